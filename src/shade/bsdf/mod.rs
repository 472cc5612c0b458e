//! What materials do to light at a point: values, densities and samples.
//!
//! Directions point away from the surface and have length 1. Within the models they are in the shading frame, whose z axis is
//! the shading normal.

mod conductor;
mod dielectric;
mod diffuse;
mod fresnel;
mod metals;
mod microfacet;
mod plastic;
mod principled;
mod quadrature;
mod refractive_index;
#[cfg(test)]
mod tests;

use glam::{DVec2, DVec3};

use crate::trace::SurfaceInteraction;

pub use metals::{METAL_NAMES, metal};
pub use microfacet::MicrofacetDistribution;
pub use refractive_index::{REFRACTIVE_INDICES, refractive_index};

pub(super) use conductor::{Conductor, Metal, RoughConductor};
pub(super) use dielectric::{Dielectric, Glass, RoughDielectric};
pub(super) use diffuse::Diffuse;
pub(super) use microfacet::Microfacets;
pub(super) use plastic::{Coat, Plastic, RoughCoat, RoughPlastic};
pub(super) use principled::{Parameters as PrincipledParameters, Principled};

/// What a material does to light between two directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfValue {
    /// BSDF times the cosine of the incoming light's angle with the normal, in 1/sr.
    pub value: DVec3,
    /// Density by solid angle with which [`Bsdf::sample`] draws the direction.
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
    fn of(to_light: DVec3, value: BsdfValue, eta: f64) -> Option<Self> {
        let BsdfValue { value, pdf } = value;
        (pdf > 0.0).then(|| Self { to_light, weight: value / pdf, pdf, is_delta: false, eta })
    }
}

/// Whether a direction is on the normal's side; not along the surface, nor NaN.
fn is_above(direction: DVec3) -> bool {
    direction.z > 0.0
}

/// Brightness of a colour in linear sRGB, with Mitsuba's coefficients.
pub(super) fn luminance(colour: DVec3) -> f64 {
    colour.dot(DVec3::new(0.212_671, 0.715_160, 0.072_169))
}

/// The model of a material at one point, its parameters looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Model<'a> {
    /// Lambertian reflection.
    Diffuse(Diffuse),
    /// A smooth metal or mirror.
    Conductor(Conductor),
    /// A rough metal.
    RoughConductor(RoughConductor),
    /// Clear glass.
    Dielectric(Dielectric),
    /// Frosted glass.
    RoughDielectric(RoughDielectric),
    /// A diffuse base under a smooth coat.
    Plastic(Plastic),
    /// A diffuse base under a rough coat.
    RoughPlastic(RoughPlastic<'a>),
    /// Disney's model of many lobes.
    Principled(Principled),
}

impl Model<'_> {
    fn eval(&self, to_viewer: DVec3, to_light: DVec3) -> BsdfValue {
        match self {
            Self::Diffuse(diffuse) => diffuse.eval(to_viewer, to_light),
            Self::Conductor(_) | Self::Dielectric(_) => BsdfValue::BLACK,
            Self::RoughConductor(conductor) => conductor.eval(to_viewer, to_light),
            Self::RoughDielectric(dielectric) => dielectric.eval(to_viewer, to_light),
            Self::Plastic(plastic) => plastic.eval(to_viewer, to_light),
            Self::RoughPlastic(plastic) => plastic.eval(to_viewer, to_light),
            Self::Principled(principled) => principled.eval(to_viewer, to_light),
        }
    }

    fn sample(&self, to_viewer: DVec3, choice: f64, u: DVec2) -> Option<BsdfSample> {
        match self {
            Self::Diffuse(diffuse) => diffuse.sample(to_viewer, u),
            Self::Conductor(conductor) => conductor.sample(to_viewer),
            Self::RoughConductor(conductor) => conductor.sample(to_viewer, u),
            Self::Dielectric(dielectric) => dielectric.sample(to_viewer, choice),
            Self::RoughDielectric(dielectric) => dielectric.sample(to_viewer, choice, u),
            Self::Plastic(plastic) => plastic.sample(to_viewer, choice, u),
            Self::RoughPlastic(plastic) => plastic.sample(to_viewer, choice, u),
            Self::Principled(principled) => principled.sample(to_viewer, choice, u),
        }
    }

    const fn has_smooth_part(&self) -> bool {
        !matches!(self, Self::Conductor(_) | Self::Dielectric(_))
    }
}

/// A material at one point of a surface, for directions of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bsdf<'a> {
    model: Model<'a>,
    two_sided: bool,
    /// Right-handed: x along the texture coordinate u if there is one, z the shading normal.
    frame: [DVec3; 3],
}

impl<'a> Bsdf<'a> {
    pub(super) fn new(model: Model<'a>, two_sided: bool, surface: &SurfaceInteraction) -> Self {
        let normal = surface.shading_normal;
        let along_u = surface.dp_du - normal * normal.dot(surface.dp_du);
        let frame = match along_u.try_normalize() {
            Some(tangent) => [tangent, normal.cross(tangent), normal],
            None => {
                let (tangent, bitangent) = normal.any_orthonormal_pair();
                [tangent, bitangent, normal]
            }
        };
        Self { model, two_sided, frame }
    }

    /// BSDF times cosine, and the density of sampling, without delta distributions.
    ///
    /// A two-sided material does on the side that the normal turns away from what it does on the other, as Mitsuba's
    /// `twosided`.
    pub fn eval(&self, to_viewer: DVec3, to_light: DVec3) -> BsdfValue {
        let (mut viewer, mut light) = (self.local(to_viewer), self.local(to_light));
        if self.two_sided && viewer.z < 0.0 {
            (viewer.z, light.z) = (-viewer.z, -light.z);
        }
        self.model.eval(viewer, light)
    }

    /// Draws a direction by uniform numbers in `[0, 1)`: `choice` of the part of the model, `u` of the direction.
    ///
    /// None where no light comes from the direction drawn.
    pub fn sample(&self, to_viewer: DVec3, choice: f64, u: DVec2) -> Option<BsdfSample> {
        let mut viewer = self.local(to_viewer);
        let turned = self.two_sided && viewer.z < 0.0;
        if turned {
            viewer.z = -viewer.z;
        }
        let mut sample = self.model.sample(viewer, choice, u)?;
        if turned {
            sample.to_light.z = -sample.to_light.z;
        }
        let [x, y, z] = self.frame;
        let local = sample.to_light;
        sample.to_light = (local.x * x + local.y * y + local.z * z).normalize();
        Some(sample)
    }

    /// BSDF for light along the normal, of a two-sided material on the viewer's side.
    pub(super) fn under_normal_light(&self, to_viewer: DVec3) -> DVec3 {
        let mut viewer = self.local(to_viewer);
        if self.two_sided {
            viewer.z = viewer.z.abs();
        }
        self.model.eval(viewer, DVec3::Z).value
    }

    /// Whether it has more than delta distributions, so that lights can be seen in it by chance.
    pub fn has_smooth_part(&self) -> bool {
        self.model.has_smooth_part()
    }

    fn local(&self, direction: DVec3) -> DVec3 {
        let [x, y, z] = self.frame;
        DVec3::new(x.dot(direction), y.dot(direction), z.dot(direction))
    }
}
