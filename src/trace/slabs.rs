//! Wide nodes and the slab tests of rays against their boxes, in single precision.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, f32x16, f64x8, mask32x16};

use crate::math::lanes::Real;

use super::leaf_test::LocalRays;
use super::local::LocalRay;
use super::single_precision::{down, nearest, up};

/// Children of a node: as many boxes as the widest common vectors hold in single precision.
pub(super) const WIDTH: usize = 8;

/// A slab test's exit is multiplied by this: entry and exit are each off by three rounded operations at most, and by
/// one of the conversion to a distance in the tree's units.
///
/// Source: Ize (2013), *Robust BVH ray traversal*.
const SLAB_SLACK: f32 = 1.0 + 8.0 * f32::EPSILON;

/// Greatest reciprocal of a direction's component: finite, so that its product with 0 is 0 and not NaN, and yet far
/// beyond any distance for the least difference of two coordinates.
const STEEPEST: f64 = 1e37;

/// Eight boxes and what they hold. Unused places have boxes that no ray enters.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(super) struct Node {
    /// For each axis the eight lower planes, then the eight upper ones.
    pub(super) planes: [[[f32; WIDTH]; 2]; 3],
    pub(super) children: [u32; WIDTH],
}

impl Node {
    pub(super) const EMPTY: Self =
        Self { planes: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3], children: [0; WIDTH] };

    pub(super) fn set(&mut self, place: usize, [low, high]: [[f32; 3]; 2], child: u32) {
        for axis in 0..3 {
            self.planes[axis][0][place] = low[axis];
            self.planes[axis][1][place] = high[axis];
        }
        self.children[place] = child;
    }
}

/// A ray ready for slab tests.
pub(super) struct Slabs<S: Simd> {
    /// To the near planes, to the far ones.
    origin: [[f32x8<S>; 2]; 3],
    inverse: [f32x8<S>; 3],
    /// Index of the near plane of each axis.
    near: [usize; 3],
    t_min: f32x8<S>,
}

/// A ray's numbers for slab tests, with unit direction.
pub(super) struct SlabRay {
    /// The origin moved forth by its own rounding, and back.
    to_near: [f32; 3],
    to_far: [f32; 3],
    inverse: [f32; 3],
    backward: [bool; 3],
    t_min: f32,
    /// The tree's distance for each unit of the ray's `t`.
    per_t: f64,
}

/// Bound on the rounding of an origin's coordinate: in double precision, and of the result in single precision.
#[inline(always)]
fn slack<R: Real>(rounding: R, origin: R) -> R {
    rounding + origin.abs() * f64::from(f32::EPSILON) + f64::from(f32::MIN_POSITIVE)
}

impl SlabRay {
    #[expect(clippy::cast_possible_truncation, reason = "roundings to single precision are within the slack")]
    #[inline(always)]
    pub(super) fn new(ray: &LocalRay, t_min: f64) -> Self {
        let per_t = ray.direction.length();
        let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
        let mut numbers = Self {
            to_near: [0.0; 3],
            to_far: [0.0; 3],
            inverse: [0.0; 3],
            backward: [false; 3],
            t_min: (t_min * per_t) as f32 * (1.0 - 4.0 * f32::EPSILON),
            per_t,
        };
        for axis in 0..3 {
            let slack = slack(ray.rounding, origin[axis]);
            // -0 goes forwards
            let backward = direction[axis] < 0.0;
            let sign = if backward { -1.0 } else { 1.0 };
            numbers.to_near[axis] = (origin[axis] + sign * slack) as f32;
            numbers.to_far[axis] = (origin[axis] - sign * slack) as f32;
            numbers.inverse[axis] = (sign * (per_t / direction[axis].abs()).min(STEEPEST)) as f32;
            numbers.backward[axis] = backward;
        }
        numbers
    }

    /// A ray parameter as a distance in the tree, rounded up.
    #[expect(clippy::cast_possible_truncation, reason = "rounded up by the factor")]
    #[inline(always)]
    pub(super) fn distance(&self, t: f64) -> f32 {
        (t * self.per_t) as f32 * SLAB_SLACK
    }
}

impl<S: Simd> Slabs<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, ray: &SlabRay) -> Self {
        let splat = |x: f32| f32x8::splat(simd, x);
        let origin = |axis: usize| [splat(ray.to_near[axis]), splat(ray.to_far[axis])];
        let [x, y, z] = ray.inverse;
        let [backward_x, backward_y, backward_z] = ray.backward;
        Self {
            origin: [origin(0), origin(1), origin(2)],
            inverse: [splat(x), splat(y), splat(z)],
            near: [usize::from(backward_x), usize::from(backward_y), usize::from(backward_z)],
            t_min: splat(ray.t_min),
        }
    }

    /// Where the ray enters each of a node's boxes, and a bit for each that it enters before `far`.
    #[inline(always)]
    pub(super) fn entries(&self, node: &Node, far: f32) -> ([f32; WIDTH], u64) {
        entries(
            node,
            (self.near, self.t_min, far),
            #[inline(always)]
            |axis, near, far| {
                let ([to_near, to_far], inverse) = (self.origin[axis], self.inverse[axis]);
                [(near - to_near) * inverse, (far - to_far) * inverse]
            },
        )
    }
}

