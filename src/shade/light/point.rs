//! A point that shines alike in all directions.

use glam::DVec3;

use super::{Light, LightEnd, LightKind, LightSample, LightSettings};
use crate::math::rounding::gamma;
use crate::shade::parameters::{Parameter, Parameters};

/// Mitsuba's `point`.
pub(super) const KIND: LightKind = LightKind {
    name: "point",
    shape: None,
    keys: &["position", "intensity"],
    surrounds: false,
    read: |source| {
        let expected = "a point [x, y, z] of finite numbers";
        source.require("position", expected);
        let (position, intensity) = (source.vector("position", expected), source.emission("intensity"));
        position.map(|position| Light::Point(PointLight { position, intensity }))
    },
};

/// A point that shines alike in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// Where it is.
    pub position: DVec3,
    /// Radiant intensity (power per solid angle).
    pub intensity: DVec3,
}

impl LightSettings for PointLight {
    fn kind(&self) -> &'static str {
        KIND.name
    }

    fn parameters(&self) -> Parameters<'_> {
        vec![("position", Parameter::Point(self.position)), ("intensity", Parameter::Colour(self.intensity))]
    }
}

impl PointLight {
    /// The light on a point: intensity / distance².
    pub(super) fn sample(&self, from: DVec3) -> Option<LightSample> {
        let way = self.position - from;
        let distance = way.length();
        (distance > 0.0).then(|| LightSample {
            direction: way / distance,
            end: Some(LightEnd {
                position: self.position,
                // given exactly; the subtraction that makes the ray rounds once
                position_error: gamma(1) * self.position.abs().max_element(),
                cos_light: 1.0,
                light: None,
            }),
            weight: self.intensity / (distance * distance),
            pdf: 1.0,
            is_delta: true,
        })
    }
}
