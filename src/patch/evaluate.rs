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

    /// Does the work; to give `M`, `N` and `STRIDE` to [`BezierPatch::eval_one`] and [`BezierPatch::eval_lanes`].
    fn run<const M: usize, const N: usize, const STRIDE: usize>(self) -> Self::Output;
}

impl BezierPatch {
    /// Does work with this patch's orders as constants, or [`MAX_ORDER`] if they are not common, and with the numbers of a control
    /// point. What is common is what volumes of degrees 1 to 4 give in the frames of lowest degree, cells, and quadrics.
    #[inline(always)]
    pub(crate) fn with_orders<W: OrderWork>(&self, work: W) -> W::Output {
        if self.is_rational() {
            return match self.degree() {
                [2, 2] => work.run::<3, 3, RATIONAL>(),
                [4, 4] => work.run::<5, 5, RATIONAL>(),
                [6, 6] => work.run::<7, 7, RATIONAL>(),
                _ => work.run::<MAX_ORDER, MAX_ORDER, RATIONAL>(),
            };
        }
        match self.degree() {
            [1, 1] => work.run::<2, 2, POLYNOMIAL>(),
            [1, 2] => work.run::<2, 3, POLYNOMIAL>(),
            [2, 1] => work.run::<3, 2, POLYNOMIAL>(),
            [2, 2] => work.run::<3, 3, POLYNOMIAL>(),
            [2, 4] => work.run::<3, 5, POLYNOMIAL>(),
            [4, 2] => work.run::<5, 3, POLYNOMIAL>(),
            [3, 3] => work.run::<4, 4, POLYNOMIAL>(),
            [3, 6] => work.run::<4, 7, POLYNOMIAL>(),
            [6, 3] => work.run::<7, 4, POLYNOMIAL>(),
            [4, 4] => work.run::<5, 5, POLYNOMIAL>(),
            [5, 5] => work.run::<6, 6, POLYNOMIAL>(),
            [6, 6] => work.run::<7, 7, POLYNOMIAL>(),
            [7, 7] => work.run::<8, 8, POLYNOMIAL>(),
            [8, 8] => work.run::<9, 9, POLYNOMIAL>(),
            [9, 9] => work.run::<10, 10, POLYNOMIAL>(),
            [10, 10] => work.run::<11, 11, POLYNOMIAL>(),
            _ => work.run::<MAX_ORDER, MAX_ORDER, POLYNOMIAL>(),
        }
    }

    /// As [`Self::eval`], to the bit; a vector holds (w x, w y, w z, w). `M`, `N` and `STRIDE` as [`Self::with_orders`] gives them.
    #[inline(always)]
    pub(crate) fn eval_one<const M: usize, const N: usize, const STRIDE: usize, S: Simd>(
        &self,
        simd: S,
        st: DVec2,
    ) -> PatchPoint {
        let [position, dp_ds, dp_dt] = homogeneous_one::<M, N, STRIDE, S>(simd, self, st);
        if STRIDE == RATIONAL {
            from_homogeneous([position, dp_ds, dp_dt].map(DVec4::from_array))
        } else {
            PatchPoint {
                position: first_three(position),
                dp_ds: first_three(dp_ds),
                dp_dt: first_three(dp_dt),
            }
        }
    }

    /// As [`Self::eval`] in each lane, to the bit. `M`, `N` and `STRIDE` as [`Self::with_orders`] gives them.
    #[inline(always)]
    pub(crate) fn eval_lanes<const M: usize, const N: usize, const STRIDE: usize, S: Simd>(
        &self,
        simd: S,
        st: [f64x8<S>; 2],
    ) -> PointLanes<f64x8<S>> {
        let [value, by_s, by_t] = homogeneous_lanes::<M, N, STRIDE, S>(simd, self, st);
        let first_three = |vector: [f64x8<S>; STRIDE]| Vector::new(vector[0], vector[1], vector[2]);
        if STRIDE == RATIONAL {
            let weight = value[RATIONAL - 1];
            let position = Vector::new(value[0] / weight, value[1] / weight, value[2] / weight);
            let [dp_ds, dp_dt] = [by_s, by_t].map(|slope| partial(slope, position, weight));
            PointLanes { position, dp_ds, dp_dt }
        } else {
            PointLanes { position: first_three(value), dp_ds: first_three(by_s), dp_dt: first_three(by_t) }
        }
    }
}

/// A partial of a rational patch from that of its homogeneous value.
#[inline(always)]
fn partial<R: Real, const K: usize>(slope: [R; K], position: Vector<R>, weight: R) -> Vector<R> {
    Vector::new(
        (slope[0] - slope[K - 1] * position.x) / weight,
        (slope[1] - slope[K - 1] * position.y) / weight,
        (slope[2] - slope[K - 1] * position.z) / weight,
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
    use crate::math::lanes::with_vectors;
    use crate::test_support::Noise;
    use fearless_simd::Level;

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
                    let one =
                        st.map(|st| with_vectors!(level, simd => patch.with_orders(One(simd, &patch, st))));
                    assert_eq!(one, want, "{m} × {n}");
                    let lanes = with_vectors!(level, simd => patch.with_orders(Lanes(simd, &patch, st)));
                    assert_eq!(lanes, want.map(|point| point.position), "{m} × {n} in lanes");
                }
            }
        }
    }

    struct One<'a, S>(S, &'a BezierPatch, DVec2);

    impl<S: Simd> OrderWork for One<'_, S> {
        type Output = PatchPoint;

        #[inline(always)]
        fn run<const M: usize, const N: usize, const STRIDE: usize>(self) -> PatchPoint {
            self.1.eval_one::<M, N, STRIDE, S>(self.0, self.2)
        }
    }

    struct Lanes<'a, S>(S, &'a BezierPatch, [DVec2; 8]);

    impl<S: Simd> OrderWork for Lanes<'_, S> {
        type Output = [DVec3; 8];

        #[inline(always)]
        fn run<const M: usize, const N: usize, const STRIDE: usize>(self) -> [DVec3; 8] {
            let Self(simd, patch, st) = self;
            let s: f64x8<S> = st.map(|st| st.x).simd_into(simd);
            let t: f64x8<S> = st.map(|st| st.y).simd_into(simd);
            let Vector { x, y, z } = patch.eval_lanes::<M, N, STRIDE, S>(simd, [s, t]).position;
            std::array::from_fn(|lane| DVec3::new(x[lane], y[lane], z[lane]))
        }
    }
}
