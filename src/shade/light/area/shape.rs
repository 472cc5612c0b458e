//! What the shapes of area lights have in common.

use glam::{DVec2, DVec3};

/// Where a ray meets the shape of an area light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeHit {
    /// Ray parameter, in units of the ray's direction.
    pub t: f64,
    /// The point.
    pub position: DVec3,
    /// Bound on the error of each coordinate of the shape's points.
    pub position_error: f64,
    /// Unit normal, on the side that shines.
    pub normal: DVec3,
    /// Place on the shape, as Mitsuba gives it.
    pub uv: DVec2,
}

/// A point of a shape, drawn at random.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ShapePoint {
    pub(super) position: DVec3,
    /// Bound on the error of each coordinate.
    pub(super) position_error: f64,
    /// Unit normal, on the side that shines.
    pub(super) normal: DVec3,
}

/// Density by solid angle of a point drawn uniformly from `area`: distance² / (cos · area).
pub(super) fn area_pdf(area: f64, distance: f64, cos_light: f64) -> f64 {
    distance * distance / (cos_light * area)
}
