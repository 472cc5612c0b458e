//! Coordinates about the scene's centre, in which single precision serves scenes of every size and place.

use glam::DVec3;

use crate::math::lanes::{Real, Vector};

use super::Ray;

/// From the world to coordinates about the scene's centre, in units of a power of two near its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LocalSpace {
    centre: DVec3,
    scale: f64,
}

impl LocalSpace {
    /// The space of all that is in a box; of the unit box if that is empty.
    pub(crate) fn around([low, high]: [DVec3; 2]) -> Self {
        if low.cmpgt(high).any() {
            return Self { centre: DVec3::ZERO, scale: 1.0 };
        }
        let (centre, extent) = (0.5 * low + 0.5 * high, (high - low).max_element());
        let scale = if extent > 0.0 { libm::exp2(-libm::ceil(libm::log2(extent))) } else { 1.0 };
        Self { centre, scale }
    }

    /// A point of the world.
    pub(crate) fn point(&self, world: DVec3) -> DVec3 {
        (world - self.centre) * self.scale
    }

    /// A vector of the world.
    pub(crate) fn vector(&self, world: DVec3) -> DVec3 {
        world * self.scale
    }

    /// A length of the world.
    pub(crate) fn length(&self, world: f64) -> f64 {
        world * self.scale
    }

    /// Points of the world, side by side, and bounds on their rounding.
    #[inline(always)]
    pub(crate) fn points<R: Real>(&self, world: Vector<R>) -> (Vector<R>, R) {
        let [x, y, z] = self.centre.to_array();
        let local =
            Vector::new((world.x - x) * self.scale, (world.y - y) * self.scale, (world.z - z) * self.scale);
        let size =
            (world.x.abs() + x.abs()).greater(world.y.abs() + y.abs()).greater(world.z.abs() + z.abs());
        (local, size * (f64::EPSILON * self.scale))
    }

    /// Vectors of the world, side by side.
    #[inline(always)]
    pub(crate) fn vectors<R: Real>(&self, world: Vector<R>) -> Vector<R> {
        Vector::new(world.x * self.scale, world.y * self.scale, world.z * self.scale)
    }

    /// A ray of the world.
    #[inline(always)]
    pub(crate) fn ray(&self, world: &Ray) -> LocalRay {
        let rounding = (world.origin.abs() + self.centre.abs()).max_element() * (f64::EPSILON * self.scale);
        LocalRay { origin: self.point(world.origin), direction: self.vector(world.direction), rounding }
    }
}

/// A ray in a [`LocalSpace`]; its parameter t is the same as in the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalRay {
    pub(crate) origin: DVec3,
    pub(crate) direction: DVec3,
    /// Bound on the rounding of the origin's coordinates.
    pub(crate) rounding: f64,
}
