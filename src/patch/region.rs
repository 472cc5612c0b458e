//! The part of a face's unit square that belongs to the object.

use std::collections::HashMap;

use glam::DVec2;

use crate::math::polygon::{self, Side};
use crate::subdivide::VertexNumbers;

/// One convex sub-polygon in a face's parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrimLoop {
    /// Index of the prepared polygon it is cut from.
    pub polygon: u32,
    /// Index of the input face it belongs to.
    pub face: u32,
    start: u32,
    end: u32,
}

/// The part of a face's unit square that belongs to the object: the union of convex polygons in (s, t), closed, each wound
/// counter-clockwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Of the unit square the corner at which its loop begins, alone: see [`kept`].
    corners: Box<[DVec2]>,
    loops: Loops,
}

/// Most regions have one loop, which needs no allocation: all corners are its own.
#[derive(Clone, Debug, PartialEq)]
enum Loops {
    One { polygon: u32, face: u32 },
    Many(Box<[TrimLoop]>),
}

/// Loops of a region in the making; kept from region to region.
#[derive(Clone, Debug, Default)]
pub(crate) struct RegionBuilder {
    corners: Vec<DVec2>,
    vertices: Vec<u32>,
    loops: Vec<TrimLoop>,
}

/// The corners of the unit square, counter-clockwise.
pub(super) const UNIT_SQUARE: [DVec2; 4] = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];

/// The same, of which four in a row begin at any corner.
const SQUARE_TWICE: [DVec2; 7] =
    [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y, DVec2::ZERO, DVec2::X, DVec2::ONE];

/// The corners to keep of a region: of the unit square, which most uncut quads have, the first.
fn kept(corners: &[DVec2]) -> &[DVec2] {
    let bits = |st: &DVec2| st.to_array().map(f64::to_bits);
    let is_square =
        SQUARE_TWICE.windows(4).any(|square| corners.iter().map(bits).eq(square.iter().map(bits)));
    if is_square { &corners[..1] } else { corners }
}

/// A corner of a loop, with the number of its vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LoopCorner {
    pub(crate) st: DVec2,
    pub(crate) vertex: u32,
}

impl RegionBuilder {
    /// Adds a loop; corners counter-clockwise.
    pub(crate) fn push(&mut self, polygon: u32, face: u32, corners: impl IntoIterator<Item = LoopCorner>) {
        let start = index(self.corners.len());
        for LoopCorner { st, vertex } in corners {
            self.corners.push(st);
            self.vertices.push(vertex);
        }
        self.loops.push(TrimLoop { polygon, face, start, end: index(self.corners.len()) });
    }

    /// The region of the loops so far, with the vertex of each of [`Region::all_corners`]; the next begins with none.
    pub(crate) fn finish(&mut self) -> (Region, Vec<u32>) {
        let loops = match *self.loops {
            [TrimLoop { polygon, face, .. }] => Loops::One { polygon, face },
            _ => Loops::Many(self.loops.as_slice().into()),
        };
        let corners = kept(&self.corners).into();
        self.corners.clear();
        self.loops.clear();
        (Region { corners, loops }, std::mem::take(&mut self.vertices))
    }
}

/// The vertices at which the loops of one face are cut by lines: one for each edge and line.
#[derive(Debug)]
pub(crate) struct LineCuts<'a> {
    numbers: &'a mut VertexNumbers,
    known: HashMap<([u32; 2], [u64; 2]), u32>,
}

impl<'a> LineCuts<'a> {
    pub(crate) fn new(numbers: &'a mut VertexNumbers) -> Self {
        Self { numbers, known: HashMap::new() }
    }

    /// The vertex at which an edge crosses a line, a fraction of the way along it. `line` is different for different lines.
    fn vertex(&mut self, [a, b]: [u32; 2], line: [u64; 2], fraction: f64) -> u32 {
        let ends = [a.min(b), a.max(b)];
        *self.known.entry((ends, line)).or_insert_with(|| self.numbers.add_on_edge([a, b], fraction))
    }

    /// The part of a loop on one side of the line where coordinate `axis` is `value`, into `kept`, as [`polygon::clip`].
    pub(crate) fn clip(
        &mut self,
        corners: &[LoopCorner],
        (axis, value, side): (usize, f64, Side),
        line: [u64; 2],
        kept: &mut Vec<LoopCorner>,
    ) {
        let cross = |[a, b]: [&LoopCorner; 2], st, fraction| LoopCorner {
            st,
            vertex: self.vertex([a.vertex, b.vertex], line, fraction),
        };
        polygon::clip_with(corners, (axis, value, side), kept, |corner| corner.st, cross);
    }
}

/// Whether corners are a polygon with an area.
pub(crate) fn has_area(corners: &[LoopCorner]) -> bool {
    corners.len() >= 3 && polygon::doubled_area_with(corners, |corner| corner.st) > 0.0
}

pub(super) fn index(n: usize) -> u32 {
    u32::try_from(n).expect("fewer than 2^32 corners fit in memory")
}

