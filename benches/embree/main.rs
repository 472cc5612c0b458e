//! trimray side by side with Embree: the exact surface against tessellations of it, the same rays, the same run.
//!
//! `cargo bench --bench embree -- --mesh model.obj [--object a] [--adaptive] [--quick] [--json]`
//!
//! Needs g++ and Embree 3 (Debian: `apt-get install g++ libembree-dev`).
//!
//! # Objects
//! - a: the unit cube of 12 triangles, degree 2 × 2 × 2, 4 × 4 × 4 control points, twisted by 90° about z, bulge 0.35
//! - b: the same, degree 3 × 3 × 3, 6 × 6 × 6 control points
//! - c: the mesh given by `--mesh`, degree 3 × 3 × 3, 6 × 6 × 6 control points, twisted by 90° about y, bulge 0.25
//!
//! Their tessellations have the fewest triangles, of one n × n for all triangles of the object, for errors of no more than
//! 1e-3 … 1e-6 of the diagonal of the deformed object's box; `--adaptive` adds adaptive ones, refined in two ways (`tessellate::Halving`).
//!
//! - `--scene FILE`: a scene file's objects, tessellated adaptively as `trimray export --tolerance` does, without cracks
//!
//! # Rays
//! Primary: a camera's 1024 × 1024, in tiles of 4 × 4 pixels. Random: through two points of a sphere. Bounce: from the hits
//! of primary rays, directions distributed as the cosine, in the primary rays' order. Each with all its rays, and only those
//! that hit (by trimray). Packets are 16 consecutive rays; primary packets are traced with and
//! without Embree's flag for coherent rays. With `--quick` the primary rays are 256 × 256, so less coherent, and the
//! others a sixteenth.
//!
//! # How it measures
//! One thread each. Rays are cut into chunks. A round traces every chunk by every contestant in turn: trimray, then Embree on
//! each tessellation. A contestant's time is the sum over the chunks of the least time of any round, so that what else
//! the machine does falls on all alike and mostly falls away. Both sides time, within their own process, all from the ray in
//! memory to its hit parameter in memory. Ratios are rate of trimray / rate of Embree. Embree's scenes have its default flags
//! and build quality. Nothing is left out: every set and every tessellation is printed.
//!
//! Build times are the least of 7 for trimray, of 3 for Embree and for making the uniform tessellations; adaptive ones are
//! made once, with no care for time. Memory is what the structures hold afterwards (`Face::bytes` and the acceleration structure; Embree's memory monitor and the mesh).

#[path = "../common/mod.rs"]
mod common;
mod peer;
mod report;
mod tessellate;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use trimray::scene::parse_scene;
use trimray::trace::{RayTracer, TracedScene};

use common::objects::{Built, Object, Subject, each_object};
use common::rays::{RaySet, ray_sets};
use common::timing::{CHUNK, LeastTimes, TraceWay, trace_packets, trace_single};
use peer::{Mode, Peer, PeerMesh};
use report::{Agreement, BuildRow, RateRow, Report};
use tessellate::Halving;

/// Errors of the tessellations, in parts of the diagonal.
const ERRORS: [f64; 4] = [1e-3, 1e-4, 1e-5, 1e-6];

/// Times that trimray's build is timed.
const BUILDS: usize = 7;

/// Times that making a uniform tessellation is timed; the program that runs Embree times its build as often.
const TESSELLATION_BUILDS: usize = 3;

/// trimray's ways of tracing many rays, each with its name. A way that takes packets or streams is one more line.
const WAYS: [(&str, TraceWay); 2] = [("single", trace_single), ("packets", trace_packets)];

/// trimray side by side with Embree.
#[derive(Debug, Parser)]
struct Arguments {
    /// Only this object: a, b or c
    #[arg(long, value_parser = ["a", "b", "c"])]
    object: Option<String>,
    /// OBJ file of object c
    #[arg(long)]
    mesh: Option<PathBuf>,
    /// Scene files to measure instead of the objects
    #[arg(long)]
    scene: Vec<PathBuf>,
    /// Trace adaptive tessellations as well
    #[arg(long)]
    adaptive: bool,
    /// Fewer rays and rounds
    #[arg(long)]
    quick: bool,
    /// One JSON object a line in place of tables
    #[arg(long)]
    json: bool,
    /// Rounds over all chunks
    #[arg(long)]
    rounds: Option<usize>,
    /// Given by `cargo bench`
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    if !arguments.bench {
        // `cargo test --all-targets` starts benchmarks as well
        println!("not measured: start it by cargo bench --bench embree");
        return ExitCode::SUCCESS;
    }
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let report = Report { json: arguments.json };
    for path in &arguments.scene {
        compare_scene(path, arguments, report)?;
    }
    if !arguments.scene.is_empty() && arguments.object.is_none() {
        return Ok(());
    }
    // each with a peer of its own, so that no object pays for the memory of another's meshes
    each_object(arguments.object.as_deref(), arguments.mesh.as_deref(), |object| {
        compare(object, arguments, report)
    })
}

