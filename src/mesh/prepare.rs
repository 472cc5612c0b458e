//! Faces of a mesh to convex planar polygons in the world.

use glam::{DAffine3, DVec2, DVec3};

use super::mend::triangulate_mended;
use super::polygon_set::Polygon;
use super::triangulate::{MOST_SEARCHED, NoEar, clip_ears, crosses_itself, is_convex};
use super::{Face, MeshNotes, PolygonMesh, PolygonSet};

/// Farthest that a vertex of a planar face may lie from the face's plane, relative to the mesh's diagonal.
///
/// Ten thousand times the rounding of a rotation; the later cutting along knot planes snaps vertices by as much. Larger
/// would bend faces noticeably in an exact method, smaller would triangulate flat faces that were only turned.
const PLANARITY: f64 = 1e-10;

/// Least area of a face relative to its perimeter and the mesh's diagonal: about half the height of a sliver.
///
/// Below it the direction of the normal is rounding noise, and what is left out is as thin as the margins of rays: a sliver that
/// is wider would leave a hole between its neighbours.
const AREA: f64 = 1e-15;

/// What counts as planar and as area zero, in parts of the mesh's bounding box diagonal after placing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshTolerances {
    /// Farthest that a vertex of a planar face may lie from the face's plane (default 1e-10).
    pub planarity: f64,
    /// Least ratio of a face's area to its perimeter (default 1e-15).
    pub area: f64,
}

impl Default for MeshTolerances {
    fn default() -> Self {
        Self { planarity: PLANARITY, area: AREA }
    }
}

/// Places a mesh by `transform` and makes convex planar polygons of its faces.
///
/// - Planar convex faces stay whole, with the corners on their straight edges.
/// - Planar concave faces are cut into triangles by ear clipping; all get the face's normal.
/// - Faces that lie in no plane (by [`MeshTolerances::planarity`]) are cut into triangles as well: quads along the
///   shorter diagonal (where the quad is concave seen along its mean normal: along the one that is inside), others by ear
///   clipping in their mean plane (Newell).
/// - Faces whose outline crosses itself by rounding (a hole's slit, up to 1e-3 of the face) are cut as if it touched itself.
/// - Faces whose outline crosses itself by more are cut into a fan of triangles from their first corner, as renderers do, so that
///   no hole opens beside their neighbours.
/// - Faces without area, or with a position that `transform` makes infinite, are left out.
///
/// A corner at the same place as the one before is dropped. The notes count all of this.
#[must_use]
pub fn prepare_polygons(
    mesh: &PolygonMesh,
    transform: DAffine3,
    tolerances: MeshTolerances,
) -> (PolygonSet, MeshNotes) {
    let placed: Vec<_> = mesh.positions().iter().map(|&p| transform.transform_point3(p)).collect();
    let mut preparation = Preparation::new(mesh, &placed, tolerances);
    let mut outline = Outline::default();
    for face in mesh.faces() {
        preparation.face(face, &mut outline);
    }
    let mut notes = preparation.notes;
    notes.faces = mesh.face_count();
    notes.triangles = mesh.triangle_count();
    notes.positions = mesh.positions().len();
    notes.polygons = preparation.polygons.len();
    (preparation.polygons, notes)
}

/// Corners of one face, repeated ones left out.
#[derive(Default)]
struct Outline {
    /// Corner numbers within the mesh.
    corners: Vec<u32>,
    /// Where they are, divided by [`Preparation::unit`].
    scaled: Vec<DVec3>,
}

/// What the shape of a face asks for.
enum Shape {
    /// All vertices on a line, or fewer than three.
    Degenerate,
    Convex {
        normal: DVec3,
    },
    Concave {
        normal: DVec3,
        triangles: Vec<[usize; 3]>,
        mended: bool,
    },
    NonPlanar {
        triangles: Vec<[usize; 3]>,
        mended: bool,
    },
    Crossing,
}

struct Preparation<'a> {
    mesh: &'a PolygonMesh,
    placed: &'a [DVec3],
    /// A power of two next to the mesh's largest coordinate: dividing by it is exact and keeps products finite.
    unit: f64,
    /// In units of `unit`.
    planarity: f64,
    /// In units of `unit`.
    area: f64,
    polygons: PolygonSet,
    notes: MeshNotes,
}

impl<'a> Preparation<'a> {
    fn new(mesh: &'a PolygonMesh, placed: &'a [DVec3], tolerances: MeshTolerances) -> Self {
        let finite = || placed.iter().filter(|p| p.is_finite());
        let unit = power_of_two(finite().fold(0.0, |size: f64, p| size.max(p.abs().max_element())));
        let start = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let [low, high] = finite().fold(start, |[low, high], &p| [low.min(p / unit), high.max(p / unit)]);
        let diagonal = (high - low).length();
        Self {
            mesh,
            placed,
            unit,
            planarity: tolerances.planarity * diagonal,
            area: tolerances.area * diagonal,
            polygons: PolygonSet::default(),
            notes: MeshNotes::default(),
        }
    }

