//! The triangles of the sub-polygons, before any is halved: which corners are the same.

use std::collections::{HashMap, HashSet};

use glam::{DVec2, DVec3};

use super::index;
use crate::math::polygon::doubled_area;
use crate::patch::{PatchPoint, TrimmedPatch};

/// Corners of the undeformed object this close, in parts of its diagonal, are the same: above the 1e-12 by which pieces are
/// moved into shared planes and onto knot planes.
const SAME_REST: f64 = 1e-11;

/// The same in parts of the greatest coordinate, whose rounding no diagonal tells of.
const SAME_REST_ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Points of the deformed object this close, in parts of its diagonal, are the same if they are so undeformed: far above
/// rounding, far below a tear that anyone would see.
const SAME_POSITION: f64 = 1e-9;

/// Normals are the same if the cosine of their angle is this close to 1: a hundredth of a degree, far above rounding.
const SMOOTH: f64 = 1e-8;

/// Share of a mean triangle's area below which one of a fan is taken to be degenerate.
const THIN: f64 = 0.01;

/// A sub-polygon: where its triangles are evaluated.
#[derive(Clone, Debug)]
pub(super) struct Part<'a> {
    pub(super) patch: &'a TrimmedPatch,
    /// All patches over the same rectangle, with curved borders between them; the first leads.
    pub(super) sheets: &'a [TrimmedPatch],
    /// Whether its triangles are on its own side of curved borders, and not on that of whichever patch is there.
    pub(super) is_side: bool,
    /// Its corners in the patch's parameters, counter-clockwise.
    pub(super) outline: &'a [DVec2],
    /// The edges of it beyond which the surface does not go on smoothly.
    pub(super) creases: Vec<[DVec2; 2]>,
    /// Index of the prepared polygon it is cut from.
    pub(super) polygon: u32,
    /// Index of the input face.
    pub(super) face: u32,
}

/// A triangle within one sub-polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    /// Index of the sub-polygon.
    pub(super) part: u32,
    pub(super) vertices: [u32; 3],
    /// The vertices in the patch's parameters.
    pub(super) st: [DVec2; 3],
    /// Whether it is known to be close enough to the surface.
    pub(super) settled: bool,
    /// Whether it has not been halved yet.
    pub(super) is_first: bool,
    /// Whether the edges 0-1, 1-2 and 2-0 are along a curved border where the surface is torn.
    pub(super) on_border: [bool; 3],
}

/// Triangles on the exact surface.
#[derive(Debug)]
pub(super) struct Mesh<'a> {
    pub(super) parts: Vec<Part<'a>>,
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<Triangle>,
    /// Points as close as this, with the same place on the undeformed object, are one vertex.
    pub(super) same_position: f64,
}

/// A corner of a sub-polygon.
#[derive(Clone, Copy, Debug)]
struct Corner {
    vertex: u32,
    st: DVec2,
}

/// All sub-polygons as triangles that share corners.
pub(super) fn base_mesh(patches: &[TrimmedPatch]) -> Mesh<'_> {
    let mut welder = Welder::new(patches);
    let mut parts = Vec::new();
    let mut outlines: Vec<Vec<Corner>> = Vec::new();
    for sheets in patches.chunk_by(|_, next| !next.leads()) {
        let patch = &sheets[0];
        for trim_loop in patch.trim.loops() {
            let mut outline: Vec<Corner> = Vec::new();
            for &st in patch.trim.corners(trim_loop) {
                let vertex = welder.vertex(patch.frame.point(st), patch.eval_whole(st).position);
                outline.push(Corner { vertex, st });
            }
            outline.dedup_by_key(|corner| corner.vertex);
            if outline.len() > 1 && outline[0].vertex == outline[outline.len() - 1].vertex {
                outline.pop();
            }
            let border = patch.trim.corners(trim_loop);
            let (polygon, face) = (trim_loop.polygon, trim_loop.face);
            let creases = Vec::new();
            parts.push(Part { patch, sheets, is_side: false, outline: border, creases, polygon, face });
            outlines.push(outline);
        }
    }
    insert_corners_on_edges(&welder, &parts, &mut outlines);
    find_creases(&mut parts, &outlines);
    let mut mesh = Mesh {
        parts,
        positions: welder.vertices.iter().map(|vertex| vertex.position).collect(),
        triangles: Vec::new(),
        same_position: welder.same_position,
    };
    for (part, outline) in outlines.iter().enumerate() {
        mesh.triangulate(index(part), outline);
    }
    mesh
}

impl Part<'_> {
    /// Point and partial derivatives of the surface.
    pub(super) fn eval(&self, st: DVec2) -> PatchPoint {
        if self.is_side { self.patch.eval(st) } else { self.patch.eval_whole(st) }
    }
}

