//! Direct manipulation through the real program.

mod common;

use common::{TestFolder, npy};
use serde_json::Value;

const HEAD: &str = r#"
[camera]
origin = [0.5, -3.0, 0.6]
target = [0.5, 0.5, 0.5]
fov = 30.0
[film]
size = [80, 60]
[[object]]
name = "cube"
mesh = "cube.obj"
[[object.deform]]
type = "ffd"
degree = [3, 3, 3]
points = [5, 6, 5]
[[object.deform.edit]]
twist = { axis = "z", angle = 25.0 }
"#;

/// Sources on the cube's surface, and where they go.
const DRAGS: [[[f64; 3]; 2]; 4] = [
    [[0.3, 0.0, 0.4], [0.25, -0.2, 0.45]],
    [[1.0, 0.5, 0.5], [1.2, 0.6, 0.5]],
    [[0.4, 0.6, 1.0], [0.35, 0.7, 1.3]],
    [[1.0, 1.0, 1.0], [1.1, 1.2, 1.15]],
];

fn edit(drags: &[[[f64; 3]; 2]], more: &str) -> String {
    let list = |i: usize| format!("{:?}", drags.iter().map(|drag| drag[i]).collect::<Vec<_>>());
    format!("{HEAD}[[object.deform.edit]]\ndrag = {}\nto = {}\n{more}\n", list(0), list(1))
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn the_traced_surface_passes_through_every_target() {
    let at = TestFolder::new();
    at.write("scene.toml", edit(&DRAGS, ""));
    let report = json(&at.succeed(&["drags", "scene.toml", "--json"]).stdout);
    let edits = &report["objects"][0]["edits"];
    assert_eq!((edits[0]["edit"].as_u64(), edits[0]["rank"].as_u64()), (Some(2), Some(4)));
    let drags = edits[0]["drags"].as_array().expect("a list");
    for drag in drags {
        assert!(drag["residual"].as_f64().expect("a number") < 2e-12, "{drag}");
        assert!(drag["decomposed"].is_array());
    }
    assert!(edits[0]["control_points"].as_array().expect("a list").len() > 40);
    // rays through the targets, from several sides
    let ways = [[0.3, 0.5, -0.8], [-0.6, 0.7, 0.2], [0.1, -0.2, 0.9]];
    let rays = |way: [f64; 3]| {
        DRAGS.iter().flat_map(move |[_, target]| (0..3).map(move |i| target[i] - 2.0 * way[i]).chain(way))
    };
    let numbers: Vec<f64> = ways.into_iter().flat_map(rays).collect();
    at.write("rays.npy", npy(&[12, 6], &numbers));
    at.succeed(&["trace", "scene.toml", "--rays", "rays.npy", "-o", "hits.npz", "--all"]);
    let archive = at.read("hits.npz");
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(archive)).expect("an archive");
    let mut array = |name: &str| {
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut archive.by_name(name).expect("the array"), &mut bytes)
            .expect("readable");
        bytes
    };
    let t = npyz::NpyFile::new(&array("t.npy")[..]).expect("npy").into_vec::<f64>().expect("doubles");
    let offsets =
        npyz::NpyFile::new(&array("offsets.npy")[..]).expect("npy").into_vec::<i64>().expect("integers");
    for (ray, ends) in offsets.windows(2).enumerate() {
        let ends = [ends[0], ends[1]].map(|end| usize::try_from(end).expect("a count"));
        let hits = &t[ends[0]..ends[1]];
        let off = hits.iter().map(|t| (t - 2.0).abs()).fold(f64::INFINITY, f64::min);
        // the last is a corner of the cube, which a ray may pass beside by rounding
        assert!(off < 1e-11 || ray % 4 == 3, "ray {ray} misses its target by {off:e}");
    }
}

#[test]
fn the_solved_lattice_can_be_exported_and_given_back() {
    let at = TestFolder::new();
    at.write("scene.toml", edit(&DRAGS, ""));
    at.succeed(&["export", "scene.toml", "-o", "lattice.npy"]);
    at.write("again.toml", format!("{HEAD}[[object.deform.edit]]\ncontrol_points = \"lattice.npy\"\n"));
    at.succeed(&["export", "scene.toml", "-o", "a.json"]);
    at.succeed(&["export", "again.toml", "-o", "b.json"]);
    assert!(at.read("a.json") == at.read("b.json"));
    at.write("scene.toml", edit(&[[[0.5; 3], [0.55, 0.44, 0.53]]], "using = \"weights\""));
    let report = json(&at.succeed(&["drags", "scene.toml", "--json"]).stdout);
    assert_eq!(report["objects"][0]["edits"][0]["using"], "weights");
    let changed = report["objects"][0]["edits"][0]["weights"].as_array().expect("a list");
    assert!(!changed.is_empty() && changed.iter().all(|point| point["weight"].as_f64() > Some(0.0)));
}

