//! Checks the cells of deformed surfaces at many random places: `cargo run --release --example cells -- SCENE…`
//!
//! For each scene: that points of the formula are in the boxes that are proven for their cells, and as near to their cells'
//! patches as is proven; that rays planted on points of the formula, many of them at grazing angles, find these points; and that
//! random rays have the nearest hits that plain subdivision finds.

use std::process::ExitCode;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use trimray::random::SplitMix64;
use trimray::scene::parse_scene;
use trimray::trace::{PatchHit, Ray, TracedScene, closest_hit_by_subdivision};

/// Patches of which points are checked, and how many of each.
const PATCHES: u64 = 200_000;
const POINTS_OF_PATCH: u64 = 100;
const PLANTED: u64 = 100_000;
const BRUTE_FORCE: u64 = 1_000;
/// Width of borders in subdivision, in parts of a patch.
const BORDER: f64 = 1e-8;
const CHUNK: u64 = 1_000;

/// What is drawn at random.
struct Random(SplitMix64);

impl Random {
    /// Uniform in [0, 1).
    fn next(&mut self) -> f64 {
        self.0.next_unit()
    }

    fn direction(&mut self) -> DVec3 {
        let z = 2.0 * self.next() - 1.0;
        let angle = std::f64::consts::TAU * self.next();
        let ring = (1.0 - z * z).sqrt();
        DVec3::new(ring * angle.cos(), ring * angle.sin(), z)
    }

