//! The real program's `test`: references made, met, missed, missing, and of others.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::fs;

use common::{CUBE, Run, TestFolder};
use serde_json::Value;
use trimray::film::{Numbers, read_layers, write_layers};

const FILM: &str = "\
[camera]
origin = [3.0, -4.0, 2.0]
target = [0.5, 0.5, 0.5]
[film]
size = [32, 24]
[render]
spp = 32
";

const OBJECT: &str = "\
[[object]]
name = \"cube\"
mesh = \"cube.obj\"
";

/// A folder with the scenes `cube` and `tilted` in `all`.
fn scenes() -> TestFolder {
    let at = TestFolder::new();
    fs::create_dir(at.path("all")).unwrap();
    at.write("all/cube.obj", CUBE);
    at.write("all/cube.toml", format!("{FILM}{OBJECT}"));
    at.write(
        "all/tilted.toml",
        format!("{FILM}aovs = [\"depth\"]\n{OBJECT}transform = [{{ scale = 0.7 }}]\n"),
    );
    at
}

/// The same with references.
fn blessed() -> TestFolder {
    let at = scenes();
    let run = at.succeed(&["test", "all", "--bless", "cube", "--bless", "tilted", "--spp", "64"]);
    assert!(run.stdout.contains("cube.exr: 64 samples per pixel"), "{run:?}");
    at
}

fn fails(at: &TestFolder, more: &[&str]) -> Run {
    let arguments: Vec<_> = ["test", "all"].iter().chain(more).copied().collect();
    let run = at.run(&arguments);
    assert_eq!(run.code, 1, "{run:?}");
    assert!(!run.stderr.contains("panicked"), "{run:?}");
    run
}

fn text(at: &TestFolder, name: &str) -> String {
    String::from_utf8(at.read(name)).unwrap()
}

/// Writes the reference of `cube` with these channels alone, a value of the first one changed, and nothing recorded.
fn change(at: &TestFolder, keep: &[&str], index: usize, by: f32) {
    let mut picture = read_layers(&at.path("all/cube.exr")).unwrap();
    picture.parts[0].channels.retain(|channel| keep.contains(&channel.name.as_str()));
    match &mut picture.parts[0].channels[0].numbers {
        Numbers::Real(values) => values[index] += by,
        Numbers::Whole(_) => panic!("colours are real"),
    }
    write_layers(&at.path("all/cube.exr"), &picture).unwrap();
}

