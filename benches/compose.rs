//! Composition time per patch, and subdivision with composition of a whole mesh; one thread.
//!
//! ```text
//! cargo bench --bench compose                     # per patch, for every degree and way
//! cargo bench --bench compose -- --mesh MESH.obj  # the whole mesh: 3×3×3, lattice 6×6×6, twist 90°, bulge 0.25 about y
//! cargo bench --bench compose -- --degree 3 --direct  # one degree, without interpolation
//! cargo bench --bench compose -- --json           # one JSON object a line instead of tables
//! ```
//!
//! `tests/peers/splinepy_compose.py` runs it beside splinepy and demands the ratios.

use std::env;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use glam::{DAffine3, DVec3};
use serde_json::{Value, json};
use trimray::mesh::{MeshTolerances, load_obj, prepare_polygons};
use trimray::patch::{
    Chart, Composer, Deformation, PlanarPolygon, compose_by_interpolation, deform_polygons,
};
use trimray::random::SplitMix64;
use trimray::spline::{Axis, ControlLattice, KnotBox, MAX_VOLUME_DEGREE, SplineVolume};
use trimray::subdivide::{Frame, FrameChoice};

/// Planes per timed batch: enough that a batch (0.1 ms and more) is long beside the clock's step, few enough that
/// their frames stay in the first-level cache, as one patch after another does in a build.
const PLANES: usize = 64;

/// Batches per figure. The least of them is reported: what the code takes when nothing else runs.
const BATCHES: usize = 300;

/// Runs over a whole mesh.
const MESH_RUNS: usize = 15;

/// What `--mesh` must stay below, in milliseconds on one core.
const MESH_LIMIT_MS: f64 = 100.0;

struct Arguments {
    json: bool,
    mesh: Option<PathBuf>,
    degree: Option<usize>,
    direct: bool,
}

fn arguments() -> Result<Arguments, String> {
    let mut parsed = Arguments { json: false, mesh: None, degree: None, direct: false };
    let mut rest = env::args().skip(1);
    while let Some(argument) = rest.next() {
        match argument.as_str() {
            // cargo's own
            "--bench" => {}
            "--json" => parsed.json = true,
            "--mesh" => parsed.mesh = Some(rest.next().ok_or("--mesh needs the path of an OBJ file")?.into()),
            "--direct" => parsed.direct = true,
            "--degree" => {
                let degree = rest.next().and_then(|text| text.parse().ok());
                let valid = degree.filter(|degree| (1..=MAX_VOLUME_DEGREE).contains(degree));
                parsed.degree = Some(valid.ok_or("--degree needs a number from 1 to 4")?);
            }
            other => {
                return Err(format!(
                    "unknown argument {other} (known: --json, --degree K, --direct, --mesh PATH)"
                ));
            }
        }
    }
    Ok(parsed)
}

fn main() -> ExitCode {
    let arguments = match arguments() {
        Ok(arguments) => arguments,
        Err(message) => {
            eprintln!("compose: {message}");
            return ExitCode::from(2);
        }
    };
    let print = |line: &Value| println!("{}", if arguments.json { line.to_string() } else { readable(line) });
    if let Some(path) = &arguments.mesh {
        match whole_mesh(path) {
            Ok(line) => print(&line),
            Err(message) => {
                eprintln!("compose: {message}");
                return ExitCode::FAILURE;
            }
        }
        return ExitCode::SUCCESS;
    }
    for degree in arguments.degree.map_or(1..=4, |degree| degree..=degree) {
        for choice in [FrameChoice::Parallelogram, FrameChoice::Rectangle] {
            for line in per_patch([degree; 3], choice, arguments.direct) {
                print(&line);
            }
        }
    }
    ExitCode::SUCCESS
}

/// Composition alone, for planes in general position in one knot box.
fn per_patch(degree: [usize; 3], choice: FrameChoice, only_direct: bool) -> Vec<Value> {
    let volume = bent_volume(degree, degree.map(|k| k + 1), DVec3::ZERO, DVec3::ONE);
    let planes = general_planes(&volume, choice);
    let mut composer = Composer::default();
    let patch_degree = composer.compose(&volume, planes[0].0, &planes[0].1).degree();
    let line = |way: &str, time: Duration| {
        json!({
            "bench": "compose",
            "volume_degree": degree,
            "frame": format!("{choice:?}").to_lowercase(),
            "patch_degree": patch_degree,
            "way": way,
            "nanoseconds_per_patch": time.as_secs_f64() * 1e9 / planes.len() as f64,
        })
    };
    let direct = least_batch(|| {
        for (knot_box, frame) in &planes {
            black_box(composer.compose(black_box(&volume), *knot_box, black_box(frame)));
        }
    });
    if only_direct {
        return vec![line("direct", direct)];
    }
    let interpolated = least_batch(|| {
        for (knot_box, frame) in &planes {
            black_box(compose_by_interpolation(
                black_box(&volume),
                *knot_box,
                black_box(frame),
                patch_degree,
            ));
        }
    });
    vec![line("direct", direct), line("interpolation", interpolated)]
}

