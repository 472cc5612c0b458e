//! Curves on patches: what straight lines in the parameters become.

use glam::{DVec2, DVec3, DVec4};

use crate::math::bernstein::binomial;

use super::bezier_patch::BezierPatch;

/// What a term of the highest degree may change, in parts of the greatest number of the control points, for the curve to be taken
/// for one of lower degree: the rounding of the patch's own control points.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A rational Bézier curve over \[0, 1\].
#[derive(Clone, Debug, PartialEq)]
pub struct BezierCurve {
    /// Homogeneous: (w x, w y, w z, w).
    points: Vec<DVec4>,
}

impl BezierCurve {
    /// The degree, one less than the number of control points.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.points.len() - 1
    }

    /// The control points as (x, y, z, weight).
    pub fn control_points(&self) -> impl ExactSizeIterator<Item = DVec4> + '_ {
        self.points.iter().map(|point| (point.truncate() / point.w).extend(point.w))
    }

    /// Whether any weight is not 1.
    #[must_use]
    pub fn is_rational(&self) -> bool {
        self.points.iter().any(|point| point.w != 1.0)
    }

    /// The point at `t`, by de Casteljau's algorithm.
    #[must_use]
    pub fn eval(&self, t: f64) -> DVec3 {
        let mut points = self.points.clone();
        for level in (1..points.len()).rev() {
            for i in 0..level {
                points[i] = points[i].lerp(points[i + 1], t);
            }
        }
        points[0].truncate() / points[0].w
    }

    /// Lowers the degree as far as the curve stays the same within rounding.
    ///
    /// The coefficient of t^d changes the curve by no more than itself · 2^(1 - 2d), the greatest value of the Chebyshev polynomial of
    /// degree d over \[0, 1\] with leading coefficient 1. Where that is nothing, the control points of degree d - 1 follow from
    /// those of d by undoing degree elevation, from both ends to the middle.
    ///
    /// Source: Farin (2002), *Curves and Surfaces for CAGD*, section 6.4.
    fn lower_degree(&mut self) {
        let greatest = self.points.iter().map(|point| point.abs().max_element()).fold(0.0, f64::max);
        while self.degree() > 1 {
            let degree = self.degree();
            let leading: DVec4 = (0..=degree)
                .map(|i| {
                    let sign = if (degree - i).is_multiple_of(2) { 1.0 } else { -1.0 };
                    sign * binomial(degree, i) * self.points[i]
                })
                .sum();
            let change = leading.abs().max_element() * 0.5_f64.powi(2 * exponent(degree) - 1);
            // so written, NaN stays
            let is_nothing = change <= ROUNDING * greatest;
            if !is_nothing {
                return;
            }
            let d = degree as f64;
            let mut lower = vec![DVec4::ZERO; degree];
            lower[0] = self.points[0];
            lower[degree - 1] = self.points[degree];
            for i in 1..degree.div_ceil(2) {
                let k = i as f64;
                lower[i] = (d * self.points[i] - k * lower[i - 1]) / (d - k);
                let mirror = degree - 1 - i;
                if mirror > i {
                    lower[mirror] = (d * self.points[mirror + 1] - k * lower[mirror + 1]) / (d - k);
                }
            }
            self.points = lower;
        }
    }
}

/// A degree as an exponent.
fn exponent(degree: usize) -> i32 {
    i32::try_from(degree).expect("degrees are small")
}

