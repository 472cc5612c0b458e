//! Area lights: a shape that shines to the side of its normal.

use glam::{DVec2, DVec3};

use super::disk::Disk;
use super::rectangle::Rectangle;
use super::sphere::Sphere;
use super::{LightEnd, LightSample};
use crate::trace::Ray;

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

/// A shape that rays are intersected with directly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shape {
    Rectangle(Rectangle),
    Disk(Disk),
    Sphere(Sphere),
}

/// A shape and what it emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AreaLight {
    pub(super) shape: Shape,
    pub(super) radiance: DVec3,
}

impl AreaLight {
    /// A point that shines on `from`; none on the side that does not shine.
    ///
    /// `light` is this light's index.
    pub(super) fn sample(&self, from: DVec3, u: DVec2, light: usize) -> Option<LightSample> {
        let point = match &self.shape {
            Shape::Rectangle(rectangle) => rectangle.sample(u),
            Shape::Disk(disk) => disk.sample(u),
            Shape::Sphere(sphere) => sphere.sample(from, u)?,
        };
        let way = point.position - from;
        let distance = way.length();
        let direction = way / distance;
        let cos_light = -direction.dot(point.normal);
        if cos_light.is_nan() || cos_light <= 0.0 {
            return None;
        }
        let pdf = self.pdf(from, distance, cos_light);
        (pdf > 0.0).then(|| LightSample {
            direction,
            end: Some(LightEnd {
                position: point.position,
                position_error: point.position_error,
                cos_light,
                light: Some(light),
            }),
            weight: self.radiance / pdf,
            pdf,
            is_delta: false,
        })
    }

    /// Density by solid angle of [`Self::sample`] for a point seen under `cos_light` to the normal;
    /// 0 on the side that does not shine.
    pub(super) fn pdf(&self, from: DVec3, distance: f64, cos_light: f64) -> f64 {
        if cos_light.is_nan() || cos_light <= 0.0 {
            return 0.0;
        }
        match &self.shape {
            Shape::Rectangle(rectangle) => area_pdf(rectangle.area(), distance, cos_light),
            Shape::Disk(disk) => area_pdf(disk.area(), distance, cos_light),
            Shape::Sphere(sphere) => sphere.pdf(from, distance, cos_light),
        }
    }

    /// Where the ray meets the shape first, from either side.
    pub(super) fn intersect(&self, ray: &Ray) -> Option<ShapeHit> {
        match &self.shape {
            Shape::Rectangle(rectangle) => rectangle.intersect(ray),
            Shape::Disk(disk) => disk.intersect(ray),
            Shape::Sphere(sphere) => sphere.intersect(ray),
        }
    }
}

/// Density by solid angle of a point drawn uniformly from `area`: distance² / (cos · area).
pub(super) fn area_pdf(area: f64, distance: f64, cos_light: f64) -> f64 {
    distance * distance / (cos_light * area)
}
