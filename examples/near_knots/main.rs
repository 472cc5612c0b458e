//! Traces rays at closed solids of random triangles whose vertices and edges lie a hair off knot planes, faces of the lattice's
//! box, and each other, where slivers of patches are:
//!
//! `cargo run --release --example near_knots -- --rays 1000000 --triangles 200 --triangles 20000`
//!
//! Every ray starts or ends inside, so that it must meet the surface; exits with 1 if one passes. The rays do not depend on the
//! number of threads.

mod rays;
mod solids;

use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use rays::{Tally, run};
use solids::{LATTICES, Method, Random, Solid};

/// Rays that share a stream of random numbers, so that results do not depend on the number of threads.
const CHUNK: u64 = 20_000;

/// Traces rays at closed solids of random triangles a hair off knot planes.
#[derive(Debug, Parser)]
struct Options {
    /// Triangles of a solid, about; several times for several
    #[arg(long, default_values_t = [200, 2000, 20_000])]
    triangles: Vec<usize>,
    /// Rays at each solid, for each lattice and method
    #[arg(long, default_value_t = 100_000)]
    rays: u64,
    /// Chooses solids and rays
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only this lattice, from 0 on
    #[arg(long)]
    lattice: Option<usize>,
    /// Only this method: parallelogram, rectangle, triangular
    #[arg(long)]
    method: Option<String>,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let (mut rays, mut passed) = (0, 0);
    for &triangles in &options.triangles {
        for lattice in (0..LATTICES).filter(|lattice| options.lattice.is_none_or(|only| only == *lattice)) {
            for method in Method::ALL {
                let name = format!("{method:?}");
                if options.method.as_ref().is_some_and(|only| !only.eq_ignore_ascii_case(&name)) {
                    continue;
                }
                let random = &mut Random::new(options.seed, (triangles * LATTICES + lattice) as u64);
                let solid = match Solid::new(triangles, lattice, method, random) {
                    Ok(solid) => solid,
                    Err(message) => {
                        eprintln!("{message}");
                        return ExitCode::from(2);
                    }
                };
                let started = Instant::now();
                let tally = run_all(&solid, &options);
                let rate = tally.rays as f64 / started.elapsed().as_secs_f64();
                println!(
                    "{triangles} triangles, lattice {lattice}, {name}, {} patches: {} of {} rays passed (seed {}, {rate:.0} rays/s)",
                    solid.scene.objects()[0].faces().len(),
                    tally.passed,
                    tally.rays,
                    options.seed
                );
                for ray in &tally.failures {
                    println!("    {:?} + t {:?}, t < {}", ray.origin, ray.direction, ray.t_max);
                }
                rays += tally.rays;
                passed += tally.passed;
            }
        }
    }
    println!("{passed} of {rays} rays passed");
    ExitCode::from(u8::from(passed > 0))
}

fn run_all(solid: &Solid, options: &Options) -> Tally {
    let chunks = options.rays.div_ceil(CHUNK);
    let chunk = |chunk: u64| {
        let rays = CHUNK.min(options.rays - chunk * CHUNK);
        run(solid, rays, &mut Random::new(options.seed, 1 << 40 | chunk))
    };
    // in order, so that the failures kept are the same for any number of threads
    let tallies: Vec<_> = (0..chunks).into_par_iter().map(chunk).collect();
    tallies.into_iter().fold(Tally::default(), Tally::merged)
}