    /// A place of a patch's trim: its object, its index and its parameters.
    fn place(&mut self, scene: &TracedScene) -> Option<(u32, u32, DVec2)> {
        let object = index(self.next(), scene.objects().len());
        let patches = scene.objects()[object].faces();
        let patch = index(self.next(), patches.len());
        let trimmed = &patches[patch];
        let chosen = index(self.next(), trimmed.region.len());
        let corners = trimmed.region.corners(&trimmed.region.trim_loop(chosen));
        let weights: Vec<f64> = corners.iter().map(|_| -(1.0 - self.next()).ln()).collect();
        let sum: f64 = weights.iter().sum();
        let st = corners.iter().zip(&weights).map(|(corner, weight)| *corner * (weight / sum)).sum();
        let inside = trimmed.exact.as_ref().is_none_or(|exact| exact.holds(st, DVec2::ZERO));
        inside.then_some((u32::try_from(object).ok()?, u32::try_from(patch).ok()?, st))
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number below the count")]
fn index(part: f64, count: usize) -> usize {
    (part * count as f64) as usize
}

/// Numbers of checks made and failed, and a greatest value.
type Tally = (u64, u64, f64);

fn tally(count: u64, check: impl Fn(&mut Random) -> (u64, bool, f64) + Sync) -> Tally {
    let chunk = |first: u64| {
        let mut random = Random(SplitMix64::new(first.wrapping_mul(0x2545_f491_4f6c_dd1d)));
        let add = |(made, failed, worst): Tally, (count, good, value): (u64, bool, f64)| {
            (made + count, failed + u64::from(!good), worst.max(value))
        };
        (0..CHUNK).map(|_| check(&mut random)).fold((0, 0, 0.0), add)
    };
    let sum = |a: Tally, b: Tally| (a.0 + b.0, a.1 + b.1, a.2.max(b.2));
    (0..count / CHUNK).into_par_iter().map(chunk).reduce(|| (0, 0, 0.0), sum)
}

/// Whether points of a patch are in its cell's box, and their greatest distance from the patch in parts of what is proven;
/// with how many there were.
fn points(scene: &TracedScene, random: &mut Random) -> (u64, bool, f64) {
    let object = index(random.next(), scene.objects().len());
    let patches = scene.objects()[object].faces();
    let trimmed = &patches[index(random.next(), patches.len())];
    let Some(exact) = &trimmed.exact else { return (0, true, 0.0) };
    let ([low, high], error) = (trimmed.patch.hull_bounds(), exact.error());
    let (mut count, mut good, mut worst) = (0, true, 0.0_f64);
    for _ in 0..POINTS_OF_PATCH {
        let st = DVec2::new(random.next(), random.next());
        if !exact.holds(st, DVec2::ZERO) {
            continue;
        }
        let point = exact.position(st);
        let part = trimmed.patch.eval(st).position.distance(point) / error;
        let inside = point.cmpge(low - error).all() && point.cmple(high + error).all();
        (count, good, worst) = (count + 1, good && inside && part <= 1.0, worst.max(part));
    }
    (count, good, worst)
}

/// Whether a planted ray finds its point, and how far the hit is off, in parts of what its angle allows.
fn planted(scene: &TracedScene, diagonal: f64, random: &mut Random) -> Option<(u64, bool, f64)> {
    let (object, patch, st) = random.place(scene)?;
    let trimmed = &scene.objects()[object as usize].faces()[patch as usize];
    let point = trimmed.eval(st);
    let normal = point.dp_ds.cross(point.dp_dt).try_normalize()?;
    let mut direction = random.direction();
    if random.next() < 0.5 {
        let tilt = 10.0_f64.powf(-4.0 * random.next());
        direction = (direction.reject_from_normalized(normal).try_normalize()? + tilt * normal).normalize();
    }
    let steep = direction.dot(normal).abs();
    if steep < 1e-5 {
        return None;
    }
    let ray = Ray::new(point.position - 2.0 * diagonal * direction, direction);
    let distance = |hit: &PatchHit| {
        let trimmed = &scene.objects()[hit.object as usize].faces()[hit.patch as usize];
        trimmed.eval(hit.st).position.distance(point.position)
    };
    let nearest = scene.all(&ray).iter().map(distance).fold(f64::INFINITY, f64::min);
    let off = nearest * steep / diagonal;
    Some((1, off < 1e-12, off))
}

/// Whether a ray's nearest hit is that of subdivision, and how far apart they are, in parts of the diagonal.
fn compared(scene: &TracedScene, [low, high]: [DVec3; 2], random: &mut Random) -> (u64, bool, f64) {
    let diagonal = (high - low).length();
    let part = DVec3::new(random.next(), random.next(), random.next());
    let direction = random.direction();
    let ray = Ray::new(low + part * (high - low) - 2.0 * diagonal * direction, direction);
    let found = scene.closest(&ray).map_or(f64::INFINITY, |hit| hit.t);
    let other = closest_hit_by_subdivision(scene, &ray, BORDER);
    if found == other {
        return (1, true, 0.0);
    }
    // subdivision finds the patch, which is as far from the surface as proven, over the sine of the angle along the ray
    let apart = (found - other).abs() / diagonal;
    (1, apart < 1e-7, apart)
}

fn main() -> ExitCode {
    let mut good = true;
    for path in std::env::args_os().skip(1) {
        let name = path.display().to_string();
        let built = match parse_scene(path.as_ref()).and_then(|scene| scene.build()) {
            Ok(built) => built,
            Err(error) => {
                eprintln!("{error}");
                return ExitCode::from(2);
            }
        };
        let scene = &built.traced;
        let bounds = scene.bounds();
        let diagonal = (bounds[1] - bounds[0]).length();
        let (count, outside, part) = tally(PATCHES, |random| points(scene, random));
        let (rays, lost, off) =
            tally(PLANTED, |random| planted(scene, diagonal, random).unwrap_or((0, true, 0.0)));
        let (compared, differ, apart) = tally(BRUTE_FORCE, |random| compared(scene, bounds, random));
        println!(
            "{name}: {count} points, {outside} outside of what is proven ({part:.3} of it at most); {rays} planted rays, {lost} lost, \
             {off:.1e} off; {compared} rays by subdivision, {differ} differ, {apart:.1e} apart"
        );
        good &= outside == 0 && lost == 0 && differ == 0;
    }
    if good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
