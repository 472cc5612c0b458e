//! Materials that mesh files name (`usemtl`), through the library and the real program.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::TestFolder;
use glam::DVec3;
use trimray::scene::{BuiltScene, parse_scene};
use trimray::shade::{Material, PrincipledInterface, TextureSource};
use trimray::trace::Ray;

/// Two squares side by side and a third without a material.
const SQUARES: &str = "\
mtllib lib.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nv 3 0 0\nv 3 1 0\n\
f 5 7 8 6\nusemtl red clay\nf 1 2 3 4\nusemtl shiny\nf 2 5 6 3\n";

const LIBRARY: &str =
    "newmtl red clay\nKd 0.8 0.1 0.2\nKe 1 1 1\nnewmtl shiny\nKd 0.3 0.3 0.3\nKs 0.5 0.5 0.5\nNs 98\n";

fn folder(object: &str) -> TestFolder {
    let at = TestFolder::new();
    at.write("squares.obj", SQUARES);
    at.write("lib.mtl", LIBRARY);
    let scene = format!(
        "[[material]]\nname = \"clay\"\ntype = \"diffuse\"\nreflectance = [0.1, 0.2, 0.3]\n\
         [[object]]\nname = \"squares\"\nmesh = \"squares.obj\"\n{object}"
    );
    at.write("squares.toml", scene);
    at
}

fn built(at: &TestFolder) -> BuiltScene {
    parse_scene(&at.path("squares.toml")).unwrap().build().unwrap()
}

/// The colour of the square that a ray from above meets at x.
fn colour(scene: &BuiltScene, x: f64) -> Option<DVec3> {
    let hit = scene.traced.closest_hit(&Ray::new(DVec3::new(x, 0.5, 1.0), DVec3::NEG_Z)).unwrap();
    let materials = &scene.materials[0];
    materials.iter().nth(materials.index(hit.face)).unwrap().0.uniform_colour()
}

#[test]
fn faces_have_the_materials_of_the_library() {
    let scene = built(&folder(""));
    assert_eq!(colour(&scene, 0.5), Some(DVec3::new(0.8, 0.1, 0.2)));
    assert_eq!(colour(&scene, 1.5), Some(DVec3::splat(0.3)));
    assert_eq!(colour(&scene, 2.5), Some(DVec3::splat(0.5)), "the default");
    let (shiny, _) = scene.materials[0].iter().nth(2).unwrap();
    let Material::Principled(shiny) = shiny else { panic!("Ks makes a highlight: {shiny:?}") };
    // alpha = sqrt(2 / (98 + 2))
    let alpha = (0.02_f64).sqrt();
    assert_eq!(shiny.roughness, TextureSource::from(alpha.sqrt()));
    assert_eq!(scene.materials[0].emission(), [DVec3::ZERO, DVec3::ONE, DVec3::ZERO]);
    assert!(scene.light_settings.is_empty(), "a scene that shines has no light of the first view");
}

#[test]
fn the_scene_file_comes_before_the_library() {
    let whole = built(&folder("material = \"clay\"\n"));
    assert!([0.5, 1.5, 2.5].iter().all(|&x| colour(&whole, x) == Some(DVec3::new(0.1, 0.2, 0.3))));
    let by_name = built(&folder("materials = { \"red clay\" = \"clay\" }\n"));
    assert_eq!(colour(&by_name, 0.5), Some(DVec3::new(0.1, 0.2, 0.3)));
    assert_eq!(colour(&by_name, 1.5), Some(DVec3::splat(0.3)));
}

#[test]
fn what_a_library_lacks_is_told() {
    let at = folder("");
    at.write("lib.mtl", "newmtl shiny\nKd 0.1 0.1 0.1\nmap_Kd nowhere.png\n");
    let scene = built(&at);
    assert_eq!(colour(&scene, 0.5), Some(DVec3::splat(0.5)));
    assert_eq!(colour(&scene, 1.5), Some(DVec3::splat(0.1)), "no texture coordinates, no picture");
    let notes = scene.objects[0].warnings.join("\n");
    assert!(notes.contains("red clay") && notes.contains("in no library"), "{notes}");
    assert!(notes.contains("no texture coordinates"), "{notes}");
    std::fs::remove_file(at.path("lib.mtl")).unwrap();
    let run = at.succeed(&["info", "squares.toml"]);
    assert!((run.stdout + &run.stderr).contains("lib.mtl"), "a library that is not there is told");
}

#[test]
fn wrong_names_are_refused() {
    folder("materials = { red = \"clay\" }\n").refuse(
        &["info", "squares.toml"],
        &["squares.toml:8:", "has no material \"red\" (it has: red clay, shiny)"],
    );
    folder("materials = { shiny = \"cly\" }\n").refuse(
        &["info", "squares.toml"],
        &["squares.toml:8:", "unknown material \"cly\"", "did you mean \"clay\""],
    );
    folder("material = \"clay\"\nmaterials = { shiny = \"clay\" }\n")
        .refuse(&["info", "squares.toml"], &["either a material or materials by name"]);
}

