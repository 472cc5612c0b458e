//! The real program's `diff`: every exit code, and pictures that must not pass.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::path::Path;

use common::{Run, TestFolder};
use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, IntegerBounds, Layer};
use exr::prelude::{ImageAttributes, LayerAttributes, Text, Vec2, WritableImage};
use serde_json::Value;
use trimray::film::{Numbers, read_layers};

const SIZE: [usize; 2] = [24, 16];

/// One part: its name, place and channels.
#[derive(Clone)]
struct Part {
    name: Option<&'static str>,
    position: [i32; 2],
    size: [usize; 2],
    channels: Vec<(String, FlatSamples)>,
}

fn smooth(channel: usize) -> Vec<f32> {
    (0..SIZE[0] * SIZE[1])
        .map(|index| {
            let (x, y) = ((index % SIZE[0]) as f32, (index / SIZE[0]) as f32);
            0.5 + 0.4 * (0.3 * x + 0.2 * y + channel as f32).sin()
        })
        .collect()
}

/// R, G, B, A, a depth, a normal and an id.
fn part() -> Part {
    let pixels = SIZE[0] * SIZE[1];
    let float = |name: &str, values| (name.to_owned(), FlatSamples::F32(values));
    let mut channels: Vec<_> =
        ["R", "G", "B"].iter().enumerate().map(|(at, name)| float(name, smooth(at))).collect();
    channels.extend([
        float("A", vec![1.0; pixels]),
        float("depth.T", vec![4.0; pixels]),
        float("normal.X", vec![0.0; pixels]),
        float("normal.Y", vec![0.0; pixels]),
        float("normal.Z", vec![1.0; pixels]),
        float("object.I", vec![2.0; pixels]),
    ]);
    Part { name: None, position: [0, 0], size: SIZE, channels }
}

impl Part {
    fn values(&mut self, name: &str) -> &mut Vec<f32> {
        let channel = self.channels.iter_mut().find(|(known, _)| known == name).unwrap();
        match &mut channel.1 {
            FlatSamples::F32(values) => values,
            _ => panic!("{name} is not float"),
        }
    }
}

fn write(path: &Path, display: [usize; 2], parts: &[Part]) {
    let layers: Vec<_> = parts
        .iter()
        .map(|part| {
            let attributes = LayerAttributes {
                layer_name: part.name.map(Text::from),
                layer_position: Vec2(part.position[0], part.position[1]),
                ..LayerAttributes::default()
            };
            let list = part
                .channels
                .iter()
                .map(|(name, samples)| AnyChannel::new(name.as_str(), samples.clone()))
                .collect();
            Layer::new(
                (part.size[0], part.size[1]),
                attributes,
                Encoding::FAST_LOSSLESS,
                AnyChannels::sort(list),
            )
        })
        .collect();
    let window = IntegerBounds::from_dimensions((display[0], display[1]));
    Image::from_layers(ImageAttributes::new(window), layers).write().to_file(path).unwrap();
}

/// A folder with `a.exr`, and `b.exr` with a change.
fn pair(change: impl FnOnce(&mut Part)) -> TestFolder {
    let at = TestFolder::new();
    let mut changed = part();
    write(&at.path("a.exr"), SIZE, &[part()]);
    change(&mut changed);
    write(&at.path("b.exr"), SIZE, &[changed]);
    at
}

fn diff(at: &TestFolder, more: &[&str]) -> Run {
    let arguments: Vec<_> = ["diff", "a.exr", "b.exr"].iter().chain(more).copied().collect();
    let run = at.run(&arguments);
    assert!(!run.stderr.contains("panicked"), "{run:?}");
    run
}

fn json(run: &Run) -> Value {
    serde_json::from_str(&run.stdout).unwrap_or_else(|error| panic!("{error}: {run:?}"))
}

