//! Drags met by changing weights.

use glam::DVec3;

use super::hull::is_outside;
use super::least_norm::{Equation, LeastNorm, combine};
use super::{Basis, CONSISTENT, Drag, DragError, diagonal};
use crate::spline::ControlLattice;

/// Most changes of the set of weights at their bound.
const MAX_ROUNDS: usize = 200;

/// A change of a lattice's weights.
#[derive(Clone, Debug, PartialEq)]
pub struct WeightSolution {
    /// Places of control points in the lattice, and their new weights.
    pub weights: Vec<(usize, f64)>,
    /// Σ (w' - w)², which is the least.
    pub objective: f64,
    /// Number of equations and of independent ones.
    pub rank: [usize; 2],
    /// Greatest over least singular value of the independent equations.
    pub condition: f64,
    /// How many weights are at the least allowed.
    pub at_bound: usize,
}

/// The equations of drags in the changes of the weights.
struct WeightEquations {
    equations: Vec<Equation>,
    right: Vec<f64>,
}

/// The least change of the weights that takes the sources to their targets, every weight at least `min_weight` times the
/// least one before.
///
/// Q(t) = T is linear and homogeneous in the weights: `Σ_a B_a(t) (P_a - T) w_a = 0`, three equations for each drag, with basis
/// functions B without weights. Without bounds the least change is a projection on their null space (Hu et al. 2001 leave
/// weights to the reader). With bounds l the least x = w' - w is max(l - w, Aᵀλ) where Aᵀλ is its unbounded form; which
/// weights are at the bound is found by the primal-dual active set method (Hintermüller, Ito, Kunisch 2003), whose end
/// is the optimum by its conditions (Karush, Kuhn, Tucker).
///
/// # Errors
/// If a source is outside the box or held, or no such weights are found; a target outside the hull of its active control
/// points is named.
pub fn solve_weights(
    lattice: &ControlLattice,
    drags: &[Drag],
    min_weight: f64,
) -> Result<WeightSolution, DragError> {
    let before: Vec<f64> = lattice.points().iter().map(|point| point.w).collect();
    let least = min_weight * before.iter().copied().fold(f64::INFINITY, f64::min);
    let WeightEquations { equations, right } = equations(lattice, drags, &before)?;
    let mut bound = vec![false; before.len()];
    let mut outcome = (0, f64::INFINITY);
    for _ in 0..MAX_ROUNDS {
        let reduced: Vec<Equation> = equations.iter().map(|equation| without(equation, &bound)).collect();
        let rest: Vec<f64> = equations
            .iter()
            .zip(&right)
            .map(|(equation, right)| right - fixed_part(equation, &bound, |i| least - before[i]))
            .collect();
        let system = LeastNorm::new(reduced, before.len());
        let multipliers = system.multipliers(&system.consistent(&rest));
        let change = system.combine(&multipliers);
        let left = system.equations().iter().zip(&rest).map(|(equation, rest)| rest - equation.dot(&change));
        outcome = (system.rank(), left.fold(0.0, |most: f64, left| most.max(left.abs())));
        // what each weight's change would be without bounds, those at the bound too
        let free = combine(&equations, &multipliers, before.len());
        let next: Vec<bool> = (0..before.len()).map(|i| before[i] + free[i] < least).collect();
        if next != bound {
            bound = next;
            continue;
        }
        if outcome.1.is_nan() || outcome.1 > CONSISTENT {
            break;
        }
        let at_bound = bound.iter().filter(|at| **at).count();
        let changes: Vec<f64> =
            (0..before.len()).map(|i| if bound[i] { least - before[i] } else { change[i] }).collect();
        return Ok(WeightSolution {
            weights: (0..before.len())
                .filter(|&i| changes[i] != 0.0)
                .map(|i| (i, if bound[i] { least } else { before[i] + changes[i] }))
                .collect(),
            objective: changes.iter().map(|change| change * change).sum(),
            rank: [equations.len(), system.rank()],
            condition: system.condition(),
            at_bound,
        });
    }
    Err(infeasible(lattice, drags, least, (equations.len(), outcome)))
}

/// Three equations for each drag, each of length 1.
fn equations(
    lattice: &ControlLattice,
    drags: &[Drag],
    weights: &[f64],
) -> Result<WeightEquations, DragError> {
    let mut made = WeightEquations { equations: Vec::new(), right: Vec::new() };
    let size = diagonal(lattice);
    for (number, drag) in drags.iter().enumerate() {
        let Basis { all, .. } = Basis::at(lattice, number, drag.source)?;
        for axis in 0..3 {
            let lever = |flat: usize| (lattice.points()[flat].truncate() - drag.target)[axis] / size;
            let mut equation = Equation::default();
            let mut right = 0.0;
            for &(flat, value) in &all {
                let coefficient = value * lever(flat);
                right -= coefficient * weights[flat];
                if !lattice.is_held(lattice.index_of(flat)) {
                    equation.unknowns.push(flat);
                    equation.coefficients.push(coefficient);
                }
            }
            made.equations.push(equation);
            made.right.push(right);
        }
    }
    Ok(made)
}

/// An equation in the unknowns that are not at their bound.
fn without(equation: &Equation, bound: &[bool]) -> Equation {
    let free = equation.unknowns.iter().zip(&equation.coefficients).filter(|(unknown, _)| !bound[**unknown]);
    let (unknowns, coefficients) = free.map(|(&unknown, &a)| (unknown, a)).unzip();
    Equation { unknowns, coefficients }
}

/// What the unknowns at their bound contribute to an equation.
fn fixed_part(equation: &Equation, bound: &[bool], value: impl Fn(usize) -> f64) -> f64 {
    let terms = equation.unknowns.iter().zip(&equation.coefficients);
    terms.filter(|(unknown, _)| bound[**unknown]).map(|(&unknown, a)| a * value(unknown)).sum()
}

fn infeasible(
    lattice: &ControlLattice,
    drags: &[Drag],
    least: f64,
    (count, (rank, residual)): (usize, (usize, f64)),
) -> DragError {
    for (number, drag) in drags.iter().enumerate() {
        let Ok(Basis { all, .. }) = Basis::at(lattice, number, drag.source) else { continue };
        let active: Vec<DVec3> = all.iter().map(|&(flat, _)| lattice.points()[flat].truncate()).collect();
        if is_outside(drag.target, &active) {
            return DragError::OutsideHull { drag: number + 1, target: drag.target };
        }
    }
    DragError::NoWeights { drags: (1..=drags.len()).collect(), least, count, rank, residual }
}

impl WeightSolution {
    /// Sets the lattice's weights.
    ///
    /// # Panics
    /// If the solution is of a larger lattice.
    pub fn apply(&self, lattice: &mut ControlLattice) {
        for &(flat, weight) in &self.weights {
            lattice
                .set_weight(lattice.index_of(flat), weight)
                .expect("the equations have no control points that are held");
        }
    }
}
