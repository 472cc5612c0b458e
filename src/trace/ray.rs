//! Rays.

use glam::DVec3;

/// A ray: the points `origin + t · direction` with `t` in the open interval `(t_min, t_max)`.
///
/// The direction has any non-zero length; `t` counts in its units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start of the ray, where `t` is 0.
    pub origin: DVec3,
    /// Direction, of any length but 0.
    pub direction: DVec3,
    /// Hits have `t` greater than this.
    pub t_min: f64,
    /// Hits have `t` less than this.
    pub t_max: f64,
}

impl Ray {
    /// The ray with `t` in `(0, ∞)`.
    pub const fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
    }

    /// Whether the ray has a direction that double precision can normalise, and finite numbers.
    pub fn is_traceable(&self) -> bool {
        self.origin.is_finite() && self.direction.is_finite() && self.direction.try_normalize().is_some()
    }

    /// The point at parameter `t`.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.direction
    }
}
