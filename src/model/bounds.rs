//! The box of a deformed object.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::{DVec2, DVec3};

use crate::math::bounds;
use crate::patch::{Face, Overlap, TrimLoop};

/// The box is larger than the object by no more than this, in parts of its size.
const TIGHTNESS: f64 = 1e-9;

/// Rectangles examined for one side of the box; then it is what has been proven so far.
const MAX_RECTANGLES: usize = 20_000;

/// A rectangle of a patch, with the farthest that its control points reach.
struct Candidate {
    reach: f64,
    patch: usize,
    low: DVec2,
    high: DVec2,
    /// The loops of the patch's region that have a point in it: no other need be asked again of a part of it.
    loops: Vec<TrimLoop>,
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.reach.total_cmp(&other.reach)
    }
}

/// Lowest and highest corner of a box around the trimmed patches: the tightest, up to rounding-like slack, and never too
/// small. By halving the rectangle that reaches farthest until its middle does too.
pub(super) fn tight_bounds(patches: &[Face]) -> [DVec3; 2] {
    let [low, high] = bounds::around(patches.iter().flat_map(|patch| patch.patch.hull_bounds()));
    let slack = TIGHTNESS * (high - low).length();
    let greatest =
        |axis: usize, sign: f64| sign * (farthest_reach(patches, sign * DVec3::AXES[axis], slack) + slack);
    [-1.0, 1.0].map(|sign| DVec3::new(greatest(0, sign), greatest(1, sign), greatest(2, sign)))
}

/// How far trimmed patches reach along an axis of any length: the greatest scalar product of a point with it, or more by
/// no more than `slack` (by no more than is left after 20 000 rectangles, if that is more). Minus infinity for no patches.
pub(crate) fn farthest_reach(patches: &[Face], axis: DVec3, slack: f64) -> f64 {
    let candidate = |patch: usize, [low, high]: [DVec2; 2], loops: &mut dyn Iterator<Item = TrimLoop>| {
        let trimmed = &patches[patch];
        let loops: Vec<_> =
            loops.filter(|trim_loop| trimmed.region.loop_reaches(trim_loop, [low, high])).collect();
        if loops.is_empty() || trimmed.overlap(low, high) == Overlap::None {
            return None;
        }
        let part = trimmed.patch.subpatch(low, high);
        let along = part.control_points().map(|point| axis.dot(point.truncate() / point.w));
        let reach = along.fold(f64::NEG_INFINITY, f64::max) + trimmed.error() * axis.abs().element_sum();
        Some(Candidate { reach, patch, low, high, loops })
    };
    let whole =
        |(patch, face): (usize, &Face)| candidate(patch, [DVec2::ZERO, DVec2::ONE], &mut face.region.loops());
    let mut waiting: BinaryHeap<_> = patches.iter().enumerate().filter_map(whole).collect();
    let mut reached = f64::NEG_INFINITY;
    let mut examined = 0;
    while let Some(Candidate { reach, patch, low, high, loops }) = waiting.pop() {
        let middle = 0.5 * (low + high);
        let trimmed = &patches[patch];
        let in_region = loops.iter().any(|trim_loop| trimmed.region.holds(trim_loop, middle, DVec2::ZERO));
        if in_region && trimmed.holds(middle, DVec2::ZERO) {
            reached = reached.max(axis.dot(trimmed.patch.eval(middle).position));
        }
        examined += 1;
        if reach <= reached + slack || examined == MAX_RECTANGLES {
            return reach;
        }
        let halves = if high.x - low.x >= high.y - low.y {
            [[low, DVec2::new(middle.x, high.y)], [DVec2::new(middle.x, low.y), high]]
        } else {
            [[low, DVec2::new(high.x, middle.y)], [DVec2::new(low.x, middle.y), high]]
        };
        let half = |rectangle| candidate(patch, rectangle, &mut loops.iter().copied());
        waiting.extend(halves.into_iter().filter_map(half));
    }
    reached
}