#[test]
fn equal_pictures_pass() {
    let at = pair(|_| ());
    let run = diff(&at, &[]);
    assert_eq!(run.code, 0, "{run:?}");
    assert!(run.stdout.starts_with("Comparing \"a.exr\" and \"b.exr\"\n"), "{}", run.stdout);
    assert!(run.stdout.contains("  Peak SNR = inf\n") && run.stdout.ends_with("PASS\n"), "{}", run.stdout);
    let quiet = diff(&at, &["-q"]);
    assert_eq!((quiet.code, quiet.stdout.as_str(), quiet.stderr.as_str()), (0, "", ""));
    let all = json(&diff(&at, &["--json"]));
    assert_eq!((all["status"].as_str(), all["psnr"].is_null()), (Some("pass"), true), "JSON has no infinity");
}

#[test]
fn every_exit_code() {
    let at = pair(|part| part.values("R")[30] += 0.05);
    assert_eq!(diff(&at, &["--fail", "0.1"]).code, 1, "a warning, which idiff does not give");
    assert_eq!(diff(&at, &["--fail", "0.1", "--warn", "0.1"]).code, 0);
    let failed = diff(&at, &[]);
    assert_eq!(failed.code, 2);
    assert!(failed.stdout.contains("Max error  = 0.05 @ (6, 1, R)  values are "), "{}", failed.stdout);
    assert!(failed.stdout.ends_with("FAILURE\n"));
    let quiet = diff(&at, &["-q"]);
    assert_eq!((quiet.stdout.as_str(), quiet.stderr.as_str()), ("", "FAILURE\n"));
    write(&at.path("b.exr"), [24, 17], &[part()]);
    let other = diff(&at, &[]);
    assert_eq!(other.code, 3);
    assert!(other.stdout.contains("the display windows differ"), "{}", other.stdout);
    at.write("b.exr", &at.read("a.exr")[..900]);
    let cut = diff(&at, &[]);
    assert_eq!(cut.code, 4);
    assert!(cut.stderr.contains("b.exr") && cut.stderr.contains("OpenEXR"), "{}", cut.stderr);
    at.write("b.exr", "text");
    assert_eq!(diff(&at, &[]).code, 4);
    assert_eq!(at.run(&["diff", "a.exr", "none.exr"]).code, 4);
    at.refuse(&["diff", "a.exr"], &["TEST"]);
    at.refuse(&["diff", "a.exr", "a.exr", "--fail", "nan"], &["--fail", "not negative"]);
    at.refuse(&["diff", "a.exr", "a.exr", "--heatmap", "a.jpg"], &[".png"]);
    at.refuse(&["diff", "a.exr", "a.exr", "-o", "none/d.exr"], &["there is no folder"]);
    at.refuse(&["diff", "a.exr", "a.exr", "-o", "a.exr"], &["is another file of this command"]);
    at.refuse(&["diff", "a.exr", "a.exr", "--metric", "fllip"], &["did you mean \"flip\"?"]);
    let layer = ["diff", "a.exr", "a.exr", "--layer", "depht", "fail=1"];
    let run = at.run(&layer);
    assert_eq!(run.code, 2);
    assert!(run.stderr.contains("did you mean \"depth\"?"), "{}", run.stderr);
}

/// What must fail, however lax the thresholds are.
#[test]
fn lax_thresholds_hide_no_broken_values_and_no_ids() {
    let lax = [
        "--fail",
        "10",
        "--warn",
        "10",
        "--failpercent",
        "100",
        "--failrelative",
        "10",
        "--allowfailures",
        "9999",
    ];
    let broken: [(&str, f32); 5] = [
        ("G", f32::NAN),
        ("G", f32::INFINITY),
        ("depth.T", f32::NEG_INFINITY),
        ("A", f32::NAN),
        ("object.I", 3.0),
    ];
    for (name, value) in broken {
        let at = pair(|part| part.values(name)[77] = value);
        let run = diff(&at, &lax);
        assert_eq!(run.code, 2, "{name} {value}: {run:?}");
        let found = json(&diff(&at, &[&lax[..], &["--json"]].concat()));
        assert_eq!(found["status"], "fail");
        let finite = value.is_finite();
        assert_eq!(found["non_finite"]["count"], i32::from(!finite), "{name}");
        if !finite {
            let first = &found["non_finite"]["first"];
            assert_eq!((&first["x"], &first["y"], &first["channel"]), (&5.into(), &3.into(), &name.into()));
            assert!(run.stdout.contains("1 values are NaN or Inf in one picture alone"), "{}", run.stdout);
        }
    }
    // NaN the other way round, everywhere, and in both
    let at = pair(|part| part.values("R").fill(f32::NAN));
    assert_eq!(at.run(&["diff", "b.exr", "a.exr", "--fail", "1", "--warn", "1"]).code, 2);
    assert_eq!(at.run(&["diff", "b.exr", "b.exr"]).code, 0);
    assert_eq!(diff(&at, &["--layer", "R", "ignore"]).code, 0);
}

