//! What formulas are evaluated over: numbers, or discs of complex numbers.

/// Sizes of discs that are carried side by side: see [`Disc`](super::disc::Disc).
pub(super) const SIZES: usize = 17;

/// Highest order of derivatives that a formula is evaluated with.
pub(super) const MAX_ORDER: usize = 4;

/// Taylor coefficients of a function of one argument.
pub(super) type Series<T> = [T; MAX_ORDER + 1];

/// A number, or a set of numbers around one.
pub(super) trait Number: Copy + std::fmt::Debug {
    /// A single number.
    fn constant(value: f64) -> Self;

    /// The numbers within some distances of one; `reach` gives the distances where sets are meant.
    fn around(centre: f64, reach: impl FnOnce() -> [f64; SIZES]) -> Self;

    fn centre(self) -> f64;

    /// Distances from the centre; 0 for a single number.
    fn reach(self) -> [f64; SIZES];

    /// Whether it is a single number always.
    const SINGLE: bool;

    fn add(self, other: Self) -> Self;
    fn multiply(self, other: Self) -> Self;
    fn scale(self, factor: f64) -> Self;

    fn reciprocal(self) -> Self;
    fn exp(self) -> Self;
    fn exp_minus_1(self) -> Self;
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    fn ln(self) -> Self;
    fn asin(self) -> Self;
    fn atan(self) -> Self;

    /// x^exponent of x >= 0.
    fn power(self, exponent: f64) -> Self;

    fn subtract(self, other: Self) -> Self {
        self.add(other.scale(-1.0))
    }
}

impl Number for f64 {
    const SINGLE: bool = true;

    #[inline]
    fn constant(value: f64) -> Self {
        value
    }

    #[inline]
    fn around(centre: Self, _reach: impl FnOnce() -> [Self; SIZES]) -> Self {
        centre
    }

    #[inline]
    fn centre(self) -> f64 {
        self
    }

    #[inline]
    fn reach(self) -> [f64; SIZES] {
        [0.0; SIZES]
    }

    #[inline]
    fn add(self, other: Self) -> Self {
        self + other
    }

    #[inline]
    fn subtract(self, other: Self) -> Self {
        self - other
    }

    #[inline]
    fn multiply(self, other: Self) -> Self {
        self * other
    }

    #[inline]
    fn scale(self, factor: f64) -> Self {
        self * factor
    }

    #[inline]
    fn reciprocal(self) -> Self {
        1.0 / self
    }

    fn exp(self) -> Self {
        libm::exp(self)
    }

    fn exp_minus_1(self) -> Self {
        libm::expm1(self)
    }

    fn sin(self) -> Self {
        libm::sin(self)
    }

    fn cos(self) -> Self {
        libm::cos(self)
    }

    fn ln(self) -> Self {
        libm::log(self)
    }

    fn asin(self) -> Self {
        libm::asin(self)
    }

    fn atan(self) -> Self {
        libm::atan(self)
    }

    fn power(self, exponent: f64) -> Self {
        if exponent == 0.5 { self.sqrt() } else { libm::pow(self, exponent) }
    }
}
