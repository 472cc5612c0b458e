//! Tensor-product Bézier patches over homogeneous control points.

use glam::{DVec2, DVec3, DVec4};

use crate::math::bernstein::{self, MAX_DEGREE, MAX_ORDER, basis};

/// A (rational) tensor-product Bézier patch of degree m × n over the unit square.
///
/// R(s, t) = Σ `P_ij` B(i, m)(s) B(j, n)(t), with `P_ij` = (w x, w y, w z, w) and a division by the weight at the end.
#[derive(Clone, Debug, PartialEq)]
pub struct BezierPatch {
    degree: [usize; 2],
    /// j (along t) fastest.
    control_points: Vec<DVec4>,
    rational: bool,
}

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

impl BezierPatch {
    /// A patch from homogeneous control points (w x, w y, w z, w), the index along t running fastest.
    ///
    /// # Panics
    /// If a degree is not in 1..=12 or the number of control points is not (m + 1)(n + 1).
    pub fn new(degree: [usize; 2], control_points: Vec<DVec4>) -> Self {
        assert!(degree.iter().all(|d| (1..=MAX_DEGREE).contains(d)), "degree {degree:?} is not in 1..=12");
        let want = (degree[0] + 1) * (degree[1] + 1);
        assert_eq!(control_points.len(), want, "a net of degree {degree:?} has {want} control points");
        let rational = control_points.iter().any(|point| point.w != 1.0);
        Self { degree, control_points, rational }
    }

    /// Degrees m and n along s and t.
    pub fn degree(&self) -> [usize; 2] {
        self.degree
    }

    /// Homogeneous control points (w x, w y, w z, w), the index along t running fastest.
    pub fn control_points(&self) -> &[DVec4] {
        &self.control_points
    }

    /// Whether any weight is not 1.
    pub fn is_rational(&self) -> bool {
        self.rational
    }

    /// Whether all weights are positive, so that the patch lies in the hull of its control points.
    pub fn has_positive_weights(&self) -> bool {
        self.control_points.iter().all(|point| point.w > 0.0)
    }

    /// Point and partial derivatives at any real parameters; meant for the unit square.
    ///
    /// Relative to the largest control point the error is a few times the degree in roundings.
    pub fn eval(&self, st: DVec2) -> PatchPoint {
        let [m, n] = self.degree;
        let along_s = basis::<MAX_ORDER, f64>(m, st.x);
        let along_t = basis::<MAX_ORDER, f64>(n, st.y);
        let mut sums = [DVec4::ZERO; 3];
        for (i, row) in self.control_points.chunks_exact(n + 1).enumerate() {
            let (mut value, mut slope) = (DVec4::ZERO, DVec4::ZERO);
            for (j, &point) in row.iter().enumerate() {
                value += along_t.value[j] * point;
                slope += along_t.derivative[j] * point;
            }
            sums[0] += along_s.value[i] * value;
            sums[1] += along_s.derivative[i] * value;
            sums[2] += along_s.value[i] * slope;
        }
        from_homogeneous(sums, self.rational)
    }

    /// Lowest and highest corner of the control points' box, which holds the patch over the unit square.
    ///
    /// Only if all weights are positive.
    pub fn hull_bounds(&self) -> [DVec3; 2] {
        self.control_points.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], point| {
            let position = point.truncate() / point.w;
            [low.min(position), high.max(position)]
        })
    }

    /// The part over `[low, high]`, as a patch over the unit square; by de Casteljau's algorithm.
    pub fn subpatch(&self, low: DVec2, high: DVec2) -> Self {
        let [m, n] = self.degree;
        let mut part = self.clone();
        for i in 0..=m {
            bernstein::restrict(&mut part.control_points[i * (n + 1)..], 1, n, low.y, high.y);
        }
        for j in 0..=n {
            bernstein::restrict(&mut part.control_points[j..], n + 1, m, low.x, high.x);
        }
        part
    }
}

/// Divides by the weight, which is 1 if the patch is not rational: the one place where homogeneous values become
/// points and partials.
#[inline(always)]
pub(super) fn from_homogeneous([value, by_s, by_t]: [DVec4; 3], rational: bool) -> PatchPoint {
    if !rational {
        let [position, dp_ds, dp_dt] = [value, by_s, by_t].map(DVec4::truncate);
        return PatchPoint { position, dp_ds, dp_dt };
    }
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
