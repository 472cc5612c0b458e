//! Lights.

mod area;
mod directional;
mod disk;
mod envmap;
mod object;
mod point;
mod rectangle;
mod sphere;
mod spot;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3};
use thiserror::Error;

use self::area::{AreaLight, Shape};
use self::disk::Disk;
use self::envmap::EnvironmentMap;
use self::object::ObjectLight;
use self::rectangle::Rectangle;
use self::sphere::Sphere;
use self::spot::Spot;
use super::warp;
use crate::film::Picture;
use crate::trace::{Ray, SurfaceInteraction, TracedObject};

pub use area::ShapeHit;

/// A light as the scene file gives it; colours are linear RGB.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// The same radiance from every direction.
    Constant {
        /// Radiance.
        radiance: DVec3,
    },
    /// A picture around the scene: longitude along its rows, +y of `to_world` above the first one.
    Envmap {
        /// Radiance before it is scaled.
        picture: Arc<Picture>,
        /// Factor of the radiance.
        scale: f64,
        /// Turns the picture, and may mirror it; nothing else.
        to_world: DAffine3,
    },
    /// A point that shines alike in all directions.
    Point {
        /// Where it is.
        position: DVec3,
        /// Radiant intensity (power per solid angle).
        intensity: DVec3,
    },
    /// Light that comes from infinitely far.
    Directional {
        /// The way it goes, of any length but 0.
        direction: DVec3,
        /// Irradiance of a surface that faces it.
        irradiance: DVec3,
    },
    /// A point that shines into a cone around +z, placed by `to_world`.
    Spot {
        /// Places the cone in the world.
        to_world: DAffine3,
        /// Radiant intensity within `beam_width`.
        intensity: DVec3,
        /// Degrees from the axis beyond which it is dark.
        cutoff_angle: f64,
        /// Degrees from the axis up to which it is not dimmed; at most `cutoff_angle`.
        beam_width: f64,
    },
    /// The rectangle `[-1, 1]²` of the plane z = 0, shining to the side of +z, placed by `to_world`.
    Rectangle {
        /// Places the rectangle in the world.
        to_world: DAffine3,
        /// Radiance emitted.
        radiance: DVec3,
    },
    /// The unit disk of the plane z = 0, shining to the side of +z, placed by `to_world`.
    Disk {
        /// Places the disk in the world.
        to_world: DAffine3,
        /// Radiance emitted.
        radiance: DVec3,
    },
    /// The unit sphere, shining outwards, or inwards if `to_world` mirrors it.
    Sphere {
        /// Places the sphere in the world; scales all axes alike.
        to_world: DAffine3,
        /// Radiance emitted.
        radiance: DVec3,
    },
    /// An object of the scene, shining to the side from which its faces wind counter-clockwise.
    Object {
        /// Index of the object.
        object: usize,
        /// Radiance emitted.
        radiance: DVec3,
    },
}

/// Why lights cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum LightError {
    /// As in Mitsuba, one light at most may surround the scene.
    #[error(
        "lights {first} and {second} both surround the scene; only one constant or envmap light is possible"
    )]
    TwoEnvironments {
        /// Index of the light that came first.
        first: usize,
        /// Index of the other light.
        second: usize,
    },
    /// A shape without area.
    #[error("light {light}: to_world leaves the shape without area, or is not finite")]
    FlatShape {
        /// Index of the light.
        light: usize,
    },
    /// A sphere that is an ellipsoid.
    #[error("light {light}: to_world of a sphere must scale all axes alike, and be finite")]
    NotRound {
        /// Index of the light.
        light: usize,
    },
    /// An environment map that cannot be used.
    #[error("light {light}: to_world of an envmap must only turn or mirror, and its numbers must be finite")]
    Envmap {
        /// Index of the light.
        light: usize,
    },
    /// A spot or directional light without direction.
    #[error("light {light}: direction or to_world gives no direction, or beam_width exceeds cutoff_angle")]
    NoDirection {
        /// Index of the light.
        light: usize,
    },
    /// An object that is not there, or that another light has already.
    #[error("light {light}: there is no object {object}, or another light makes it shine already")]
    Object {
        /// Index of the light.
        light: usize,
        /// Index of the object.
        object: usize,
    },
}

/// Where the way to a light ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightEnd {
    /// The point on the light.
    pub position: DVec3,
    /// Bound on the error of each of its coordinates.
    pub position_error: f64,
    /// Cosine of the way's angle with the light's normal, positive; 1 for a point.
    pub cos_light: f64,
    /// The light whose shape or object the point is on, as an index into the set's lights.
    pub light: Option<usize>,
}

