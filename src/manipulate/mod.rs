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

/// Sum of the rational basis values of the free control points below which a source counts as held: to move it by 1 they
/// would move by the reciprocal of this.
const LEAST_HOLD: f64 = 1e-6;

/// The control points that have a say at a drag's source.
struct Basis {
    /// Places in the lattice and basis values without weights, where these are not 0.
    all: Vec<(usize, f64)>,
    /// Those of them that are free.
    free: Vec<(usize, f64)>,
    /// The weighted sum of all values.
    total: f64,
}

impl Basis {
    fn at(lattice: &ControlLattice, drag: usize, source: DVec3) -> Result<Self, DragError> {
        let mut all = lattice.basis(source).ok_or_else(|| DragError::Outside {
            drag: drag + 1,
            source_point: source,
            bounds: lattice.bounds(),
        })?;
        all.retain(|(_, value)| *value != 0.0);
        let is_free = |(flat, _): &(usize, f64)| !lattice.is_held(lattice.index_of(*flat));
        let free: Vec<_> = all.iter().copied().filter(is_free).collect();
        let weighted = |values: &[(usize, f64)]| -> f64 {
            values.iter().map(|&(flat, value)| value * lattice.points()[flat].w).sum()
        };
        let total = weighted(&all);
        if weighted(&free) / total < LEAST_HOLD {
            return Err(DragError::Held { drag: drag + 1, source_point: source });
        }
        Ok(Self { all, free, total })
    }
}

/// The length that residuals are measured by.
fn diagonal(lattice: &ControlLattice) -> f64 {
    let [low, high] = lattice.bounds();
    (high - low).length()
}

#[cfg(test)]
mod tests;
