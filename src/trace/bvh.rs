//! The acceleration structure: the one file that knows obvhs and single precision.
//!
//! obvhs builds a binary tree; it is collapsed to nodes of eight children whose boxes are tested together.

use std::time::Duration;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, f32x16, f64x8, mask32x16};
use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::{Boundable, BvhBuildParams};

use crate::math::lanes::Real;

use super::leaf::{down, nearest, up};
use super::leaf_test::LocalRays;
use super::local::LocalRay;

/// Children of a node: as many boxes as the widest common vectors hold in single precision.
const WIDTH: usize = 8;

/// Set in a child's reference if it is a box of the input, not a node.
const PRIMITIVE: u32 = 1 << 31;

/// A slab test's exit is multiplied by this: entry and exit are each off by three rounded operations at most, and by
/// one of the conversion to a distance in the tree's units.
///
/// Source: Ize (2013), *Robust BVH ray traversal*.
const SLAB_SLACK: f32 = 1.0 + 8.0 * f32::EPSILON;

/// Greatest reciprocal of a direction's component: finite, so that its product with 0 is 0 and not NaN, and yet far
/// beyond any distance for the least difference of two coordinates.
const STEEPEST: f64 = 1e37;

/// A bounding volume hierarchy over boxes in local coordinates.
#[derive(Debug)]
pub(crate) struct Bvh {
    nodes: Vec<Node>,
    /// Nodes and boxes that can wait at once.
    waiting: usize,
}

/// Eight boxes and what they hold. Unused places have boxes that no ray enters.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Node {
    /// For each axis the eight lower planes, then the eight upper ones.
    planes: [[[f32; WIDTH]; 2]; 3],
    children: [u32; WIDTH],
}

impl Node {
    const EMPTY: Self =
        Self { planes: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3], children: [0; WIDTH] };

    fn set(&mut self, place: usize, aabb: &Aabb, child: u32) {
        let (low, high) = (aabb.min.to_array(), aabb.max.to_array());
        for axis in 0..3 {
            self.planes[axis][0][place] = low[axis];
            self.planes[axis][1][place] = high[axis];
        }
        self.children[place] = child;
    }
}

struct OutwardBox(Aabb);

impl Boundable for OutwardBox {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Bvh {
    /// Builds over the boxes `[lowest corner, highest corner]`, which must be finite, of a size near 1 about the origin.
    pub(crate) fn build(boxes: &[[DVec3; 2]]) -> Self {
        let outward: Vec<_> = boxes
            .iter()
            .map(|&[low, high]| OutwardBox(Aabb { min: each(low, down), max: each(high, up) }))
            .collect();
        let mut core_build_time = Duration::ZERO;
        // a leaf costs far more to test than a box
        let parameters = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::medium_build() };
        let bvh = build_bvh2(&outward, parameters, &mut core_build_time);
        debug_assert!(
            boxes.is_empty()
                || bvh.validate(&outward, false, false).discovered_primitives.len() == boxes.len(),
            "every box is in the tree"
        );
        let (nodes, depth) = collapse(&bvh);
        Self { nodes, waiting: depth * WIDTH + 1 }
    }

    /// Number of nodes.
    pub(crate) fn nodes(&self) -> usize {
        self.nodes.len()
    }

    /// Memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
    }

    /// Visits the boxes a ray enters before `t_max`, nearer ones first as far as the tree tells.
    ///
    /// `visit` is given a box's index and the greatest `t` of interest, and returns the new one; a return of
    /// `f64::NEG_INFINITY` ends the traversal. Which boxes are visited does not depend on the ray's length.
    #[inline(always)]
    pub(crate) fn traverse<S: Simd>(
        &self,
        simd: S,
        (ray, [t_min, mut t_max]): (&LocalRay, [f64; 2]),
        stack: &mut Stack,
        mut visit: impl FnMut(usize, f64) -> f64,
    ) {
        if self.nodes.is_empty() {
            return;
        }
        let slab_ray = SlabRay::new(ray, t_min);
        let slabs = Slabs::new(simd, &slab_ray);
        let mut far = slab_ray.distance(t_max);
        stack.make_room(self.waiting);
        let waiting = &mut *stack.entries;
        let mut height = 0;
        let mut child = 0;
        loop {
            if child & PRIMITIVE == 0 {
                let node = &self.nodes[child as usize];
                let (entries, entered) = slabs.entries(node, far);
                if let Some(nearest) = descend(waiting, &mut height, (&node.children, &entries), entered) {
                    child = nearest;
                    continue;
                }
            } else {
                t_max = visit((child & !PRIMITIVE) as usize, t_max);
                if t_max == f64::NEG_INFINITY {
                    return;
                }
                far = slab_ray.distance(t_max);
            }
            loop {
                if height == 0 {
                    return;
                }
                height -= 1;
                let (next, entry) = waiting[height];
                if entry <= far {
                    child = next;
                    break;
                }
            }
        }
    }
}

