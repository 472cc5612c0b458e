//! Clamped uniform knot vectors.

use thiserror::Error;

use crate::math::bernstein::binomial;

/// Highest degree of a volume along one axis.
pub const MAX_VOLUME_DEGREE: usize = 4;

/// Number of basis functions that are not 0 in one knot interval at [`MAX_VOLUME_DEGREE`].
pub(crate) const MAX_VOLUME_ORDER: usize = MAX_VOLUME_DEGREE + 1;

/// Why a knot vector cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum KnotError {
    /// The degree is not supported.
    #[error("degree {degree} is not supported (valid: 1 to 4)")]
    Degree {
        /// The degree asked for.
        degree: usize,
    },
    /// Fewer control points than one interval needs.
    #[error("{points} control points are too few for degree {degree} (valid: at least {})", degree + 1)]
    Points {
        /// The degree asked for.
        degree: usize,
        /// The number of control points asked for.
        points: usize,
    },
    /// The domain is empty, reversed or not finite, or too short for its intervals to differ.
    #[error("the domain [{start}, {end}] has no extent")]
    Domain {
        /// Start of the domain.
        start: f64,
        /// End of the domain.
        end: f64,
    },
}

/// A clamped knot vector with uniform intervals over its domain.
///
/// For degree k and n control points there are n + k + 1 knots U, the first and the last k + 1 of them
/// equal, and n - k intervals `[U_i, U_{i+1}]`, `k <= i < n`. Intervals are counted from 0 here: interval
/// j is the one at i = k + j.
///
/// Source: Feng, Nishita, Jin, Peng (2002), section 3.1.
#[derive(Clone, Debug, PartialEq)]
pub struct KnotVector {
    degree: usize,
    points: usize,
    knots: Vec<f64>,
    extraction: Vec<BernsteinRows>,
}

/// Basis functions of an interval in Bernstein form: number r is the sum over i of `rows[i][r]` a^i (1 - a)^(k - i),
/// with a from 0 to 1 over the interval.
pub(crate) type BernsteinRows = [LocalBasis; MAX_VOLUME_ORDER];

/// Values of the basis functions that are not 0 in an interval, lowest index first.
pub(crate) type LocalBasis = [f64; MAX_VOLUME_ORDER];

impl KnotVector {
    /// The clamped uniform knot vector over `[start, end]`.
    ///
    /// # Errors
    /// [`KnotError`] if the degree is not in 1..=4, the control points do not outnumber the degree, or
    /// the domain has no extent.
    pub fn clamped_uniform(degree: usize, points: usize, start: f64, end: f64) -> Result<Self, KnotError> {
        if !(1..=MAX_VOLUME_DEGREE).contains(&degree) {
            return Err(KnotError::Degree { degree });
        }
        if points <= degree {
            return Err(KnotError::Points { degree, points });
        }
        let intervals = points - degree;
        let mut knots = vec![start; degree + 1];
        for i in 1..intervals {
            let fraction = i as f64 / intervals as f64;
            knots.push(start + (end - start) * fraction);
        }
        knots.extend(std::iter::repeat_n(end, degree + 1));
        let rising = knots[degree..=points].windows(2).all(|pair| pair[0] < pair[1]);
        if !(rising && start.is_finite() && end.is_finite() && (end - start).is_finite()) {
            return Err(KnotError::Domain { start, end });
        }
        let mut made = Self { degree, points, knots, extraction: Vec::new() };
        made.extraction = (0..intervals).map(|interval| made.extract(interval)).collect();
        Ok(made)
    }

    /// Degree k.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Number of control points n.
    #[must_use]
    pub fn points(&self) -> usize {
        self.points
    }

    /// All n + k + 1 knots.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Number of knot intervals, n - k.
    #[must_use]
    pub fn intervals(&self) -> usize {
        self.points - self.degree
    }

