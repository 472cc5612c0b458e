//! Tensor-product Bézier patches over homogeneous control points.

use glam::{DVec2, DVec3, DVec4};

use crate::math::bernstein::{self, MAX_DEGREE, MAX_ORDER, basis};
use crate::math::bounds;

/// A (rational) tensor-product Bézier patch of degree m × n over the unit square.
///
/// R(s, t) = Σ `P_ij` B(i, m)(s) B(j, n)(t), with `P_ij` = (w x, w y, w z, w) and a division by the weight at the end.
#[derive(Clone, Debug)]
pub struct BezierPatch {
    /// Control points, j (along t) fastest, of [`Self::stride`] numbers each: weights are kept only if one is not 1.
    ///
    /// Then follow the extent's numbers: magnitude, NaN if it has not been found, and, if weights are kept, greatest and
    /// least weight. So four numbers can be read from the start of every control point.
    numbers: Box<[f64]>,
    degree: [u8; 2],
    rational: bool,
}

/// How large the numbers of a patch's control points are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Extent {
    /// Greatest length of (w x, w y, w z).
    pub(crate) magnitude: f64,
    pub(crate) greatest_weight: f64,
    pub(crate) least_weight: f64,
}

/// Numbers of a control point of a polynomial patch, and of a rational one.
pub(super) const POLYNOMIAL: usize = 3;
pub(super) const RATIONAL: usize = 4;

/// A patch's point and partial derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchPoint {
    /// The point.
    pub position: DVec3,
    /// Partial derivative by s.
    pub dp_ds: DVec3,
    /// Partial derivative by t.
    pub dp_dt: DVec3,
}

impl PatchPoint {
    /// The step of the parameters whose partials come nearest to an offset (Gauss-Newton); none where they are parallel.
    pub(crate) fn step_along(&self, offset: DVec3) -> DVec2 {
        let (s, t) = (self.dp_ds, self.dp_dt);
        let normal = s.cross(t);
        let step =
            DVec2::new(offset.cross(t).dot(normal), s.cross(offset).dot(normal)) / normal.length_squared();
        if step.is_finite() { step } else { DVec2::ZERO }
    }

    /// Unit normal, by the right-hand rule from s to t; 0 where the partials are parallel.
    pub fn normal(&self) -> DVec3 {
        self.dp_ds.cross(self.dp_dt).normalize_or_zero()
    }
}

impl BezierPatch {
    /// A patch from homogeneous control points (w x, w y, w z, w), the index along t running fastest.
    ///
    /// # Panics
    /// If a degree is not in 1..=12 or the number of control points is not (m + 1)(n + 1).
    pub fn new(degree: [usize; 2], control_points: Vec<DVec4>) -> Self {
        let rational = control_points.iter().any(|point| point.w != 1.0);
        if rational {
            Self::from_numbers(degree, true, control_points.iter().map(DVec4::to_array))
        } else {
            Self::polynomial(degree, control_points.iter().map(|point| point.truncate()))
        }
    }

    /// A patch from control points of weight 1; panics as [`Self::new`].
    pub(super) fn polynomial(degree: [usize; 2], control_points: impl Iterator<Item = DVec3>) -> Self {
        Self::from_numbers(degree, false, control_points.map(|point| point.to_array()))
    }

    fn from_numbers<const STRIDE: usize>(
        degree: [usize; 2],
        rational: bool,
        points: impl Iterator<Item = [f64; STRIDE]>,
    ) -> Self {
        assert!(degree.iter().all(|d| (1..=MAX_DEGREE).contains(d)), "degree {degree:?} is not in 1..=12");
        let want = (degree[0] + 1) * (degree[1] + 1);
        let mut numbers = Vec::with_capacity(want * STRIDE + extent_numbers(rational));
        for point in points {
            numbers.extend_from_slice(&point);
        }
        let got = numbers.len() / STRIDE;
        assert_eq!(got, want, "a net of degree {degree:?} has {want} control points");
        numbers.resize(want * STRIDE + extent_numbers(rational), 0.0);
        let degree = degree.map(|degree| u8::try_from(degree).expect("a degree is at most 12"));
        let mut patch = Self { numbers: numbers.into_boxed_slice(), degree, rational };
        let Extent { magnitude, greatest_weight, least_weight } = patch.measured();
        let extent = [magnitude, greatest_weight, least_weight];
        patch.numbers[want * STRIDE..].copy_from_slice(&extent[..extent_numbers(rational)]);
        patch
    }

