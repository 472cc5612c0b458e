//! A point that shines into a cone.

use glam::{DAffine3, DMat3, DVec3};

use super::{LightSample, point};

/// Mitsuba's `spot`: at the origin, around +z, placed by `to_world`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    position: DVec3,
    to_local: DMat3,
    intensity: DVec3,
    /// In radians, of half the cone.
    cutoff: f64,
    /// In radians, of the inner cone that is not dimmed.
    beam: f64,
}

impl Spot {
    /// Angles in degrees, `beam_width` not above `cutoff_angle`; none if `to_world` cannot be inverted.
    pub(super) fn try_new(
        to_world: &DAffine3,
        intensity: DVec3,
        [cutoff_angle, beam_width]: [f64; 2],
    ) -> Option<Self> {
        let to_local = to_world.matrix3.inverse();
        let usable = to_local.is_finite() && to_world.is_finite() && beam_width <= cutoff_angle;
        usable.then(|| Self {
            position: to_world.translation,
            to_local,
            intensity,
            cutoff: cutoff_angle.to_radians(),
            beam: beam_width.to_radians(),
        })
    }

    /// The light on a point; none outside the cone.
    pub(super) fn sample(&self, from: DVec3) -> Option<LightSample> {
        let falloff = self.falloff(from - self.position);
        (falloff > 0.0).then(|| point::sample(from, self.position, falloff * self.intensity)).flatten()
    }

    /// The share of the intensity in a direction: 1 in the beam, falling linearly with the angle to 0
    /// at the cutoff.
    fn falloff(&self, direction: DVec3) -> f64 {
        let local = self.to_local * direction;
        let angle = libm::atan2(local.truncate().length(), local.z);
        if angle <= self.beam {
            1.0
        } else if angle < self.cutoff {
            (self.cutoff - angle) / (self.cutoff - self.beam)
        } else {
            0.0
        }
    }
}
