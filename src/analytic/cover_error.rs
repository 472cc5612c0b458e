//! Why a surface under a chain of deformations cannot be covered by cells.

use glam::DVec2;
use thiserror::Error;

use crate::math::magnitude::MagnitudeError;
use crate::memory::OutOfMemory;

/// Cells of a surface, at most: a formula that is not smooth along a curve needs ever more.
pub(super) const MAX_CELLS: usize = 30_000;

/// Why a formula cannot be covered. Places are (u, v) of a surface, or parameters of a patch.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CoverError {
    /// A step gives a point that is not finite.
    #[error("at u = {0}, v = {1} the point is not finite: the exponent h phi^n is too large, or an expression has no value", place.x, place.y)]
    NotFinite {
        /// Index of the step.
        step: usize,
        /// Where.
        place: DVec2,
    },
    /// A step takes a point too far.
    #[error("at u = {0}, v = {1} {source}", place.x, place.y)]
    TooLarge {
        /// Index of the step.
        step: usize,
        /// Where.
        place: DVec2,
        /// How far.
        source: MagnitudeError,
    },
    /// All of the surface comes to be as small as a point.
    #[error("the deformed surface is too small: {source}")]
    TooSmall {
        /// How small.
        source: MagnitudeError,
    },
    /// A step along a normal or tangent, where there is none.
    #[error("at u = {0}, v = {1} the surface has no normal or tangent that the field could follow", place.x, place.y)]
    NoNormal {
        /// Index of the step.
        step: usize,
        /// Where.
        place: DVec2,
    },
    /// The surface has too much detail.
    #[error("more than {MAX_CELLS} cells would be needed, up to u = {0}, v = {1}: the surface has too many waves, or a curve along which an expression is not smooth, or lies too far from the origin for its size", place.x, place.y)]
    TooMany {
        /// How far they came.
        place: DVec2,
    },
    /// There is too little memory for so many cells.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
    /// No bounds were found.
    #[error("about u = {0}, v = {1} the surface is not smooth enough to be bounded: an expression has a singular point or curve there", place.x, place.y)]
    Unbounded {
        /// Where.
        place: DVec2,
    },
}

impl CoverError {
    /// Index of the step at fault, if it is one.
    pub const fn step(&self) -> Option<usize> {
        match self {
            Self::NotFinite { step, .. } | Self::TooLarge { step, .. } | Self::NoNormal { step, .. } => {
                Some(*step)
            }
            Self::TooSmall { .. } | Self::TooMany { .. } | Self::Memory(_) | Self::Unbounded { .. } => None,
        }
    }
}
