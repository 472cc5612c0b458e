//! Whatever a file holds, the real program ends within seconds and within its memory, with a message if it ends badly.
//!
//! Every run is under a limit of address space and of time. `TRIMRAY_MUTATIONS=N` runs so many mutated inputs (240 without
//! it), `TRIMRAY_SEED=S` others; a fault's seed is printed with it, and the input is kept in the folder that is named.

mod common;
mod mutation;

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use common::{CUBE, Run, SCENE, TestFolder, npy, repository};
use mutation::{Random, mutated_bytes, mutated_text};

/// Seconds of two processors that any input may take; debug builds are slower.
const SECONDS: u64 = if cfg!(debug_assertions) { 60 } else { 10 };

/// Seconds after which a run ends in any case, however busy the machine is.
const PATIENCE: u64 = 12 * SECONDS;

/// Address space of a run in kilobytes: the memory limit that is passed, the program and what its threads reserve.
const ADDRESS_SPACE: u64 = 3 << 20;

/// Runs the program in a folder under both limits; the memory it may take is 1 GB unless the arguments say otherwise.
fn bounded(folder: &Path, arguments: &[&str]) -> Run {
    let mut arguments = arguments.to_vec();
    if !arguments.contains(&"--max-memory") {
        arguments.extend(["--max-memory", "1G"]);
    }
    let processor = 2 * SECONDS;
    let shell = format!(
        "ulimit -v {ADDRESS_SPACE} && ulimit -t {processor} && exec timeout -s KILL {PATIENCE} \"$@\""
    );
    let output = Command::new("sh")
        .args(["-c", &shell, "sh", env!("CARGO_BIN_EXE_trimray")])
        .args(&arguments)
        .args(["--threads", "2"].iter().filter(|_| arguments[0] != "diff"))
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .expect("a shell");
    Run::of(output)
}

/// What is wrong with a run's end, if anything.
fn fault(run: &Run, codes: &[i32]) -> Option<String> {
    let is_told = run.code == 0 || !run.stderr.trim().is_empty() || !run.stdout.trim().is_empty();
    let is_well = codes.contains(&run.code) && is_told && !run.stderr.contains("panicked");
    (!is_well).then(|| format!("{run:?}"))
}

/// Demands that commands on a scene end well.
fn ends_well(at: &TestFolder, scene: &str, commands: &[&[&str]]) {
    at.write("hostile.toml", scene);
    for command in commands {
        let made = bounded(&at.path("."), command);
        if let Some(fault) = fault(&made, &[0, 1, 2]) {
            panic!("trimray {command:?} of\n{scene}\n{fault}");
        }
    }
}

const INFO: &[&str] = &["info", "hostile.toml", "--json"];
const RENDER: &[&str] = &["render", "hostile.toml", "--size", "16x12", "--spp", "1", "-o", "x.exr", "-q"];

/// A flat sheet under an extension with one region.
fn sheet(mode: &str, bound: &str, index: u32, h: &str, factor: &str) -> String {
    format!(
        "[[object]]\nname = \"sheet\"\nsurface = {{ type = \"plane\", origin = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0] }}\n\
         [[object.deform]]\ntype = \"extension\"\n{mode}\n[[object.deform.region]]\nbound = \"{bound}\"\nindex = {index}\n\
         h = {h}\nfactor = \"{factor}\"\n"
    )
}

const OPERATOR: &str = "mode = \"operator\"\ncenter = [0, 0, 1]";

