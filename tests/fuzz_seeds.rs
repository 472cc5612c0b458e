//! The fuzz targets on their seeds and on mutations of these, without a fuzzer.
//!
//! `TRIMRAY_EXECUTIONS=N` runs so many mutations for each target (50 without it), `TRIMRAY_SEED=S` others, `TRIMRAY_TARGET=NAME` one
//! target alone. An input that fails is kept, and its place printed.

mod mutation;
#[path = "../fuzz/src/lib.rs"]
#[allow(unreachable_pub, reason = "the targets' own crate gives them to its programs")]
mod targets;

use std::fs;
use std::panic::catch_unwind;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use mutation::{Random, mutated_bytes, mutated_text};
use rayon::prelude::*;

/// Longer than any input may take, however busy the machine.
const PATIENCE: Duration = Duration::from_secs(if cfg!(debug_assertions) { 600 } else { 60 });

/// A whole number of the environment.
fn number(variable: &str, otherwise: u64) -> u64 {
    std::env::var(variable).map_or(otherwise, |text| text.parse().expect("a whole number"))
}

/// Runs a target on each of its seeds, and on mutations of them.
fn run(target: &str, body: fn(&[u8])) {
    if std::env::var("TRIMRAY_TARGET").is_ok_and(|only| only != target) {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds");
    let made = Command::new(script).arg(folder.path()).status().expect("the script runs");
    assert!(made.success(), "the seeds are made");
    let seeds: Vec<_> = fs::read_dir(folder.path().join(target))
        .expect("the target has a folder")
        .map(|entry| entry.expect("readable").path())
        .collect();
    assert!(seeds.len() > 3, "{target} has {} seeds", seeds.len());
    let seeds: Vec<_> = seeds.iter().map(|seed| fs::read(seed).expect("readable")).collect();
    seeds.iter().for_each(|seed| body(seed));
    let (executions, first) = (number("TRIMRAY_EXECUTIONS", 50), number("TRIMRAY_SEED", 1));
    let (failed, longest) = (0..executions)
        .into_par_iter()
        .map(|execution| {
            let mut random = Random::new(first << 40 | execution);
            let seed = random.choose(&seeds).clone();
            let input = match String::from_utf8(seed) {
                Ok(text) if random.below(2) == 0 => mutated_text(&text, &mut random).into_bytes(),
                Ok(text) => mutated_bytes(text.as_bytes(), &mut random),
                Err(binary) => mutated_bytes(binary.as_bytes(), &mut random),
            };
            let started = Instant::now();
            let passed = catch_unwind(|| body(&input)).is_ok();
            let took = started.elapsed();
            if !passed || took > PATIENCE {
                let kept = std::env::temp_dir().join(format!("trimray_{target}_{first}_{execution}"));
                fs::write(&kept, &input).expect("the input is kept");
                eprintln!("{target} {execution}: {took:?}, see {}", kept.display());
            }
            (u64::from(!passed || took > PATIENCE), took)
        })
        .reduce(|| (0, Duration::ZERO), |a, b| (a.0 + b.0, a.1.max(b.1)));
    println!("{target}: {failed} of {executions} failed, {longest:?} at most");
    assert_eq!(failed, 0, "{target} fails");
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
