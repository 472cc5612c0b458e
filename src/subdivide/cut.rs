//! Polygons cut at the knot planes, without degenerate pieces.
//!
//! Source: Feng, Nishita, Jin, Peng (2002), section 3.2. The singular cases are settled by exact sign tests after
//! vertices close to a knot plane have been moved onto it.

use std::cmp::Ordering;
use std::collections::HashMap;

use glam::DVec3;

use crate::math::bounds;
use crate::spline::{KnotBox, SplineVolume};

use super::vertices::{Numbering, VertexNumbers};

/// A coordinate this close to a knot, in parts of the lattice's diagonal, is taken to lie on it.
///
/// Far above the rounding of coordinates that are meant to lie on the knot (1e-16), far below the accuracy asked
/// of hits (1e-11), so that moving a vertex by this much shows nowhere.
const SNAP: f64 = 1e-12;

/// The same of points on edges in the faces of the lattice's box: what is outside is not cut at them and has the whole edge, so
/// that they may leave it by no more than rounding.
const SNAP_IN_FACE: f64 = 1e-15;

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
    /// The vertex of each corner.
    vertices: Vec<u32>,
    numbers: VertexNumbers,
    pieces: Vec<Piece>,
}

/// A point of a polygon, with the number of its vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) place: DVec3,
    pub(super) vertex: u32,
}

impl Corner {
    pub(super) fn new(place: DVec3, numbering: &mut Numbering) -> Self {
        Self { place, vertex: numbering.vertex(place) }
    }
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

    /// The vertices of the corners of piece number `index`.
    pub(crate) fn vertices(&self, index: usize) -> &[u32] {
        let piece = &self.pieces[index];
        &self.vertices[piece.start as usize..piece.end as usize]
    }

    /// The numbers that were given.
    pub(crate) const fn numbers(&self) -> &VertexNumbers {
        &self.numbers
    }

    pub(super) fn set_numbers(&mut self, numbers: VertexNumbers) {
        self.numbers = numbers;
    }

    pub(super) fn push(
        &mut self,
        polygon: u32,
        knot_box: Option<KnotBox>,
        corners: impl IntoIterator<Item = Corner>,
    ) {
        let start = self.corners.len();
        for Corner { place, vertex } in corners {
            self.corners.push(place);
            self.vertices.push(vertex);
        }
        let index = |n: usize| u32::try_from(n).expect("fewer than 2^32 corners fit in memory");
        self.pieces.push(Piece { polygon, knot_box, start: index(start), end: index(self.corners.len()) });
    }
}

/// Cuts convex polygons at the knot planes of a volume.
///
/// Each piece lies in one closed knot box, or outside the lattice; pieces outside are split from the rest at the
/// lattice's box and not cut further. A piece in a knot plane belongs to the box above, at the lattice's end to the
/// last box. New corners on an edge that two polygons share are bit-identical in both, for they depend on the
/// edge's end points alone; so are the numbers of their vertices. Without a volume every polygon is one piece outside.
/// If it `shares_edges` with polygons that are cut apart from these, it is kept which vertices are inside of which edges.
pub(crate) fn cut_at_knot_planes<'a>(
    polygons: impl Iterator<Item = (u32, &'a [DVec3])>,
    volume: Option<&SplineVolume>,
    shares_edges: bool,
) -> Pieces {
    let mut pieces = Pieces::default();
    let Some(volume) = volume else {
        let mut numbering = Numbering::default();
        for (polygon, corners) in polygons {
            pieces.push(polygon, None, corners.iter().map(|&corner| Corner::new(corner, &mut numbering)));
        }
        pieces.numbers = numbering.numbers;
        return pieces;
    };
    let mut cutter = Cutter { shares_edges, ..Cutter::new(volume) };
    for (polygon, corners) in polygons {
        cutter.cut(polygon, corners, &mut pieces);
    }
    pieces.numbers = cutter.numbering.numbers;
    if !shares_edges && pieces.pieces.iter().all(|piece| piece.knot_box.is_some()) {
        // all that have such an edge are cut at the point
        pieces.numbers.forget_edge_points();
    }
    pieces
}

/// A list of polygons, flat.
#[derive(Debug, Default)]
struct Polygons {
    corners: Vec<Corner>,
    ends: Vec<usize>,
}

impl Polygons {
    fn clear(&mut self) {
        self.corners.clear();
        self.ends.clear();
    }