#[test]
fn numbers_beyond_double_precision_are_named() {
    let at = TestFolder::new();
    let edit = "twist = { axis = \"z\", angle = 90.0 }";
    let of_object = "object \"cube\": ";
    for (to, parts) in [
        ("move = [1, 1, 1]\nby = [0, 1e160, 0]", vec!["scene.toml:10:", of_object, "[1, 1, 1]", "1e160"]),
        ("drag = [[0.5, 0.5, 0.5]]\nto = [[1e160, 0, 0]]", vec!["scene.toml:10:", "drag 1", "e144"]),
        ("taper = { axis = \"z\", scale = 1e300 }", vec!["scene.toml:10:", of_object, "e299"]),
        ("weight = [1, 1, 1]\nvalue = 1e300", vec!["scene.toml:10:", of_object, "[1, 1, 1]", "1e300"]),
        ("weight = [1, 1, 1]\nvalue = 1e-300", vec!["scene.toml:10:", of_object, "1e-300"]),
    ] {
        at.refuse_scene(edit, to, &parts);
    }
    at.refuse_scene(
        "points = [4, 4, 4]",
        "points = [4, 4, 4]\nbounds = [[-1e155, -1e155, -1e155], [1e155, 1e155, 1e155]]",
        &["scene.toml:5:1: ", of_object, "1e155"],
    );
    let mut points: Vec<f64> = (0..192).map(f64::from).collect();
    points[100] = -3e230;
    at.write("lattice.npy", npy(&[4, 4, 4, 3], &points));
    at.refuse_scene(edit, "control_points = \"lattice.npy\"", &["scene.toml:10:", of_object, "3e230"]);
    for (size, shown) in [("1e200", "1e200"), ("1e77", "1e77"), ("1e-100", "1e-100"), ("1e-200", "1e-200")] {
        let scale = format!("mesh = \"cube.obj\"\ntransform = [{{ scale = {size} }}]");
        // a map whose inverse has no numbers is refused as such
        let message = if size.len() > 4 && !size.ends_with("100") { "inverted" } else { of_object };
        at.refuse_scene("mesh = \"cube.obj\"", &scale, &["scene.toml:", message]);
        let scaled: String = CUBE.replace(" 1", &format!(" {size}"));
        let faces = CUBE.lines().filter(|line| line.starts_with('f'));
        let vertices = scaled.lines().filter(|line| line.starts_with('v'));
        at.write("scaled.obj", vertices.chain(faces).flat_map(|line| [line, "\n"]).collect::<String>());
        at.refuse_scene("cube.obj", "scaled.obj", &["scene.toml:4:8: ", of_object, shown]);
        let sphere = format!("surface = {{ type = \"sphere\", radius = {size} }}");
        at.refuse_scene("mesh = \"cube.obj\"", &sphere, &[of_object, &shown[1..]]);
    }
    at.write("hostile.toml", sheet(OPERATOR, "-2", 4, "[0.0, 0.0, 0.9]", "11"));
    at.refuse(&["info", "hostile.toml"], &["hostile.toml:4:1: object \"sheet\": at u = ", "e68"]);
    at.write("hostile.toml", sheet("mode = \"radial\"\ncenter = [0.5, 0.5, 0]", "-2", 4, "-9", "1e4"));
    let run = at.run(&["info", "hostile.toml"]);
    assert!(run.code == 0 || run.stderr.contains("too small"), "{run:?}");
}

#[test]
fn cameras_and_lights_beyond_double_precision_end_well() {
    let at = TestFolder::new();
    for table in [
        "[camera]\norigin = [1e160, 0, 0]\ntarget = [0, 0, 0]",
        "[camera]\norigin = [1e100, 0, 0]\ntarget = [0, 1e-100, 0]",
        "[camera]\norigin = [3, 0, 0]\ntarget = [0, 0, 0]\ntype = \"orthographic\"\nwidth = 1e200",
        "[camera]\norigin = [3, 0, 0]\ntarget = [0, 0, 0]\naperture_radius = 1e200\nfocus_distance = 1e-200",
        "[[light]]\ntype = \"point\"\nposition = [1e200, 0, 0]\nintensity = 1e300",
        "[[light]]\ntype = \"area\"\nshape = \"rectangle\"\nradiance = 1\nto_world = [{ scale = 1e150 }]",
        "[[light]]\ntype = \"area\"\nshape = \"sphere\"\nradiance = 1\nto_world = [{ scale = 1e-150 }]",
        "[[light]]\ntype = \"area\"\nshape = \"disk\"\nradiance = 1\nto_world = [{ translate = [1e300, 0, 0] }]",
    ] {
        ends_well(&at, &format!("{table}\n{SCENE}"), &[RENDER, INFO]);
    }
}

