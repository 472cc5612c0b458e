//! The axes of a lattice.

use std::str::FromStr;

use crate::choice::{Choice, UnknownName};

/// An axis of the lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// The first.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
}

impl Choice for Axis {
    const WHAT: &'static str = "axis";
    const ALL: &'static [Self] = &[Self::X, Self::Y, Self::Z];

    fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }
}

impl Axis {
    /// 0, 1 or 2.
    #[must_use]
    pub fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }

    /// The other two, in the order x, y, z.
    #[must_use]
    pub fn cross_axes(self) -> [Self; 2] {
        match self {
            Self::X => [Self::Y, Self::Z],
            Self::Y => [Self::X, Self::Z],
            Self::Z => [Self::X, Self::Y],
        }
    }
}

/// An axis with a sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SignedAxis {
    /// The axis.
    pub axis: Axis,
    /// Whether it points to smaller coordinates.
    pub negative: bool,
}

impl SignedAxis {
    /// 1 or -1.
    #[must_use]
    pub fn sign(self) -> f64 {
        if self.negative { -1.0 } else { 1.0 }
    }
}

impl FromStr for SignedAxis {
    type Err = UnknownName;

    fn from_str(text: &str) -> Result<Self, UnknownName> {
        let (negative, name) = match text.strip_prefix('-') {
            Some(name) => (true, name),
            None => (false, text.strip_prefix('+').unwrap_or(text)),
        };
        let axis = Axis::from_name(name)?;
        Ok(Self { axis, negative })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signed_axes_parse() {
        for (text, axis, negative) in [("x", Axis::X, false), ("+y", Axis::Y, false), ("-z", Axis::Z, true)] {
            assert_eq!(text.parse(), Ok(SignedAxis { axis, negative }));
        }
        assert!("--x".parse::<SignedAxis>().is_err());
    }
}
