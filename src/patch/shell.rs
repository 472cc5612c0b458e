//! The faces of an object, with the numbers of the vertices that they share.

use crate::subdivide::VertexNumbers;

use super::face::Face;

/// The faces of an object and which of their corners are one vertex.
///
/// Corners are the same vertex where the undeformed object has one point: their numbers come from its cutting and are not
/// found again from places. What is made of this, vertices and edges, is its [`Topology`](super::Topology). No ray needs any of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shell {
    faces: Vec<Face>,
    /// The vertices of the corners of the faces' regions, one face after the other.
    vertices: Vec<u32>,
    numbers: VertexNumbers,
}

impl Shell {
    /// The shell of no faces, whose corners will be vertices with the numbers given here.
    pub(crate) fn new(numbers: VertexNumbers) -> Self {
        Self { faces: Vec::new(), vertices: Vec::new(), numbers }
    }

    /// The faces.
    #[must_use]
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// The faces alone.
    #[must_use]
    pub fn into_faces(self) -> Vec<Face> {
        self.faces
    }

    /// The faces, each with the vertices of its corners in the order of [`Region::all_corners`](super::Region::all_corners).
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&Face, &[u32])> {
        let mut start = 0;
        self.faces.iter().map(move |face| {
            let end = start + face.region.all_corners().len();
            let vertices = &self.vertices[start..end];
            start = end;
            (face, vertices)
        })
    }

    pub(crate) const fn numbers(&self) -> &VertexNumbers {
        &self.numbers
    }

    pub(crate) const fn numbers_mut(&mut self) -> &mut VertexNumbers {
        &mut self.numbers
    }

    /// Adds a face with the vertices of its corners.
    pub(crate) fn push(&mut self, face: Face, vertices: &[u32]) {
        debug_assert_eq!(face.region.all_corners().len(), vertices.len(), "each corner is at a vertex");
        self.faces.push(face);
        self.vertices.extend_from_slice(vertices);
    }

    /// Adds the faces of another. Of its vertices with numbers below `first`, `known` says which of these here they are.
    pub(crate) fn append(&mut self, mut other: Self, first: u32, known: impl Fn(u32) -> u32) {
        let moved = self.numbers.append(&other.numbers, first, known);
        self.faces.append(&mut other.faces);
        self.vertices.extend(other.vertices.into_iter().map(moved));
    }

    /// The same shell with each face replaced; regions keep their corners.
    pub(crate) fn map(self, replaced: impl FnMut(Face) -> Face) -> Self {
        Self { faces: self.faces.into_iter().map(replaced).collect(), ..self }
    }

    /// Frees memory that is not used.
    pub(crate) fn shrink(&mut self) {
        self.faces.shrink_to_fit();
        self.vertices.shrink_to_fit();
        self.numbers.shrink();
    }

    /// Memory in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let faces: usize = self.faces.iter().map(Face::bytes).sum();
        faces + size_of_val(&*self.vertices) + self.numbers.bytes()
    }
}

impl From<Vec<Face>> for Shell {
    /// Faces that share nothing.
    fn from(faces: Vec<Face>) -> Self {
        let corners: usize = faces.iter().map(|face| face.region.all_corners().len()).sum();
        let count = u32::try_from(corners).expect("fewer than 2^32 corners fit in memory");
        Self { faces, vertices: (0..count).collect(), numbers: VertexNumbers::new(count) }
    }
}
