//! What materials do to light between two directions.

use glam::DVec3;

/// What a material does to light between two directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfValue {
    /// BSDF times the cosine of the incoming light's angle with the normal, in 1/sr.
    pub value: DVec3,
    /// Density by solid angle with which [`Bsdf::sample`](super::Bsdf::sample) draws the direction.
    pub pdf: f64,
}

impl BsdfValue {
    /// No light goes this way, and no sample does.
    pub const BLACK: Self = Self { value: DVec3::ZERO, pdf: 0.0 };
}

/// A direction drawn by a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Unit direction towards where the light comes from.
    pub to_light: DVec3,
    /// BSDF times cosine, divided by `pdf`; of a delta distribution its strength over the probability of its choice.
    pub weight: DVec3,
    /// Density by solid angle; of a delta distribution the probability of its choice.
    pub pdf: f64,
    /// Whether no other strategy can find this direction (mirrors, clear glass).
    pub is_delta: bool,
    /// Index of refraction that the path goes through, relative to before: 1 for reflection.
    pub eta: f64,
}

impl BsdfSample {
    /// A sample of what is no delta distribution; none if it is never drawn.
    pub(super) fn smooth(to_light: DVec3, value: BsdfValue, eta: f64) -> Option<Self> {
        let BsdfValue { value, pdf } = value;
        (pdf > 0.0).then(|| Self { to_light, weight: value / pdf, pdf, is_delta: false, eta })
    }
}

/// Whether a direction is on the normal's side; not along the surface, nor NaN.
pub(super) fn is_above(direction: DVec3) -> bool {
    direction.z > 0.0
}
