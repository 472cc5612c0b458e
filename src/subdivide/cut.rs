//! Polygons cut at the knot planes, without degenerate pieces.
//!
//! Source: Feng, Nishita, Jin, Peng (2002), section 3.2. The singular cases are settled by exact sign tests after
//! vertices close to a knot plane have been moved onto it.

use std::cmp::Ordering;

use glam::DVec3;

use crate::math::bounds;
use crate::spline::{KnotBox, SplineVolume};

/// A coordinate this close to a knot, in parts of the lattice's diagonal, is taken to lie on it.
///
/// Far above the rounding of coordinates that are meant to lie on the knot (1e-16), far below the accuracy asked
/// of hits (1e-11), so that moving a vertex by this much shows nowhere.
const SNAP: f64 = 1e-12;

/// One convex sub-polygon, its corners a run of [`Pieces::corners`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    /// Index of the polygon it is cut from.
    pub(crate) polygon: u32,
    /// Its knot box; `None` outside the lattice.
    pub(crate) knot_box: Option<KnotBox>,
    start: u32,
    end: u32,
}

/// All sub-polygons of an object, in the order of the polygons they are cut from.
#[derive(Debug, Default)]
pub(crate) struct Pieces {
    corners: Vec<DVec3>,
    pieces: Vec<Piece>,
}

impl Pieces {
    /// Number of pieces.
    pub(crate) fn len(&self) -> usize {
        self.pieces.len()
    }

    /// Piece number `index`.
    pub(crate) fn piece(&self, index: usize) -> &Piece {
        &self.pieces[index]
    }

    /// Corners of piece number `index`, in the polygon's winding.
    pub(crate) fn corners(&self, index: usize) -> &[DVec3] {
        let piece = &self.pieces[index];
        &self.corners[piece.start as usize..piece.end as usize]
    }

    pub(super) fn push(&mut self, polygon: u32, knot_box: Option<KnotBox>, corners: &[DVec3]) {
        let start = self.corners.len();
        self.corners.extend_from_slice(corners);
        let index = |n: usize| u32::try_from(n).expect("fewer than 2^32 corners fit in memory");
        self.pieces.push(Piece { polygon, knot_box, start: index(start), end: index(self.corners.len()) });
    }
}

/// Cuts convex polygons at the knot planes of a volume.
///
/// Each piece lies in one closed knot box, or outside the lattice; pieces outside are split from the rest at the
/// lattice's box and not cut further. A piece in a knot plane belongs to the box above, at the lattice's end to the
/// last box. New corners on an edge that two polygons share are bit-identical in both, for they depend on the
/// edge's end points alone. Without a volume every polygon is one piece outside.
pub(crate) fn cut_at_knot_planes<'a>(
    polygons: impl Iterator<Item = (u32, &'a [DVec3])>,
    volume: Option<&SplineVolume>,
) -> Pieces {
    let mut pieces = Pieces::default();
    let Some(volume) = volume else {
        for (polygon, corners) in polygons {
            pieces.push(polygon, None, corners);
        }
        return pieces;
    };
    let mut cutter = Cutter::new(volume);
    for (polygon, corners) in polygons {
        cutter.cut(polygon, corners, &mut pieces);
    }
    pieces
}

/// A list of polygons, flat.
#[derive(Debug, Default)]
struct Polygons {
    corners: Vec<DVec3>,
    ends: Vec<usize>,
}

impl Polygons {
    fn clear(&mut self) {
        self.corners.clear();
        self.ends.clear();
    }

    fn iter(&self) -> impl Iterator<Item = &[DVec3]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.corners[start..end])
    }

    /// Adds a polygon, without corners that equal their predecessor, unless too little is left of it.
    fn push(&mut self, corners: &[DVec3]) {
        let start = self.corners.len();
        for &corner in corners {
            if self.corners.len() == start || self.corners[self.corners.len() - 1] != corner {
                self.corners.push(corner);
            }
        }
        while self.corners.len() > start + 1 && self.corners[self.corners.len() - 1] == self.corners[start] {
            self.corners.pop();
        }
        if self.corners.len() < start + 3 {
            self.corners.truncate(start);
        } else {
            self.ends.push(self.corners.len());
        }
    }
}

/// Cuts one polygon after another; keeps its buffers.
pub(super) struct Cutter<'a> {
    pub(super) volume: &'a SplineVolume,
    /// See [`SNAP`]; a length.
    pub(super) snap: f64,
    current: Polygons,
    next: Polygons,
    rest: Vec<DVec3>,
    below: Vec<DVec3>,
    above: Vec<DVec3>,
}

