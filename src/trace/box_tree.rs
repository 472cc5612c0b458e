//! Boxes that are asked for by points and by other boxes.

use glam::DVec3;

use super::bvh::Bvh;
use super::local::LocalSpace;
use crate::math::bounds;

/// A tree of boxes of the world.
#[derive(Debug)]
pub(crate) struct BoxTree {
    space: LocalSpace,
    bvh: Bvh,
    /// The length of the world that is 1 in the tree.
    unit: f64,
}

impl BoxTree {
    /// The tree over the boxes `[lowest corner, highest corner]`, which must be finite.
    pub(crate) fn build(boxes: &[[DVec3; 2]]) -> Self {
        let space = LocalSpace::around(bounds::around(boxes.iter().flatten().copied()));
        let local: Vec<_> = boxes.iter().map(|corners| corners.map(|corner| space.point(corner))).collect();
        Self { space, bvh: Bvh::build(&local), unit: 1.0 / space.length(1.0) }
    }

    /// Visits boxes in the order of their distance from a point, as far as the tree tells, while that is at most `far`.
    ///
    /// `visit` is given a box's index and returns the new `far`.
    pub(crate) fn nearest(&self, point: DVec3, mut far: f64, mut visit: impl FnMut(usize) -> f64) {
        let local = self.space.point(point);
        self.bvh.descend_by_distance(local, far / self.unit, |index| {
            far = visit(index);
            far / self.unit
        });
    }

    /// Visits the boxes that have a point in common with another one, in no certain order.
    pub(crate) fn overlapping(&self, corners: [DVec3; 2], visit: impl FnMut(usize)) {
        self.bvh.overlapping(corners.map(|corner| self.space.point(corner)), visit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Noise;

    fn distance([low, high]: [DVec3; 2], point: DVec3) -> f64 {
        (low - point).max(point - high).max(DVec3::ZERO).length()
    }

    #[test]
    fn boxes_are_found_as_by_brute_force() {
        let mut noise = Noise(71);
        for (scale, count) in [(1.0, 300), (1e-7, 50), (1e5, 1), (1.0, 0)] {
            let boxes: Vec<_> = (0..count)
                .map(|_| {
                    let (middle, half) = (noise.vector(), 0.05 * noise.vector().abs());
                    [middle - half, middle + half].map(|corner| corner * scale)
                })
                .collect();
            let tree = BoxTree::build(&boxes);
            for _ in 0..200 {
                let point = 1.5 * scale * noise.vector();
                let (mut best, mut visited) = (f64::INFINITY, 0);
                tree.nearest(point, f64::INFINITY, |index| {
                    visited += 1;
                    best = best.min(distance(boxes[index], point));
                    best
                });
                let want = boxes.iter().map(|b| distance(*b, point)).fold(f64::INFINITY, f64::min);
                assert_eq!(best, want);
                assert!(visited <= count.min(100), "{visited}");
                let query = [point - 0.2 * scale, point + 0.2 * scale];
                let mut found = Vec::new();
                tree.overlapping(query, |index| found.push(index));
                found.sort_unstable();
                let meets = |b: &[DVec3; 2]| b[0].cmple(query[1]).all() && query[0].cmple(b[1]).all();
                let want: Vec<_> = (0..count).filter(|&index| meets(&boxes[index])).collect();
                assert!(want.iter().all(|index| found.contains(index)), "{want:?} in {found:?}");
                assert!(found.len() <= want.len() + 1);
            }
        }
    }
}
