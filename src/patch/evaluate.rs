//! Fast twins of [`BezierPatch::eval`]: one point by vectors of coordinates, eight points side by side.
//!
//! Each adds up the same products in the same order as the plain one, so all give the same bits. Degrees that volumes of
//! degree 1 to 4 give, and those of most cells, are compiled apart, others run through loops of their length.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4, f64x8};
use glam::{DVec2, DVec3, DVec4};

use crate::math::bernstein::{MAX_ORDER, basis};
use crate::math::lanes::{Real, Vector};

use super::bezier_patch::{BezierPatch, POLYNOMIAL, PatchPoint, RATIONAL, from_homogeneous};

/// Points and partials by s and t, side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointLanes<R> {
    pub(crate) position: Vector<R>,
    pub(crate) dp_ds: Vector<R>,
    pub(crate) dp_dt: Vector<R>,
}

/// Work on a patch that is compiled apart for orders that are common.
pub(crate) trait OrderWork {
    /// What the work gives.
    type Output;

    /// Does the work; to give `M` and `N` to [`BezierPatch::eval_one`] and [`BezierPatch::eval_lanes`].
    fn run<const M: usize, const N: usize>(self) -> Self::Output;
}

impl BezierPatch {
    /// Does work with this patch's orders as constants, or [`MAX_ORDER`] if they are not common.
    #[inline(always)]
    pub(crate) fn with_orders<W: OrderWork>(&self, work: W) -> W::Output {
        match self.degree() {
            [1, 1] => work.run::<2, 2>(),
            [1, 2] => work.run::<2, 3>(),
            [2, 1] => work.run::<3, 2>(),
            [2, 2] => work.run::<3, 3>(),
            [2, 4] => work.run::<3, 5>(),
            [4, 2] => work.run::<5, 3>(),
            [3, 3] => work.run::<4, 4>(),
            [3, 6] => work.run::<4, 7>(),
            [6, 3] => work.run::<7, 4>(),
            [4, 4] => work.run::<5, 5>(),
            [4, 6] => work.run::<5, 7>(),
            [5, 5] => work.run::<6, 6>(),
            [6, 6] => work.run::<7, 7>(),
            [6, 9] => work.run::<7, 10>(),
            [7, 7] => work.run::<8, 8>(),
            [8, 8] => work.run::<9, 9>(),
            [9, 9] => work.run::<10, 10>(),
            [10, 10] => work.run::<11, 11>(),
            [8, 12] => work.run::<9, 13>(),
            _ => work.run::<MAX_ORDER, MAX_ORDER>(),
        }
    }

    /// As [`Self::eval`], to the bit; a vector holds (w x, w y, w z, w). `M` and `N` as [`Self::with_orders`] gives them.
    #[inline(always)]
    pub(crate) fn eval_one<const M: usize, const N: usize, S: Simd>(&self, simd: S, st: DVec2) -> PatchPoint {
        if self.is_rational() {
            let [value, by_s, by_t] = homogeneous_one::<M, N, RATIONAL, S>(simd, self, st);
            from_homogeneous([DVec4::from_array(value), DVec4::from_array(by_s), DVec4::from_array(by_t)])
        } else {
            let [position, dp_ds, dp_dt] = homogeneous_one::<M, N, POLYNOMIAL, S>(simd, self, st);
            PatchPoint {
                position: first_three(position),
                dp_ds: first_three(dp_ds),
                dp_dt: first_three(dp_dt),
            }
        }
    }

    /// As [`Self::eval`] in each lane, to the bit. `M` and `N` as [`Self::with_orders`] gives them.
    #[inline(always)]
    pub(crate) fn eval_lanes<const M: usize, const N: usize, S: Simd>(
        &self,
        simd: S,
        st: [f64x8<S>; 2],
    ) -> PointLanes<f64x8<S>> {
        if self.is_rational() {
            let [value, by_s, by_t] = homogeneous_lanes::<M, N, RATIONAL, S>(simd, self, st);
            let position = Vector::new(value[0] / value[3], value[1] / value[3], value[2] / value[3]);
            let [dp_ds, dp_dt] = [partial(by_s, position, value[3]), partial(by_t, position, value[3])];
            PointLanes { position, dp_ds, dp_dt }
        } else {
            let [value, by_s, by_t] = homogeneous_lanes::<M, N, POLYNOMIAL, S>(simd, self, st);
            PointLanes {
                position: Vector::new(value[0], value[1], value[2]),
                dp_ds: Vector::new(by_s[0], by_s[1], by_s[2]),
                dp_dt: Vector::new(by_t[0], by_t[1], by_t[2]),
            }
        }
    }
}

