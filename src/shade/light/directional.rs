//! A light so far away that it comes from one direction.

use glam::DVec3;

use super::LightSample;

/// The light of unit `direction`, the way it goes; as Mitsuba's `directional`.
pub(super) fn sample(direction: DVec3, irradiance: DVec3) -> LightSample {
    LightSample { direction: -direction, end: None, weight: irradiance, pdf: 1.0, is_delta: true }
}
