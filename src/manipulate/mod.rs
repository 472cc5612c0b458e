//! Stage 2b: direct manipulation: where points of the object must go, and the lattice that takes them there.
//!
//! Source: Hu, Zhang, Tai, Sun (2001), *Direct manipulation of FFD: efficient explicit solutions and decomposable multiple
//! point constraints*.

mod hull;
mod least_norm;
mod points;
mod weights;

use glam::DVec3;
use thiserror::Error;

use crate::spline::ControlLattice;
use least_norm::Equation;

pub use points::{DirectManipulation, PointSolution};
pub use weights::{WeightSolution, solve_weights};

/// Greatest distance of a reached position from its target that counts as rounding, in parts of the lattice's diagonal.
pub const CONSISTENT: f64 = 1e-12;

/// A point of the object and where it must go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    /// The point on the undeformed object, as the deformation receives it.
    pub source: DVec3,
    /// Where it must be after the deformation.
    pub target: DVec3,
}

/// Why drags cannot be met. Drags are numbered from 1.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum DragError {
    /// There is no basis function there.
    #[error("drag {drag}: its source {source_point} is outside the lattice's box {} to {}", .bounds[0], .bounds[1])]
    Outside {
        /// Its number.
        drag: usize,
        /// Its source.
        source_point: DVec3,
        /// The lattice's box.
        bounds: [DVec3; 2],
    },
    /// No control point that is free moves it.
    #[error(
        "drag {drag}: its source {source_point} is where hold keeps all control points; fewer layers would free it"
    )]
    Held {
        /// Its number.
        drag: usize,
        /// Its source.
        source_point: DVec3,
    },
    /// The targets contradict each other.
    #[error(
        "{} cannot all be met: {count} drags have rank {rank}, and the best compromise is off by {residual:.3e}; \
         more control points would do, or --least-squares to accept the compromise", numbered(.drags)
    )]
    Inconsistent {
        /// Numbers of those that the best compromise misses.
        drags: Vec<usize>,
        /// Number of drags.
        count: usize,
        /// Number of independent ones.
        rank: usize,
        /// Greatest distance from a target.
        residual: f64,
    },
    /// A weight would have to be negative or too small.
    #[error(
        "drag {drag}: its target {target} lies outside the hull of the active control points, so no weights reach it"
    )]
    OutsideHull {
        /// Its number.
        drag: usize,
        /// Its target.
        target: DVec3,
    },
    /// No weights above the least were found.
    #[error(
        "{} cannot be met by weights of at least {least:.3e}: the equations have rank {rank} of {count}, and the nearest \
         solution is off by {residual:.3e}; a smaller min_weight or using = \"points\" would do", numbered(.drags)
    )]
    NoWeights {
        /// Numbers of the drags.
        drags: Vec<usize>,
        /// The least weight allowed.
        least: f64,
        /// Number of equations.
        count: usize,
        /// Number of independent ones.
        rank: usize,
        /// What is left of the greatest equation.
        residual: f64,
    },
}

/// "drag 1", "drags 1 and 3", "drags 1, 2 and 5".
fn numbered(drags: &[usize]) -> String {
    let numbers: Vec<_> = drags.iter().map(usize::to_string).collect();
    match numbers.as_slice() {
        [] => "drags".to_owned(),
        [one] => format!("drag {one}"),
        [first @ .., last] => format!("drags {} and {last}", first.join(", ")),
    }
}

/// The basis functions at a drag's source that are not 0: places of control points and values without weights.
fn basis_of(lattice: &ControlLattice, drag: usize, source: DVec3) -> Result<Equation, DragError> {
    let basis = lattice.basis(source).ok_or_else(|| DragError::Outside {
        drag: drag + 1,
        source_point: source,
        bounds: lattice.bounds(),
    })?;
    let (unknowns, coefficients) = basis.into_iter().filter(|(_, value)| *value != 0.0).unzip();
    Ok(Equation { unknowns, coefficients })
}

/// The length that residuals are measured by.
fn diagonal(lattice: &ControlLattice) -> f64 {
    let [low, high] = lattice.bounds();
    (high - low).length()
}

#[cfg(test)]
mod tests;
