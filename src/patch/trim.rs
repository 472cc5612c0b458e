//! The part of a patch that belongs to the surface.

use glam::DVec2;

use crate::math::polygon;

/// One convex sub-polygon in a patch's parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrimLoop {
    /// Index of the prepared polygon it is cut from.
    pub polygon: u32,
    /// Index of the input face it belongs to.
    pub face: u32,
    start: u32,
    end: u32,
}

/// The trim of a patch: the union of convex polygons in (s, t), closed, each wound counter-clockwise.
#[derive(Clone, Debug, PartialEq)]
pub struct TrimRegion {
    corners: Box<[DVec2]>,
    loops: Loops,
}

/// Most patches have one loop, which needs no allocation.
#[derive(Clone, Debug, PartialEq)]
enum Loops {
    One(TrimLoop),
    Many(Box<[TrimLoop]>),
}

/// Loops of a trim in the making; kept from trim to trim.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrimBuilder {
    corners: Vec<DVec2>,
    loops: Vec<TrimLoop>,
}

impl TrimBuilder {
    /// Adds a loop; corners counter-clockwise.
    pub(crate) fn push(&mut self, polygon: u32, face: u32, corners: impl IntoIterator<Item = DVec2>) {
        let index = |n: usize| u32::try_from(n).expect("fewer than 2^32 corners fit in memory");
        let start = index(self.corners.len());
        self.corners.extend(corners);
        self.loops.push(TrimLoop { polygon, face, start, end: index(self.corners.len()) });
    }

    /// The region of the loops so far; the next begins with none.
    pub(crate) fn finish(&mut self) -> TrimRegion {
        let loops = match *self.loops {
            [only] => Loops::One(only),
            _ => Loops::Many(self.loops.as_slice().into()),
        };
        let corners = self.corners.as_slice().into();
        self.corners.clear();
        self.loops.clear();
        TrimRegion { corners, loops }
    }
}

impl TrimRegion {
    /// The loops, in the order of the input faces.
    pub fn loops(&self) -> &[TrimLoop] {
        match &self.loops {
            Loops::One(only) => std::slice::from_ref(only),
            Loops::Many(loops) => loops,
        }
    }

    /// The corners of one of [`Self::loops`].
    pub fn corners(&self, trim_loop: &TrimLoop) -> &[DVec2] {
        &self.corners[trim_loop.start as usize..trim_loop.end as usize]
    }

    /// Memory of corners and loops in bytes, besides that of the region itself.
    pub(crate) fn bytes(&self) -> usize {
        let loops = match &self.loops {
            Loops::One(_) => 0,
            Loops::Many(loops) => size_of_val(&**loops),
        };
        size_of_val(&*self.corners) + loops
    }

    /// Lowest and highest corner of the bounding rectangle; `None` if the region is empty.
    pub(crate) fn bounds(&self) -> Option<[DVec2; 2]> {
        polygon::bounds(self.corners.iter().copied())
    }

    /// Whether one loop, closed, holds a point that may be off by `tolerance` along s and t.
    pub(crate) fn holds(&self, trim_loop: &TrimLoop, st: DVec2, tolerance: DVec2) -> bool {
        holds(self.corners(trim_loop), st, tolerance)
    }

    /// Whether any loop has a point in the closed rectangle `[low, high]`.
    pub(crate) fn reaches(&self, low: DVec2, high: DVec2) -> bool {
        let part = |trim_loop| polygon::clip_to_rectangle(self.corners(trim_loop), [low, high]);
        self.loops().iter().any(|trim_loop| !part(trim_loop).is_empty())
    }

    /// The loop a point belongs to, if any.
    ///
    /// Each loop is closed: its edges and corners belong to it, and a point of several loops belongs to the first.
    /// `tolerance` is how far off the point may be along s and t; a point that is inside no loop belongs to the
    /// first one from which it is no farther than that. NaN belongs to none.
    pub fn find(&self, st: DVec2, tolerance: DVec2) -> Option<&TrimLoop> {
        let inside = |tolerance| self.loops().iter().find(|l| holds(self.corners(l), st, tolerance));
        inside(DVec2::ZERO).or_else(|| inside(tolerance))
    }
}

/// Whether a convex polygon, wound counter-clockwise, holds a point that may be off by `tolerance`.
///
/// Each edge is moved outwards by the tolerance. At the tip of a needle moved edges meet far beyond it, so the bounding
/// rectangle, moved outwards as far, is to hold the point too.
fn holds(corners: &[DVec2], st: DVec2, tolerance: DVec2) -> bool {
    let mut from = corners[corners.len() - 1];
    let (mut low, mut high) = (from, from);
    for &to in corners {
        let edge = to - from;
        let slack = edge.x.abs() * tolerance.y + edge.y.abs() * tolerance.x;
        let inward = edge.perp_dot(st - from) >= -slack;
        if !inward {
            return false;
        }
        (low, high) = (low.min(to), high.max(to));
        from = to;
    }
    st.cmpge(low - tolerance).all() && st.cmple(high + tolerance).all()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_triangles() -> TrimRegion {
        let (a, b, c, d) = (DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y);
        let mut region = TrimBuilder::default();
        region.push(0, 7, [a, b, c]);
        region.push(1, 9, [a, c, d]);
        region.finish()
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
    fn the_tolerance_reaches_no_farther_at_the_tip_of_a_needle() {
        let mut builder = TrimBuilder::default();
        builder.push(0, 0, [DVec2::new(0.0, 0.5), DVec2::new(1.0, 0.5), DVec2::new(1.0, 0.5 + 1e-5)]);
        let region = builder.finish();
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