impl<'a> Mesh<'a> {
    /// The patches over a triangle's rectangle.
    pub(super) fn sheets(&self, triangle: &Triangle) -> &'a [TrimmedPatch] {
        self.parts[triangle.part as usize].sheets
    }

    /// The point of a sub-polygon's patch.
    pub(super) fn eval(&self, part: u32, st: DVec2) -> DVec3 {
        self.parts[part as usize].eval(st).position
    }

    /// Cuts a convex outline, which may have corners on straight edges, into triangles: a fan, or a star around its middle
    /// where every fan would have a triangle without area.
    fn triangulate(&mut self, part: u32, outline: &[Corner]) {
        let count = outline.len();
        if count < 3 {
            return;
        }
        let mut push = |corners: [Corner; 3]| {
            let (vertices, st) = (corners.map(|corner| corner.vertex), corners.map(|corner| corner.st));
            self.triangles.push(Triangle {
                part,
                vertices,
                st,
                settled: false,
                is_first: true,
                on_border: [false; 3],
            });
        };
        let corner = |i: usize| outline[i % count];
        let fan =
            |apex: usize| (1..count - 1).map(move |i| [corner(apex), corner(apex + i), corner(apex + i + 1)]);
        let least_area = |apex: usize| {
            fan(apex).map(|t| doubled_area(&t.map(|corner| corner.st))).fold(f64::INFINITY, f64::min)
        };
        let (apex, least) = (0..count)
            .map(|apex| (apex, least_area(apex)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .expect("an outline has corners");
        let st: Vec<_> = outline.iter().map(|corner| corner.st).collect();
        if count == 3 || least > THIN * doubled_area(&st) / (count - 2) as f64 {
            fan(apex).for_each(push);
            return;
        }
        let middle = st.iter().sum::<DVec2>() / count as f64;
        self.positions.push(self.parts[part as usize].patch.eval_whole(middle).position);
        let middle = Corner { vertex: index(self.positions.len() - 1), st: middle };
        for i in 0..count {
            push([middle, corner(i), corner(i + 1)]);
        }
    }
}

/// A corner of the object.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    rest: DVec3,
    position: DVec3,
}

/// Finds corners that are the same.
struct Welder {
    vertices: Vec<Vertex>,
    /// Vertices by the grid cell of their place on the undeformed object.
    cells: HashMap<[i64; 3], Vec<u32>>,
    same_rest: f64,
    same_position: f64,
}

impl Welder {
    fn new(patches: &[TrimmedPatch]) -> Self {
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let (mut rest, mut deformed) = (none, none);
        let mut boundary_error: f64 = 0.0;
        for patch in patches {
            boundary_error = boundary_error.max(patch.error());
            for &st in patch.trim.loops().iter().flat_map(|trim_loop| patch.trim.corners(trim_loop)) {
                let place = patch.frame.point(st);
                rest = [rest[0].min(place), rest[1].max(place)];
            }
            let [low, high] = patch.patch.hull_bounds();
            deformed = [deformed[0].min(low), deformed[1].max(high)];
        }
        let magnitude = rest[0].abs().max(rest[1].abs()).max_element();
        let diagonal = |[low, high]: [DVec3; 2]| (high - low).length();
        Self {
            vertices: Vec::new(),
            cells: HashMap::new(),
            same_rest: SAME_REST * diagonal(rest) + SAME_REST_ROUNDING * magnitude + f64::MIN_POSITIVE,
            same_position: SAME_POSITION * diagonal(deformed) + 2.0 * boundary_error,
        }
    }

    /// The vertex at a place of the undeformed object and its image.
    fn vertex(&mut self, rest: DVec3, position: DVec3) -> u32 {
        if let Some(known) = self.known(rest, position) {
            return known;
        }
        self.vertices.push(Vertex { rest, position });
        let vertex = index(self.vertices.len() - 1);
        self.cells.entry(self.cell(rest)).or_default().push(vertex);
        vertex
    }

    fn known(&self, rest: DVec3, position: DVec3) -> Option<u32> {
        let (low, high) = (self.cell(rest - self.same_rest), self.cell(rest + self.same_rest));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let found = self.cells.get(&[x, y, z]).into_iter().flatten();
                    let same = |vertex: &&u32| {
                        let known = self.vertices[**vertex as usize];
                        known.rest.distance(rest) <= self.same_rest
                            && known.position.distance(position) <= self.same_position
                    };
                    if let Some(&vertex) = found.clone().find(same) {
                        return Some(vertex);
                    }
                }
            }
        }
        None
    }

    #[expect(
        clippy::cast_possible_truncation,
        reason = "beyond 2^63 cells it saturates, and cells are only a sieve"
    )]
    fn cell(&self, rest: DVec3) -> [i64; 3] {
        // larger than what is looked for, so that mostly one cell is looked into
        (rest / (16.0 * self.same_rest)).floor().to_array().map(|x| x as i64)
    }
}

