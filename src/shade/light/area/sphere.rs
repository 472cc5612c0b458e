//! The sphere that an area light has for its shape.

use std::f64::consts::{FRAC_1_PI, PI, TAU};

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::shape::{ShapeHit, ShapePoint, area_pdf};
use crate::math::linear::similarity_scale;
use crate::math::rounding::gamma;
use crate::shade::parameters::ParameterSource;
use crate::shade::warp;
use crate::trace::Ray;

/// The unit sphere placed in the world, as Mitsuba's `sphere`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sphere {
    centre: DVec3,
    radius: f64,
    /// Whether it shines inwards.
    inwards: bool,
    /// From the world's directions to those of the unit sphere.
    to_local: DMat3,
}

impl Sphere {
    /// The sphere that `to_world` makes; none if it is an ellipsoid, a point, or not finite.
    ///
    /// It shines outwards; a mirrored one inwards.
    pub(super) fn try_new(to_world: &DAffine3) -> Option<Self> {
        let matrix = to_world.matrix3;
        let radius = similarity_scale(&matrix)?;
        let usable = to_world.is_finite() && (4.0 * PI * radius * radius).is_finite();
        usable.then(|| Self {
            centre: to_world.translation,
            radius,
            inwards: matrix.determinant() < 0.0,
            to_local: matrix.inverse(),
        })
    }

    /// A point that is seen from `from`, uniform by solid angle; from inside, any point, uniform by area.
    ///
    /// None on the side that does not shine. As Mitsuba's `sample_direction`, which follows Akalin
    /// (Sampling the visible sphere), but by the law of sines, and by cosines' differences from 1 so
    /// that small angles keep their digits.
    pub(super) fn sample(&self, from: DVec3, u: DVec2) -> Option<ShapePoint> {
        let outside = self.is_outside(from);
        if outside == self.inwards {
            return None;
        }
        let outward = if outside { self.visible_point(from, u) } else { warp::uniform_sphere(u) };
        Some(ShapePoint {
            position: self.centre + self.radius * outward,
            position_error: self.point_error(),
            normal: self.side() * outward,
        })
    }

    /// Density by solid angle of [`Self::sample`], for a point on the side that shines.
    pub(super) fn pdf(&self, from: DVec3, distance: f64, cos_light: f64) -> f64 {
        let outside = self.is_outside(from);
        if outside == self.inwards {
            0.0
        } else if outside {
            1.0 / (TAU * self.cap(from))
        } else {
            area_pdf(4.0 * PI * self.radius * self.radius, distance, cos_light)
        }
    }

    fn is_outside(&self, from: DVec3) -> bool {
        from.distance_squared(self.centre) > self.radius * self.radius
    }

    /// 1 - cos of half the angle under which the sphere is seen.
    fn cap(&self, from: DVec3) -> f64 {
        let distance = from.distance(self.centre);
        let sin = self.radius / distance;
        let cos_squared = (distance - self.radius) * (distance + self.radius) / (distance * distance);
        sin * sin / (1.0 + cos_squared.max(0.0).sqrt())
    }

    /// From the centre to a point that is seen from outside, at unit length.
    fn visible_point(&self, from: DVec3, u: DVec2) -> DVec3 {
        let away = from - self.centre;
        let distance = away.length();
        let from_one = u.x * self.cap(from);
        let cos = 1.0 - from_one;
        let sin = (from_one * (1.0 + cos)).sqrt();
        // along the ray: (d² - r²) / (d cos θ + √(r² - d² sin² θ))
        let half = (self.radius - distance * sin) * (self.radius + distance * sin);
        let way =
            (distance - self.radius) * (distance + self.radius) / (distance * cos + half.max(0.0).sqrt());
        let (sin_turn, cos_turn) = libm::sincos(TAU * u.y);
        let axis = away / distance;
        let (tangent, bitangent) = axis.any_orthonormal_pair();
        let across = way * sin * (cos_turn * tangent + sin_turn * bitangent);
        (across + (distance - way * cos) * axis).normalize()
    }

    /// Sign of the shining side's normal relative to the outward one.
    const fn side(&self) -> f64 {
        if self.inwards { -1.0 } else { 1.0 }
    }

    /// Bound on the error of each coordinate of points: of the unit vector (length and quotient, six
    /// roundings), the product and the sum.
    fn point_error(&self) -> f64 {
        gamma(8) * (self.centre.abs().max_element() + self.radius)
    }

    /// Where the ray meets the sphere first, from either side.
    pub(super) fn intersect(&self, ray: &Ray) -> Option<ShapeHit> {
        let a = ray.direction.length_squared();
        let to_centre = self.centre - ray.origin;
        let middle = to_centre.dot(ray.direction) / a;
        // the discriminant from the point nearest to the centre keeps its digits
        let off_axis = to_centre - middle * ray.direction;
        let half_squared = (self.radius * self.radius - off_axis.length_squared()) / a;
        if half_squared.is_nan() || half_squared < 0.0 {
            return None;
        }
        let distance = to_centre.length();
        let product = (distance - self.radius) * (distance + self.radius) / a;
        let larger = middle + half_squared.sqrt().copysign(middle);
        let other = product / larger;
        let (near, far) = if larger < other { (larger, other) } else { (other, larger) };
        let t = [near, far].into_iter().find(|&t| t > ray.t_min && t < ray.t_max)?;
        let outward = (ray.at(t) - self.centre).normalize();
        Some(ShapeHit {
            t,
            position: self.centre + self.radius * outward,
            position_error: self.point_error(),
            normal: self.side() * outward,
            uv: self.uv(outward),
        })
    }

