//! The maps that a chain is made of, each kind in a file of its own.

mod check;
mod extension;

pub use extension::{Extension, ExtensionMode, Field, Region};

use super::branch::SelectBranch;
use super::jet::{Jet, Point};
use super::number::Number;
use super::taylor::deformed;
use crate::spline::SplineVolume;

/// One deformation.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// By a B-spline volume; what is outside its box stays.
    Volume(SplineVolume),
    /// By extension functions of the surface's parameters.
    Extension(Extension),
}

impl Step {
    /// The deformed point of a surface with parameters (u, v).
    pub(super) fn apply<T: Number, const N: usize>(
        &self,
        point: Point<T, N>,
        uv: &[Jet<T, N>; 2],
        choose: &mut dyn SelectBranch<T>,
    ) -> Point<T, N> {
        match self {
            Self::Volume(volume) => match choose.knot_box(volume, &point.map(Jet::to_linear)) {
                Some(knot_box) => deformed(volume, knot_box, &point),
                None => point,
            },
            Self::Extension(extension) => extension.apply(&point, uv, choose),
        }
    }

    /// Bound on how much farther apart points can be afterwards. It is 1 for an extension: surfaces have no borders
    /// that rounding could displace.
    pub(super) fn lipschitz_bound(&self) -> f64 {
        match self {
            Self::Volume(volume) => volume.lipschitz_bound(),
            Self::Extension(_) => 1.0,
        }
    }

    /// How large numbers become on the way to coordinates no greater than `magnitude`.
    pub(super) fn largest_term(&self, magnitude: f64) -> f64 {
        match self {
            Self::Volume(_) => magnitude,
            Self::Extension(extension) => extension.largest_term(magnitude),
        }
    }

    /// Whether it takes derivatives of the surface.
    #[must_use]
    pub const fn takes_derivatives(&self) -> bool {
        match self {
            Self::Volume(_) => false,
            Self::Extension(extension) => extension.takes_derivatives(),
        }
    }

    /// What it is called, if it moves points by their parameters (u, v), which only surfaces have.
    #[must_use]
    pub const fn needs_parameters(&self) -> Option<&'static str> {
        match self {
            Self::Volume(_) => None,
            Self::Extension(_) => Some("extension"),
        }
    }

    /// What it may do that its author did not mean, over the domain of (u, v).
    #[must_use]
    pub fn warnings(&self, domain: [[f64; 2]; 2]) -> Vec<String> {
        match self {
            Self::Volume(_) => Vec::new(),
            Self::Extension(extension) => check::warnings(extension, domain),
        }
    }
}
