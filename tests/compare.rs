//! `trimray compare` and the other methods through the real program.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::{SCENE, TestFolder, repository};
use serde_json::Value;

fn report(at: &TestFolder, folder: &str) -> Value {
    serde_json::from_slice(&at.read(&format!("{folder}/report.json"))).unwrap()
}

fn method<'r>(report: &'r Value, name: &str) -> &'r Value {
    let methods = report["methods"].as_array().unwrap();
    methods.iter().find(|method| method["method"] == name && method["noise"] == false).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn errors_fall_by_four_with_each_level_and_tolerances_are_met() {
    let at = TestFolder::new();
    let flags = ["compare", "scene.toml", "-o", "out", "--levels", "6", "--adaptive", "1e-2,1e-3"];
    let run = at.succeed(&[&flags[..], &["--size", "48x36", "--spp", "4", "--json"]].concat());
    let report = report(&at, "out");
    assert_eq!(serde_json::from_str::<Value>(&run.stdout).unwrap(), report);
    assert_eq!((&report["scene"], &report["spp"]), (&"scene.toml".into(), &4.into()));
    let deviation = |name: &str| number(&method(&report, name)["deviation"]["max"]);
    assert!(deviation("exact") < 1e-12);
    assert!(deviation("pointwise:0") > 0.05);
    for level in 4..6 {
        let [coarse, fine] = [level, level + 1].map(|level| deviation(&format!("pointwise:{level}")));
        assert!((coarse / fine - 4.0).abs() < 0.4, "level {level}: {coarse:e}, {fine:e}");
        let [coarse, fine] = [level, level + 1]
            .map(|level| number(&method(&report, &format!("pointwise:{level}"))["silhouette"]["max"]));
        assert!(fine < 0.5 * coarse, "level {level}: {coarse:e}, {fine:e}");
    }
    let info: Value = serde_json::from_str(&at.succeed(&["info", "scene.toml", "--json"]).stdout).unwrap();
    let [low, high] = [0, 1]
        .map(|i| info["objects"][0]["bounds"][i].as_array().unwrap().iter().map(number).collect::<Vec<_>>());
    let diagonal = low.iter().zip(&high).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
    for tolerance in ["0.01", "0.001"] {
        let found = method(&report, &format!("adaptive:{tolerance}"));
        let bound = number(&found["deviation"]["bound"]) * diagonal;
        let tolerance: f64 = tolerance.parse().unwrap();
        // certified for every point
        assert!(bound <= tolerance && bound > 0.3 * tolerance, "{bound:e} for {tolerance:e}");
        assert!(number(&found["triangles"]) < 100_000.0);
    }
    let exact = method(&report, "exact");
    assert!(exact["image"].is_null());
    assert_eq!((&exact["triangles"], &exact["patches"]), (&12.into(), &24.into()));
    let coarse = method(&report, "pointwise:0");
    for key in ["mean_error", "rms_error", "max_error", "psnr", "relmse", "ssim", "flip", "hdrflip"] {
        assert!(number(&coarse["image"][key]) > 0.0, "{key}");
    }
    assert!(number(&coarse["image"]["normal_degrees"]["max"]) > 1.0);
    for key in ["seconds", "bytes"] {
        assert!(number(&coarse[key]) > 0.0, "{key}");
    }
    let needed = report["needed"].as_array().unwrap();
    let level = |below: f64| {
        let found = needed.iter().find(|n| n["quantity"] == "deviation" && number(&n["below"]) == below);
        found.map(|n| (n["level"].as_u64().unwrap(), n["extrapolated"] == true)).unwrap()
    };
    assert!(!level(1e-3).1 && level(1e-6).1 && level(1e-6).0 >= 7, "{needed:?}");
    let page = String::from_utf8(at.read("out/report.html")).unwrap();
    assert!(page.contains("pointwise:3") && page.contains("data:image/png;base64,") && page.contains("<svg"));
    assert!(!page.contains("http:") && !page.contains("https:"), "no network");
    // the pictures are what `render` makes
    let flags = ["--size", "48x36", "--spp", "4", "--method", "pointwise:2", "-o", "two.exr"];
    at.succeed(&[&["render", "scene.toml"][..], &flags].concat());
    let run = at.run(&["diff", "two.exr", "out/scene_pointwise_2.exr"]);
    assert_eq!(run.code, 3, "with other layers: {}", run.stderr);
}