    fn measured(&self) -> Extent {
        if self.rational {
            let points = self.points::<RATIONAL>();
            let weights = points.iter().map(|point| point[3]);
            Extent {
                magnitude: greatest_length(points),
                greatest_weight: weights.clone().fold(0.0, f64::max),
                least_weight: weights.fold(f64::INFINITY, f64::min),
            }
        } else {
            let magnitude = greatest_length(self.points::<POLYNOMIAL>());
            Extent { magnitude, greatest_weight: 1.0, least_weight: 1.0 }
        }
    }

    /// The control points' numbers, as many of each as [`Self::stride`] says.
    #[inline]
    fn points<const STRIDE: usize>(&self) -> &[[f64; STRIDE]] {
        self.numbers[..self.count() * STRIDE].as_chunks().0
    }

    /// Control points of a patch that is not rational.
    #[inline]
    pub(crate) fn positions(&self) -> impl ExactSizeIterator<Item = DVec3> {
        debug_assert!(!self.rational, "weights are needed");
        self.points::<POLYNOMIAL>().iter().map(|&point| DVec3::from_array(point))
    }

    /// Degrees m and n along s and t.
    #[inline]
    pub fn degree(&self) -> [usize; 2] {
        [usize::from(self.degree[0]), usize::from(self.degree[1])]
    }

    /// Number of control points.
    #[inline]
    fn count(&self) -> usize {
        (usize::from(self.degree[0]) + 1) * (usize::from(self.degree[1]) + 1)
    }

    /// Numbers kept of a control point.
    #[inline]
    fn stride(&self) -> usize {
        if self.rational { RATIONAL } else { POLYNOMIAL }
    }

    /// Homogeneous control points (w x, w y, w z, w), the index along t running fastest.
    pub fn control_points(&self) -> impl ExactSizeIterator<Item = DVec4> + Clone {
        let stride = self.stride();
        self.numbers[..self.count() * stride].chunks_exact(stride).map(|point| {
            let weight = point.get(3).copied().unwrap_or(1.0);
            DVec4::new(point[0], point[1], point[2], weight)
        })
    }

    /// The numbers of the control points, [`POLYNOMIAL`] or [`RATIONAL`] each, and at least one more.
    #[inline(always)]
    pub(super) fn numbers(&self) -> &[f64] {
        &self.numbers
    }

    /// How large the control points are.
    pub(crate) fn extent(&self) -> Extent {
        match self.numbers[self.count() * self.stride()..] {
            [magnitude, ..] if magnitude.is_nan() => self.measured(),
            [magnitude, greatest_weight, least_weight] => Extent { magnitude, greatest_weight, least_weight },
            ref extent => Extent { magnitude: extent[0], greatest_weight: 1.0, least_weight: 1.0 },
        }
    }

