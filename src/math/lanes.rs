//! Numbers that hold one ray or several: the kernel is written once, for [`f64`] and for eight of them side by side.
//!
//! Nothing here fuses a multiplication with an addition, so a ray has the same bits alone and in any lane.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x8, mask64x8};

/// Does work with the widest vectors that a processor has, of those that it is compiled for: AVX-512, AVX2, else what every
/// processor of its kind has. As [`fearless_simd::dispatch`], which would compile all work once more for SSE4.2.
macro_rules! with_vectors {
    ($level:expr, $simd:ident => $work:expr) => {{
        use fearless_simd::Simd;
        let level: fearless_simd::Level = $level;
        #[cfg(target_arch = "x86_64")]
        if let Some($simd) = level.as_avx512() {
            $simd.vectorize(
                #[inline(always)]
                || $work,
            )
        } else if let Some($simd) = level.as_avx2() {
            $simd.vectorize(
                #[inline(always)]
                || $work,
            )
        } else {
            let $simd = level.as_sse2().expect("every x86-64 processor has SSE2");
            $simd.vectorize(
                #[inline(always)]
                || $work,
            )
        }
        #[cfg(not(target_arch = "x86_64"))]
        fearless_simd::dispatch!(level, $simd => $work)
    }};
}
pub(crate) use with_vectors;

/// Rays side by side in [`f64x8`].
pub(crate) const LANES: usize = 8;

/// Truth for each lane.
pub(crate) trait Truth:
    Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// Whether it holds in any lane.
    fn any(self) -> bool;
    /// In how many lanes it holds.
    fn count(self) -> u64;
}

/// One real number a lane.
pub(crate) trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
{
    /// What comparisons give.
    type Truth: Truth;

    /// The same number in every lane of as many as `self` has.
    fn all(self, value: f64) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Square root; NaN of a negative number.
    fn sqrt(self) -> Self;
    /// Less than; false for NaN.
    fn lt(self, other: Self) -> Self::Truth;
    /// Less than or equal; false for NaN.
    fn le(self, other: Self) -> Self::Truth;
    /// `yes` where `truth` holds, `no` elsewhere.
    fn select(truth: Self::Truth, yes: Self, no: Self) -> Self;

    /// `other` where it is less, else `self`; a NaN in `other` is dropped.
    #[inline(always)]
    fn lesser(self, other: Self) -> Self {
        Self::select(other.lt(self), other, self)
    }

    /// `other` where it is greater, else `self`; a NaN in `other` is dropped.
    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        Self::select(self.lt(other), other, self)
    }
}

impl Truth for bool {
    #[inline(always)]
    fn any(self) -> bool {
        self
    }

    #[inline(always)]
    fn count(self) -> u64 {
        u64::from(self)
    }
}

impl Real for f64 {
    type Truth = bool;

    #[inline(always)]
    fn all(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self::abs(self)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self::sqrt(self)
    }

    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn select(truth: bool, yes: Self, no: Self) -> Self {
        if truth { yes } else { no }
    }
}

impl<S: Simd> Truth for mask64x8<S> {
    #[inline(always)]
    fn any(self) -> bool {
        self.any_true()
    }

    #[inline(always)]
    fn count(self) -> u64 {
        u64::from(self.to_bitmask().count_ones())
    }
}

impl<S: Simd> Real for f64x8<S> {
    type Truth = mask64x8<S>;

    #[inline(always)]
    fn all(self, value: f64) -> Self {
        Self::splat(self.token(), value)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        SimdBase::abs(self)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        SimdFloat::sqrt(self)
    }

    #[inline(always)]
    fn lt(self, other: Self) -> mask64x8<S> {
        self.simd_lt(other)
    }

    #[inline(always)]
    fn le(self, other: Self) -> mask64x8<S> {
        self.simd_le(other)
    }

    #[inline(always)]
    fn select(truth: mask64x8<S>, yes: Self, no: Self) -> Self {
        truth.select(yes, no)
    }
}

/// A vector a lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vector<R> {
    pub(crate) x: R,
    pub(crate) y: R,
    pub(crate) z: R,
}

impl<R: Real> Vector<R> {
    #[inline(always)]
    pub(crate) fn new(x: R, y: R, z: R) -> Self {
        Self { x, y, z }
    }

    #[inline(always)]
    pub(crate) fn minus(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }

    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }

    #[inline(always)]
    pub(crate) fn times(self, factor: R) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> R {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }
}