    /// Azimuth over 2π and angle with +z over π, in the unit sphere's own axes.
    fn uv(&self, outward: DVec3) -> DVec2 {
        let local = self.to_local * outward;
        let turn = 0.5 * FRAC_1_PI * libm::atan2(local.y, local.x);
        let angle = libm::atan2(local.truncate().length(), local.z);
        DVec2::new(if turn < 0.0 { turn + 1.0 } else { turn }, FRAC_1_PI * angle)
    }
}

/// The place of the unit sphere: first `radius`, then `center`, then `to_world`, as in Mitsuba.
pub(super) fn read_place(source: &dyn ParameterSource, to_world: Option<DAffine3>) -> Option<DAffine3> {
    let center = source.vector("center", "a point [x, y, z] of finite numbers").unwrap_or(DVec3::ZERO);
    let radius = source.number("radius", "a number above 0", &|radius| radius > 0.0).unwrap_or(1.0);
    let to_world = to_world?;
    if similarity_scale(&to_world.matrix3).is_none() {
        let message = "to_world of a sphere must scale all axes alike: only disks become ellipses";
        source.report_value("to_world", message.to_owned());
        return None;
    }
    Some(to_world * (DAffine3::from_translation(center) * DAffine3::from_scale(DVec3::splat(radius))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shade::Sampler;

    fn sphere(centre: DVec3, radius: f64) -> Sphere {
        let place = DAffine3::from_translation(centre) * DAffine3::from_rotation_x(0.3);
        Sphere::try_new(&(place * DAffine3::from_scale(DVec3::splat(radius)))).unwrap()
    }

    #[test]
    fn samples_are_what_is_seen() {
        for (centre, radius, from) in [
            (DVec3::new(1.0, 2.0, 3.0), 0.5, DVec3::new(3.0, -1.0, 2.0)),
            (DVec3::ZERO, 1.0, DVec3::new(0.0, 1.000_001, 0.0)),
            (DVec3::new(1e3, 0.0, 0.0), 1e-3, DVec3::ZERO),
        ] {
            let sphere = sphere(centre, radius);
            for i in 0..1000 {
                let u = Sampler::new(2, [i, 0], 0).next_2d();
                let point = sphere.sample(from, u).unwrap();
                let way = point.position - from;
                assert!(way.dot(point.normal) < 1e-9 * radius, "{u}: on the near side");
                // uniform by solid angle: 1 - cos over the cap is u.x
                let cos = way.normalize().dot((centre - from).normalize());
                let cap = 1.0 - (1.0 - radius * radius / from.distance_squared(centre)).sqrt();
                assert!(radius < 0.1 || ((1.0 - cos) / cap - u.x).abs() < 1e-7, "{cos} {cap} {u}");
                let hit = sphere.intersect(&Ray::new(from, 0.5 * way));
                // at the limb the ray may pass by
                assert!(u.x > 0.999 || hit.is_some_and(|hit| (hit.t - 2.0).abs() < 1e-6), "{u} {hit:?}");
            }
        }
    }

    #[test]
    fn seen_from_inside_and_mirrored() {
        let from = DVec3::new(0.3, 0.1, 0.2);
        let outwards = sphere(DVec3::ZERO, 1.0);
        assert_eq!(outwards.sample(from, DVec2::splat(0.3)), None);
        assert_eq!(outwards.pdf(from, 1.0, 1.0), 0.0);
        let mirrored = Sphere::try_new(&DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0))).unwrap();
        let inside = mirrored.sample(from, DVec2::splat(0.3)).unwrap();
        assert!(inside.normal.dot(inside.position - from) < 0.0);
        assert_eq!(mirrored.sample(DVec3::new(0.0, 0.0, 2.0), DVec2::splat(0.3)), None);
        let stretched = DAffine3::from_scale(DVec3::new(1.0, 1.0, 1.001));
        assert_eq!(Sphere::try_new(&stretched), None);
        let turned = DAffine3::from_rotation_y(1.0) * DAffine3::from_scale(DVec3::splat(-3.0));
        assert!(Sphere::try_new(&turned).is_some_and(|sphere| sphere.inwards));
    }

    #[test]
    fn rays_meet_the_nearer_side() {
        let sphere = sphere(DVec3::new(0.0, 0.0, 5.0), 2.0);
        let ray = Ray::new(DVec3::ZERO, DVec3::Z);
        assert!((sphere.intersect(&ray).unwrap().t - 3.0).abs() < 1e-15);
        let beyond = Ray { t_min: 4.0, ..ray };
        assert!((sphere.intersect(&beyond).unwrap().t - 7.0).abs() < 1e-15);
        assert_eq!(sphere.intersect(&Ray { t_max: 2.9, ..ray }), None);
        assert_eq!(sphere.intersect(&Ray::new(DVec3::ZERO, DVec3::NEG_Z)), None);
        let centre = Ray::new(DVec3::new(0.0, 0.0, 5.0), DVec3::X);
        assert!((sphere.intersect(&centre).unwrap().t - 2.0).abs() < 1e-15);
    }
}