#[test]
fn surfaces_that_grow_or_wave_without_bound_end() {
    let at = TestFolder::new();
    let field = "mode = \"field\"\nfield = [\"(0.3+v)^-v\", \"v\", \"1\"]";
    for scene in [
        sheet(OPERATOR, "-v/pi-v", 2, "[0.0, 0.0, 0.9]", "30"),
        sheet(OPERATOR, "-2.7", 4, "[0.2, 0.1, 0.3]", "exp(tan(u))"),
        sheet(OPERATOR, "-2", 4, "[0.2, 0.1, 0.3]", "-(900^u)"),
        sheet(OPERATOR, "pi/(2-(pi/v-v))", 2, "[0.2, 0.1, 0.3]", "pi"),
        sheet(OPERATOR, "(v-0.4)*sin(v)-pi", 5, "[0.2, 0.1, 0.3]", "tan(v)"),
        sheet(OPERATOR, "v-exp(-u)^2", 2, "[0.2, 0.1, 0.3]", "480"),
        sheet(OPERATOR, "2+(v-pi)/0.25", 2, "[0.0, 0.0, 0.9]", "e"),
        sheet(OPERATOR, "-(v+u)*u", 5, "[0.0, 0.0, 0.9]", "0.5-(pi+u)"),
        sheet(OPERATOR, "-exp(sqrt(cos(v)))", 4, "[0.0, 0.0, 0.9]", "e"),
        sheet(field, "atan(v^900)-3", 4, "[0.0, 0.0, 0.9]", "pi"),
        sheet(field, "-(0.5*v)^(v^900)/0.5", 2, "[0.0, 0.0, 0.9]", "2/(v*v)"),
        sheet(field, "-(acos(atan(v))+0.4)", 4, "[0.0, 0.0, 0.9]", "36*(v+e)"),
        sheet(OPERATOR, "sin(1e6*u*v)", 2, "0.3", "1"),
    ] {
        ends_well(&at, &scene, &[RENDER, INFO]);
    }
}

#[test]
fn parts_at_any_distance_from_each_other_end() {
    let at = TestFolder::new();
    let far = "4294967296.0";
    let region = "[[object.deform]]\ntype = \"extension\"\nmode = \"operator\"\ncenter = [0, 0, 0]\n\
                  [[object.deform.region]]\nbound = \"((u-0.5)^2 + (v-0.5)^2)/0.1 - 1\"\nindex = 4\nh = [0.9, 0.9, 0.1]\n";
    let patch = format!(
        "[[object]]\nname = \"patch\"\n[object.surface]\ntype = \"bezier\"\ndegree = [2, 2]\npoints = [[0, 0, 0], [0, 1, 1], \
         [0, 2, 0], [1, 0, 1], [1, 1, {far}], [1, 2, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0]]\n"
    );
    ends_well(&at, &patch, &[RENDER, INFO]);
    ends_well(&at, &format!("{patch}{region}"), &[RENDER, INFO]);
    let pair = format!(
        "[[object]]\nname = \"near\"\nsurface = {{ type = \"sphere\", radius = 0.5 }}\n[[object]]\nname = \"far\"\nsurface = \
         {{ type = \"torus\", center = [0, {far}, 0], axis = [0.3, 0.1, 1], major_radius = 0.5, minor_radius = 0.2 }}\n\
         [[object.deform]]\ntype = \"extension\"\nmode = \"field\"\nfield = \"normal\"\n[[object.deform.region]]\n\
         bound = \"((u-0.8)^2 + (v-0.2)^2)/0.02 - 1\"\nindex = 2\nh = 0.1\n[[object.deform]]\ntype = \"ffd\"\n\
         degree = [2, 2, 2]\npoints = [4, 4, 4]\n[[object.deform.edit]]\nbend = {{ axis = \"x\", angle = 40, toward = \"z\" }}\n"
    );
    ends_well(&at, &pair, &[INFO, &["drags", "hostile.toml"]]);
    let moved = SCENE.replace(
        "twist = { axis = \"z\", angle = 90.0 }",
        &format!(
            "move = [1, 1, 0]\nby = [0, {far}, 0]\n[[object.deform.edit]]\nmove = [2, 1, 3]\nby = [0, 0, 0.4]"
        ),
    );
    ends_well(&at, &moved, &[RENDER, INFO, &["export", "hostile.toml", "-o", "x.obj"]]);
    at.write("spike.obj", CUBE.replacen("v 1 1 1", "v 400000 1 1", 1));
    let spike = SCENE.replace("cube.obj", "spike.obj");
    let export: &[&str] = &["export", "hostile.toml", "--tolerance", "0.05", "-o", "x.obj"];
    ends_well(&at, &spike, &[RENDER, INFO, export]);
}

