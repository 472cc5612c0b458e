//! Boxes around points.

use glam::DVec3;

/// Lowest and highest corner of the box around points; of none, infinite ones the other way round.
pub(crate) fn around(points: impl IntoIterator<Item = DVec3>) -> [DVec3; 2] {
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    points.into_iter().fold(none, |[low, high], point| [low.min(point), high.max(point)])
}
