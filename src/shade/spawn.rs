//! Rays that leave a surface, free of hits with the surface they leave.

use glam::DVec3;

use super::light::LightSample;
use crate::trace::{Ray, SurfaceInteraction};

/// How many error bounds a ray starts away from its surface: one for the error of the point
/// itself, one for the error with which the same surface would be found again.
pub(super) const BOUNDS_AWAY: f64 = 2.0;

/// A ray from the surface in a direction of any length but 0.
#[must_use]
pub fn spawn_ray(from: &SurfaceInteraction, direction: DVec3) -> Ray {
    Ray::new(offset_origin(from, direction), direction)
}

/// The ray from the surface to a light's sample; ends just before the light.
///
/// A surface that lies in the light's own plane must not hide it. Both are known up to their
/// error bounds (the unknown surface's is taken to be the shaded one's), and a shift along the
/// light's normal moves the crossing by the shift over the cosine. So the ray ends
/// 2 · (sum of the bounds) / cos before the light: relative to the distance, a few ulps.
#[must_use]
pub fn spawn_shadow_ray(from: &SurfaceInteraction, light: &LightSample) -> Ray {
    let origin = offset_origin(from, light.direction);
    let Some(end) = light.end else {
        return Ray::new(origin, light.direction);
    };
    let direction = end.position - origin;
    let bounds = end.position_error + from.position_error;
    let margin = BOUNDS_AWAY * bounds / (end.cos_light * direction.length());
    Ray { t_max: (1.0 - margin).max(0.0), ..Ray::new(origin, direction) }
}

/// The point moved to the side of `direction`, until it is surely off the surface.
///
/// The exact surface crosses the box of half width `position_error` about the point; the box
/// reaches error · (|nx| + |ny| + |nz|) along the normal. The result is rounded away from the
/// surface (pbrt 4, `OffsetRayOrigin`).
fn offset_origin(from: &SurfaceInteraction, direction: DVec3) -> DVec3 {
    let side = if direction.dot(from.normal) < 0.0 { -from.normal } else { from.normal };
    let reach = from.position_error * side.abs().element_sum();
    let moved = from.position + BOUNDS_AWAY * reach * side;
    let away = |moved: f64, side: f64| {
        if side > 0.0 {
            moved.next_up()
        } else if side < 0.0 {
            moved.next_down()
        } else {
            moved
        }
    };
    DVec3::new(away(moved.x, side.x), away(moved.y, side.y), away(moved.z, side.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shade::testing::{Shape, Shapes, to_world};
    use crate::shade::{Sampler, warp};

    #[test]
    fn spawned_rays_leave_a_convex_shape() {
        // hits all over spheres of many sizes and places: no ray outwards meets the sphere again
        let mut hits = 0;
        for i in 0..20_000 {
            let mut sampler = Sampler::new(4, [i, 0], 0);
            let radius = 10.0_f64.powf(8.0 * sampler.next_1d() - 4.0);
            let centre = 1e3 * sampler.next_1d() * warp::uniform_sphere(sampler.next_2d());
            let sphere = Shapes(vec![Shape::Sphere { centre, radius }]);
            let start = centre + 3.0 * radius * warp::uniform_sphere(sampler.next_2d());
            let aim = centre + 0.9 * radius * warp::uniform_sphere(sampler.next_2d());
            let Some(hit) = sphere.closest_hit(&Ray::new(start, aim - start)) else {
                continue;
            };
            hits += 1;
            let local = warp::cosine_hemisphere(sampler.next_2d());
            let out = spawn_ray(&hit, to_world(hit.normal, local));
            assert!(!sphere.any_hit(&out), "sample {i}: hit itself from {}", hit.position);
            let inwards = spawn_ray(&hit, -out.direction);
            let through = sphere.closest_hit(&inwards);
            assert!(through.is_some_and(|h| h.position.distance(hit.position) > 0.0));
        }
        assert!(hits > 15_000, "only {hits} rays met their sphere");
    }

    #[test]
    fn offset_is_a_few_bounds() {
        let floor = Shapes(vec![Shape::floor(0.0)]);
        let start = DVec3::new(0.3, 0.4, 2.0);
        let hit = floor.closest_hit(&Ray::new(start, DVec3::NEG_Z)).unwrap();
        let up = spawn_ray(&hit, DVec3::Z).origin.z;
        assert!(up > 0.0 && up < 10.0 * hit.position_error.max(1e-300), "moved by {up:e}");
        assert_eq!(spawn_ray(&hit, DVec3::NEG_Z).origin.z, -up);
    }
}
