//! Materials that a mesh's own file defines.

use std::path::PathBuf;

use glam::DVec3;

/// A material of glTF's model: a base colour, and how metallic and how rough the surface is.
///
/// Source: Khronos Group (2021), *glTF 2.0 Specification*, section 3.9.2 and appendix B.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshMaterial {
    /// Its name.
    pub name: String,
    /// Linear RGB, each in `[0, 1]`.
    pub base_color: DVec3,
    /// The picture of the base colour, in place of [`Self::base_color`].
    pub picture: Option<PathBuf>,
    /// In `[0, 1]`.
    pub metallic: f64,
    /// In `[0, 1]`: the square root of the microfacet distribution's.
    pub roughness: f64,
    /// The radiance that it emits, linear RGB from 0 on.
    pub emission: DVec3,
    /// What else the file says of it that is not used.
    pub left_out: Vec<&'static str>,
}