    /// The knots that bound the intervals: start of the domain, inner knots, end of the domain.
    #[must_use]
    pub fn breakpoints(&self) -> &[f64] {
        &self.knots[self.degree..=self.points]
    }

    /// The interval of a parameter: half open `[U_i, U_{i+1})`, the last one closed.
    ///
    /// `None` outside the domain and for NaN.
    #[must_use]
    pub fn interval(&self, parameter: f64) -> Option<usize> {
        let breakpoints = self.breakpoints();
        let last = breakpoints.len() - 1;
        if !(parameter >= breakpoints[0] && parameter <= breakpoints[last]) {
            return None;
        }
        let above = breakpoints.partition_point(|&knot| knot <= parameter);
        Some((above - 1).min(last - 1))
    }

    /// Greville abscissa of control point i: the mean of knots i + 1 to i + k.
    ///
    /// With control points there the spline is the identity (linear precision).
    ///
    /// # Panics
    /// If `i` is not below the number of control points.
    #[must_use]
    pub fn greville(&self, i: usize) -> f64 {
        let start = self.knots[0];
        let sum: f64 = self.knots[i + 1..=i + self.degree].iter().map(|knot| knot - start).sum();
        start + sum / self.degree as f64
    }

    /// An interval's basis functions in Bernstein form, times the binomials: the polar forms at its ends.
    fn extract(&self, interval: usize) -> BernsteinRows {
        let k = self.degree;
        let [start, end] = [self.breakpoints()[interval], self.breakpoints()[interval + 1]];
        let mut rows = [[0.0; MAX_VOLUME_ORDER]; MAX_VOLUME_ORDER];
        for (i, row) in rows.iter_mut().enumerate().take(k + 1) {
            let mut arguments = [start; MAX_VOLUME_DEGREE];
            arguments[..i].fill(end);
            *row = self.polar_form(interval, &arguments[..k]).map(|value| value * binomial(k, i));
        }
        rows
    }

    /// The basis functions that are not 0 in an interval, in Bernstein form.
    pub(crate) fn bernstein_rows(&self, interval: usize) -> &BernsteinRows {
        &self.extraction[interval]
    }

    /// Polar form of the polynomial piece of an interval: the coefficients of the control points
    /// `interval ..= interval + k` for the given k arguments, in any order.
    ///
    /// The Cox-de Boor recursion with the interval held fixed and another argument in each step; with all
    /// arguments equal it gives the basis functions, and the piece extends to all real arguments.
    /// Every denominator contains the interval, so none is 0.
    pub(crate) fn polar_form(&self, interval: usize, arguments: &[f64]) -> LocalBasis {
        debug_assert_eq!(arguments.len(), self.degree, "one argument for each degree");
        let mut basis = [0.0; MAX_VOLUME_ORDER];
        polar_form(&self.knots, interval + self.degree, arguments, &mut basis);
        basis
    }

    /// Basis functions of an interval's polynomial piece at any real parameter, by their Bernstein form: without the divisions of
    /// [`Self::basis_with_derivatives`].
    pub(crate) fn basis(&self, interval: usize, parameter: f64) -> LocalBasis {
        match self.degree {
            1 => self.basis_of_order::<2>(interval, parameter),
            2 => self.basis_of_order::<3>(interval, parameter),
            3 => self.basis_of_order::<4>(interval, parameter),
            _ => self.basis_of_order::<5>(interval, parameter),
        }
    }

    /// As [`Self::basis`], with loops of lengths known when compiling.
    #[inline]
    fn basis_of_order<const ORDER: usize>(&self, interval: usize, parameter: f64) -> LocalBasis {
        let k = ORDER - 1;
        let (start, end) = (self.knots[interval + k], self.knots[interval + k + 1]);
        let part = (parameter - start) / (end - start);
        let mut falling = [1.0; ORDER];
        for i in 1..ORDER {
            falling[i] = falling[i - 1] * (1.0 - part);
        }
        let mut basis = [0.0; MAX_VOLUME_ORDER];
        let mut rising = 1.0;
        for (i, row) in self.bernstein_rows(interval).iter().enumerate().take(ORDER) {
            let product = rising * falling[k - i];
            for r in 0..ORDER {
                basis[r] += row[r] * product;
            }
            rising *= part;
        }
        basis
    }

