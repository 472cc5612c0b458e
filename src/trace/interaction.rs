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

/// A normal is taken as it is if rounding turns it by no more than this: far below what a picture shows.
const NORMAL_ERROR: f64 = 1e-7;

/// How far from a place without a normal others are looked at, in parts of the way to the middle of the patch: near enough for
/// two of them to tell the limit to the square of that, far enough for rounding not to matter.
const LIMIT_STEPS: [f64; 3] = [1e-4, 1e-3, 1e-2];

/// Unit normal on the side of the face's winding; where the partials are parallel or one is 0, but for rounding, the limit of
/// those on the way from the middle of the patch, as of a collapsed edge or a cusp.
fn normal(trimmed: &Face, st: DVec2, point: &PatchPoint) -> DVec3 {
    // partials are sums of as many products as points are, times the degree
    let [m, n] = trimmed.patch.degree();
    let error = position_error(&trimmed.patch) * m.max(n) as f64;
    let cross = |point: &PatchPoint| {
        let normal = point.dp_ds.cross(point.dp_dt);
        let scale = error * (point.dp_ds.length() + point.dp_dt.length());
        (NORMAL_ERROR * normal.length() > scale).then(|| normal.normalize())
    };
    let toward = DVec2::splat(0.5) - st;
    let limit = |step: f64| {
        let [near, far] = [step, 2.0 * step].map(|step| cross(&trimmed.eval(st + step * toward)));
        (2.0 * near? - far?).try_normalize()
    };
    let uncertain = || point.dp_ds.cross(point.dp_dt).try_normalize();
    cross(point).or_else(|| LIMIT_STEPS.into_iter().find_map(limit)).or_else(uncertain).unwrap_or_else(|| {
        let [_, s, t] = trimmed.chart.coordinates();
        s.cross(t).normalize_or(DVec3::Z)
    })
}
