//! What tracing costs, from one evaluation of a patch to objects of a million patches; one thread.
//!
//! ```text
//! cargo bench --bench kernel                           # all sections, about a minute and a half
//! cargo bench --bench kernel -- --quick                # fewer rays and rounds, no more than 10^4 patches
//! cargo bench --bench kernel -- --section growth       # one of: evaluation patch growth degree objects
//! cargo bench --bench kernel -- --object c --mesh M.obj   # the section of objects, with one of a, b, c alone
//! cargo bench --bench kernel -- --json                 # one JSON object a line instead of tables
//! ```
//!
//! # Sections
//! - evaluation: `BezierPatch::eval`, a point with both partials: independent ones after one another, and each at parameters
//!   that depend on the one before, as in Newton's method
//! - patch: the nearest hit with a scene of one patch, rays that hit; and the interaction of such a hit
//! - growth: a ball of one patch a triangle in a volume of one knot box, from 8 to 10^6 patches
//! - degree: a ball of 968 triangles in a lattice of 6 × 6 × 6 control points of degree 1 to 4
//! - objects: those of the benchmark beside Embree, with its rays, and what the rays meet
//!
//! Rates count rays a second for the nearest hit alone. Time is the sum over chunks of rays of the least of several rounds.
//! Build times are from polygons to the first ray, the least of up to 7; bytes are those of patches and acceleration
//! structure. Counts per ray are `TraceStatistics`.

#[path = "../common/mod.rs"]
mod common;
mod patches;
mod report;
mod scenes;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueEnum};

use report::Report;

/// A part of the benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Section {
    Evaluation,
    Patch,
    Growth,
    Degree,
    Objects,
}

/// What tracing costs.
#[derive(Debug, Parser)]
struct Arguments {
    /// Only this section; may be given several times
    #[arg(long)]
    section: Vec<Section>,
    /// Only this object of the section of objects: a, b or c
    #[arg(long, value_parser = ["a", "b", "c"])]
    object: Option<String>,
    /// OBJ file of object c
    #[arg(long)]
    mesh: Option<PathBuf>,
    /// Fewer rays and rounds, no more than 10^4 patches
    #[arg(long)]
    quick: bool,
    /// One JSON object a line in place of tables
    #[arg(long)]
    json: bool,
    /// Rounds over all rays
    #[arg(long)]
    rounds: Option<usize>,
    /// Given by `cargo bench`
    #[arg(long, hide = true)]
    bench: bool,
}

impl Arguments {
    fn rounds(&self) -> usize {
        self.rounds.unwrap_or(if self.quick { 3 } else { 5 })
    }

    fn wants(&self, section: Section) -> bool {
        if self.section.is_empty() {
            return self.object.is_none() || section == Section::Objects;
        }
        self.section.contains(&section)
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    if !arguments.bench {
        // `cargo test --all-targets` starts benchmarks as well
        println!("not measured: start it by cargo bench --bench kernel");
        return ExitCode::SUCCESS;
    }
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("kernel: {message}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let report = Report { json: arguments.json };
    for section in Section::value_variants().iter().filter(|section| arguments.wants(**section)) {
        let measure = match section {
            Section::Evaluation => patches::evaluation,
            Section::Patch => patches::patch,
            Section::Growth => scenes::growth,
            Section::Degree => scenes::degree,
            Section::Objects => scenes::objects,
        };
        measure(arguments, report)?;
    }
    Ok(())
}
