//! Bernstein polynomials: B(i, n)(t) = C(n, i) t^i (1 - t)^(n - i).
//!
//! Source of the algorithms: Farin, *Curves and Surfaces for CAGD*, the chapters on Bézier curves.

use std::ops::{Add, Mul};

use super::lanes::Real;

/// Highest degree of a patch in one direction: all three axes of a volume of degree 4.
pub(crate) const MAX_DEGREE: usize = 12;

/// Number of coefficients at [`MAX_DEGREE`].
pub(crate) const MAX_ORDER: usize = MAX_DEGREE + 1;

/// Highest row of the binomial table; products of two polynomials of [`MAX_DEGREE`] fit.
const MAX_BINOMIAL: usize = 2 * MAX_DEGREE;

const BINOMIALS: [[f64; MAX_BINOMIAL + 1]; MAX_BINOMIAL + 1] = pascal_triangle();

const fn pascal_triangle() -> [[f64; MAX_BINOMIAL + 1]; MAX_BINOMIAL + 1] {
    let mut table = [[0.0; MAX_BINOMIAL + 1]; MAX_BINOMIAL + 1];
    let mut n = 0;
    while n <= MAX_BINOMIAL {
        table[n][0] = 1.0;
        let mut i = 1;
        while i <= n {
            table[n][i] = table[n - 1][i - 1] + table[n - 1][i];
            i += 1;
        }
        n += 1;
    }
    table
}

/// C(n, i), exact.
///
/// # Panics
/// If `n` or `i` is above twice [`MAX_DEGREE`].
pub(crate) const fn binomial(n: usize, i: usize) -> f64 {
    BINOMIALS[n][i]
}

const INVERSE_BINOMIALS: [[f64; MAX_ORDER]; MAX_ORDER] = inverse_pascal_triangle();

const fn inverse_pascal_triangle() -> [[f64; MAX_ORDER]; MAX_ORDER] {
    let mut table = [[0.0; MAX_ORDER]; MAX_ORDER];
    let mut n = 0;
    while n <= MAX_DEGREE {
        let mut i = 0;
        while i <= n {
            table[n][i] = 1.0 / BINOMIALS[n][i];
            i += 1;
        }
        n += 1;
    }
    table
}

/// 1 / C(n, i), rounded once; 0 for `i > n`.
///
/// # Panics
/// If `n` or `i` is above [`MAX_DEGREE`].
pub(crate) const fn inverse_binomial(n: usize, i: usize) -> f64 {
    INVERSE_BINOMIALS[n][i]
}

/// Bernstein polynomials of one degree and their derivatives at one parameter, or at several side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BasisValues<const ORDER: usize, R> {
    /// B(i, n)(t).
    pub(crate) value: [R; ORDER],
    /// d/dt B(i, n)(t).
    pub(crate) derivative: [R; ORDER],
}

/// Values and derivatives of all Bernstein polynomials of a degree, at any real `t`.
///
/// The values come from the triangle of convex combinations, so that for `t` in `[0, 1]` each has a
/// relative error of at most `2 degree` roundings; d/dt B(i, n) = n (B(i-1, n-1) - B(i, n-1)).
///
/// # Panics
/// If `degree` is not below `ORDER`.
#[inline(always)]
pub(crate) fn basis<const ORDER: usize, R: Real>(degree: usize, t: R) -> BasisValues<ORDER, R> {
    let mut value = [t.all(0.0); ORDER];
    let mut derivative = value;
    value[0] = t.all(1.0);
    let u = t.all(1.0) - t;
    for n in 1..=degree {
        if n == degree {
            let scale = f64::from(u32::try_from(degree).expect("a degree is at most 12"));
            derivative[0] = value[0] * -scale;
            for i in 1..degree {
                derivative[i] = (value[i - 1] - value[i]) * scale;
            }
            derivative[degree] = value[degree - 1] * scale;
        }
        value[n] = t * value[n - 1];
        for i in (1..n).rev() {
            value[i] = u * value[i] + t * value[i - 1];
        }
        value[0] = value[0] * u;
    }
    BasisValues { value, derivative }
}