#[test]
fn a_shifted_picture_fails() {
    let at = pair(|part| {
        for name in ["R", "G", "B"] {
            part.values(name).rotate_right(1);
        }
    });
    assert_eq!(diff(&at, &["--fail", "0.01"]).code, 2);
    assert_eq!(
        diff(&at, &["--metric", "flip", "--metricfail", "0.01", "--fail", "9", "--warn", "9"]).code,
        2
    );
    assert_eq!(diff(&at, &["--hardfail", "0.01", "--fail", "9", "--warn", "9"]).code, 2, "idiff passes this");
}

#[test]
fn other_names_parts_and_windows_are_other_pictures() {
    let renamed = pair(|part| part.channels[4].0 = "depth.Z".into());
    let run = diff(&renamed, &[]);
    assert_eq!(run.code, 3);
    assert!(run.stdout.contains("missing depth.T") && run.stdout.contains("new depth.Z"), "{}", run.stdout);
    let found = diff(&renamed, &["--json"]);
    assert_eq!((found.code, json(&found)["status"].as_str()), (3, Some("different")));
    let at = TestFolder::new();
    let named = |name| Part { name: Some(name), ..part() };
    write(&at.path("a.exr"), SIZE, &[named("one"), named("two")]);
    write(&at.path("b.exr"), SIZE, &[named("two"), named("one")]);
    assert_eq!(diff(&at, &[]).code, 0, "parts are matched by name");
    write(&at.path("b.exr"), SIZE, &[named("two"), named("one"), named("more")]);
    let run = diff(&at, &[]);
    assert_eq!(run.code, 3);
    assert!(run.stdout.contains("the part \"more\" is new"), "{}", run.stdout);
    // a part's difference is found, and named
    let mut changed = named("two");
    changed.values("B")[0] = 9.0;
    write(&at.path("b.exr"), SIZE, &[named("one"), changed]);
    let run = diff(&at, &[]);
    assert_eq!(run.code, 2);
    assert!(run.stdout.contains("@ (0, 0, two: B)"), "{}", run.stdout);
}

#[test]
fn a_crop_is_compared_only_if_asked() {
    let at = pair(|part| {
        part.position = [4, 2];
        part.size = [10, 8];
        for (_, samples) in &mut part.channels {
            let FlatSamples::F32(values) = samples else { panic!("float") };
            let rows = (2..10).flat_map(|y| (4..14).map(move |x| y * SIZE[0] + x));
            *values = rows.map(|index| values[index]).collect();
        }
    });
    let run = diff(&at, &[]);
    assert_eq!(run.code, 3);
    assert!(run.stdout.contains("--overlap"), "{}", run.stdout);
    let run = diff(&at, &["--overlap"]);
    assert_eq!(run.code, 0, "{run:?}");
    assert!(run.stdout.contains("only the 10x8 at 4,2 that both have are compared"), "{}", run.stdout);
    assert_eq!(json(&diff(&at, &["--overlap", "--json"]))["pixels"], 80);
}