#[test]
fn points_can_be_picked_in_the_picture() {
    let at = TestFolder::new();
    let scene = format!("{HEAD}[[object.deform.edit]]\npick = [40.5, 30.5]\nto = [0.5, -0.4, 0.5]\n");
    at.write("scene.toml", &scene);
    let report = json(&at.succeed(&["drags", "scene.toml", "--json"]).stdout);
    let drag = &report["objects"][0]["edits"][0]["drags"][0];
    // the point lay on the ray through that place, on the front face
    let before: Vec<f64> =
        drag["before"].as_array().expect("a list").iter().filter_map(Value::as_f64).collect();
    let depth = before[1] + 3.0;
    assert!(
        (before[0] - 0.5).abs() < 0.02 * depth && (before[2] - 0.6 + 0.1 * depth / 3.5).abs() < 0.02 * depth
    );
    assert!(drag["source"][1].as_f64().expect("a number").abs() < 1e-12, "{drag}");
    assert!(drag["residual"].as_f64() < Some(2e-12));
    at.write("scene.toml", scene.replace("[40.5, 30.5]", "[1, 1]"));
    at.refuse(&["drags", "scene.toml"], &["pick 1, 1: the camera sees nothing of the object there"]);
    let start = HEAD.find("[[object]]").expect("an object");
    at.write("scene.toml", scene.replace(&HEAD[..start], ""));
    at.refuse(&["drags", "scene.toml"], &["pick needs a [camera]"]);
}

#[test]
fn drags_that_cannot_be_met_are_refused_by_number() {
    let at = TestFolder::new();
    let conflict = [DRAGS[0], DRAGS[1], [DRAGS[0][0], [0.3, -0.3, 0.4]]];
    at.write("scene.toml", edit(&conflict, ""));
    let parts =
        ["scene.toml:18:8", "drags 1 and 3 cannot all be met: 3 drags have rank 2", "--least-squares"];
    at.refuse(&["info", "scene.toml"], &parts);
    let run = at.succeed(&["info", "scene.toml", "--least-squares"]);
    assert!(run.stdout.contains("patches"), "{}", run.stdout);
    let run = at.succeed(&["drags", "scene.toml", "--least-squares"]);
    assert!(run.stderr.contains("edit 2: the drags are a compromise, off by up to 6."), "{}", run.stderr);
    at.write("scene.toml", edit(&[[[0.5, 0.5, 1.5], [0.0; 3]]], ""));
    at.refuse(&["info", "scene.toml"], &["drag 1: its source [0.5, 0.5, 1.5] is outside the lattice's box"]);
    at.write(
        "scene.toml",
        edit(&DRAGS[..1], "").replace("points = [5, 6, 5]", "points = [9, 9, 9]\nhold = 3"),
    );
    at.refuse(
        &["info", "scene.toml"],
        &["drag 1: its source [0.3, 0, 0.4] is where hold keeps all control points"],
    );
    at.write("scene.toml", edit(&[[[0.5; 3], [3.0, 0.5, 0.5]]], "using = \"weights\""));
    at.refuse(
        &["info", "scene.toml"],
        &["drag 1: its target [3, 0.5, 0.5] lies outside the hull of the active control points"],
    );
    // 8 control points, 9 drags
    let many: Vec<_> = (0..9)
        .map(|i| {
            let p = [
                0.1 + 0.09 * f64::from(i),
                0.3 + 0.05 * f64::from(i * i % 7),
                0.2 + 0.07 * f64::from(i * i % 11),
            ];
            [p, [p[0], p[1] + 0.1 * f64::from(i % 3), p[2]]]
        })
        .collect();
    let crowded = edit(&many, "")
        .replace("degree = [3, 3, 3]\npoints = [5, 6, 5]", "degree = [1, 1, 1]\npoints = [2, 2, 2]");
    at.write("scene.toml", crowded);
    at.refuse(&["info", "scene.toml"], &["9 drags have rank 8"]);
}

#[test]
fn lattices_and_drags_are_drawn_over_previews() {
    let at = TestFolder::new();
    at.write("scene.toml", edit(&DRAGS, ""));
    let render = ["render", "scene.toml", "--spp", "1", "-o"];
    at.succeed(&[&render[..], &["plain.png"]].concat());
    at.succeed(&[&render[..], &["shown.png", "--show", "lattice,drags"]].concat());
    assert!(at.read("plain.png") != at.read("shown.png"));
    at.refuse(
        &[&render[..], &["a.exr", "--show", "lattice"]].concat(),
        &["--show draws over previews alone"],
    );
}
