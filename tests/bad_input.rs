//! Bad input through the real program: one message a fault, exit code 2, nothing written.

mod common;

use common::{CUBE, SCENE, TestFolder, npy};

#[test]
fn missing_and_unusable_scene_files() {
    let at = TestFolder::new();
    at.refuse(&["info", "nothing.toml"], &["nothing.toml: "]);
    at.refuse(&["render", "nothing.toml"], &["nothing.toml: "]);
    std::fs::create_dir(at.path("folder")).unwrap();
    at.refuse(&["info", "folder"], &["folder"]);
    at.write("empty.toml", "");
    at.refuse(&["info", "empty.toml"], &["empty.toml", "object"]);
    at.write("binary.toml", [0_u8, 159, 146, 150, 255, 0, 1]);
    at.refuse(&["info", "binary.toml"], &["binary.toml:1:"]);
    at.write("broken.toml", "[[object]\nname = 3");
    at.refuse(&["info", "broken.toml"], &["broken.toml:1:"]);
}

#[test]
fn missing_and_unusable_meshes() {
    let at = TestFolder::new();
    at.refuse_scene("cube.obj", "nothing.obj", &["scene.toml:4:8: mesh ", "nothing.obj: cannot be read"]);
    at.write("empty.obj", "");
    at.refuse_scene("cube.obj", "empty.obj", &["empty.obj: has no faces"]);
    at.write("binary.obj", [0_u8, 200, 1, 2, 3, 255]);
    at.refuse_scene("cube.obj", "binary.obj", &["binary.obj:1:", "not text"]);
    at.write("range.obj", format!("{CUBE}f 1 2 9\nf -9 1 2\nf 0 1 2\n"));
    at.refuse_scene(
        "cube.obj",
        "range.obj",
        &["range.obj:21:7: vertex index 9", "range.obj:22:3:", "range.obj:23:3:", "1 to 8"],
    );
    at.write("nan.obj", CUBE.replacen("v 0 0 0", "v 0 nan 0", 1).replacen("v 1 0 0", "v inf 0 0", 1));
    at.refuse_scene(
        "cube.obj",
        "nan.obj",
        &["nan.obj:1:5: `nan` is not finite", "nan.obj:2:3: `inf` is not finite"],
    );
    at.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    at.refuse_scene("cube.obj", "flat.obj", &["no face has an area"]);
}

#[test]
fn what_of_a_mesh_is_not_used_is_told_and_refuses_nothing() {
    let at = TestFolder::new();
    let mut mesh = b"o W\xfcrfel\r".to_vec();
    let cube =
        CUBE.replace("v 0 0 0", "v 0 0 0 0.5").replace('\n', "\r").replace("f 1 3 4", "f 1//1 3//2 4/7/1");
    mesh.extend(cube.bytes().chain("vn 0 nan 0\rv inf 1\rf 1 2#short\r\0".bytes()));
    at.write("cube.obj", mesh);
    let notes = [
        "1 face with fewer than 3 corners",
        "1 vertex used by no face",
        "1 vertex with a fourth coordinate, not used",
        "1 statement not readable, used by no face",
        "1 normal not finite, left out",
        "1 corner naming a texture coordinate that is not there",
        "1 corner naming a normal that is not there",
        "1 byte not UTF-8, in names or comments",
        "1 zero byte at the end, left out",
    ];
    let info = at.succeed(&["info", "scene.toml"]);
    let export = at.succeed(&["export", "scene.toml", "-o", "x.json"]);
    for note in notes {
        assert!(info.stdout.contains(note), "{note}: {}", info.stdout);
        assert!(export.stderr.contains(&format!("cube.obj: {note}")), "{note}: {}", export.stderr);
    }
    at.write("cube.obj", "ply\nformat ascii 1.0\nelement vertex 3\n");
    at.refuse(&["info", "scene.toml"], &["cube.obj: the header has no end: a line `end_header` is needed"]);
    at.write("cube.obj", "PK\u{3}\u{4}");
    at.refuse(&["info", "scene.toml"], &["cube.obj: is a ZIP archive, not an OBJ file"]);
}

