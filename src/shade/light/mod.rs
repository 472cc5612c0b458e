//! Lights: Mitsuba's, by its names and with its defaults.
//!
//! Each is in a file of its own: its parameters, how they are read, and how it is sampled. To add one, write such a file, and
//! list it here in [`Light`], among its [kinds](Light::kinds) and in `Emitter`.

mod area;
mod constant;
mod directional;
mod envmap;
mod object;
mod point;
mod spot;
#[cfg(test)]
mod tests;

use glam::{DVec2, DVec3};
use thiserror::Error;

use self::area::AreaEmitter;
use self::envmap::EnvironmentMap;
use self::object::{Emission, ObjectEmitter};
use self::spot::Spot;
use super::parameters::{ParameterSource, Parameters, PictureSource};
use super::warp;
use crate::film::PictureLimits;
use crate::shade::material::ObjectMaterials;
use crate::trace::{Ray, SurfaceInteraction, TracedObject};

pub use area::{AreaLight, AreaShape, ShapeHit};
pub use constant::ConstantLight;
pub use directional::DirectionalLight;
pub use envmap::{EnvironmentError, EnvironmentLight};
pub use object::ObjectLight;
pub use point::PointLight;
pub use spot::SpotLight;

/// A light as the scene file gives it; colours are linear RGB.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// The same radiance from every direction.
    Constant(ConstantLight),
    /// A picture around the scene.
    Envmap(EnvironmentLight),
    /// A point that shines alike in all directions.
    Point(PointLight),
    /// Light that comes from infinitely far.
    Directional(DirectionalLight),
    /// A point that shines into a cone.
    Spot(SpotLight),
    /// A shape that shines.
    Area(AreaLight),
    /// An object of the scene that shines.
    Object(ObjectLight),
}

/// The kinds of light, in the order that messages list them.
const KINDS: &[&[LightKind]] = &[
    &[constant::KIND, envmap::KIND, point::KIND, directional::KIND, spot::KIND],
    area::KINDS,
    &[object::KIND],
];

/// A kind of light.
#[derive(Clone, Copy, Debug)]
pub struct LightKind {
    /// Its name in scene files.
    pub name: &'static str,
    /// The shape that shines, of area lights.
    pub shape: Option<&'static str>,
    /// The names of its parameters.
    pub keys: &'static [&'static str],
    /// Whether it surrounds the scene.
    pub surrounds: bool,
    /// Reads the parameters; only faults that the source is told of make it none.
    pub read: fn(&dyn ParameterSource) -> Option<Light>,
}

/// What all lights have.
trait LightSettings {
    /// The light's name in scene files.
    fn kind(&self) -> &'static str;

    /// The shape that shines, of area lights.
    fn shape(&self) -> Option<&'static str> {
        None
    }

    /// All parameters.
    fn parameters(&self) -> Parameters<'_>;

    /// The parameters as Mitsuba must have them.
    fn mitsuba_parameters(&self) -> Parameters<'_> {
        self.parameters()
    }
}

