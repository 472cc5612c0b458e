//! Why an object cannot be built.

use glam::DVec3;
use thiserror::Error;

use super::deformer::EditError;
use crate::analytic::{CoverError, MAX_FIELDS};
use crate::math::bernstein::MAX_DEGREE;
use crate::math::magnitude::MagnitudeError;
use crate::memory::OutOfMemory;
use crate::patch::BuildError;
use crate::spline::VolumeError;
use crate::tessellate::TessellateError;

/// Why an object cannot be built. Deformers and edits are numbered from 0.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ModelError {
    /// Nothing of the shape is left to trace.
    #[error("no face has an area")]
    NoArea,
    /// [`Attributes::texture_coordinates`](super::Attributes::texture_coordinates) are asked for where there are none.
    #[error("face {face} has no texture coordinates")]
    NoTextureCoordinates {
        /// The first such face.
        face: u32,
    },
    /// [`Attributes::vertex_normals`](super::Attributes::vertex_normals) are asked for where there are none.
    #[error("has no normals (vn), which normals = \"vertex\" needs; normals = \"face\" needs none")]
    NoNormals,
    /// A representation of polygons is asked of a surface.
    #[error("a surface has no triangles: valid are exact and adaptive:TOL")]
    NeedsPolygons,
    /// A deformer of surfaces stands before polygons.
    #[error("{name} functions deform surfaces, and this object is a mesh")]
    NeedsSurface {
        /// Index of the deformer.
        deformer: usize,
        /// What it is called.
        name: &'static str,
    },
    /// Too many deformers take derivatives of the surface.
    #[error("more than {MAX_FIELDS} deformations of one object follow a normal or tangents")]
    TooManyFields {
        /// Index of the first that is too many.
        deformer: usize,
    },
    /// A lattice that is no volume, before or after its edits.
    #[error("{source}")]
    Lattice {
        /// Index of the deformer.
        deformer: usize,
        /// What is wrong.
        source: VolumeError,
    },
    /// The object, as it is placed or after a deformer, or a lattice's box is too large or too small.
    #[error("{source}")]
    Magnitude {
        /// Index of the deformer; none before the first.
        deformer: Option<usize>,
        /// What is wrong.
        source: MagnitudeError,
    },
    /// There is too little memory for the object.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
    /// A lattice that takes all of the object to one point.
    #[error("the lattice collapses to a point: all its control points that act on the object are at {place}")]
    Collapsed {
        /// Index of the deformer.
        deformer: usize,
        /// The point.
        place: DVec3,
    },
    /// An edit of a lattice.
    #[error("{source}")]
    Edit {
        /// Index of the deformer.
        deformer: usize,
        /// Index of the edit among the lattice's.
        edit: usize,
        /// What is wrong.
        source: EditError,
    },
    /// Parts of the object are outside a lattice's box, which [`Outside::Error`](super::Outside::Error) refuses.
    #[error("{} not {}in the lattice's box{}; larger bounds or outside = \"keep\" would do", .parts.subject(), .parts.adverb(), .parts.list())]
    Outside {
        /// Index of the deformer.
        deformer: usize,
        /// Which parts.
        parts: PartsOutside,
    },
    /// The image of flat pieces under a lattice.
    #[error("{source}")]
    Patches {
        /// Index of the deformer.
        deformer: usize,
        /// What is wrong.
        source: BuildError,
    },
    /// The image of a surface under a chain.
    #[error("{source}")]
    Cover {
        /// Index of the deformer, if it is one alone.
        deformer: Option<usize>,
        /// What is wrong.
        source: CoverError,
    },
    /// [`Representation::FengPeng`](super::Representation::FengPeng) of more than one deformer.
    #[error(
        "method triangular takes one lattice at most, for only flat polygons have triangular patches; \
         method = \"exact\" takes any number"
    )]
    OneLattice,
    /// [`Representation::FengPeng`](super::Representation::FengPeng) of anything but polygons under a lattice.
    #[error("method triangular takes a mesh and a lattice")]
    OnlyLattice,
    /// [`Representation::FengPeng`](super::Representation::FengPeng) under a lattice of high degrees.
    #[error(
        "method triangular makes patches of the sum of the lattice's degrees, {degree}, but {MAX_DEGREE} is the most; \
         method = \"exact\" takes any"
    )]
    TriangularDegree {
        /// The sum.
        degree: usize,
    },
    /// [`Representation::Pointwise`](super::Representation::Pointwise) of too high a level.
    #[error("pointwise:{level} would make more than {most} triangles; a lower level would do")]
    TooManyTriangles {
        /// The level.
        level: u32,
        /// Most triangles of an object.
        most: usize,
    },
    /// [`Representation::Adaptive`](super::Representation::Adaptive) does not reach its tolerance.
    #[error("adaptive:{tolerance}: {source}")]
    Tessellate {
        /// The tolerance.
        tolerance: f64,
        /// What is wrong.
        source: TessellateError,
    },
}

/// The parts of an object outside a lattice's box.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PartsOutside {
    /// These faces of polygons are, wholly or in part; ascending.
    Faces(Vec<u32>),
    /// Some are.
    Some,
}

impl PartsOutside {
    /// Faces that are named before the list says "…".
    const NAMED: usize = 8;

    fn subject(&self) -> String {
        match self {
            Self::Faces(faces) => format!("{} faces are", faces.len()),
            Self::Some => "parts of it are".to_owned(),
        }
    }

    const fn adverb(&self) -> &'static str {
        match self {
            Self::Faces(_) => "wholly ",
            Self::Some => "",
        }
    }

    fn list(&self) -> String {
        let Self::Faces(faces) = self else { return String::new() };
        let named: Vec<_> = faces.iter().take(Self::NAMED).map(u32::to_string).collect();
        let dots = if faces.len() > Self::NAMED { ", …" } else { "" };
        format!(" (face {}{dots})", named.join(", "))
    }
}

impl ModelError {
    /// Index of the deformer at fault; `None` if it is the object as a whole.
    #[must_use]
    pub const fn deformer(&self) -> Option<usize> {
        match self {
            Self::NeedsSurface { deformer, .. }
            | Self::TooManyFields { deformer }
            | Self::Lattice { deformer, .. }
            | Self::Collapsed { deformer, .. }
            | Self::Edit { deformer, .. }
            | Self::Outside { deformer, .. }
            | Self::Patches { deformer, .. } => Some(*deformer),
            Self::Cover { deformer, .. } | Self::Magnitude { deformer, .. } => *deformer,
            // the second is one too many
            Self::OneLattice => Some(1),
            Self::OnlyLattice | Self::TriangularDegree { .. } => Some(0),
            Self::NoArea
            | Self::NoTextureCoordinates { .. }
            | Self::NoNormals
            | Self::NeedsPolygons
            | Self::Memory(_)
            | Self::TooManyTriangles { .. }
            | Self::Tessellate { .. } => None,
        }
    }

    /// Whether there is too little memory, and nothing else is wrong.
    #[must_use]
    pub fn lacks_memory(&self) -> bool {
        match self {
            Self::Memory(_)
            | Self::Patches { source: BuildError::Memory(_), .. }
            | Self::Cover { source: CoverError::Memory(_), .. }
            | Self::Tessellate { source: TessellateError::Memory(_), .. } => true,
            Self::Edit { source: EditError::Object(error), .. } => error.lacks_memory(),
            _ => false,
        }
    }

    /// Index of the edit at fault among its deformer's, if it is one.
    #[must_use]
    pub const fn edit(&self) -> Option<usize> {
        match self {
            Self::Edit { edit, .. } => Some(*edit),
            _ => None,
        }
    }
}
