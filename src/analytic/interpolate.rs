//! Patches through values of a function at Chebyshev points, and how far they are from it.

use std::f64::consts::{FRAC_2_PI, PI};
use std::sync::LazyLock;

use glam::{DVec2, DVec3, DVec4};
use nalgebra::DMatrix;

use crate::math::bernstein::{MAX_ORDER, basis};

type Matrix = [[f64; MAX_ORDER]; MAX_ORDER];

/// One degree's points (1 - cos(π i / n)) / 2, the Bernstein polynomials there, and the inverse of that matrix.
struct Nodes {
    places: [f64; MAX_ORDER],
    values: Matrix,
    inverse: Matrix,
}

static NODES: LazyLock<[Nodes; MAX_ORDER]> = LazyLock::new(|| std::array::from_fn(Nodes::of_degree));

impl Nodes {
    fn of_degree(degree: usize) -> Self {
        let place = |i: usize| {
            let angle = PI * i as f64 / degree.max(1) as f64;
            let half = libm::sin(0.5 * angle);
            if i <= degree { half * half } else { 0.0 }
        };
        let places: [f64; MAX_ORDER] = std::array::from_fn(place);
        let values: Matrix = std::array::from_fn(|i| basis::<MAX_ORDER, f64>(degree, places[i]).value);
        Self { places, values, inverse: inverse(degree + 1, &values) }
    }
}

/// The inverse of a matrix' first rows and columns.
fn inverse(size: usize, matrix: &Matrix) -> Matrix {
    let inverse = DMatrix::from_fn(size, size, |i, j| matrix[i][j]).try_inverse();
    let inverse = inverse.expect("Bernstein polynomials at distinct points are independent");
    std::array::from_fn(|i| std::array::from_fn(|j| inverse.get((i, j)).copied().unwrap_or(0.0)))
}

/// A patch's control points, and how far from the values it is at the points of interpolation.
#[derive(Clone, Debug)]
pub(super) struct Interpolant {
    /// Homogeneous, the second index fastest.
    pub(super) control_points: Vec<DVec4>,
    /// Greatest distance at a point of interpolation, in any coordinate.
    pub(super) residual: f64,
}

/// The polynomial of a degree through a function's values, which are homogeneous points, at the Chebyshev points of the unit
/// square.
pub(super) fn interpolate(degree: [usize; 2], mut value: impl FnMut(DVec2) -> DVec4) -> Interpolant {
    let [m, n] = degree;
    let (along_s, along_t) = (&NODES[m], &NODES[n]);
    let mut values = Vec::with_capacity((m + 1) * (n + 1));
    for s in &along_s.places[..=m] {
        for t in &along_t.places[..=n] {
            values.push(value(DVec2::new(*s, *t)));
        }
    }
    // about a point of the surface, so that roundings are in parts of its size
    let middle = values[0].truncate().extend(0.0) / values[0].w;
    for value in &mut values {
        *value -= value.w * middle;
    }
    let mut control_points = product(degree, &along_s.inverse, &along_t.inverse, &values);
    let mut residual = DVec3::ZERO;
    for refinement in 0..2 {
        let made = product(degree, &along_s.values, &along_t.values, &control_points);
        let left: Vec<_> = values.iter().zip(&made).map(|(value, made)| *value - *made).collect();
        residual = left.iter().map(|left| left.truncate().abs()).fold(DVec3::ZERO, DVec3::max);
        if refinement == 0 {
            let correction = product(degree, &along_s.inverse, &along_t.inverse, &left);
            for (point, correction) in control_points.iter_mut().zip(correction) {
                *point += correction;
            }
        }
    }
    for point in &mut control_points {
        *point += point.w * middle;
    }
    Interpolant { control_points, residual: residual.max_element() }
}