    fn face(&mut self, face: Face<'_>, outline: &mut Outline) {
        self.collect(face, outline);
        let index = face.index();
        match self.shape(&outline.scaled) {
            Shape::Degenerate => self.notes.degenerate_faces.push(index),
            Shape::Convex { normal } => self.push(index, normal, &outline.corners),
            Shape::Concave { normal, triangles, mended } => {
                self.notes.triangulated_concave += 1;
                self.notes.mended_faces += usize::from(mended);
                for triangle in triangles {
                    self.push(index, normal, &triangle.map(|i| outline.corners[i]));
                }
            }
            Shape::NonPlanar { triangles, mended } => {
                self.notes.triangulated_nonplanar += 1;
                self.notes.mended_faces += usize::from(mended);
                self.push_triangles(index, &triangles, outline);
            }
            Shape::Crossing => {
                let before = self.polygons.len();
                let fan: Vec<_> = (2..outline.corners.len()).map(|i| [0, i - 1, i]).collect();
                self.push_triangles(index, &fan, outline);
                // an outline that goes along edges and back has no area after all
                if self.polygons.len() > before {
                    self.notes.self_intersecting_faces.push(index);
                } else {
                    self.notes.degenerate_faces.push(index);
                }
            }
        }
    }

    /// Fills `outline` with the face's corners, without those that repeat the one before.
    fn collect(&mut self, face: Face<'_>, outline: &mut Outline) {
        outline.corners.clear();
        outline.scaled.clear();
        for corner in face.corner_range() {
            let p = self.placed[self.mesh.corner(corner).position as usize] / self.unit;
            if outline.scaled.last() != Some(&p) {
                outline.scaled.push(p);
                let number = u32::try_from(corner).expect("a mesh has fewer than 2^32 corners");
                outline.corners.push(number);
            }
        }
        while outline.scaled.len() > 1 && outline.scaled.first() == outline.scaled.last() {
            outline.scaled.pop();
            outline.corners.pop();
        }
        self.notes.repeated_corners += face.arity() - outline.corners.len();
    }

    fn shape(&self, points: &[DVec3]) -> Shape {
        let finite = points.iter().all(|p| p.is_finite());
        if points.len() < 3 || !finite || self.is_line(points) {
            return Shape::Degenerate;
        }
        let area_vector = newell(points);
        let perimeter: f64 = edges(points).map(|[a, b]| a.distance(b)).sum();
        let large = area_vector.length() > self.area * perimeter;
        if points.len() == 3 {
            let normal = area_vector.normalize_or_zero();
            return if large { Shape::Convex { normal } } else { Shape::Degenerate };
        }
        if !large {
            // not on a line, and yet no area: the parts of a bow-tie cancel out
            return Shape::Crossing;
        }
        let normal = area_vector.normalize();
        let centre = points.iter().sum::<DVec3>() / points.len() as f64;
        let distance = points.iter().map(|&p| (p - centre).dot(normal).abs()).fold(0.0, f64::max);
        if distance <= self.planarity { self.planar(points, normal) } else { nonplanar(points, normal) }
    }

    fn planar(&self, points: &[DVec3], normal: DVec3) -> Shape {
        let flat = along_main_axis(points, normal);
        if is_convex(&flat) || self.is_nearly_convex(points, &flat) {
            return Shape::Convex { normal };
        }
        match triangulate(&flat) {
            Triangulation::Simple(triangles) => Shape::Concave { normal, triangles, mended: false },
            Triangulation::Mended(triangles) => Shape::Concave { normal, triangles, mended: true },
            Triangulation::Crossing => Shape::Crossing,
        }
    }

    /// Whether the polygon is convex but for vertices that rounding pushed inwards from a straight edge.
    ///
    /// Such vertices lie between their neighbours and within the planarity tolerance of the line through them; the rest
    /// must be convex exactly.
    fn is_nearly_convex(&self, points: &[DVec3], flat: &[DVec2]) -> bool {
        let n = points.len();
        let on_edge = |i: usize| {
            let (a, p, b) = (points[(i + n - 1) % n], points[i], points[(i + 1) % n]);
            let line = b - a;
            let height = (p - a).cross(line).length();
            height <= self.planarity * line.length() && (p - a).dot(b - p) > 0.0
        };
        let rest: Vec<_> = (0..n).filter(|&i| !on_edge(i)).map(|i| flat[i]).collect();
        rest.len() >= 3 && rest.len() < n && is_convex(&rest)
    }

