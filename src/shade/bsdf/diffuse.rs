//! Lambertian reflection.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use super::{BsdfSample, BsdfValue};
use crate::shade::warp;

/// Reflects light alike to all directions of the side it comes from, where the normal points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::shade) struct Diffuse {
    pub(in crate::shade) reflectance: DVec3,
}

impl Diffuse {
    /// reflectance · cos(θ)/π, black below the horizon.
    pub(super) fn eval(&self, to_viewer: DVec3, to_light: DVec3) -> BsdfValue {
        if !(to_viewer.z > 0.0 && to_light.z > 0.0) {
            return BsdfValue::BLACK;
        }
        BsdfValue {
            value: self.reflectance * (FRAC_1_PI * to_light.z),
            pdf: warp::cosine_hemisphere_pdf(to_light.z),
        }
    }

    /// Draws in proportion to the cosine; BSDF, cosine and density cancel to the reflectance.
    pub(super) fn sample(&self, to_viewer: DVec3, u: DVec2) -> Option<BsdfSample> {
        let to_light = warp::cosine_hemisphere(u);
        let pdf = warp::cosine_hemisphere_pdf(to_light.z);
        (to_viewer.z > 0.0 && pdf > 0.0).then_some(BsdfSample {
            to_light,
            weight: self.reflectance,
            pdf,
            is_delta: false,
            eta: 1.0,
        })
    }
}