    /// Basis functions of an interval's polynomial piece and their derivatives, at any real parameter.
    pub(crate) fn basis_with_derivatives(&self, interval: usize, parameter: f64) -> (LocalBasis, LocalBasis) {
        let (k, span) = (self.degree, interval + self.degree);
        let mut basis = [0.0; MAX_VOLUME_ORDER];
        basis[0] = 1.0;
        for level in 1..k {
            raise(&self.knots, span, level, parameter, &mut basis);
        }
        let mut derivative = [0.0; MAX_VOLUME_ORDER];
        for r in 0..k {
            let slope = k as f64 * basis[r] / (self.knots[span + r + 1] - self.knots[span + r + 1 - k]);
            derivative[r] -= slope;
            derivative[r + 1] += slope;
        }
        raise(&self.knots, span, k, parameter, &mut basis);
        (basis, derivative)
    }
}

/// As [`KnotVector::polar_form`], for any knots that do not fall and an interval of them that has a length: that from
/// `knots[span]` on. `basis` has a place for each of the coefficients, one more than arguments.
pub(crate) fn polar_form(knots: &[f64], span: usize, arguments: &[f64], basis: &mut [f64]) {
    basis[0] = 1.0;
    for (level, &argument) in (1..).zip(arguments) {
        raise(knots, span, level, argument, basis);
    }
}

