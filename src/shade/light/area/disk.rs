//! The disk that an area light has for its shape.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_4};

use glam::{DAffine3, DVec2};

use super::rectangle::Rectangle;
use super::shape::{ShapeHit, ShapePoint};
use crate::shade::warp;
use crate::trace::Ray;

/// The unit disk of z = 0 placed in the world, as Mitsuba's `disk`; an ellipse if `to_world` makes it one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Disk {
    /// The rectangle that it touches from within.
    around: Rectangle,
}

impl Disk {
    /// The disk that `to_world` makes; none if it has no area or is not finite.
    pub(super) fn try_new(to_world: &DAffine3) -> Option<Self> {
        Rectangle::try_new(to_world).map(|around| Self { around })
    }

    /// In square world units.
    pub(super) fn area(&self) -> f64 {
        FRAC_PI_4 * self.around.area()
    }

    /// The point of uniform `u` in `[0, 1)²`; uniform by area.
    pub(super) fn sample(&self, u: DVec2) -> ShapePoint {
        self.around.sample(0.5 * warp::concentric_disk(u) + 0.5)
    }

    /// Where the ray meets the disk, from either side. Its texture coordinates are the distance from
    /// the centre and the angle over 2π.
    pub(super) fn intersect(&self, ray: &Ray) -> Option<ShapeHit> {
        let hit = self.around.intersect(ray)?;
        let place = 2.0 * hit.uv - 1.0;
        let radius = place.length();
        let turn = 0.5 * FRAC_1_PI * libm::atan2(place.y, place.x);
        let uv = DVec2::new(radius, if turn < 0.0 { turn + 1.0 } else { turn });
        (radius <= 1.0).then_some(ShapeHit { uv, ..hit })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::shade::Sampler;

    #[test]
    fn samples_are_hit_and_lie_within() {
        let place = DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0))
            * DAffine3::from_rotation_y(0.7)
            * DAffine3::from_scale(DVec3::new(2.0, 0.5, 1.0));
        let disk = Disk::try_new(&place).unwrap();
        assert!((disk.area() - std::f64::consts::PI).abs() < 1e-14, "π · 2 · 0.5");
        let from = DVec3::new(3.0, 1.0, 7.0);
        let mut inner = 0;
        for i in 0..4000 {
            let point = disk.sample(Sampler::new(2, [i, 0], 0).next_2d()).position;
            let local = place.inverse().transform_point3(point);
            assert!(local.z.abs() < 1e-14 && local.length() < 1.0 + 1e-14);
            inner += usize::from(local.length() < 0.5);
            let inwards = DVec3::new(1.0, 2.0, 3.0).lerp(point, 0.999_999);
            let hit = disk.intersect(&Ray::new(from, 2.0 * (inwards - from))).unwrap();
            assert!((hit.t - 0.5).abs() < 1e-12);
            assert!((hit.uv.x - 0.999_999 * local.length()).abs() < 1e-12);
            let angle = std::f64::consts::TAU * hit.uv.y;
            assert!((hit.uv.x * angle.cos() - 0.999_999 * local.x).abs() < 1e-12 && hit.uv.y >= 0.0);
            let outwards =
                DVec3::new(1.0, 2.0, 3.0) + (point - DVec3::new(1.0, 2.0, 3.0)) / local.length() * 1.001;
            assert_eq!(disk.intersect(&Ray::new(from, outwards - from)), None);
        }
        assert!((900..1100).contains(&inner), "a quarter is within half the radius: {inner}");
    }
}
