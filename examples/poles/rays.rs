//! Rays at poles and next to them.

use glam::{DVec2, DVec3};
use trimray::trace::{PatchHit, Ray, Tracer};

use super::shapes::{Pole, Random, Surface};

/// A hit this near to where a ray is aimed is the one.
const NEAR: f64 = 1e-10;

/// One that is tangent: rounding of the ray's height over the surface moves it along the ray by its root, 1.5e-8.
const TANGENT_NEAR: f64 = 1.5e-8;

/// How far a normal may be from the limit.
const NORMAL: f64 = 1e-6;

/// What came of some rays.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    /// Rays traced.
    pub(crate) rays: u64,
    /// Those without a hit where they are aimed.
    pub(crate) lost: u64,
    /// Hits whose normals are not the limit.
    pub(crate) turned: u64,
    /// The greatest distance of a normal from the limit.
    pub(crate) farthest: f64,
    /// The first of those that failed, in words.
    pub(crate) failures: Vec<String>,
}

impl Tally {
    /// Failures that are kept.
    const KEPT: usize = 3;

    /// The counts of both.
    pub(crate) fn merged(mut self, other: Self) -> Self {
        self.rays += other.rays;
        self.lost += other.lost;
        self.turned += other.turned;
        self.farthest = self.farthest.max(other.farthest);
        self.failures.extend(other.failures);
        self.failures.truncate(Self::KEPT);
        self
    }

    fn fail(&mut self, failure: impl FnOnce() -> String) {
        if self.failures.len() < Self::KEPT {
            self.failures.push(failure());
        }
    }
}

/// Traces rays at poles of a surface, and at places 1e-16 to 1e-1 of a face away from them, along the axes and any direction
/// that is not all but tangent.
pub(crate) fn run(surface: &Surface, rays: u64, random: &mut Random) -> Tally {
    let mut tally = Tally::default();
    let mut tracer = surface.scene.tracer();
    while tally.rays < rays {
        let pole = surface.poles[random.below(surface.poles.len())];
        let face = &surface.scene.objects()[0].faces()[pole.face];
        let depth = if random.below(2) == 0 { 0.0 } else { libm::pow(10.0, -1.0 - 15.0 * random.unit()) };
        let st = pole.place(0.05 + 0.9 * random.unit(), depth);
        // where formulas of several pieces meet
        if face.exact.as_ref().is_some_and(|exact| !exact.holds(st, DVec2::ZERO)) {
            continue;
        }
        let target = face.eval(st).position;
        let direction = match random.below(4) {
            0 => DVec3::AXES[random.below(3)] * if random.below(2) == 0 { 1.0 } else { -1.0 },
            _ => random.direction(),
        };
        let normal = limit(surface, &pole, st[1 - pole.axis]);
        if normal.dot(direction).abs() < 0.05 {
            continue;
        }
        tally.rays += 1;
        let ray = Ray::new(target - 3.0 * direction, direction);
        check(surface, &mut tracer, &ray, target, &mut tally);
    }
    tally
}

fn check(surface: &Surface, tracer: &mut Tracer<'_>, ray: &Ray, target: DVec3, tally: &mut Tally) {
    let hits = tracer.all(ray);
    let is_near = |hit: &&PatchHit| {
        let most = if hit.tangent { TANGENT_NEAR } else { NEAR };
        ray.at(hit.t).distance(target) <= most
    };
    let near: Vec<_> = hits.iter().filter(is_near).collect();
    let closest = tracer.closest(ray);
    let agrees = closest.is_some_and(|hit| hit.t <= near.first().map_or(0.0, |hit| hit.t) + NEAR);
    if near.is_empty() || !agrees || !tracer.any(ray) {
        tally.lost += 1;
        tally.fail(|| format!("lost {target:?}: {ray:?} {hits:?}, closest {closest:?}"));
        return;
    }
    for hit in near {
        let normal = surface.scene.interaction(hit).normal;
        let Some(pole) = surface.poles.iter().find(|pole| pole.face == hit.patch as usize) else { continue };
        let depth = (hit.st[pole.axis] - pole.end).abs();
        // farther away the normal is another
        if depth > 1e-9 {
            continue;
        }
        let off = normal.distance(limit(surface, pole, hit.st[1 - pole.axis]));
        tally.farthest = tally.farthest.max(off);
        if off.is_nan() || off > NORMAL {
            tally.turned += 1;
            tally.fail(|| format!("normal off by {off:e}: {normal:?}, {hit:?} of {ray:?}"));
        }
    }
}

/// The limit of the normals along a line of a face that ends in a pole, by extrapolation of second order.
fn limit(surface: &Surface, pole: &Pole, along: f64) -> DVec3 {
    let face = &surface.scene.objects()[0].faces()[pole.face];
    let normal = |depth: f64| face.eval(pole.place(along, depth)).normal();
    let [near, middle, far] = [1e-4, 2e-4, 3e-4].map(normal);
    (3.0 * near - 3.0 * middle + far).normalize()
}
