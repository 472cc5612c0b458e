//! Polygon meshes as files have them.

use glam::{DVec2, DVec3};
use thiserror::Error;

use super::material::MeshMaterial;

/// Marks a corner without texture coordinates or normal in the flat arrays.
pub(super) const NONE: u32 = u32::MAX;

/// One corner of a face: what it refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Corner {
    /// Index into the positions.
    pub position: u32,
    /// Index into the texture coordinates.
    pub uv: Option<u32>,
    /// Index into the normals.
    pub normal: Option<u32>,
}

/// The pieces that [`PolygonMesh::try_new`] checks and puts together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshParts {
    /// Positions of the vertices.
    pub positions: Vec<DVec3>,
    /// Texture coordinates.
    pub uvs: Vec<DVec2>,
    /// Vertex normals, of any length.
    pub normals: Vec<DVec3>,
    /// Corners of all faces, face after face.
    pub corners: Vec<Corner>,
    /// Number of corners of each face, at least 3.
    pub arities: Vec<u32>,
    /// Index of each face's object in `object_names`.
    pub face_objects: Vec<u32>,
    /// Names of the objects (or groups).
    pub object_names: Vec<String>,
    /// The material of each face: its place in `material_names`, counted from 1, or 0 for none; empty if no face has one.
    pub face_materials: Vec<u32>,
    /// Names of materials.
    pub material_names: Vec<String>,
    /// Names of the files that define them.
    pub material_libraries: Vec<String>,
    /// Those that the mesh's own file defines.
    pub materials: Vec<MeshMaterial>,
}

/// The pieces of a mesh array by array, as a [`PolygonMesh`] keeps them: large files are read into these.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MeshColumns {
    pub(super) positions: Vec<DVec3>,
    pub(super) uvs: Vec<DVec2>,
    pub(super) normals: Vec<DVec3>,
    /// Index of each corner's position.
    pub(super) corner_positions: Vec<u32>,
    pub(super) corner_uvs: References,
    pub(super) corner_normals: References,
    /// Face `i` has the corners `face_starts[i]..face_starts[i + 1]`; the first is 0.
    pub(super) face_starts: Vec<u32>,
    /// As [`MeshParts::face_objects`], or empty if all faces are of the first object.
    pub(super) face_objects: Vec<u32>,
    pub(super) object_names: Vec<String>,
    /// See [`MeshParts`].
    pub(super) face_materials: Vec<u32>,
    pub(super) material_names: Vec<String>,
    pub(super) material_libraries: Vec<String>,
    pub(super) materials: Vec<MeshMaterial>,
}

/// Which texture coordinates, or which normals, the corners have.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) enum References {
    /// None.
    #[default]
    Absent,
    /// Those of the same index as their positions.
    AsPositions,
    /// These, corner by corner, or [`NONE`].
    Own(Vec<u32>),
}

impl References {
    /// What the corner of this number refers to, which has this position.
    fn get(&self, corner: usize, position: u32) -> Option<u32> {
        match self {
            Self::Absent => None,
            Self::AsPositions => Some(position),
            Self::Own(indices) => Some(indices[corner]).filter(|&index| index != NONE),
        }
    }
}

/// Why pieces do not make a mesh; faces and corners are counted from 0.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum MeshError {
    /// A coordinate is NaN or infinite.
    #[error("{what} {index} is not finite")]
    NotFinite {
        /// "position", "uv" or "normal".
        what: &'static str,
        /// Its index.
        index: usize,
    },
    /// A face has fewer than three corners.
    #[error("face {face} has {arity} corners, at least 3 are needed")]
    TooFewCorners {
        /// Index of the face.
        face: usize,
        /// How many corners it has.
        arity: u32,
    },
    /// An index points beyond its array.
    #[error("corner {corner} refers to {what} {index}, but there are {count}")]
    OutOfRange {
        /// Index of the corner over all faces.
        corner: usize,
        /// "position", "uv" or "normal".
        what: &'static str,
        /// The index given.
        index: u32,
        /// How many there are.
        count: usize,
    },
    /// A face belongs to an object that has no name.
    #[error("face {face} belongs to object {object}, but there are {count}")]
    UnknownObject {
        /// Index of the face.
        face: usize,
        /// The object given.
        object: u32,
        /// How many there are.
        count: usize,
    },
    /// A face has a material that has no name.
    #[error("face {face} has material {material}, but there are {count}")]
    UnknownMaterial {
        /// Index of the face.
        face: usize,
        /// The material given, counted from 1.
        material: u32,
        /// How many there are.
        count: usize,
    },
    /// There are materials for more or fewer faces than there are.
    #[error("{materials} materials for {faces} faces")]
    MaterialCount {
        /// Materials given.
        materials: usize,
        /// Number of faces.
        faces: usize,
    },
    /// The arrays do not fit together in length.
    #[error(
        "{corners} corners and {objects} object indices for faces with {expected} corners in {faces} faces"
    )]
    Lengths {
        /// Corners given.
        corners: usize,
        /// Object indices given.
        objects: usize,
        /// Sum of the arities.
        expected: u64,
        /// Number of arities.
        faces: usize,
    },
    /// More elements than 32-bit indices can name.
    #[error("more than {} corners, positions, uvs or normals", u32::MAX - 1)]
    TooLarge,
}