#[test]
fn pixels_outside_of_a_window_can_be_black() {
    let crop = |part: &mut Part, values: &dyn Fn(usize, &str) -> f32| {
        part.position = [4, 2];
        part.size = [10, 8];
        for (name, samples) in &mut part.channels {
            let rows = (2..10).flat_map(|y| (4..14).map(move |x| y * SIZE[0] + x));
            *samples = FlatSamples::F32(rows.map(|index| values(index, name)).collect());
        }
    };
    // a picture that is black but for the crop, and the crop alone
    let at = TestFolder::new();
    let (mut whole, mut part) = (part(), part());
    let inside = |index: usize| (4..14).contains(&(index % SIZE[0])) && (2..10).contains(&(index / SIZE[0]));
    for (_, samples) in &mut whole.channels {
        let FlatSamples::F32(values) = samples else { panic!("float") };
        for (index, value) in values.iter_mut().enumerate() {
            *value = if inside(index) { 0.25 } else { 0.0 };
        }
    }
    crop(&mut part, &|_, _| 0.25);
    write(&at.path("a.exr"), SIZE, &[whole.clone()]);
    write(&at.path("b.exr"), SIZE, &[part]);
    let run = diff(&at, &[]);
    assert!(run.code == 3 && run.stdout.contains("--outside black"), "{run:?}");
    let run = diff(&at, &["--outside", "black", "--json"]);
    assert_eq!((run.code, &json(&run)["pixels"]), (0, &(24 * 16).into()), "{run:?}");
    // light outside of the crop is a difference, which --overlap does not see
    whole.values("G")[0] = 0.5;
    write(&at.path("a.exr"), SIZE, &[whole]);
    assert_eq!(diff(&at, &["--overlap"]).code, 0);
    let run = diff(&at, &["--outside", "black"]);
    assert!(run.code == 2 && run.stdout.contains("0.5 @ (0, 0, G)"), "{run:?}");
    let run = diff(&at, &["--outside", "black", "--max-pixels", "383"]);
    assert!([3, 4].contains(&run.code), "{run:?}");
    assert_eq!(diff(&at, &["--outside", "black", "--overlap"]).code, 2);
    assert_eq!(diff(&at, &["--outside", "white"]).code, 2);
}

#[test]
fn layers_have_their_own_thresholds() {
    let at = pair(|part| {
        part.values("depth.T")[5] += 0.01;
        part.values("normal.X")[6] = 0.001;
        part.values("object.I")[7] = 5.0;
    });
    assert_eq!(diff(&at, &[]).code, 2);
    let rules = [
        "--layer",
        "depth",
        "fail=0.1,warn=0.1",
        "--layer",
        "normal",
        "degrees=1",
        "--layer",
        "object.I",
        "allowfailures=1",
    ];
    assert_eq!(diff(&at, &rules).code, 0, "{:?}", diff(&at, &rules));
    let stricter = [&rules[..], &["--layer", "normal", "degrees=0.01"]].concat();
    let run = diff(&at, &stricter);
    assert_eq!(run.code, 2, "the last rule counts");
    assert!(run.stdout.contains("Max angle  = 0.0572958 degrees @ (6, 0)"), "{}", run.stdout);
    assert!(run.stdout.contains("% of the ids are equal"), "{}", run.stdout);
}

