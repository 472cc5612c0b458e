//! What one sample brings to its pixel.

use glam::{DVec2, DVec3};

/// Radiance along one ray through a pixel, and what the ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Radiance, linear RGB.
    pub radiance: DVec3,
    /// 1 where the picture is covered, 0 where it is not.
    pub alpha: f64,
    /// What the camera's ray met first; none for a miss.
    pub first_hit: Option<FirstHit>,
}

/// What the layers beside the picture show of the camera ray's hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstHit {
    /// Distance from the camera, in world units.
    pub depth: f64,
    /// The point.
    pub position: DVec3,
    /// Unit shading normal.
    pub normal: DVec3,
    /// Unit geometric normal.
    pub geo_normal: DVec3,
    /// Texture coordinates; NaN where there are none.
    pub uv: DVec2,
    /// Parameters in the patch.
    pub st: DVec2,
    /// The place on the undeformed object.
    pub rest: DVec3,
    /// The surface's place in the scene; none for a light's shape.
    pub ids: Option<SurfaceIds>,
    /// Reflectance, linear RGB.
    pub albedo: DVec3,
}

/// Which surface a ray met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfaceIds {
    /// Index of the object in the scene.
    pub object: u32,
    /// Index of the input face.
    pub face: u32,
    /// Index of the patch within the object.
    pub patch: u32,
}