impl BezierPatch {
    /// The curve on the patch whose parameters run straight from one place to another: exact, of the lowest degree.
    ///
    /// The patch over the rectangle that has the line as its diagonal, with control points b, is on the diagonal a curve of degree m + n with
    /// the control points `c_k` = sum over i + j = k of C(m, i) C(n, j) / C(m + n, k) `b_ij`. Its degree is lower where the line runs
    /// along few axes of the lattice: the sum of the lattice's degrees over the axes along which the undeformed line moves.
    ///
    /// Source: `DeRose` (1988), *Composing Bézier Simplexes*.
    ///
    /// ```
    /// use glam::{DVec2, DVec4};
    /// use trimray::patch::BezierPatch;
    ///
    /// // the saddle z = s t
    /// let points = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 1.0]];
    /// let saddle = BezierPatch::new([1, 1], points.map(|[x, y, z]| DVec4::new(x, y, z, 1.0)).to_vec());
    /// assert_eq!(saddle.curve([DVec2::ZERO, DVec2::ONE]).degree(), 2);
    /// assert_eq!(saddle.curve([DVec2::ZERO, DVec2::X]).degree(), 1);
    /// ```
    #[must_use]
    pub fn curve(&self, [from, to]: [DVec2; 2]) -> BezierCurve {
        let [m, n] = self.degree();
        let part: Vec<DVec4> = self.subpatch(from.min(to), from.max(to)).control_points().collect();
        let mut points = vec![DVec4::ZERO; m + n + 1];
        for i in 0..=m {
            for j in 0..=n {
                let row = if to.x < from.x { m - i } else { i };
                let column = if to.y < from.y { n - j } else { j };
                let share = binomial(m, i) * binomial(n, j) / binomial(m + n, i + j);
                points[i + j] += share * part[row * (n + 1) + column];
            }
        }
        if !self.is_rational() {
            points.iter_mut().for_each(|point| point.w = 1.0);
        }
        let mut curve = BezierCurve { points };
        curve.lower_degree();
        if !self.is_rational() {
            curve.points.iter_mut().for_each(|point| point.w = 1.0);
        }
        curve
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch::Composer;
    use crate::subdivide::Frame;
    use crate::test_support::{Noise, random_volume};

    #[test]
    fn curves_are_on_their_patches_and_of_the_degrees_of_the_axes_they_move_along() {
        let mut noise = Noise(8);
        for rational in [false, true] {
            let volume = random_volume(&mut noise, [2, 3, 4], [3, 4, 5], 0.3, rational);
            let cases = [
                ([DVec3::X, DVec3::Y], [DVec2::ZERO, DVec2::X], 2),
                ([DVec3::X, DVec3::Y], [DVec2::new(0.3, 0.9), DVec2::new(0.3, 0.1)], 3),
                ([DVec3::X, DVec3::Y], [DVec2::new(0.9, 0.2), DVec2::new(0.1, 0.7)], 5),
                ([DVec3::X + DVec3::Z, DVec3::Y], [DVec2::ZERO, DVec2::X], 6),
                // the steps along x cancel
                ([DVec3::X + DVec3::Z, DVec3::Y + DVec3::X], [DVec2::new(0.1, 0.8), DVec2::new(0.7, 0.2)], 7),
                ([DVec3::X + DVec3::Z, DVec3::Y + DVec3::X], [DVec2::new(0.1, 0.8), DVec2::new(0.7, 0.3)], 9),
            ];
            for ([s, t], line, degree) in cases {
                let frame = Frame { origin: DVec3::splat(0.05), s: 0.4 * s, t: 0.4 * t };
                let patch = Composer::default().compose(&volume, [0; 3], &frame);
                let curve = patch.curve(line);
                assert_eq!(curve.degree(), degree, "{s} {t} {line:?}");
                assert_eq!(curve.is_rational(), rational);
                for i in 0..=50 {
                    let at = f64::from(i) / 50.0;
                    let want = patch.eval(line[0].lerp(line[1], at)).position;
                    let got = curve.eval(at);
                    assert!(got.distance(want) < 2e-14, "{s} {t} {line:?} at {at}: {got} {want}");
                }
            }
        }
    }

    #[test]
    fn diagonals_of_patches_of_the_highest_degree() {
        let mut noise = Noise(10);
        let points: Vec<_> = (0..169).map(|_| noise.vector().extend(1.0)).collect();
        let patch = BezierPatch::new([12, 12], points);
        let curve = patch.curve([DVec2::ZERO, DVec2::ONE]);
        assert_eq!(curve.degree(), 24);
        for i in 0..=20 {
            let at = f64::from(i) / 20.0;
            assert!(curve.eval(at).distance(patch.eval(DVec2::splat(at)).position) < 1e-13);
        }
    }

    #[test]
    fn a_line_of_one_place_is_a_point() {
        let mut noise = Noise(9);
        let points: Vec<_> = (0..12).map(|_| noise.vector().extend(1.0)).collect();
        let patch = BezierPatch::new([2, 3], points);
        for st in [DVec2::ZERO, DVec2::ONE, DVec2::new(0.3, 0.6)] {
            let curve = patch.curve([st, st]);
            assert_eq!(curve.degree(), 1);
            assert!(curve.eval(0.7).distance(patch.eval(st).position) < 1e-15);
        }
    }
}
