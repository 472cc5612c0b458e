//! Shapes with closed forms, for tests of light.

use glam::{DVec2, DVec3};

use crate::math::rounding::gamma;
use crate::trace::{Geometry, Ray, RayTracer, SurfaceInteraction};

/// Turns `local`, whose +z is the normal, to the world.
///
/// # Panics
/// In debug builds, if `normal` has not length 1.
pub(crate) fn to_world(normal: DVec3, local: DVec3) -> DVec3 {
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    local.x * tangent + local.y * bitangent + local.z * normal
}

/// A shape whose hits are computed directly.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    /// Normal outwards.
    Sphere { centre: DVec3, radius: f64 },
    /// The points corner + s·u + t·v with s, t in `[0, 1]`; normal u × v.
    Quad { corner: DVec3, u: DVec3, v: DVec3 },
}

/// Shapes, each an object of its own.
#[derive(Clone, Debug)]
pub(crate) struct Shapes(pub(crate) Vec<Shape>);

impl Shape {
    /// The square `[-4, 4]²` at height z, normal upwards.
    pub(crate) fn floor(z: f64) -> Self {
        Self::Quad { corner: DVec3::new(-4.0, -4.0, z), u: 8.0 * DVec3::X, v: 8.0 * DVec3::Y }
    }

    fn hit(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        match self {
            Self::Sphere { centre, radius } => hit_sphere(*centre, *radius, ray),
            Self::Quad { corner, u, v } => hit_quad(*corner, *u, *v, ray),
        }
    }
}

fn hit_sphere(centre: DVec3, radius: f64, ray: &Ray) -> Option<SurfaceInteraction> {
    let a = ray.direction.length_squared();
    let to_centre = centre - ray.origin;
    let middle = to_centre.dot(ray.direction) / a;
    // the discriminant from the point nearest to the centre keeps its digits
    let off_axis = to_centre - middle * ray.direction;
    let half_sq = (radius * radius - off_axis.length_squared()) / a;
    if half_sq.is_nan() || half_sq < 0.0 {
        return None;
    }
    let c = (to_centre.length() - radius) * (to_centre.length() + radius);
    let far = middle + half_sq.sqrt().copysign(middle);
    let mut roots = [far, c / a / far];
    roots.sort_by(f64::total_cmp);
    let t = roots.into_iter().find(|&t| t > ray.t_min && t < ray.t_max)?;
    let normal = (ray.at(t) - centre).normalize();
    let position = centre + radius * normal;
    let reach = centre.abs().max_element() + radius;
    Some(interaction(t, position, normal, gamma(12) * reach))
}

fn hit_quad(corner: DVec3, u: DVec3, v: DVec3, ray: &Ray) -> Option<SurfaceInteraction> {
    let cross = u.cross(v);
    let t = (corner - ray.origin).dot(cross) / ray.direction.dot(cross);
    if !(t > ray.t_min && t < ray.t_max) {
        return None;
    }
    let local = ray.at(t) - corner;
    let scale = 1.0 / cross.length_squared();
    let st = scale * DVec2::new(local.cross(v).dot(cross), u.cross(local).dot(cross));
    if !(st.min_element() >= 0.0 && st.max_element() <= 1.0) {
        return None;
    }
    let reach = (corner.abs() + u.abs() + v.abs()).max_element();
    let position = corner + st.x * u + st.y * v;
    Some(SurfaceInteraction { st, uv: st, ..interaction(t, position, cross.normalize(), gamma(20) * reach) })
}

/// A point of a surface with that normal.
pub(crate) fn surface(normal: DVec3) -> SurfaceInteraction {
    interaction(1.0, DVec3::ZERO, normal, 0.0)
}

fn interaction(t: f64, position: DVec3, normal: DVec3, position_error: f64) -> SurfaceInteraction {
    let (dp_ds, dp_dt) = normal.any_orthonormal_pair();
    SurfaceInteraction {
        t,
        object: 0,
        face: 7,
        patch: 9,
        st: DVec2::ZERO,
        uv: DVec2::NAN,
        rest: position,
        position,
        position_error,
        normal,
        shading_normal: normal,
        dp_du: DVec3::NAN,
        dp_ds,
        dp_dt,
    }
}

impl Shapes {
    pub(crate) fn closest_hit(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        let mut ray = *ray;
        let mut closest = None;
        for (object, shape) in (0..).zip(&self.0) {
            if let Some(hit) = shape.hit(&ray) {
                ray.t_max = hit.t;
                closest = Some(SurfaceInteraction { object, ..hit });
            }
        }
        closest
    }

    pub(crate) fn any_hit(&self, ray: &Ray) -> bool {
        self.0.iter().any(|shape| shape.hit(ray).is_some())
    }
}

impl Geometry for Shapes {
    type Tracer<'a> = &'a Self;

    fn tracer(&self) -> &Self {
        self
    }
}

impl RayTracer for &Shapes {
    fn closest_hit(&mut self, ray: &Ray) -> Option<SurfaceInteraction> {
        Shapes::closest_hit(self, ray)
    }

    fn any_hit(&mut self, ray: &Ray) -> bool {
        Shapes::any_hit(self, ray)
    }
}
