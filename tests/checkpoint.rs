//! Renders that are killed and gone on with, through the real program.

mod common;

use std::fs;
use std::process::Stdio;
use std::time::Duration;

use common::TestFolder;

const FLAGS: [&str; 6] = ["--size", "96x96", "--spp", "160", "--max-depth", "4"];

#[test]
fn killed_renders_go_on_to_the_same_file() {
    let at = TestFolder::new();
    at.succeed(&[&["render", "scene.toml", "-o", "whole.exr"], &FLAGS[..]].concat());
    let whole = fs::read(at.path("whole.exr")).unwrap();
    let mut resumed = 0;
    for round in 0..4_u64 {
        let _ = fs::remove_file(at.path("state"));
        let checkpoint = ["--checkpoint", "state", "--checkpoint-interval", "0.02"];
        for moment in [150 + 170 * round, 100] {
            let resume: &[&str] = if at.path("state").exists() { &["--resume"] } else { &[] };
            resumed += resume.len();
            let start = ["render", "scene.toml", "-o", "killed.exr", "--threads", "1"];
            let mut child = at
                .command(&[&start, &FLAGS[..], &checkpoint, resume].concat())
                .stderr(Stdio::null())
                .spawn()
                .unwrap();
            std::thread::sleep(Duration::from_millis(moment));
            // kill -9; it may have ended by itself
            let _ = child.kill();
            child.wait().unwrap();
        }
        let _ = fs::remove_file(at.path("killed.exr"));
        at.succeed(
            &[&["render", "scene.toml", "-o", "killed.exr", "--resume"], &FLAGS[..], &checkpoint].concat(),
        );
        assert!(fs::read(at.path("killed.exr")).unwrap() == whole, "round {round}");
    }
    assert!(resumed > 0, "no render was killed after it had saved something");
}

/// What is said when a command is refused.
fn refused(at: &TestFolder, arguments: &[&str]) -> String {
    let run = at.run(arguments);
    assert_eq!(run.code, 2, "{}", run.stderr);
    run.stderr
}

#[test]
fn a_checkpoint_of_another_picture_is_refused() {
    let at = TestFolder::new();
    let render =
        ["render", "scene.toml", "-o", "a.exr", "--size", "16x16", "--spp", "16", "--checkpoint", "state"];
    at.succeed(&render);
    let again = refused(&at, &render);
    assert!(again.contains("--resume goes on from it"), "{again}");
    let resume = |flags: &[&'static str]| [&render[..], &["--resume"], flags].concat();
    at.succeed(&resume(&[]));
    let other = refused(&at, &resume(&["--seed", "9"]));
    assert!(other.contains("render.seed differs"), "{other}");
    let text = fs::read_to_string(at.path("scene.toml")).unwrap();
    fs::write(at.path("scene.toml"), text + "\n[[object.deform.edit]]\nmove = [1, 1, 1]\nby = [0.1, 0, 0]\n")
        .unwrap();
    let other = refused(&at, &resume(&[]));
    assert!(other.contains("the scene differs"), "{other}");
    fs::write(at.path("state"), b"nonsense").unwrap();
    let other = refused(&at, &resume(&[]));
    assert!(other.contains("is no checkpoint"), "{other}");
}

#[test]
fn more_samples_go_on_from_a_finished_picture() {
    let at = TestFolder::new();
    let render = |spp: &'static str, output: &'static str| {
        ["render", "scene.toml", "-o", output, "--size", "20x20", "--spp", spp]
    };
    at.succeed(&render("96", "whole.exr"));
    at.succeed(&[&render("32", "a.exr")[..], &["--checkpoint", "state"]].concat());
    at.succeed(&[&render("96", "a.exr")[..], &["--checkpoint", "state", "--resume"]].concat());
    assert!(fs::read(at.path("a.exr")).unwrap() == fs::read(at.path("whole.exr")).unwrap());
}