#[test]
fn weights_of_any_ratio_end() {
    let at = TestFolder::new();
    for (heavy, light) in [("1e9", "1"), ("1e14", "1"), ("1e12", "1e-12"), ("1e16", "1"), ("1e29", "1e-29")] {
        let patch = format!(
            "[[object]]\nname = \"patch\"\n[object.surface]\ntype = \"bezier\"\ndegree = [2, 2]\npoints = [[0, 0, 0], \
             [0, 1, 1], [0, 2, 0], [1, 0, 1], [1, 1, 0.3], [1, 2, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0]]\n\
             weights = [1, 1, 1, 1, {heavy}, 1, 1, {light}, 1]\n"
        );
        ends_well(&at, &patch, &[RENDER, INFO]);
        let lattice = SCENE.replace(
            "twist = { axis = \"z\", angle = 90.0 }",
            &format!("weight = [1, 1, 1]\nvalue = {heavy}\n[[object.deform.edit]]\nweight = [2, 1, 2]\nvalue = {light}"),
        );
        ends_well(&at, &lattice, &[RENDER, INFO]);
    }
    let sphere =
        "[[object]]\nname = \"ball\"\nsurface = { type = \"sphere\", center = [1e59, 0, 0], radius = 1 }\n";
    ends_well(&at, sphere, &[RENDER, INFO]);
}

#[test]
fn memory_is_asked_for_before_it_is_taken() {
    let at = TestFolder::new();
    let refused = |arguments: &[&str], part: &str| {
        let made = bounded(&at.path("."), arguments);
        assert_eq!(made.code, 1, "{arguments:?}: {made:?}");
        let message = &made.stderr;
        assert!(message.contains(part) && message.contains("--max-memory"), "{arguments:?}: {message}");
    };
    refused(
        &["render", "scene.toml", "--size", "16384x16384", "-o", "x.exr"],
        "picture of 16384x16384 pixels",
    );
    refused(&["info", "scene.toml", "--method", "pointwise:10"], "pointwise:10 of 12 triangles");
    refused(&["export", "scene.toml", "-o", "x.ply", "--level", "10"], "triangles");
    refused(&["info", "scene.toml", "--max-memory", "1M"], "--max-memory");
    at.write("scene.toml", SCENE.replace("[4, 4, 4]", "[200, 200, 200]"));
    refused(&["info", "scene.toml", "--max-memory", "64M"], "object \"cube\"");
    at.refuse(&["info", "scene.toml", "--max-memory", "much"], &["--max-memory", "512M"]);
    let help = at.succeed(&["info", "--help"]);
    assert!(help.stdout.contains("--max-memory <SIZE>"), "{}", help.stdout);
}

/// The repository's own files of an ending below a folder, by name.
fn own(folder: &str, ending: &str) -> Vec<std::path::PathBuf> {
    let entries = fs::read_dir(repository().join(folder)).expect("the folder is there");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("readable").path()).collect();
    files.retain(|path| path.extension().is_some_and(|found| found == ending));
    files.sort();
    files
}