/// A direction from which a light shines on a point, drawn at random.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit direction towards the light.
    pub direction: DVec3,
    /// Where the light is; none for one that is infinitely far.
    pub end: Option<LightEnd>,
    /// Radiance over density; for a delta distribution, irradiance at normal incidence over the
    /// probability of its choice.
    pub weight: DVec3,
    /// Density by solid angle, times the probability of the light's choice.
    pub pdf: f64,
    /// Whether no other strategy can find this light (a point, a spot or a directional light).
    pub is_delta: bool,
}

/// The shape of an area light that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightHit {
    /// The light, as an index into the set's lights.
    pub light: usize,
    /// Where on its shape.
    pub hit: ShapeHit,
}

/// A light ready for sampling.
#[derive(Clone, Debug, PartialEq)]
enum Emitter {
    Constant(DVec3),
    Envmap(EnvironmentMap),
    Point { position: DVec3, intensity: DVec3 },
    Directional { direction: DVec3, irradiance: DVec3 },
    Spot(Spot),
    Area(AreaLight),
    Object(ObjectLight),
}

/// The lights of a scene, chosen among uniformly, as in Mitsuba.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct LightSet {
    emitters: Vec<Emitter>,
    /// The light that surrounds the scene.
    environment: Option<usize>,
    /// The light that each object is, by the object's index; shorter if no further object is one.
    objects: Vec<Option<usize>>,
}

impl LightSet {
    /// Prepares the lights of a scene with these objects.
    ///
    /// # Errors
    /// Where two lights surround the scene or are the same object, or a light's settings make none.
    pub fn try_new(lights: &[Light], objects: &[TracedObject]) -> Result<Self, LightError> {
        let mut set = Self::default();
        for (light, settings) in lights.iter().enumerate() {
            match settings {
                Light::Constant { .. } | Light::Envmap { .. } => {
                    if let Some(first) = set.environment.replace(light) {
                        return Err(LightError::TwoEnvironments { first, second: light });
                    }
                }
                Light::Object { object, .. } => set.mark(light, *object, objects.len())?,
                _ => {}
            }
            set.emitters.push(Emitter::try_new(settings, light, objects)?);
        }
        Ok(set)
    }

    /// Notes that an object is a light.
    fn mark(&mut self, light: usize, object: usize, count: usize) -> Result<(), LightError> {
        if object >= count || self.light_of(object).is_some() {
            return Err(LightError::Object { light, object });
        }
        if self.objects.len() <= object {
            self.objects.resize(object + 1, None);
        }
        self.objects[object] = Some(light);
        Ok(())
    }

    /// The light that an object is.
    fn light_of(&self, object: usize) -> Option<usize> {
        self.objects.get(object).copied().flatten()
    }

    /// Whether a light surrounds the scene.
    pub const fn has_environment(&self) -> bool {
        self.environment.is_some()
    }

    /// Whether an object of the scene is a light.
    pub fn is_object_light(&self, object: u32) -> bool {
        self.light_of(object as usize).is_some()
    }