/// One step of the Cox-de Boor recursion: degree `level - 1` to degree `level`.
fn raise(knots: &[f64], span: usize, level: usize, argument: f64, basis: &mut [f64]) {
    let mut carried = 0.0;
    for r in 0..level {
        let right = knots[span + r + 1];
        let left = knots[span + r + 1 - level];
        let share = basis[r] / (right - left);
        basis[r] = carried + (right - argument) * share;
        carried = (argument - left) * share;
    }
    basis[level] = carried;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn basis(knots: &KnotVector, interval: usize, parameter: f64) -> LocalBasis {
        knots.polar_form(interval, &vec![parameter; knots.degree()])
    }

    fn all_kinds() -> impl Iterator<Item = KnotVector> {
        (1..=4).flat_map(|degree| {
            (degree + 1..degree + 7)
                .map(move |points| KnotVector::clamped_uniform(degree, points, -1.0, 2.5).unwrap())
        })
    }

    #[test]
    fn greville_abscissae_give_the_identity() {
        for knots in all_kinds() {
            for step in 0..=50 {
                let u = -1.0 + 3.5 * f64::from(step) / 50.0;
                let interval = knots.interval(u).unwrap();
                let basis = basis(&knots, interval, u);
                let got: f64 = (0..=knots.degree()).map(|r| basis[r] * knots.greville(interval + r)).sum();
                assert!((got - u).abs() < 4e-15, "{knots:?} at {u}: {got}");
            }
        }
    }

    #[test]
    fn clamped_greville_spacing_follows_the_closed_form() {
        // math: R_s R_{s+1} = min(s+1, k, n-k, n-1-s) (b-a)/(k(n-k))
        for knots in all_kinds() {
            let (k, n) = (knots.degree(), knots.points());
            for s in 0..n - 1 {
                let steps = (s + 1).min(k).min(n - k).min(n - 1 - s) as f64;
                let want = steps * 3.5 / (k * (n - k)) as f64;
                let got = knots.greville(s + 1) - knots.greville(s);
                assert!((got - want).abs() < 4e-15, "k {k} n {n} s {s}: {got}, want {want}");
            }
        }
    }

    #[test]
    fn intervals_are_half_open_and_the_last_is_closed() {
        let knots = KnotVector::clamped_uniform(2, 6, 0.0, 4.0).unwrap();
        for (parameter, want) in [(0.0, Some(0)), (1.0, Some(1)), (3.999, Some(3)), (4.0, Some(3))] {
            assert_eq!(knots.interval(parameter), want, "at {parameter}");
        }
        for outside in [-1e-300, 4.000_000_1, f64::NAN, f64::INFINITY] {
            assert_eq!(knots.interval(outside), None, "at {outside}");
        }
    }

    #[test]
    fn derivatives_match_central_differences_and_pieces_extend() {
        for knots in all_kinds() {
            for interval in 0..knots.intervals() {
                for u in [-3.0, -0.9, 0.2, 1.7, 4.0] {
                    let (value, derivative) = knots.basis_with_derivatives(interval, u);
                    assert_eq!(value, basis(&knots, interval, u), "two ways to one value");
                    let h = 1e-6;
                    let (ahead, behind) = (basis(&knots, interval, u + h), basis(&knots, interval, u - h));
                    for r in 0..=knots.degree() {
                        let want = (ahead[r] - behind[r]) / (2.0 * h);
                        let scale = 1.0 + want.abs() + value[r].abs();
                        assert!((derivative[r] - want).abs() < 1e-7 * scale, "{knots:?} {interval} {u} {r}");
                    }
                }
            }
        }
    }

    #[test]
    fn bernstein_rows_are_the_basis() {
        let power = |x: f64, e: usize| (0..e).fold(1.0, |p, _| p * x);
        for knots in all_kinds() {
            let k = knots.degree();
            for (interval, ends) in knots.breakpoints().windows(2).enumerate() {
                let rows = knots.bernstein_rows(interval);
                for a in [-0.5_f64, 0.0, 0.3, 1.0, 1.7] {
                    let want = basis(&knots, interval, ends[0] + a * (ends[1] - ends[0]));
                    for (r, want) in want.into_iter().enumerate() {
                        let got: f64 =
                            (0..=k).map(|i| rows[i][r] * power(a, i) * power(1.0 - a, k - i)).sum();
                        assert!((got - want).abs() < 1e-13, "{knots:?} {interval} {a} {r}: {got}");
                    }
                }
            }
        }
    }

    #[test]
    fn polar_form_is_symmetric_and_multiaffine() {
        let knots = KnotVector::clamped_uniform(3, 7, 0.0, 1.0).unwrap();
        let a = knots.polar_form(1, &[0.1, 0.7, 0.4]);
        let b = knots.polar_form(1, &[0.4, 0.1, 0.7]);
        let mean = knots.polar_form(1, &[0.25, 0.7, 0.4]);
        let other = knots.polar_form(1, &[0.4, 0.7, 0.4]);
        for r in 0..4 {
            assert!((a[r] - b[r]).abs() < 1e-15, "symmetric at {r}");
            assert!((mean[r] - 0.5 * (a[r] + other[r])).abs() < 1e-15, "affine at {r}");
        }
    }

    #[test]
    fn bad_requests_are_refused() {
        assert_eq!(KnotVector::clamped_uniform(0, 4, 0.0, 1.0), Err(KnotError::Degree { degree: 0 }));
        assert_eq!(KnotVector::clamped_uniform(5, 9, 0.0, 1.0), Err(KnotError::Degree { degree: 5 }));
        assert_eq!(
            KnotVector::clamped_uniform(2, 2, 0.0, 1.0),
            Err(KnotError::Points { degree: 2, points: 2 })
        );
        assert!(KnotVector::clamped_uniform(2, 4, 1.0, 1.0).is_err());
        assert!(KnotVector::clamped_uniform(2, 4, 0.0, f64::NAN).is_err());
        assert!(KnotVector::clamped_uniform(2, 40, 1.0, 1.0 + f64::EPSILON).is_err());
    }
}