    /// Memory of the control points in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.numbers)
    }

    /// Whether any weight is not 1.
    #[inline]
    pub fn is_rational(&self) -> bool {
        self.rational
    }

    /// Whether all weights are positive, so that the patch lies in the hull of its control points.
    pub fn has_positive_weights(&self) -> bool {
        !self.rational || self.control_points().all(|point| point.w > 0.0)
    }

    /// Whether all control points are finite.
    pub(crate) fn is_finite(&self) -> bool {
        self.numbers[..self.count() * self.stride()].iter().all(|number| number.is_finite())
    }

    /// Point and partial derivatives at any real parameters; meant for the unit square.
    ///
    /// Relative to the largest control point the error is a few times the degree in roundings.
    pub fn eval(&self, st: DVec2) -> PatchPoint {
        if self.rational {
            let [value, by_s, by_t] = self.sums::<RATIONAL>(st);
            from_homogeneous([value, by_s, by_t].map(DVec4::from_array))
        } else {
            let [position, dp_ds, dp_dt] = self.sums::<POLYNOMIAL>(st);
            PatchPoint { position: position.into(), dp_ds: dp_ds.into(), dp_dt: dp_dt.into() }
        }
    }

    /// The point and its weight.
    pub(crate) fn homogeneous(&self, st: DVec2) -> (DVec3, f64) {
        if self.rational {
            let value = DVec4::from_array(self.value::<RATIONAL>(st));
            (value.truncate() / value.w, value.w)
        } else {
            (self.value::<POLYNOMIAL>(st).into(), 1.0)
        }
    }

    /// The homogeneous point alone, to the bits of [`Self::sums`].
    #[inline]
    fn value<const STRIDE: usize>(&self, st: DVec2) -> [f64; STRIDE] {
        let [m, n] = self.degree();
        let along_s = basis::<MAX_ORDER, f64>(m, st.x).value;
        let along_t = basis::<MAX_ORDER, f64>(n, st.y).value;
        let mut sum = [0.0; STRIDE];
        for (row, along_s) in self.points::<STRIDE>().chunks_exact(n + 1).zip(along_s) {
            let mut of_row = [0.0; STRIDE];
            for (point, along_t) in row.iter().zip(along_t) {
                for k in 0..STRIDE {
                    of_row[k] += along_t * point[k];
                }
            }
            for k in 0..STRIDE {
                sum[k] += along_s * of_row[k];
            }
        }
        sum
    }

    /// The homogeneous point and its partials.
    #[inline]
    fn sums<const STRIDE: usize>(&self, st: DVec2) -> [[f64; STRIDE]; 3] {
        let [m, n] = self.degree();
        let along_s = basis::<MAX_ORDER, f64>(m, st.x);
        let along_t = basis::<MAX_ORDER, f64>(n, st.y);
        let points = self.points::<STRIDE>();
        let zero = [0.0; STRIDE];
        let mut sums = [zero; 3];
        for (i, row) in points.chunks_exact(n + 1).enumerate() {
            let (mut value, mut slope) = (zero, zero);
            for (j, point) in row.iter().enumerate() {
                for k in 0..STRIDE {
                    value[k] += along_t.value[j] * point[k];
                    slope[k] += along_t.derivative[j] * point[k];
                }
            }
            for k in 0..STRIDE {
                sums[0][k] += along_s.value[i] * value[k];
                sums[1][k] += along_s.derivative[i] * value[k];
                sums[2][k] += along_s.value[i] * slope[k];
            }
        }
        sums
    }

    /// Lowest and highest corner of the control points' box, which holds the patch over the unit square.
    ///
    /// Only if all weights are positive.
    pub fn hull_bounds(&self) -> [DVec3; 2] {
        if self.rational {
            bounds::around(self.control_points().map(|point| point.truncate() / point.w))
        } else {
            bounds::around(self.positions())
        }
    }

    /// The part over `[low, high]`, as a patch over the unit square; by de Casteljau's algorithm.
    pub fn subpatch(&self, low: DVec2, high: DVec2) -> Self {
        let mut part = self.clone();
        part.numbers[self.count() * self.stride()] = f64::NAN;
        if self.rational {
            part.restrict::<RATIONAL>(low, high);
        } else {
            part.restrict::<POLYNOMIAL>(low, high);
        }
        part
    }

    fn restrict<const STRIDE: usize>(&mut self, low: DVec2, high: DVec2) {
        let [m, n] = self.degree();
        let width = (n + 1) * STRIDE;
        let points = &mut self.numbers[..(m + 1) * width];
        for row in points.chunks_exact_mut(width) {
            bernstein::restrict_rows(row, STRIDE, n, low.y, high.y);
        }
        bernstein::restrict_rows(points, width, m, low.x, high.x);
    }
}

