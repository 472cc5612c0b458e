//! The least solution of linear equations that are fewer than their unknowns.

use nalgebra::{DMatrix, DVector};

/// One equation: the unknowns that it has, and their coefficients.
#[derive(Clone, Debug, Default)]
pub(super) struct Equation {
    pub(super) unknowns: Vec<usize>,
    pub(super) coefficients: Vec<f64>,
}

impl Equation {
    pub(super) fn dot(&self, x: &[f64]) -> f64 {
        self.unknowns.iter().zip(&self.coefficients).map(|(&unknown, a)| a * x[unknown]).sum()
    }
}

/// Corrections of a solution by its residual: each gains the digits that the factorisation is good for.
const REFINEMENTS: usize = 3;

/// Equations factorised for many right-hand sides.
///
/// With the equations as the columns of A, x = A λ is the least of all x with Aᵀ x = b, and `AᵀA` λ = b. A = Q R by Householder's
/// reflections, R = Q' T Pᵀ by the same with columns pivoted: so `AᵀA` = P `TᵀT` Pᵀ, T shows the rank, and λ comes from two
/// triangular systems. What the squared condition costs, the refinement by residuals brings back (the corrected
/// seminormal equations of Björck 1987, *Stability analysis of the method of seminormal equations*).
#[derive(Clone, Debug)]
pub(super) struct LeastNorm {
    equations: Vec<Equation>,
    unknowns: usize,
    /// Upper trapezoidal, as many rows as the rank.
    factor: DMatrix<f64>,
    /// The equation that each column of `factor` stands for.
    order: Vec<usize>,
}

impl LeastNorm {
    /// Equations in unknowns numbered below `unknowns`.
    pub(super) fn new(equations: Vec<Equation>, unknowns: usize) -> Self {
        let mut place = vec![usize::MAX; unknowns];
        let mut rows = 0;
        for &unknown in equations.iter().flat_map(|equation| &equation.unknowns) {
            if place[unknown] == usize::MAX {
                place[unknown] = rows;
                rows += 1;
            }
        }
        let columns = equations.len();
        let mut a = DMatrix::<f64>::zeros(rows, columns);
        for (column, equation) in equations.iter().enumerate() {
            for (&unknown, &coefficient) in equation.unknowns.iter().zip(&equation.coefficients) {
                a[(place[unknown], column)] += coefficient;
            }
        }
        // pivoting passes over all of the matrix for each column, which is less for the triangle
        let small = if rows > columns { a.qr().unpack_r() } else { a };
        let pivoted = small.col_piv_qr();
        let mut order = DMatrix::from_fn(1, columns, |_, column| column);
        pivoted.p().permute_columns(&mut order);
        let factor = pivoted.r();
        // the factorisation's backward error
        let largest = if factor.is_empty() { 0.0 } else { factor[(0, 0)].abs() };
        let threshold = largest * f64::EPSILON * rows.max(columns) as f64;
        let rank = (0..factor.nrows()).take_while(|&i| factor[(i, i)].abs() > threshold).count();
        let factor = factor.rows(0, rank).into_owned();
        Self { equations, unknowns, factor, order: order.iter().copied().collect() }
    }

    pub(super) fn equations(&self) -> &[Equation] {
        &self.equations
    }

    /// Number of independent equations.
    pub(super) fn rank(&self) -> usize {
        self.factor.nrows()
    }

    /// Greatest over least singular value of the independent equations.
    pub(super) fn condition(&self) -> f64 {
        let rank = self.rank();
        if rank == 0 {
            return 1.0;
        }
        let values = self.factor.columns(0, rank).into_owned().singular_values();
        values.max() / values.min()
    }

    /// Diagonal element of `AᵀA`.
    pub(super) fn norm_squared(&self, equation: usize) -> f64 {
        self.equations[equation].coefficients.iter().map(|a| a * a).sum()
    }

    /// The multipliers λ of the least x that meets the independent equations. The others get none; they are met too if `b`
    /// is consistent.
    pub(super) fn multipliers(&self, b: &[f64]) -> Vec<f64> {
        let mut multipliers = vec![0.0; self.equations.len()];
        for _ in 0..=REFINEMENTS {
            let x = self.combine(&multipliers);
            let residual: Vec<f64> =
                self.equations.iter().zip(b).map(|(equation, b)| b - equation.dot(&x)).collect();
            for (equation, correction) in self.correction(&residual) {
                multipliers[equation] += correction;
            }
        }
        multipliers
    }