#[test]
fn the_spellings_of_idiff_work() {
    let at = pair(|part| part.values("R")[30] += 0.05);
    assert_eq!(diff(&at, &["-fail", "0.1", "-warn", "0.1"]).code, 0);
    assert_eq!(diff(&at, &["-failpercent", "1", "-warnpercent", "1", "-q"]).code, 0);
    assert_eq!(diff(&at, &["-failpercent", "1", "-hardfail", "0.01"]).code, 2);
    assert_eq!(diff(&at, &["-allowfailures", "1"]).code, 0);
    assert_eq!(diff(&at, &["-failrelative", "0.5", "-warnrelative", "0.5", "-a"]).code, 0);
    assert_eq!(diff(&at, &["-fail", "0.1", "-hardwarn", "0.01", "-warn", "1"]).code, 1);
    assert_eq!(at.run(&["diff", "a.exr", "a.exr", "-od", "-o", "same.exr"]).code, 0);
    assert!(!at.files().contains(&"same.exr".to_owned()), "no file without a difference");
    assert_eq!(diff(&at, &["-o", "d.exr", "-od", "-abs", "-scale", "10"]).code, 2);
    let made = read_layers(&at.path("d.exr")).unwrap();
    let Numbers::Real(red) = &made.parts[0].channel("R").unwrap().numbers else { panic!("float") };
    assert!((red[30] - 0.5).abs() < 1e-5 && red.iter().filter(|value| **value != 0.0).count() == 1);
    // a folder has the file of the same name
    std::fs::create_dir(at.path("new")).unwrap();
    std::fs::copy(at.path("b.exr"), at.path("new/a.exr")).unwrap();
    assert_eq!(at.run(&["diff", "a.exr", "new"]).code, 2);
    assert_eq!(at.run(&["diff", "a.exr", "new", "--fail", "1", "--warn", "1"]).code, 0);
}

#[test]
fn json_has_the_keys_that_programs_rely_on() {
    let at = pair(|part| {
        part.values("R")[30] = 0.0;
        part.values("B")[31] += 0.01;
    });
    let run = diff(&at, &["--json", "--metric", "relmse", "--metric", "flip"]);
    assert_eq!((run.code, run.stderr.as_str()), (2, ""));
    let found = json(&run);
    let max = &found["max_error"];
    assert_eq!((&max["x"], &max["y"], &max["channel"]), (&6.into(), &1.into(), &"R".into()));
    assert_eq!((max["test"].as_f64(), max["value"].as_f64()), (Some(0.0), max["reference"].as_f64()));
    assert_eq!((&found["failing"], &found["warning"]), (&2.into(), &2.into()));
    let value = max["value"].as_f64().unwrap();
    let mean = (value + 0.01) / (9 * SIZE[0] * SIZE[1]) as f64;
    assert!((found["mean_error"].as_f64().unwrap() / mean - 1.0).abs() < 1e-5);
    assert!(found["rms_error"].as_f64().unwrap() > mean && found["psnr"].as_f64().unwrap() > 20.0);
    assert_eq!(found["metric"]["name"], "relmse");
    assert_eq!(found["metrics"][1]["name"], "flip");
    assert_eq!(found["layers"][0]["name"], "color");
    assert_eq!(found["layers"][0]["channels"][0]["name"], "R");
    assert_eq!(found["worst"][0]["x"], 6);
}

#[test]
fn pictures_and_pages_are_written() {
    let at = pair(|part| part.values("R")[30] = 0.0);
    let files = [
        "--heatmap",
        "h.png",
        "--sidebyside",
        "s.png",
        "--flip",
        "f.png",
        "--html",
        "p.html",
        "--junit",
        "j.xml",
    ];
    let run = diff(&at, &files);
    assert_eq!(run.code, 2);
    assert!(
        run.stdout.contains("h.png: greatest absolute difference of the colours, from 0 (black) to"),
        "{}",
        run.stdout
    );
    let size = |name: &str| {
        let read = read_layers(&at.path(name)).unwrap();
        [read.display.width, read.display.height]
    };
    assert_eq!((size("h.png"), size("s.png"), size("f.png")), ([24, 16], [3 * 24 + 8, 16], [24, 16]));
    let heat = read_layers(&at.path("h.png")).unwrap();
    let green = heat.parts[0].channel("G").unwrap();
    assert!(green.value(30) > 0.9 && green.value(31) < 0.01, "one bright pixel");
    let text = |name: &str| String::from_utf8(at.read(name)).unwrap();
    assert!(at.read("f.png").windows(4).filter(|bytes| bytes == b"fcTL").count() == 2, "two frames");
    let page = text("p.html");
    assert!(page.matches("data:image/png;base64,").count() == 5 && page.contains("class=\"wipe\""));
    assert!(!page.contains("http:") && !page.contains("https:") && page.contains("FAIL"));
    let mut reader = quick_xml::Reader::from_str(Box::leak(text("j.xml").into_boxed_str()));
    let (mut cases, mut failures) = (0, 0);
    loop {
        use quick_xml::events::Event;
        match reader.read_event().unwrap() {
            Event::Start(tag) | Event::Empty(tag) => match tag.name().as_ref() {
                "testcase" => cases += 1,
                "failure" => failures += 1,
                _ => {}
            },
            Event::Eof => break,
            _ => {}
        }
    }
    assert_eq!((cases, failures), (5, 2), "the picture and four layers");
    let run = diff(&at, &["--heatmap", "h.png", "--metric", "flip"]);
    assert!(run.stdout.contains("h.png: flip, from 0 (black) to 1"), "{}", run.stdout);
}