fn least_batch(mut batch: impl FnMut()) -> Duration {
    batch();
    let timed = || {
        let started = Instant::now();
        batch();
        started.elapsed()
    };
    std::iter::repeat_with(timed).take(BATCHES).min().expect("BATCHES is not 0")
}

/// The mesh in its bounding box's lattice, by the same calls as the program.
fn whole_mesh(path: &Path) -> Result<Value, String> {
    let (mesh, _) = load_obj(path).map_err(|error| error.to_string())?;
    let (polygons, _) = prepare_polygons(&mesh, DAffine3::IDENTITY, MeshTolerances::default());
    let [low, high] = polygons.bounds().ok_or("the mesh has no faces")?;
    let volume = bent_volume([3; 3], [6; 3], low, high);
    let planar: Vec<_> =
        polygons.iter().map(|p| PlanarPolygon { face: p.face, corners: p.positions }).collect();
    let deformation = Deformation { volume: Some(&volume), frame: FrameChoice::Parallelogram };
    let mut runs = Vec::with_capacity(MESH_RUNS);
    let mut patches = 0;
    for _ in 0..MESH_RUNS {
        let started = Instant::now();
        let made = deform_polygons(black_box(&planar), deformation).map_err(|error| error.to_string())?;
        runs.push((started.elapsed(), made.times));
        patches = made.shell.faces().len();
    }
    runs.sort_by_key(|run| run.0);
    let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
    let (median, times) = runs[MESH_RUNS / 2];
    Ok(json!({
        "bench": "mesh",
        "polygons": planar.len(),
        "patches": patches,
        "least_ms": milliseconds(runs[0].0),
        "median_ms": milliseconds(median),
        "median_subdivide_ms": milliseconds(times.subdivide),
        "median_compose_ms": milliseconds(times.compose),
        "limit_ms": MESH_LIMIT_MS,
        "within_limit": milliseconds(median) <= MESH_LIMIT_MS,
    }))
}

/// Twist by 90° and bulge by 0.25 about y.
fn bent_volume(degree: [usize; 3], points: [usize; 3], low: DVec3, high: DVec3) -> SplineVolume {
    let mut lattice =
        ControlLattice::identity(degree, points, [low, high], 0).expect("degree, points and box are valid");
    lattice.twist(Axis::Y, 90.0);
    lattice.bulge(Axis::Y, 0.25);
    lattice.volume().expect("the edits keep points finite and weights 1")
}

/// Knot box and frame of triangles in general position; a volume of one knot box keeps each whole.
fn general_planes(volume: &SplineVolume, frame: FrameChoice) -> Vec<(KnotBox, Frame)> {
    let mut random = SplitMix64::new(1);
    (0..PLANES)
        .map(|_| {
            let corners: [DVec3; 3] = std::array::from_fn(|_| {
                DVec3::new(random.next_unit(), random.next_unit(), random.next_unit())
            });
            let polygon = [PlanarPolygon { face: 0, corners: &corners }];
            let made = deform_polygons(&polygon, Deformation { volume: Some(volume), frame })
                .expect("a small triangle in a mild lattice");
            let patch = made.shell.faces().first().expect("the triangle has area and lies in the lattice");
            let Chart::Plane(frame) = patch.chart else { panic!("a triangle is plane") };
            (patch.knot_box().expect("it lies in the lattice"), frame)
        })
        .collect()
}

fn readable(line: &Value) -> String {
    let number = |key: &str| line[key].as_f64().unwrap_or(f64::NAN);
    if line["bench"] == "mesh" {
        return format!(
            "{} polygons, {} patches: median {:.1} ms (subdivide {:.1}, compose {:.1}), least {:.1}; limit {} ms",
            line["polygons"],
            line["patches"],
            number("median_ms"),
            number("median_subdivide_ms"),
            number("median_compose_ms"),
            number("least_ms"),
            number("limit_ms"),
        );
    }
    format!(
        "volume {:<9} {:<14} patch {:<8} {:<14} {:>9.0} ns",
        line["volume_degree"].to_string(),
        line["frame"].as_str().unwrap_or_default(),
        line["patch_degree"].to_string(),
        line["way"].as_str().unwrap_or_default(),
        number("nanoseconds_per_patch"),
    )
}