    fn iter(&self) -> impl Iterator<Item = &[Corner]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.corners[start..end])
    }

    /// Adds a polygon, without corners at the place of their predecessor, unless too little is left of it. The vertices of such
    /// corners are one.
    fn push(&mut self, corners: &[Corner], numbers: &mut VertexNumbers) {
        let start = self.corners.len();
        for &corner in corners {
            match self.corners[start..].last() {
                Some(last) if last.place == corner.place => numbers.join(last.vertex, corner.vertex),
                _ => self.corners.push(corner),
            }
        }
        while self.corners.len() > start + 1 {
            let [first, last] = [self.corners[start], self.corners[self.corners.len() - 1]];
            if first.place != last.place {
                break;
            }
            numbers.join(first.vertex, last.vertex);
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
    pub(super) numbering: Numbering,
    /// Whether polygons that others share edges with are cut apart from these.
    shares_edges: bool,
    /// The vertices where edges cross planes: of the edge's ends, the axis, and the plane's number.
    crossings: HashMap<([u32; 2], usize, usize), u32>,
    current: Polygons,
    next: Polygons,
    rest: Vec<Corner>,
    below: Vec<Corner>,
    above: Vec<Corner>,
}

impl<'a> Cutter<'a> {
    pub(super) fn new(volume: &'a SplineVolume) -> Self {
        let [low, high] = volume.bounds();
        Self {
            volume,
            snap: SNAP * (high - low).length(),
            numbering: Numbering::default(),
            shares_edges: false,
            crossings: HashMap::new(),
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
            let snapped = self.corner(corner);
            self.rest.push(snapped);
        }
        self.current.clear();
        self.current.push(&self.rest, &mut self.numbering.numbers);
        for axis in 0..3 {
            self.cut_axis(axis, polygon, pieces);
        }
        for piece in self.current.iter() {
            let middle = middle(piece.iter().map(|corner| corner.place));
            pieces.push(polygon, self.volume.knot_box(middle), piece.iter().copied());
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
            let (min, max) = range(corners.iter().map(|corner| corner.place), axis);
            for (number, &plane) in planes.iter().enumerate() {
                if min < plane && plane < max {
                    self.split(axis, number);
                    self.next.push(&self.below, &mut self.numbering.numbers);
                    std::mem::swap(&mut self.rest, &mut self.above);
                }
            }
            self.next.push(&self.rest, &mut self.numbering.numbers);
        }
        self.current = current;
        self.current.clear();
        for corners in self.next.iter() {
            let middle = middle(corners.iter().map(|corner| corner.place))[axis];
            if middle < first || middle > last {
                pieces.push(polygon, None, corners.iter().copied());
            } else {
                self.current.push(corners, &mut self.numbering.numbers);
            }
        }
    }

    /// Splits `rest` into `below` and `above` the plane.
    ///
    /// Where the outline goes from one side to the other it has one point in both: a corner in the plane, or a crossing. Of several
    /// corners in the plane one after the other, which a needle has after its corners were moved onto knots, it is the first; the
    /// others stay on the side to which the outline goes, or comes back.
    fn split(&mut self, axis: usize, number: usize) {
        let plane = self.volume.axes()[axis].breakpoints()[number];
        self.below.clear();
        self.above.clear();
        let count = self.rest.len();
        let side = |corner: &Corner| corner.place[axis].total_cmp(&plane);
        let Some(last) = self.rest.iter().rev().map(side).find(|side| *side != Ordering::Equal) else {
            return;
        };
        let (mut before, mut is_run) = (last, self.rest.last().is_some_and(|corner| side(corner).is_eq()));
        for i in 0..count {
            let (here, next) = (self.rest[i], self.rest[(i + 1) % count]);
            let own = side(&here);
            let after = if own == Ordering::Equal {
                let onwards = (1..count).map(|step| side(&self.rest[(i + step) % count]));
                onwards.into_iter().find(|side| *side != Ordering::Equal).unwrap_or(before)
            } else {
                own
            };
            let is_in_both = own == Ordering::Equal && before != after && !is_run;
            if after == Ordering::Less || is_in_both {
                self.below.push(here);
            }
            if after == Ordering::Greater || is_in_both {
                self.above.push(here);
            }
            is_run = own == Ordering::Equal;
            if !is_run {
                before = own;
            }
            let next_side = side(&next);
            if own != Ordering::Equal && next_side != Ordering::Equal && own != next_side {
                let crossing = self.crossing([here, next], axis, number);
                self.below.push(crossing);
                self.above.push(crossing);
            }
        }
    }

    /// The point of an edge in plane number `number` of an axis: the same bits, and the same vertex, for both directions of the
    /// edge.
    pub(super) fn crossing(&mut self, [a, b]: [Corner; 2], axis: usize, number: usize) -> Corner {
        let plane = self.volume.axes()[axis].breakpoints()[number];
        let (a, b) = if a.place[axis] < b.place[axis] { (a, b) } else { (b, a) };
        let fraction = (plane - a.place[axis]) / (b.place[axis] - a.place[axis]);
        let ends = [a.vertex.min(b.vertex), a.vertex.max(b.vertex)];
        // what is outside the box is not cut along the edges it has in the box's faces
        let in_face = (0..3).filter(|&other| other != axis).any(|other| {
            let planes = self.volume.axes()[other].breakpoints();
            let along = a.place[other];
            along == b.place[other] && (along == planes[0] || along == planes[planes.len() - 1])
        });
        let snap = if in_face { self.snap * (SNAP_IN_FACE / SNAP) } else { self.snap };
        let mut place = self.snapped(a.place + fraction * (b.place - a.place), snap);
        place[axis] = plane;
        let numbers = &mut self.numbering.numbers;
        let vertex = *self.crossings.entry((ends, axis, number)).or_insert_with(|| {
            if in_face || self.shares_edges {
                numbers.add_on_edge([a.vertex, b.vertex], fraction)
            } else {
                numbers.add()
            }
        });
        Corner { place, vertex }
    }

    /// A point of a polygon, moved onto knots that are close.
    pub(super) fn corner(&mut self, point: DVec3) -> Corner {
        Corner::new(self.snapped(point, self.snap), &mut self.numbering)
    }

    /// The point with coordinates as close to a knot as `snap` moved onto it.
    fn snapped(&self, mut point: DVec3, snap: f64) -> DVec3 {
        for (axis, knots) in self.volume.axes().iter().enumerate() {
            let planes = knots.breakpoints();
            let above = planes.partition_point(|&plane| plane < point[axis]);
            for &plane in &planes[above.saturating_sub(1)..planes.len().min(above + 1)] {
                if (plane - point[axis]).abs() <= snap {
                    point[axis] = plane;
                }
            }
        }
        // -0 would compare below a knot at 0
        point + DVec3::ZERO
    }
}

/// Least and greatest coordinate of the corners.
pub(super) fn range(corners: impl IntoIterator<Item = DVec3>, axis: usize) -> (f64, f64) {
    corners.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), corner| {
        (min.min(corner[axis]), max.max(corner[axis]))
    })
}

