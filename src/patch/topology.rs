//! The vertices and edges of a shell: what its faces share.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use crate::math::bounds;
use crate::subdivide::EdgePoint;

use super::face::Face;
use super::region::{TrimLoop, index};
use super::sheets::Sheets;
use super::shell::Shell;

/// Images of one vertex this close, in parts of the deformed object's diagonal, are one: far above the rounding of their
/// evaluation in different faces, far below a tear that anyone would see.
const SAME_POSITION: f64 = 1e-9;

/// Points of an edge this close, in parts of it, are one: above the rounding of parameters in the faces that cut it.
const SAME_FRACTION: f64 = 1e-12;

/// Corners of a loop this close, in parts of the unit square, are one if their vertex is.
const SAME_PARAMETERS: f64 = 1e-12;

/// Normals are the same if the cosine of their angle is this close to 1: a hundredth of a degree, far above rounding.
const SMOOTH: f64 = 1e-8;

/// The vertices and edges of a [`Shell`].
///
/// Where the deformation tears the object (parts outside a lattice's box that stay beside moved ones) a vertex of the
/// undeformed object has several images, each a vertex here, and the two sides of a tear are two edges.
#[derive(Clone, Debug)]
pub struct Topology<'a> {
    positions: Vec<DVec3>,
    outlines: Vec<Outline<'a>>,
    edges: Vec<Edge>,
    same_position: f64,
}

/// A loop of a face's region, with the vertices that others have on its edges.
#[derive(Clone, Debug)]
pub struct Outline<'a> {
    /// The faces over this unit square; the first leads.
    pub sheets: Sheets<'a>,
    /// The loop of their region.
    pub trim_loop: TrimLoop,
    /// Its corners and the vertices between them, counter-clockwise in the face's parameters.
    pub corners: Vec<Corner>,
}

/// A vertex in a loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Index of the vertex.
    pub vertex: u32,
    /// Its place in the face's parameters.
    pub st: DVec2,
}

/// A straight line in the parameters of each loop that has it, between two vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Indices of the vertices, as the first use runs.
    pub vertices: [u32; 2],
    /// The loops that have it: one on a border, two inside of a manifold surface.
    pub uses: Vec<EdgeUse>,
}

/// An edge in a loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeUse {
    /// Index of the outline.
    pub outline: u32,
    /// Index of its corner in the outline at which the edge starts.
    pub corner: u32,
    /// Its ends in the face's parameters, in the loop's direction.
    pub st: [DVec2; 2],
    /// Whether the loop runs from the edge's second vertex to its first.
    pub is_reversed: bool,
}

impl<'a> Outline<'a> {
    /// The first of its faces.
    #[must_use]
    pub const fn face(&self) -> &'a Face {
        &self.sheets.faces()[0]
    }

    /// Its edges.
    fn edges(&self) -> impl Iterator<Item = [Corner; 2]> {
        let count = self.corners.len();
        (0..count).map(move |i| [self.corners[i], self.corners[(i + 1) % count]])
    }
}

impl Shell {
    /// Its vertices and edges.
    #[must_use]
    pub fn topology(&self) -> Topology<'_> {
        Topology::new(self)
    }
}

impl<'a> Topology<'a> {
    fn new(shell: &'a Shell) -> Self {
        let lines = Lines::new(shell.numbers().edge_points(), shell.numbers().equal());
        let mut images = Images::new(shell.faces());
        let mut outlines = Vec::new();
        let mut numbered = shell.iter();
        for sheets in Sheets::of_faces(shell.faces()) {
            let Some((face, vertices)) = numbered.next() else { break };
            numbered.by_ref().take(sheets.faces().len() - 1).for_each(drop);
            for trim_loop in face.region.loops() {
                let corners = outline(face, &trim_loop, vertices, &lines, &mut images);
                outlines.push(Outline { sheets, trim_loop, corners });
            }
        }
        let edges = edges(&outlines, images.same_position);
        Self { positions: images.positions, outlines, edges, same_position: images.same_position }
    }

    /// The vertices: their places in the deformed object.
    #[must_use]
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// The loops of all faces, in their order.
    #[must_use]
    pub fn outlines(&self) -> &[Outline<'a>] {
        &self.outlines
    }

    /// The edges, in the order of the loops that have them first.
    #[must_use]
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Images of one vertex no farther apart than this, in world units, are taken to be one.
    #[must_use]
    pub const fn same_position(&self) -> f64 {
        self.same_position
    }