impl<'a> Cutter<'a> {
    pub(super) fn new(volume: &'a SplineVolume) -> Self {
        let [low, high] = volume.bounds();
        Self {
            volume,
            snap: SNAP * (high - low).length(),
            current: Polygons::default(),
            next: Polygons::default(),
            rest: Vec::new(),
            below: Vec::new(),
            above: Vec::new(),
        }
    }

    fn cut(&mut self, polygon: u32, corners: &[DVec3], pieces: &mut Pieces) {
        self.rest.clear();
        for &corner in corners {
            let snapped = self.snapped(corner);
            self.rest.push(snapped);
        }
        self.current.clear();
        self.current.push(&self.rest);
        for axis in 0..3 {
            self.cut_axis(axis, polygon, pieces);
        }
        for piece in self.current.iter() {
            let middle = middle(piece);
            pieces.push(polygon, self.volume.knot_box(middle), piece);
        }
    }

    /// Cuts the current polygons at one axis' planes; those outside the lattice on this axis are done.
    fn cut_axis(&mut self, axis: usize, polygon: u32, pieces: &mut Pieces) {
        let planes = self.volume.axes()[axis].breakpoints();
        let (first, last) = (planes[0], planes[planes.len() - 1]);
        let current = std::mem::take(&mut self.current);
        self.next.clear();
        for corners in current.iter() {
            self.rest.clear();
            self.rest.extend_from_slice(corners);
            let (min, max) = range(corners, axis);
            for &plane in planes.iter().filter(|&&plane| min < plane && plane < max) {
                self.split(axis, plane);
                self.next.push(&self.below);
                std::mem::swap(&mut self.rest, &mut self.above);
            }
            let rest = std::mem::take(&mut self.rest);
            self.next.push(&rest);
            self.rest = rest;
        }
        self.current = current;
        self.current.clear();
        for corners in self.next.iter() {
            let middle = middle(corners)[axis];
            if middle < first || middle > last {
                pieces.push(polygon, None, corners);
            } else {
                self.current.push(corners);
            }
        }
    }

    /// Splits `rest` into `below` and `above` the plane; corners in the plane go to both.
    fn split(&mut self, axis: usize, plane: f64) {
        self.below.clear();
        self.above.clear();
        let count = self.rest.len();
        for i in 0..count {
            let (here, next) = (self.rest[i], self.rest[(i + 1) % count]);
            let side = here[axis].total_cmp(&plane);
            if side != Ordering::Greater {
                self.below.push(here);
            }
            if side != Ordering::Less {
                self.above.push(here);
            }
            let next_side = next[axis].total_cmp(&plane);
            if side != Ordering::Equal && next_side != Ordering::Equal && side != next_side {
                let crossing = self.crossing(here, next, axis, plane);
                self.below.push(crossing);
                self.above.push(crossing);
            }
        }
    }

    /// The point of an edge in a plane: the same bits for both directions of the edge.
    pub(super) fn crossing(&self, a: DVec3, b: DVec3, axis: usize, plane: f64) -> DVec3 {
        let (a, b) = if a[axis] < b[axis] { (a, b) } else { (b, a) };
        let fraction = (plane - a[axis]) / (b[axis] - a[axis]);
        let mut point = self.snapped(a + fraction * (b - a));
        point[axis] = plane;
        point
    }

    /// The point with coordinates close to a knot moved onto it.
    pub(super) fn snapped(&self, mut point: DVec3) -> DVec3 {
        for (axis, knots) in self.volume.axes().iter().enumerate() {
            let planes = knots.breakpoints();
            let above = planes.partition_point(|&plane| plane < point[axis]);
            for &plane in &planes[above.saturating_sub(1)..planes.len().min(above + 1)] {
                if (plane - point[axis]).abs() <= self.snap {
                    point[axis] = plane;
                }
            }
        }
        // -0 would compare below a knot at 0
        point + DVec3::ZERO
    }
}

/// Least and greatest coordinate of the corners.
pub(super) fn range(corners: &[DVec3], axis: usize) -> (f64, f64) {
    corners.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), corner| {
        (min.min(corner[axis]), max.max(corner[axis]))
    })
}

