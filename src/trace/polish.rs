//! The last steps of Newton's method.

use fearless_simd::{Level, Simd};

use crate::math::lanes::with_vectors;
use glam::{DVec2, DVec3};

use crate::patch::{BezierPatch, ExactSurface, OrderWork, PatchPoint};

use super::Ray;
use super::object::PatchHit;
use super::statistics::TraceStatistics;

/// Most steps from a patch's root to that of the surface it stands for.
const MAX_POLISHING_STEPS: usize = 4;

/// What the next step would move, in parts of the patch, below which it is not taken: about the last one times the whole way so
/// far, over the sine of the angle between ray and surface.
const LAST_POLISHED: f64 = 1e-13;

/// A root farther than this from the patch's, in parts of the patch, is not the same one.
const MOST_POLISHED: f64 = 1e-2;

/// The step of the parameters from a point that is off the ray, by the cross product of the ray's direction with the way to
/// the point; Cramer's rule.
fn newton_step(point: &PatchPoint, ray: &Ray, across: DVec3) -> DVec2 {
    let inverse = 1.0 / point.dp_ds.cross(point.dp_dt).dot(ray.direction);
    DVec2::new(-point.dp_dt.dot(across), point.dp_ds.dot(across)) * inverse
}

/// A root after one Newton step on the exact patch, if that brings it nearer to the ray.
pub(super) fn on_patch(patch: &BezierPatch, ray: &Ray, st: DVec2) -> DVec2 {
    let across = |st: DVec2| {
        let point = patch.eval(st);
        (point, ray.direction.cross(point.position - ray.origin))
    };
    let (point, off) = across(st);
    let next = st + newton_step(&point, ray, off);
    if across(next).1.length_squared() < off.length_squared() { next } else { st }
}

/// A patch's point, by the processor's vectors.
pub(super) fn point(level: Level, patch: &BezierPatch, st: DVec2) -> PatchPoint {
    with_vectors!(level, simd => patch.with_orders(PointAt { simd, patch, st }))
}

/// What [`point`] does.
struct PointAt<'a, S> {
    simd: S,
    patch: &'a BezierPatch,
    st: DVec2,
}

impl<S: Simd> OrderWork for PointAt<'_, S> {
    type Output = PatchPoint;

    #[inline(always)]
    fn run<const M: usize, const N: usize, const STRIDE: usize>(self) -> PatchPoint {
        let Self { simd, patch, st } = self;
        simd.vectorize(
            #[inline(always)]
            || patch.eval_one::<M, N, STRIDE, S>(simd, st),
        )
    }
}

/// A hit moved to the exact surface by Newton's method, with the patch's derivatives, which are as near to its own as the
/// patch is: one step does, but for places where the ray is all but tangent. Where the patch's root has none on the surface
/// the hit stays, as a tangent one.
pub(super) fn on_surface(
    point: &PatchPoint,
    exact: &dyn ExactSurface,
    hit: PatchHit,
    ray: &Ray,
    statistics: &mut TraceStatistics,
) -> PatchHit {
    let normal = point.dp_ds.cross(point.dp_dt);
    let steep = normal.dot(ray.direction).abs() / (normal.length() * ray.direction.length());
    let mut st = hit.st;
    for _ in 0..MAX_POLISHING_STEPS {
        statistics.newton_steps += 1;
        let offset = exact.position(st) - ray.origin;
        // what of it is along the ray is rounding, which a grazing angle would turn into a step across the ray
        let across = ray.direction.cross(offset).reject_from(ray.direction);
        let step = newton_step(point, ray, across);
        let length = step.abs().max_element();
        if length.is_nan() || length > MOST_POLISHED {
            break;
        }
        st += step;
        if step.length() * (st - hit.st).length() <= LAST_POLISHED * steep {
            let t = normal.dot(offset) / normal.dot(ray.direction);
            // the ray's ends are no sharper than the patch
            let t = if t > ray.t_min && t < ray.t_max { t } else { hit.t };
            return PatchHit { st, t, ..hit };
        }
    }
    statistics.not_converged += 1;
    PatchHit { tangent: true, ..hit }
}