/// Finds the edges without a neighbour whose normal is the same in their middle.
fn find_creases(parts: &mut [Part<'_>], outlines: &[Vec<Corner>]) {
    let middle = |[from, to]: [Corner; 2]| 0.5 * (from.st + to.st);
    let mut beside: HashMap<[u32; 2], (usize, DVec2)> = HashMap::new();
    for (part, outline) in outlines.iter().enumerate() {
        beside.extend(edges(outline).map(|edge| (edge.map(|corner| corner.vertex), (part, middle(edge)))));
    }
    let normal = |part: &Part<'_>, st: DVec2| part.patch.eval_whole(st).normal();
    let creases: Vec<Vec<[DVec2; 2]>> = parts
        .iter()
        .zip(outlines)
        .map(|(part, outline)| {
            let is_smooth = |edge: [Corner; 2]| {
                let [from, to] = edge.map(|corner| corner.vertex);
                beside.get(&[to, from]).is_some_and(|&(other, st)| {
                    normal(part, middle(edge)).dot(normal(&parts[other], st)) > 1.0 - SMOOTH
                })
            };
            edges(outline).filter(|&edge| !is_smooth(edge)).map(|edge| edge.map(|corner| corner.st)).collect()
        })
        .collect();
    for (part, creases) in parts.iter_mut().zip(creases) {
        part.creases = creases;
    }
}

/// Adds to outlines the corners of others that lie on their edges.
///
/// Pieces that share an edge are cut at the same points of it, but not all are cut: parts outside the lattice's box stay
/// whole where they meet pieces inside, and patches that are halved for the sake of their weights have neighbours that are
/// not. Only edges without a partner can have such corners.
fn insert_corners_on_edges(welder: &Welder, parts: &[Part<'_>], outlines: &mut [Vec<Corner>]) {
    let mut directed = HashSet::new();
    for outline in outlines.iter() {
        directed.extend(edges(outline).map(|[from, to]| [from.vertex, to.vertex]));
    }
    let is_alone = |from: &Corner, to: &Corner| !directed.contains(&[to.vertex, from.vertex]);
    let mut ends: Vec<u32> = outlines
        .iter()
        .flat_map(|outline| edges(outline))
        .filter(|[from, to]| is_alone(from, to))
        .flat_map(|edge| edge.map(|corner| corner.vertex))
        .collect();
    ends.sort_unstable();
    ends.dedup();
    let sorted = SortedPoints::new(welder, &ends);
    for (part, outline) in parts.iter().zip(outlines) {
        if !edges(outline).any(|[from, to]| is_alone(&from, &to)) {
            continue;
        }
        let mut grown = Vec::with_capacity(outline.len());
        for [from, to] in edges(outline) {
            grown.push(from);
            if is_alone(&from, &to) {
                grown.extend(corners_between(welder, &sorted, part, [from, to]));
            }
        }
        *outline = grown;
    }
}

/// Vertices on an edge, from its start to its end.
fn corners_between(
    welder: &Welder,
    sorted: &SortedPoints,
    part: &Part<'_>,
    [from, to]: [Corner; 2],
) -> Vec<Corner> {
    let [a, b] = [from, to].map(|corner| welder.vertices[corner.vertex as usize].rest);
    let along = b - a;
    let mut found: Vec<(f64, Corner)> = Vec::new();
    for vertex in sorted.within(a.min(b) - welder.same_rest, a.max(b) + welder.same_rest) {
        let candidate = welder.vertices[vertex as usize];
        let fraction = (candidate.rest - a).dot(along) / along.length_squared();
        let off = (candidate.rest - (a + fraction * along)).length();
        if vertex == from.vertex || vertex == to.vertex || !(0.0..=1.0).contains(&fraction) {
            continue;
        }
        let st = from.st.lerp(to.st, fraction);
        // a tear: the neighbour has gone elsewhere
        let gap = (part.patch.eval_whole(st).position - candidate.position).length();
        if off <= 2.0 * welder.same_rest && gap <= welder.same_position {
            found.push((fraction, Corner { vertex, st }));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, corner)| corner).collect()
}

/// Vertices in the order of each coordinate of their undeformed places.
struct SortedPoints {
    by_axis: [Vec<(f64, u32)>; 3],
}

impl SortedPoints {
    fn new(welder: &Welder, vertices: &[u32]) -> Self {
        let by_axis = [0, 1, 2].map(|axis| {
            let place = |&vertex: &u32| (welder.vertices[vertex as usize].rest[axis], vertex);
            let mut sorted: Vec<_> = vertices.iter().map(place).collect();
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            sorted
        });
        Self { by_axis }
    }

    /// All in the slab of the box along the axis where it holds fewest.
    fn within(&self, low: DVec3, high: DVec3) -> impl Iterator<Item = u32> {
        let run = |axis: usize| {
            let sorted = &self.by_axis[axis];
            let start = sorted.partition_point(|(x, _)| *x < low[axis]);
            let end = sorted.partition_point(|(x, _)| *x <= high[axis]);
            &sorted[start..end.max(start)]
        };
        let fewest = [run(0), run(1), run(2)].into_iter().min_by_key(|run| run.len()).unwrap_or_default();
        fewest.iter().map(|(_, vertex)| *vertex)
    }
}

/// The edges of a closed outline.
fn edges(outline: &[Corner]) -> impl Iterator<Item = [Corner; 2]> {
    (0..outline.len()).map(|i| [outline[i], outline[(i + 1) % outline.len()]])
}
