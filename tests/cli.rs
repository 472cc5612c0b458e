//! The commands through the real program.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::collections::HashMap;
use std::io::Read;

use common::{SCENE, TestFolder, npy, repository};

/// The arrays of an `.npz` archive that hold doubles or integers, as doubles.
fn arrays(bytes: &[u8]) -> HashMap<String, Vec<f64>> {
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).unwrap();
    let mut found = HashMap::new();
    for index in 0..archive.len() {
        let mut entry = archive.by_index(index).unwrap();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).unwrap();
        let name = entry.name().unwrap().trim_end_matches(".npy").to_owned();
        let file = npyz::NpyFile::new(&bytes[..]).unwrap();
        let values = match file.dtype().descr().as_str() {
            "'<f8'" => file.into_vec::<f64>().unwrap(),
            "'<i4'" => file.into_vec::<i32>().unwrap().into_iter().map(f64::from).collect(),
            "'<i8'" => file.into_vec::<i64>().unwrap().into_iter().map(|x| x as f64).collect(),
            "'|b1'" => file.into_vec::<bool>().unwrap().into_iter().map(|x| f64::from(u8::from(x))).collect(),
            other => panic!("{name}: unexpected type {other}"),
        };
        found.insert(name, values);
    }
    found
}

#[test]
fn info_counts_the_cube_of_fengs_table_2() {
    let at = TestFolder::new();
    let run = at.succeed(&["info", "scene.toml", "--json"]);
    let info: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    let object = &info["objects"][0];
    for (key, want) in
        [("faces", 12), ("triangles", 12), ("subpolygons", 36), ("patches", 24), ("fold_overs", 0)]
    {
        assert_eq!(object[key], want, "{key}");
    }
    assert_eq!(object["name"], "cube");
    assert_eq!(object["method"], "exact");
    assert_eq!(object["degrees"], serde_json::json!({ "2x2": 24 }));
    assert_eq!(object["injective"], true);
    assert_eq!(object["lattice"], serde_json::json!({ "degree": [2, 2, 2], "points": [4, 4, 4] }));
    for key in ["load", "subdivide", "compose", "build"] {
        assert!(info["seconds"][key].as_f64().unwrap() >= 0.0, "{key}");
    }
    assert!(info["accel"]["leaves"].as_u64().unwrap() >= 24);
    assert!(run.stderr.is_empty(), "{}", run.stderr);
    let table = at.succeed(&["info", "scene.toml"]).stdout;
    assert!(table.contains("36") && table.contains("24 of 2x2"), "{table}");
}

#[test]
fn info_counts_the_triangular_patches_of_the_method_before() {
    let at = TestFolder::new();
    let run = at.succeed(&["info", "scene.toml", "--json", "--method", "triangular"]);
    let info: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    let object = &info["objects"][0];
    for (key, want) in [("subpolygons", 60), ("patches", 60), ("control_points", 60 * 49)] {
        assert_eq!(object[key], want, "{key}");
    }
    assert_eq!(object["method"], "triangular");
    assert_eq!(object["degrees"], serde_json::json!({ "6x6": 60 }));
    let triangular = &object["triangular"];
    assert_eq!((&triangular["patches"], &triangular["control_points"]), (&60.into(), &(60 * 28).into()));
    assert!(triangular["bytes"].as_u64() < object["bytes"].as_u64());
    assert_eq!(object["injective"], true);
    let table = at.succeed(&["info", "scene.toml", "--method", "triangular"]).stdout;
    assert!(table.contains("60 patches, 1680 control points"), "{table}");
}

