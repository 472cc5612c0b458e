//! Materials.

use glam::DVec3;

use super::bsdf::{Bsdf, Diffuse, Model};
use crate::trace::SurfaceInteraction;

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

impl Material {
    /// The `albedo` layer's value at a point.
    pub const fn albedo(&self, _surface: &SurfaceInteraction) -> DVec3 {
        let Self::Diffuse { reflectance, .. } = self;
        *reflectance
    }

    /// The material at a point.
    pub fn bsdf(&self, surface: &SurfaceInteraction) -> Bsdf<'_> {
        let Self::Diffuse { reflectance, two_sided } = self;
        Bsdf::new(Model::Diffuse(Diffuse { reflectance: *reflectance }), *two_sided, surface)
    }
}
