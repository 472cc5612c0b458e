//! What the real program writes, and what it must leave alone.

mod common;

use std::fs;

use common::{CUBE, SCENE, TestFolder, npy};

/// Runs a command that must be refused, and demands that all files keep their bytes.
fn refuse(at: &TestFolder, arguments: &[&str], part: &str) {
    let files: Vec<_> = at.files().into_iter().filter(|name| at.path(name).is_file()).collect();
    let before: Vec<_> = files.iter().map(|name| at.read(name)).collect();
    at.refuse(arguments, &[part, "another name is needed"]);
    for (name, bytes) in files.iter().zip(before) {
        assert!(at.read(name) == bytes, "{name} after {arguments:?}");
    }
}

#[test]
fn outputs_that_are_inputs_are_refused() {
    let at = TestFolder::new();
    let points: Vec<f64> =
        (0..27).flat_map(|i| [i / 9, i / 3 % 3, i % 3].map(|x| f64::from(x) / 2.0)).collect();
    at.write("lattice.npy", npy(&[3, 3, 3, 3], &points));
    at.write("rays.npz", npy(&[1, 6], &[0.5, 0.5, 3.0, 0.0, 0.0, -1.0]));
    let lattice = SCENE
        .replace("points = [4, 4, 4]", "points = [3, 3, 3]")
        .replace("twist = { axis = \"z\", angle = 90.0 }", "control_points = \"lattice.npy\"");
    let scene = format!(
        "[[material]]\nname = \"m\"\ntype = \"diffuse\"\nreflectance = {{ texture = \"wood.png\" }}\n{lattice}"
    );
    at.write("scene.toml", scene);
    at.write("wood.png", at.read("cube.obj"));
    refuse(&at, &["export", "scene.toml", "-o", "cube.obj"], "cube.obj: is read by this command");
    refuse(&at, &["export", "scene.toml", "-o", "./cube.obj"], "./cube.obj: is ");
    refuse(&at, &["export", "scene.toml", "-o", "lattice.npy"], "lattice.npy");
    refuse(&at, &["export", "scene.toml", "-o", "scene.toml", "--format", "json"], "scene.toml");
    refuse(&at, &["render", "scene.toml", "-o", "wood.png"], "wood.png");
    refuse(&at, &["render", "scene.toml", "-o", "a.exr", "--checkpoint", "cube.obj"], "cube.obj");
    refuse(&at, &["trace", "scene.toml", "--rays", "rays.npz", "-o", "rays.npz"], "rays.npz");
    fs::hard_link(at.path("cube.obj"), at.path("twin.obj")).unwrap();
    refuse(&at, &["export", "scene.toml", "-o", "twin.obj"], "twin.obj: is ");
    fs::create_dir(at.path("inner")).unwrap();
    refuse(&at, &["export", "scene.toml", "-o", "inner/../cube.obj"], "cube.obj");
    at.write("scene.toml", SCENE);
    at.succeed(&["export", "scene.toml", "-o", "other.obj"]);
}

#[test]
fn exports_to_folders_replace_no_inputs() {
    let at = TestFolder::new();
    at.succeed(&["export", "scene.toml", "--format", "mitsuba", "-o", "made"]);
    fs::write(at.path("made/meshes/own.obj"), CUBE).unwrap();
    at.write("scene.toml", SCENE.replace("cube.obj", "made/meshes/own.obj"));
    at.refuse(&["export", "scene.toml", "--format", "mitsuba", "-o", "made"], &["would replace", "own.obj"]);
    assert!(at.path("made/meshes/own.obj").exists());
}

#[cfg(unix)]
mod unix {
    use std::fs::{self, Permissions};
    use std::os::unix::fs::{PermissionsExt, symlink};
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    use super::common::{Run, TestFolder};

