//! What materials do to light at a point: values, densities and samples.
//!
//! Directions point away from the surface and have length 1. Within the models they are in the shading frame, whose z axis is
//! the shading normal.

mod diffuse;

use glam::DVec3;

use crate::trace::SurfaceInteraction;
use diffuse::Diffuse;
use glam::DVec2;

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

/// The reflection model of a material at one point, its parameters looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Model {
    /// Lambertian reflection.
    Diffuse(Diffuse),
}

impl Model {
    pub(super) const fn diffuse(reflectance: DVec3) -> Self {
        Self::Diffuse(Diffuse { reflectance })
    }

    fn eval(&self, to_viewer: DVec3, to_light: DVec3) -> BsdfValue {
        match self {
            Self::Diffuse(diffuse) => diffuse.eval(to_viewer, to_light),
        }
    }

    fn sample(&self, to_viewer: DVec3, _choice: f64, u: DVec2) -> Option<BsdfSample> {
        match self {
            Self::Diffuse(diffuse) => diffuse.sample(to_viewer, u),
        }
    }

    fn has_smooth_part(&self) -> bool {
        match self {
            Self::Diffuse(_) => true,
        }
    }
}

/// A material at one point of a surface, for directions of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bsdf {
    model: Model,
    two_sided: bool,
    /// Right-handed: x along the texture coordinate u if there is one, z the shading normal.
    frame: [DVec3; 3],
}

impl Bsdf {
    pub(super) fn new(model: Model, two_sided: bool, surface: &SurfaceInteraction) -> Self {
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

    /// Whether it has more than delta distributions, so that lights can be seen in it by chance.
    pub fn has_smooth_part(&self) -> bool {
        self.model.has_smooth_part()
    }

    fn local(&self, direction: DVec3) -> DVec3 {
        let [x, y, z] = self.frame;
        DVec3::new(x.dot(direction), y.dot(direction), z.dot(direction))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_1_PI;

    use super::*;
    use crate::shade::testing::surface;
    use crate::shade::{Sampler, warp};

    fn clay(two_sided: bool, normal: DVec3) -> Bsdf {
        Bsdf::new(Model::diffuse(DVec3::new(0.6, 0.5, 0.4)), two_sided, &surface(normal))
    }

    #[test]
    fn samples_agree_with_eval() {
        for i in 0..10_000 {
            let mut sampler = Sampler::new(3, [i, 0], 0);
            let normal = warp::uniform_sphere(sampler.next_2d()).normalize();
            let viewer = warp::uniform_sphere(sampler.next_2d()).normalize();
            let u = sampler.next_2d();
            let sample = clay(true, normal).sample(viewer, 0.5, u).unwrap();
            let value = clay(true, normal).eval(viewer, sample.to_light);
            assert!((value.pdf / sample.pdf - 1.0).abs() < 1e-9, "sample {i}: {} {}", value.pdf, sample.pdf);
            let off = (value.value / value.pdf - sample.weight).abs().max_element();
            assert!(off < 1e-14, "sample {i}: off by {off:e}");
            let same_side = normal.dot(viewer) * normal.dot(sample.to_light);
            assert!(same_side > 0.0, "sample {i} went through the surface");
            let one_sided = clay(false, normal).sample(viewer, 0.5, u);
            assert_eq!(one_sided.is_some(), normal.dot(viewer) > 0.0);
        }
    }

    #[test]
    fn sides() {
        let (above, below) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.6, 0.0, -0.8));
        let lit = DVec3::new(0.6, 0.5, 0.4) * (0.8 * FRAC_1_PI);
        for two_sided in [false, true] {
            let material = clay(two_sided, DVec3::Z);
            assert_eq!(material.eval(above, above).value, lit);
            assert_eq!(material.eval(above, below), BsdfValue::BLACK);
            assert_eq!(material.eval(below, above), BsdfValue::BLACK);
        }
        assert_eq!(clay(true, DVec3::Z).eval(below, below).value, lit);
        assert_eq!(clay(false, DVec3::Z).eval(below, below), BsdfValue::BLACK);
        assert_eq!(clay(true, DVec3::Z).sample(DVec3::X, 0.5, DVec2::splat(0.3)), None);
    }
}