#[test]
fn each_material_is_a_shape_of_its_own_for_mitsuba() {
    let at = folder("");
    at.succeed(&["export", "squares.toml", "--format", "mitsuba", "-o", "out"]);
    let text = String::from_utf8(at.read("out/scene.xml")).unwrap();
    assert_eq!(text.matches("<shape type=\"ply\">").count(), 3, "{text}");
    assert_eq!(text.matches("<bsdf type=\"principled\"").count(), 1, "{text}");
    assert!(text.contains("0.8, 0.1, 0.2") || text.contains("0.8 0.1 0.2"), "{text}");
}

/// The mean of a picture's red, by the scene's own seed.
fn mean_red(at: &TestFolder, scene: &str) -> f64 {
    at.write("lit.toml", scene);
    at.succeed(&["render", "lit.toml", "-o", "lit.exr", "-q"]);
    let picture = trimray::film::read_picture(&at.path("lit.exr"), true).unwrap();
    picture.pixels.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / picture.pixels.len() as f64
}

/// A floor under a lamp whose other half is dark; the camera sees the floor alone.
const SETTINGS: &str = "[camera]\norigin = [0.5, 0.5, 0.8]\ntarget = [0.5, 0.5, 0]\nup = [0, 1, 0]\nfov = 50\n\
    [film]\nsize = [16, 16]\n[render]\nspp = 64\nintegrator = \"path\"\nmax_depth = 2\n";

#[test]
fn faces_that_emit_light_the_scene_as_an_object_would() {
    let lamp = "v 0 0 1\nv 0.5 0 1\nv 0.5 1 1\nv 0 1 1\nv 1 0 1\nv 1 1 1\n";
    let floor = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let at = TestFolder::new();
    at.write("lamp.mtl", "newmtl lamp\nKd 0 0 0\nKe 4 2 1\nnewmtl dark\nKd 0 0 0\n");
    at.write(
        "by_face.obj",
        format!("mtllib lamp.mtl\n{lamp}usemtl lamp\nf 4 3 2 1\nusemtl dark\nf 3 6 5 2\n"),
    );
    at.write("lit_half.obj", format!("{lamp}f 4 3 2 1\n"));
    at.write("dark_half.obj", format!("{lamp}f 3 6 5 2\n"));
    at.write("floor.obj", format!("{floor}f 1 2 3 4\n"));
    let floor = "[[object]]\nname = \"floor\"\nmesh = \"floor.obj\"\n";
    let by_face =
        mean_red(&at, &format!("{SETTINGS}{floor}[[object]]\nname = \"lamp\"\nmesh = \"by_face.obj\"\n"));
    let by_object = mean_red(
        &at,
        &format!(
            "{SETTINGS}{floor}[[object]]\nname = \"lamp\"\nmesh = \"lit_half.obj\"\n\
             [[object]]\nname = \"dark\"\nmesh = \"dark_half.obj\"\n\
             [[light]]\ntype = \"area\"\nshape = \"object\"\nobject = \"lamp\"\nradiance = [4, 2, 1]\n"
        ),
    );
    assert!(by_object > 0.05, "{by_object}");
    assert!((by_face - by_object).abs() < 1e-6 * by_object, "{by_face} for {by_object}");
}

#[test]
fn what_is_not_opaque_lets_light_through() {
    let at = folder("");
    at.write("lib.mtl", "newmtl red clay\nKd 1 1 1\nd 0.25\nNi 1.3\nnewmtl shiny\nTr 0.5\n");
    let scene = built(&at);
    let expected = [(1, 0.75, 1.3), (2, 0.5, 1.5)];
    for (index, transmission, eta) in expected {
        let (material, _) = scene.materials[0].iter().nth(index).unwrap();
        let Material::Principled(glass) = material else { panic!("d makes glass: {material:?}") };
        assert_eq!(glass.spec_trans, TextureSource::from(transmission));
        assert_eq!(glass.interface, PrincipledInterface::Eta(eta));
    }
}

#[test]
fn libraries_and_their_pictures_are_not_overwritten() {
    let at = folder("");
    for command in [
        ["export", "squares.toml", "-o", "lib.obj"],
        ["trace", "squares.toml", "-o", "lib.obj"],
        ["render", "squares.toml", "-o", "picture.png"],
    ] {
        at.write("lib.obj", "newmtl red clay\nmap_Kd picture.png\n");
        at.write("picture.png", "a picture");
        at.write("squares.obj", SQUARES.replace("lib.mtl", "lib.obj"));
        at.write("rays.npy", common::npy(&[0, 6], &[]));
        let mut command = command.to_vec();
        if command[0] == "trace" {
            command.extend(["--rays", "rays.npy"]);
        }
        at.refuse(&command, &["is read by this command"]);
        assert_eq!(at.read("picture.png"), b"a picture");
        assert!(at.read("lib.obj").starts_with(b"newmtl"));
    }
}

#[test]
fn shining_faces_are_emitters_for_mitsuba() {
    let at = folder("");
    at.succeed(&["export", "squares.toml", "--format", "mitsuba", "-o", "out"]);
    let text = String::from_utf8(at.read("out/scene.xml")).unwrap();
    assert_eq!(text.matches("<emitter type=\"area\"").count(), 1, "{text}");
}