/// A partial of a rational patch from that of its homogeneous value.
#[inline(always)]
fn partial<R: Real>(slope: [R; 4], position: Vector<R>, weight: R) -> Vector<R> {
    Vector::new(
        (slope[0] - slope[3] * position.x) / weight,
        (slope[1] - slope[3] * position.y) / weight,
        (slope[2] - slope[3] * position.z) / weight,
    )
}

/// A vector of a control point's first numbers, `STRIDE` of each, and its partials; the rest of the vector is of no meaning.
#[inline(always)]
fn homogeneous_one<const M: usize, const N: usize, const STRIDE: usize, S: Simd>(
    simd: S,
    patch: &BezierPatch,
    st: DVec2,
) -> [[f64; 4]; 3] {
    let [m, n] = orders::<M, N>(patch);
    let along_s = basis::<M, f64>(m - 1, st.x);
    let along_t = basis::<N, f64>(n - 1, st.y);
    let zero = f64x4::splat(simd, 0.0);
    let (mut position, mut by_s, mut by_t) = (zero, zero, zero);
    // four numbers from the start of the last point reach beyond it if it has but three
    let beyond = RATIONAL - STRIDE;
    let points = &patch.numbers()[..m * n * STRIDE + beyond];
    for i in 0..m {
        let row = &points[i * n * STRIDE..][..n * STRIDE + beyond];
        let (mut value, mut slope) = (zero, zero);
        for j in 0..n {
            let point = f64x4::from_slice(simd, &row[j * STRIDE..][..4]);
            value += point * along_t.value[j];
            slope += point * along_t.derivative[j];
        }
        position += value * along_s.value[i];
        by_s += value * along_s.derivative[i];
        by_t += slope * along_s.value[i];
    }
    [position.into(), by_s.into(), by_t.into()]
}

#[inline(always)]
fn first_three([x, y, z, _]: [f64; 4]) -> DVec3 {
    DVec3::new(x, y, z)
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
    let [mut position, mut by_s, mut by_t] = [zero; 3];
    let (points, _) = patch.numbers()[..m * n * K].as_chunks::<K>();
    for (i, row) in points.chunks_exact(n).enumerate() {
        let (mut value, mut slope) = (zero, zero);
        for (j, point) in row.iter().enumerate() {
            for k in 0..K {
                value[k] += along_t.value[j] * point[k];
                slope[k] += along_t.derivative[j] * point[k];
            }
        }
        for k in 0..K {
            position[k] += along_s.value[i] * value[k];
            by_s[k] += along_s.derivative[i] * value[k];
            by_t[k] += along_s.value[i] * slope[k];
        }
    }
    [position, by_s, by_t]
}

/// The patch's orders; constants where `M` and `N` are these.
#[inline(always)]
fn orders<const M: usize, const N: usize>(patch: &BezierPatch) -> [usize; 2] {
    if M == MAX_ORDER && N == MAX_ORDER { patch.degree().map(|degree| degree + 1) } else { [M, N] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Noise;
    use fearless_simd::{Level, dispatch};

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
                    let one = st.map(|st| dispatch!(level, simd => patch.with_orders(One(simd, &patch, st))));
                    assert_eq!(one, want, "{m} × {n}");
                    let lanes = dispatch!(level, simd => patch.with_orders(Lanes(simd, &patch, st)));
                    assert_eq!(lanes, want.map(|point| point.position), "{m} × {n} in lanes");
                }
            }
        }
    }

    struct One<'a, S>(S, &'a BezierPatch, DVec2);

    impl<S: Simd> OrderWork for One<'_, S> {
        type Output = PatchPoint;

        #[inline(always)]
        fn run<const M: usize, const N: usize>(self) -> PatchPoint {
            self.1.eval_one::<M, N, S>(self.0, self.2)
        }
    }

    struct Lanes<'a, S>(S, &'a BezierPatch, [DVec2; 8]);

    impl<S: Simd> OrderWork for Lanes<'_, S> {
        type Output = [DVec3; 8];

        #[inline(always)]
        fn run<const M: usize, const N: usize>(self) -> [DVec3; 8] {
            let Self(simd, patch, st) = self;
            let s: f64x8<S> = st.map(|st| st.x).simd_into(simd);
            let t: f64x8<S> = st.map(|st| st.y).simd_into(simd);
            let Vector { x, y, z } = patch.eval_lanes::<M, N, S>(simd, [s, t]).position;
            std::array::from_fn(|lane| DVec3::new(x[lane], y[lane], z[lane]))
        }
    }
}
