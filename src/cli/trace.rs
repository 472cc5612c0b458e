//! `trimray trace`.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use clap::Args;
use glam::DVec3;
use serde::Serialize;

use trimray::arrays::{NamedArray, Values, read_f64, write_npz};
use trimray::export::to_json;
use trimray::memory::MemoryLimit;
use trimray::output::check_writable;
use trimray::trace::{HitArrays, Interrupted, Ray, TraceStatistics, TracedScene};

use super::own_inputs::check_not_inputs;
use super::statistics::{Acceleration, print_trace};
use super::{CliError, INTERRUPTED, SceneArgs, print_result};

/// Memory that the hit of a ray takes: as it is found, by threads and all together, and as numbers of the arrays.
const HIT_BYTES: u64 = 2 * 256 + 2 * 160;

/// The same if it is only asked whether there is one.
const ANY_BYTES: u64 = 4;

#[derive(Debug, Args)]
#[command(after_help = "Example: trimray trace scenes/feng_fig07.toml --rays rays.npy -o hits.npz

rays.npy holds float64 rows ox oy oz dx dy dz (directions of any length, t in its units); numpy.load reads hits.npz.")]
pub(super) struct TraceArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Rays: float64 array of shape (N, 6)
    #[arg(long, value_name = "R.npy")]
    rays: PathBuf,
    /// Where the hits go
    #[arg(short, long, value_name = "H.npz")]
    output: PathBuf,
    /// Only whether each ray hits anything
    #[arg(long, conflicts_with = "all")]
    any: bool,
    /// Every hit of each ray, sorted along it
    #[arg(long)]
    all: bool,
    /// With --all: an edge or a vertex that faces share counts once, not for each patch that has it
    #[arg(long, requires = "all")]
    once: bool,
    /// Print JSON to stdout
    #[arg(long)]
    json: bool,
    /// Print to stderr what the rays met, and the acceleration structure; JSON has both always
    #[arg(long)]
    stats: bool,
    /// No notes and no summary
    #[arg(short, long)]
    quiet: bool,
}

#[derive(Debug, Serialize)]
struct Summary {
    rays: usize,
    hits: usize,
    seconds: f64,
    mrays_per_second: f64,
    threads: usize,
    stats: TraceStatistics,
    accel: Acceleration,
}

pub(super) fn run(args: &TraceArgs) -> Result<(), CliError> {
    let scene = args.scene.parse()?;
    check_not_inputs(&[&args.output], &[&scene.files()[..], &[&args.rays]].concat())?;
    check_writable(&args.output)?;
    let memory = args.scene.limits.memory();
    let rays = read_rays(&args.rays, memory)?;
    let built = args.scene.build(&scene, args.quiet)?;
    check_not_inputs(&[&args.output], &built.library_files)?;
    let count = rays.len();
    let kept = if args.any { ANY_BYTES } else { HIT_BYTES };
    let promise = memory.ask(format_args!("the hits of {count} rays"), count as u64 * kept)?;
    let (arrays, mut summary) = args.scene.install(|| {
        let threads = rayon::current_num_threads();
        let traced = match (args.any, args.all) {
            (true, _) => any_hits(&built.traced, &rays),
            (_, true) => all_hits(&built.traced, &rays, args.once),
            _ => closest_hits(&built.traced, &rays),
        };
        let Traced { arrays, hits, seconds, stats } = traced.map_err(|Interrupted| CliError::Interrupted)?;
        let mrays_per_second = rays.len() as f64 * 1e-6 / seconds;
        let accel = Acceleration::new(&built);
        let summary = Summary { rays: rays.len(), hits, seconds, mrays_per_second, threads, stats, accel };
        Ok::<_, CliError>((arrays, summary))
    })??;
    write_npz(&args.output, &arrays)?;
    drop(promise);
    if !summary.mrays_per_second.is_finite() {
        summary.mrays_per_second = 0.0;
    }
    if !args.quiet {
        let Summary { rays, hits, seconds, mrays_per_second, .. } = summary;
        say!("{rays} rays, {hits} hits, {seconds:.4} s, {mrays_per_second:.3} Mrays/s");
    }
    if args.stats {
        print_trace(&summary.stats, &summary.accel);
    }
    if args.json {
        let bytes = to_json(&summary).context("the JSON")?;
        print_result(&String::from_utf8(bytes).context("the JSON")?)?;
    }
    Ok(())
}