#[test]
fn info_says_what_the_acceleration_structure_is_and_what_a_ray_costs() {
    let at = TestFolder::new();
    let info = || -> serde_json::Value {
        serde_json::from_str(&at.succeed(&["info", "scene.toml", "--json"]).stdout).unwrap()
    };
    let lines = info();
    let accel = |key: &str| lines["accel"][key].as_u64().unwrap();
    assert_eq!(accel("leaves_inside") + accel("leaves_crossed"), accel("leaves"));
    assert!(accel("leaves_inside") > 0 && accel("leaves_crossed") > 0 && accel("nodes") > 0, "{lines}");
    assert!(accel("bytes") > 100 * accel("leaves"));
    assert_eq!(lines["accel"]["seconds"], lines["seconds"]["build"]);
    let sample = &lines["sample"];
    assert_eq!((&sample["from"], &sample["rays"]), (&"lines".into(), &4096.into()));
    let share = sample["hits"].as_u64().unwrap() as f64 / 4096.0;
    // Cauchy: of the lines that meet a sphere, the share that meets a convex body in it is the ratio of their areas;
    // the twisted cube is nearly one, of nearly the plain cube's area
    let bounds: [[f64; 3]; 2] = serde_json::from_value(lines["objects"][0]["bounds"].clone()).unwrap();
    let diagonal_sq: f64 = (0..3).map(|axis| (bounds[1][axis] - bounds[0][axis]).powi(2)).sum();
    let want = 6.0 / (std::f64::consts::PI * diagonal_sq);
    assert!((share / want - 1.0).abs() < 0.15, "{share}, want {want}");
    assert!(sample["per_ray"]["leaf_tests"].as_f64().unwrap() > share, "{sample}");
    assert!(sample["per_ray"]["rays"].is_null(), "{sample}");
    assert_eq!(info()["sample"], *sample, "the same on every run");
    let camera =
        "[camera]\norigin = [0.5, -3.0, 0.5]\ntarget = [0.5, 0.5, 0.5]\nup = [0, 0, 1]\nfov = 10.0\n";
    at.write("scene.toml", format!("{camera}{SCENE}"));
    assert_eq!(info()["sample"]["from"], "camera");
    assert_eq!(info()["sample"]["hits"], 4096, "it sees nothing but the cube");
    let table = at.succeed(&["info", "scene.toml"]).stdout;
    assert!(
        table.contains("4096 rays of the camera, 4096 hits") && table.contains("newton steps"),
        "{table}"
    );
}

/// The totals of the table that `--stats` prints, by counter.
fn totals(table: &str) -> HashMap<String, u64> {
    let row = |line: &str| {
        let columns: Vec<_> = line.strip_prefix("  ")?.split("  ").filter(|c| !c.is_empty()).collect();
        Some((columns[0].trim().to_owned(), columns.get(1)?.trim().parse().ok()?))
    };
    table.lines().filter_map(row).collect()
}

#[test]
fn render_counts_every_ray_of_every_thread() {
    let at = TestFolder::new();
    at.write("scene.toml", format!("{SCENE}[[light]]\ntype = \"constant\"\n"));
    let stats = |threads: &str| {
        let run = at.succeed(&[
            "render",
            "scene.toml",
            "--size",
            "70x50",
            "--spp",
            "3",
            "--stats",
            "--quiet",
            "--threads",
            threads,
            "-o",
            "x.exr",
        ]);
        assert!(run.stdout.is_empty());
        assert!(run.stderr.contains(" nodes, ") && run.stderr.contains("built in"), "{}", run.stderr);
        totals(&run.stderr)
    };
    let one = stats("1");
    assert_eq!(one["samples"], 70 * 50 * 3);
    assert_eq!(one["rays"], one["nearest hit rays"] + one["shadow rays"], "{one:?}");
    assert!(one["shadow rays"] > 1000 && one["leaf tests"] > 1000 && one["newton steps"] > 1000, "{one:?}");
    for counter in ["fallbacks", "boxes", "roots", "degenerate", "in surface", "not converged", "on border"] {
        assert!(one.contains_key(counter), "{counter}");
    }
    assert_eq!(stats("3"), one);
}

#[test]
fn trace_counts_the_same_for_any_number_of_threads() {
    let at = TestFolder::new();
    let rays: Vec<_> = (0..5000)
        .flat_map(|i| {
            let x = f64::from(i) / 5000.0;
            [x, 0.2 + 0.5 * x, -1.0, 0.1, 0.2 - x, 2.0]
        })
        .collect();
    at.write("rays.npy", npy(&[5000, 6], &rays));
    let trace = |more: &[&str]| {
        let mut arguments = vec!["trace", "scene.toml", "--rays", "rays.npy", "-o", "hits.npz"];
        arguments.extend(more);
        at.succeed(&arguments)
    };
    let run = trace(&["--json", "--stats", "--threads", "3"]);
    let summary: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(summary["stats"]["rays"], 5000);
    assert!(summary["accel"]["leaves"].as_u64().unwrap() >= 24 && summary["accel"]["seconds"].is_number());
    let table = totals(&run.stderr);
    for (name, count) in summary["stats"].as_object().unwrap() {
        assert_eq!(*count, table[&name.replace('_', " ")], "{name}");
    }
    assert_eq!(totals(&trace(&["--stats", "--quiet", "--threads", "1"]).stderr), table);
    assert!(totals(&trace(&[]).stderr).is_empty(), "only when asked for");
}

