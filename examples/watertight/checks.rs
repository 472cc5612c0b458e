//! What every ray must do on a closed solid.
//!
//! The solid's volume has a positive Jacobian determinant, so the deformed surface winds around the image of an inner point
//! as often as the volume reaches it, once or more: a ray from there must leave, and one that ends there must enter, and
//! entries less exits between a point far outside and an inner one are the winding number, which is 1 where the
//! volume is one to one.

use glam::DVec3;
use trimray::trace::{PatchHit, Ray, TracedScene};

use super::aim::{Aims, Random, distance};
use super::solids::Solid;

/// Bound on distances of hits from ray and surface, in parts of the diagonal.
const BOUND: f64 = 1e-11;

/// Hits on the same side of the surface that are nearer than this, in parts of the diagonal, are one crossing.
const SAME_PLACE: f64 = 1e-9;

/// A cosine between ray and normal below which the side that the ray comes from is not known.
const GRAZING: f64 = 1e-7;

/// Rays from one point inside where only hits count.
const DIRECTIONS: usize = 64;

/// The kinds of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Test {
    /// From random points inside in random directions, 64 from each; only whether they hit anything.
    Enclosed,
    /// From random points inside in random directions.
    Inside,
    /// From outside through points of borders to points inside, and back.
    Aimed,
    /// Random lines through the solid's sphere.
    Lines,
}

/// Why a ray failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// A ray that must hit does not.
    Leak,
    /// `closest`, `any_hit` and `all` contradict each other.
    Contradiction,
    /// Entries less exits are not what they must be.
    Unbalanced,
    /// A hit is not on the ray, or not on the surface.
    Ghost,
    /// As unbalanced, with a hit within rounding of a border: where the ray grazes an edge or a vertex, the patches
    /// that meet there may be hit singly. No failure, but counted.
    UnbalancedAtBorder,
}

/// A ray that failed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Failure {
    /// Why.
    pub(crate) fault: Fault,
    /// The ray.
    pub(crate) ray: Ray,
}

/// Counts of one test.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    /// Rays traced.
    pub(crate) rays: u64,
    /// Their hits.
    pub(crate) hits: u64,
    /// Rays with a hit within rounding of a border.
    pub(crate) on_border: u64,
    /// Rays that touch the surface, so that their crossings cannot be counted.
    pub(crate) touching: u64,
    /// Aimed rays without a hit at the border point itself, which is no fault if they enter elsewhere.
    pub(crate) beside: u64,
    /// Greatest distance of a hit from its ray.
    pub(crate) from_ray: f64,
    /// Greatest distance of a hit from the volume at its place on the undeformed solid.
    pub(crate) from_volume: f64,
    /// Failures of each kind, in the order of [`Fault`].
    pub(crate) faults: [u64; 5],
    /// The first of them.
    pub(crate) failures: Vec<Failure>,
}

impl Tally {
    /// Failures of each kind that are kept.
    const KEPT: usize = 5;

    fn fail(&mut self, fault: Fault, ray: &Ray) {
        self.faults[fault as usize] += 1;
        self.keep(Failure { fault, ray: *ray });
    }

    fn keep(&mut self, failure: Failure) {
        let kept = self.failures.iter().filter(|other| other.fault == failure.fault).count();
        if kept < Self::KEPT {
            self.failures.push(failure);
        }
    }

    /// Number of failures.
    pub(crate) fn failed(&self) -> u64 {
        let kinds = [Fault::Leak, Fault::Contradiction, Fault::Unbalanced, Fault::Ghost];
        kinds.into_iter().map(|fault| self.faults[fault as usize]).sum()
    }

    /// The counts of both.
    pub(crate) fn merged(mut self, other: Self) -> Self {
        self.rays += other.rays;
        self.hits += other.hits;
        self.on_border += other.on_border;
        self.touching += other.touching;
        self.beside += other.beside;
        self.from_ray = self.from_ray.max(other.from_ray);
        self.from_volume = self.from_volume.max(other.from_volume);
        for (count, more) in self.faults.iter_mut().zip(other.faults) {
            *count += more;
        }
        for failure in other.failures {
            self.keep(failure);
        }
        self
    }
}

/// Rays against one solid.
pub(crate) struct Checker<'a> {
    /// The solid.
    pub(crate) solid: &'a Solid,
    /// Where rays start and end.
    pub(crate) aims: &'a Aims<'a>,
    /// Aimed rays start up to this many diagonals away.
    pub(crate) farthest: f64,
}