/// Middle of the corners' bounding box.
pub(super) fn middle(corners: impl IntoIterator<Item = DVec3>) -> DVec3 {
    let [min, max] = bounds::around(corners);
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
        cut_at_knot_planes(std::iter::once((5, corners)), Some(&cube_volume()), false)
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
    fn pieces_of_a_needle_among_knot_planes_do_not_overlap() {
        // all corners all but in the planes x = 2/3 and z = 2/3: after cuts and moves two corners in a row are in a plane that others
        // are on both sides of
        let corners = [
            DVec3::new(0.6666666663773373, 0.3333333333328949, 0.6666666659950312),
            DVec3::new(0.6666666666579394, 0.6666666666393006, 0.6666666666668505),
            DVec3::new(0.6666667291230501, 0.73443110660078, 0.6666666666698072),
        ];
        let volume = SplineVolume::identity([2; 3], [5; 3], [DVec3::ZERO, DVec3::ONE]).unwrap();
        let pieces = cut_at_knot_planes(std::iter::once((0, &corners[..])), Some(&volume), false);
        assert!(pieces.len() > 3);
        let mut edges: HashMap<[u32; 2], usize> = HashMap::new();
        for piece in 0..pieces.len() {
            let vertices = pieces.vertices(piece);
            for (i, &from) in vertices.iter().enumerate() {
                *edges.entry([from, vertices[(i + 1) % vertices.len()]]).or_default() += 1;
            }
        }
        assert!(edges.values().all(|&count| count == 1), "{edges:?}");
        // the outline alone has no partner: three corners, and where planes cross its sides
        let alone = edges.keys().filter(|[a, b]| !edges.contains_key(&[*b, *a])).count();
        let euler = pieces.len() as isize - (edges.len() + alone) as isize / 2;
        let mut vertices: Vec<u32> = edges.keys().map(|edge| edge[0]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        assert_eq!(euler + vertices.len() as isize, 1, "a disc");
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
