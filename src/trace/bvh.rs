//! The acceleration structure: the one file that knows obvhs and single precision.
//!
//! obvhs builds; rays traverse in double precision, so that only the boxes are rounded, and those outward.

use std::time::Duration;

use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

use super::Ray;

/// A slab test's entry and exit are each off by three rounded operations at most; so much is added to the exit.
///
/// Source: Ize (2013), *Robust BVH ray traversal*.
const SLAB_SLACK: f64 = 1.0 + 8.0 * f64::EPSILON;

/// A bounding volume hierarchy over boxes in double precision.
pub(crate) struct Bvh {
    bvh: Bvh2,
    /// Boxes are kept about this point, in units of a power of two, so that single precision serves scenes of every
    /// size and place.
    centre: DVec3,
    scale: f64,
}

impl std::fmt::Debug for Bvh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Bvh").field("nodes", &self.bvh.nodes.len()).finish_non_exhaustive()
    }
}

struct OutwardBox(Aabb);

impl Boundable for OutwardBox {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Bvh {
    /// Builds over the boxes `[lowest corner, highest corner]`, which must be finite.
    pub(crate) fn build(boxes: &[[DVec3; 2]]) -> Self {
        let [low, high] = boxes
            .iter()
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], b| [low.min(b[0]), high.max(b[1])]);
        let (centre, extent) = if boxes.is_empty() {
            (DVec3::ZERO, 0.0)
        } else {
            (0.5 * low + 0.5 * high, (high - low).max_element())
        };
        let scale = if extent > 0.0 { libm::exp2(-libm::ceil(libm::log2(extent))) } else { 1.0 };
        let outward: Vec<_> = boxes
            .iter()
            .map(|&[low, high]| {
                let (low, high) = ((low - centre) * scale, (high - centre) * scale);
                OutwardBox(Aabb { min: each(low, round_down), max: each(high, round_up) })
            })
            .collect();
        let mut core_build_time = Duration::ZERO;
        // a patch costs far more to test than a box
        let parameters = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::medium_build() };
        let bvh = build_bvh2(&outward, parameters, &mut core_build_time);
        debug_assert!(
            boxes.is_empty()
                || bvh.validate(&outward, false, false).discovered_primitives.len() == boxes.len(),
            "every box is in the tree"
        );
        Self { bvh, centre, scale }
    }

    /// Number of nodes.
    pub(crate) fn nodes(&self) -> usize {
        self.bvh.nodes.len()
    }

    /// Memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.bvh.nodes) + size_of_val(&*self.bvh.primitive_indices)
    }

    /// Visits the boxes a ray enters before `t_max`, nearer ones first as far as the tree tells.
    ///
    /// `visit` is given a box's index and the greatest `t` of interest, and returns the new one; a return of
    /// `f64::NEG_INFINITY` ends the traversal. Which boxes are visited does not depend on the ray's length.
    pub(crate) fn traverse(&self, ray: &Ray, mut visit: impl FnMut(usize, f64) -> f64) {
        if self.bvh.nodes.is_empty() {
            return;
        }
        let slabs = Slabs {
            origin: (ray.origin - self.centre) * self.scale,
            inverse: ray.direction.recip() / self.scale,
            t_min: ray.t_min,
        };
        // rounding of the origin's shift, as a distance
        let slack = 4.0
            * f64::EPSILON
            * (ray.origin.abs().max_element() + self.centre.abs().max_element())
            * self.scale;
        let mut t_max = ray.t_max;
        let mut stack: Vec<(usize, f64)> = Vec::with_capacity(64);
        if let Some(entry) = slabs.entry(&self.bvh.nodes[0].aabb, slack, t_max) {
            stack.push((0, entry));
        }
        while let Some((index, entry)) = stack.pop() {
            if entry > t_max {
                continue;
            }
            let node = &self.bvh.nodes[index];
            let first = node.first_index as usize;
            if node.prim_count > 0 {
                for &primitive in &self.bvh.primitive_indices[first..first + node.prim_count as usize] {
                    t_max = visit(primitive as usize, t_max);
                }
                if t_max == f64::NEG_INFINITY {
                    return;
                }
                continue;
            }
            let [left, right] = [first, first + 1].map(|child| {
                slabs.entry(&self.bvh.nodes[child].aabb, slack, t_max).map(|entry| (child, entry))
            });
            match (left, right) {
                (Some(a), Some(b)) => {
                    let (near, far) = if a.1 <= b.1 { (a, b) } else { (b, a) };
                    stack.push(far);
                    stack.push(near);
                }
                (Some(only), None) | (None, Some(only)) => stack.push(only),
                (None, None) => {}
            }
        }
    }
}

