//! The same control points by polynomial interpolation, as Feng et al. compute them.
//!
//! Kept as the check of [`Composer`](super::Composer), which is faster and loses no digits.

use glam::{DVec2, DVec4};

use crate::math::bernstein::{MAX_ORDER, basis};
use crate::spline::{KnotBox, SplineVolume};
use crate::subdivide::Frame;

use super::bezier_patch::BezierPatch;

/// The patch of the given degree through the volume piece's values at (i/m, j/n) of the frame.
///
/// R = B_m^-1 S B_n^-T with `B_n`\[i\]\[j\] = B(j, n)(i/n), in two stages of curve interpolation. The condition of `B_n`
/// grows to 2.4e4 at degree 12, and the two directions multiply; the errors cancel on the surface near the nodes.
///
/// Source: Feng, Nishita, Jin, Peng (2002), section 3.4.2, Eqs. (3) and (4).
///
/// # Panics
/// If a degree is not in 1..=12 or the volume has no such knot box.
pub fn compose_by_interpolation(
    volume: &SplineVolume,
    knot_box: KnotBox,
    frame: &Frame,
    degree: [usize; 2],
) -> BezierPatch {
    let [m, n] = degree;
    let node = |i: usize, degree: usize| i as f64 / degree as f64;
    let mut net: Vec<DVec4> = Vec::with_capacity((m + 1) * (n + 1));
    for i in 0..=m {
        for j in 0..=n {
            net.push(
                volume.homogeneous_in_knot_box(knot_box, frame.point(DVec2::new(node(i, m), node(j, n)))),
            );
        }
    }
    let mut column = vec![DVec4::ZERO; m + 1];
    for j in 0..=n {
        for i in 0..=m {
            column[i] = net[i * (n + 1) + j];
        }
        solve_at_nodes(m, &mut column);
        for i in 0..=m {
            net[i * (n + 1) + j] = column[i];
        }
    }
    for row in net.chunks_exact_mut(n + 1) {
        solve_at_nodes(n, row);
    }
    if !volume.is_rational() {
        for point in &mut net {
            point.w = 1.0;
        }
    }
    BezierPatch::new(degree, net)
}

/// Solves `B_n` x = values for the Bernstein coefficients x, in place, by elimination with partial pivoting.
fn solve_at_nodes(degree: usize, values: &mut [DVec4]) {
    let order = degree + 1;
    let mut matrix: [[f64; MAX_ORDER]; MAX_ORDER] =
        std::array::from_fn(|i| basis::<MAX_ORDER, f64>(degree, i as f64 / degree as f64).value);
    for k in 0..order {
        let pivot = (k..order)
            .max_by(|&a, &b| matrix[a][k].abs().total_cmp(&matrix[b][k].abs()))
            .expect("the range holds k");
        matrix.swap(k, pivot);
        values.swap(k, pivot);
        let pivot_row = matrix[k];
        let pivot_value = values[k];
        for i in k + 1..order {
            let factor = matrix[i][k] / pivot_row[k];
            for (entry, above) in matrix[i].iter_mut().zip(pivot_row) {
                *entry -= factor * above;
            }
            values[i] -= factor * pivot_value;
        }
    }
    for k in (0..order).rev() {
        for j in k + 1..order {
            values[k] -= matrix[k][j] * values[j];
        }
        values[k] /= matrix[k][k];
    }
}