#[test]
fn lattices_that_collapse_to_a_point_are_named() {
    let at = TestFolder::new();
    let place = [3.0, 4.0, 5.0_f64];
    let points: Vec<f64> =
        (0..64).flat_map(|i| place.map(|x| if i % 2 == 0 { x } else { x.next_up() })).collect();
    at.write("lattice.npy", npy(&[4, 4, 4, 3], &points));
    let message = "object \"cube\": the lattice collapses to a point: all its control points";
    let edit = "twist = { axis = \"z\", angle = 90.0 }";
    at.refuse_scene(edit, "control_points = \"lattice.npy\"", &["scene.toml:5:1: ", message, "at [3, 4, 5"]);
    // those far from the object do not matter
    let bounds = "bounds = [[0, 0, 0], [9, 9, 9]]\n[[object.deform.edit]]\n";
    let spread: Vec<f64> = (0..64).flat_map(|i| if i / 16 == 3 { [1.0, 2.0, 3.0] } else { place }).collect();
    at.write("lattice.npy", npy(&[4, 4, 4, 3], &spread));
    let scene = format!("{bounds}control_points = \"lattice.npy\"");
    at.refuse_scene(&format!("[[object.deform.edit]]\n{edit}"), &scene, &[message]);
}

#[test]
fn faces_of_no_area_are_reported_skipped_and_counted() {
    let at = TestFolder::new();
    at.write("cube.obj", format!("{CUBE}f 1 2 2\nf 1 2 1\n"));
    let run = at.succeed(&["info", "scene.toml", "--json"]);
    let info: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    let object = &info["objects"][0];
    assert_eq!((&object["faces"], &object["patches"]), (&14.into(), &24.into()));
    let notes = object["notes"].to_string();
    assert!(notes.contains("of no area") && notes.contains("12") && notes.contains("13"), "{notes}");
    let run = at.succeed(&["export", "scene.toml", "-o", "x.json"]);
    assert!(run.stderr.contains("of no area"), "{}", run.stderr);
}

#[test]
fn lattices_that_cannot_be() {
    let at = TestFolder::new();
    at.refuse_scene("[2, 2, 2]", "[0, 2, 2]", &["scene.toml:7:", "0", "1 to 8"]);
    at.refuse_scene("[2, 2, 2]", "[2, 9, 2]", &["scene.toml:7:", "9", "1 to 8"]);
    at.refuse_scene("[4, 4, 4]", "[4, 2, 4]", &["scene.toml:8:"]);
    at.refuse_scene("[4, 4, 4]", "[4, 4, 4]\nbounds = [[0, 0, 0], [1, 0, 1]]", &["scene.toml:9:"]);
    at.refuse_scene(
        "[4, 4, 4]",
        "[4, 4, 4]\noutside = \"error\"\nbounds = [[0, 0, 0], [1, 1, 0.5]]",
        &["face", "bounds"],
    );
    let edit = "twist = { axis = \"z\", angle = 90.0 }";
    at.refuse_scene(edit, "weight = [1, 1, 1]\nvalue = 0", &["scene.toml:11:"]);
    at.refuse_scene(edit, "weight = [1, 1, 1]\nvalue = -2.0", &["scene.toml:11:"]);
    at.refuse_scene(edit, "move = [4, 1, 1]\nby = [0, 0, 1]", &["scene.toml:10:", "4"]);
    at.refuse_scene(edit, "move = [1, 1, 1]\nby = [0, nan, 1]", &["scene.toml:11:"]);
}