/// A kind of input: makes a mutated one in a folder, and says what is to be run, and the exit codes that are right.
type Kind = fn(&TestFolder, &mut Random) -> (Vec<String>, &'static [i32]);

const KINDS: [(&str, Kind); 4] =
    [("scene", scene), ("mesh", mesh), ("lattice", lattice), ("picture", picture)];

fn words(text: &str) -> Vec<String> {
    text.split(' ').map(str::to_owned).collect()
}

/// A shipped scene, in a folder with links to its meshes and pictures.
fn scene(at: &TestFolder, random: &mut Random) -> (Vec<String>, &'static [i32]) {
    let folder = *random.choose(&["scenes", "refs/scenes"]);
    let text = fs::read_to_string(random.choose(&own(folder, "toml"))).expect("readable");
    for part in ["meshes", "pictures"] {
        let link = at.path(part);
        // of the scene before
        let _ = fs::remove_file(&link);
        std::os::unix::fs::symlink(repository().join(folder).join(part), link).expect("a link");
    }
    at.write("mutated.toml", mutated_text(&text, random));
    let command = random.choose(&[
        "info mutated.toml --json",
        "render mutated.toml --size 16x12 --spp 1 -o x.exr -q",
        "render mutated.toml --size 8x8 --spp 1 -o x.exr -q --method pointwise:1",
        "export mutated.toml -o x.json -q",
        "export mutated.toml -o x.ply -q --level 1",
        "drags mutated.toml",
    ]);
    (words(command), &[0, 1, 2])
}

fn mesh(at: &TestFolder, random: &mut Random) -> (Vec<String>, &'static [i32]) {
    let small: Vec<_> = own("scenes/meshes", "obj")
        .into_iter()
        .filter(|path| fs::metadata(path).is_ok_and(|file| file.len() < 30_000))
        .collect();
    let text = fs::read(random.choose(&small)).expect("readable");
    let mutated = match random.below(3) {
        0 => mutated_bytes(&text, random),
        _ => mutated_text(&String::from_utf8_lossy(&text), random).into_bytes(),
    };
    at.write("mutated.obj", mutated);
    at.write("mutated.toml", SCENE.replace("cube.obj", "mutated.obj"));
    let command = random.choose(&[
        "info mutated.toml --json",
        "render mutated.toml --size 16x12 --spp 1 -o x.exr -q",
        "export mutated.toml -o x.obj -q --tolerance 0.05",
    ]);
    (words(command), &[0, 1, 2])
}

fn lattice(at: &TestFolder, random: &mut Random) -> (Vec<String>, &'static [i32]) {
    let places = (0..64).flat_map(|i| [i / 16, i / 4 % 4, i % 4]);
    let points: Vec<f64> = places.map(|place| f64::from(place) / 3.0 + 0.2 * (random.unit() - 0.5)).collect();
    at.write("mutated.npy", mutated_bytes(&npy(&[4, 4, 4, 3], &points), random));
    let edit = "twist = { axis = \"z\", angle = 90.0 }";
    at.write("mutated.toml", SCENE.replace(edit, "control_points = \"mutated.npy\""));
    let command =
        random.choose(&["info mutated.toml --json", "render mutated.toml --size 16x12 --spp 1 -o x.exr -q"]);
    (words(command), &[0, 1, 2])
}

fn picture(at: &TestFolder, random: &mut Random) -> (Vec<String>, &'static [i32]) {
    let own = if random.below(3) == 0 { own("refs/scenes/pictures", "png") } else { own("refs", "exr") };
    let path = random.choose(&own);
    let ending = path.extension().unwrap_or_default().to_string_lossy().into_owned();
    let bytes = fs::read(path).expect("readable");
    at.write(&format!("whole.{ending}"), &bytes);
    at.write(&format!("mutated.{ending}"), mutated_bytes(&bytes, random));
    (words(&format!("diff whole.{ending} mutated.{ending}")), &[0, 1, 2, 3, 4])
}

#[test]
fn mutated_inputs_end_well() {
    let number = |name: &str, default| {
        std::env::var(name).map_or(default, |text| text.parse().expect("a whole number"))
    };
    let (count, seed) = (number("TRIMRAY_MUTATIONS", 240), number("TRIMRAY_SEED", 1));
    println!("{count} mutated inputs, from seed {seed}");
    let at = TestFolder::new();
    let mut faults = Vec::new();
    for seed in seed..seed + count {
        let mut random = Random::new(seed);
        let (name, kind) = KINDS[random.below(KINDS.len())];
        let (arguments, codes) = kind(&at, &mut random);
        let arguments: Vec<_> = arguments.iter().map(String::as_str).collect();
        let made = bounded(&at.path("."), &arguments);
        if let Some(fault) = fault(&made, codes) {
            let kept = std::env::temp_dir().join(format!("trimray_{name}_{seed}"));
            // what is kept is for people; without it the seed makes it again
            let _ = fs::create_dir_all(&kept);
            for file in at.files().iter().filter(|file| file.starts_with("mutated.")) {
                let _ = fs::copy(at.path(file), kept.join(file));
            }
            let fault: String = fault.chars().take(600).collect();
            let line =
                format!("TRIMRAY_SEED={seed} ({name}, kept in {}): {arguments:?}: {fault}", kept.display());
            println!("{line}");
            faults.push(line);
        }
    }
    assert!(faults.is_empty(), "{} of {count}:\n{}", faults.len(), faults.join("\n"));
}