#[test]
fn blessed_scenes_pass() {
    let at = blessed();
    let recorded = read_layers(&at.path("all/tilted.exr")).unwrap().recorded;
    assert_eq!((recorded.seed.as_deref(), recorded.spp.as_deref()), (Some("0"), Some("64")));
    let run = at.succeed(&["test", "all", "--junit", "results.xml"]);
    assert!(run.stdout.starts_with("pass cube: ") && run.stdout.contains("\npass tilted: "), "{run:?}");
    assert!(run.stdout.contains("values pass, largest |z|") && run.stdout.contains(", FLIP "), "{run:?}");
    assert!(run.stdout.contains("not compared, since other samples hit other places: depth"), "{run:?}");
    assert!(run.stdout.ends_with("2 pass, 0 fail; see trimray_test.html\n"), "{run:?}");
    let page = text(&at, "trimray_test.html");
    assert!(page.contains("2 of 2 scenes pass") && !page.contains("<section"), "{}", page.len());
    assert_eq!(page.matches("data:image/png;base64,").count(), 6);
    assert!(!page.contains("http"), "no network");
    assert!(text(&at, "results.xml").contains(r#"tests="2" failures="0""#));
    // the same seed, though another one is demanded, is not that of the reference
    at.succeed(&["test", "all", "cube", "--seed", "0", "-q", "-o", "other.html"]);
    let one = at.succeed(&["test", "all", "--filter", "ilt", "--json"]);
    let all: Value = serde_json::from_str(&one.stdout).unwrap();
    assert_eq!((&all["status"], &all["passed"]), (&Value::from("pass"), &Value::from(1)));
    assert_eq!(all["scenes"][0]["name"], "tilted");
    assert_eq!(all["scenes"][0]["judged_by"], "z-test");
}

#[test]
fn references_come_from_three_places() {
    let at = blessed();
    fs::create_dir(at.path("kept")).unwrap();
    for name in ["cube", "tilted"] {
        fs::rename(at.path(&format!("all/{name}.exr")), at.path(&format!("kept/{name}.exr"))).unwrap();
    }
    at.succeed(&["test", "all", "--references", "kept"]);
    fails(&at, &[]);
    // refs/NAME.exr and refs/scenes/NAME.toml
    fs::rename(at.path("all"), at.path("kept/scenes")).unwrap();
    at.succeed(&["test", "kept"]);
    at.succeed(&["test", "kept/scenes"]);
    fs::rename(at.path("kept/cube.exr"), at.path("kept/lost.exr")).unwrap();
    let run = at.run(&["test", "kept"]);
    assert!(run.stderr.contains("lost.exr: no scene has this reference"), "{run:?}");
    let missing = "there is no reference kept/cube.exr; --bless cube makes it";
    assert!(run.code == 1 && run.stdout.replace('\\', "/").contains(missing), "{run:?}");
    at.succeed(&["test", "kept", "--bless", "cube", "-q"]);
    at.succeed(&["test", "kept"]);
}

#[test]
fn changed_scenes_fail() {
    let at = blessed();
    let brighter = "[[light]]\ntype = \"constant\"\nradiance = [1.1, 1.0, 1.0]\n";
    at.write("all/cube.toml", format!("{FILM}{brighter}{OBJECT}"));
    let run = fails(&at, &["--junit", "results.xml", "-o", "page.html"]);
    assert!(run.stdout.contains("FAIL cube: ") && run.stdout.contains("pass tilted"), "{run:?}");
    for part in ["is of another scene; --bless cube makes it anew", "noise does not explain the difference"] {
        assert!(run.stdout.contains(part), "{part} is not in {run:?}");
    }
    assert!(run.stdout.contains("note: the scenes differ"), "{run:?}");
    assert!(run.stdout.ends_with("1 pass, 1 fail; see page.html\n"), "{run:?}");
    let page = text(&at, "page.html");
    assert!(page.contains("<section id=\"cube\">") && page.contains("1 of 2 scenes pass, 1 fail"));
    assert!(page.contains("<details id=\"tilted\">"));
    let xml = text(&at, "results.xml");
    assert!(xml.contains(r#"tests="2" failures="1""#) && xml.contains("is of another scene"), "{xml}");
    let quiet = fails(&at, &["-q"]);
    assert!(quiet.stdout.starts_with("FAIL cube") && !quiet.stdout.contains("pass tilted"), "{quiet:?}");
    at.succeed(&["test", "all", "--bless", "cube"]);
    at.succeed(&["test", "all"]);
    // one that cannot be read is a failure among others
    at.write("all/cube.toml", "[film]\nsise = [32, 24]\n");
    let broken = fails(&at, &[]);
    assert!(broken.stdout.contains("sise") && broken.stdout.contains("pass tilted"), "{broken:?}");
}

#[test]
fn other_sizes_and_files_fail() {
    let at = blessed();
    at.write("all/cube.toml", format!("{}{OBJECT}", FILM.replace("32, 24", "24, 32")));
    assert!(fails(&at, &[]).stdout.contains("24x32"));
    at.write("all/cube.exr", "no picture");
    assert!(fails(&at, &[]).stdout.contains("cube.exr"));
    fs::remove_file(at.path("all/cube.exr")).unwrap();
    let run = fails(&at, &["cube"]);
    assert!(run.stdout.contains("there is no reference") && run.stdout.contains("0 pass, 1 fail"), "{run:?}");
}

#[test]
fn references_of_others_stay() {
    let at = blessed();
    let own = at.read("all/cube.exr");
    let place = own.windows(8).position(|bytes| bytes == b"trimray ").unwrap();
    let mut bytes = own.clone();
    bytes[place..place + 8].copy_from_slice(b"Mitsuba ");
    at.write("all/cube.exr", &bytes);
    at.refuse(&["test", "all", "--bless", "cube"], &["cube.exr: is a picture by Mitsuba", "--force"]);
    assert_eq!(at.read("all/cube.exr"), bytes);
    at.succeed(&["test", "all", "--bless", "cube", "--spp", "64", "--force"]);
    assert_eq!(at.read("all/cube.exr"), own, "the same command, the same bytes");
    at.write("all/cube.exr", "precious");
    at.refuse(&["test", "all", "--bless", "cube"], &["is no picture that this program wrote"]);
}

#[test]
fn references_without_variance_are_met_exactly() {
    let at = scenes();
    at.succeed(&["render", "all/cube.toml", "-o", "all/cube.exr"]);
    at.succeed(&["render", "all/tilted.toml", "-o", "all/tilted.exr"]);
    let run = at.succeed(&["test", "all"]);
    assert!(run.stdout.contains("pass cube: identical, FLIP 0.0000\npass tilted: identical"), "{run:?}");
    assert!(fails(&at, &["--ztest"]).stdout.contains("the z-test needs a reference with variance"));
    // a picture of red alone, as another program may write it
    change(&at, &["R"], 40, 0.01);
    let off = fails(&at, &["cube"]);
    assert!(
        off.stdout.contains("1 of 768 pixels differ (color), most by") && off.stdout.contains("(8, 1, R)")
    );
    at.succeed(&["test", "all", "cube", "--fail", "0.1"]);
}

#[test]
fn values_that_are_not_finite_fail() {
    let at = blessed();
    let colours = ["R", "G", "B", "variance.R", "variance.G", "variance.B"];
    change(&at, &colours, 7, f32::NAN);
    let run = fails(&at, &["cube"]);
    assert!(run.stdout.contains("the reference has 1 values that are not finite: NaN at (7, 0, "), "{run:?}");
}

#[test]
fn bad_input_is_refused() {
    let at = blessed();
    fs::create_dir(at.path("empty")).unwrap();
    at.refuse(&["test", "empty"], &["empty: there are no scenes"]);
    at.refuse(&["test", "nowhere"], &["nowhere: "]);
    at.refuse(&["test", "all", "cub"], &["cub: there is no such scene; did you mean \"cube\"?"]);
    at.refuse(&["test", "all", "--filter", "sphere"], &["no scene has this in its name"]);
    at.refuse(&["test", "all", "--bless", "cub"], &["--bless cub: there is no such scene"]);
    at.refuse(&["test", "all", "--bless", "cube", "--spp", "1"], &["at least 2 samples"]);
    at.refuse(&["test", "all", "--spp", "4"], &["--bless"]);
    at.refuse(&["test", "all", "-o", "page.txt"], &["must end in .html"]);
    at.refuse(&["test", "all", "--references", "nowhere"], &["nowhere: "]);
}