#[test]
fn lattice_files_of_the_wrong_shape() {
    let at = TestFolder::new();
    let edit = "twist = { axis = \"z\", angle = 90.0 }";
    let file = "control_points = \"lattice.npy\"";
    at.refuse_scene(edit, file, &["scene.toml:10:", "lattice.npy", "cannot be read"]);
    at.write("lattice.npy", npy(&[4, 4, 3, 3], &[0.5; 144]));
    at.refuse_scene(edit, file, &["lattice.npy", "[4, 4, 3, 3]", "(4, 4, 4, 3)"]);
    at.write("lattice.npy", npy(&[4, 4, 4, 3], &[f64::NAN; 192]));
    at.refuse_scene(edit, file, &["lattice.npy", "[0, 0, 0]", "not finite"]);
    at.write("lattice.npy", npy(&[4, 4, 4, 4], &[0.0; 256]));
    at.refuse_scene(edit, file, &["lattice.npy", "weight 0"]);
    at.write("lattice.npy", "nonsense");
    at.refuse_scene(edit, file, &["lattice.npy", "not a .npy file"]);
}

#[test]
fn unknown_names() {
    let at = TestFolder::new();
    at.refuse_scene("degree", "degre", &["scene.toml:7:1: unknown key", "did you mean \"degree\""]);
    at.refuse_scene("\"ffd\"", "\"fdd\"", &["scene.toml:6:8:", "did you mean \"ffd\""]);
    at.refuse_scene("name = \"cube\"", "name = \"cube\"\nmaterial = \"clay\"", &["scene.toml:4:12:", "clay"]);
    for (table, parts) in [
        ("[[material]]\nname = \"m\"\ntype = \"difuse\"", ["unknown material", "diffuse"]),
        ("[[light]]\ntype = \"constnt\"", ["unknown light", "constant"]),
        ("[render]\nintegrator = \"pth\"", ["unknown integrator", "path"]),
        ("[render]\naovs = [\"dept\"]", ["unknown aov", "depth"]),
        ("[camera]\norigin = [0,0,1]\ntarget = [0,0,1]", ["origin", "target"]),
        ("[film]\nsize = [0, 5]", ["size", "1"]),
        ("[film]\nsize = [64, 64]\ncrop = [60, 0, 8, 8]", ["crop", "64"]),
    ] {
        at.write("scene.toml", format!("{table}\n{SCENE}"));
        at.refuse(&["info", "scene.toml"], &[parts[0], parts[1], "scene.toml:"]);
    }
}

#[test]
fn all_faults_come_at_once() {
    let at = TestFolder::new();
    at.write("bad.obj", "v 0 0 x\nf 1 2 3\n");
    let second = SCENE.replace("\"cube\"", "\"other\"").replace("cube.obj", "bad.obj");
    at.write("scene.toml", format!("{SCENE}{second}").replacen("cube.obj", "nothing.obj", 1));
    at.refuse(&["info", "scene.toml"], &["nothing.obj", "bad.obj:1:7", "bad.obj:2:5"]);
    at.write("scene.toml", SCENE.replace("degree = [2, 2, 2]", "degree = [9, 2, 2]\ncolour = 3"));
    at.refuse(&["info", "scene.toml"], &["scene.toml:7:", "scene.toml:8:1"]);
}

#[test]
fn bad_flags() {
    let at = TestFolder::new();
    let render = |more: &[&str], parts: &[&str]| {
        let arguments: Vec<_> = ["render", "scene.toml"].iter().chain(more).copied().collect();
        at.refuse(&arguments, parts);
    };
    render(&["--size", "0x10"], &["--size"]);
    render(&["--size", "10"], &["--size"]);
    render(&["--spp", "0"], &["--spp"]);
    render(&["--crop", "0,0,600,1"], &["512"]);
    render(&["--max-depth", "-2"], &["--max-depth"]);
    render(&["--integrator", "pth"], &["path"]);
    render(&["--method", "exat"], &["exact"]);
    render(&["--method", "triangular:2"], &["--method", "write triangular alone"]);
    render(&["--threads", "0"], &["--threads"]);
    render(&["--nonsense"], &["--nonsense"]);
    render(&["-o", "nowhere/x.exr"], &["nowhere"]);
    render(&["-o", "x.jpg"], &[".exr", ".png"]);
    at.refuse(&["export", "scene.toml", "-o", "x.stl"], &[".json"]);
    at.refuse(&["export", "scene.toml", "-o", "nowhere/x.json"], &["nowhere"]);
    at.refuse(&["info", "scene.toml", "--stats"], &["--stats"]);
    at.refuse(&["nonsense"], &["nonsense"]);
    at.refuse(&[], &["Usage"]);
}

