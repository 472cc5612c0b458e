//! A point that shines into a cone.

use glam::{DAffine3, DMat3, DVec3};

use super::point::PointLight;
use super::{Light, LightKind, LightSample, LightSettings};
use crate::shade::parameters::{Parameter, Parameters};

/// Mitsuba's `spot`.
pub(super) const KIND: LightKind = LightKind {
    name: "spot",
    shape: None,
    keys: &["to_world", "intensity", "cutoff_angle", "beam_width"],
    surrounds: false,
    read: |source| {
        let (to_world, intensity) = (source.placement("to_world"), source.emission("intensity"));
        let expected = "degrees above 0, up to 180";
        let cutoff = source.number("cutoff_angle", expected, &|angle| angle > 0.0 && angle <= 180.0);
        let cutoff_angle = cutoff.unwrap_or(20.0);
        let expected = "degrees from 0 up to cutoff_angle";
        let beam = source.number("beam_width", expected, &|angle| (0.0..=cutoff_angle).contains(&angle));
        let beam_width = beam.unwrap_or(0.75 * cutoff_angle);
        Some(Light::Spot(SpotLight { to_world: to_world?, intensity, cutoff_angle, beam_width }))
    },
};

/// A point that shines into a cone around +z, placed by `to_world`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotLight {
    /// Places the cone in the world.
    pub to_world: DAffine3,
    /// Radiant intensity within `beam_width`.
    pub intensity: DVec3,
    /// Degrees from the axis beyond which it is dark.
    pub cutoff_angle: f64,
    /// Degrees from the axis up to which it is not dimmed; at most `cutoff_angle`.
    pub beam_width: f64,
}

impl LightSettings for SpotLight {
    fn kind(&self) -> &'static str {
        KIND.name
    }

    fn parameters(&self) -> Parameters<'_> {
        vec![
            ("to_world", Parameter::Placement(self.to_world)),
            ("intensity", Parameter::Colour(self.intensity)),
            ("cutoff_angle", Parameter::Number(self.cutoff_angle)),
            ("beam_width", Parameter::Number(self.beam_width)),
        ]
    }
}

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
    /// None if `to_world` cannot be inverted, or `beam_width` is above `cutoff_angle`.
    pub(super) fn try_new(settings: &SpotLight) -> Option<Self> {
        let SpotLight { to_world, intensity, cutoff_angle, beam_width } = *settings;
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
        let point = PointLight { position: self.position, intensity: falloff * self.intensity };
        (falloff > 0.0).then(|| point.sample(from)).flatten()
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
