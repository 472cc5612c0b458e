//! A sky that is alike all around.

use glam::{DVec2, DVec3};

use super::{Light, LightKind, LightSample, LightSettings};
use crate::shade::parameters::{Parameter, Parameters};
use crate::shade::warp;

/// Mitsuba's `constant`.
pub(super) const KIND: LightKind = LightKind {
    name: "constant",
    shape: None,
    keys: &["radiance"],
    surrounds: true,
    read: |source| Some(Light::Constant(ConstantLight { radiance: source.emission("radiance") })),
};

/// The same radiance from every direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantLight {
    /// Radiance.
    pub radiance: DVec3,
}

impl LightSettings for ConstantLight {
    fn kind(&self) -> &'static str {
        KIND.name
    }

    fn parameters(&self) -> Parameters<'_> {
        vec![("radiance", Parameter::Colour(self.radiance))]
    }
}

impl ConstantLight {
    /// A direction, uniform over the sphere.
    pub(super) fn sample(&self, u: DVec2) -> LightSample {
        LightSample {
            direction: warp::uniform_sphere(u),
            end: None,
            weight: self.radiance / warp::UNIFORM_SPHERE_PDF,
            pdf: warp::UNIFORM_SPHERE_PDF,
            is_delta: false,
        }
    }
}