#[test]
fn triangular_patches_take_one_lattice_at_most() {
    let at = TestFolder::new();
    let lattice = SCENE.split_once("[[object.deform]]").unwrap().1;
    at.write("scene.toml", format!("{SCENE}[[object.deform]]{lattice}"));
    at.refuse(
        &["info", "scene.toml", "--method", "triangular"],
        &["scene.toml:11:", "object \"cube\"", "one lattice at most", "\"exact\""],
    );
    at.succeed(&["info", "scene.toml"]);
}

#[test]
fn bad_rays() {
    let at = TestFolder::new();
    let trace = |parts: &[&str]| {
        at.refuse(&["trace", "scene.toml", "--rays", "rays.npy", "-o", "hits.npz"], parts);
    };
    trace(&["rays.npy: cannot be read"]);
    at.write("rays.npy", npy(&[2, 5], &[1.0; 10]));
    trace(&["rays.npy", "[2, 5]", "(N, 6)"]);
    at.write("rays.npy", npy(&[2, 6], &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]));
    trace(&["rays.npy: row 1: the direction"]);
    at.write("rays.npy", npy(&[1, 6], &[1.0, f64::NAN, 1.0, 1.0, 1.0, 1.0]));
    trace(&["rays.npy: row 0: not finite"]);
    at.write("rays.npy", "");
    trace(&["rays.npy", "not a .npy file"]);
}

#[test]
fn extensions_without_values_or_bounds() {
    let at = TestFolder::new();
    let scene = |mode: &str, bound: &str, h: &str| {
        format!(
            "[[object]]\nname = \"a\"\nsurface = {{ type = \"sphere\", radius = 1 }}\n[[object.deform]]\n\
             type = \"extension\"\n{mode}\n[[object.deform.region]]\nbound = \"{bound}\"\nindex = 2\nh = {h}\n"
        )
    };
    let operator = "mode = \"operator\"";
    let vanishing = "mode = \"field\"\nfield = [\"u-0.5\", \"v-0.5\", \"0\"]";
    for (mode, bound, h, message) in [
        (
            "mode = \"field\"\nfield = \"normal\"",
            "-1",
            "0.3",
            "4:1: object \"a\": at u = 0, v = 0 the surface has no normal",
        ),
        (
            operator,
            "(u-0.5)^2 + (v-0.5)^2 - 1",
            "2000",
            "the point is not finite: the exponent h phi^n is too large",
        ),
        (operator, "ln(u-0.5)", "1", "or an expression has no value"),
        (operator, "sqrt(u) - 0.5", "0.2", "the surface is not smooth enough to be bounded"),
        (vanishing, "-1", "0.2", "at u = 0.5, v = 0.5 the point is not finite"),
        (operator, "u + w", "1", "8:9: bound \"u + w\", column 5: unknown name \"w\""),
    ] {
        at.write("a.toml", scene(mode, bound, h));
        at.refuse(&["info", "a.toml"], &[message]);
    }
    // a point where it is not smooth is covered
    at.write("a.toml", scene(operator, "sqrt((u-0.5)^2+(v-0.5)^2) - 0.3", "2"));
    at.succeed(&["info", "a.toml"]);
    at.write("a.toml", scene(operator, "1 + cos(pi*u)", "1"));
    let run = at.succeed(&["export", "a.toml", "-o", "x.json"]);
    assert!(run.stderr.contains("region 1 is empty"), "{}", run.stderr);
}
