//! Triangles and Mitsuba scenes through the real program.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::collections::HashMap;
use std::fs;

use common::{SCENE, TestFolder};

const LIT: &str = "\
[camera]\norigin = [3, -4, 2]\ntarget = [0.5, 0.5, 0.5]\nfov = 35.0\nfov_axis = \"smaller\"
[film]\nsize = [40, 30]\ncrop = [4, 3, 20, 10]
[render]\nspp = 16\nmax_depth = -1\nhide_emitters = true\naovs = [\"depth\", \"rest\", \"normal\"]
[[material]]\nname = \"clay & <co>\"\ntype = \"diffuse\"\ntwo_sided = false
[[light]]\ntype = \"point\"\nposition = [1, 2, 3]\nintensity = [3, 2, 1]
[[light]]\ntype = \"constant\"\nradiance = 0.5
[[light]]\ntype = \"area\"\nshape = \"rectangle\"\nto_world = [{ translate = [0, 0, 5] }]
";

/// Names in a folder, sorted.
fn names(folder: &std::path::Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// The vertices and triangles of an OBJ file.
fn read_obj(text: &str) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let words: Vec<_> = line.split(' ').collect();
        match words[0] {
            "v" => vertices.push([1, 2, 3].map(|i| words[i].parse().unwrap())),
            "f" => triangles.push([1, 2, 3].map(|i| {
                let vertex = words[i].split('/').next().unwrap();
                vertex.parse::<usize>().unwrap() - 1
            })),
            _ => {}
        }
    }
    (vertices, triangles)
}

/// The number of edges, each of which two triangles have in opposite directions.
fn closed_edges(triangles: &[[usize; 3]]) -> usize {
    let mut edges: HashMap<[usize; 2], u32> = HashMap::new();
    for [a, b, c] in triangles {
        for edge in [[*a, *b], [*b, *c], [*c, *a]] {
            *edges.entry(edge).or_default() += 1;
        }
    }
    assert!(edges.iter().all(|([a, b], count)| *count == 1 && edges.contains_key(&[*b, *a])));
    edges.len() / 2
}

/// The texture coordinates of surfaces jump at their seams, and have all values at their poles.
#[test]
fn vertices_are_there_once_where_texture_coordinates_jump() {
    let at = TestFolder::new();
    for (surface, characteristic) in [
        ("{ type = \"sphere\", radius = 1 }", 2),
        ("{ type = \"torus\", axis = [0, 0, 1], major_radius = 2, minor_radius = 0.5 }", 0),
    ] {
        at.write("surface.toml", format!("[[object]]\nname = \"s\"\nsurface = {surface}\n"));
        at.succeed(&["export", "surface.toml", "-o", "s.obj", "--tolerance", "0.05"]);
        let text = String::from_utf8(at.read("s.obj")).unwrap();
        let (vertices, triangles) = read_obj(&text);
        assert_eq!(vertices.len() + triangles.len(), closed_edges(&triangles) + characteristic);
        assert!(text.matches("\nvt ").count() > vertices.len(), "more texture coordinates than vertices");
    }
}

#[test]
fn obj_files_are_closed_solids_within_the_tolerance() {
    let at = TestFolder::new();
    let mut before = 0;
    for tolerance in ["1e-2", "1e-3", "1e-4"] {
        let run = at.succeed(&["export", "scene.toml", "-o", "x.obj", "--tolerance", tolerance]);
        let within = run.stderr.split("within ").nth(1).unwrap().split(' ').next().unwrap();
        assert!(within.parse::<f64>().unwrap() <= tolerance.parse().unwrap(), "{}", run.stderr);
        assert!(run.stdout.is_empty());
        let (vertices, triangles) = read_obj(&String::from_utf8(at.read("x.obj")).unwrap());
        // Euler: a solid without holes
        assert_eq!(vertices.len() + triangles.len(), closed_edges(&triangles) + 2);
        assert!(triangles.len() > before);
        before = triangles.len();
    }
    at.succeed(&["export", "scene.toml", "-o", "y.obj", "--level", "0", "--quiet"]);
    let (_, coarse) = read_obj(&String::from_utf8(at.read("y.obj")).unwrap());
    at.succeed(&["export", "scene.toml", "-o", "y.ply", "--level", "2"]);
    let header = String::from_utf8_lossy(&at.read("y.ply")[..200]).into_owned();
    assert!(header.contains(&format!("element face {}\n", 16 * coarse.len())), "{header}");
    assert!(header.contains("property double x"), "{header}");
}