    #[test]
    fn links_are_followed() {
        let at = TestFolder::new();
        fs::create_dir(at.path("far")).unwrap();
        symlink("far/made.obj", at.path("link.obj")).unwrap();
        for _ in 0..2 {
            at.succeed(&["export", "scene.toml", "-o", "link.obj", "--level", "0"]);
            assert!(fs::symlink_metadata(at.path("link.obj")).unwrap().is_symlink());
            assert!(fs::symlink_metadata(at.path("far/made.obj")).unwrap().is_file());
        }
        symlink("cube.obj", at.path("mesh.obj")).unwrap();
        at.refuse(&["export", "scene.toml", "-o", "mesh.obj"], &["mesh.obj: is ", "cube.obj"]);
    }

    #[test]
    fn leftovers_of_killed_runs_are_removed() {
        let at = TestFolder::new();
        at.write(".a.obj.4000000-0.part", "half");
        at.succeed(&["export", "scene.toml", "-o", "a.obj", "--level", "0"]);
        assert_eq!(at.files(), ["a.obj", "cube.obj", "scene.toml"]);
    }

    #[test]
    fn what_cannot_be_written_is_one_message() {
        let at = TestFolder::new();
        fs::create_dir(at.path("folder.exr")).unwrap();
        at.refuse(&["render", "scene.toml", "-o", "folder.exr"], &["folder.exr: is a folder"]);
        fs::create_dir(at.path("locked")).unwrap();
        fs::set_permissions(at.path("locked"), Permissions::from_mode(0o555)).unwrap();
        let is_root = fs::write(at.path("locked/probe"), "").is_ok();
        let run = at.run(&["render", "scene.toml", "-o", "locked/a.exr", "--spp", "1"]);
        fs::set_permissions(at.path("locked"), Permissions::from_mode(0o755)).unwrap();
        let says = run.stderr.contains("locked/a.exr: cannot be written") && run.code == 1;
        assert!(is_root || says, "{run:?}");
        // a full disk
        let full =
            at.command(&["info", "scene.toml"]).stdout(fs::File::create("/dev/full").unwrap()).output();
        let run = Run::of(full.unwrap());
        assert!(run.code == 1 && run.stderr.contains("standard output: cannot be written"), "{run:?}");
        let run = at.run(&["export", "scene.toml", "--format", "obj", "--level", "0", "-o", "/dev/full"]);
        assert!(run.code == 1 && run.stderr.contains("/dev/full: cannot be written"), "{run:?}");
    }

    #[test]
    fn closed_pipes_are_no_fault() {
        let at = TestFolder::new();
        let program = env!("CARGO_BIN_EXE_trimray");
        // both outputs go to a reader that has gone when they come
        let script = "{ sleep 0.2; \"$@\" 2>&1; echo $? >code; } | true; sleep 0.1; while ! test -s code; do sleep 0.05; done";
        for (arguments, want) in [(["info", "scene.toml"], "0"), (["info", "nothing.toml"], "2")] {
            let _ = fs::remove_file(at.path("code"));
            let mut command = Command::new("sh");
            command.args(["-c", script, "sh", program]).args(arguments).current_dir(at.path(""));
            command.status().unwrap();
            assert_eq!(fs::read_to_string(at.path("code")).unwrap().trim(), want, "{arguments:?}");
        }
    }

    #[test]
    fn the_signal_to_end_is_as_ctrl_c() {
        let at = TestFolder::new();
        for signal in ["TERM", "INT"] {
            let render = ["render", "scene.toml", "-o", "a.exr", "--spp", "1000000", "--size", "64x64"];
            let child = at.command(&render).stderr(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
            std::thread::sleep(Duration::from_millis(1500));
            let started = Instant::now();
            let sent = Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).status();
            assert!(sent.unwrap().success());
            let run = Run::of(child.wait_with_output().unwrap());
            assert!(run.code == 1 && run.stderr.contains("interrupted"), "{signal}: {run:?}");
            assert!(started.elapsed() < Duration::from_secs(20));
            assert_eq!(at.files(), ["cube.obj", "scene.toml"]);
        }
    }
}