#[test]
fn several_scenes_are_on_one_page_and_nothing_deformed_is_an_error() {
    let at = TestFolder::new();
    at.write("other.toml", SCENE.replace("angle = 90.0", "angle = 20.0"));
    let small = ["--levels", "0", "--adaptive", "0.1", "--size", "16x12", "--spp", "1"];
    at.succeed(&[&["compare", "scene.toml", "other.toml", "-o", "out"][..], &small].concat());
    let report = report(&at, "out");
    let scenes = report["scenes"].as_array().unwrap();
    assert_eq!(scenes.iter().map(|scene| &scene["scene"]).collect::<Vec<_>>(), ["scene.toml", "other.toml"]);
    at.write("flat.toml", "[[object]]\nname = \"cube\"\nmesh = \"cube.obj\"\n");
    let run = at.run(&["compare", "flat.toml", "-o", "none"]);
    assert_eq!(run.code, 2, "{}", run.stderr);
    assert!(run.stderr.contains("no object is deformed"), "{}", run.stderr);
    let run = at.run(&["compare", "scene.toml", "-o", "out", "--adaptive", "0"]);
    assert_eq!(run.code, 2);
}

#[test]
fn adaptive_triangles_stand_for_surfaces_and_shade_with_normals() {
    let at = TestFolder::new();
    at.write(
        "surface.toml",
        "[[object]]\nname = \"ball\"\nsurface = { type = \"sphere\", radius = 1 }\nmethod = \"adaptive:0.01\"\n\
         [[object]]\nname = \"other\"\nsurface = { type = \"sphere\", radius = 1 }\n",
    );
    let info: Value = serde_json::from_str(&at.succeed(&["info", "surface.toml", "--json"]).stdout).unwrap();
    let patches = |index: usize| info["objects"][index]["patches"].as_u64().unwrap();
    assert!(patches(0) > 50 && patches(0) < 5000 && patches(1) < 50, "{info}");
    at.write(
        "pointwise.toml",
        "[[object]]\nname = \"ball\"\nsurface = { type = \"sphere\", radius = 1 }\nmethod = \"pointwise:2\"\n",
    );
    let run = at.run(&["info", "pointwise.toml"]);
    assert_eq!(run.code, 2);
    assert!(run.stderr.contains("4:10: a surface has no triangles"), "{}", run.stderr);
}

#[test]
fn every_scene_of_feng_meets_its_tolerance() {
    let at = TestFolder::new();
    let scenes: Vec<_> =
        (7..=13).map(|figure| repository().join(format!("scenes/feng_fig{figure:02}.toml"))).collect();
    let paths = scenes.iter().map(|path| path.to_str().unwrap());
    let flags = ["-o", "out", "--levels", "3", "--adaptive", "0.01", "--size", "16x12", "--spp", "1"];
    at.succeed(&std::iter::once("compare").chain(paths).chain(flags).collect::<Vec<_>>());
    let report = report(&at, "out");
    let scenes = report["scenes"].as_array().unwrap();
    assert_eq!(scenes.len(), 7);
    for scene in scenes {
        let deviation = |name: &str| number(&method(scene, name)["deviation"]["max"]);
        let name = &scene["scene"];
        assert!(deviation("exact") < 1e-12, "{name}");
        assert!(deviation("pointwise:3") < 0.5 * deviation("pointwise:2"), "{name}");
        // no object is smaller than 1
        assert!(number(&method(scene, "adaptive:0.01")["deviation"]["bound"]) <= 0.01, "{name}");
    }
}
