//! The deformed objects that are traced.

use std::path::Path;
use std::time::{Duration, Instant};

use glam::{DAffine3, DVec3};
use trimray::mesh::{MeshTolerances, load_obj, prepare_polygons};
use trimray::patch::{Deformation, PlanarPolygon, TrimmedPatch, deform_polygons};
use trimray::spline::{Axis, ControlLattice, SplineVolume};
use trimray::trace::{NoUvs, TracedObject, TracedScene};

use crate::tessellate::uniform;

/// A triangle mesh and the volume that deforms it.
#[derive(Debug)]
pub(crate) struct Object {
    /// "a", "b" or "c".
    pub(crate) name: &'static str,
    /// What it is, for the heading of its tables.
    pub(crate) description: String,
    /// Undeformed vertices.
    pub(crate) vertices: Vec<DVec3>,
    /// Indices into the vertices, counter-clockwise seen from outside.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The deformation.
    pub(crate) volume: SplineVolume,
    /// Lowest and highest corner of the box around the deformed surface, from points on it.
    pub(crate) bounds: [DVec3; 2],
    /// Length of the diagonal of that box: errors are in parts of it.
    pub(crate) diagonal: f64,
}

impl Object {
    /// The unit cube of 12 triangles, degree 2 × 2 × 2, 4 × 4 × 4 control points.
    pub(crate) fn a() -> Result<Self, String> {
        Self::cube("a", 2, 4)
    }

    /// The same, degree 3 × 3 × 3, 6 × 6 × 6 control points.
    pub(crate) fn b() -> Result<Self, String> {
        Self::cube("b", 3, 6)
    }

    fn cube(name: &'static str, degree: usize, points: usize) -> Result<Self, String> {
        let bit = |corner: u32, axis: u32| f64::from(corner >> axis & 1);
        let vertices = (0..8).map(|c| DVec3::new(bit(c, 0), bit(c, 1), bit(c, 2))).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Self::twisted(name, "unit cube", (vertices, triangles), [degree, points], (Axis::Z, 0.35))
    }

    /// A mesh from an OBJ file, degree 3 × 3 × 3, 6 × 6 × 6 control points.
    pub(crate) fn c(path: &Path) -> Result<Self, String> {
        let (mesh, _) = load_obj(path).map_err(|error| error.to_string())?;
        let (polygons, _) = prepare_polygons(&mesh, DAffine3::IDENTITY, MeshTolerances::default());
        let mut triangles = Vec::new();
        for polygon in polygons.iter() {
            let vertex = |corner: usize| mesh.corner(polygon.corners[corner] as usize).position;
            triangles.extend((2..polygon.corners.len()).map(|i| [vertex(0), vertex(i - 1), vertex(i)]));
        }
        let file = path.file_name().map_or_else(Default::default, |name| name.to_string_lossy());
        let mesh = (mesh.positions().to_vec(), triangles);
        Self::twisted("c", &file, mesh, [3, 6], (Axis::Y, 0.25))
    }

    /// Deforms a mesh over its box by a twist of 90° and a bulge.
    fn twisted(
        name: &'static str,
        what: &str,
        (vertices, triangles): (Vec<DVec3>, Vec<[u32; 3]>),
        [degree, points]: [usize; 2],
        (axis, bulge): (Axis, f64),
    ) -> Result<Self, String> {
        let bounds = bounds_of(vertices.iter().copied());
        let mut lattice = ControlLattice::identity([degree; 3], [points; 3], bounds, 0)
            .map_err(|error| error.to_string())?;
        lattice.twist(axis, 90.0);
        lattice.bulge(axis, bulge);
        let volume = lattice.volume().map_err(|error| error.to_string())?;
        let description = format!(
            "{what}, {} triangles, degree {degree} × {degree} × {degree}, {points} × {points} × {points} control points",
            triangles.len()
        );
        let mut object = Self { name, description, vertices, triangles, volume, bounds, diagonal: 0.0 };
        // a few hundred thousand points are enough for a box that only scales errors and frames the view
        let per_side = if object.triangles.len() < 100 { 128 } else { 8 };
        let points = uniform(&object, per_side).vertices;
        object.bounds = bounds_of(points.iter().map(|point| point.as_dvec3()));
        object.diagonal = (object.bounds[1] - object.bounds[0]).length();
        Ok(object)
    }

    /// The corners of an undeformed triangle.
    pub(crate) fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|vertex| self.vertices[vertex as usize])
    }

    /// Cuts, composes and builds: all that precedes the first ray. Also the time it took and the bytes it holds.
    pub(crate) fn build(&self) -> Result<(TracedScene, Duration, usize), String> {
        let corners: Vec<_> = (0..self.triangles.len()).map(|triangle| self.corners(triangle)).collect();
        let polygons: Vec<_> =
            (0..).zip(&corners).map(|(face, corners)| PlanarPolygon { face, corners }).collect();
        let started = Instant::now();
        let deformation = Deformation { volume: Some(&self.volume), ..Default::default() };
        let made = deform_polygons(&polygons, deformation).map_err(|error| error.to_string())?;
        let object = TracedObject { name: self.name.into(), patches: made.patches, uvs: Box::new(NoUvs) };
        let scene = TracedScene::new(vec![object]);
        let elapsed = started.elapsed();
        let patches: usize = scene.objects()[0].patches.iter().map(TrimmedPatch::bytes).sum();
        let acceleration = scene.acceleration().bytes;
        Ok((scene, elapsed, patches + acceleration))
    }
}

/// Lowest and highest corner of the box around points.
pub(crate) fn bounds_of(points: impl Iterator<Item = DVec3>) -> [DVec3; 2] {
    points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
}
