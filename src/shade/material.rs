//! Materials.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use super::warp;

/// A material as the scene file gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Material {
    /// Lambertian reflection.
    Diffuse {
        /// Reflectance, linear RGB, each in `[0, 1]`.
        reflectance: DVec3,
        /// Whether the side that the normal turns away from reflects too; it is black otherwise.
        two_sided: bool,
    },
}

impl Default for Material {
    fn default() -> Self {
        Self::Diffuse { reflectance: DVec3::splat(0.5), two_sided: true }
    }
}

/// What a material does to light between two directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfValue {
    /// BSDF times the cosine of the incoming light's angle with the normal, in 1/sr.
    pub value: DVec3,
    /// Density by solid angle with which [`Material::sample`] draws the direction.
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
    /// BSDF times cosine, divided by `pdf`.
    pub weight: DVec3,
    /// Density by solid angle.
    pub pdf: f64,
}

impl Material {
    /// The `albedo` layer's value.
    pub const fn albedo(&self) -> DVec3 {
        let Self::Diffuse { reflectance, .. } = self;
        *reflectance
    }

    /// BSDF times cosine, and the density of sampling, for unit directions away from the surface.
    ///
    /// Lambert: reflectance · cos(θ)/π where both directions are on the reflecting side. A
    /// two-sided material reflects on the viewer's side, whichever that is, as Mitsuba's
    /// `twosided`; a one-sided one where the normal points.
    pub fn eval(&self, normal: DVec3, to_viewer: DVec3, to_light: DVec3) -> BsdfValue {
        let Some(side) = self.reflecting_normal(normal, to_viewer) else {
            return BsdfValue::BLACK;
        };
        let cos_light = side.dot(to_light);
        if cos_light.is_nan() || cos_light <= 0.0 {
            return BsdfValue::BLACK;
        }
        let Self::Diffuse { reflectance, .. } = self;
        BsdfValue {
            value: *reflectance * (FRAC_1_PI * cos_light),
            pdf: warp::cosine_hemisphere_pdf(cos_light),
        }
    }

    /// Draws a direction in proportion to the cosine, from uniform `u` in `[0, 1)²`.
    ///
    /// None where the surface is black for this viewer. The weight is the reflectance itself,
    /// since BSDF, cosine and density cancel.
    pub fn sample(&self, normal: DVec3, to_viewer: DVec3, u: DVec2) -> Option<BsdfSample> {
        let side = self.reflecting_normal(normal, to_viewer)?;
        let local = warp::cosine_hemisphere(u);
        let to_light = warp::to_world(side, local).normalize();
        // the density of the direction as it came out, so that `eval` gives the same
        let pdf = warp::cosine_hemisphere_pdf(side.dot(to_light));
        let Self::Diffuse { reflectance, .. } = self;
        (pdf > 0.0).then_some(BsdfSample { to_light, weight: *reflectance, pdf })
    }

    /// The normal on the side that reflects towards the viewer; none where it is black.
    fn reflecting_normal(&self, normal: DVec3, to_viewer: DVec3) -> Option<DVec3> {
        let Self::Diffuse { two_sided, .. } = self;
        let cos_viewer = normal.dot(to_viewer);
        if cos_viewer > 0.0 {
            Some(normal)
        } else if cos_viewer < 0.0 && *two_sided {
            Some(-normal)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shade::Sampler;

    fn clay(two_sided: bool) -> Material {
        Material::Diffuse { reflectance: DVec3::new(0.6, 0.5, 0.4), two_sided }
    }

    #[test]
    fn samples_agree_with_eval() {
        for i in 0..10_000 {
            let mut sampler = Sampler::new(3, [i, 0], 0);
            let normal = warp::uniform_sphere(sampler.next_2d()).normalize();
            let viewer = warp::uniform_sphere(sampler.next_2d()).normalize();
            let u = sampler.next_2d();
            let sample = clay(true).sample(normal, viewer, u).unwrap();
            let value = clay(true).eval(normal, viewer, sample.to_light);
            assert_eq!(value.pdf, sample.pdf);
            let off = (value.value / value.pdf - sample.weight).abs().max_element();
            assert!(off < 1e-14, "sample {i}: off by {off:e}");
            let same_side = normal.dot(viewer) * normal.dot(sample.to_light);
            assert!(same_side > 0.0, "sample {i} went through the surface");
            let one_sided = clay(false).sample(normal, viewer, u);
            assert_eq!(one_sided.is_some(), normal.dot(viewer) > 0.0);
        }
    }

    #[test]
    fn sides() {
        let (above, below) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.6, 0.0, -0.8));
        let lit = DVec3::new(0.6, 0.5, 0.4) * (0.8 * FRAC_1_PI);
        for two_sided in [false, true] {
            let material = clay(two_sided);
            assert_eq!(material.eval(DVec3::Z, above, above).value, lit);
            assert_eq!(material.eval(DVec3::Z, above, below), BsdfValue::BLACK);
            assert_eq!(material.eval(DVec3::Z, below, above), BsdfValue::BLACK);
        }
        assert_eq!(clay(true).eval(DVec3::Z, below, below).value, lit);
        assert_eq!(clay(false).eval(DVec3::Z, below, below), BsdfValue::BLACK);
        assert_eq!(clay(true).sample(DVec3::Z, DVec3::X, DVec2::splat(0.3)), None);
    }
}