    /// λ of the independent equations, as good as the factorisation.
    fn correction(&self, b: &[f64]) -> impl Iterator<Item = (usize, f64)> {
        let rank = self.rank();
        let square = self.factor.columns(0, rank);
        let pivoted = DVector::from_fn(rank, |i, _| b[self.order[i]]);
        let solved = square
            .tr_solve_upper_triangular(&pivoted)
            .and_then(|y| square.solve_upper_triangular(&y))
            .unwrap_or_else(|| DVector::zeros(rank));
        (0..rank).map(move |i| (self.order[i], solved[i]))
    }

    /// x = A λ.
    pub(super) fn combine(&self, multipliers: &[f64]) -> Vec<f64> {
        combine(&self.equations, multipliers, self.unknowns)
    }

    /// The right-hand side nearest to `b` (in the sum of squares) that the equations can have.
    pub(super) fn consistent(&self, b: &[f64]) -> Vec<f64> {
        let (rank, count) = (self.rank(), self.equations.len());
        if rank == count {
            return b.to_vec();
        }
        let range = self.factor.transpose();
        let pivoted = DVector::from_fn(count, |i, _| b[self.order[i]]);
        // the projection on the range of Tᵀ, by an orthonormal basis of it
        let basis = range.qr().q();
        let projected = &basis * (basis.tr_mul(&pivoted));
        let mut nearest = vec![0.0; count];
        for (i, &equation) in self.order.iter().enumerate() {
            nearest[equation] = projected[i];
        }
        nearest
    }
}

/// The combination of equations with multipliers, as a vector of so many unknowns.
pub(super) fn combine(equations: &[Equation], multipliers: &[f64], unknowns: usize) -> Vec<f64> {
    let mut x = vec![0.0; unknowns];
    for (equation, multiplier) in equations.iter().zip(multipliers) {
        for (&unknown, a) in equation.unknowns.iter().zip(&equation.coefficients) {
            x[unknown] += a * multiplier;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Noise;

    fn random(noise: &mut Noise, equations: usize, unknowns: usize) -> Vec<Equation> {
        let mut equation = |number: usize| {
            let start = 5 * number % (unknowns - 8);
            let coefficients = (0..8).map(|_| noise.next()).collect();
            Equation { unknowns: (start..start + 8).collect(), coefficients }
        };
        (0..equations).map(&mut equation).collect()
    }

    /// By the pseudo-inverse, from a singular value decomposition.
    fn by_pseudo_inverse(equations: &[Equation], unknowns: usize, b: &[f64]) -> DVector<f64> {
        let mut a = DMatrix::<f64>::zeros(equations.len(), unknowns);
        for (row, equation) in equations.iter().enumerate() {
            for (&unknown, &c) in equation.unknowns.iter().zip(&equation.coefficients) {
                a[(row, unknown)] += c;
            }
        }
        a.pseudo_inverse(1e-11).unwrap() * DVector::from_column_slice(b)
    }

    #[test]
    fn solutions_are_the_pseudo_inverses() {
        let mut noise = Noise(12);
        for case in 0..30 {
            let (count, unknowns) = (1 + case, 12 + 2 * case);
            let mut equations = random(&mut noise, count, unknowns);
            // some that depend on others
            if case % 3 == 0 && count > 3 {
                equations[2] = equations[0].clone();
            }
            let system = LeastNorm::new(equations.clone(), unknowns);
            let dependent = usize::from(case % 3 == 0 && count > 3);
            assert_eq!(system.rank(), count - dependent, "case {case}");
            let b: Vec<f64> = (0..count).map(|_| noise.next()).collect();
            let nearest = system.consistent(&b);
            let x = system.combine(&system.multipliers(&nearest));
            let want = by_pseudo_inverse(&equations, unknowns, &b);
            let off = x.iter().zip(want.iter()).map(|(x, want)| (x - want).abs()).fold(0.0, f64::max);
            assert!(off < 1e-10 * (1.0 + want.norm()), "case {case}: {off:e}");
            for (equation, b) in equations.iter().zip(&nearest) {
                assert!((equation.dot(&x) - b).abs() < 1e-13 * (1.0 + want.norm()), "case {case}");
            }
        }
    }

    #[test]
    fn nothing_and_zero_are_fine() {
        let none = LeastNorm::new(Vec::new(), 5);
        assert_eq!((none.rank(), none.combine(&none.multipliers(&[]))), (0, vec![0.0; 5]));
        let zero = LeastNorm::new(vec![Equation { unknowns: vec![1], coefficients: vec![0.0] }], 2);
        assert_eq!(zero.rank(), 0);
        assert_eq!(zero.consistent(&[3.0]), [0.0]);
        let empty = LeastNorm::new(vec![Equation::default()], 2);
        assert_eq!((empty.rank(), empty.condition()), (0, 1.0));
    }
}