/// A tessellation as Embree has it.
struct Contestant {
    label: String,
    error: f64,
    mesh: PeerMesh,
}

fn compare(object: &Object, arguments: &Arguments, report: Report) -> Result<(), String> {
    let mut peer = Peer::start()?;
    let subject = &object.subject;
    report.heading(subject, &peer.version);
    let Built { scene, times, bytes } = object.build_least(BUILDS)?;
    let build_seconds = times.total();
    report.trimray(subject, scene.acceleration().leaves, build_seconds, bytes);
    let contestants = add_tessellations(object, &mut peer, arguments, |row| {
        report.build(subject, build_seconds, bytes, &row);
    })?;
    compare_rates(subject, &scene, arguments, report, (&mut peer, &contestants))
}

/// A scene file: its tessellations are those that trimray exports.
fn compare_scene(path: &Path, arguments: &Arguments, report: Report) -> Result<(), String> {
    let mut peer = Peer::start()?;
    let description = parse_scene(path).map_err(|error| error.to_string())?;
    let build = || description.build().map(|built| built.traced).map_err(|error| error.to_string());
    let (built, build_seconds) = least_of(build);
    let scene = built?;
    let bytes: usize = scene.objects().iter().map(|object| object.shell.bytes()).sum();
    let bytes = bytes + scene.acceleration().bytes;
    let (coarse, _) = tessellate::of_scene(&scene, 1e-3, 1.0)?;
    let name = path.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let patches: usize = scene.objects().iter().map(|object| object.faces().len()).sum();
    let points = coarse.vertices.iter().map(|vertex| vertex.as_dvec3());
    let subject = Subject::new(name, format!("{}, {patches} patches", path.display()), points);
    report.heading(&subject, &peer.version);
    report.trimray(&subject, scene.acceleration().leaves, build_seconds, bytes);
    let mut contestants = Vec::new();
    for target in ERRORS {
        let started = Instant::now();
        let (mesh, error) = tessellate::of_scene(&scene, target, subject.diagonal)?;
        let tessellate_seconds = started.elapsed().as_secs_f64();
        let (label, triangles) = (format!("{target:.0e}"), mesh.triangles.len());
        let built = peer.add_mesh(&mesh)?;
        let row =
            BuildRow { label: label.clone(), n: None, triangles, error, tessellate_seconds, mesh: built };
        report.build(&subject, build_seconds, bytes, &row);
        contestants.push(Contestant { label, error, mesh: built });
    }
    compare_rates(&subject, &scene, arguments, report, (&mut peer, &contestants))
}

fn compare_rates(
    subject: &Subject,
    scene: &TracedScene,
    arguments: &Arguments,
    report: Report,
    (peer, contestants): (&mut Peer, &[Contestant]),
) -> Result<(), String> {
    let (width, random, rounds) = if arguments.quick { (256, 1 << 14, 3) } else { (1024, 1 << 18, 5) };
    report.rates_heading(&WAYS.map(|(name, _)| name));
    for set in ray_sets(subject, scene, width, random) {
        let rounds = arguments.rounds.unwrap_or(rounds);
        for row in measure(subject, scene, &set, peer, contestants, rounds)? {
            report.rates(subject, &set, &WAYS.map(|(name, _)| name), &row);
        }
    }
    Ok(())
}

/// A result, and the least seconds of a few ways to it.
fn least_of<T>(make: impl Fn() -> T) -> (T, f64) {
    let timed = || {
        let started = Instant::now();
        let made = make();
        (made, started.elapsed().as_secs_f64())
    };
    (0..TESSELLATION_BUILDS - 1).fold(timed(), |(_, least), _| {
        let (made, seconds) = timed();
        (made, least.min(seconds))
    })
}

