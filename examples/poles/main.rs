//! Traces rays at the poles of spheres, cones, and patches one side of which is a point, at both ends of u and v, plain and
//! deformed by lattices:
//!
//! `cargo run --release --example poles -- --rays 1000000`
//!
//! Each ray must have a hit where it is aimed, with the limit of the normals; exits with 1 if one has none.

mod rays;
mod shapes;

use std::process::ExitCode;

use clap::Parser;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use rays::{Tally, run};
use shapes::{Random, surfaces};

/// Rays that share a stream of random numbers, so that results do not depend on the number of threads.
const CHUNK: u64 = 2000;

/// Traces rays at poles.
#[derive(Debug, Parser)]
struct Options {
    /// Rays in all
    #[arg(long, default_value_t = 1_000_000)]
    rays: u64,
    /// Chooses the rays
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only surfaces whose names have this in them
    #[arg(long)]
    surface: Option<String>,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let surfaces = match surfaces(&mut Random::new(options.seed, u64::MAX)) {
        Ok(surfaces) => surfaces,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::from(2);
        }
    };
    let wanted = |name: &str| options.surface.as_ref().is_none_or(|only| name.contains(only));
    let surfaces: Vec<_> = surfaces.into_iter().filter(|surface| wanted(&surface.name)).collect();
    let each = options.rays.div_ceil(surfaces.len().max(1) as u64);
    let mut all = Tally::default();
    for (number, surface) in (0..).zip(&surfaces) {
        let chunk = |chunk: u64| {
            let rays = CHUNK.min(each - chunk * CHUNK);
            run(surface, rays, &mut Random::new(options.seed, number << 40 | chunk))
        };
        let tallies: Vec<_> = (0..each.div_ceil(CHUNK)).into_par_iter().map(chunk).collect();
        let tally = tallies.into_iter().fold(Tally::default(), Tally::merged);
        if tally.lost + tally.turned > 0 {
            println!("{}: {} of {} lost, {} turned", surface.name, tally.lost, tally.rays, tally.turned);
            for failure in &tally.failures {
                println!("    {failure}");
            }
        }
        all = all.merged(tally);
    }
    println!(
        "{} surfaces: {} of {} rays lost, {} normals turned, by {:.1e} at most",
        surfaces.len(),
        all.lost,
        all.rays,
        all.turned,
        all.farthest
    );
    ExitCode::from(u8::from(all.lost + all.turned > 0))
}