impl Region {
    /// Number of loops.
    #[must_use]
    pub fn len(&self) -> usize {
        match &self.loops {
            Loops::One { .. } => 1,
            Loops::Many(loops) => loops.len(),
        }
    }

    /// Whether there are no loops.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The loop of index `number`.
    ///
    /// # Panics
    /// If there is no such loop.
    #[must_use]
    #[inline]
    pub fn trim_loop(&self, number: usize) -> TrimLoop {
        match &self.loops {
            &Loops::One { polygon, face } => {
                assert!(number == 0, "the region has one loop");
                TrimLoop { polygon, face, start: 0, end: index(self.all_corners().len()) }
            }
            Loops::Many(loops) => loops[number],
        }
    }

    /// The loops, in the order of the input faces.
    pub fn loops(&self) -> impl ExactSizeIterator<Item = TrimLoop> + Clone + '_ {
        (0..self.len()).map(|number| self.trim_loop(number))
    }

    /// The corners of one of [`Self::loops`].
    #[must_use]
    pub fn corners(&self, trim_loop: &TrimLoop) -> &[DVec2] {
        &self.all_corners()[trim_loop.start as usize..trim_loop.end as usize]
    }

    /// The corners of a loop with their vertices, of those of [`Self::all_corners`].
    pub(crate) fn numbered_corners<'a>(
        &'a self,
        trim_loop: &TrimLoop,
        vertices: &'a [u32],
    ) -> impl Iterator<Item = LoopCorner> + use<'a> {
        let range = trim_loop.start as usize..trim_loop.end as usize;
        let corners = self.all_corners()[range.clone()].iter().zip(&vertices[range]);
        corners.map(|(&st, &vertex)| LoopCorner { st, vertex })
    }

    /// The corners of all loops, one loop after the other.
    #[must_use]
    #[inline]
    pub fn all_corners(&self) -> &[DVec2] {
        match *self.corners {
            [first] => {
                let start = if first.y == 0.0 {
                    usize::from(first.x != 0.0)
                } else {
                    2 + usize::from(first.x == 0.0)
                };
                &SQUARE_TWICE[start..start + 4]
            }
            _ => &self.corners,
        }
    }

    /// Memory of corners and loops in bytes, besides that of the region itself.
    pub(crate) fn bytes(&self) -> usize {
        let loops = match &self.loops {
            Loops::One { .. } => 0,
            Loops::Many(loops) => size_of_val(&**loops),
        };
        size_of_val(&*self.corners) + loops
    }

    /// Lowest and highest corner of the bounding rectangle; `None` if the region is empty.
    pub(crate) fn bounds(&self) -> Option<[DVec2; 2]> {
        polygon::bounds(self.all_corners().iter().copied())
    }

    /// Whether one loop, closed, holds a point that may be off by `tolerance` along s and t.
    pub(crate) fn holds(&self, trim_loop: &TrimLoop, st: DVec2, tolerance: DVec2) -> bool {
        self.position(trim_loop, st, tolerance) != LoopPosition::Outside
    }

    /// Where a point that may be off by `tolerance` along s and t is with respect to one loop.
    pub(crate) fn position(&self, trim_loop: &TrimLoop, st: DVec2, tolerance: DVec2) -> LoopPosition {
        position(self.corners(trim_loop), st, tolerance)
    }

    /// Whether any loop has a point in the closed rectangle `[low, high]`.
    pub(crate) fn reaches(&self, low: DVec2, high: DVec2) -> bool {
        self.loops().any(|trim_loop| self.loop_reaches(&trim_loop, [low, high]))
    }

    /// Whether one loop has a point in a closed rectangle.
    pub(crate) fn loop_reaches(&self, trim_loop: &TrimLoop, rectangle: [DVec2; 2]) -> bool {
        !polygon::clip_to_rectangle(self.corners(trim_loop), rectangle).is_empty()
    }

    /// The loop a point belongs to, if any.
    ///
    /// Each loop is closed: its edges and corners belong to it, and a point of several loops belongs to the first.
    /// `tolerance` is how far off the point may be along s and t; a point that is inside no loop belongs to the
    /// first one from which it is no farther than that. NaN belongs to none.
    pub fn find(&self, st: DVec2, tolerance: DVec2) -> Option<TrimLoop> {
        let inside = |tolerance| self.loops().find(|trim_loop| self.holds(trim_loop, st, tolerance));
        inside(DVec2::ZERO).or_else(|| inside(tolerance))
    }
}

/// Where a point is with respect to a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LoopPosition {
    /// Inside, farther from every edge than it may be off.
    Inside,
    /// On an edge, as far as is known.
    Border,
    /// Outside, or NaN.
    Outside,
}