    /// Draws a light by `choice` and a direction to it by `u`, uniform in `[0, 1)`.
    ///
    /// None if no light comes from there: the back of a shape, outside a cone, or no lights at all.
    pub fn sample(&self, from: DVec3, choice: f64, u: DVec2) -> Option<LightSample> {
        let count = self.emitters.len() as f64;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "choice < 1, and the count is exact, so the product is an index"
        )]
        let light = (choice * count) as usize;
        let sample = match self.emitters.get(light)? {
            Emitter::Constant(radiance) => Some(LightSample {
                direction: warp::uniform_sphere(u),
                end: None,
                weight: *radiance / warp::UNIFORM_SPHERE_PDF,
                pdf: warp::UNIFORM_SPHERE_PDF,
                is_delta: false,
            }),
            Emitter::Envmap(map) => map.sample(u),
            Emitter::Point { position, intensity } => point::sample(from, *position, *intensity),
            Emitter::Directional { direction, irradiance } => {
                Some(directional::sample(*direction, *irradiance))
            }
            Emitter::Spot(spot) => spot.sample(from),
            Emitter::Area(area) => area.sample(from, u, light),
            Emitter::Object(object) => object.sample(from, u, light),
        }?;
        Some(LightSample { weight: sample.weight * count, pdf: sample.pdf / count, ..sample })
    }

    /// Radiance that comes from around the scene, back along a ray's direction of any length but 0.
    pub fn environment_radiance(&self, direction: DVec3) -> DVec3 {
        match self.environment.map(|light| &self.emitters[light]) {
            Some(Emitter::Constant(radiance)) => *radiance,
            Some(Emitter::Envmap(map)) => map.radiance(direction),
            _ => DVec3::ZERO,
        }
    }

    /// Density of [`Self::sample`] for the direction of a ray that meets no surface.
    pub fn environment_pdf(&self, direction: DVec3) -> f64 {
        let pdf = match self.environment.map(|light| &self.emitters[light]) {
            Some(Emitter::Constant(_)) => warp::UNIFORM_SPHERE_PDF,
            Some(Emitter::Envmap(map)) => map.pdf(direction),
            _ => return 0.0,
        };
        pdf / self.emitters.len() as f64
    }

    /// Density of [`Self::sample`] for the direction of a ray that met the shape of a light.
    pub fn hit_pdf(&self, ray: &Ray, hit: &LightHit) -> f64 {
        let Emitter::Area(area) = &self.emitters[hit.light] else {
            return 0.0;
        };
        let length = ray.direction.length();
        let cos_light = -hit.hit.normal.dot(ray.direction) / length;
        area.pdf(ray.origin, hit.hit.t * length, cos_light) / self.emitters.len() as f64
    }

    /// Radiance that the shape of a light sends back along the ray; its back is black.
    pub fn hit_radiance(&self, ray: &Ray, hit: &LightHit) -> DVec3 {
        match &self.emitters[hit.light] {
            Emitter::Area(area) if ray.direction.dot(hit.hit.normal) < 0.0 => area.radiance,
            _ => DVec3::ZERO,
        }
    }

    /// Radiance that an object sends back along the ray that hit it; black if it is no light.
    pub fn object_radiance(&self, hit: &SurfaceInteraction, direction: DVec3) -> DVec3 {
        self.object(hit).map_or(DVec3::ZERO, |object| object.radiance(hit, direction))
    }

    /// Density of [`Self::sample`] for the direction of a ray that hit an object, `distance` away.
    pub fn object_pdf(&self, hit: &SurfaceInteraction, direction: DVec3, distance: f64) -> f64 {
        self.object(hit)
            .map_or(0.0, |object| object.hit_pdf(hit, direction, distance) / self.emitters.len() as f64)
    }

    fn object(&self, hit: &SurfaceInteraction) -> Option<&ObjectLight> {
        match &self.emitters[self.light_of(hit.object as usize)?] {
            Emitter::Object(object) => Some(object),
            _ => None,
        }
    }

    /// The shape of a light that the ray meets first; objects are not among them.
    pub fn closest_hit(&self, ray: &Ray) -> Option<LightHit> {
        let mut ray = *ray;
        let mut closest = None;
        for (light, emitter) in self.emitters.iter().enumerate() {
            if let Emitter::Area(area) = emitter
                && let Some(hit) = area.intersect(&ray)
            {
                ray.t_max = hit.t;
                closest = Some(LightHit { light, hit });
            }
        }
        closest
    }

    /// Whether the shape of a light other than `target` is in the ray's way.
    pub fn blocks(&self, ray: &Ray, target: Option<usize>) -> bool {
        self.emitters.iter().enumerate().any(|(light, emitter)| {
            matches!(emitter, Emitter::Area(area)
                if target != Some(light) && area.intersect(ray).is_some())
        })
    }
}

impl Emitter {
    fn try_new(settings: &Light, light: usize, objects: &[TracedObject]) -> Result<Self, LightError> {
        let flat = LightError::FlatShape { light };
        let no_direction = LightError::NoDirection { light };
        let area = |shape, radiance: &DVec3| Self::Area(AreaLight { shape, radiance: *radiance });
        Ok(match settings {
            Light::Constant { radiance } => Self::Constant(*radiance),
            Light::Envmap { picture, scale, to_world } => Self::Envmap(
                EnvironmentMap::try_new(picture, *scale, to_world).ok_or(LightError::Envmap { light })?,
            ),
            Light::Point { position, intensity } => {
                Self::Point { position: *position, intensity: *intensity }
            }
            Light::Directional { direction, irradiance } => Self::Directional {
                direction: direction.try_normalize().ok_or(no_direction)?,
                irradiance: *irradiance,
            },
            Light::Spot { to_world, intensity, cutoff_angle, beam_width } => Self::Spot(
                Spot::try_new(to_world, *intensity, [*cutoff_angle, *beam_width]).ok_or(no_direction)?,
            ),
            Light::Rectangle { to_world, radiance } => {
                area(Shape::Rectangle(Rectangle::try_new(to_world).ok_or(flat)?), radiance)
            }
            Light::Disk { to_world, radiance } => {
                area(Shape::Disk(Disk::try_new(to_world).ok_or(flat)?), radiance)
            }
            Light::Sphere { to_world, radiance } => {
                let sphere = Sphere::try_new(to_world).ok_or(LightError::NotRound { light })?;
                area(Shape::Sphere(sphere), radiance)
            }
            Light::Object { object, radiance } => {
                Self::Object(ObjectLight::new(&objects[*object], *radiance))
            }
        })
    }
}
