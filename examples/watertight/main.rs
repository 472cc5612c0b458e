//! Traces rays at closed deformed solids, mostly where they might leak:
//!
//! `cargo run --release --example watertight -- --rays 1000000 --solid cube --solid slivers --solid model.obj`
//!
//! Kinds of rays: from points inside, to be balanced or, by many at once, only to hit; from outside through points of borders (corners and edges of trims, lines on
//! which patches are halved) to points inside, and back; random lines. Every ray must enter and leave as often as its ends
//! say, and every hit must be on the ray and on the exact surface. Exits with 1 on any failure, and prints failing rays of
//! each kind; `--ray` traces one of them again. The rays do not depend on the number of threads.

mod aim;
mod checks;
mod solids;

use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use clap::Parser;
use glam::DVec3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use trimray::trace::Ray;

use aim::{Aims, Random};
use checks::{Checker, Tally, Test, describe};
use solids::Solid;

/// Rays that share a stream of random numbers, so that results do not depend on the number of threads.
const CHUNK: u64 = 5000;

/// Traces rays at closed deformed solids, mostly where they might leak.
#[derive(Debug, Parser)]
struct Options {
    /// cube, slivers, or an OBJ file of a closed mesh; several times for several
    #[arg(long, default_values = ["cube", "slivers"])]
    solid: Vec<String>,
    /// Only these tests: inside, aimed, lines, enclosed
    #[arg(long)]
    test: Vec<String>,
    /// Rays for each test and solid
    #[arg(long, default_value_t = 1_000_000)]
    rays: u64,
    /// Chooses the rays
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Threads to work with; 0: one for each processor
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Aimed rays start up to this many diagonals away
    #[arg(long, default_value_t = 10.0)]
    farthest: f64,
    /// Give the lattice weights
    #[arg(long)]
    rational: bool,
    /// Only this ray, "ox oy oz dx dy dz", and what it hits
    #[arg(long, allow_hyphen_values = true)]
    ray: Option<String>,
    /// Where the ray of `--ray` ends
    #[arg(long, default_value_t = f64::INFINITY)]
    t_max: f64,
}

fn main() -> ExitCode {
    let options = Options::parse();
    match run(&options) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(2)
        }
    }
}

fn run(options: &Options) -> Result<bool, String> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build();
    let pool = pool.map_err(|error| error.to_string())?;
    let mut good = true;
    for name in &options.solid {
        let solid = Solid::named(name, options.rational).map_err(|error| format!("{name}: {error}"))?;
        if let Some(ray) = &options.ray {
            let ray = Ray { t_max: options.t_max, ..parse_ray(ray)? };
            print!("{name}\n{}", describe(&solid, &ray));
            continue;
        }
        good &= pool.install(|| run_solid(name, &solid, options));
    }
    Ok(good)
}

fn run_solid(name: &str, solid: &Solid, options: &Options) -> bool {
    let patches = solid.scene.objects()[0].faces().len();
    println!("{name}: {} faces, {patches} patches", solid.polygons.len());
    let aims = Aims::new(solid, &mut Random::new(options.seed, u64::MAX));
    let checker = Checker { solid, aims: &aims, farthest: options.farthest };
    let mut good = true;
    for (number, test) in (0..).zip([Test::Inside, Test::Aimed, Test::Lines, Test::Enclosed]) {
        if !options.test.is_empty()
            && !options.test.iter().any(|name| format!("{test:?}").eq_ignore_ascii_case(name))
        {
            continue;
        }
        let started = Instant::now();
        let tally = run_test(&checker, test, number, options);
        let rate = tally.rays as f64 / started.elapsed().as_secs_f64();
        println!("  {} ({rate:.0} rays/s)", summary(test, options.seed, &tally));
        for failure in &tally.failures {
            let Ray { origin: o, direction: d, t_max, .. } = failure.ray;
            println!(
                "    {:?}: --ray \"{:.16e} {:.16e} {:.16e} {:.16e} {:.16e} {:.16e}\" --t-max {t_max}",
                failure.fault, o.x, o.y, o.z, d.x, d.y, d.z
            );
        }
        good &= tally.failed() == 0;
    }
    good
}

fn run_test(checker: &Checker<'_>, test: Test, number: u64, options: &Options) -> Tally {
    let chunks = options.rays.div_ceil(CHUNK);
    let done = AtomicU64::new(0);
    let run_chunk = |chunk: u64| {
        let rays = CHUNK.min(options.rays - chunk * CHUNK);
        let mut random = Random::new(options.seed, number << 40 | chunk);
        let tally = checker.run(test, rays, &mut random);
        let before = done.fetch_add(1, Ordering::Relaxed);
        if before * 10 / chunks != (before + 1) * 10 / chunks {
            eprintln!("  {test:?}: {} %", (before + 1) * 100 / chunks);
        }
        tally
    };
    // in order, so that the failures kept are the same for any number of threads
    let tallies: Vec<_> = (0..chunks).into_par_iter().map(run_chunk).collect();
    tallies.into_iter().fold(Tally::default(), Tally::merged)
}

fn summary(test: Test, seed: u64, tally: &Tally) -> String {
    let Tally { rays, hits, on_border, touching, beside, from_ray, from_volume, .. } = tally;
    let beside = if test == Test::Aimed { format!(", {beside} beside the point") } else { String::new() };
    let failed = tally.failed();
    let [leaks, contradictions, unbalanced, ghosts, at_border] = tally.faults;
    format!(
        "{test:?}: {failed} of {rays} rays failed (seed {seed}): {leaks} leaks, {contradictions} contradictions, \
         {unbalanced} unbalanced, {ghosts} ghosts ({at_border} unbalanced at a border); {hits} hits, {on_border} rays on a border, {touching} \
         touching{beside}; {from_ray:.1e} from the ray, {from_volume:.1e} from the volume"
    )
}

fn parse_ray(text: &str) -> Result<Ray, String> {
    let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    let numbers = numbers.map_err(|error| format!("--ray: {error}"))?;
    let &[ox, oy, oz, dx, dy, dz] = numbers.as_slice() else {
        return Err(format!("--ray: 6 numbers are needed, {} given", numbers.len()));
    };
    Ok(Ray::new(DVec3::new(ox, oy, oz), DVec3::new(dx, dy, dz)))
}
