//! Fast twins of [`BezierPatch::eval`]: one point by vectors of coordinates, eight points side by side.
//!
//! Each adds up the same products in the same order as the plain one, so all give the same bits. Degrees that volumes of
//! degree 1 to 4 give are compiled apart, others run through loops of their length.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4, f64x8};
use glam::{DVec2, DVec4};

use crate::math::bernstein::{MAX_ORDER, basis};
use crate::math::lanes::{Real, Vector};

use super::bezier_patch::{BezierPatch, PatchPoint, from_homogeneous};

/// Points and partials by s and t, side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointLanes<R> {
    pub(crate) position: Vector<R>,
    pub(crate) dp_ds: Vector<R>,
    pub(crate) dp_dt: Vector<R>,
}

/// Calls a function with the patch's orders as constants where they are common, else with [`MAX_ORDER`].
macro_rules! with_orders {
    ($patch:expr, $call:ident ( $($argument:expr),* )) => {
        match $patch.degree() {
            [1, 1] => $call::<2, 2, _>($($argument),*),
            [1, 2] => $call::<2, 3, _>($($argument),*),
            [2, 1] => $call::<3, 2, _>($($argument),*),
            [2, 2] => $call::<3, 3, _>($($argument),*),
            [2, 4] => $call::<3, 5, _>($($argument),*),
            [4, 2] => $call::<5, 3, _>($($argument),*),
            [3, 3] => $call::<4, 4, _>($($argument),*),
            [3, 6] => $call::<4, 7, _>($($argument),*),
            [6, 3] => $call::<7, 4, _>($($argument),*),
            [4, 4] => $call::<5, 5, _>($($argument),*),
            [4, 6] => $call::<5, 7, _>($($argument),*),
            [6, 6] => $call::<7, 7, _>($($argument),*),
            [6, 9] => $call::<7, 10, _>($($argument),*),
            [8, 8] => $call::<9, 9, _>($($argument),*),
            [8, 12] => $call::<9, 13, _>($($argument),*),
            _ => $call::<MAX_ORDER, MAX_ORDER, _>($($argument),*),
        }
    };
}

impl BezierPatch {
    /// As [`Self::eval`], to the bit.
    #[inline(always)]
    pub(crate) fn eval_one<S: Simd>(&self, simd: S, st: DVec2) -> PatchPoint {
        with_orders!(self, one(simd, self, st))
    }

    /// As [`Self::eval`] in each lane, to the bit.
    #[inline(always)]
    pub(crate) fn eval_lanes<S: Simd>(&self, simd: S, [s, t]: [f64x8<S>; 2]) -> PointLanes<f64x8<S>> {
        with_orders!(self, lanes(simd, self, [s, t]))
    }
}

/// One point: a vector holds (w x, w y, w z, w).
///
/// `M` and `N` are the patch's orders, or [`MAX_ORDER`] for any.
#[inline(always)]
fn one<const M: usize, const N: usize, S: Simd>(simd: S, patch: &BezierPatch, st: DVec2) -> PatchPoint {
    simd.vectorize(
        #[inline(always)]
        || {
            let [m, n] = orders::<M, N>(patch);
            let along_s = basis::<M, f64>(m - 1, st.x);
            let along_t = basis::<N, f64>(n - 1, st.y);
            let zero = f64x4::splat(simd, 0.0);
            let mut sums = [zero; 3];
            for (i, row) in patch.control_points()[..m * n].chunks_exact(n).enumerate() {
                let (mut value, mut slope) = (zero, zero);
                for (j, point) in row.iter().enumerate() {
                    let point: f64x4<S> = point.to_array().simd_into(simd);
                    value += point * along_t.value[j];
                    slope += point * along_t.derivative[j];
                }
                sums[0] += value * along_s.value[i];
                sums[1] += value * along_s.derivative[i];
                sums[2] += slope * along_s.value[i];
            }
            from_homogeneous(sums.map(|sum| DVec4::from_slice(sum.as_slice())), patch.is_rational())
        },
    )
}