    /// Whether the faces bound solids: there are edges, each is there as often in one direction as in the other, and no face is
    /// torn along a curve.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        let is_torn = |outline: &Outline<'_>| {
            let corners = outline.face().region.corners(&outline.trim_loop);
            outline.sheets.are_torn(corners, self.same_position)
        };
        let is_balanced = |edge: &Edge| {
            2 * edge.uses.iter().filter(|edge_use| edge_use.is_reversed).count() == edge.uses.len()
        };
        !self.edges.is_empty() && self.edges.iter().all(is_balanced) && !self.outlines.par_iter().any(is_torn)
    }

    /// Whether the surface goes on smoothly across an edge: two faces have it, and the normals on both sides of its middle are
    /// the same.
    #[must_use]
    pub fn is_smooth(&self, edge: &Edge) -> bool {
        let normal = |edge_use: &EdgeUse| {
            let middle = 0.5 * (edge_use.st[0] + edge_use.st[1]);
            self.outlines[edge_use.outline as usize].face().eval_whole(middle).normal()
        };
        let [first, second] = &*edge.uses else { return false };
        first.is_reversed != second.is_reversed && normal(first).dot(normal(second)) > 1.0 - SMOOTH
    }
}

/// A loop's corners as vertices, with those that other loops have on its edges.
fn outline(
    face: &Face,
    trim_loop: &TrimLoop,
    vertices: &[u32],
    lines: &Lines,
    images: &mut Images,
) -> Vec<Corner> {
    let numbered: Vec<_> = face.region.numbered_corners(trim_loop, vertices).collect();
    let mut corners: Vec<Corner> = Vec::with_capacity(numbered.len());
    for (i, from) in numbered.iter().enumerate() {
        let to = &numbered[(i + 1) % numbered.len()];
        let image = |st: DVec2| face.eval_whole(st).position;
        let ends = [from, to].map(|corner| lines.first(corner.vertex));
        corners.push(Corner { vertex: images.vertex(ends[0], image(from.st)), st: from.st });
        for (fraction, number) in lines.between(ends) {
            let st = from.st.lerp(to.st, fraction);
            corners.push(Corner { vertex: images.vertex(number, image(st)), st });
        }
    }
    // a side that is a pole has one vertex at several parameters
    let is_same =
        |a: &Corner, b: &Corner| a.vertex == b.vertex && (a.st - b.st).abs().max_element() <= SAME_PARAMETERS;
    corners.dedup_by(|a, b| is_same(a, b));
    if corners.len() > 1 && is_same(&corners[0], &corners[corners.len() - 1]) {
        corners.pop();
    }
    corners
}