/// Where rays enter each of a node's boxes, and a bit for each that they enter before `far`. `cross` says where they cross
/// the near planes of an axis and the far ones; `near` has the index of each axis's near planes.
#[inline(always)]
fn entries<S: Simd>(
    node: &Node,
    (near, t_min, far): ([usize; 3], f32x8<S>, f32),
    cross: impl Fn(usize, f32x8<S>, f32x8<S>) -> [f32x8<S>; 2],
) -> ([f32; WIDTH], u64) {
    let simd = t_min.token();
    let mut enter = t_min;
    let mut leave = f32x8::splat(simd, far);
    for axis in 0..3 {
        let planes = &node.planes[axis];
        let [entry, exit] =
            cross(axis, planes[near[axis]].simd_into(simd), planes[1 - near[axis]].simd_into(simd));
        enter = enter.max(entry);
        leave = leave.min(exit * SLAB_SLACK);
    }
    (enter.into(), enter.simd_le(leave).to_bitmask())
}

/// Rays of a packet ready for slab tests: all between the least and the greatest of their numbers.
///
/// Products with the ends of an interval bound those with what is between them, roundings included.
pub(crate) struct PacketSlabs<S: Simd> {
    /// The origins' ends farthest from the near planes, and farthest from the far ones.
    origin: [[f32x8<S>; 2]; 3],
    /// Least and greatest reciprocal of the directions' components.
    inverse: [[f32x8<S>; 2]; 3],
    /// Index of the near plane of each axis.
    near: [usize; 3],
    t_min: f32x8<S>,
    /// Where the longest ray ends.
    pub(super) far: f32,
    /// The greatest distance of the tree for each unit of a ray's `t`.
    per_t: f64,
}

/// One axis of a [`PacketSlabs`].
struct PacketAxis {
    origin: [f32; 2],
    inverse: [f32; 2],
    near: usize,
}

impl PacketAxis {
    /// `None` if some rays go forwards and some backwards.
    #[inline(always)]
    fn new<S: Simd>(
        origin: [f64x8<S>; 2],
        direction: [f64x8<S>; 2],
        rounding: [f64x8<S>; 2],
        per_t: [f64x8<S>; 2],
    ) -> Option<Self> {
        let zero = f64x8::splat(per_t[0].token(), 0.0);
        let backward = direction[0].simd_lt(zero).to_bitmask();
        if direction[1].simd_lt(zero).to_bitmask() != backward || (backward != 0 && backward != 0xff) {
            return None;
        }
        let slack = [slack(rounding[0], origin[0]), slack(rounding[1], origin[1])];
        let least = down((origin[0] - slack[0]).lesser(origin[1] - slack[1]).reduce_min());
        let greatest = up((origin[0] + slack[0]).greater(origin[1] + slack[1]).reduce_max());
        let steepness = [per_t[0] / Real::abs(direction[0]), per_t[1] / Real::abs(direction[1])];
        let inverse = [
            down(steepness[0].lesser(steepness[1]).reduce_min().min(STEEPEST)),
            up(steepness[0].greater(steepness[1]).reduce_max().min(STEEPEST)),
        ];
        // forwards, near planes are farthest from the greatest origins, far planes from the least
        Some(if backward == 0 {
            Self { origin: [greatest, least], inverse, near: 0 }
        } else {
            Self { origin: [least, greatest], inverse: inverse.map(|x| -x), near: 1 }
        })
    }
}

impl<S: Simd> PacketSlabs<S> {
    /// The slabs of rays side by side; `None` if their directions are not all in one octant.
    #[inline(always)]
    pub(crate) fn new(simd: S, [a, b]: [&LocalRays<f64x8<S>>; 2]) -> Option<Self> {
        let per_t = [Real::sqrt(a.direction.dot(a.direction)), Real::sqrt(b.direction.dot(b.direction))];
        let slack = [a.rounding, b.rounding];
        let x = PacketAxis::new([a.origin.x, b.origin.x], [a.direction.x, b.direction.x], slack, per_t)?;
        let y = PacketAxis::new([a.origin.y, b.origin.y], [a.direction.y, b.direction.y], slack, per_t)?;
        let z = PacketAxis::new([a.origin.z, b.origin.z], [a.direction.z, b.direction.z], slack, per_t)?;
        let t_min = (a.t_min * per_t[0]).lesser(b.t_min * per_t[1]).reduce_min();
        let splat = |[p, q]: [f32; 2]| [f32x8::splat(simd, p), f32x8::splat(simd, q)];
        let mut slabs = Self {
            origin: [splat(x.origin), splat(y.origin), splat(z.origin)],
            inverse: [splat(x.inverse), splat(y.inverse), splat(z.inverse)],
            near: [x.near, y.near, z.near],
            t_min: f32x8::splat(simd, nearest(t_min) * (1.0 - 4.0 * f32::EPSILON)),
            far: 0.0,
            per_t: per_t[0].greater(per_t[1]).reduce_max(),
        };
        slabs.far = slabs.distance(a.t_max.greater(b.t_max));
        Some(slabs)
    }

