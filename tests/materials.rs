//! Materials that mesh files name (`usemtl`), through the library and the real program.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::TestFolder;
use glam::DVec3;
use trimray::scene::{BuiltScene, parse_scene};
use trimray::shade::{Material, TextureSource};
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
    assert!(scene.objects[0].warnings.iter().any(|note| note.contains("red clay") && note.contains("Ke")));
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