fn read_rays(path: &Path, memory: MemoryLimit) -> Result<Vec<Ray>, CliError> {
    let bytes = fs::metadata(path).map_or(0, |file| file.len());
    // the file's bytes, its numbers, and the rays, which are of eight numbers
    let _promise = memory.ask(format_args!("the rays of {}", path.display()), bytes.saturating_mul(4))?;
    let array = read_f64(path).map_err(|error| CliError::Input(error.to_string()))?;
    let input = |message: String| CliError::Input(format!("{}: {message}", path.display()));
    let [_, 6] = array.shape.as_slice() else {
        return Err(input(format!("has the shape {:?}; rays need (N, 6): ox oy oz dx dy dz", array.shape)));
    };
    let rays = array.values.chunks_exact(6).enumerate().map(|(row, r)| {
        let ray = Ray::new(DVec3::new(r[0], r[1], r[2]), DVec3::new(r[3], r[4], r[5]));
        if !(ray.origin.is_finite() && ray.direction.is_finite()) {
            return Err(input(format!("row {row}: not finite")));
        }
        if !ray.is_traceable() {
            return Err(input(format!("row {row}: the direction {} has no usable length", ray.direction)));
        }
        Ok(ray)
    });
    rays.collect()
}

/// What a batch of rays gave.
struct Traced {
    arrays: Vec<NamedArray>,
    hits: usize,
    /// Time in the queries alone.
    seconds: f64,
    stats: TraceStatistics,
}

fn any_hits(scene: &TracedScene, rays: &[Ray]) -> Result<Traced, Interrupted> {
    let started = Instant::now();
    let (found, stats) = scene.any_batch(rays.len(), |index| rays[index], &INTERRUPTED)?;
    let seconds = started.elapsed().as_secs_f64();
    let hits = found.iter().filter(|&&hit| hit).count();
    let arrays = vec![NamedArray { name: "hit", columns: 1, values: Values::Bool(found) }];
    Ok(Traced { arrays, hits, seconds, stats })
}

fn closest_hits(scene: &TracedScene, rays: &[Ray]) -> Result<Traced, Interrupted> {
    let started = Instant::now();
    let (found, stats) = scene.closest_batch(rays.len(), |index| rays[index], &INTERRUPTED)?;
    let seconds = started.elapsed().as_secs_f64();
    let hits = found.t.iter().filter(|t| t.is_finite()).count();
    Ok(Traced { arrays: columns(found), hits, seconds, stats })
}

fn all_hits(scene: &TracedScene, rays: &[Ray], once: bool) -> Result<Traced, Interrupted> {
    let started = Instant::now();
    let (found, offsets, stats) = scene.all_batch(rays.len(), |index| rays[index], once, &INTERRUPTED)?;
    let seconds = started.elapsed().as_secs_f64();
    let hits = found.t.len();
    let mut arrays = columns(found);
    arrays.push(NamedArray { name: "offsets", columns: 1, values: Values::I64(offsets) });
    Ok(Traced { arrays, hits, seconds, stats })
}

/// The arrays of the file, one row for each hit or miss.
fn columns(hits: HitArrays) -> Vec<NamedArray> {
    let HitArrays { t, ids, pairs, vectors } = hits;
    let of = |names: &[&'static str], columns: usize, values: Vec<Values>| {
        let named = names.iter().zip(values);
        named.map(|(name, values)| NamedArray { name, columns, values }).collect::<Vec<_>>()
    };
    [
        of(&["t"], 1, vec![Values::F64(t)]),
        of(&HitArrays::ID_NAMES, 1, ids.map(Values::I32).into()),
        of(&HitArrays::PAIR_NAMES, 2, pairs.map(Values::F64).into()),
        of(&HitArrays::VECTOR_NAMES, 3, vectors.map(Values::F64).into()),
    ]
    .concat()
}