impl Checker<'_> {
    /// Traces `rays` random rays of a kind.
    pub(crate) fn run(&self, test: Test, rays: u64, random: &mut Random) -> Tally {
        let mut tally = Tally::default();
        if test == Test::Enclosed {
            for first in (0..rays).step_by(DIRECTIONS) {
                self.enclosed((rays - first).min(DIRECTIONS as u64), random, &mut tally);
            }
            return tally;
        }
        for _ in 0..rays {
            match test {
                Test::Enclosed | Test::Inside => {
                    let ray = Ray::new(self.aims.inside(random), random.direction());
                    self.check(&ray, -1, &mut tally);
                }
                Test::Aimed => self.aimed(random, &mut tally),
                Test::Lines => {
                    let [a, b] = [0, 1].map(|_| random.direction());
                    let origin = self.solid.centre + 1.01 * self.solid.radius * a;
                    self.check(&Ray::new(origin, self.solid.radius * (b - a)), 0, &mut tally);
                }
            }
        }
        tally
    }

    /// Rays from one point inside, by the call that takes many.
    fn enclosed(&self, rays: u64, random: &mut Random, tally: &mut Tally) {
        let origin = self.aims.inside(random);
        let rays: Vec<_> = (0..rays).map(|_| Ray::new(origin, random.direction())).collect();
        let mut found = [false; DIRECTIONS];
        let found = &mut found[..rays.len()];
        self.solid.scene.tracer().any_of_each(&rays, found);
        tally.rays += rays.len() as u64;
        for (ray, found) in rays.iter().zip(found) {
            if *found {
                tally.hits += 1;
            } else {
                tally.fail(Fault::Leak, ray);
            }
        }
    }

    fn aimed(&self, random: &mut Random, tally: &mut Tally) {
        let target = self.aims.target(random);
        let towards = (target.inside - target.border).normalize();
        let away = self.solid.diagonal() * 1.01 * libm::pow(self.farthest, random.unit());
        let origin = target.border - away * towards;
        let ray = Ray { t_max: 1.0, ..Ray::new(origin, target.inside - origin) };
        let hits = self.check(&ray, 1, tally);
        let near = self.same_place(&ray);
        tally.beside += u64::from(!hits.iter().any(|hit| ray.at(hit.t).distance(target.border) <= near));
        self.check(&Ray::new(target.inside, target.border - target.inside), -1, tally);
    }

    /// Traces a ray that enters the solid `balance` times more often than it leaves.
    pub(crate) fn check(&self, ray: &Ray, balance: i64, tally: &mut Tally) -> Vec<PatchHit> {
        let scene = &self.solid.scene;
        tally.rays += 1;
        let mut tracer = scene.tracer();
        let hits = tracer.all(ray);
        tally.hits += hits.len() as u64;
        let closest = tracer.closest(ray);
        if balance != 0 && (closest.is_none() || !tracer.any(ray)) {
            tally.fail(Fault::Leak, ray);
            return hits;
        }
        let first = hits.first().map(|hit| hit.t);
        let apart = |t: f64| (t - first.unwrap_or(f64::INFINITY)).abs() * ray.direction.length();
        let agrees = closest.is_some() == first.is_some()
            && closest.is_none_or(|hit| apart(hit.t) <= self.same_place(ray))
            && tracer.any(ray) == first.is_some();
        if !agrees {
            tally.fail(Fault::Contradiction, ray);
            return hits;
        }
        if hits.iter().any(|hit| self.is_ghost(ray, hit, tally)) {
            tally.fail(Fault::Ghost, ray);
            return hits;
        }
        tally.on_border += u64::from(hits.iter().any(|hit| hit.on_border));
        match self.crossings(ray, &hits) {
            None => tally.touching += 1,
            Some(got) if got != balance => {
                let at_border = hits.iter().any(|hit| self.is_at_border(ray, hit));
                tally.fail(if at_border { Fault::UnbalancedAtBorder } else { Fault::Unbalanced }, ray);
            }
            Some(_) => {}
        }
        hits
    }

    /// How near hits of a ray are one crossing: far from the origin roundings are larger.
    fn same_place(&self, ray: &Ray) -> f64 {
        SAME_PLACE * (self.solid.diagonal() + 1e-3 * ray.origin.distance(self.solid.centre))
    }

    /// Entries less exits; `None` if the ray touches the surface, or enters and leaves in one place.
    fn crossings(&self, ray: &Ray, hits: &[PatchHit]) -> Option<i64> {
        let length = ray.direction.length();
        let mut sum = 0;
        let mut last: Option<(f64, i64, f64)> = None;
        for hit in hits {
            let slide = self.slide(ray, hit);
            let cos = self.solid.scene.interaction(hit).normal.dot(ray.direction) / length;
            if hit.tangent || cos.abs() < GRAZING {
                return None;
            }
            let sign = if cos < 0.0 { 1 } else { -1 };
            let reach = |before: f64| self.same_place(ray) + slide + before;
            let same_place = last.filter(|&(t, _, before)| (hit.t - t) * length <= reach(before));
            match same_place {
                Some((_, other, _)) if other != sign => return None,
                Some(_) => {}
                None => sum += sign,
            }
            last = Some((hit.t, sign, slide));
        }
        Some(sum)
    }

    /// How far rounding across the ray, which grows with the distance of its origin, may have moved a hit along the surface.
    fn slide(&self, ray: &Ray, hit: &PatchHit) -> f64 {
        let error = self.solid.scene.st_error(hit, ray);
        let point = self.solid.scene.objects()[0].faces()[hit.patch as usize].eval(hit.st);
        error.x * point.dp_ds.length() + error.y * point.dp_dt.length()
    }

    /// Whether a hit is within rounding of the border of its loop, on either side.
    fn is_at_border(&self, ray: &Ray, hit: &PatchHit) -> bool {
        let trim = &self.solid.scene.objects()[0].faces()[hit.patch as usize].region;
        let tolerance = 2.0 * self.solid.scene.st_error(hit, ray) + 1e-12;
        let own = trim.loops().filter(|trim_loop| trim_loop.polygon == hit.polygon);
        let corners = own.map(|trim_loop| trim.corners(&trim_loop));
        let mut edges = corners.flat_map(|corners| corners.iter().zip(corners.iter().cycle().skip(1)));
        edges.any(|(&a, &b)| {
            let edge = b - a;
            edge.perp_dot(hit.st - a).abs() <= edge.x.abs() * tolerance.y + edge.y.abs() * tolerance.x
        })
    }

    /// Whether a hit is off its ray, off the deformed surface, or off its polygon on the undeformed one.
    fn is_ghost(&self, ray: &Ray, hit: &PatchHit, tally: &mut Tally) -> bool {
        let (scene, diagonal): (&TracedScene, f64) = (&self.solid.scene, self.solid.diagonal());
        let interaction = scene.interaction(hit);
        let offset = interaction.position - ray.origin;
        let from_ray = offset.cross(ray.direction.normalize()).length() / diagonal;
        let [low, high] = self.solid.volume.bounds();
        let exact = self.solid.volume.eval(interaction.rest.clamp(low, high));
        let exact = exact.map_or(DVec3::NAN, |point| point.position);
        let from_volume = exact.distance(interaction.position) / diagonal;
        tally.from_ray = tally.from_ray.max(from_ray);
        tally.from_volume = tally.from_volume.max(from_volume);
        let [_, s, t] = scene.objects()[0].faces()[hit.patch as usize].chart.coordinates();
        let error = scene.st_error(hit, ray);
        let st_error = error.x * s.length() + error.y * t.length();
        let slide = error.x * interaction.dp_ds.length() + error.y * interaction.dp_dt.length();
        let corners = &self.solid.polygons[hit.polygon as usize];
        let off_polygon = corners[1..]
            .windows(2)
            .map(|pair| distance(interaction.rest, [corners[0], pair[0], pair[1]]))
            .fold(f64::INFINITY, f64::min);
        // the ray itself is known to the rounding of some tens of operations on coordinates of its origin's size
        let far = 64.0 * f64::EPSILON * ray.origin.distance(self.solid.centre) / diagonal;
        // at a border a hit may be as far outside as its error says, and the volume ends there; so written, NaN is a ghost
        !(from_ray <= BOUND + far
            && from_volume <= BOUND + 2.0 * slide / diagonal
            && off_polygon <= BOUND * diagonal + 2.0 * st_error)
    }
}

/// The hits of one ray, in words.
pub(crate) fn describe(solid: &Solid, ray: &Ray) -> String {
    use std::fmt::Write;
    let mut text = String::new();
    let mut tracer = solid.scene.tracer();
    for hit in tracer.all(ray) {
        let normal = solid.scene.interaction(&hit).normal;
        let cos = normal.dot(ray.direction) / ray.direction.length();
        writeln!(text, "  cos {cos:+e} {hit:?}").expect("writing to a String cannot fail");
    }
    let statistics = tracer.statistics();
    writeln!(text, "  {statistics:?}").expect("writing to a String cannot fail");
    text
}