/// Middle of the corners' bounding box.
pub(super) fn middle(corners: &[DVec3]) -> DVec3 {
    let [min, max] = bounds::around(corners.iter().copied());
    min + 0.5 * (max - min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Noise;

    fn cube_volume() -> SplineVolume {
        SplineVolume::identity([2; 3], [4; 3], [DVec3::ZERO, DVec3::ONE]).unwrap()
    }

    fn area_vector(corners: &[DVec3]) -> DVec3 {
        (1..corners.len() - 1)
            .map(|i| 0.5 * (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]))
            .sum()
    }

    fn cut_one(corners: &[DVec3]) -> Pieces {
        cut_at_knot_planes(std::iter::once((5, corners)), Some(&cube_volume()))
    }

    #[test]
    fn a_triangle_across_two_planes_falls_into_three() {
        let corners = [DVec3::ZERO, DVec3::new(1.0, 0.0, 0.2), DVec3::new(0.0, 0.4, 0.0)];
        let pieces = cut_one(&corners);
        assert_eq!(pieces.len(), 2, "one cut at x = 1/2, none in y or z");
        let sum: DVec3 = (0..pieces.len()).map(|i| area_vector(pieces.corners(i))).sum();
        assert!((sum - area_vector(&corners)).length() < 1e-16);
        assert!((0..pieces.len()).all(|i| pieces.piece(i).polygon == 5 && pieces.corners(i).len() >= 3));
    }

    #[test]
    fn touching_vertices_and_edges_in_a_plane_make_no_cut() {
        let touching = [DVec3::new(0.5, 0.1, 0.1), DVec3::new(0.9, 0.1, 0.1), DVec3::new(0.9, 0.3, 0.2)];
        assert_eq!(cut_one(&touching).len(), 1, "vertex in the plane");
        let edge = [DVec3::new(0.5, 0.1, 0.1), DVec3::new(0.9, 0.1, 0.1), DVec3::new(0.5, 0.3, 0.1)];
        assert_eq!(cut_one(&edge).len(), 1, "edge in the plane");
        let near = edge.map(|p| if p.x == 0.5 { p + DVec3::X * -3e-13 } else { p });
        let pieces = cut_one(&near);
        assert_eq!(pieces.len(), 1, "edge within rounding of the plane");
        assert_eq!(pieces.corners(0)[0].x, 0.5, "moved onto it");
        let through = [DVec3::new(0.5, 0.0, 0.1), DVec3::new(0.9, 0.4, 0.1), DVec3::new(0.1, 0.4, 0.1)];
        let pieces = cut_one(&through);
        assert_eq!(pieces.len(), 2, "plane through a vertex");
        assert!((0..2).all(|i| pieces.corners(i).len() == 3), "no edge of length 0");
    }

    #[test]
    fn a_polygon_in_a_knot_plane_belongs_to_the_box_above_or_the_last() {
        for (x, want) in [(0.0, 0), (0.5, 1), (1.0, 1)] {
            let corners = [DVec3::new(x, 0.1, 0.1), DVec3::new(x, 0.3, 0.1), DVec3::new(x, 0.1, 0.3)];
            assert_eq!(cut_one(&corners).piece(0).knot_box, Some([want, 0, 0]), "at x = {x}");
        }
    }

    #[test]
    fn parts_outside_are_split_at_the_box() {
        let corners = [DVec3::new(-1.0, 0.1, 0.1), DVec3::new(2.0, 0.1, 0.1), DVec3::new(2.0, 0.4, 0.1)];
        let pieces = cut_one(&corners);
        let outside: Vec<_> = (0..pieces.len()).filter(|&i| pieces.piece(i).knot_box.is_none()).collect();
        assert_eq!((pieces.len(), outside.len()), (4, 2));
        for i in 0..pieces.len() {
            let inside = pieces.corners(i).iter().all(|p| (0.0..=1.0).contains(&p.x));
            assert_eq!(inside, pieces.piece(i).knot_box.is_some());
        }
        let far = corners.map(|p| p + DVec3::Z * 3.0);
        assert_eq!(cut_one(&far).piece(0).knot_box, None);
    }

    #[test]
    fn neighbours_share_new_corners_to_the_bit() {
        let mut noise = Noise(11);
        for _ in 0..300 {
            let mut point = || noise.vector() + 0.5;
            let (a, b, c, d) = (point(), point(), point(), point());
            let pieces = [cut_one(&[a, b, c]), cut_one(&[b, a, d])];
            let on_edge = |pieces: &Pieces| -> Vec<[u64; 3]> {
                let mut found: Vec<_> = pieces
                    .corners
                    .iter()
                    .filter(|&&p| (p - a).cross(b - a).length() < 1e-15 && (p - a).dot(b - a) >= 0.0)
                    .map(|p| p.to_array().map(f64::to_bits))
                    .collect();
                found.sort_unstable();
                found.dedup();
                found
            };
            let (mine, yours) = (on_edge(&pieces[0]), on_edge(&pieces[1]));
            assert!(mine.len() >= 2);
            assert_eq!(mine, yours);
        }
    }
}
