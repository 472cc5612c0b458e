//! Points of a plane in a tree, to find those in a triangle that still count.

use glam::DVec2;

use super::turn::turn;

/// Points in a leaf.
const LEAF: usize = 8;

/// A tree of boxes over points, each of which counts or not.
#[derive(Debug)]
pub(super) struct PointTree<'a> {
    points: &'a [DVec2],
    /// Indices of points, so that each node has a run of them.
    order: Vec<u32>,
    /// Where each point is in `order`.
    place: Vec<u32>,
    counts: Vec<bool>,
    /// A full binary tree as in a heap: the children of node `i` are `2 i + 1` and `2 i + 2`.
    nodes: Vec<Node>,
    /// Levels below the root.
    depth: u32,
}

/// The least box of those of its points that count.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: DVec2,
    high: DVec2,
    /// How many of its points count.
    counting: u32,
}

impl<'a> PointTree<'a> {
    /// A tree of points of which none counts yet.
    pub(super) fn new(points: &'a [DVec2]) -> Self {
        let depth = points.len().div_ceil(LEAF).next_power_of_two().trailing_zeros();
        let count = u32::try_from(points.len()).expect("a face has fewer than 2^32 corners");
        let empty = Node { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY, counting: 0 };
        let mut tree = Self {
            points,
            order: (0..count).collect(),
            place: vec![0; points.len()],
            counts: vec![false; points.len()],
            nodes: vec![empty; (2 << depth) - 1],
            depth,
        };
        tree.split(0, 0, points.len());
        for (place, &index) in (0..).zip(&tree.order) {
            tree.place[index as usize] = place;
        }
        tree
    }

    /// The run of `order` that is a node's: halves of the parent's.
    fn split(&mut self, node: usize, start: usize, end: usize) {
        let run = &mut self.order[start..end];
        let mut corners = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        for &index in run.iter() {
            let p = self.points[index as usize];
            corners = [corners[0].min(p), corners[1].max(p)];
        }
        if 2 * node + 1 < self.nodes.len() {
            let half = run.len() / 2;
            let size = corners[1] - corners[0];
            let points = self.points;
            let along = |&index: &u32| {
                if size.x >= size.y { points[index as usize].x } else { points[index as usize].y }
            };
            if half < run.len() {
                run.select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)));
            }
            self.split(2 * node + 1, start, start + half);
            self.split(2 * node + 2, start + half, end);
        }
    }

    /// Whether a point counts from now on.
    pub(super) fn set(&mut self, index: usize, counts: bool) {
        if std::mem::replace(&mut self.counts[index], counts) == counts {
            return;
        }
        let place = self.place[index] as usize;
        let (mut node, mut start, mut end) = (0, 0, self.order.len());
        let p = self.points[index];
        for level in 0..=self.depth {
            let Node { low, high, counting } = &mut self.nodes[node];
            if counts {
                (*low, *high, *counting) = (low.min(p), high.max(p), *counting + 1);
            } else {
                *counting -= 1;
            }
            if level < self.depth {
                let half = start + (end - start) / 2;
                (node, start, end) = match place < half {
                    true => (2 * node + 1, start, half),
                    false => (2 * node + 2, half, end),
                };
            }
        }
        if !counts {
            self.shrink(node, start..end);
        }
    }

    /// Makes the boxes of a leaf and of all above it as small as what counts in them.
    fn shrink(&mut self, leaf: usize, run: std::ops::Range<usize>) {
        let run = self.order[run].iter().map(|&index| index as usize);
        let counting = run.filter(|&index| self.counts[index]).map(|index| self.points[index]);
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let mut corners = counting.fold(start, |(low, high), p| (low.min(p), high.max(p)));
        let mut node = leaf;
        while (self.nodes[node].low, self.nodes[node].high) != corners {
            (self.nodes[node].low, self.nodes[node].high) = corners;
            if node == 0 {
                break;
            }
            node = (node - 1) / 2;
            let [a, b] = [self.nodes[2 * node + 1], self.nodes[2 * node + 2]];
            corners = (a.low.min(b.low), a.high.max(b.high));
        }
    }

    /// Some point that counts, lies in the box of a triangle that winds counter-clockwise and fulfils `is_in`.
    ///
    /// `is_in` is to hold for points in the triangle or on its rim alone.
    pub(super) fn find(&self, triangle: [DVec2; 3], is_in: impl Fn(usize) -> bool) -> Option<usize> {
        let [a, b, c] = triangle;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let mut stack = vec![(0_usize, 0, self.order.len())];
        while let Some((node, start, end)) = stack.pop() {
            let bounds = self.nodes[node];
            let apart = bounds.counting == 0
                || bounds.low.cmpgt(high).any()
                || bounds.high.cmplt(low).any()
                || [[a, b], [b, c], [c, a]].iter().any(|&edge| is_right_of(bounds, edge));
            if apart {
                continue;
            }
            if 2 * node + 1 < self.nodes.len() {
                let half = start + (end - start) / 2;
                stack.push((2 * node + 2, half, end));
                stack.push((2 * node + 1, start, half));
                continue;
            }
            let run = self.order[start..end].iter().map(|&index| index as usize);
            let mut near = run.filter(|&index| {
                let p = self.points[index];
                self.counts[index] && p.cmpge(low).all() && p.cmple(high).all()
            });
            if let Some(found) = near.find(|&index| is_in(index)) {
                return Some(found);
            }
        }
        None
    }
}

/// Whether a box is wholly to the right of an edge: so is its corner farthest to the left then.
fn is_right_of(node: Node, [from, to]: [DVec2; 2]) -> bool {
    let along = to - from;
    let corner = DVec2::new(
        if along.y > 0.0 { node.low.x } else { node.high.x },
        if along.x > 0.0 { node.high.y } else { node.low.y },
    );
    turn(from, to, corner) < 0.0
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn finds_what_a_search_of_all_finds(
            points in proptest::collection::vec((0..20u8, 0..20u8), 1..200),
            corners in proptest::array::uniform3((0..20u8, 0..20u8)),
            changes in proptest::collection::vec((0..200usize, any::<bool>()), 0..300),
        ) {
            let place = |&(x, y): &(u8, u8)| DVec2::new(x.into(), y.into());
            let points: Vec<_> = points.iter().map(place).collect();
            let [a, b, c] = corners.map(|corner| place(&corner));
            prop_assume!(turn(a, b, c) > 0.0);
            let mut tree = PointTree::new(&points);
            let mut counts = vec![false; points.len()];
            for (index, counting) in changes {
                let index = index % points.len();
                counts[index] = counting;
                tree.set(index, counting);
            }
            let inside = |index: usize| {
                let p = points[index];
                [turn(a, b, p), turn(b, c, p), turn(c, a, p)].iter().all(|&side| side >= 0.0)
            };
            let found = tree.find([a, b, c], inside);
            prop_assert!(found.is_none_or(|index| counts[index] && inside(index)));
            prop_assert_eq!(found.is_some(), (0..points.len()).any(|index| counts[index] && inside(index)));
        }
    }
}
