//! Lambertian reflection.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use super::bsdf::{BsdfSample, BsdfValue};
use super::prepared::{MaterialError, Textures};
use super::{Material, MaterialKind, MaterialSettings, Model, Prepared, SIDES, read_colour, read_sides};
use crate::shade::parameters::{Parameter, Parameters};
use crate::shade::texture::{Texture, TextureSource};
use crate::shade::warp;

/// Mitsuba's `diffuse`.
pub(super) const KIND: MaterialKind = MaterialKind {
    name: "diffuse",
    keys: &[&["reflectance"], SIDES],
    read: |source| {
        let default = DiffuseSource::default();
        Some(Material::Diffuse(DiffuseSource {
            reflectance: read_colour(source, "reflectance", default.reflectance),
            two_sided: read_sides(source).unwrap_or(default.two_sided),
        }))
    },
};

/// Lambertian reflection.
#[derive(Clone, Debug, PartialEq)]
pub struct DiffuseSource {
    /// Share of light that is reflected.
    pub reflectance: TextureSource,
    /// Whether both sides reflect.
    pub two_sided: bool,
}

impl Default for DiffuseSource {
    fn default() -> Self {
        Self { reflectance: TextureSource::from(0.5), two_sided: true }
    }
}

impl MaterialSettings for DiffuseSource {
    fn kind(&self) -> &'static str {
        KIND.name
    }

    fn parameters(&self) -> Parameters<'_> {
        vec![("reflectance", Parameter::ColourTexture(&self.reflectance))]
    }

    fn two_sided(&self) -> Option<bool> {
        Some(self.two_sided)
    }

    fn prepare(&self, textures: &mut Textures) -> Result<Box<dyn Prepared>, MaterialError> {
        Ok(Box::new(PreparedDiffuse { reflectance: textures.read(&self.reflectance)? }))
    }
}

#[derive(Debug)]
struct PreparedDiffuse {
    reflectance: Texture,
}

impl Prepared for PreparedDiffuse {
    fn model(&self, uv: DVec2) -> Model<'_> {
        Model::Diffuse(Diffuse { reflectance: self.reflectance.colour(uv) })
    }

    fn diffuse_colour(&self, uv: DVec2) -> Option<DVec3> {
        Some(self.reflectance.colour(uv))
    }
}

/// Reflects light alike to all directions of the side it comes from, where the normal points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Diffuse {
    pub(super) reflectance: DVec3,
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