/// Vertices and polygonal faces; faces keep the order they have in the file.
///
/// Valid by construction: every coordinate is finite, every index in range, every face has at least three corners.
/// Faces need be neither planar nor simple: see [`prepare_polygons`](super::prepare_polygons).
#[derive(Clone, Debug, PartialEq)]
pub struct PolygonMesh {
    columns: MeshColumns,
}

/// One face of a [`PolygonMesh`].
#[derive(Clone, Copy, Debug)]
pub struct Face<'a> {
    mesh: &'a PolygonMesh,
    index: u32,
    start: usize,
    end: usize,
}

impl PolygonMesh {
    /// Checks the pieces and puts them together.
    ///
    /// # Errors
    /// The first [`MeshError`] that applies.
    pub fn try_new(parts: MeshParts) -> Result<Self, MeshError> {
        check_sizes(&parts)?;
        let mut face_starts = Vec::with_capacity(parts.arities.len() + 1);
        let mut start = 0;
        face_starts.push(start);
        for arity in &parts.arities {
            start += arity;
            face_starts.push(start);
        }
        let column = |index: fn(&Corner) -> Option<u32>| {
            if parts.corners.iter().all(|corner| index(corner).is_none()) {
                return References::Absent;
            }
            References::Own(parts.corners.iter().map(|corner| index(corner).unwrap_or(NONE)).collect())
        };
        Self::from_columns(MeshColumns {
            corner_positions: parts.corners.iter().map(|corner| corner.position).collect(),
            corner_uvs: column(|corner| corner.uv),
            corner_normals: column(|corner| corner.normal),
            positions: parts.positions,
            uvs: parts.uvs,
            normals: parts.normals,
            face_starts,
            face_objects: parts.face_objects,
            object_names: parts.object_names,
            face_materials: parts.face_materials,
            material_names: parts.material_names,
            material_libraries: parts.material_libraries,
            materials: parts.materials,
        })
    }

    /// Checks the pieces; `face_starts` must rise to the number of corners.
    ///
    /// # Errors
    /// The first [`MeshError`] that applies.
    pub(super) fn from_columns(columns: MeshColumns) -> Result<Self, MeshError> {
        let sizes = [
            columns.corner_positions.len(),
            columns.positions.len(),
            columns.uvs.len(),
            columns.normals.len(),
        ];
        if sizes.iter().any(|&size| size >= NONE as usize) {
            return Err(MeshError::TooLarge);
        }
        check_finite(&columns)?;
        check_faces(&columns)?;
        check_corners(&columns)?;
        Ok(Self { columns })
    }

    /// Positions of the vertices.
    #[must_use]
    pub fn positions(&self) -> &[DVec3] {
        &self.columns.positions
    }

    /// Texture coordinates, empty where the mesh has none.
    #[must_use]
    pub fn uvs(&self) -> &[DVec2] {
        &self.columns.uvs
    }

    /// Vertex normals as the file has them, of any length; empty where the mesh has none.
    #[must_use]
    pub fn normals(&self) -> &[DVec3] {
        &self.columns.normals
    }

    /// Names of the objects (or groups) that have faces, in the order of their first face.
    #[must_use]
    pub fn object_names(&self) -> &[String] {
        &self.columns.object_names
    }

    /// Names of the materials that the file uses, in the order of their first use.
    #[must_use]
    pub fn material_names(&self) -> &[String] {
        &self.columns.material_names
    }

    /// Names of the files that define the materials, as the mesh's file gives them.
    #[must_use]
    pub fn material_libraries(&self) -> &[String] {
        &self.columns.material_libraries
    }