    /// The greatest distance in the tree of ray parameters, rounded up.
    #[inline(always)]
    pub(super) fn distance(&self, t: f64x8<S>) -> f32 {
        nearest(t.reduce_max() * self.per_t) * SLAB_SLACK
    }

    /// Bounds of where the rays enter each of a node's boxes, and a bit for each box that one can enter before `far`.
    #[inline(always)]
    pub(super) fn entries(&self, node: &Node, far: f32) -> ([f32; WIDTH], u64) {
        entries(
            node,
            (self.near, self.t_min, far),
            #[inline(always)]
            |axis, near, far| {
                let [to_near, to_far] = self.origin[axis];
                let [least, greatest] = self.inverse[axis];
                let (near, far) = (near - to_near, far - to_far);
                [(near * least).min(near * greatest), (far * least).max(far * greatest)]
            },
        )
    }
}

/// Rays of a packet ready for slab tests of each by itself.
pub(crate) struct SpreadSlabs<S: Simd> {
    /// The origins moved by their rounding, for lower planes and for upper ones.
    origin: [[f32x16<S>; 2]; 3],
    inverse: [f32x16<S>; 3],
    t_min: f32x16<S>,
    /// The tree's distance for each unit of the rays' `t`.
    per_t: [f64x8<S>; 2],
}

impl<S: Simd> SpreadSlabs<S> {
    /// The slabs of rays side by side.
    #[inline(always)]
    pub(crate) fn new(simd: S, [a, b]: [&LocalRays<f64x8<S>>; 2]) -> Self {
        let per_t = [Real::sqrt(a.direction.dot(a.direction)), Real::sqrt(b.direction.dot(b.direction))];
        let origin = |p: f64x8<S>, q: f64x8<S>| {
            let (e, f) = (slack(a.rounding, p), slack(b.rounding, q));
            [simd.narrow_f64x8(p + e, q + f), simd.narrow_f64x8(p - e, q - f)]
        };
        let steep = |per_t: f64x8<S>, d: f64x8<S>| {
            // -0 goes forwards
            let inverse = (per_t / Real::abs(d)).lesser(d.all(STEEPEST));
            f64x8::select(Real::lt(d, d.all(0.0)), -inverse, inverse)
        };
        let inverse = |p: f64x8<S>, q: f64x8<S>| simd.narrow_f64x8(steep(per_t[0], p), steep(per_t[1], q));
        Self {
            origin: [
                origin(a.origin.x, b.origin.x),
                origin(a.origin.y, b.origin.y),
                origin(a.origin.z, b.origin.z),
            ],
            inverse: [
                inverse(a.direction.x, b.direction.x),
                inverse(a.direction.y, b.direction.y),
                inverse(a.direction.z, b.direction.z),
            ],
            t_min: simd.narrow_f64x8(a.t_min * per_t[0], b.t_min * per_t[1]) * (1.0 - 4.0 * f32::EPSILON),
            per_t,
        }
    }

    /// Ray parameters as distances in the tree, rounded up.
    #[inline(always)]
    pub(crate) fn distances(&self, [a, b]: [f64x8<S>; 2]) -> f32x16<S> {
        let simd = self.t_min.token();
        simd.narrow_f64x8(a * self.per_t[0], b * self.per_t[1]) * SLAB_SLACK
    }

    /// Where the first of some rays enters a node's box, and a bit for each that enters it before its end.
    #[inline(always)]
    pub(super) fn entry(&self, node: &Node, lane: usize, far: f32x16<S>, rays: u64) -> (f32, u64) {
        let mut enter = self.t_min;
        let mut leave = far;
        for axis in 0..3 {
            let [low, high] = [node.planes[axis][0][lane], node.planes[axis][1][lane]];
            let [to_low, to_high] = self.origin[axis];
            let low = (-to_low + low) * self.inverse[axis];
            let high = (-to_high + high) * self.inverse[axis];
            enter = enter.max(low.min(high));
            leave = leave.min(low.max(high) * SLAB_SLACK);
        }
        let mask = enter.simd_le(leave).to_bitmask() & rays;
        let entered = mask32x16::from_bitmask(self.t_min.token(), mask);
        (entered.select(enter, f32x16::splat(self.t_min.token(), f32::INFINITY)).reduce_min(), mask)
    }
}