    /// Whether all points lie on a line, to the tolerance of areas.
    fn is_line(&self, points: &[DVec3]) -> bool {
        let from = points[0];
        let far =
            points.iter().map(|&p| p - from).max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        let Some(direction) = far.and_then(DVec3::try_normalize) else {
            return true;
        };
        points.iter().all(|&p| (p - from).cross(direction).length() <= self.area)
    }

    /// Triangles with a normal each; those of no area are left out.
    fn push_triangles(&mut self, face: u32, triangles: &[[usize; 3]], outline: &Outline) {
        for triangle in triangles {
            let points = triangle.map(|i| outline.scaled[i]);
            let area_vector = newell(&points);
            let perimeter: f64 = edges(&points).map(|[a, b]| a.distance(b)).sum();
            if area_vector.length() > self.area * perimeter {
                self.push(face, area_vector.normalize(), &triangle.map(|i| outline.corners[i]));
            }
        }
    }

    fn push(&mut self, face: u32, normal: DVec3, corners: &[u32]) {
        let refs = || corners.iter().map(|&corner| self.mesh.corner(corner as usize));
        let positions: Vec<_> = refs().map(|corner| self.placed[corner.position as usize]).collect();
        let uvs: Vec<_> = match self.mesh.has_uvs() {
            true => {
                refs().map(|corner| corner.uv.map_or(DVec2::NAN, |uv| self.mesh.uvs()[uv as usize])).collect()
            }
            false => Vec::new(),
        };
        self.polygons.push(Polygon { face, normal, positions: &positions, uvs: &uvs, corners });
    }
}

/// Cuts a face that lies in no plane; `normal` is that of its mean plane.
fn nonplanar(points: &[DVec3], normal: DVec3) -> Shape {
    let (s, t) = normal.any_orthonormal_pair();
    let (s, t) = if s.cross(t).dot(normal) < 0.0 { (t, s) } else { (s, t) };
    let flat: Vec<_> = points.iter().map(|&p| DVec2::new(p.dot(s), p.dot(t))).collect();
    if points.len() == 4 && is_convex(&flat) {
        let triangles = if points[0].distance(points[2]) <= points[1].distance(points[3]) {
            vec![[0, 1, 2], [0, 2, 3]]
        } else {
            vec![[1, 2, 3], [1, 3, 0]]
        };
        return Shape::NonPlanar { triangles, mended: false };
    }
    match triangulate(&flat) {
        Triangulation::Simple(triangles) => Shape::NonPlanar { triangles, mended: false },
        Triangulation::Mended(triangles) => Shape::NonPlanar { triangles, mended: true },
        Triangulation::Crossing => Shape::Crossing,
    }
}

/// What a plane outline is cut into.
enum Triangulation {
    /// Its triangles.
    Simple(Vec<[usize; 3]>),
    /// The triangles of an outline that crosses itself by rounding alone.
    Mended(Vec<[usize; 3]>),
    /// It crosses itself, or winds clockwise.
    Crossing,
}

fn triangulate(flat: &[DVec2]) -> Triangulation {
    let crosses = flat.len() <= MOST_SEARCHED && crosses_itself(flat);
    let triangles = if crosses { Err(NoEar) } else { clip_ears(flat) };
    match triangles {
        Ok(triangles) => Triangulation::Simple(triangles),
        Err(NoEar) => triangulate_mended(flat).map_or(Triangulation::Crossing, Triangulation::Mended),
    }
}

/// Area vector of a closed polygon: its length is the area, its direction the normal (Newell's formula).
fn newell(points: &[DVec3]) -> DVec3 {
    // relative to a vertex, so that a place far from the origin costs no digits
    let origin = points[0];
    edges(points).map(|[a, b]| (a - origin).cross(b - origin)).sum::<DVec3>() * 0.5
}

fn edges(points: &[DVec3]) -> impl Iterator<Item = [DVec3; 2]> {
    let ends = points.iter().cycle().skip(1);
    points.iter().zip(ends).map(|(&a, &b)| [a, b])
}

/// The points without the coordinate in which the normal is longest, so that they wind counter-clockwise; no rounding.
fn along_main_axis(points: &[DVec3], normal: DVec3) -> Vec<DVec2> {
    let size = normal.abs();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let (mut first, mut second) = ((axis + 1) % 3, (axis + 2) % 3);
    if normal[axis] < 0.0 {
        (first, second) = (second, first);
    }
    points.iter().map(|p| DVec2::new(p[first], p[second])).collect()
}

/// The power of two at or below a positive number, kept so far from the ends of the range that dividing by it is exact.
fn power_of_two(size: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    f64::from_bits(size.clamp(1e-290, 1e290).to_bits() & EXPONENT)
}

#[cfg(test)]
mod tests;
