//! The axes of a lattice.

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
