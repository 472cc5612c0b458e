//! Drags met by moving control points.

use glam::DVec3;

use super::least_norm::{Equation, LeastNorm};
use super::{Basis, CONSISTENT, DragError, diagonal};
use crate::spline::ControlLattice;

/// Points of the object that are dragged together, by the least change of the control points.
///
/// The change of the control points is δ = R G⁻¹ D: R has a column of rational basis values for each source, of the control
/// points that are free; G = `RᵀR`; D has the displacements (Hu et al. 2001, section 4, with G where they write the inverse
/// of R). For one point it is their equation 9, `δ_a = R_a / ΣR² D`. If sources depend on each other it is the pseudo-inverse.
#[derive(Clone, Debug)]
pub struct DirectManipulation {
    system: LeastNorm,
    tolerance: f64,
}

/// A change of a lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct PointSolution {
    /// Places of control points in the lattice, and by what they move.
    pub moves: Vec<(usize, DVec3)>,
    /// By what each source moves.
    pub displacements: Vec<DVec3>,
    /// Σ |δ|², which is the least.
    pub objective: f64,
}

impl DirectManipulation {
    /// The equations of sources in a lattice's box, on the lattice as it stands.
    ///
    /// # Errors
    /// If a source is outside the box, or where all control points are held.
    pub fn try_new(lattice: &ControlLattice, sources: &[DVec3]) -> Result<Self, DragError> {
        let equation = |(drag, source): (usize, &DVec3)| {
            let Basis { free, total, .. } = Basis::at(lattice, drag, *source)?;
            let rational = |(flat, value): (usize, f64)| (flat, value * lattice.points()[flat].w / total);
            let (unknowns, coefficients) = free.into_iter().map(rational).unzip();
            Ok(Equation { unknowns, coefficients })
        };
        let equations: Vec<_> = sources.iter().enumerate().map(equation).collect::<Result<_, _>>()?;
        let system = LeastNorm::new(equations, lattice.points().len());
        Ok(Self { system, tolerance: CONSISTENT * diagonal(lattice) })
    }

    /// Number of independent sources.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.system.rank()
    }

    /// Greatest over least singular value of R, of the independent sources.
    #[must_use]
    pub fn condition(&self) -> f64 {
        self.system.condition()
    }

    /// The least change of the control points that moves the sources by these displacements.
    ///
    /// # Errors
    /// [`DragError::Inconsistent`] if none does.
    ///
    /// # Panics
    /// If there are not as many displacements as sources.
    pub fn solve(&self, displacements: &[DVec3]) -> Result<PointSolution, DragError> {
        let solution = self.solve_least_squares(displacements);
        let off: Vec<f64> = displacements
            .iter()
            .zip(&solution.displacements)
            .map(|(want, got)| want.distance(*got))
            .collect();
        let missed: Vec<usize> =
            (0..off.len()).filter(|&i| off[i].is_nan() || off[i] > self.tolerance).map(|i| i + 1).collect();
        if missed.is_empty() {
            return Ok(solution);
        }
        Err(DragError::Inconsistent {
            drags: missed,
            count: off.len(),
            rank: self.rank(),
            residual: off.into_iter().fold(0.0, f64::max),
        })
    }

    /// As [`Self::solve`], with the displacements nearest to these (in the sum of squares) that are possible.
    ///
    /// # Panics
    /// If there are not as many displacements as sources.
    #[must_use]
    pub fn solve_least_squares(&self, displacements: &[DVec3]) -> PointSolution {
        let multipliers = self.multipliers(displacements);
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let of_axis: Vec<f64> = multipliers.iter().map(|multiplier| multiplier[axis]).collect();
            self.system.combine(&of_axis)
        });
        let moves: Vec<(usize, DVec3)> = (0..x.len())
            .map(|flat| (flat, DVec3::new(x[flat], y[flat], z[flat])))
            .filter(|(_, offset)| *offset != DVec3::ZERO)
            .collect();
        let displacement =
            |equation: &Equation| DVec3::new(equation.dot(&x), equation.dot(&y), equation.dot(&z));
        PointSolution {
            displacements: self.system.equations().iter().map(displacement).collect(),
            objective: moves.iter().map(|(_, offset)| offset.length_squared()).sum(),
            moves,
        }
    }

    /// The displacements ρ of the single-point moves that together, in any order, change the lattice as
    /// [`Self::solve_least_squares`] does: step q moves source q by `ρ_q = G_qq M_q`, M = G⁻¹ D.
    ///
    /// Source: Hu et al. (2001), section 5, with displacements instead of their equation 19, which divides by basis
    /// values.
    ///
    /// # Panics
    /// If there are not as many displacements as sources.
    #[must_use]
    pub fn decompose(&self, displacements: &[DVec3]) -> Vec<DVec3> {
        let multipliers = self.multipliers(displacements);
        multipliers.iter().enumerate().map(|(q, m)| self.system.norm_squared(q) * *m).collect()
    }

    /// The change that undoes [`Self::solve_least_squares`]: moves by displacement of the same sources commute and add up.
    ///
    /// # Panics
    /// If there are not as many displacements as sources.
    #[must_use]
    pub fn inverse(&self, displacements: &[DVec3]) -> PointSolution {
        let back: Vec<DVec3> = displacements.iter().map(|displacement| -displacement).collect();
        self.solve_least_squares(&back)
    }

    /// M = G⁻¹ D.
    fn multipliers(&self, displacements: &[DVec3]) -> Vec<DVec3> {
        assert_eq!(displacements.len(), self.system.equations().len(), "one displacement for each source");
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let of_axis: Vec<f64> = displacements.iter().map(|displacement| displacement[axis]).collect();
            self.system.multipliers(&self.system.consistent(&of_axis))
        });
        (0..x.len()).map(|q| DVec3::new(x[q], y[q], z[q])).collect()
    }
}

impl PointSolution {
    /// Moves the lattice's control points.
    ///
    /// # Panics
    /// If the solution is of a larger lattice.
    pub fn apply(&self, lattice: &mut ControlLattice) {
        for &(flat, offset) in &self.moves {
            lattice
                .move_by(lattice.index_of(flat), offset)
                .expect("the equations have no control points that are held");
        }
    }
}
