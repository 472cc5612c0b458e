//! The box of a deformed object.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::{DVec2, DVec3};

use crate::math::bounds;
use crate::patch::{Face, Overlap, TrimLoop};

/// The box is larger than the object by no more than this, in parts of its size.
const TIGHTNESS: f64 = 1e-9;

/// Rectangles examined for one side of the box; then it is what has been proven so far.
const MAX_RECTANGLES: usize = 5_000;

/// What the reach of a whole patch and that of its part over the unit square differ by, in parts of its size.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// A patch that has not been looked at, with more than its control points reach.
struct Unseen {
    reach: f64,
    patch: usize,
}

impl PartialEq for Unseen {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Unseen {}

impl PartialOrd for Unseen {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Unseen {
    fn cmp(&self, other: &Self) -> Ordering {
        self.reach.total_cmp(&other.reach)
    }
}

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
    bounds_of(patches, TIGHTNESS)
}

/// Lowest and highest corner of a box around trimmed patches: never too small, and too large by no more than `tightness` in
/// parts of the size of the box around the patches' control points (by no more than is left after 5 000 rectangles for a side,
/// if that is more).
#[must_use]
pub fn bounds_of(patches: &[Face], tightness: f64) -> [DVec3; 2] {
    let [low, high] = bounds::around(patches.iter().flat_map(|patch| patch.patch.hull_bounds()));
    let slack = tightness * (high - low).length();
    let greatest =
        |axis: usize, sign: f64| sign * (farthest_reach(patches, sign * DVec3::AXES[axis], slack) + slack);
    [-1.0, 1.0].map(|sign| DVec3::new(greatest(0, sign), greatest(1, sign), greatest(2, sign)))
}

/// How far trimmed patches reach along an axis of any length: the greatest scalar product of a point with it, or more by
/// no more than `slack` (by no more than is left after 5 000 rectangles, if that is more). Minus infinity for no patches.
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
    // most patches reach nowhere near as far as some do: they are looked at more closely only when it is their turn
    let whole = |(patch, face): (usize, &Face)| {
        let along = face.patch.control_points().map(|point| axis.dot(point.truncate() / point.w));
        let reach = along.fold(f64::NEG_INFINITY, f64::max) + face.error() * axis.abs().element_sum();
        Unseen { reach: reach + ROUNDING * face.patch.extent().magnitude * axis.length(), patch }
    };
    let mut unseen: BinaryHeap<_> = patches.iter().enumerate().map(whole).collect();
    let mut waiting: BinaryHeap<Candidate> = BinaryHeap::new();
    let mut reached = f64::NEG_INFINITY;
    let mut examined = 0;
    loop {
        while let Some(next) = unseen.peek()
            && waiting.peek().is_none_or(|top| next.reach >= top.reach)
        {
            let patch = next.patch;
            unseen.pop();
            let mut loops = patches[patch].region.loops();
            waiting.extend(candidate(patch, [DVec2::ZERO, DVec2::ONE], &mut loops));
        }
        let Some(Candidate { reach, patch, low, high, loops }) = waiting.pop() else { break };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subdivide::FrameChoice;
    use crate::test_support::{Noise, deform, random_volume};

    #[test]
    fn boxes_of_slanted_triangles_are_tight_and_never_too_small() {
        let mut noise = Noise(61);
        for case in 0..40 {
            let corners = [0; 3].map(|_| noise.vector() + 0.5);
            let volume = random_volume(&mut noise, [1 + case % 3; 3], [4; 3], 0.3, case % 5 == 0);
            let volume = (case % 4 > 0).then_some(&volume);
            let faces = deform(&[corners], volume, FrameChoice::Parallelogram).into_faces();
            let [low, high] = bounds_of(&faces, 1e-4);
            let [least, most] = bounds_of(&faces, 1e-9);
            let mut seen = [DVec3::INFINITY, DVec3::NEG_INFINITY];
            for face in &faces {
                for trim_loop in face.region.loops() {
                    let st = face.region.corners(&trim_loop);
                    for k in 1..st.len() - 1 {
                        for (i, j) in (0..=60).flat_map(|i| (0..=60 - i).map(move |j| (i, j))) {
                            let [v, w] = [i, j].map(|n| f64::from(n) / 60.0);
                            let place = st[0] * (1.0 - v - w) + st[k] * v + st[k + 1] * w;
                            let point = face.patch.eval(place).position;
                            seen = [seen[0].min(point), seen[1].max(point)];
                        }
                    }
                }
            }
            let size = (seen[1] - seen[0]).length();
            for (a, b) in [(low, high), (least, most)] {
                assert!(a.cmple(seen[0]).all() && b.cmpge(seen[1]).all(), "case {case}: too small");
                let excess = (seen[0] - a).max(b - seen[1]).max_element();
                assert!(excess <= 1e-3 * size, "case {case}: {excess} of {size} too large");
            }
        }
    }
}
