//! Area lights: a shape that shines to the side of its normal.

mod disk;
mod rectangle;
mod shape;
mod sphere;

use glam::{DAffine3, DVec2, DVec3};

use self::disk::Disk;
use self::rectangle::Rectangle;
use self::shape::area_pdf;
use self::sphere::Sphere;
use super::{Light, LightEnd, LightError, LightKind, LightSample, LightSettings};
use crate::shade::parameters::{Parameter, ParameterSource, Parameters};
use crate::trace::Ray;

pub use shape::ShapeHit;

/// Mitsuba's `area` with each of the shapes.
pub(super) const KINDS: &[LightKind] = &[
    LightKind {
        name: "area",
        shape: Some("rectangle"),
        keys: &["shape", "to_world", "radiance"],
        surrounds: false,
        read: |source| AreaLight::read(source, AreaShape::Rectangle),
    },
    LightKind {
        name: "area",
        shape: Some("disk"),
        keys: &["shape", "to_world", "radiance"],
        surrounds: false,
        read: |source| AreaLight::read(source, AreaShape::Disk),
    },
    LightKind {
        name: "area",
        shape: Some("sphere"),
        keys: &["shape", "to_world", "center", "radius", "radiance"],
        surrounds: false,
        read: |source| AreaLight::read(source, AreaShape::Sphere),
    },
];

/// The shape of an area light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AreaShape {
    /// `[-1, 1]²` of the plane z = 0, shining to the side of +z.
    Rectangle,
    /// The unit disk of the plane z = 0, shining to the side of +z.
    Disk,
    /// The unit sphere, shining outwards, or inwards if `to_world` mirrors it.
    Sphere,
}

/// A shape that shines, placed by `to_world`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaLight {
    /// The shape.
    pub shape: AreaShape,
    /// Places the shape in the world; scales all axes of a sphere alike.
    pub to_world: DAffine3,
    /// Radiance emitted.
    pub radiance: DVec3,
}

impl AreaLight {
    fn read(source: &dyn ParameterSource, shape: AreaShape) -> Option<Light> {
        let (radiance, to_world) = (source.emission("radiance"), source.placement("to_world"));
        let to_world = match shape {
            AreaShape::Rectangle | AreaShape::Disk => to_world,
            AreaShape::Sphere => sphere::read_place(source, to_world),
        };
        Some(Light::Area(Self { shape, to_world: to_world?, radiance }))
    }
}

impl LightSettings for AreaLight {
    fn kind(&self) -> &'static str {
        "area"
    }

    fn shape(&self) -> Option<&'static str> {
        Some(match self.shape {
            AreaShape::Rectangle => "rectangle",
            AreaShape::Disk => "disk",
            AreaShape::Sphere => "sphere",
        })
    }

    fn parameters(&self) -> Parameters<'_> {
        vec![
            ("to_world", Parameter::Placement(self.to_world)),
            ("radiance", Parameter::Colour(self.radiance)),
        ]
    }
}

/// A shape that rays are intersected with directly.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Rectangle(Rectangle),
    Disk(Disk),
    Sphere(Sphere),
}

/// A shape and what it emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AreaEmitter {
    shape: Shape,
    pub(super) radiance: DVec3,
}

impl AreaEmitter {
    /// The light, whose index is `light`, ready for sampling.
    pub(super) fn try_new(settings: &AreaLight, light: usize) -> Result<Self, LightError> {
        let AreaLight { shape, to_world, radiance } = settings;
        let flat = LightError::FlatShape { light };
        let shape = match shape {
            AreaShape::Rectangle => Shape::Rectangle(Rectangle::try_new(to_world).ok_or(flat)?),
            AreaShape::Disk => Shape::Disk(Disk::try_new(to_world).ok_or(flat)?),
            AreaShape::Sphere => {
                Shape::Sphere(Sphere::try_new(to_world).ok_or(LightError::NotRound { light })?)
            }
        };
        Ok(Self { shape, radiance: *radiance })
    }

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
