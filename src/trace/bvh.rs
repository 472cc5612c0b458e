//! The acceleration structure: the one file that knows obvhs.
//!
//! obvhs builds a binary tree; it is collapsed to nodes of eight children whose boxes are tested together.

use std::time::Duration;

use fearless_simd::{Simd, f32x16, f64x8};
use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::{Boundable, BvhBuildParams};

use super::collapse::{BinaryNode, Collapse};
use super::local::LocalRay;
use super::single_precision::{down, up};
use super::slabs::{Node, PacketSlabs, SlabRay, Slabs, SpreadSlabs, WIDTH};

/// Set in a child's reference if it is a box of the input, not a node.
const PRIMITIVE: u32 = 1 << 31;

/// A bounding volume hierarchy over boxes in local coordinates.
#[derive(Debug)]
pub(crate) struct Bvh {
    nodes: Vec<Node>,
    /// Nodes and boxes that can wait at once.
    waiting: usize,
}

struct OutwardBox(Aabb);

impl Boundable for OutwardBox {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Bvh {
    /// Memory that building takes for each box: the box in single precision, two nodes of the binary tree and what the builder keeps
    /// beside them, costs and places of the collapse, and an eighth of two wide nodes.
    pub(crate) const BYTES_PER_BOX: u64 = 400;

    /// Builds over the boxes `[lowest corner, highest corner]`, which must be finite, of a size near 1 about the origin.
    pub(crate) fn build(boxes: &[[DVec3; 2]]) -> Self {
        let mut outward: Vec<_> = boxes
            .iter()
            .map(|&[low, high]| OutwardBox(Aabb { min: each(low, down), max: each(high, up) }))
            .collect();
        set_apart(&mut outward);
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
        let slab_ray = SlabRay::new(ray, t_min);
        let slabs = Slabs::new(simd, &slab_ray);
        self.descend_in_order(
            slab_ray.distance(t_max),
            stack,
            #[inline(always)]
            |node, far| slabs.entries(node, far),
            #[inline(always)]
            |index| {
                t_max = visit(index, t_max);
                (t_max != f64::NEG_INFINITY).then(|| slab_ray.distance(t_max))
            },
        );
    }

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
        self.descend_in_order(
            slabs.far,
            stack,
            #[inline(always)]
            |node, far| slabs.entries(node, far),
            #[inline(always)]
            |index| Some(slabs.distance(visit(index)).min(slabs.far)),
        );
    }