/// The greatest length of the points' first three coordinates.
fn greatest_length<const STRIDE: usize>(points: &[[f64; STRIDE]]) -> f64 {
    // several side by side, for none waits for another
    let mut squares = [0.0; 4];
    for some in points.chunks(squares.len()) {
        for (greatest, point) in squares.iter_mut().zip(some) {
            let square = point[0] * point[0] + point[1] * point[1] + point[2] * point[2];
            *greatest = if square > *greatest { square } else { *greatest };
        }
    }
    squares.into_iter().fold(0.0, f64::max).sqrt()
}

impl PartialEq for BezierPatch {
    fn eq(&self, other: &Self) -> bool {
        let points = |patch: &Self| patch.count() * patch.stride();
        self.degree == other.degree
            && self.rational == other.rational
            && self.numbers[..points(self)] == other.numbers[..points(other)]
    }
}

/// Numbers of an [`Extent`] that a patch keeps.
fn extent_numbers(rational: bool) -> usize {
    if rational { 3 } else { 1 }
}

/// Divides by the weight: the one place where homogeneous values become points and partials.
#[inline(always)]
pub(super) fn from_homogeneous([value, by_s, by_t]: [DVec4; 3]) -> PatchPoint {
    let position = value.truncate() / value.w;
    let partial = |slope: DVec4| (slope.truncate() - slope.w * position) / value.w;
    PatchPoint { position, dp_ds: partial(by_s), dp_dt: partial(by_t) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter of the unit cylinder, 0 <= z <= 2, exact as a rational patch of degree 2 × 1.
    fn quarter_cylinder() -> BezierPatch {
        let w = std::f64::consts::FRAC_1_SQRT_2;
        let ring = [(1.0, 0.0, 1.0), (1.0, 1.0, w), (0.0, 1.0, 1.0)];
        let points = ring
            .iter()
            .flat_map(|&(x, y, w)| [0.0, 2.0].map(|z| DVec4::new(w * x, w * y, w * z, w)))
            .collect();
        BezierPatch::new([2, 1], points)
    }

    #[test]
    fn a_rational_patch_is_the_cylinder() {
        let patch = quarter_cylinder();
        assert!(patch.is_rational() && patch.has_positive_weights());
        let [low, high] = patch.hull_bounds();
        for i in 0..=20 {
            for j in 0..=5 {
                let st = DVec2::new(f64::from(i) / 20.0, f64::from(j) / 5.0);
                let got = patch.eval(st);
                let radius = got.position.truncate().length();
                assert!((radius - 1.0).abs() < 1e-15 * 4.0, "at {st}: radius {radius}");
                assert!((got.position.z - 2.0 * st.y).abs() < 1e-15 * 4.0);
                assert!(got.dp_ds.truncate().dot(got.position.truncate()).abs() < 1e-14, "tangent at {st}");
                assert!((got.dp_dt - DVec3::new(0.0, 0.0, 2.0)).length() < 1e-14);
                assert!(got.position.cmpge(low - 1e-15).all() && got.position.cmple(high + 1e-15).all());
            }
        }
    }

    #[test]
    fn subpatch_is_the_same_surface() {
        let patch = quarter_cylinder();
        let (low, high) = (DVec2::new(0.25, 0.1), DVec2::new(0.5, 1.0));
        let part = patch.subpatch(low, high);
        for (s, t) in [(0.0, 0.0), (0.3, 0.7), (1.0, 1.0)] {
            let st = DVec2::new(s, t);
            let (got, want) = (part.eval(st), patch.eval(low + st * (high - low)));
            assert!((got.position - want.position).length() < 1e-15 * 4.0);
            assert!((got.dp_ds - want.dp_ds * 0.25).length() < 1e-14);
        }
    }
}
