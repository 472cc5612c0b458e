//! Materials.

use glam::DVec3;

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