impl Bvh {
    /// Visits the boxes that rays of a packet can enter.
    ///
    /// `visit` is given a box's index and returns the greatest `t` of interest for each ray; once none is positive the
    /// traversal ends.
    #[inline(always)]
    pub(crate) fn traverse_packet<S: Simd>(
        &self,
        slabs: &PacketSlabs<S>,
        stack: &mut Stack,
        mut visit: impl FnMut(usize) -> f64x8<S>,
    ) {
        if self.nodes.is_empty() {
            return;
        }
        let mut far = slabs.far;
        stack.make_room(self.waiting);
        let waiting = &mut *stack.entries;
        let mut height = 0;
        let mut child = 0;
        loop {
            if child & PRIMITIVE == 0 {
                let node = &self.nodes[child as usize];
                let (entries, entered) = slabs.entries(node, far);
                if let Some(nearest) = descend(waiting, &mut height, (&node.children, &entries), entered) {
                    child = nearest;
                    continue;
                }
            } else {
                far = slabs.distance(visit((child & !PRIMITIVE) as usize)).min(slabs.far);
            }
            loop {
                if height == 0 {
                    return;
                }
                height -= 1;
                let (next, entry) = waiting[height];
                if entry <= far {
                    child = next;
                    break;
                }
            }
        }
    }
}

/// The nearest of the children whose bits are set; the others wait, the nearer on top.
#[inline(always)]
fn descend(
    waiting: &mut [(u32, f32)],
    height: &mut usize,
    (children, entries): (&[u32; WIDTH], &[f32; WIDTH]),
    mut entered: u64,
) -> Option<u32> {
    let take = |entered: u64| {
        let lane = entered.trailing_zeros() as usize % WIDTH;
        (children[lane], entries[lane])
    };
    // few are entered as a rule, and a sort's branches are hard to predict
    match entered.count_ones() {
        0 => return None,
        1 => return Some(take(entered).0),
        2 => {
            let (a, b) = (take(entered), take(entered & entered.wrapping_sub(1)));
            let (near, far) = if b.1 < a.1 { (b, a) } else { (a, b) };
            waiting[*height] = far;
            *height += 1;
            return Some(near.0);
        }
        _ => {}
    }
    let start = *height;
    while entered != 0 {
        let lane = entered.trailing_zeros() as usize % WIDTH;
        entered &= entered - 1;
        let entry = entries[lane];
        let mut place = *height;
        while place > start && waiting[place - 1].1 < entry {
            waiting[place] = waiting[place - 1];
            place -= 1;
        }
        waiting[place] = (children[lane], entry);
        *height += 1;
    }
    *height -= 1;
    Some(waiting[*height].0)
}

/// Nodes of eight and the depth of their tree: of a node's descendants, the one with the largest surface is opened
/// until there are eight.
fn collapse(bvh: &Bvh2) -> (Vec<Node>, usize) {
    let Some(root) = bvh.nodes.first() else { return (Vec::new(), 0) };
    let mut nodes = vec![Node::EMPTY];
    let mut open = vec![(*root, 0, 1)];
    let mut greatest_depth = 0;
    while let Some((node, place, depth)) = open.pop() {
        greatest_depth = greatest_depth.max(depth);
        let mut children = vec![node];
        while children.len() < WIDTH {
            let inner = children.iter().enumerate().filter(|(_, child)| child.prim_count == 0);
            let largest = inner.max_by(|a, b| half_area(a.1).total_cmp(&half_area(b.1)));
            let Some((index, _)) = largest else { break };
            let first = children.swap_remove(index).first_index as usize;
            children.extend_from_slice(&bvh.nodes[first..first + 2]);
        }
        for (lane, child) in children.iter().enumerate() {
            let reference = if child.prim_count > 0 {
                PRIMITIVE | bvh.primitive_indices[child.first_index as usize]
            } else {
                nodes.push(Node::EMPTY);
                let index = u32::try_from(nodes.len() - 1).expect("fewer than 2^31 nodes fit in memory");
                open.push((*child, nodes.len() - 1, depth + 1));
                index
            };
            nodes[place].set(lane, child.aabb(), reference);
        }
    }
    (nodes, greatest_depth)
}

