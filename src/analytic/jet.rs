//! Truncated Taylor series in two parameters: a value with its partial derivatives.

use super::number::{MAX_ORDER, Number, Series};

/// Taylor coefficients in (s, t) about a place: that of s^i t^j, at `index(i, j)`, is the partial derivative over i! j!.
///
/// `N` is 1, 3, 6, 10 or 15, for orders up to 0, 1, 2, 3 or 4.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jet<T, const N: usize> {
    pub(super) coefficients: [T; N],
}

/// Three of them: a point.
pub(super) type Point<T, const N: usize> = [Jet<T, N>; 3];

/// Where the coefficient of s^i t^j is.
pub(super) const fn index(i: usize, j: usize) -> usize {
    (i + j) * (i + j + 1) / 2 + j
}

/// The highest order of a jet of so many coefficients.
pub(super) const fn order_of(count: usize) -> usize {
    match count {
        1 => 0,
        3 => 1,
        6 => 2,
        10 => 3,
        _ => 4,
    }
}

impl<T: Number, const N: usize> Jet<T, N> {
    const ORDER: usize = order_of(N);

    /// A constant.
    pub(super) fn constant(value: T) -> Self {
        let mut coefficients = [T::constant(0.0); N];
        coefficients[0] = value;
        Self { coefficients }
    }

    /// value + slope · s, or + slope · t.
    pub(super) fn linear(value: T, [by_s, by_t]: [f64; 2]) -> Self {
        let mut jet = Self::constant(value);
        if N > 1 {
            jet.coefficients[1] = T::constant(by_s);
            jet.coefficients[2] = T::constant(by_t);
        }
        jet
    }

    /// The value and the first partial derivatives.
    pub(super) fn to_linear(self) -> [T; 3] {
        std::array::from_fn(|k| self.coefficients.get(k).copied().unwrap_or_else(|| T::constant(0.0)))
    }

    pub(super) fn value(&self) -> T {
        self.coefficients[0]
    }

    pub(super) fn add(&self, other: &Self) -> Self {
        Self { coefficients: std::array::from_fn(|k| self.coefficients[k].add(other.coefficients[k])) }
    }

    pub(super) fn subtract(&self, other: &Self) -> Self {
        Self { coefficients: std::array::from_fn(|k| self.coefficients[k].subtract(other.coefficients[k])) }
    }

    pub(super) fn scale(&self, factor: f64) -> Self {
        Self { coefficients: self.coefficients.map(|x| x.scale(factor)) }
    }

    /// With a number added.
    pub(super) fn plus(&self, value: f64) -> Self {
        let mut sum = *self;
        sum.coefficients[0] = sum.coefficients[0].add(T::constant(value));
        sum
    }

    pub(super) fn multiply(&self, other: &Self) -> Self {
        let (a, b) = (&self.coefficients, &other.coefficients);
        if N == 1 {
            return Self::constant(a[0].multiply(b[0]));
        }
        let mut product = [T::constant(0.0); N];
        for i in 0..=Self::ORDER {
            for j in 0..=Self::ORDER - i {
                for k in 0..=Self::ORDER - i - j {
                    for l in 0..=Self::ORDER - i - j - k {
                        let at = index(i + k, j + l);
                        product[at] = product[at].add(a[index(i, j)].multiply(b[index(k, l)]));
                    }
                }
            }
        }
        Self { coefficients: product }
    }

    /// The function with these Taylor coefficients about this jet's value, at this jet.
    fn compose(&self, series: &Series<T>) -> Self {
        let mut small = *self;
        small.coefficients[0] = T::constant(0.0);
        let mut sum = Self::constant(series[Self::ORDER]);
        for order in (0..Self::ORDER).rev() {
            sum = sum.multiply(&small);
            sum.coefficients[0] = series[order];
        }
        sum
    }

    /// The partial derivatives by s and t; the highest order of them is missing and 0.
    pub(super) fn partials(&self) -> [Self; 2] {
        let mut partials = [Self::constant(T::constant(0.0)); 2];
        for i in 0..Self::ORDER {
            for j in 0..Self::ORDER - i {
                let [by_s, by_t] = &mut partials;
                by_s.coefficients[index(i, j)] = self.coefficients[index(i + 1, j)].scale((i + 1) as f64);
                by_t.coefficients[index(i, j)] = self.coefficients[index(i, j + 1)].scale((j + 1) as f64);
            }
        }
        partials
    }

    pub(super) fn reciprocal(&self) -> Self {
        let inverse = self.value().reciprocal();
        let mut series = [inverse; MAX_ORDER + 1];
        for k in 1..=Self::ORDER {
            series[k] = series[k - 1].multiply(inverse).scale(-1.0);
        }
        self.compose(&series)
    }

    pub(super) fn divide(&self, other: &Self) -> Self {
        self.multiply(&other.reciprocal())
    }

    pub(super) fn exp(&self) -> Self {
        self.compose(&exponential(self.value().exp()))
    }

    pub(super) fn exp_minus_1(&self) -> Self {
        let mut series = exponential(self.value().exp());
        series[0] = self.value().exp_minus_1();
        self.compose(&series)
    }

    pub(super) fn sin(&self) -> Self {
        let (sin, cos) = (self.value().sin(), self.value().cos());
        self.compose(&circular(sin, cos))
    }

