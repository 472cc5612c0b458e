//! `trimray trace`.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use clap::Args;
use glam::DVec3;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use rayon::slice::ParallelSlice;
use serde::Serialize;

use trimray::arrays::{NamedArray, Values, read_f64, write_npz};
use trimray::export::to_json;
use trimray::memory::MemoryLimit;
use trimray::output::check_writable;
use trimray::trace::{Ray, RayTracer, SurfaceInteraction, TraceStatistics, TracedScene, Tracer};

use super::own_inputs::check_not_inputs;
use super::statistics::{Acceleration, print_trace};
use super::{CliError, SceneArgs, check_interrupted, print_result};

/// Rays handed to a thread at once: enough to hide the handing out, few enough to share the work and notice Ctrl-C.
const CHUNK: usize = 1024;

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
        let Traced { arrays, hits, seconds, stats } = if args.any {
            any_hits(&built.traced, &rays)
        } else if args.all {
            all_hits(&built.traced, &rays, args.once)
        } else {
            closest_hits(&built.traced, &rays)
        };
        let mrays_per_second = rays.len() as f64 * 1e-6 / seconds;
        let accel = Acceleration::new(&built);
        (arrays, Summary { rays: rays.len(), hits, seconds, mrays_per_second, threads, stats, accel })
    })?;
    check_interrupted()?;
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

/// Runs a query on all rays: the results, the time, and the sum of what the threads counted.
fn query<T: Send>(
    scene: &TracedScene,
    rays: &[Ray],
    query: impl Fn(&mut Tracer<'_>, &Ray) -> T + Sync,
) -> (Vec<T>, f64, TraceStatistics) {
    let started = Instant::now();
    let chunk = |rays: &[Ray]| {
        let mut tracer = scene.tracer();
        let mut found = Vec::new();
        if check_interrupted().is_ok() {
            found.extend(rays.iter().map(|ray| query(&mut tracer, ray)));
        }
        (found, tracer.statistics())
    };
    let chunks: Vec<_> = rays.par_chunks(CHUNK).map(chunk).collect();
    let seconds = started.elapsed().as_secs_f64();
    let mut statistics = TraceStatistics::default();
    let mut results = Vec::with_capacity(rays.len());
    for (mut part, counts) in chunks {
        results.append(&mut part);
        statistics += counts;
    }
    (results, seconds, statistics)
}

fn any_hits(scene: &TracedScene, rays: &[Ray]) -> Traced {
    let (found, seconds, stats) = query(scene, rays, |tracer, ray| tracer.any(ray));
    let hits = found.iter().filter(|&&hit| hit).count();
    let arrays = vec![NamedArray { name: "hit", columns: 1, values: Values::Bool(found) }];
    Traced { arrays, hits, seconds, stats }
}

fn closest_hits(scene: &TracedScene, rays: &[Ray]) -> Traced {
    let (found, seconds, stats) = query(scene, rays, |tracer, ray| tracer.closest_hit(ray));
    Traced { hits: found.iter().flatten().count(), arrays: columns(&found), seconds, stats }
}

fn all_hits(scene: &TracedScene, rays: &[Ray], once: bool) -> Traced {
    let every = |tracer: &mut Tracer<'_>, ray: &Ray| -> Vec<_> {
        let hits = if once { tracer.all_once(ray) } else { tracer.all(ray) };
        hits.iter().map(|hit| Some(scene.interaction(hit))).collect()
    };
    let (found, seconds, stats) = query(scene, rays, every);
    let mut offsets = vec![0_i64];
    let mut hits = 0;
    for ray in &found {
        hits += ray.len();
        offsets.push(i64::try_from(hits).expect("fewer than 2^63 hits fit in memory"));
    }
    let flat: Vec<_> = found.into_iter().flatten().collect();
    let mut arrays = columns(&flat);
    arrays.push(NamedArray { name: "offsets", columns: 1, values: Values::I64(offsets) });
    Traced { arrays, hits, seconds, stats }
}

/// The arrays of the contract, one row for each hit or miss.
fn columns(hits: &[Option<SurfaceInteraction>]) -> Vec<NamedArray> {
    let id = |get: fn(&SurfaceInteraction) -> u32| {
        // -1 for a miss; ids of 2^31 and more do not fit in memory
        let id = |hit: &Option<SurfaceInteraction>| {
            hit.as_ref().map_or(-1, |hit| i32::try_from(get(hit)).unwrap_or(i32::MAX))
        };
        Values::I32(hits.par_iter().map(id).collect())
    };
    let numbers = |miss: f64, columns: usize, get: fn(&SurfaceInteraction) -> Vec<f64>| {
        let row = |hit: &Option<SurfaceInteraction>| hit.as_ref().map_or_else(|| vec![miss; columns], get);
        Values::F64(hits.iter().flat_map(row).collect())
    };
    let array = |name, columns, values| NamedArray { name, columns, values };
    vec![
        array("t", 1, numbers(f64::INFINITY, 1, |hit| vec![hit.t])),
        array("object", 1, id(|hit| hit.object)),
        array("face", 1, id(|hit| hit.face)),
        array("patch", 1, id(|hit| hit.patch)),
        array("st", 2, numbers(f64::NAN, 2, |hit| hit.st.to_array().to_vec())),
        array("uv", 2, numbers(f64::NAN, 2, |hit| hit.uv.to_array().to_vec())),
        array("rest", 3, numbers(f64::NAN, 3, |hit| hit.rest.to_array().to_vec())),
        array("position", 3, numbers(f64::NAN, 3, |hit| hit.position.to_array().to_vec())),
        array("normal", 3, numbers(f64::NAN, 3, |hit| hit.normal.to_array().to_vec())),
        array("dp_ds", 3, numbers(f64::NAN, 3, |hit| hit.dp_ds.to_array().to_vec())),
        array("dp_dt", 3, numbers(f64::NAN, 3, |hit| hit.dp_dt.to_array().to_vec())),
    ]
}