#[test]
fn every_shipped_scene_builds_and_has_its_table_2_triangles() {
    let at = TestFolder::new();
    let mut names: Vec<_> = std::fs::read_dir(repository().join("scenes"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    names.sort();
    let table_2 = [("07", 12), ("08", 56), ("09", 200), ("10", 260), ("11", 178), ("12", 96), ("13", 956)];
    let mut found = 0;
    for path in &names {
        let run = at.succeed(&["info", path.to_str().unwrap(), "--json"]);
        let info: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
        let name = path.file_stem().unwrap().to_str().unwrap();
        if let Some((_, want)) = table_2.iter().find(|(figure, _)| name == format!("feng_fig{figure}")) {
            let deformed = info["objects"].as_array().unwrap().iter().filter(|o| !o["lattice"].is_null());
            let triangles: u64 = deformed.map(|object| object["triangles"].as_u64().unwrap()).sum();
            assert_eq!(triangles, *want, "{name}");
            found += 1;
        }
        for object in info["objects"].as_array().unwrap() {
            assert_eq!(object["injective"], true, "{name}: {object}");
        }
    }
    assert_eq!(found, 7);
    assert!(names.iter().filter(|path| path.to_str().unwrap().contains("gallery_")).count() >= 2);
}

#[test]
fn trace_writes_the_arrays_of_the_contract() {
    let at = TestFolder::new();
    at.write("rays.npy", npy(&[2, 6], &[0.4, 0.3, -1.0, 0.0, 0.0, 2.0, 5.0, 5.0, 5.0, 1.0, 0.0, 0.0]));
    let trace = |more: &[&str]| {
        let arguments: Vec<_> = ["trace", "scene.toml", "--rays", "rays.npy", "-o", "hits.npz"]
            .iter()
            .chain(more)
            .copied()
            .collect();
        let run = at.succeed(&arguments);
        (run, arrays(&at.read("hits.npz")))
    };
    let (run, hits) = trace(&["--json"]);
    let lengths = [
        ("t", 1),
        ("object", 1),
        ("face", 1),
        ("patch", 1),
        ("st", 2),
        ("uv", 2),
        ("rest", 3),
        ("position", 3),
        ("normal", 3),
        ("dp_ds", 3),
        ("dp_dt", 3),
    ];
    for (name, columns) in lengths {
        assert_eq!(hits[name].len(), 2 * columns, "{name}");
    }
    assert_eq!(hits.len(), lengths.len());
    assert!((hits["t"][0] - 0.5).abs() < 1e-15 && hits["t"][1] == f64::INFINITY, "{:?}", hits["t"]);
    assert_eq!((hits["object"][0], hits["object"][1]), (0.0, -1.0));
    assert_eq!((hits["face"][1], hits["patch"][1]), (-1.0, -1.0));
    assert_eq!(hits["normal"][..3], [0.0, 0.0, -1.0]);
    assert!(hits["uv"].iter().all(|x| x.is_nan()));
    let summary: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!((&summary["rays"], &summary["hits"]), (&2.into(), &1.into()));
    assert!(summary["stats"]["newton_steps"].as_u64().unwrap() > 0);
    assert!(run.stderr.contains("Mrays/s"));
    let (_, any) = trace(&["--any"]);
    assert_eq!(any["hit"], [1.0, 0.0]);
    assert_eq!(any.len(), 1);
    let (_, all) = trace(&["--all"]);
    assert_eq!(all["offsets"], [0.0, 2.0, 2.0]);
    assert!((all["t"][0] - 0.5).abs() < 1e-15 && (all["t"][1] - 1.0).abs() < 1e-15);
    let (_, once) = trace(&["--all", "--once"]);
    assert_eq!(once["offsets"], [0.0, 2.0, 2.0]);
}

#[test]
fn uvs_reach_the_hit() {
    let at = TestFolder::new();
    at.write(
        "cube.obj",
        "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n",
    );
    at.write("scene.toml", "[[object]]\nname = \"quad\"\nmesh = \"cube.obj\"\n");
    at.write("rays.npy", npy(&[1, 6], &[0.5, 0.25, 1.0, 0.0, 0.0, -1.0]));
    at.succeed(&["trace", "scene.toml", "--rays", "rays.npy", "-o", "hits.npz"]);
    let hits = arrays(&at.read("hits.npz"));
    assert!((hits["uv"][0] - 0.25).abs() < 1e-15 && (hits["uv"][1] - 0.25).abs() < 1e-15, "{:?}", hits["uv"]);
    assert_eq!(hits["rest"], [0.5, 0.25, 0.0]);
}

#[test]
fn export_holds_the_exact_patches() {
    let at = TestFolder::new();
    at.succeed(&["export", "scene.toml", "-o", "x.json"]);
    let json: serde_json::Value = serde_json::from_slice(&at.read("x.json")).unwrap();
    let object = &json["objects"][0];
    let volume = &object["volumes"][0];
    assert_eq!(volume["degree"], serde_json::json!([2, 2, 2]));
    assert_eq!(volume["knots"][0].as_array().unwrap().len(), 7);
    assert_eq!(volume["control_points"].as_array().unwrap().len(), 64);
    let patches = object["patches"].as_array().unwrap();
    assert_eq!(patches.len(), 24);
    let mut area = 0.0;
    for patch in patches {
        let (m, n) = (patch["degree"][0].as_u64().unwrap(), patch["degree"][1].as_u64().unwrap());
        assert_eq!(patch["control_points"].as_array().unwrap().len() as u64, (m + 1) * (n + 1));
        let vector = |key: &str| -> Vec<f64> {
            patch["frame"][key].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
        };
        let (s, t) = (vector("s"), vector("t"));
        let cross = [s[1] * t[2] - s[2] * t[1], s[2] * t[0] - s[0] * t[2], s[0] * t[1] - s[1] * t[0]];
        let scale = cross.iter().map(|x| x * x).sum::<f64>().sqrt();
        for trim in patch["trim"].as_array().unwrap() {
            let corners: Vec<[f64; 2]> = serde_json::from_value(trim["loop"].clone()).unwrap();
            let next = corners.iter().cycle().skip(1);
            let doubled: f64 = corners.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum();
            assert!(doubled > 0.0, "loops wind counter-clockwise");
            area += 0.5 * doubled * scale;
        }
    }
    assert!((area - 6.0).abs() < 1e-12, "the trims' area on the undeformed planes: {area}");
}

#[test]
fn rational_lattices_and_lattice_files_work() {
    let at = TestFolder::new();
    let mut values = Vec::new();
    let greville = [0.0, 0.25, 0.75, 1.0];
    for x in greville {
        for y in greville {
            for z in greville {
                values.extend([x, y, z + 0.1 * x * y, 1.0 + x]);
            }
        }
    }
    at.write("lattice.npy", npy(&[4, 4, 4, 4], &values));
    at.write(
        "scene.toml",
        SCENE.replace("twist = { axis = \"z\", angle = 90.0 }", "control_points = \"lattice.npy\""),
    );
    at.succeed(&["export", "scene.toml", "-o", "x.json"]);
    let json: serde_json::Value = serde_json::from_slice(&at.read("x.json")).unwrap();
    let weights: Vec<f64> = json["objects"][0]["patches"][0]["control_points"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| p[3].as_f64().unwrap())
        .collect();
    assert!(
        weights.iter().all(|w| (1.0..=2.0).contains(w)) && weights.iter().any(|w| *w != 1.0),
        "{weights:?}"
    );
}

#[test]
fn render_writes_the_same_bytes_for_any_number_of_threads() {
    let at = TestFolder::new();
    let render = |name: &str, more: &[&str]| {
        let arguments: Vec<_> = ["render", "scene.toml", "--size", "40x30", "--spp", "4", "-o", name]
            .iter()
            .chain(more)
            .copied()
            .collect();
        let run = at.succeed(&arguments);
        assert!(run.stdout.is_empty() && run.stderr.is_empty(), "silent in a pipe: {run:?}");
        at.read(name)
    };
    let one = render("one.exr", &["--threads", "1"]);
    assert_eq!(one, render("three.exr", &["--threads", "3"]));
    assert_ne!(one, render("seed.exr", &["--seed", "1"]));
    assert!(render("x.png", &[]).starts_with(b"\x89PNG"));
}

#[test]
fn pictures_and_objects_light_a_scene() {
    let at = TestFolder::new();
    let render = |lights: &str, name: &str| {
        at.write("lit.toml", lights.to_owned() + SCENE);
        at.succeed(&["render", "lit.toml", "--size", "8x4", "--spp", "4", "-o", name]);
        at.read(name)
    };
    let sky = render("[[light]]\ntype = \"constant\"\nradiance = [3, 2, 1]\n", "sky.exr");
    at.write("other.exr", &sky);
    let envmap = |file: &str| format!("[[light]]\ntype = \"envmap\"\nfile = \"{file}\"\n");
    let lit = render(&envmap("sky.exr"), "lit.exr");
    assert!(lit == render(&envmap("other.exr"), "again.exr"), "the pixels count, not the file's name");
    let lamp = "[[light]]\ntype = \"area\"\nshape = \"object\"\nobject = \"cube\"\n";
    let shining = render(lamp, "lamp.exr");
    let text = |bytes: &[u8], part: &str| bytes.windows(part.len()).any(|window| window == part.as_bytes());
    assert!(text(&lit, r#""type":"envmap""#) && !text(&lit, "sky.exr"));
    assert!(text(&shining, r#""object":"cube""#));
    // faults of the picture are told where the scene names it
    at.write("lit.toml", envmap("none.exr") + SCENE);
    at.refuse(&["info", "lit.toml"], &["lit.toml:3:8: file cannot read the picture", "none.exr"]);
    at.write("lit.toml", envmap("cube.obj") + SCENE);
    at.refuse(
        &["info", "lit.toml"],
        &["lit.toml:3:8: file", "is neither OpenEXR, Radiance HDR, PNG, JPEG, TIFF, BMP, WebP nor TGA"],
    );
}

#[test]
fn render_writes_beside_the_caller_by_default() {
    let at = TestFolder::new();
    at.succeed(&["render", "scene.toml", "--size", "8x8", "--spp", "1"]);
    assert_eq!(at.files(), ["cube.obj", "scene.exr", "scene.toml"]);
}

#[test]
fn help_shows_an_example_for_each_command() {
    let at = TestFolder::new();
    for command in ["render", "info", "trace", "export", "diff"] {
        let run = at.succeed(&[command, "--help"]);
        assert!(run.stdout.contains(&format!("Example: trimray {command}")), "{command}");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_render_ends_with_1_and_leaves_nothing() {
    let at = TestFolder::new();
    let arguments = ["render", "scene.toml", "--spp", "100000", "-o", "x.exr"];
    let child = at.command(&arguments).stderr(std::process::Stdio::piped()).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(1500));
    let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let run = common::Run::of(child.wait_with_output().unwrap());
    assert_eq!(run.code, 1, "{run:?}");
    assert!(run.stderr.contains("interrupted"), "{run:?}");
    assert_eq!(at.files(), ["cube.obj", "scene.toml"]);
}

#[cfg(unix)]
#[test]
fn signals_end_the_program_while_a_scene_is_built() {
    let at = TestFolder::new();
    // a pipe that nobody writes to: reading it waits for ever
    let made = std::process::Command::new("mkfifo").arg(at.path("pipe.obj")).status().unwrap();
    assert!(made.success());
    at.write("pipe.toml", "[[object]]\nname = \"pipe\"\nmesh = \"pipe.obj\"\n");
    for signal in ["-INT", "-TERM"] {
        let child = at.command(&["info", "pipe.toml"]).stderr(std::process::Stdio::piped()).spawn().unwrap();
        std::thread::sleep(std::time::Duration::from_millis(1500));
        let killed =
            std::process::Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        assert!(killed.success());
        let run = common::Run::of(child.wait_with_output().unwrap());
        assert_eq!(run.code, 1, "{signal}: {run:?}");
        assert!(run.stderr.contains("interrupted"), "{signal}: {run:?}");
    }
}
