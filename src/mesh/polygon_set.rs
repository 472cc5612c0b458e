//! Planar convex polygons, the form in which meshes are cut and deformed.

use glam::{DVec2, DVec3};

/// Convex planar polygons without area zero, each from one face of a mesh.
///
/// Made by [`prepare_polygons`](super::prepare_polygons). "Convex" and "planar" hold to the tolerance given there;
/// corners on a straight edge are kept, since a neighbour may end there.
#[derive(Clone, Debug, PartialEq)]
pub struct PolygonSet {
    /// Polygon `i` has the corners `starts[i]..starts[i + 1]`.
    starts: Vec<u32>,
    faces: Vec<u32>,
    normals: Vec<DVec3>,
    positions: Vec<DVec3>,
    /// As long as `positions`, or empty where the mesh has none.
    uvs: Vec<DVec2>,
    /// Corner numbers within the mesh, as long as `positions`.
    corners: Vec<u32>,
}

/// One polygon of a [`PolygonSet`]; it winds counter-clockwise seen from where its normal points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polygon<'a> {
    /// Index of the mesh's face that it comes from.
    pub face: u32,
    /// Unit normal: that of the whole face (Newell) where the face is planar, else the triangle's own.
    pub normal: DVec3,
    /// Positions of the corners, at least 3.
    pub positions: &'a [DVec3],
    /// Texture coordinates of the corners, NaN at a corner without; empty where the mesh has none at all.
    pub uvs: &'a [DVec2],
    /// Corner numbers, for [`PolygonMesh::corner`](super::PolygonMesh::corner).
    pub corners: &'a [u32],
}

impl Default for PolygonSet {
    fn default() -> Self {
        Self {
            starts: vec![0],
            faces: Vec::new(),
            normals: Vec::new(),
            positions: Vec::new(),
            uvs: Vec::new(),
            corners: Vec::new(),
        }
    }
}

impl PolygonSet {
    /// Appends a polygon; `uvs` is empty for all polygons of a set or for none.
    pub(super) fn push(&mut self, polygon: Polygon<'_>) {
        debug_assert!(polygon.positions.len() >= 3, "a polygon has at least three corners");
        debug_assert!(polygon.normal.is_finite(), "the normal of a polygon is finite");
        self.faces.push(polygon.face);
        self.normals.push(polygon.normal);
        self.positions.extend_from_slice(polygon.positions);
        self.uvs.extend_from_slice(polygon.uvs);
        self.corners.extend_from_slice(polygon.corners);
        let end = u32::try_from(self.positions.len()).expect("fewer than three times the corners of a mesh");
        self.starts.push(end);
    }

    /// Number of polygons.
    #[must_use]
    pub fn len(&self) -> usize {
        self.faces.len()
    }

    /// Whether there are no polygons.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// Number of corners of all polygons.
    #[must_use]
    pub fn corner_count(&self) -> usize {
        self.positions.len()
    }

    /// The polygon of index `polygon`.
    ///
    /// # Panics
    /// If there is no such polygon.
    #[must_use]
    pub fn polygon(&self, polygon: usize) -> Polygon<'_> {
        let range = self.starts[polygon] as usize..self.starts[polygon + 1] as usize;
        Polygon {
            face: self.faces[polygon],
            normal: self.normals[polygon],
            positions: &self.positions[range.clone()],
            uvs: self.uvs.get(range.clone()).unwrap_or_default(),
            corners: &self.corners[range],
        }
    }

    /// All polygons, in the order of the faces they come from.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Polygon<'_>> {
        (0..self.len()).map(|polygon| self.polygon(polygon))
    }

    /// Least and greatest coordinates of all corners; `None` if there are no polygons.
    #[must_use]
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let (first, rest) = self.positions.split_first()?;
        Some(rest.iter().fold([*first; 2], |[low, high], &p| [low.min(p), high.max(p)]))
    }
}
