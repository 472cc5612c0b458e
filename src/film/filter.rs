//! Reconstruction filters: how much a sample counts for the pixels around it.

use crate::choice::Choice;

/// Reconstruction filter, with Mitsuba's names, widths and parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Filter {
    /// Each sample counts for its own pixel alone.
    #[default]
    Box,
    /// Falls linearly to 0 at a distance of one pixel.
    Tent,
    /// A Gaussian of standard deviation 1/2, lowered to be 0 where it ends, at 2.
    Gaussian,
    /// Mitchell and Netravali (1988), *Reconstruction filters in computer graphics*, with B = C = 1/3.
    Mitchell,
    /// The same with B = 0, C = 1/2: the Catmull-Rom spline, which is 1 at its own pixel and 0 at others.
    CatmullRom,
    /// sin(πx)/(πx) under its own main lobe stretched to 3 pixels (Lanczos).
    Lanczos,
}

impl Choice for Filter {
    const WHAT: &'static str = "filter";
    const ALL: &'static [Self] =
        &[Self::Box, Self::Tent, Self::Gaussian, Self::Mitchell, Self::CatmullRom, Self::Lanczos];

    fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Tent => "tent",
            Self::Gaussian => "gaussian",
            Self::Mitchell => "mitchell",
            Self::CatmullRom => "catmullrom",
            Self::Lanczos => "lanczos",
        }
    }
}

impl Filter {
    /// The greatest [`Self::border`].
    pub(super) const MAX_BORDER: u32 = Self::Lanczos.border();

    /// Distance along each axis from which the filter is 0, in pixels.
    #[must_use]
    pub const fn radius(self) -> f64 {
        match self {
            Self::Box => 0.5,
            Self::Tent => 1.0,
            Self::Gaussian | Self::Mitchell | Self::CatmullRom => 2.0,
            Self::Lanczos => 3.0,
        }
    }

    /// How many pixels to each side of its own a sample counts for at most.
    #[must_use]
    pub const fn border(self) -> u32 {
        match self {
            Self::Box => 0,
            Self::Tent => 1,
            Self::Gaussian | Self::Mitchell | Self::CatmullRom => 2,
            Self::Lanczos => 3,
        }
    }

    /// The filter at a distance from the pixel's centre along one axis; of two axes the product counts. Not normalised.
    #[must_use]
    pub fn eval(self, distance: f64) -> f64 {
        let x = distance.abs();
        if x >= self.radius() {
            return 0.0;
        }
        match self {
            Self::Box => 1.0,
            Self::Tent => 1.0 - x,
            Self::Gaussian => libm::exp(-2.0 * x * x) - libm::exp(-8.0),
            Self::Mitchell => cubic(x, 1.0 / 3.0, 1.0 / 3.0),
            Self::CatmullRom => cubic(x, 0.0, 0.5),
            Self::Lanczos => sinc(x) * sinc(x / 3.0),
        }
    }
}

/// The family of cubics of Mitchell and Netravali (1988), equation 8, for 0 <= x < 2.
fn cubic(x: f64, b: f64, c: f64) -> f64 {
    let [third, second, first, constant] = if x < 1.0 {
        [12.0 - 9.0 * b - 6.0 * c, -18.0 + 12.0 * b + 6.0 * c, 0.0, 6.0 - 2.0 * b]
    } else {
        [-b - 6.0 * c, 6.0 * b + 30.0 * c, -12.0 * b - 48.0 * c, 8.0 * b + 24.0 * c]
    };
    (((third * x + second) * x + first) * x + constant) / 6.0
}

/// sin(πx)/(πx).
fn sinc(x: f64) -> f64 {
    let x = std::f64::consts::PI * x;
    if x < 1e-9 { 1.0 } else { libm::sin(x) / x }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_are_mitsubas() {
        // printed by Mitsuba 3.9.1: mi.load_dict({"type": ...}).eval(x), single precision
        let at = [0.0, 0.3, 0.7, 1.2, 1.7, 2.4];
        let cases = [
            (Filter::Tent, TENT),
            (Filter::Gaussian, GAUSSIAN),
            (Filter::Mitchell, MITCHELL),
            (Filter::CatmullRom, CATMULL_ROM),
            (Filter::Lanczos, LANCZOS),
        ];
        for (filter, want) in cases {
            for (x, want) in at.into_iter().zip(want) {
                // Mitsuba's Gaussian is a polynomial that is off by up to 1e-3
                let bound = if filter == Filter::Gaussian { 2e-3 } else { 1e-6 };
                for x in [x, -x] {
                    let got = filter.eval(x);
                    assert!((got - want).abs() < bound, "{filter:?} at {x}: got {got}, want {want}");
                }
            }
            assert_eq!(filter.eval(filter.radius()), 0.0);
            assert!(f64::from(filter.border()) + 0.5 >= filter.radius() - 0.5);
        }
    }

    const TENT: [f64; 6] = [1.0000000, 0.7000000, 0.3000000, 0.0000000, 0.0000000, 0.0000000];
    const GAUSSIAN: [f64; 6] = [0.9992471, 0.8350478, 0.3749484, 0.0558084, 0.0027441, 0.0000000];
    const MITCHELL: [f64; 6] = [0.8888890, 0.7403890, 0.3090556, -0.0142223, -0.0194999, 0.0000000];
    const CATMULL_ROM: [f64; 6] = [1.0000000, 0.8155000, 0.2895000, -0.0640001, -0.0314999, 0.0000000];
    const LANCZOS: [f64; 6] = [1.0000000, 0.8443431, 0.3358103, -0.1180006, -0.0832311, 0.0295001];
}
