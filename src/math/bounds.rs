//! Boxes around points.

use glam::DVec3;

/// The box around nothing: infinite corners the other way round.
pub(crate) const NONE: [DVec3; 2] = [DVec3::INFINITY, DVec3::NEG_INFINITY];

/// Lowest and highest corner of the box around points; of none, [`NONE`].
pub(crate) fn around(points: impl IntoIterator<Item = DVec3>) -> [DVec3; 2] {
    points.into_iter().fold(NONE, |[low, high], point| [low.min(point), high.max(point)])
}