struct Slabs {
    origin: DVec3,
    inverse: DVec3,
    t_min: f64,
}

impl Slabs {
    /// Where the ray enters a box, if it does before `t_max`.
    ///
    /// A direction component of 0 gives infinite bounds, or NaN for an origin in a side's plane, which `f64::min` and
    /// `f64::max` drop: that side then does not exclude the box.
    fn entry(&self, aabb: &Aabb, slack: f64, t_max: f64) -> Option<f64> {
        let low = aabb.min.as_dvec3() - slack;
        let high = aabb.max.as_dvec3() + slack;
        let (mut enter, mut leave) = (self.t_min, t_max);
        for axis in 0..3 {
            let a = (low[axis] - self.origin[axis]) * self.inverse[axis];
            let b = (high[axis] - self.origin[axis]) * self.inverse[axis];
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b) * SLAB_SLACK);
        }
        (enter <= leave).then_some(enter)
    }
}

fn each(v: DVec3, round: fn(f64) -> f32) -> Vec3A {
    Vec3A::new(round(v.x), round(v.y), round(v.z))
}

/// The greatest single-precision number not above `x`.
#[expect(clippy::cast_possible_truncation, reason = "rounding to single precision is the purpose")]
fn round_down(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) > x { nearest.next_down() } else { nearest }
}

/// The least single-precision number not below `x`.
#[expect(clippy::cast_possible_truncation, reason = "rounding to single precision is the purpose")]
fn round_up(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) < x { nearest.next_up() } else { nearest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Noise;

    #[test]
    fn traversal_visits_what_brute_force_does() {
        let mut noise = Noise(3);
        for (scale, offset) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6), (1e-30, 0.0)] {
            let mut vector = || noise.vector();
            let boxes: Vec<_> = (0..200)
                .map(|i| {
                    let (a, b) = (vector(), vector() * if i % 3 == 0 { 0.0 } else { 0.1 });
                    [a - b.abs(), a + b.abs()].map(|p| p * scale + offset)
                })
                .collect();
            let bvh = Bvh::build(&boxes);
            for number in 0..500 {
                let target = boxes[number * 7 % boxes.len()];
                let origin = vector() * 3.0 * scale + offset;
                let mut direction = 0.5 * (target[0] + target[1]) - origin;
                if direction.x.abs() < 0.2 * scale {
                    direction.x = 0.0;
                }
                let ray = Ray::new(origin, direction);
                let mut visited = vec![false; boxes.len()];
                bvh.traverse(&ray, |index, t_max| {
                    visited[index] = true;
                    t_max
                });
                for (index, &[low, high]) in boxes.iter().enumerate() {
                    let middle = 0.5 * (low + high);
                    // a point of the ray well inside the box proves a crossing
                    let t = (middle - origin).dot(direction) / direction.length_squared();
                    let p = ray.at(t);
                    let crossed = p.cmpge(low).all() && p.cmple(high).all() && t > 0.0;
                    assert!(
                        !crossed || visited[index],
                        "box {index} crossed but not visited at scale {scale}"
                    );
                }
            }
        }
    }

    #[test]
    fn boxes_round_outward() {
        for x in [0.1, -0.1, 1e-50, -1e-50, 16_777_217.0, 0.0, 1.0] {
            assert!(f64::from(round_down(x)) <= x && f64::from(round_up(x)) >= x, "{x}");
        }
    }

    #[test]
    fn nothing_and_a_point_are_fine() {
        let nothing = Bvh::build(&[]);
        nothing.traverse(&Ray::new(DVec3::ZERO, DVec3::X), |_, _| panic!("nothing to visit"));
        let point = Bvh::build(&[[DVec3::ONE, DVec3::ONE]]);
        let mut visits = 0;
        point.traverse(&Ray::new(DVec3::ZERO, DVec3::ONE), |_, t| {
            visits += 1;
            t
        });
        assert_eq!(visits, 1);
    }
}