    /// The materials that the mesh's own file defines.
    #[must_use]
    pub fn materials(&self) -> &[MeshMaterial] {
        &self.columns.materials
    }

    /// Number of faces.
    #[must_use]
    pub fn face_count(&self) -> usize {
        self.columns.face_starts.len().saturating_sub(1)
    }

    /// Number of corners of all faces.
    #[must_use]
    pub fn corner_count(&self) -> usize {
        self.columns.corner_positions.len()
    }

    /// Number of triangles that the faces make when fanned.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.corner_count() - 2 * self.face_count()
    }

    /// Whether any corner has texture coordinates.
    #[must_use]
    pub fn has_uvs(&self) -> bool {
        self.columns.corner_uvs != References::Absent
    }

    /// Whether any corner has a normal.
    #[must_use]
    pub fn has_normals(&self) -> bool {
        self.columns.corner_normals != References::Absent
    }

    /// The face of index `face`.
    ///
    /// # Panics
    /// If there is no such face.
    #[must_use]
    pub fn face(&self, face: u32) -> Face<'_> {
        let index = face as usize;
        Face {
            mesh: self,
            index: face,
            start: self.columns.face_starts[index] as usize,
            end: self.columns.face_starts[index + 1] as usize,
        }
    }

    /// All faces in order.
    pub fn faces(&self) -> impl ExactSizeIterator<Item = Face<'_>> {
        let mut next = 0;
        self.columns.face_starts.windows(2).map(move |range| {
            let index = next;
            next += 1;
            Face { mesh: self, index, start: range[0] as usize, end: range[1] as usize }
        })
    }

    /// What corner `corner` (counted over all faces) refers to.
    ///
    /// # Panics
    /// If there is no such corner.
    #[must_use]
    pub fn corner(&self, corner: usize) -> Corner {
        let position = self.columns.corner_positions[corner];
        Corner {
            position,
            uv: self.columns.corner_uvs.get(corner, position),
            normal: self.columns.corner_normals.get(corner, position),
        }
    }
}

impl<'a> Face<'a> {
    /// Index of the face within its mesh.
    #[must_use]
    pub fn index(&self) -> u32 {
        self.index
    }

    /// Index of the face's object in [`PolygonMesh::object_names`].
    #[must_use]
    pub fn object(&self) -> u32 {
        self.mesh.columns.face_objects.get(self.index as usize).copied().unwrap_or(0)
    }

    /// Index of the face's material in [`PolygonMesh::material_names`], if it has one.
    #[must_use]
    pub fn material(&self) -> Option<u32> {
        self.mesh.columns.face_materials.get(self.index as usize)?.checked_sub(1)
    }

    /// Number of corners, at least 3.
    #[must_use]
    pub fn arity(&self) -> usize {
        self.end - self.start
    }

    /// The corners' numbers, for [`PolygonMesh::corner`].
    #[must_use]
    pub fn corner_range(&self) -> std::ops::Range<usize> {
        self.start..self.end
    }

    /// The corners in the order of the file.
    pub fn corners(&self) -> impl ExactSizeIterator<Item = Corner> + use<'a> {
        let mesh = self.mesh;
        self.corner_range().map(move |corner| mesh.corner(corner))
    }
}

fn check_sizes(parts: &MeshParts) -> Result<(), MeshError> {
    if parts.corners.len() >= NONE as usize {
        return Err(MeshError::TooLarge);
    }
    let expected = parts.arities.iter().map(|&arity| u64::from(arity)).sum();
    if parts.corners.len() as u64 != expected || parts.face_objects.len() != parts.arities.len() {
        return Err(MeshError::Lengths {
            corners: parts.corners.len(),
            objects: parts.face_objects.len(),
            expected,
            faces: parts.arities.len(),
        });
    }
    Ok(())
}

fn check_finite(columns: &MeshColumns) -> Result<(), MeshError> {
    let faults = [
        ("position", columns.positions.iter().position(|p| !p.is_finite())),
        ("uv", columns.uvs.iter().position(|uv| !uv.is_finite())),
        ("normal", columns.normals.iter().position(|n| !n.is_finite())),
    ];
    for (what, found) in faults {
        if let Some(index) = found {
            return Err(MeshError::NotFinite { what, index });
        }
    }
    Ok(())
}

