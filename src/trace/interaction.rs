//! What a ray learns of the surface it hits.

use glam::{DVec2, DVec3};

use super::Ray;

/// Everything that shading needs of a hit, computed once for the hit that won.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceInteraction {
    /// Ray parameter, in units of the ray's direction.
    pub t: f64,
    /// Index of the object in the scene.
    pub object: u32,
    /// Index of the input face the point belongs to.
    pub face: u32,
    /// Index of the patch within the object.
    pub patch: u32,
    /// Parameters in the patch's own unit square.
    pub st: DVec2,
    /// Texture coordinates; NaN where the mesh has none.
    pub uv: DVec2,
    /// The point's place on the undeformed object.
    pub rest: DVec3,
    /// The point on the exact surface.
    pub position: DVec3,
    /// Bound on each coordinate's distance between `position` and the exact surface (rounding).
    pub position_error: f64,
    /// Unit geometric normal, on the side from which the input face winds counter-clockwise.
    pub normal: DVec3,
    /// Unit normal for shading: the geometric one, or one carried from the mesh's vertices.
    pub shading_normal: DVec3,
    /// Partial derivative of the position by the texture coordinate u; NaN where there is none.
    pub dp_du: DVec3,
    /// Partial derivative of the position by `s`.
    pub dp_ds: DVec3,
    /// Partial derivative of the position by `t`.
    pub dp_dt: DVec3,
}

/// Anything rays can be traced against.
pub trait Geometry: Sync {
    /// The hit nearest to the ray's origin, if any.
    fn closest_hit(&self, ray: &Ray) -> Option<SurfaceInteraction>;

    /// Whether anything is hit at all; stops at the first proof.
    fn any_hit(&self, ray: &Ray) -> bool;

    /// As [`Self::closest_hit`] for each ray, in place of what `hits` held; rays that are alike are faster side by side.
    fn closest_hits(&self, rays: &[Ray], hits: &mut Vec<Option<SurfaceInteraction>>) {
        hits.clear();
        hits.extend(rays.iter().map(|ray| self.closest_hit(ray)));
    }

    /// As [`Self::any_hit`] for each ray, in place of what `hit` held.
    fn any_hits(&self, rays: &[Ray], hit: &mut Vec<bool>) {
        hit.clear();
        hit.extend(rays.iter().map(|ray| self.any_hit(ray)));
    }
}
