//! How large and how small the numbers of objects may be.

use glam::DVec3;
use thiserror::Error;

/// Greatest absolute value of a coordinate: products of four of them, times weights and degrees, are still far from the
/// end of double precision's range, 1e308.
pub(crate) const LARGEST: f64 = 1e60;

/// Least size: products of four are still far from where numbers lose digits, 1e-308.
pub(crate) const SMALLEST: f64 = 1e-60;

/// Greatest weight of a control point, and the inverse of the least: a weight counts as a coordinate does and multiplies one.
pub(crate) const HEAVIEST: f64 = 1e30;

/// Least size in parts of the greatest coordinate: some thousand roundings of it.
const LEAST_SHARE: f64 = 1e-12;

/// Numbers too large or too small to compute with.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum MagnitudeError {
    /// A coordinate.
    #[error(
        "a coordinate is {0:e}, but may be {LARGEST:e} at most: double precision has to hold products of coordinates"
    )]
    TooLarge(f64),
    /// The greatest extent along an axis.
    #[error(
        "its size is {0:e}, but must be {SMALLEST:e} at least: double precision has to hold products of lengths"
    )]
    TooSmall(f64),
    /// The size beside the greatest coordinate.
    #[error(
        "its size is {size:e} at coordinates of {coordinate:e}, where double precision rounds by more than its details: \
         a place nearer to the origin would do"
    )]
    TooFar {
        /// The greatest extent along an axis.
        size: f64,
        /// The greatest coordinate.
        coordinate: f64,
    },
}

/// The greatest absolute coordinate of some points; infinite if one is not a number.
pub(crate) fn greatest(points: impl IntoIterator<Item = DVec3>) -> f64 {
    points.into_iter().fold(0.0, |most: f64, point| {
        let size = point.abs().max_element();
        // so written, NaN is infinite
        if point.is_finite() { most.max(size) } else { f64::INFINITY }
    })
}

/// Refuses a box that is too large, or too small.
///
/// # Errors
/// [`MagnitudeError`] with the value.
pub(crate) fn check([low, high]: [DVec3; 2]) -> Result<(), MagnitudeError> {
    let most = greatest([low, high]);
    if most > LARGEST {
        return Err(MagnitudeError::TooLarge(most));
    }
    let size = (high - low).max_element();
    if size < SMALLEST {
        return Err(MagnitudeError::TooSmall(size));
    }
    if size < LEAST_SHARE * most {
        return Err(MagnitudeError::TooFar { size, coordinate: most });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_of_usable_size_pass() {
        let cube = |size: f64| check([DVec3::ZERO, DVec3::splat(size)]);
        for size in [1e-59, 1.0, 1e59] {
            assert_eq!(cube(size), Ok(()), "{size}");
        }
        assert_eq!(check([DVec3::ZERO, DVec3::X]), Ok(()), "flat");
        let far = |size: f64| check([DVec3::X, DVec3::X + size]);
        assert_eq!(far(1e-11), Ok(()));
        assert!(matches!(far(1e-13), Err(MagnitudeError::TooFar { .. })), "{:?}", far(1e-13));
        assert_eq!(cube(1e61), Err(MagnitudeError::TooLarge(1e61)));
        assert_eq!(cube(f64::NAN), Err(MagnitudeError::TooLarge(f64::INFINITY)));
        assert_eq!(cube(1e-61), Err(MagnitudeError::TooSmall(1e-61)));
        assert_eq!(cube(0.0), Err(MagnitudeError::TooSmall(0.0)));
    }
}