impl Light {
    /// All kinds, in the order that messages list them; area lights once for each shape.
    pub fn kinds() -> impl Iterator<Item = &'static LightKind> {
        KINDS.iter().copied().flatten()
    }

    fn settings(&self) -> &dyn LightSettings {
        match self {
            Self::Constant(light) => light,
            Self::Envmap(light) => light,
            Self::Point(light) => light,
            Self::Directional(light) => light,
            Self::Spot(light) => light,
            Self::Area(light) => light,
            Self::Object(light) => light,
        }
    }

    /// Its name in scene files.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        self.settings().kind()
    }

    /// The shape that shines, of area lights, by its name in scene files.
    #[must_use]
    pub fn shape(&self) -> Option<&'static str> {
        self.settings().shape()
    }

    /// All parameters.
    #[must_use]
    pub fn parameters(&self) -> Parameters<'_> {
        self.settings().parameters()
    }

    /// The parameters as Mitsuba must have them, where they differ from [`Self::parameters`].
    #[must_use]
    pub fn mitsuba_parameters(&self) -> Parameters<'_> {
        self.settings().mitsuba_parameters()
    }

    /// The same light, its picture read if it has one.
    ///
    /// # Errors
    /// If the picture cannot be read or is larger than allowed, or a pixel is not finite.
    pub fn with_picture(&self, limits: PictureLimits) -> Result<Self, EnvironmentError> {
        match self {
            Self::Envmap(light) => light.with_picture(limits).map(Self::Envmap),
            other => Ok(other.clone()),
        }
    }
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
    /// An environment map whose picture is still a file.
    #[error("light {light}: the picture of the envmap is not read yet")]
    Unread {
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
    Constant(ConstantLight),
    Envmap(EnvironmentMap),
    Point(PointLight),
    /// Its direction has length 1.
    Directional(DirectionalLight),
    Spot(Spot),
    Area(AreaEmitter),
    Object(ObjectEmitter),
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
                Light::Constant(_) | Light::Envmap(_) => {
                    if let Some(first) = set.environment.replace(light) {
                        return Err(LightError::TwoEnvironments { first, second: light });
                    }
                }
                Light::Object(shining) => set.mark(light, shining.object, objects.len())?,
                _ => {}
            }
            set.emitters.push(Emitter::try_new(settings, light, objects)?);
        }
        Ok(set)
    }

    /// The same lights and, one for each object, the faces whose materials emit; not those of objects that are lights
    /// already.
    ///
    /// # Panics
    /// If there are more materials than objects.
    #[must_use]
    pub fn with_materials(mut self, materials: &[ObjectMaterials], objects: &[TracedObject]) -> Self {
        for (object, materials) in materials.iter().enumerate() {
            let emission = materials.emission();
            if emission.is_empty() || self.light_of(object).is_some() {
                continue;
            }
            let by_face = materials.of_face().iter().map(|&material| emission[material as usize]).collect();
            if self.mark(self.emitters.len(), object, objects.len()).is_ok() {
                self.emitters
                    .push(Emitter::Object(ObjectEmitter::new(&objects[object], Emission::ByFace(by_face))));
            }
        }
        self
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
    #[must_use]
    pub const fn has_environment(&self) -> bool {
        self.environment.is_some()
    }

    /// Whether what a ray hit is an object of the scene that is a light, or a face that shines.
    #[must_use]
    pub fn is_object_light(&self, hit: &SurfaceInteraction) -> bool {
        self.object(hit).is_some_and(|object| object.shines(hit.face))
    }

    /// Draws a light by `choice` and a direction to it by `u`, uniform in `[0, 1)`.
    ///
    /// None if no light comes from there: the back of a shape, outside a cone, or no lights at all.
    #[must_use]
    pub fn sample(&self, from: DVec3, choice: f64, u: DVec2) -> Option<LightSample> {
        let count = self.emitters.len() as f64;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "choice < 1, and the count is exact, so the product is an index"
        )]
        let light = (choice * count) as usize;
        let sample = match self.emitters.get(light)? {
            Emitter::Constant(sky) => Some(sky.sample(u)),
            Emitter::Envmap(map) => map.sample(u),
            Emitter::Point(point) => point.sample(from),
            Emitter::Directional(light) => Some(light.sample()),
            Emitter::Spot(spot) => spot.sample(from),
            Emitter::Area(area) => area.sample(from, u, light),
            Emitter::Object(object) => object.sample(from, u, light),
        }?;
        Some(LightSample { weight: sample.weight * count, pdf: sample.pdf / count, ..sample })
    }

    /// Radiance that comes from around the scene, back along a ray's direction of any length but 0.
    #[must_use]
    pub fn environment_radiance(&self, direction: DVec3) -> DVec3 {
        match self.environment.map(|light| &self.emitters[light]) {
            Some(Emitter::Constant(sky)) => sky.radiance,
            Some(Emitter::Envmap(map)) => map.radiance(direction),
            _ => DVec3::ZERO,
        }
    }

    /// Density of [`Self::sample`] for the direction of a ray that meets no surface.
    #[must_use]
    pub fn environment_pdf(&self, direction: DVec3) -> f64 {
        let pdf = match self.environment.map(|light| &self.emitters[light]) {
            Some(Emitter::Constant(_)) => warp::UNIFORM_SPHERE_PDF,
            Some(Emitter::Envmap(map)) => map.pdf(direction),
            _ => return 0.0,
        };
        pdf / self.emitters.len() as f64
    }

    /// Density of [`Self::sample`] for the direction of a ray that met the shape of a light.
    #[must_use]
    pub fn hit_pdf(&self, ray: &Ray, hit: &LightHit) -> f64 {
        let Emitter::Area(area) = &self.emitters[hit.light] else {
            return 0.0;
        };
        let length = ray.direction.length();
        let cos_light = -hit.hit.normal.dot(ray.direction) / length;
        area.pdf(ray.origin, hit.hit.t * length, cos_light) / self.emitters.len() as f64
    }

    /// Radiance that the shape of a light sends back along the ray; its back is black.
    #[must_use]
    pub fn hit_radiance(&self, ray: &Ray, hit: &LightHit) -> DVec3 {
        match &self.emitters[hit.light] {
            Emitter::Area(area) if ray.direction.dot(hit.hit.normal) < 0.0 => area.radiance,
            _ => DVec3::ZERO,
        }
    }

    /// Radiance that an object sends back along the ray that hit it; black if it is no light.
    #[must_use]
    pub fn object_radiance(&self, hit: &SurfaceInteraction, direction: DVec3) -> DVec3 {
        self.object(hit).map_or(DVec3::ZERO, |object| object.radiance(hit, direction))
    }

    /// Density of [`Self::sample`] for the direction of a ray that hit an object, `distance` away.
    #[must_use]
    pub fn object_pdf(&self, hit: &SurfaceInteraction, direction: DVec3, distance: f64) -> f64 {
        self.object(hit)
            .map_or(0.0, |object| object.hit_pdf(hit, direction, distance) / self.emitters.len() as f64)
    }

    fn object(&self, hit: &SurfaceInteraction) -> Option<&ObjectEmitter> {
        match &self.emitters[self.light_of(hit.object as usize)?] {
            Emitter::Object(object) => Some(object),
            _ => None,
        }
    }

    /// The shape of a light that the ray meets first; objects are not among them.
    #[must_use]
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
    #[must_use]
    pub fn blocks(&self, ray: &Ray, target: Option<usize>) -> bool {
        self.emitters.iter().enumerate().any(|(light, emitter)| {
            matches!(emitter, Emitter::Area(area)
                if target != Some(light) && area.intersect(ray).is_some())
        })
    }
}

impl Emitter {
    fn try_new(settings: &Light, light: usize, objects: &[TracedObject]) -> Result<Self, LightError> {
        let no_direction = LightError::NoDirection { light };
        Ok(match settings {
            Light::Constant(sky) => Self::Constant(*sky),
            Light::Envmap(map) => {
                let PictureSource::Read(picture) = &map.picture else {
                    return Err(LightError::Unread { light });
                };
                let map = EnvironmentMap::try_new(picture, map.scale, &map.to_world);
                Self::Envmap(map.ok_or(LightError::Envmap { light })?)
            }
            Light::Point(point) => Self::Point(*point),
            Light::Directional(sun) => Self::Directional(sun.normalized().ok_or(no_direction)?),
            Light::Spot(spot) => Self::Spot(Spot::try_new(spot).ok_or(no_direction)?),
            Light::Area(area) => Self::Area(AreaEmitter::try_new(area, light)?),
            Light::Object(shining) => Self::Object(ObjectEmitter::new(
                &objects[shining.object],
                Emission::Uniform(shining.radiance),
            )),
        })
    }
}