fn add_tessellations(
    object: &Object,
    peer: &mut Peer,
    arguments: &Arguments,
    mut show: impl FnMut(BuildRow),
) -> Result<Vec<Contestant>, String> {
    let mut contestants = Vec::new();
    let mut add = |label: String, n, error, mesh: &tessellate::Mesh, seconds| -> Result<(), String> {
        let built = peer.add_mesh(mesh)?;
        let triangles = mesh.triangles.len();
        show(BuildRow {
            label: label.clone(),
            n,
            triangles,
            error,
            tessellate_seconds: seconds,
            mesh: built,
        });
        contestants.push(Contestant { label, error, mesh: built });
        Ok(())
    };
    let mut guess = 1;
    for target in ERRORS {
        let (n, error) = tessellate::least_uniform(object, target, guess);
        guess = 3 * n;
        let (mesh, seconds) = least_of(|| tessellate::uniform(object, n));
        add(format!("{target:.0e}"), Some(n), error, &mesh, seconds)?;
    }
    for (halving, name) in [(Halving::FarEdges, "far edges"), (Halving::LongestEdge, "longest edge")] {
        for target in ERRORS.into_iter().filter(|_| arguments.adaptive) {
            let started = Instant::now();
            let (mesh, error) = tessellate::adaptive(object, target, halving);
            let seconds = started.elapsed().as_secs_f64();
            add(format!("{target:.0e} {name}"), None, error, &mesh, seconds)?;
        }
    }
    Ok(contestants)
}

/// All rates on one set of rays: a row for each tessellation.
fn measure(
    subject: &Subject,
    scene: &TracedScene,
    set: &RaySet,
    peer: &mut Peer,
    contestants: &[Contestant],
    rounds: usize,
) -> Result<Vec<RateRow>, String> {
    let count = set.rays.len();
    if count == 0 {
        return Ok(Vec::new());
    }
    let chunks = count.div_ceil(CHUNK);
    let index = peer.add_rays(&set.rays)?;
    let modes: &[_] = match set.coherent {
        true => &[Mode::Intersect1, Mode::Intersect16, Mode::Coherent16],
        false => &[Mode::Intersect1, Mode::Intersect16],
    };
    let mut exact = vec![f64::INFINITY; count];
    let mut ways: Vec<_> = WAYS.iter().map(|_| LeastTimes::new(chunks)).collect();
    let mut others: Vec<_> = contestants
        .iter()
        .map(|_| modes.iter().map(|_| LeastTimes::new(chunks)).collect::<Vec<_>>())
        .collect();
    for _ in 0..rounds.max(1) {
        for (chunk, rays) in set.rays.chunks(CHUNK).enumerate() {
            let first = chunk * CHUNK;
            for ((_, way), times) in WAYS.iter().zip(&mut ways) {
                let started = Instant::now();
                way(scene, rays, &mut exact[first..first + rays.len()]);
                times.add(chunk, started.elapsed().as_secs_f64());
            }
            for (contestant, times) in contestants.iter().zip(&mut others) {
                for (&mode, times) in modes.iter().zip(times) {
                    times.add(chunk, peer.run(&contestant.mesh, index, mode, first, rays.len())?);
                }
            }
        }
    }
    let trimray: Vec<_> = ways.iter().map(|times| times.rate(count)).collect();
    let hits = exact.iter().filter(|t| t.is_finite()).count();
    let mut rows = Vec::new();
    for (contestant, times) in contestants.iter().zip(&others) {
        for first in (0..count).step_by(CHUNK) {
            peer.run(&contestant.mesh, index, Mode::Intersect1, first, CHUNK)?;
        }
        let agreement = agreement(subject, scene, set, &peer.distances(index)?, contestant.error);
        rows.push(RateRow {
            label: contestant.label.clone(),
            hits,
            trimray: trimray.clone(),
            intersect1: times[0].rate(count),
            intersect16: times[1].rate(count),
            coherent16: times.get(2).map(|times| times.rate(count)),
            agreement,
        });
    }
    Ok(rows)
}

/// Compares the hits of both.
fn agreement(
    subject: &Subject,
    scene: &TracedScene,
    set: &RaySet,
    distances: &[f32],
    error: f64,
) -> Agreement {
    // the coordinates of vertices, origins and hits are rounded to single precision by Embree
    let size = subject.bounds[0].abs().max(subject.bounds[1].abs()).max_element() + 2.0 * subject.diagonal;
    let allowed = 2.0 * error * subject.diagonal + 8.0 * f64::from(f32::EPSILON) * size;
    let mut agreement = Agreement::default();
    let mut tracer = scene.tracer();
    for (ray, &distance) in set.rays.iter().zip(distances) {
        let ray = ray.ray();
        match tracer.closest_hit(&ray) {
            Some(_) if distance.is_infinite() => agreement.only_trimray += 1,
            None if distance.is_finite() => agreement.only_embree += 1,
            Some(hit) if distance.is_finite() => {
                let across = hit.normal.dot(ray.direction).abs();
                let apart = (f64::from(distance) - hit.t).abs() * across;
                agreement.elsewhere += usize::from(apart > allowed);
            }
            _ => {}
        }
    }
    agreement
}