#[test]
fn png_files_are_compared_as_they_are() {
    let at = pair(|part| part.values("R")[30] = 0.0);
    for name in ["a", "b"] {
        let (exr, png) = (format!("{name}.exr"), format!("{name}.png"));
        diff(&at, &["--sidebyside", "x.png"]);
        assert_eq!(at.run(&["diff", &exr, &exr, "--sidebyside", &png]).code, 0);
    }
    let run = at.run(&["diff", "a.png", "b.png"]);
    assert_eq!(run.code, 2);
    assert!(run.stdout.contains("sRGB curve"), "{}", run.stdout);
    let found = json(&at.run(&["diff", "a.png", "b.png", "--json"]));
    let steps = found["max_error"]["value"].as_f64().unwrap() * 255.0;
    assert!((steps - steps.round()).abs() < 1e-4 && steps > 1.0, "{steps}");
}

#[test]
fn renders_are_told_apart_from_their_noise() {
    let at = TestFolder::new();
    at.write("lit.toml", format!("[render]\naovs = [\"variance\"]\n{}", common::SCENE));
    let render = |name: &str, more: &[&str]| {
        let base = ["render", "lit.toml", "--size", "24x24", "--spp", "64", "-o", name];
        at.succeed(&[&base[..], more].concat());
    };
    render("a.exr", &[]);
    render("b.exr", &["--seed", "1"]);
    assert_eq!(diff(&at, &[]).code, 2);
    let run = diff(&at, &["--ztest", "--json"]);
    assert_eq!(run.code, 0, "{run:?}");
    let found = json(&run);
    assert_eq!(found["layers"][0]["judged_by"], "ztest");
    assert!(found["ztest"]["values"].as_u64().unwrap() > 100, "{found}");
    let notes = found["notes"].to_string();
    assert!(notes.contains("the seeds differ (0 against 1)"), "{notes}");
    let command = found["worst"][0]["command"].as_str().unwrap();
    assert!(
        command.starts_with("trimray render SCENE --size 24x24 --crop ")
            && command.contains("--spp 64 --seed 1"),
        "{command}"
    );
    // the command gives that pixel
    let words: Vec<_> =
        command.split(' ').skip(1).map(|word| if word == "SCENE" { "lit.toml" } else { word }).collect();
    at.succeed(&words);
    assert_eq!(at.run(&["diff", "b.exr", "worst.exr", "--overlap"]).code, 0);
    // another scene is not explained by noise, and said to be another
    at.write("lit.toml", String::from_utf8(at.read("lit.toml")).unwrap().replace("90.0", "80.0"));
    render("b.exr", &["--seed", "1"]);
    let run = diff(&at, &["--ztest"]);
    assert_eq!(run.code, 2, "{run:?}");
    assert!(
        run.stdout.contains("the scenes differ") && run.stdout.contains("NOT explained"),
        "{}",
        run.stdout
    );
    at.succeed(&["render", "scene.toml", "--size", "24x24", "--spp", "1", "-o", "plain.exr"]);
    let run = at.run(&["diff", "plain.exr", "plain.exr", "--ztest"]);
    assert_eq!(run.code, 2);
    assert!(run.stderr.contains("aovs = [\"variance\"]"), "{}", run.stderr);
}
