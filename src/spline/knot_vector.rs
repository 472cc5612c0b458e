//! Knot vectors.

use thiserror::Error;

use crate::math::bernstein::binomial;

/// Highest degree of a volume along one axis.
pub const MAX_VOLUME_DEGREE: usize = 8;

/// Number of basis functions that are not 0 in one knot interval at [`MAX_VOLUME_DEGREE`].
pub(crate) const MAX_VOLUME_ORDER: usize = MAX_VOLUME_DEGREE + 1;

/// Why a knot vector cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum KnotError {
    /// The degree is not supported.
    #[error("degree {degree} is not supported (valid: 1 to {MAX_VOLUME_DEGREE})")]
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
    /// A knot is NaN or infinite.
    #[error("knot {index} is not finite")]
    NotFinite {
        /// Index of the knot.
        index: usize,
    },
    /// The knots fall.
    #[error("knot {index}, {knot}, is less than the one before, {before}; knots must not fall")]
    Fall {
        /// Index of the knot.
        index: usize,
        /// The knot.
        knot: f64,
        /// The knot before.
        before: f64,
    },
    /// Too many equal knots.
    #[error("the knot {knot} stands {multiplicity} times; the degree {degree} allows {most} times {place}")]
    Multiplicity {
        /// The knot.
        knot: f64,
        /// How often it stands there.
        multiplicity: usize,
        /// The degree.
        degree: usize,
        /// How often it may.
        most: usize,
        /// Where it is: at an end, or inside.
        place: &'static str,
    },
    /// Different knots that are too near each other.
    #[error(
        "the knots {} and {} differ by less than {NARROWEST:e} of their range; equal ones make one knot of a multiplicity",
        pair[0], pair[1]
    )]
    Narrow {
        /// The knots.
        pair: [f64; 2],
    },
    /// Not as many knots as the degree and the control points ask for.
    #[error(
        "{got} knots for degree {degree} and {points} control points; their number is the sum of these and 1, {}",
        degree + points + 1
    )]
    Count {
        /// Number of knots given.
        got: usize,
        /// The degree.
        degree: usize,
        /// The number of control points.
        points: usize,
    },
}

/// Least length of an interval between knots that differ, in parts of the domain: places within are told apart by 1e-12 of it.
const NARROWEST: f64 = 1e-9;

/// A knot vector, with as many equal inner knots as the degree at most.
///
/// For degree k and n control points there are n + k + 1 knots U that do not fall. The domain is `[U_k, U_n]`; where it is
/// clamped, k + 1 knots are equal at each end. The intervals between different knots of the domain are counted from 0.
///
/// Source: Feng, Nishita, Jin, Peng (2002), section 3.1; Piegl, Tiller (1997), *The NURBS Book*, section 2.4, for those that are not
/// clamped.
#[derive(Clone, Debug, PartialEq)]
pub struct KnotVector {
    degree: usize,
    points: usize,
    knots: Vec<f64>,
    /// Ends of the intervals.
    breakpoints: Vec<f64>,
    /// The first of the control points that act in each interval.
    first_points: Vec<usize>,
    extraction: Vec<BernsteinRows>,
}

/// Basis functions of an interval in Bernstein form: number r is the sum over i of `rows[i][r]` a^i (1 - a)^(k - i),
/// with a from 0 to 1 over the interval.
pub(crate) type BernsteinRows = [LocalBasis; MAX_VOLUME_ORDER];

/// Values of the basis functions that are not 0 in an interval, lowest index first.
pub(crate) type LocalBasis = [f64; MAX_VOLUME_ORDER];

impl KnotVector {
    /// A knot vector of all its knots.
    ///
    /// # Errors
    /// [`KnotError`] if the degree is not supported, the knots are too few, fall, are equal too often or too near each other, or the
    /// domain has no extent.
    pub fn try_new(degree: usize, knots: Vec<f64>) -> Result<Self, KnotError> {
        if !(1..=MAX_VOLUME_DEGREE).contains(&degree) {
            return Err(KnotError::Degree { degree });
        }
        let points = knots.len().saturating_sub(degree + 1);
        if points <= degree {
            return Err(KnotError::Points { degree, points });
        }
        check_knots(degree, &knots)?;
        let (mut breakpoints, mut first_points) = (vec![knots[degree]], Vec::new());
        for span in degree..points {
            if knots[span] < knots[span + 1] {
                breakpoints.push(knots[span + 1]);
                first_points.push(span - degree);
            }
        }
        let mut made = Self { degree, points, knots, breakpoints, first_points, extraction: Vec::new() };
        made.extraction = (0..made.intervals()).map(|interval| made.extract(interval)).collect();
        Ok(made)
    }

