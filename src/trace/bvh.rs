//! The acceleration structure: the one file that knows obvhs and single precision.
//!
//! obvhs builds a binary tree; it is collapsed to nodes of eight children whose boxes are tested together.

use std::time::Duration;

use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::{Boundable, BvhBuildParams};

use super::Ray;

/// Children of a node: as many boxes as the widest common vectors hold in single precision.
const WIDTH: usize = 8;

/// Set in a child's reference if it is a box of the input, not a node.
const PRIMITIVE: u32 = 1 << 31;

/// A slab test's exit is multiplied by this: entry and exit are each off by three rounded operations at most, and by
/// one of the conversion to a distance in the tree's units.
///
/// Source: Ize (2013), *Robust BVH ray traversal*.
const SLAB_SLACK: f32 = 1.0 + 8.0 * f32::EPSILON;

/// A bounding volume hierarchy over boxes in double precision.
#[derive(Debug)]
pub(crate) struct Bvh {
    nodes: Vec<Node>,
    /// Boxes are kept about this point, in units of a power of two, so that single precision serves scenes of every
    /// size and place.
    centre: DVec3,
    scale: f64,
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
        // a leaf costs far more to test than a box
        let parameters = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::medium_build() };
        let bvh = build_bvh2(&outward, parameters, &mut core_build_time);
        debug_assert!(
            boxes.is_empty()
                || bvh.validate(&outward, false, false).discovered_primitives.len() == boxes.len(),
            "every box is in the tree"
        );
        Self { nodes: collapse(&bvh), centre, scale }
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
    pub(crate) fn traverse(&self, ray: &Ray, stack: &mut Stack, mut visit: impl FnMut(usize, f64) -> f64) {
        if self.nodes.is_empty() {
            return;
        }
        let slabs = Slabs::new(ray, self.centre, self.scale);
        let mut t_max = ray.t_max;
        let mut far = slabs.distance(t_max);
        stack.entries.clear();
        stack.entries.push((0, f32::NEG_INFINITY));
        while let Some((child, entry)) = stack.entries.pop() {
            if entry > far {
                continue;
            }
            if child & PRIMITIVE != 0 {
                t_max = visit((child & !PRIMITIVE) as usize, t_max);
                if t_max == f64::NEG_INFINITY {
                    return;
                }
                far = slabs.distance(t_max);
                continue;
            }
            let node = &self.nodes[child as usize];
            let entries = slabs.entries(node, far);
            stack.push_sorted(&node.children, &entries);
        }
    }
}

/// Nodes of eight: of a node's descendants, the one with the largest surface is opened until there are eight.
fn collapse(bvh: &Bvh2) -> Vec<Node> {
    let Some(root) = bvh.nodes.first() else { return Vec::new() };
    let mut nodes = vec![Node::EMPTY];
    let mut open = vec![(*root, 0)];
    while let Some((node, place)) = open.pop() {
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
                open.push((*child, nodes.len() - 1));
                index
            };
            nodes[place].set(lane, child.aabb(), reference);
        }
    }
    nodes
}

fn half_area(node: &Bvh2Node) -> f32 {
    node.aabb().half_area()
}

/// A ray ready for slab tests in the tree's units, with unit direction.
struct Slabs {
    /// The origin moved forth and back by its own rounding: to the near planes, to the far ones.
    origin: [[f32; 2]; 3],
    inverse: [f32; 3],
    /// Index of the near plane of each axis.
    near: [usize; 3],
    t_min: f32,
    /// The tree's distance for each unit of the ray's `t`.
    per_t: f64,
}

