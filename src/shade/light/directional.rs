//! A light so far away that it comes from one direction.

use glam::DVec3;

use super::{Light, LightKind, LightSample, LightSettings};
use crate::math::linear::unit_vector;
use crate::shade::parameters::{Parameter, ParameterSource, Parameters};

/// Mitsuba's `directional`.
pub(super) const KIND: LightKind = LightKind {
    name: "directional",
    shape: None,
    keys: &["direction", "to_world", "irradiance"],
    surrounds: false,
    read: |source| {
        let irradiance = source.emission("irradiance");
        let direction = read_direction(source)?;
        Some(Light::Directional(DirectionalLight { direction, irradiance }))
    },
};

/// Light that comes from infinitely far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionalLight {
    /// The way it goes, of any length but 0.
    pub direction: DVec3,
    /// Irradiance of a surface that faces it.
    pub irradiance: DVec3,
}

/// The direction, or where `to_world` takes +z.
fn read_direction(source: &dyn ParameterSource) -> Option<DVec3> {
    if !source.has("direction") {
        return unit_vector(source.placement("to_world")?.matrix3.z_axis);
    }
    if source.has("to_world") {
        let message = "a directional light has direction or to_world, not both";
        source.report_key("to_world", message.to_owned());
    }
    let direction = unit_vector(source.vector("direction", "[x, y, z] of finite numbers, not all 0")?);
    if direction.is_none() {
        source.report_value("direction", "direction must not be [0, 0, 0]".to_owned());
    }
    direction
}

impl LightSettings for DirectionalLight {
    fn kind(&self) -> &'static str {
        KIND.name
    }

    fn parameters(&self) -> Parameters<'_> {
        vec![
            ("direction", Parameter::Vector(self.direction)),
            ("irradiance", Parameter::Colour(self.irradiance)),
        ]
    }
}

impl DirectionalLight {
    /// The light with a direction of length 1; none if there is no direction.
    pub(super) fn normalized(&self) -> Option<Self> {
        Some(Self { direction: self.direction.try_normalize()?, ..*self })
    }

    /// The light on any point; the direction must have length 1.
    pub(super) fn sample(&self) -> LightSample {
        LightSample {
            direction: -self.direction,
            end: None,
            weight: self.irradiance,
            pdf: 1.0,
            is_delta: true,
        }
    }
}