/// Splits the polynomial with the given coefficients at `t` by de Casteljau's algorithm.
///
/// `coefficients` becomes the part over `[0, t]`, `right` the part over `[t, 1]`; a stride lets both
/// be a row or a column of a net: coefficient i is at `i * stride`.
///
/// # Panics
/// If a slice ends before coefficient `degree`.
pub(crate) fn split<V>(coefficients: &mut [V], right: &mut [V], stride: usize, degree: usize, t: f64)
where
    V: Copy + Add<Output = V> + Mul<f64, Output = V>,
{
    let u = 1.0 - t;
    right[degree * stride] = coefficients[degree * stride];
    for level in 1..=degree {
        for i in (level..=degree).rev() {
            coefficients[i * stride] = coefficients[(i - 1) * stride] * u + coefficients[i * stride] * t;
        }
        right[(degree - level) * stride] = coefficients[degree * stride];
    }
}

/// Restricts the polynomial to `[from, to]`, in place; strides as in [`split`].
///
/// Also to parts that reach beyond `[0, 1]`, `to` being positive; rounding grows with the distance from there.
pub(crate) fn restrict<V>(coefficients: &mut [V], stride: usize, degree: usize, from: f64, to: f64)
where
    V: Copy + Add<Output = V> + Mul<f64, Output = V>,
{
    if to != 1.0 {
        for level in 1..=degree {
            for i in (level..=degree).rev() {
                coefficients[i * stride] =
                    coefficients[(i - 1) * stride] * (1.0 - to) + coefficients[i * stride] * to;
            }
        }
    }
    if from != 0.0 {
        let t = from / to;
        for level in 1..=degree {
            for i in 0..=degree - level {
                coefficients[i * stride] =
                    coefficients[i * stride] * (1.0 - t) + coefficients[(i + 1) * stride] * t;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn basis_is_a_partition_of_unity_with_the_closed_form() {
        for degree in 0..=MAX_DEGREE {
            for step in 0..=20 {
                let t = f64::from(step) / 20.0;
                let basis = basis::<MAX_ORDER, f64>(degree, t);
                let sum: f64 = basis.value.iter().sum();
                assert!((sum - 1.0).abs() < 1e-15 * 12.0, "degree {degree} t {t}: {sum:e}");
                let slope: f64 = basis.derivative.iter().sum();
                assert!(slope.abs() < 1e-13, "degree {degree} t {t}: {slope:e}");
                for i in 0..=degree {
                    let power = |x: f64, e: usize| (0..e).fold(1.0, |p, _| p * x);
                    let want = binomial(degree, i) * power(t, i) * power(1.0 - t, degree - i);
                    let got = basis.value[i];
                    assert!((got - want).abs() <= 1e-15, "B({i},{degree})({t}): {got:e}, want {want:e}");
                }
            }
        }
    }

    #[test]
    fn split_and_restrict_agree_with_the_whole() {
        let whole = [1.0, -2.0, 0.5, 3.0, -1.0];
        let eval = |c: &[f64], t: f64| -> f64 {
            let basis = basis::<MAX_ORDER, f64>(c.len() - 1, t);
            c.iter().zip(basis.value).map(|(c, b)| c * b).sum()
        };
        let mut left = whole;
        let mut right = [0.0; 5];
        split(&mut left, &mut right, 1, 4, 0.3);
        let mut part = whole;
        restrict(&mut part, 1, 4, 0.2, 0.7);
        for step in 0..=10 {
            let t = f64::from(step) / 10.0;
            assert!((eval(&left, t) - eval(&whole, 0.3 * t)).abs() < 1e-14);
            assert!((eval(&right, t) - eval(&whole, 0.3 + 0.7 * t)).abs() < 1e-14);
            assert!((eval(&part, t) - eval(&whole, 0.2 + 0.5 * t)).abs() < 1e-14);
        }
    }
}