    /// The clamped uniform knot vector over `[start, end]`.
    ///
    /// # Errors
    /// [`KnotError`] if the degree is not supported, the control points do not outnumber the degree, or
    /// the domain has no extent.
    pub fn clamped_uniform(degree: usize, points: usize, start: f64, end: f64) -> Result<Self, KnotError> {
        let inner = inner_knots(degree, points, start, end)?;
        let ends = |knot: f64| std::iter::repeat_n(knot, degree + 1);
        Self::try_new(degree, ends(start).chain(inner).chain(ends(end)).collect())
    }

    /// The uniform knot vector whose domain is `[start, end]`; its outer knots lie as far from each other as the inner ones.
    ///
    /// # Errors
    /// As [`Self::clamped_uniform`].
    pub fn uniform(degree: usize, points: usize, start: f64, end: f64) -> Result<Self, KnotError> {
        let inner = inner_knots(degree, points, start, end)?;
        let step = (end - start) / (points - degree) as f64;
        let before = (1..=degree).rev().map(|i| start - step * i as f64);
        let after = (1..=degree).map(|i| end + step * i as f64);
        let knots = before.chain([start]).chain(inner).chain([end]).chain(after);
        Self::try_new(degree, knots.collect())
    }

    /// The knot vector with its domain taken to `[start, end]`.
    ///
    /// # Errors
    /// [`KnotError::Domain`] if that has no extent.
    pub fn over(&self, start: f64, end: f64) -> Result<Self, KnotError> {
        let [low, high] = self.domain();
        if [low, high] == [start, end] {
            return Ok(self.clone());
        }
        if !(start < end && (end - start).is_finite()) {
            return Err(KnotError::Domain { start, end });
        }
        let map = |knot: f64| match (knot - low) / (high - low) {
            1.0 => end,
            part => start + (end - start) * part,
        };
        Self::try_new(self.degree, self.knots.iter().copied().map(map).collect())
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

    /// Number of knot intervals: n - k, less where inner knots are equal.
    #[must_use]
    pub fn intervals(&self) -> usize {
        self.first_points.len()
    }

    /// The domain, from the start of the first interval to the end of the last one.
    #[must_use]
    pub fn domain(&self) -> [f64; 2] {
        [self.breakpoints[0], self.breakpoints[self.breakpoints.len() - 1]]
    }

    /// The first of the k + 1 control points that act in an interval.
    pub(crate) fn first_point(&self, interval: usize) -> usize {
        self.first_points[interval]
    }

    /// The knots that bound the intervals: start of the domain, inner knots, end of the domain.
    #[must_use]
    pub fn breakpoints(&self) -> &[f64] {
        &self.breakpoints
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
    /// that act there for the given k arguments, in any order.
    ///
    /// The Cox-de Boor recursion with the interval held fixed and another argument in each step; with all
    /// arguments equal it gives the basis functions, and the piece extends to all real arguments.
    /// Every denominator contains the interval, so none is 0.
    pub(crate) fn polar_form(&self, interval: usize, arguments: &[f64]) -> LocalBasis {
        debug_assert_eq!(arguments.len(), self.degree, "one argument for each degree");
        let mut basis = [0.0; MAX_VOLUME_ORDER];
        polar_form(&self.knots, self.first_points[interval] + self.degree, arguments, &mut basis);
        basis
    }

    /// Basis functions of an interval's polynomial piece at any real parameter, by their Bernstein form: without the divisions of
    /// [`Self::basis_with_derivatives`].
    #[inline(always)]
    pub(crate) fn basis(&self, interval: usize, parameter: f64) -> LocalBasis {
        match self.degree {
            1 => self.basis_of_order::<2>(interval, parameter),
            2 => self.basis_of_order::<3>(interval, parameter),
            3 => self.basis_of_order::<4>(interval, parameter),
            4 => self.basis_of_order::<5>(interval, parameter),
            5 => self.basis_of_order::<6>(interval, parameter),
            6 => self.basis_of_order::<7>(interval, parameter),
            7 => self.basis_of_order::<8>(interval, parameter),
            _ => self.basis_of_order::<9>(interval, parameter),
        }
    }

    /// As [`Self::basis`], with loops of lengths known when compiling.
    #[inline(always)]
    fn basis_of_order<const ORDER: usize>(&self, interval: usize, parameter: f64) -> LocalBasis {
        let k = ORDER - 1;
        let (start, end) = (self.breakpoints[interval], self.breakpoints[interval + 1]);
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
        let (k, span) = (self.degree, self.first_points[interval] + self.degree);
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

/// The knots that cut `[start, end]` into as many equal parts as there are intervals.
fn inner_knots(
    degree: usize,
    points: usize,
    start: f64,
    end: f64,
) -> Result<impl Iterator<Item = f64>, KnotError> {
    if !(1..=MAX_VOLUME_DEGREE).contains(&degree) {
        return Err(KnotError::Degree { degree });
    }
    if points <= degree {
        return Err(KnotError::Points { degree, points });
    }
    if !(start.is_finite() && end.is_finite() && (end - start).is_finite()) {
        return Err(KnotError::Domain { start, end });
    }
    let intervals = points - degree;
    let knot = move |i: usize| start + (end - start) * (i as f64 / intervals as f64);
    if (0..intervals).any(|i| knot(i) >= knot(i + 1)) {
        return Err(KnotError::Domain { start, end });
    }
    Ok((1..intervals).map(knot))
}

/// Refuses knots that make no basis.
fn check_knots(degree: usize, knots: &[f64]) -> Result<(), KnotError> {
    if let Some(index) = knots.iter().position(|knot| !knot.is_finite()) {
        return Err(KnotError::NotFinite { index });
    }
    if let Some(index) = (1..knots.len()).find(|&i| knots[i] < knots[i - 1]) {
        return Err(KnotError::Fall { index, knot: knots[index], before: knots[index - 1] });
    }
    let (start, end) = (knots[degree], knots[knots.len() - 1 - degree]);
    if !(start < end && (knots[knots.len() - 1] - knots[0]).is_finite()) {
        return Err(KnotError::Domain { start, end });
    }
    for equal in knots.chunk_by(|a, b| a == b) {
        let (knot, multiplicity) = (equal[0], equal.len());
        let is_inside = knot > start && knot < end;
        let (most, place) = if is_inside { (degree, "inside") } else { (degree + 1, "at an end") };
        if multiplicity > most {
            return Err(KnotError::Multiplicity { knot, multiplicity, degree, most, place });
        }
    }
    // uniform ones of a lattice may be narrow as long as they differ
    let mut steps = knots.windows(2).filter(|pair| pair[0] < pair[1]);
    let range = end - start;
    match steps.find(|pair| pair[1] - pair[0] < NARROWEST * range) {
        Some(&[before, after]) => Err(KnotError::Narrow { pair: [before, after] }),
        _ => Ok(()),
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
                let got: f64 = (0..=knots.degree())
                    .map(|r| basis[r] * knots.greville(knots.first_point(interval) + r))
                    .sum();
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

    /// High degrees, ends that are not clamped, and equal inner knots of every multiplicity.
    fn general_kinds() -> Vec<KnotVector> {
        let mut kinds = Vec::new();
        for degree in 1..=MAX_VOLUME_DEGREE {
            kinds.push(KnotVector::clamped_uniform(degree, degree + 3, -1.0, 2.5).unwrap());
            kinds.push(KnotVector::uniform(degree, degree + 4, -1.0, 2.5).unwrap());
            for multiplicity in 1..=degree {
                let inner = [vec![-0.5; multiplicity], vec![0.75], vec![1.0; multiplicity]].concat();
                let clamped = [vec![-1.0; degree + 1], inner.clone(), vec![2.5; degree + 1]].concat();
                kinds.push(KnotVector::try_new(degree, clamped).unwrap());
                let below = (1..=degree).rev().map(|i| -1.0 - 0.3 * i as f64);
                let above = (1..=degree).map(|i| 2.5 + 0.2 * i as f64);
                let open = below.chain([-1.0]).chain(inner).chain([2.5]).chain(above);
                kinds.push(KnotVector::try_new(degree, open.collect()).unwrap());
            }
        }
        kinds
    }

    #[test]
    fn general_knots_have_the_identity_and_derivatives() {
        for knots in general_kinds() {
            let (k, ends) = (knots.degree(), knots.breakpoints());
            assert_eq!(knots.domain(), [-1.0, 2.5]);
            assert_eq!(ends.len(), knots.intervals() + 1);
            for step in 0..=70 {
                let u = -1.0 + 3.5 * f64::from(step) / 70.0;
                let interval = knots.interval(u).unwrap();
                assert!(u >= ends[interval] && u <= ends[interval + 1]);
                let (value, derivative) = knots.basis_with_derivatives(interval, u);
                let by_rows = knots.basis(interval, u);
                let mut sums = [0.0; 3];
                for r in 0..=k {
                    let place = knots.greville(knots.first_point(interval) + r);
                    sums[0] += value[r];
                    sums[1] += value[r] * place;
                    sums[2] += derivative[r] * place;
                    assert!((value[r] - by_rows[r]).abs() < 1e-13, "{knots:?} at {u}: {r}");
                    assert!(value[r] >= -1e-15, "{knots:?} at {u}: {r}");
                }
                let off = [sums[0] - 1.0, sums[1] - u, sums[2] - 1.0].map(f64::abs);
                assert!(off[0] < 1e-14 && off[1] < 1e-14 && off[2] < 1e-12, "{knots:?} at {u}: {off:?}");
            }
        }
    }

    #[test]
    fn domains_are_taken_to_boxes() {
        let knots = KnotVector::try_new(2, vec![0., 0., 0., 1., 1., 3., 3., 3.]).unwrap();
        let moved = knots.over(-1.0, 5.0).unwrap();
        assert_eq!(moved.knots(), [-1., -1., -1., 1., 1., 5., 5., 5.]);
        assert_eq!(knots.over(0.0, 3.0).unwrap(), knots);
        assert!(knots.over(2.0, 2.0).is_err() && knots.over(f64::NAN, 1.0).is_err());
        let uniform = KnotVector::uniform(3, 6, 0.0, 3.0).unwrap();
        assert_eq!(uniform.knots(), [-3., -2., -1., 0., 1., 2., 3., 4., 5., 6.]);
    }

    #[test]
    fn knots_that_make_no_basis_are_refused() {
        let cases: [(&[f64], &str); 7] = [
            (&[0., 0., 0., 1., 1.], "2 control points are too few for degree 2"),
            (&[0., 0., 0., 2., 1., 3., 3., 3.], "knot 4, 1, is less than the one before, 2"),
            (
                &[0., 0., 0., 1., 1., 1., 3., 3., 3.],
                "the knot 1 stands 3 times; the degree 2 allows 2 times inside",
            ),
            (
                &[0., 0., 0., 0., 3., 3., 3.],
                "the knot 0 stands 4 times; the degree 2 allows 3 times at an end",
            ),
            (&[0., 0., 0., f64::NAN, 3., 3., 3.], "knot 3 is not finite"),
            (&[1., 1., 1., 1., 1., 1.], "the domain [1, 1] has no extent"),
            (
                &[0., 0., 0., 1e-12, 3., 3., 3.],
                "the knots 0 and 0.000000000001 differ by less than 1e-9 of their range",
            ),
        ];
        for (knots, message) in cases {
            let error = KnotVector::try_new(2, knots.to_vec()).unwrap_err().to_string();
            assert!(error.starts_with(message), "{message}:\n{error}");
        }
    }

    #[test]
    fn bad_requests_are_refused() {
        assert_eq!(KnotVector::clamped_uniform(0, 4, 0.0, 1.0), Err(KnotError::Degree { degree: 0 }));
        assert_eq!(KnotVector::clamped_uniform(9, 12, 0.0, 1.0), Err(KnotError::Degree { degree: 9 }));
        assert_eq!(
            KnotVector::clamped_uniform(2, 2, 0.0, 1.0),
            Err(KnotError::Points { degree: 2, points: 2 })
        );
        assert!(KnotVector::clamped_uniform(2, 4, 1.0, 1.0).is_err());
        assert!(KnotVector::clamped_uniform(2, 4, 0.0, f64::NAN).is_err());
        assert!(KnotVector::clamped_uniform(2, 40, 1.0, 1.0 + f64::EPSILON).is_err());
    }
}