/// Where a point that may be off by `tolerance` along s and t is with respect to a polygon.
///
/// It is at the border if the rectangle of what it may be touches an edge, and inside if the line from it along s crosses the
/// border an odd number of times. Nothing is asked of the corners: rounding may have pushed one inwards, so that the polygon is
/// not convex, and an edge as short as rounding has no direction.
pub(super) fn position(corners: &[DVec2], st: DVec2, tolerance: DVec2) -> LoopPosition {
    let mut inside = false;
    let mut from = corners[corners.len() - 1] - st;
    for &to in corners {
        let to = to - st;
        let edge = to - from;
        let beside = edge.perp_dot(from);
        // so written, NaN touches nothing
        let touches = beside.abs() <= edge.x.abs() * tolerance.y + edge.y.abs() * tolerance.x
            && from.min(to).cmple(tolerance).all()
            && from.max(to).cmpge(-tolerance).all();
        if touches {
            return LoopPosition::Border;
        }
        if (from.y <= 0.0) != (to.y <= 0.0) {
            inside ^= (beside > 0.0) == (edge.y > 0.0);
        }
        from = to;
    }
    if inside && !st.is_nan() { LoopPosition::Inside } else { LoopPosition::Outside }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(st: DVec2) -> LoopCorner {
        LoopCorner { st, vertex: 0 }
    }

    fn two_triangles() -> Region {
        let (a, b, c, d) = (DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y);
        let mut region = RegionBuilder::default();
        region.push(0, 7, [a, b, c].map(corner));
        region.push(1, 9, [a, c, d].map(corner));
        region.finish().0
    }

    #[test]
    fn a_whole_square_begins_where_it_began() {
        for start in 0..4 {
            let square: Vec<_> = (0..4).map(|i| UNIT_SQUARE[(start + i) % 4]).collect();
            let mut builder = RegionBuilder::default();
            builder.push(3, 5, square.iter().copied().map(corner));
            let (region, vertices) = builder.finish();
            assert_eq!((region.all_corners(), vertices.len()), (&*square, 4));
            assert_eq!(region.corners(&region.trim_loop(0)), &*square);
            assert_eq!(region.bytes(), size_of::<DVec2>());
        }
    }

    #[test]
    fn loops_are_closed_and_the_first_wins() {
        let region = two_triangles();
        let face = |s: f64, t: f64| region.find(DVec2::new(s, t), DVec2::ZERO).map(|l| l.face);
        assert_eq!(face(0.7, 0.2), Some(7));
        assert_eq!(face(0.2, 0.7), Some(9));
        assert_eq!(face(0.5, 0.5), Some(7), "on the shared edge");
        assert_eq!(face(0.0, 0.0), Some(7), "a corner");
        assert_eq!(face(0.0, 1.0), Some(9), "a corner");
        assert_eq!(face(1.0 + f64::EPSILON, 0.5), None);
        assert_eq!(face(f64::NAN, 0.5), None);
    }

    #[test]
    fn an_edge_as_short_as_rounding_takes_nothing_away() {
        // the short edge is turned far from the long ones that it all but goes on
        let corners =
            [DVec2::ZERO, DVec2::X, DVec2::new(1.0, 1.0), DVec2::new(1.0 - 1e-16, 1.0 - 1e-16), DVec2::Y];
        let mut builder = RegionBuilder::default();
        builder.push(0, 0, corners.map(corner));
        let (region, _) = builder.finish();
        let whole = region.trim_loop(0);
        for (s, t) in [(0.5, 0.5), (0.9, 0.1), (0.1, 0.9), (0.01, 0.99), (0.99, 0.01), (0.999, 0.998)] {
            let position = region.position(&whole, DVec2::new(s, t), DVec2::splat(1e-14));
            assert_eq!(position, LoopPosition::Inside, "at {s}, {t}");
        }
        let position = |s: f64, t: f64| region.position(&whole, DVec2::new(s, t), DVec2::splat(1e-14));
        assert_eq!(position(1.0 + 1e-15, 0.5), LoopPosition::Border);
        assert_eq!(position(1.0 + 1e-13, 0.5), LoopPosition::Outside);
        assert_eq!(position(0.5, f64::NAN), LoopPosition::Outside);
    }

    #[test]
    fn the_tolerance_reaches_no_farther_at_the_tip_of_a_needle() {
        let mut builder = RegionBuilder::default();
        let needle = [DVec2::new(0.0, 0.5), DVec2::new(1.0, 0.5), DVec2::new(1.0, 0.5 + 1e-5)];
        builder.push(0, 0, needle.map(corner));
        let (region, _) = builder.finish();
        let tolerance = DVec2::splat(1e-9);
        assert!(region.find(DVec2::new(-0.9e-9, 0.5), tolerance).is_some());
        assert!(region.find(DVec2::new(-1e-6, 0.5), tolerance).is_none(), "between the moved edges");
    }

    #[test]
    fn the_tolerance_reaches_just_so_far() {
        let region = two_triangles();
        let tolerance = DVec2::new(1e-6, 1e-9);
        assert!(region.find(DVec2::new(-0.9e-6, 0.5), tolerance).is_some());
        assert!(region.find(DVec2::new(-1.1e-6, 0.5), tolerance).is_none());
        assert!(region.find(DVec2::new(0.5, 1.0 + 0.9e-9), tolerance).is_some());
        assert!(region.find(DVec2::new(0.5, 1.0 + 1.1e-9), tolerance).is_none());
    }
}
