//! The reference for the tests: every patch, by subdivision to convergence, without acceleration structure, clipping
//! or Newton's method.

use glam::DVec2;

use crate::math::bernstein;
use crate::patch::Face;

use super::Ray;
use super::projection::{AcrossRay, ProjectedNet, excludes_zero, range};
use super::scene::TracedScene;

/// A box this small in both parameters is a zero if its hull still holds one: its image is far below any tolerance.
const SMALLEST: f64 = 1.0 / (1_u64 << 46) as f64;

/// The nearest hit over all patches by bisection alone: its `t`, or infinity.
///
/// A box of a patch's net that cannot hold a zero is dropped, the rest is halved until it is 2^-46 wide; what is left
/// is tested against the trim with the tolerance `border` along s and t.
pub fn closest_hit_by_subdivision(scene: &TracedScene, ray: &Ray, border: f64) -> f64 {
    let across = AcrossRay::new(ray);
    let mut net = ProjectedNet::default();
    let mut closest = f64::INFINITY;
    for trimmed in scene.objects().iter().flat_map(|object| object.faces()) {
        let extent = trimmed.patch.extent();
        net.project(&trimmed.patch, &across, across.rounding(extent.magnitude, extent.greatest_weight));
        if !net.misses() {
            let mut stack = Subdivision { ray, trimmed, margin: net.rounding, border, closest };
            stack.search(&net.points, DVec2::ZERO, DVec2::ONE);
            closest = stack.closest;
        }
    }
    closest
}

struct Subdivision<'a> {
    ray: &'a Ray,
    trimmed: &'a Face,
    margin: f64,
    border: f64,
    closest: f64,
}

impl Subdivision<'_> {
    fn search(&mut self, points: &[DVec2], low: DVec2, high: DVec2) {
        let [least, greatest] = range(points);
        if excludes_zero(least, greatest, self.margin) {
            return;
        }
        let size = high - low;
        if size.max_element() <= SMALLEST {
            self.accept(0.5 * (low + high));
            return;
        }
        let [m, n] = self.trimmed.patch.degree();
        let mut first = points.to_vec();
        let mut second = points.to_vec();
        let middle = 0.5 * (low + high);
        let (mut first_high, mut second_low) = (high, low);
        if size.x >= size.y {
            for j in 0..=n {
                bernstein::split(&mut first[j..], &mut second[j..], n + 1, m, 0.5);
            }
            (first_high.x, second_low.x) = (middle.x, middle.x);
        } else {
            for i in 0..=m {
                let row = i * (n + 1);
                bernstein::split(&mut first[row..], &mut second[row..], 1, n, 0.5);
            }
            (first_high.y, second_low.y) = (middle.y, middle.y);
        }
        self.search(&first, low, first_high);
        self.search(&second, second_low, high);
    }

    fn accept(&mut self, st: DVec2) {
        if self.trimmed.region.find(st, DVec2::splat(self.border)).is_none()
            || !self.trimmed.holds(st, DVec2::splat(self.border))
        {
            return;
        }
        let position = self.trimmed.eval(st).position;
        let t = (position - self.ray.origin).dot(self.ray.direction) / self.ray.direction.length_squared();
        if t > self.ray.t_min && t < self.ray.t_max {
            self.closest = self.closest.min(t);
        }
    }
}
