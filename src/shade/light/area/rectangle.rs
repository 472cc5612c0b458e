//! The rectangle that an area light has for its shape.

use glam::{DAffine3, DVec2, DVec3};

use super::shape::{ShapeHit, ShapePoint};
use crate::math::rounding::gamma;
use crate::trace::Ray;

/// The square `[-1, 1]²` of z = 0 placed in the world, as Mitsuba's `rectangle`.
///
/// Shear is allowed: a parallelogram then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rectangle {
    centre: DVec3,
    /// From the centre to the middle of the side x = 1.
    half_u: DVec3,
    /// From the centre to the middle of the side y = 1.
    half_v: DVec3,
    normal: DVec3,
    /// Area of the whole rectangle, in square world units.
    area: f64,
}

impl Rectangle {
    /// The rectangle that `to_world` makes; none if it has no area or is not finite.
    ///
    /// The normal is transformed as normals are (by the inverse transpose), so that a mirrored
    /// rectangle still shines to its own +z.
    pub(super) fn try_new(to_world: &DAffine3) -> Option<Self> {
        let (half_u, half_v) = (to_world.matrix3.x_axis, to_world.matrix3.y_axis);
        let cross = half_u.cross(half_v);
        let side = if cross.dot(to_world.matrix3.z_axis) < 0.0 { -1.0 } else { 1.0 };
        let rectangle = Self {
            centre: to_world.translation,
            half_u,
            half_v,
            normal: side * cross.try_normalize()?,
            area: 4.0 * cross.length(),
        };
        let finite = rectangle.centre.is_finite() && rectangle.area.is_finite();
        (finite && rectangle.area > 0.0).then_some(rectangle)
    }

    /// In square world units.
    pub(super) const fn area(&self) -> f64 {
        self.area
    }

    /// The point of uniform `u` in `[0, 1)²`; uniform by area.
    pub(super) fn sample(&self, u: DVec2) -> ShapePoint {
        let local = 2.0 * u - 1.0;
        ShapePoint {
            position: self.centre + local.x * self.half_u + local.y * self.half_v,
            position_error: self.point_error(),
            normal: self.normal,
        }
    }

    /// Bound on the error of each coordinate of points: five roundings, `local`'s two among them, of
    /// sums that no coordinate exceeds.
    fn point_error(&self) -> f64 {
        let reach = self.centre.abs() + self.half_u.abs() + self.half_v.abs();
        gamma(5) * reach.max_element()
    }

    /// Where the ray meets the rectangle, from either side; its edges belong to it.
    pub(super) fn intersect(&self, ray: &Ray) -> Option<ShapeHit> {
        let to_centre = self.centre - ray.origin;
        let t = self.normal.dot(to_centre) / self.normal.dot(ray.direction);
        // false for the NaN of a ray within the plane
        if !(t > ray.t_min && t < ray.t_max) {
            return None;
        }
        let position = ray.at(t);
        let from_centre = position - self.centre;
        let cross = self.half_u.cross(self.half_v);
        let local =
            DVec2::new(from_centre.cross(self.half_v).dot(cross), self.half_u.cross(from_centre).dot(cross))
                / cross.length_squared();
        (local.x.abs() <= 1.0 && local.y.abs() <= 1.0).then_some(ShapeHit {
            t,
            position,
            position_error: self.point_error(),
            normal: self.normal,
            uv: 0.5 * local + 0.5,
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DQuat};

    use super::*;
    use crate::shade::Sampler;

    fn scaled(x: f64, y: f64, z: f64) -> Rectangle {
        Rectangle::try_new(&DAffine3::from_scale(DVec3::new(x, y, z))).unwrap()
    }

    #[test]
    fn mirrored_rectangles_keep_their_own_side() {
        // as Mitsuba 3.9.1 shows: only a mirrored z turns the side
        assert_eq!(scaled(1.0, 1.0, 1.0).normal, DVec3::Z);
        assert_eq!(scaled(-1.0, 1.0, 1.0).normal, DVec3::Z);
        assert_eq!(scaled(1.0, 1.0, -1.0).normal, DVec3::NEG_Z);
        assert_eq!(scaled(2.0, 3.0, 1.0).area, 24.0);
        let flat = DAffine3::from_scale(DVec3::new(0.0, 1.0, 1.0));
        assert_eq!(Rectangle::try_new(&flat), None);
    }

    #[test]
    fn planted_points_are_hit() {
        let shear = DMat3::from_cols(DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.5, 1.0, 0.0), DVec3::Z);
        let turn = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 1.1, -0.7));
        let place = DAffine3::from_mat3_translation(turn * shear, DVec3::new(1.0, -2.0, 3.0));
        let rectangle = Rectangle::try_new(&place).unwrap();
        for i in 0..1000 {
            let mut sampler = Sampler::new(5, [i, 0], 0);
            let u = sampler.next_2d();
            let offset = sampler.next_2d().extend(sampler.next_1d()) - 0.5;
            let (from, to) = (DVec3::splat(4.0) + offset, rectangle.sample(u).position);
            let hit = rectangle.intersect(&Ray::new(from, 2.0 * (to - from))).unwrap();
            assert!((hit.t - 0.5).abs() < 1e-14, "sample {i}: t {}", hit.t);
            assert!(hit.uv.distance(u) < 1e-13, "sample {i}: uv {}, want {u}", hit.uv);
            let short = Ray { t_max: 0.999, ..Ray::new(from, to - from) };
            assert_eq!(rectangle.intersect(&short), None);
            let outside = rectangle.sample(u + DVec2::X).position;
            assert_eq!(rectangle.intersect(&Ray::new(from, outside - from)), None);
        }
        let within = Ray::new(rectangle.sample(DVec2::ZERO).position, rectangle.half_u);
        let along = rectangle.intersect(&within);
        assert!(along.is_none_or(|hit| hit.position.is_finite()));
    }
}