fn half_area(node: &Bvh2Node) -> f32 {
    node.aabb().half_area()
}

/// A ray ready for slab tests.
struct Slabs<S: Simd> {
    /// To the near planes, to the far ones.
    origin: [[f32x8<S>; 2]; 3],
    inverse: [f32x8<S>; 3],
    /// Index of the near plane of each axis.
    near: [usize; 3],
    t_min: f32x8<S>,
}

/// A ray's numbers for slab tests, with unit direction.
struct SlabRay {
    /// The origin moved forth by its own rounding, and back.
    to_near: [f32; 3],
    to_far: [f32; 3],
    inverse: [f32; 3],
    backward: [bool; 3],
    t_min: f32,
    /// The tree's distance for each unit of the ray's `t`.
    per_t: f64,
}

impl SlabRay {
    #[expect(clippy::cast_possible_truncation, reason = "roundings to single precision are within the slack")]
    #[inline(always)]
    fn new(ray: &LocalRay, t_min: f64) -> Self {
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
            // roundings: of the origin in double precision, of the result in single precision
            let slack =
                ray.rounding + f64::from(f32::EPSILON) * origin[axis].abs() + f64::from(f32::MIN_POSITIVE);
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
    fn distance(&self, t: f64) -> f32 {
        (t * self.per_t) as f32 * SLAB_SLACK
    }
}

impl<S: Simd> Slabs<S> {
    #[inline(always)]
    fn new(simd: S, ray: &SlabRay) -> Self {
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
    fn entries(&self, node: &Node, far: f32) -> ([f32; WIDTH], u64) {
        let simd = self.t_min.token();
        let mut enter = self.t_min;
        let mut leave = f32x8::splat(simd, far);
        for axis in 0..3 {
            let planes = &node.planes[axis];
            let near: f32x8<S> = planes[self.near[axis]].simd_into(simd);
            let far: f32x8<S> = planes[1 - self.near[axis]].simd_into(simd);
            let ([to_near, to_far], inverse) = (self.origin[axis], self.inverse[axis]);
            enter = enter.max((near - to_near) * inverse);
            leave = leave.min((far - to_far) * inverse * SLAB_SLACK);
        }
        (enter.into(), enter.simd_le(leave).to_bitmask())
    }
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
    far: f32,
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
        let slack = |half: usize| {
            rounding[half] + Real::abs(origin[half]) * f64::from(f32::EPSILON) + f64::from(f32::MIN_POSITIVE)
        };
        let slack = [slack(0), slack(1)];
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
    /// Of rays side by side; `None` if their directions are not all in one octant.
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
    fn distance(&self, t: f64x8<S>) -> f32 {
        nearest(t.reduce_max() * self.per_t) * SLAB_SLACK
    }

    /// Bounds of where the rays enter each of a node's boxes, and a bit for each box that one can enter before `far`.
    #[inline(always)]
    fn entries(&self, node: &Node, far: f32) -> ([f32; WIDTH], u64) {
        let simd = self.t_min.token();
        let mut enter = self.t_min;
        let mut leave = f32x8::splat(simd, far);
        for axis in 0..3 {
            let planes = &node.planes[axis];
            let near: f32x8<S> = planes[self.near[axis]].simd_into(simd);
            let far: f32x8<S> = planes[1 - self.near[axis]].simd_into(simd);
            let [to_near, to_far] = self.origin[axis];
            let [least, greatest] = self.inverse[axis];
            let (near, far) = (near - to_near, far - to_far);
            enter = enter.max((near * least).min(near * greatest));
            leave = leave.min((far * least).max(far * greatest) * SLAB_SLACK);
        }
        (enter.into(), enter.simd_le(leave).to_bitmask())
    }
}

impl Bvh {
    /// Visits the boxes that rays of a packet enter, each tested by itself.
    ///
    /// `visit` is given a box's index and a bit for each ray that enters it, and returns where the rays end now, as
    /// [`SpreadSlabs::distances`] gives it, if that has changed.
    #[inline(always)]
    pub(crate) fn traverse_spread<S: Simd>(
        &self,
        slabs: &SpreadSlabs<S>,
        mut far: f32x16<S>,
        stack: &mut Stack,
        mut visit: impl FnMut(usize, u64) -> Option<f32x16<S>>,
    ) {
        if self.nodes.is_empty() {
            return;
        }
        stack.make_room(self.waiting);
        let waiting = &mut *stack.masked;
        let mut height = 0;
        let mut child = 0;
        let mut entered = u64::MAX;
        loop {
            if child & PRIMITIVE == 0 {
                let node = &self.nodes[child as usize];
                let start = height;
                for lane in 0..WIDTH {
                    if node.planes[0][0][lane] == f32::INFINITY {
                        break;
                    }
                    let (entry, mask) = slabs.entry(node, lane, far, entered);
                    if mask == 0 {
                        continue;
                    }
                    let mut place = height;
                    while place > start && waiting[place - 1].1 < entry {
                        waiting[place] = waiting[place - 1];
                        place -= 1;
                    }
                    waiting[place] = (node.children[lane], entry, mask);
                    height += 1;
                }
            } else if let Some(new) = visit((child & !PRIMITIVE) as usize, entered) {
                far = new;
            }
            if height == 0 {
                return;
            }
            height -= 1;
            (child, _, entered) = waiting[height];
        }
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
    /// Of rays side by side.
    #[inline(always)]
    pub(crate) fn new(simd: S, [a, b]: [&LocalRays<f64x8<S>>; 2]) -> Self {
        let per_t = [Real::sqrt(a.direction.dot(a.direction)), Real::sqrt(b.direction.dot(b.direction))];
        let slack = |half: &LocalRays<f64x8<S>>, origin: f64x8<S>| {
            half.rounding + Real::abs(origin) * f64::from(f32::EPSILON) + f64::from(f32::MIN_POSITIVE)
        };
        let origin = |p: f64x8<S>, q: f64x8<S>| {
            let (e, f) = (slack(a, p), slack(b, q));
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
    fn entry(&self, node: &Node, lane: usize, far: f32x16<S>, rays: u64) -> (f32, u64) {
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

/// Nodes and boxes still to visit; kept from ray to ray.
#[derive(Debug, Default)]
pub(crate) struct Stack {
    entries: Vec<(u32, f32)>,
    /// With a bit for each ray that is to visit them.
    masked: Vec<(u32, f32, u64)>,
}

impl Stack {
    #[inline(always)]
    fn make_room(&mut self, waiting: usize) {
        if self.entries.len() < waiting {
            self.entries.resize(waiting, (0, 0.0));
            self.masked.resize(waiting, (0, 0.0, 0));
        }
    }
}

fn each(v: DVec3, round: fn(f64) -> f32) -> Vec3A {
    Vec3A::new(round(v.x), round(v.y), round(v.z))
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;
    use crate::test_support::Noise;
    use crate::trace::Ray;
    use crate::trace::local::LocalSpace;

    fn visited(bvh: &Bvh, ray: &LocalRay, boxes: usize) -> Vec<bool> {
        let mut visited = vec![false; boxes];
        let mut stack = Stack::default();
        dispatch!(Level::new(), simd => bvh.traverse(simd, (ray, [0.0, f64::INFINITY]), &mut stack, |index, t_max| {
            visited[index] = true;
            t_max
        }));
        visited
    }

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
            let all = boxes.iter().fold(boxes[0], |all, b| [all[0].min(b[0]), all[1].max(b[1])]);
            let space = LocalSpace::around(all);
            let local: Vec<_> = boxes.iter().map(|b| b.map(|corner| space.point(corner))).collect();
            let bvh = Bvh::build(&local);
            for number in 0..500 {
                let target = boxes[number * 7 % boxes.len()];
                let origin = vector() * 3.0 * scale + offset;
                let mut direction = 0.5 * (target[0] + target[1]) - origin;
                if direction.x.abs() < 0.2 * scale {
                    direction.x = 0.0;
                }
                let ray = Ray::new(origin, direction);
                let visited = visited(&bvh, &space.ray(&ray), boxes.len());
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
    fn nothing_and_a_point_are_fine() {
        let space = LocalSpace::around([DVec3::ZERO, DVec3::ONE]);
        let ray = |direction| space.ray(&Ray::new(DVec3::ZERO, direction));
        assert_eq!(visited(&Bvh::build(&[]), &ray(DVec3::X), 0), [false; 0]);
        let point = space.point(DVec3::ONE);
        assert_eq!(visited(&Bvh::build(&[[point; 2]]), &ray(DVec3::ONE), 1), [true]);
    }
}
