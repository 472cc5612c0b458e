//! Measures the accuracy that trimray states, on scenes given on the command line:
//!
//! `cargo run --release --example measure -- scenes/feng_*.toml`
//!
//! For each scene: random rays through the deformed objects' box (seed 1), traced; the greatest distance of a hit's position
//! from its ray and from the volume at the hit's rest point, in parts of the box's diagonal;
//! and the closest hits of a part of the rays against those found by
//! bisecting every patch to convergence. Exits with 1 if a figure is above its bound.

use std::path::Path;
use std::process::ExitCode;

use glam::DVec3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use trimray::random::SplitMix64;
use trimray::scene::{BuiltScene, parse_scene};
use trimray::spline::SplineVolume;
use trimray::trace::{Ray, TraceStatistics, closest_hit_by_subdivision};

/// Rays for the accuracy of hits.
const RAYS: u64 = 1_000_000;

/// Rays compared with brute force.
const BRUTE_FORCE_RAYS: u64 = 100_000;

/// Bound on distances, in parts of the diagonal.
const BOUND: f64 = 1e-11;

fn main() -> ExitCode {
    let mut good = true;
    for scene in std::env::args().skip(1) {
        match measure(Path::new(&scene)) {
            Ok(passed) => good &= passed,
            Err(message) => {
                eprintln!("{message}");
                good = false;
            }
        }
    }
    if good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn measure(path: &Path) -> Result<bool, String> {
    let built = parse_scene(path).and_then(|scene| scene.build()).map_err(|error| error.to_string())?;
    let [low, high] = deformed_bounds(&built);
    let diagonal = (high - low).length();
    println!("{}", path.display());
    let mut good = true;
    for (object, made) in built.traced.objects().iter().zip(&built.objects) {
        println!("  {}: {} sub-polygons, {} patches", object.name, made.subpolygons, object.faces().len());
    }
    let (to_ray, to_volume, hits, statistics) = accuracy(&built, low, high);
    println!(
        "  {RAYS} rays, {hits} hits: {:e} from the ray, {:e} from volume(rest)",
        to_ray / diagonal,
        to_volume / diagonal
    );
    println!("  {statistics:?}");
    good &= to_ray <= BOUND * diagonal && to_volume <= BOUND * diagonal && statistics.not_converged == 0;
    let (worst, wrong) = brute_force(&built, low, high, diagonal);
    println!(
        "  {BRUTE_FORCE_RAYS} rays by brute force: {wrong} differ, greatest difference of the rest {worst:e}"
    );
    good &= wrong == 0;
    Ok(good)
}

/// The box of the deformed objects: a ground far larger than they would take most rays.
fn deformed_bounds(built: &BuiltScene) -> [DVec3; 2] {
    let deformed = (0..built.objects.len()).filter(|&object| !built.objects[object].lattices.is_empty());
    deformed
        .map(|object| built.traced.object_bounds(object))
        .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
        .unwrap_or_else(|| built.traced.bounds())
}

/// A ray through two random points: one on the sphere around the box, one in the box.
fn random_ray(number: u64, low: DVec3, high: DVec3) -> Ray {
    let mut random = SplitMix64::new(number.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 1);
    let mut next = || random.next_unit();
    let (centre, radius) = (0.5 * (low + high), 0.6 * (high - low).length());
    let z = 2.0 * next() - 1.0;
    let ring = (1.0 - z * z).sqrt();
    let phi = std::f64::consts::TAU * next();
    let origin = centre + radius * DVec3::new(ring * phi.cos(), ring * phi.sin(), z);
    let target = low + DVec3::new(next(), next(), next()) * (high - low);
    Ray::new(origin, target - origin)
}

fn accuracy(built: &BuiltScene, low: DVec3, high: DVec3) -> (f64, f64, u64, TraceStatistics) {
    const CHUNK: u64 = 1000;
    let chunk = |first: u64| {
        let mut tracer = built.traced.tracer();
        let (mut to_ray, mut to_volume, mut hits): (f64, f64, u64) = (0.0, 0.0, 0);
        for number in first..first + CHUNK {
            let ray = random_ray(number, low, high);
            for hit in tracer.all(&ray) {
                let hit = built.traced.interaction(&hit);
                hits += 1;
                let direction = ray.direction.normalize();
                to_ray = to_ray.max((hit.position - ray.origin).cross(direction).length());
                let lattices = built.objects[hit.object as usize].lattices.iter();
                let place = lattices.fold(hit.rest, |place, lattice| deformed(&lattice.volume, place));
                to_volume = to_volume.max((place - hit.position).length());
            }
        }
        (to_ray, to_volume, hits, tracer.statistics())
    };
    (0..RAYS / CHUNK).into_par_iter().map(|index| chunk(index * CHUNK)).reduce(
        || (0.0, 0.0, 0, TraceStatistics::default()),
        |a, b| {
            let mut statistics = a.3;
            statistics += b.3;
            (a.0.max(b.0), a.1.max(b.1), a.2 + b.2, statistics)
        },
    )
}

/// The volume at a point; the point itself outside, where a point within rounding of the box is taken to be inside.
fn deformed(volume: &SplineVolume, rest: DVec3) -> DVec3 {
    let [low, high] = volume.bounds();
    let slack = 1e-13 * (high - low).length();
    if rest.cmpge(low - slack).all() && rest.cmple(high + slack).all() {
        volume.eval(rest.clamp(low, high)).map_or(rest, |point| point.position)
    } else {
        rest
    }
}

fn brute_force(built: &BuiltScene, low: DVec3, high: DVec3, diagonal: f64) -> (f64, u64) {
    let compare = |number: u64| {
        let ray = random_ray(number, low, high);
        let want = closest_hit_by_subdivision(&built.traced, &ray, 1e-13);
        let hit = built.traced.closest_hit(&ray);
        let got = hit.map_or(f64::INFINITY, |hit| hit.t);
        if got == want {
            return (0.0, 0);
        }
        // across the surface: along a ray that grazes it, a rounding of either is magnified by 1 / cos
        let cos = hit.map_or(1.0, |hit| hit.normal.dot(ray.direction.normalize()).abs());
        let difference = (got - want).abs() * ray.direction.length() * cos / diagonal;
        if difference <= BOUND {
            (difference, 0)
        } else {
            eprintln!("  ray {number}: t = {got}, by brute force {want}");
            (0.0, 1)
        }
    };
    (0..BRUTE_FORCE_RAYS).into_par_iter().map(compare).reduce(|| (0.0, 0), |a, b| (a.0.max(b.0), a.1 + b.1))
}
