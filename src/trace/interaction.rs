//! What a ray learns of the surface it hits.

use glam::{DVec2, DVec3};

use crate::patch::{Face, PatchPoint};

use super::object::{PatchHit, TracedObject};
use super::target::position_error;

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

/// Everything shading needs of a hit.
pub(super) fn interaction(objects: &[TracedObject], hit: &PatchHit) -> SurfaceInteraction {
    let object = &objects[hit.object as usize];
    let trimmed = &object.faces()[hit.patch as usize];
    let point = trimmed.eval(hit.st);
    let place = trimmed.chart.place(hit.st);
    let normal = normal(trimmed, hit.st, &point);
    SurfaceInteraction {
        t: hit.t,
        object: hit.object,
        face: hit.face,
        patch: hit.patch,
        st: hit.st,
        uv: object.attributes.uv(hit.polygon, place),
        rest: object.attributes.rest(hit.polygon, place),
        position: point.position,
        position_error: position_error(&trimmed.patch)
            + trimmed.exact.as_ref().map_or(0.0, |exact| exact.error()),
        normal,
        shading_normal: object.attributes.normal(hit.polygon, place, trimmed.knot_box()).unwrap_or(normal),
        dp_du: object
            .attributes
            .uv_gradients(hit.polygon, place)
            .map_or(DVec3::NAN, |gradients| along_u(gradients, trimmed, &point)),
        dp_ds: point.dp_ds,
        dp_dt: point.dp_dt,
    }
}

/// Partial derivative of the position by the texture coordinate u, v fixed.
fn along_u(gradients: [DVec3; 2], trimmed: &Face, point: &PatchPoint) -> DVec3 {
    let [_, s, t] = trimmed.chart.coordinates();
    let [u, v] = gradients.map(|gradient| [gradient.dot(s), gradient.dot(t)]);
    (point.dp_ds * v[1] - point.dp_dt * v[0]) / (u[0] * v[1] - u[1] * v[0])
}

/// Unit normal on the side of the face's winding; where the partials are parallel, that of a point close by.
fn normal(trimmed: &Face, st: DVec2, point: &PatchPoint) -> DVec3 {
    let cross = |point: &PatchPoint| {
        let normal = point.dp_ds.cross(point.dp_dt);
        let scale = point.dp_ds.length() * point.dp_dt.length();
        (normal.length() > 16.0 * f64::EPSILON * scale).then(|| normal.normalize())
    };
    // towards the middle of the patch, where a collapsed edge or a cusp has its one-sided limit
    let toward = DVec2::splat(0.5) - st;
    cross(point)
        .or_else(|| [1e-9, 1e-6, 1e-3].into_iter().find_map(|step| cross(&trimmed.eval(st + step * toward))))
        .unwrap_or_else(|| {
            let [_, s, t] = trimmed.chart.coordinates();
            s.cross(t).normalize_or(DVec3::Z)
        })
}