    /// Visits boxes that are entered before a distance `far`, the nearest child of each node first.
    ///
    /// `enter` says where a node's boxes are entered, with a bit for each that is; `visit` is given a box's index and returns
    /// the new `far`, or `None` to end.
    #[inline(always)]
    fn descend_in_order(
        &self,
        mut far: f32,
        stack: &mut Stack,
        enter: impl Fn(&Node, f32) -> ([f32; WIDTH], u64),
        mut visit: impl FnMut(usize) -> Option<f32>,
    ) {
        if self.nodes.is_empty() {
            return;
        }
        stack.make_room(self.waiting);
        let waiting = &mut *stack.entries;
        let mut height = 0;
        let mut child = 0;
        loop {
            if child & PRIMITIVE == 0 {
                let node = &self.nodes[child as usize];
                let (entries, entered) = enter(node, far);
                if let Some(nearest) = descend(waiting, &mut height, (&node.children, &entries), entered) {
                    child = nearest;
                    continue;
                }
            } else {
                let Some(new) = visit((child & !PRIMITIVE) as usize) else { return };
                far = new;
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

/// As many boxes that are the same and follow one another are made different.
const SAME: usize = 64;

/// Makes boxes different that are the same and many, one after the other: by some units in the last place, outwards. Leaves that are
/// small beside their tolerances have such, and the builder merges no more than one pair in each of its passes over boxes that
/// are all as good as each other.
fn set_apart(boxes: &mut [OutwardBox]) {
    let same = |a: &OutwardBox, b: &OutwardBox| a.0.min == b.0.min && a.0.max == b.0.max;
    for run in boxes.chunk_by_mut(same).filter(|run| run.len() >= SAME) {
        for (number, OutwardBox(made)) in run.iter_mut().enumerate() {
            // the digits of a number that has nothing to do with the one before
            let mut digits = (number as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
            for axis in 0..3 {
                for _ in 0..digits % 16 {
                    made.min[axis] = made.min[axis].next_down();
                }
                digits /= 16;
                for _ in 0..digits % 16 {
                    made.max[axis] = made.max[axis].next_up();
                }
                digits /= 16;
            }
        }
    }
}

/// Nodes of eight and the depth of their tree.
fn collapse(bvh: &Bvh2) -> (Vec<Node>, usize) {
    if bvh.nodes.is_empty() {
        return (Vec::new(), 0);
    }
    let binary = |node: &Bvh2Node| BinaryNode {
        half_area: node.aabb().half_area(),
        first_child: (node.prim_count == 0).then_some(node.first_index),
    };
    let tree: Vec<_> = bvh.nodes.iter().map(binary).collect();
    let collapse = Collapse::<WIDTH>::new(&tree);
    let mut nodes = vec![Node::EMPTY];
    let mut open = vec![(0, 0, 1)];
    let mut greatest_depth = 0;
    let mut children = Vec::with_capacity(WIDTH);
    while let Some((node, place, depth)) = open.pop() {
        greatest_depth = greatest_depth.max(depth);
        collapse.children(node, &mut children);
        for (lane, &child) in children.iter().enumerate() {
            let node = &bvh.nodes[child];
            let reference = if node.prim_count > 0 {
                PRIMITIVE | bvh.primitive_indices[node.first_index as usize]
            } else {
                nodes.push(Node::EMPTY);
                open.push((child, nodes.len() - 1, depth + 1));
                u32::try_from(nodes.len() - 1).expect("fewer than 2^31 nodes fit in memory")
            };
            let aabb = node.aabb();
            nodes[place].set(lane, [aabb.min.to_array(), aabb.max.to_array()], reference);
        }
    }
    nodes.shrink_to_fit();
    (nodes, greatest_depth)
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

impl Bvh {
    /// Visits boxes by their distance from a point, the nearest child of each node first, while that is at most `far`;
    /// `visit` is given a box's index and returns the new `far`.
    pub(super) fn descend_by_distance(
        &self,
        point: DVec3,
        mut far: f64,
        mut visit: impl FnMut(usize) -> f64,
    ) {
        // far above the rounding of a point near the box of size 1, far below what anyone asks for
        const ROUNDING: f64 = 1e-14;
        let reach = |far: f64| (far * (1.0 + ROUNDING) + ROUNDING).powi(2);
        let mut waiting: Vec<(f64, u32)> = Vec::new();
        if !self.nodes.is_empty() {
            waiting.push((0.0, 0));
        }
        while let Some((distance_sq, child)) = waiting.pop() {
            if distance_sq > reach(far) {
                continue;
            }
            if child & PRIMITIVE != 0 {
                far = visit((child & !PRIMITIVE) as usize);
                continue;
            }
            let node = &self.nodes[child as usize];
            let start = waiting.len();
            for (lane, &child) in node.children.iter().enumerate() {
                let mut distance_sq = 0.0;
                for axis in 0..3 {
                    let [low, high] = node.planes[axis].map(|planes| f64::from(planes[lane]));
                    let off = (low - point[axis]).max(point[axis] - high).max(0.0);
                    distance_sq += off * off;
                }
                // unused lanes are infinitely far
                if distance_sq.is_finite() && distance_sq <= reach(far) {
                    waiting.push((distance_sq, child));
                }
            }
            waiting[start..].sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        }
    }

    /// Visits the boxes that have a point in common with `[low, high]`, and perhaps some that only nearly have.
    pub(super) fn overlapping(&self, [low, high]: [DVec3; 2], mut visit: impl FnMut(usize)) {
        let mut waiting = Vec::new();
        if !self.nodes.is_empty() {
            waiting.push(0_u32);
        }
        while let Some(child) = waiting.pop() {
            if child & PRIMITIVE != 0 {
                visit((child & !PRIMITIVE) as usize);
                continue;
            }
            let node = &self.nodes[child as usize];
            for (lane, &child) in node.children.iter().enumerate() {
                let meets = |axis: usize| {
                    let [from, to] = node.planes[axis].map(|planes| f64::from(planes[lane]));
                    from <= high[axis] && low[axis] <= to
                };
                if meets(0) && meets(1) && meets(2) {
                    waiting.push(child);
                }
            }
        }
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
    use crate::math::lanes::with_vectors;
    use fearless_simd::Level;

    use super::*;
    use crate::test_support::Noise;
    use crate::trace::Ray;
    use crate::trace::local::LocalSpace;

    fn visited(bvh: &Bvh, ray: &LocalRay, boxes: usize) -> Vec<bool> {
        let mut visited = vec![false; boxes];
        let mut stack = Stack::default();
        with_vectors!(Level::new(), simd => bvh.traverse(simd, (ray, [0.0, f64::INFINITY]), &mut stack, |index, t_max| {
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
