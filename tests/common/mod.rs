//! Runs the real program in a folder of its own.

#![allow(dead_code, unreachable_pub, reason = "each test crate uses a part of this module")]
#![allow(clippy::missing_panics_doc, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// The unit cube of 12 triangles.
pub const CUBE: &str = "\
v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1
f 1 3 4\nf 1 4 2\nf 5 6 8\nf 5 8 7\nf 1 2 6\nf 1 6 5\nf 3 7 8\nf 3 8 4\nf 1 5 7\nf 1 7 3\nf 2 4 8\nf 2 8 6
";

/// A cube twisted by a lattice.
pub const SCENE: &str = r#"
[[object]]
name = "cube"
mesh = "cube.obj"
[[object.deform]]
type = "ffd"
degree = [2, 2, 2]
points = [4, 4, 4]
[[object.deform.edit]]
twist = { axis = "z", angle = 90.0 }
"#;

/// A folder with files, and the program run in it.
pub struct TestFolder {
    folder: tempfile::TempDir,
}

/// What a run gave.
#[derive(Debug)]
pub struct Run {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl TestFolder {
    /// A folder with `cube.obj` and `scene.toml`.
    pub fn new() -> Self {
        let folder = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        folder.write("cube.obj", CUBE);
        folder.write("scene.toml", SCENE);
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).expect("the folder is writable");
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Names of all files, sorted.
    pub fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path()).expect("the folder is there");
        let mut names: Vec<_> = entries
            .map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_trimray"));
        command.current_dir(self.folder.path()).args(arguments).stdin(Stdio::null());
        command
    }

    pub fn run(&self, arguments: &[&str]) -> Run {
        Run::of(self.command(arguments).output().expect("the program starts"))
    }

    /// Runs and demands success.
    pub fn succeed(&self, arguments: &[&str]) -> Run {
        let run = self.run(arguments);
        assert_eq!(run.code, 0, "trimray {arguments:?}: {run:?}");
        run
    }

    /// Runs and demands exit code 2 with a message that has all the given parts, no panic, and no new file.
    pub fn refuse(&self, arguments: &[&str], parts: &[&str]) -> Run {
        let before = self.files();
        let run = self.run(arguments);
        assert_eq!(run.code, 2, "trimray {arguments:?}: {run:?}");
        for part in parts {
            assert!(run.stderr.contains(part), "{part:?} is not in:\n{}", run.stderr);
        }
        assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
        assert_eq!(run.stdout, "", "results only on success");
        assert_eq!(self.files(), before, "nothing is written");
        run
    }

    /// Writes a scene with one edit of [`SCENE`]'s text and demands that `info` refuses it.
    pub fn refuse_scene(&self, from: &str, to: &str, parts: &[&str]) {
        assert!(SCENE.contains(from), "{from:?} is in the scene");
        self.write("scene.toml", SCENE.replace(from, to));
        self.refuse(&["info", "scene.toml"], parts);
        self.write("scene.toml", SCENE);
    }
}

impl Run {
    pub fn of(output: Output) -> Self {
        Self {
            code: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

/// A float64 `.npy` file.
pub fn npy(shape: &[usize], values: &[f64]) -> Vec<u8> {
    let extents: Vec<_> = shape.iter().map(|extent| format!("{extent},")).collect();
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}), }}\n", extents.join(" "));
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(u16::try_from(header.len()).expect("a short header").to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

/// The repository's own folder.
pub fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}