#[inline(always)]
fn lanes<const M: usize, const N: usize, S: Simd>(
    simd: S,
    patch: &BezierPatch,
    [s, t]: [f64x8<S>; 2],
) -> PointLanes<f64x8<S>> {
    simd.vectorize(
        #[inline(always)]
        || {
            if patch.is_rational() {
                let [value, by_s, by_t] = homogeneous_lanes::<M, N, 4, S>(simd, patch, [s, t]);
                let position = [0, 1, 2].map(|k| value[k] / value[3]);
                let partial =
                    |slope: [f64x8<S>; 4]| vector([0, 1, 2].map(|k| (slope[k] - slope[3] * position[k]) / value[3]));
                PointLanes { position: vector(position), dp_ds: partial(by_s), dp_dt: partial(by_t) }
            } else {
                let [value, by_s, by_t] = homogeneous_lanes::<M, N, 3, S>(simd, patch, [s, t]);
                PointLanes { position: vector(value), dp_ds: vector(by_s), dp_dt: vector(by_t) }
            }
        },
    )
}

/// The first K of (w x, w y, w z, w), and their partials.
#[inline(always)]
fn homogeneous_lanes<const M: usize, const N: usize, const K: usize, S: Simd>(
    simd: S,
    patch: &BezierPatch,
    [s, t]: [f64x8<S>; 2],
) -> [[f64x8<S>; K]; 3] {
    let [m, n] = orders::<M, N>(patch);
    let along_s = basis::<M, f64x8<S>>(m - 1, s);
    let along_t = basis::<N, f64x8<S>>(n - 1, t);
    let zero = [f64x8::splat(simd, 0.0); K];
    let mut sums = [zero; 3];
    for (i, row) in patch.control_points()[..m * n].chunks_exact(n).enumerate() {
        let (mut value, mut slope) = (zero, zero);
        for (j, point) in row.iter().enumerate() {
            let point = point.to_array();
            for k in 0..K {
                value[k] += along_t.value[j] * point[k];
                slope[k] += along_t.derivative[j] * point[k];
            }
        }
        for k in 0..K {
            sums[0][k] += along_s.value[i] * value[k];
            sums[1][k] += along_s.derivative[i] * value[k];
            sums[2][k] += along_s.value[i] * slope[k];
        }
    }
    sums
}

/// The patch's orders; constants where `M` and `N` are these.
#[inline(always)]
fn orders<const M: usize, const N: usize>(patch: &BezierPatch) -> [usize; 2] {
    if M == MAX_ORDER && N == MAX_ORDER { patch.degree().map(|degree| degree + 1) } else { [M, N] }
}

fn vector<R: Real>([x, y, z]: [R; 3]) -> Vector<R> {
    Vector { x, y, z }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;
    use crate::test_support::Noise;

    #[test]
    fn every_twin_gives_the_bits_of_the_plain_one() {
        let mut noise = Noise(3);
        let level = Level::new();
        for m in 1..=12 {
            for n in 1..=12 {
                for rational in [false, true] {
                    let mut weight = || if rational { 1.5 + noise.next() } else { 1.0 };
                    let weights: Vec<_> = (0..(m + 1) * (n + 1)).map(|_| weight()).collect();
                    let points = weights.iter().map(|&w| noise.vector().extend(w)).collect();
                    let patch = BezierPatch::new([m, n], points);
                    let st: [DVec2; 8] =
                        std::array::from_fn(|_| DVec2::new(noise.next() + 0.5, noise.next() + 0.5));
                    let want = st.map(|st| patch.eval(st));
                    let one = dispatch!(level, simd => st.map(|st| patch.eval_one(simd, st)));
                    assert_eq!(one, want, "{m} × {n}");
                    let lanes = dispatch!(level, simd => in_lanes(simd, &patch, st));
                    assert_eq!(lanes, want.map(|point| point.position), "{m} × {n} in lanes");
                }
            }
        }
    }

    #[inline(always)]
    fn in_lanes<S: Simd>(simd: S, patch: &BezierPatch, st: [DVec2; 8]) -> [glam::DVec3; 8] {
        let s: f64x8<S> = st.map(|st| st.x).simd_into(simd);
        let t: f64x8<S> = st.map(|st| st.y).simd_into(simd);
        let Vector { x, y, z } = patch.eval_lanes(simd, [s, t]).position;
        std::array::from_fn(|lane| glam::DVec3::new(x[lane], y[lane], z[lane]))
    }
}