    pub(super) fn cos(&self) -> Self {
        let (sin, cos) = (self.value().sin(), self.value().cos());
        self.compose(&circular(cos, sin.scale(-1.0)))
    }

    pub(super) fn tan(&self) -> Self {
        self.sin().divide(&self.cos())
    }

    pub(super) fn ln(&self) -> Self {
        let value = self.value();
        let mut series = [value.ln(); MAX_ORDER + 1];
        if N > 1 {
            let inverse = value.reciprocal();
            let mut power = inverse;
            for (k, coefficient) in series.iter_mut().enumerate().skip(1) {
                *coefficient = power.scale(1.0 / k as f64);
                power = power.multiply(inverse).scale(-1.0);
            }
        }
        self.compose(&series)
    }

    /// x^exponent of x >= 0.
    pub(super) fn power(&self, exponent: f64) -> Self {
        let mut series = [self.value().power(exponent); MAX_ORDER + 1];
        let mut binomial = 1.0;
        for (k, coefficient) in series.iter_mut().enumerate().take(Self::ORDER + 1).skip(1) {
            let left = exponent - k as f64;
            binomial *= (left + 1.0) / k as f64;
            // a power that ends has no terms beyond, not even 0 · infinity
            *coefficient =
                if binomial == 0.0 { T::constant(0.0) } else { self.value().power(left).scale(binomial) };
        }
        self.compose(&series)
    }

    /// x^exponent of any x but 0, and of that too for an exponent >= 0.
    pub(super) fn whole_power(&self, exponent: i32) -> Self {
        let mut power = None;
        let mut square = *self;
        let mut left = exponent.unsigned_abs();
        while left > 0 {
            if left & 1 == 1 {
                power = Some(power.map_or(square, |power: Self| power.multiply(&square)));
            }
            left >>= 1;
            if left > 0 {
                square = square.multiply(&square);
            }
        }
        let power = power.unwrap_or_else(|| Self::constant(T::constant(1.0)));
        if exponent < 0 { power.reciprocal() } else { power }
    }

    /// y' = 1 / (1 + x²), whose series w about x0 has (1 + x0²) `w_k` = -2 x0 `w_(k-1)` - `w_(k-2)`.
    pub(super) fn atan(&self) -> Self {
        let x = self.value();
        let inverse = x.multiply(x).add(T::constant(1.0)).reciprocal();
        let mut slope = [inverse; MAX_ORDER];
        for k in 1..Self::ORDER {
            let before = if k > 1 { slope[k - 2] } else { T::constant(0.0) };
            slope[k] = x.scale(2.0).multiply(slope[k - 1]).add(before).scale(-1.0).multiply(inverse);
        }
        self.compose(&integral(x.atan(), &slope))
    }

    /// y' = w = (1 - x²)^(-1/2), whose series about x0 follows from (1 - x²) w' = x w.
    pub(super) fn asin(&self) -> Self {
        let x = self.value();
        let mut slope = [x; MAX_ORDER];
        if N > 1 {
            let inverse = T::constant(1.0).subtract(x.multiply(x)).reciprocal();
            slope[0] = inverse.power(0.5);
            for k in 1..Self::ORDER {
                let n = (k - 1) as f64;
                let before = if k > 1 { slope[k - 2].scale(n) } else { T::constant(0.0) };
                let sum = x.scale(1.0 + 2.0 * n).multiply(slope[k - 1]).add(before);
                slope[k] = sum.multiply(inverse).scale(1.0 / (n + 1.0));
            }
        }
        self.compose(&integral(x.asin(), &slope))
    }
}

/// The Taylor series of a function that is its own derivative.
fn exponential<T: Number>(value: T) -> Series<T> {
    let mut series = [value; MAX_ORDER + 1];
    for k in 1..=MAX_ORDER {
        series[k] = series[k - 1].scale(1.0 / k as f64);
    }
    series
}

/// The Taylor series of a function with second derivative -f, from its value and slope.
fn circular<T: Number>(value: T, slope: T) -> Series<T> {
    [value, slope, value.scale(-0.5), slope.scale(-1.0 / 6.0), value.scale(1.0 / 24.0)]
}

/// The Taylor series of a function from its value and the series of its derivative.
fn integral<T: Number>(value: T, slope: &[T; MAX_ORDER]) -> Series<T> {
    let mut series = [value; MAX_ORDER + 1];
    for k in 1..=MAX_ORDER {
        series[k] = slope[k - 1].scale(1.0 / k as f64);
    }
    series
}

/// a · b.
pub(super) fn dot<T: Number, const N: usize>(a: &Point<T, N>, b: &Point<T, N>) -> Jet<T, N> {
    a[0].multiply(&b[0]).add(&a[1].multiply(&b[1])).add(&a[2].multiply(&b[2]))
}

/// a × b.
pub(super) fn cross<T: Number, const N: usize>(a: &Point<T, N>, b: &Point<T, N>) -> Point<T, N> {
    let part = |i: usize, j: usize| a[i].multiply(&b[j]).subtract(&a[j].multiply(&b[i]));
    [part(1, 2), part(2, 0), part(0, 1)]
}

/// a / |a|.
pub(super) fn unit<T: Number, const N: usize>(a: &Point<T, N>) -> Point<T, N> {
    let inverse = dot(a, a).power(-0.5);
    [a[0].multiply(&inverse), a[1].multiply(&inverse), a[2].multiply(&inverse)]
}