/// The edges of all outlines, less those that are points; those between the same vertices are one where their middles are.
fn edges(outlines: &[Outline<'_>], same_position: f64) -> Vec<Edge> {
    let mut found: Vec<Edge> = Vec::new();
    let mut between: HashMap<[u32; 2], Vec<(usize, DVec3)>> = HashMap::new();
    for (number, outline) in outlines.iter().enumerate() {
        for (corner, ends) in outline.edges().enumerate() {
            let vertices = ends.map(|corner| corner.vertex);
            let st = ends.map(|corner| corner.st);
            let face = outline.face();
            let middle = face.eval_whole(0.5 * (st[0] + st[1])).position;
            // at a pole
            if vertices[0] == vertices[1] && middle.distance(face.eval_whole(st[0]).position) <= same_position
            {
                continue;
            }
            let known = between.entry(ordered(vertices)).or_default();
            // so written, NaN is far
            let same = known.iter().find(|(_, place)| place.distance(middle) <= same_position);
            let edge = same.map_or(found.len(), |(edge, _)| *edge);
            if edge == found.len() {
                known.push((edge, middle));
                found.push(Edge { vertices, uses: Vec::with_capacity(2) });
            }
            let is_reversed = vertices != found[edge].vertices;
            found[edge].uses.push(EdgeUse { outline: index(number), corner: index(corner), st, is_reversed });
        }
    }
    found
}

/// Which numbers of vertices are one, and which vertices are on the edges between others.
struct Lines {
    /// The first of the numbers of a vertex, where it has several.
    first: HashMap<u32, u32>,
    /// The edge that a vertex is inside of, and where.
    inside: HashMap<u32, ([u32; 2], f64)>,
    /// The vertices inside of edges, from the end with the lower number on.
    points: HashMap<[u32; 2], Vec<(f64, u32)>>,
}

impl Lines {
    fn new(edge_points: &[EdgePoint], equal: &[[u32; 2]]) -> Self {
        let mut lines = Self { first: HashMap::new(), inside: HashMap::new(), points: HashMap::new() };
        for &[a, b] in equal {
            let (a, b) = (lines.first(a), lines.first(b));
            if a != b {
                lines.first.insert(a.max(b), a.min(b));
            }
        }
        // an edge's ends have been numbered before the points inside of it
        for point in edge_points {
            let [low, high] = point.edge.map(|end| lines.first(end));
            let vertex = lines.first(point.vertex);
            if low == high || vertex == low || vertex == high {
                continue;
            }
            let (edge, [from, to]) = lines.line([low, high]);
            let fraction = from + point.fraction * (to - from);
            let points = lines.points.entry(edge).or_default();
            let same = points.iter().find(|(other, _)| (other - fraction).abs() <= SAME_FRACTION);
            match same {
                Some(&(_, known)) if known != vertex => {
                    lines.first.insert(vertex, known);
                }
                Some(_) => {}
                None => {
                    points.push((fraction, vertex));
                    lines.inside.insert(vertex, (edge, fraction));
                }
            }
        }
        for points in lines.points.values_mut() {
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        lines
    }

    /// The first number of a vertex.
    fn first(&self, mut vertex: u32) -> u32 {
        while let Some(&other) = self.first.get(&vertex) {
            vertex = other;
        }
        vertex
    }

    /// The longest edge that the line between two vertices is a part of, and where on it they are.
    fn line(&self, [a, b]: [u32; 2]) -> ([u32; 2], [f64; 2]) {
        let [of_a, of_b] = [a, b].map(|vertex| self.inside.get(&vertex));
        let end = |(edge, fraction): &([u32; 2], f64), other: u32| {
            (edge.contains(&other)).then(|| (*edge, *fraction, f64::from(u8::from(edge[1] == other))))
        };
        if let (Some((edge, from)), Some((other, to))) = (of_a, of_b)
            && edge == other
        {
            return (*edge, [*from, *to]);
        }
        if let Some((edge, from, to)) = of_a.and_then(|inside| end(inside, b)) {
            return (edge, [from, to]);
        }
        if let Some((edge, to, from)) = of_b.and_then(|inside| end(inside, a)) {
            return (edge, [from, to]);
        }
        (ordered([a, b]), if a < b { [0.0, 1.0] } else { [1.0, 0.0] })
    }

    /// The vertices between two, and how far they are from the first to the second.
    fn between(&self, ends: [u32; 2]) -> Vec<(f64, u32)> {
        if self.points.is_empty() || ends[0] == ends[1] {
            return Vec::new();
        }
        let (edge, [from, to]) = self.line(ends);
        let Some(points) = self.points.get(&edge) else { return Vec::new() };
        let start = points.partition_point(|(place, _)| *place <= from.min(to) + SAME_FRACTION);
        let end = points.partition_point(|(place, _)| *place < from.max(to) - SAME_FRACTION);
        let inner = points.get(start..end).unwrap_or_default();
        let mut found: Vec<_> =
            inner.iter().map(|(place, vertex)| ((place - from) / (to - from), *vertex)).collect();
        if from > to {
            found.reverse();
        }
        found
    }
}

/// The images of vertices.
struct Images {
    positions: Vec<DVec3>,
    /// The vertices of a number, each at another place.
    of_number: HashMap<u32, Vec<u32>>,
    same_position: f64,
}

impl Images {
    fn new(faces: &[Face]) -> Self {
        let boundary_error = faces.iter().map(Face::error).fold(0.0, f64::max);
        let [low, high] = bounds::around(faces.iter().flat_map(|face| face.patch.hull_bounds()));
        let same_position = SAME_POSITION * (high - low).length() + 2.0 * boundary_error;
        Self { positions: Vec::new(), of_number: HashMap::new(), same_position }
    }

    /// The vertex of a number at a place.
    fn vertex(&mut self, number: u32, position: DVec3) -> u32 {
        let known = self.of_number.entry(number).or_default();
        let is_here =
            |vertex: &&u32| self.positions[**vertex as usize].distance(position) <= self.same_position;
        if let Some(&vertex) = known.iter().find(is_here) {
            return vertex;
        }
        self.positions.push(position);
        let vertex = index(self.positions.len() - 1);
        known.push(vertex);
        vertex
    }
}

const fn ordered([a, b]: [u32; 2]) -> [u32; 2] {
    if a < b { [a, b] } else { [b, a] }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec4;

    use super::*;
    use crate::patch::{PlanarPolygon, deform_triangles};
    use crate::spline::SplineVolume;
    use crate::subdivide::FrameChoice;
    use crate::test_support::{Noise, ball_triangles, cube_triangles, deform, random_volume};

    /// V - E + F of the faces, which the loops of regions are here.
    fn euler(topology: &Topology<'_>) -> isize {
        let count = |n: usize| isize::try_from(n).unwrap();
        count(topology.positions().len()) - count(topology.edges().len()) + count(topology.outlines().len())
    }

    fn assert_sphere(shell: &Shell, what: &str) {
        let topology = shell.topology();
        assert!(
            topology.edges().iter().all(|edge| edge.uses.len() == 2),
            "{what}: every edge is of two faces"
        );
        assert!(topology.is_closed(), "{what}");
        assert_eq!(euler(&topology), 2, "{what}");
        for edge in topology.edges() {
            let ends = |edge_use: &EdgeUse| {
                let face = topology.outlines()[edge_use.outline as usize].face();
                edge_use.st.map(|st| face.eval_whole(st).position)
            };
            let ([a, b], [d, c]) = (ends(&edge.uses[0]), ends(&edge.uses[1]));
            assert!(a.distance(c).max(b.distance(d)) < topology.same_position(), "{what}: {a} {b} {c} {d}");
        }
    }

    #[test]
    fn closed_solids_are_spheres_whatever_cuts_them() {
        let mut noise = Noise(31);
        for points in [3, 5, 9] {
            for rational in [false, true] {
                let volume = random_volume(&mut noise, [2; 3], [points; 3], 0.2, rational);
                for (name, triangles) in [("cube", cube_triangles()), ("ball", ball_triangles())] {
                    for frame in [FrameChoice::Parallelogram, FrameChoice::Rectangle] {
                        assert_sphere(&deform(&triangles, Some(&volume), frame), name);
                    }
                    let polygons: Vec<_> = (0..)
                        .zip(&triangles)
                        .map(|(face, corners)| PlanarPolygon { face, corners })
                        .collect();
                    let made = deform_triangles(&polygons, Some(&volume)).unwrap();
                    assert_sphere(&made.shell(&polygons, Some(&volume)).unwrap(), "Feng and Peng");
                }
            }
        }
    }

    #[test]
    fn parts_outside_the_box_are_joined_where_they_are_not_torn() {
        let identity =
            SplineVolume::identity([2; 3], [5; 3], [DVec3::splat(-0.2), DVec3::splat(0.6)]).unwrap();
        let shell = deform(&cube_triangles(), Some(&identity), FrameChoice::Parallelogram);
        assert!(shell.faces().iter().any(|face| face.knot_box().is_none()));
        assert_sphere(&shell, "cut at the box");
        let moved: Vec<_> =
            identity.control_points().iter().map(|point| *point + DVec4::new(0.3, 0.0, 0.0, 0.0)).collect();
        let moved = SplineVolume::try_new(identity.axes().clone(), &moved).unwrap();
        let torn = deform(&cube_triangles(), Some(&moved), FrameChoice::Parallelogram);
        let topology = torn.topology();
        assert!(!topology.is_closed());
        let border = topology.edges().iter().filter(|edge| edge.uses.len() == 1);
        assert!(border.clone().count() > 8);
        for edge in border {
            let [a, b] = edge.vertices.map(|vertex| topology.positions()[vertex as usize]);
            let on_tear =
                |p: DVec3| [p, p - 0.3 * DVec3::X].iter().any(|p| (p.max_element() - 0.6).abs() < 1e-9);
            assert!(on_tear(a) && on_tear(b), "{a} {b}");
        }
    }

    #[test]
    fn surfaces_close_along_seams_and_at_poles() {
        use crate::analytic::{Chain, CoverSettings, Step, cover};
        use crate::surface::Shape;
        let (center, axis) = (DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.2, 0.1, 1.0));
        let sphere = Shape::Sphere { center, radius: 1.1 };
        let torus = Shape::Torus { center, axis, major_radius: 1.0, minor_radius: 0.4 };
        let cylinder = Shape::Cylinder { origin: center, axis, radius: 0.5 };
        for (shape, is_closed, characteristic) in [(sphere, true, 2), (torus, true, 0), (cylinder, false, 0)]
        {
            let shell = shape.surface().unwrap().shell();
            let whole = shell.topology();
            assert_eq!((whole.is_closed(), euler(&whole)), (is_closed, characteristic), "{shape:?}");
            let [low, high] = bounds::around(whole.positions().iter().copied());
            let volume = SplineVolume::identity([2; 3], [4; 3], [low - 0.5, high + 0.5]).unwrap();
            let mut points = volume.control_points();
            let mut noise = Noise(5);
            points.iter_mut().for_each(|point| *point += (0.05 * noise.vector()).extend(0.0));
            let volume = SplineVolume::try_new(volume.axes().clone(), &points).unwrap();
            let chain = Arc::new(Chain::try_new(vec![Step::Volume(volume)]).unwrap());
            let covered = cover(&shell, &chain, CoverSettings::default()).unwrap().shell;
            assert!(covered.faces().len() > shell.faces().len(), "{shape:?} is cut");
            let cut = covered.topology();
            assert_eq!((cut.is_closed(), euler(&cut)), (is_closed, characteristic), "{shape:?} cut");
        }
    }

    #[test]
    fn edges_are_smooth_or_not() {
        let shell = deform(&cube_triangles(), None, FrameChoice::Parallelogram);
        let topology = shell.topology();
        let smooth = topology.edges().iter().filter(|edge| topology.is_smooth(edge)).count();
        assert_eq!((topology.edges().len(), smooth), (18, 6), "the diagonals of its squares");
    }
}