fn check_faces(columns: &MeshColumns) -> Result<(), MeshError> {
    let mut arities = columns.face_starts.windows(2).map(|range| range[1] - range[0]);
    if let Some(face) = arities.position(|arity| arity < 3) {
        let arity = columns.face_starts[face + 1] - columns.face_starts[face];
        return Err(MeshError::TooFewCorners { face, arity });
    }
    let count = columns.object_names.len();
    // without a list all faces are of the first object
    let objects = if columns.face_objects.is_empty() { &[0] } else { columns.face_objects.as_slice() };
    if let Some(face) = objects.iter().position(|&object| object as usize >= count) {
        return Err(MeshError::UnknownObject { face, object: objects[face], count });
    }
    let (materials, faces) = (columns.face_materials.len(), columns.face_starts.len().saturating_sub(1));
    if materials != 0 && materials != faces {
        return Err(MeshError::MaterialCount { materials, faces });
    }
    let count = columns.material_names.len();
    if let Some(face) = columns.face_materials.iter().position(|&material| material as usize > count) {
        let material = columns.face_materials[face];
        return Err(MeshError::UnknownMaterial { face, material, count });
    }
    Ok(())
}

fn check_corners(columns: &MeshColumns) -> Result<(), MeshError> {
    let counts = [columns.positions.len(), columns.uvs.len(), columns.normals.len()];
    for (corner, &position) in columns.corner_positions.iter().enumerate() {
        let indices = [
            ("position", Some(position)),
            ("uv", columns.corner_uvs.get(corner, position)),
            ("normal", columns.corner_normals.get(corner, position)),
        ];
        for ((what, index), count) in indices.into_iter().zip(counts) {
            if let Some(index) = index.filter(|&index| index as usize >= count) {
                return Err(MeshError::OutOfRange { corner, what, index, count });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(position: u32) -> Corner {
        Corner { position, uv: None, normal: None }
    }

    fn parts() -> MeshParts {
        MeshParts {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::ONE],
            uvs: vec![DVec2::ONE],
            corners: [0, 1, 2, 0, 1, 3, 2].map(corner).to_vec(),
            arities: vec![3, 4],
            face_objects: vec![0, 0],
            object_names: vec!["a".into()],
            ..MeshParts::default()
        }
    }

    #[test]
    fn faces_are_runs_of_corners() {
        let mut parts = parts();
        parts.corners[4].uv = Some(0);
        let mesh = PolygonMesh::try_new(parts).unwrap();
        assert_eq!((mesh.face_count(), mesh.corner_count(), mesh.triangle_count()), (2, 7, 3));
        let quad: Vec<_> = mesh.face(1).corners().collect();
        assert_eq!(quad.iter().map(|c| c.position).collect::<Vec<_>>(), [0, 1, 3, 2]);
        assert_eq!(quad.iter().map(|c| c.uv).collect::<Vec<_>>(), [None, Some(0), None, None]);
        assert!(mesh.has_uvs() && !mesh.has_normals());
        assert_eq!(mesh.faces().map(|f| f.arity()).collect::<Vec<_>>(), [3, 4]);
        assert_eq!(mesh.object_names()[mesh.face(1).object() as usize], "a");
    }

    #[test]
    fn faulty_parts_are_refused() {
        type Spoil = fn(&mut MeshParts);
        let cases: [(Spoil, &str); 9] = [
            (|p| p.face_materials = vec![0], "1 materials for 2 faces"),
            (|p| p.face_materials = vec![0, 1], "face 1 has material 1, but there are 0"),
            (|p| p.positions[2].y = f64::NAN, "position 2 is not finite"),
            (|p| p.uvs[0].x = f64::INFINITY, "uv 0 is not finite"),
            (|p| p.arities = vec![2, 5], "face 0 has 2 corners, at least 3 are needed"),
            (|p| p.corners[3].position = 4, "corner 3 refers to position 4, but there are 4"),
            (|p| p.corners[0].uv = Some(1), "corner 0 refers to uv 1, but there are 1"),
            (|p| p.face_objects[1] = 1, "face 1 belongs to object 1, but there are 1"),
            (
                |p| p.arities = vec![3, 3],
                "7 corners and 2 object indices for faces with 6 corners in 2 faces",
            ),
        ];
        for (spoil, message) in cases {
            let mut parts = parts();
            spoil(&mut parts);
            let error = PolygonMesh::try_new(parts).expect_err(message);
            assert_eq!(error.to_string(), message);
        }
    }
}