/// A · values · Bᵀ.
fn product([m, n]: [usize; 2], a: &Matrix, b: &Matrix, values: &[DVec4]) -> Vec<DVec4> {
    let mut rows = Vec::with_capacity(values.len());
    for row in values.chunks_exact(n + 1) {
        rows.extend(b[..=n].iter().map(|b| row.iter().zip(b).map(|(value, b)| *value * *b).sum::<DVec4>()));
    }
    let mut product = vec![DVec4::ZERO; values.len()];
    for i in 0..=m {
        for k in 0..=m {
            for j in 0..=n {
                product[i * (n + 1) + j] += a[i][k] * rows[k * (n + 1) + j];
            }
        }
    }
    product
}

/// Bound of the interpolant's values for values of 1 at the Chebyshev points: the Lebesgue constant.
///
/// Source: Trefethen, *Approximation Theory and Approximation Practice* (2013), Theorem 15.2.
pub(super) fn lebesgue(degree: usize) -> f64 {
    FRAC_2_PI * libm::log(degree as f64 + 1.0) + 1.0
}

/// Bound of the distance between a function over [-1, 1] and its interpolant at Chebyshev points, if it is analytic in the
/// disc of radius `reach` > 1 and no farther than 1 from its value in the middle there. The ellipse with foci -1 and 1 and
/// sum of half axes ρ is in the disc if its longer half axis (ρ + 1/ρ) / 2 is `reach`; then 4 / (ρ^n (ρ - 1)).
///
/// Source: Trefethen (2013), Theorem 8.2.
pub(super) fn interpolation_error(degree: usize, reach: f64) -> f64 {
    let rho = reach + (reach * reach - 1.0).sqrt();
    4.0 / (libm::pow(rho, degree as f64) * (rho - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch::BezierPatch;

    #[test]
    fn polynomials_are_their_own_interpolants() {
        for degree in [[1, 1], [2, 3], [5, 4], [8, 8], [12, 9]] {
            let value = |st: DVec2| {
                let power = |x: f64, n: usize| libm::pow(x - 0.3, n as f64);
                let height = power(st.x, degree[0]) * power(st.y, degree[1]);
                DVec4::new(st.x + 100.0, st.y, height, 1.0)
            };
            let made = interpolate(degree, value);
            assert!(made.residual < 1e-15, "{degree:?}: {}", made.residual);
            let patch = BezierPatch::new(degree, made.control_points.iter().map(|p| p.with_w(1.0)).collect());
            for i in 0..=40 {
                for j in 0..=40 {
                    let st = DVec2::new(f64::from(i), f64::from(j)) / 40.0;
                    let off = patch.eval(st).position - value(st).truncate();
                    assert!(off.length() < 64.0 * 100.0 * f64::EPSILON, "{degree:?} at {st}: {off}");
                }
            }
        }
    }

    #[test]
    fn the_error_of_interpolation_is_bounded() {
        // 1 / (x - pole) is analytic in discs below the pole
        for pole in [1.5, 2.0, 4.0] {
            for reach in [1.1, 0.9 * pole + 0.1] {
                let size = 1.0 / (pole - reach) - 1.0 / pole;
                for degree in 1..=12 {
                    let value = |x: f64| 1.0 / (pole - (2.0 * x - 1.0));
                    let made = interpolate([degree, 1], |st| DVec4::new(value(st.x), st.y, 0.0, 1.0));
                    let patch = BezierPatch::new(
                        [degree, 1],
                        made.control_points.iter().map(|p| p.with_w(1.0)).collect(),
                    );
                    let bound = size * interpolation_error(degree, reach) + 1e-14;
                    let off = |i: i32| {
                        let x = f64::from(i) / 200.0;
                        (patch.eval(DVec2::new(x, 0.0)).position.x - value(x)).abs()
                    };
                    let worst = (0..=200).map(off).fold(0.0, f64::max);
                    assert!(worst <= bound, "pole {pole}, degree {degree}: {worst:e} above {bound:e}");
                }
            }
        }
    }
}