#[test]
fn mitsuba_scenes_have_what_the_scene_file_says() {
    let at = TestFolder::new();
    at.write("scene.toml", format!("{LIT}{SCENE}").replace("mesh =", "material = \"clay & <co>\"\nmesh ="));
    let run = at.succeed(&["export", "scene.toml", "--format", "mitsuba", "-o", "out", "--level", "1"]);
    assert!(run.stderr.contains("cube: ") && run.stdout.is_empty());
    assert_eq!(names(&at.path("out")), ["meshes", "scene.xml"]);
    assert_eq!(names(&at.path("out/meshes")), ["0_cube.ply"]);
    let mesh = at.read("out/meshes/0_cube.ply");
    assert!(String::from_utf8_lossy(&mesh[..200]).contains("property float x"), "as Mitsuba keeps it");
    let xml = String::from_utf8(at.read("out/scene.xml")).unwrap();
    for part in [
        r#"<integrator type="aov">"#,
        r#"<string name="aovs" value="depth:depth,normal:sh_normal"/>"#,
        r#"<integer name="max_depth" value="-1"/>"#,
        r#"<boolean name="hide_emitters" value="true"/>"#,
        r#"<string name="fov_axis" value="smaller"/>"#,
        r#"<lookat origin="3.0 -4.0 2.0" target="0.5 0.5 0.5" up="0.0 0.0 1.0"/>"#,
        r#"<integer name="crop_offset_x" value="4"/>"#,
        r#"<integer name="crop_height" value="10"/>"#,
        r#"<integer name="sample_count" value="16"/>"#,
        r#"<bsdf type="diffuse" id="material_0_clay____co_">"#,
        r#"<rgb name="intensity" value="3.0 2.0 1.0"/>"#,
        r#"<emitter type="constant">"#,
        r#"<shape type="rectangle">"#,
        r#"<string name="filename" value="meshes/0_cube.ply"/>"#,
        r#"<ref id="material_0_clay____co_"/>"#,
        r#"<boolean name="face_normals" value="true"/>"#,
    ] {
        assert!(xml.contains(part), "{part} is not in:\n{xml}");
    }
    assert!(!xml.contains("twosided"));
}

#[test]
fn folders_of_others_are_refused_and_own_ones_replaced() {
    let at = TestFolder::new();
    let export = ["export", "scene.toml", "--format", "mitsuba", "-o", "out", "--quiet"];
    at.succeed(&export);
    at.write("out/scene.exr", "Mitsuba's picture");
    at.write("out/meshes/old.ply", "");
    let first = at.read("out/scene.xml");
    let run = at.succeed(&export);
    assert!(run.stderr.is_empty(), "{}", run.stderr);
    assert_eq!(at.read("out/scene.xml"), first);
    assert_eq!(names(&at.path("out")), ["meshes", "scene.exr", "scene.xml"]);
    assert_eq!(names(&at.path("out/meshes")), ["0_cube.ply"], "nothing is left of the old one");
    assert_eq!(at.files(), ["cube.obj", "out", "scene.toml"]);
    at.write("out/scene.xml", "<scene/>");
    at.refuse(&export, &["out: is not empty, and not an export of this program"]);
    assert_eq!(at.read("out/scene.xml"), b"<scene/>");
    let to = |place| ["export", "scene.toml", "--format", "mitsuba", "-o", place];
    at.refuse(&to("cube.obj"), &["cube.obj: is a file"]);
    at.refuse(&to("no/where"), &["there is no folder no"]);
}

#[test]
fn wrong_flags_are_refused() {
    let at = TestFolder::new();
    let with = |flags: &[&str], parts: &[&str]| {
        at.refuse(&[&["export", "scene.toml"], flags].concat(), parts);
    };
    with(&["-o", "x"], &["unknown kind of export", ".obj", "--format mitsuba"]);
    with(&["-o", "x.json", "--level", "1"], &["exact patches"]);
    for bad in ["0", "-1", "nan", "inf", "much"] {
        with(&["-o", "x.obj", "--tolerance", bad], &[]);
    }
    with(&["-o", "x.obj", "--tolerance", "1", "--level", "1"], &["cannot be used with"]);
    with(&["-o", "x.obj", "--level", "12"], &["cube", "more than", "triangles", "lower level"]);
    with(&["-o", "x.obj", "--tolerance", "1e-15"], &["cube", "larger tolerance"]);
    with(&["-o", "x.obj", "--format", "stl"], &["mitsuba"]);
}
