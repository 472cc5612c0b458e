//! The fuzz targets on their seeds, without a fuzzer.

#[path = "../fuzz/src/lib.rs"]
#[allow(unreachable_pub, reason = "the targets' own crate gives them to its programs")]
mod targets;

use std::fs;
use std::path::Path;
use std::process::Command;

/// Runs a target on each of its seeds.
fn run(target: &str, body: fn(&[u8])) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds");
    let made = Command::new(script).arg(folder.path()).status().expect("the script runs");
    assert!(made.success(), "the seeds are made");
    let seeds: Vec<_> = fs::read_dir(folder.path().join(target))
        .expect("the target has a folder")
        .map(|entry| entry.expect("readable").path())
        .collect();
    assert!(seeds.len() > 3, "{target} has {} seeds", seeds.len());
    for seed in seeds {
        println!("{}", seed.display());
        body(&fs::read(&seed).expect("readable"));
    }
}

#[test]
fn seeds_of_all_targets_pass() {
    run("obj", targets::obj);
    run("scene", targets::scene);
    run("array", targets::array);
    run("expression", targets::expression);
    run("picture", targets::picture);
    run("rays", targets::rays);
}

#[test]
fn every_target_has_a_program_and_a_place_in_the_manifest() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz");
    let manifest = fs::read_to_string(folder.join("Cargo.toml")).expect("readable");
    for entry in fs::read_dir(folder.join("fuzz_targets")).expect("readable") {
        let path = entry.expect("readable").path();
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let text = fs::read_to_string(&path).expect("readable");
        assert!(text.contains(&format!("trimray_fuzz::{name}(data)")), "{name}");
        assert!(manifest.contains(&format!("path = \"fuzz_targets/{name}.rs\"")), "{name}");
    }
}