impl Slabs {
    #[expect(clippy::cast_possible_truncation, reason = "roundings to single precision are within the slack")]
    #[inline(always)]
    fn new(ray: &Ray, centre: DVec3, scale: f64) -> Self {
        let origin = (ray.origin - centre) * scale;
        let length = ray.direction.length();
        let direction = ray.direction / length;
        let per_t = length * scale;
        // roundings: of the shift in double precision, of the result in single precision
        let shift = 4.0 * f64::EPSILON * (ray.origin.abs() + centre.abs()) * scale;
        let slack = shift + f64::from(f32::EPSILON) * origin.abs() + f64::from(f32::MIN_POSITIVE);
        let mut slabs = Self {
            origin: [[0.0; 2]; 3],
            inverse: [0.0; 3],
            near: [0; 3],
            t_min: (ray.t_min * per_t) as f32 * (1.0 - 4.0 * f32::EPSILON),
            per_t,
        };
        for axis in 0..3 {
            let backward = direction[axis] < 0.0;
            let sign = if backward { -1.0 } else { 1.0 };
            slabs.near[axis] = usize::from(backward);
            slabs.inverse[axis] = (1.0 / direction[axis]) as f32;
            slabs.origin[axis] =
                [(origin[axis] + sign * slack[axis]) as f32, (origin[axis] - sign * slack[axis]) as f32];
        }
        slabs
    }

    /// A ray parameter as a distance in the tree, rounded up.
    #[expect(clippy::cast_possible_truncation, reason = "rounded up by the factor")]
    #[inline(always)]
    fn distance(&self, t: f64) -> f32 {
        (t * self.per_t) as f32 * SLAB_SLACK
    }

    /// Where the ray enters each of a node's boxes; infinity where it does not before `far`.
    ///
    /// A direction component of 0 gives infinite bounds, or NaN for an origin in a side's plane, which the comparisons
    /// drop: that side then does not exclude the box.
    #[inline(always)]
    fn entries(&self, node: &Node, far: f32) -> [f32; WIDTH] {
        let mut enter = [self.t_min; WIDTH];
        let mut leave = [far; WIDTH];
        for axis in 0..3 {
            let planes = &node.planes[axis];
            let (near, far) = (&planes[self.near[axis]], &planes[1 - self.near[axis]]);
            let ([to_near, to_far], inverse) = (self.origin[axis], self.inverse[axis]);
            for lane in 0..WIDTH {
                let a = (near[lane] - to_near) * inverse;
                let b = (far[lane] - to_far) * inverse * SLAB_SLACK;
                enter[lane] = if a > enter[lane] { a } else { enter[lane] };
                leave[lane] = if b < leave[lane] { b } else { leave[lane] };
            }
        }
        let mut entries = [f32::INFINITY; WIDTH];
        for lane in 0..WIDTH {
            entries[lane] = if enter[lane] <= leave[lane] { enter[lane] } else { f32::INFINITY };
        }
        entries
    }
}

/// Nodes and boxes still to visit; kept from ray to ray.
#[derive(Debug, Default)]
pub(crate) struct Stack {
    entries: Vec<(u32, f32)>,
}

impl Stack {
    /// Pushes the children with a finite entry, the nearest on top.
    #[inline(always)]
    fn push_sorted(&mut self, children: &[u32; WIDTH], entries: &[f32; WIDTH]) {
        let start = self.entries.len();
        for (&child, &entry) in children.iter().zip(entries) {
            if entry < f32::INFINITY {
                self.entries.push((child, entry));
                let mut place = self.entries.len() - 1;
                while place > start && self.entries[place - 1].1 < entry {
                    self.entries.swap(place - 1, place);
                    place -= 1;
                }
            }
        }
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
                bvh.traverse(&ray, &mut Stack::default(), |index, t_max| {
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
        nothing.traverse(&Ray::new(DVec3::ZERO, DVec3::X), &mut Stack::default(), |_, _| {
            panic!("nothing to visit")
        });
        let point = Bvh::build(&[[DVec3::ONE, DVec3::ONE]]);
        let mut visits = 0;
        point.traverse(&Ray::new(DVec3::ZERO, DVec3::ONE), &mut Stack::default(), |_, t| {
            visits += 1;
            t
        });
        assert_eq!(visits, 1);
    }
}
