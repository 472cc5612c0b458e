//! Lights.

use glam::{DAffine3, DVec2, DVec3};
use thiserror::Error;

use super::rectangle::{Rectangle, RectangleHit};
use super::warp;
use crate::math::rounding::gamma;
use crate::trace::Ray;

/// A light as the scene file gives it; colours are linear RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// The same radiance from every direction.
    Constant {
        /// Radiance.
        radiance: DVec3,
    },
    /// A point that shines alike in all directions.
    Point {
        /// Where it is.
        position: DVec3,
        /// Radiant intensity (power per solid angle).
        intensity: DVec3,
    },
    /// The rectangle `[-1, 1]²` of the plane z = 0, shining to the side of +z, placed by `to_world`.
    Rectangle {
        /// Places the rectangle in the world.
        to_world: DAffine3,
        /// Radiance emitted.
        radiance: DVec3,
    },
}

/// Why lights cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum LightError {
    /// As in Mitsuba, one light at most may surround the scene.
    #[error("lights {first} and {second} both surround the scene; only one constant light is possible")]
    TwoEnvironments {
        /// Index of the light that comes first.
        first: usize,
        /// Index of the other light.
        second: usize,
    },
    /// A rectangle without area.
    #[error("light {light}: to_world leaves the rectangle without area, or is not finite")]
    FlatRectangle {
        /// Index of the light.
        light: usize,
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
    /// The rectangle that the point is on, as an index into the set's lights.
    pub rectangle: Option<usize>,
}

/// A direction from which a light shines on a point, drawn at random.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit direction towards the light.
    pub direction: DVec3,
    /// Where the light is; none for one that is infinitely far.
    pub end: Option<LightEnd>,
    /// Radiance over density; for a point light, irradiance at normal incidence over the
    /// probability of its choice.
    pub weight: DVec3,
    /// Density by solid angle, times the probability of the light's choice.
    pub pdf: f64,
    /// Whether no other strategy can find this light (a point).
    pub is_delta: bool,
}

/// A rectangle light that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightHit {
    /// The light, as an index into the set's lights.
    pub light: usize,
    /// Where on the rectangle.
    pub hit: RectangleHit,
}

/// A light ready for sampling.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Emitter {
    Constant(DVec3),
    Point { position: DVec3, intensity: DVec3 },
    Rectangle { shape: Rectangle, radiance: DVec3 },
}

/// The lights of a scene, chosen among uniformly, as in Mitsuba.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct LightSet {
    emitters: Vec<Emitter>,
    environment: Option<DVec3>,
}

impl LightSet {
    /// Prepares the lights.
    ///
    /// # Errors
    /// Where two lights surround the scene, or a rectangle has no area.
    pub fn try_new(lights: &[Light]) -> Result<Self, LightError> {
        let mut set = Self::default();
        let mut surrounds = None;
        for (light, settings) in lights.iter().enumerate() {
            set.emitters.push(match settings {
                Light::Constant { radiance } => {
                    if let Some(first) = surrounds.replace(light) {
                        return Err(LightError::TwoEnvironments { first, second: light });
                    }
                    set.environment = Some(*radiance);
                    Emitter::Constant(*radiance)
                }
                Light::Point { position, intensity } => {
                    Emitter::Point { position: *position, intensity: *intensity }
                }
                Light::Rectangle { to_world, radiance } => Emitter::Rectangle {
                    shape: Rectangle::try_new(to_world).ok_or(LightError::FlatRectangle { light })?,
                    radiance: *radiance,
                },
            });
        }
        Ok(set)
    }

    /// The radiance that surrounds the scene, if a light does.
    pub const fn environment(&self) -> Option<DVec3> {
        self.environment
    }

    /// Draws a light by `choice` and a direction to it by `u`, uniform in `[0, 1)`.
    ///
    /// None if no light comes from there: the back of a rectangle, or no lights at all.
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
            Emitter::Point { position, intensity } => sample_point(from, *position, *intensity),
            Emitter::Rectangle { shape, radiance } => sample_rectangle(from, shape, *radiance, light, u),
        }?;
        Some(LightSample { weight: sample.weight * count, pdf: sample.pdf / count, ..sample })
    }

    /// Density of [`Self::sample`] for a direction that meets no surface.
    pub fn environment_pdf(&self) -> f64 {
        match self.environment {
            Some(_) => warp::UNIFORM_SPHERE_PDF / self.emitters.len() as f64,
            None => 0.0,
        }
    }

    /// Density of [`Self::sample`] for the direction of a ray that met a rectangle light.
    pub fn hit_pdf(&self, ray: &Ray, hit: &LightHit) -> f64 {
        let Emitter::Rectangle { shape, .. } = &self.emitters[hit.light] else {
            return 0.0;
        };
        let length = ray.direction.length();
        let cos_light = hit.hit.normal.dot(ray.direction) / length;
        shape.pdf(hit.hit.t * length, cos_light) / self.emitters.len() as f64
    }

    /// Radiance that a rectangle light sends back along the ray; its back is black.
    pub fn hit_radiance(&self, ray: &Ray, hit: &LightHit) -> DVec3 {
        match &self.emitters[hit.light] {
            Emitter::Rectangle { radiance, .. } if ray.direction.dot(hit.hit.normal) < 0.0 => *radiance,
            _ => DVec3::ZERO,
        }
    }

    /// The rectangle light that the ray meets first.
    pub fn closest_hit(&self, ray: &Ray) -> Option<LightHit> {
        let mut ray = *ray;
        let mut closest = None;
        for (light, emitter) in self.emitters.iter().enumerate() {
            if let Emitter::Rectangle { shape, .. } = emitter
                && let Some(hit) = shape.intersect(&ray)
            {
                ray.t_max = hit.t;
                closest = Some(LightHit { light, hit });
            }
        }
        closest
    }

    /// Whether a rectangle light other than `target` is in the ray's way.
    pub fn blocks(&self, ray: &Ray, target: Option<usize>) -> bool {
        self.emitters.iter().enumerate().any(|(light, emitter)| {
            matches!(emitter, Emitter::Rectangle { shape, .. }
                if target != Some(light) && shape.intersect(ray).is_some())
        })
    }
}

/// A point light: intensity / distance².
fn sample_point(from: DVec3, position: DVec3, intensity: DVec3) -> Option<LightSample> {
    let way = position - from;
    let distance = way.length();
    (distance > 0.0).then(|| LightSample {
        direction: way / distance,
        end: Some(LightEnd {
            position,
            // given exactly; the subtraction that makes the ray rounds once
            position_error: gamma(1) * position.abs().max_element(),
            cos_light: 1.0,
            rectangle: None,
        }),
        weight: intensity / (distance * distance),
        pdf: 1.0,
        is_delta: true,
    })
}

/// A point of a rectangle, uniform by area; none on the side that does not shine.
fn sample_rectangle(
    from: DVec3,
    shape: &Rectangle,
    radiance: DVec3,
    light: usize,
    u: DVec2,
) -> Option<LightSample> {
    let position = shape.point(u);
    let way = position - from;
    let distance = way.length();
    let direction = way / distance;
    let cos_light = -direction.dot(shape.normal());
    if cos_light.is_nan() || cos_light <= 0.0 {
        return None;
    }
    let pdf = shape.pdf(distance, cos_light);
    (pdf > 0.0).then(|| LightSample {
        direction,
        end: Some(LightEnd {
            position,
            position_error: shape.point_error(),
            cos_light,
            rectangle: Some(light),
        }),
        weight: radiance / pdf,
        pdf,
        is_delta: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shade::Sampler;

    fn square(z: f64) -> Light {
        // shines downwards
        let turn = DAffine3::from_rotation_x(std::f64::consts::PI);
        Light::Rectangle {
            to_world: DAffine3::from_translation(DVec3::new(0.0, 0.0, z)) * turn,
            radiance: DVec3::splat(2.0),
        }
    }

    #[test]
    fn densities_of_samples_and_hits_agree() {
        let lights = [square(1.5), Light::Constant { radiance: DVec3::ONE }];
        let set = LightSet::try_new(&lights).unwrap();
        let from = DVec3::new(0.3, -0.2, 0.1);
        let mut seen = [0; 2];
        for i in 0..1000 {
            let mut sampler = Sampler::new(6, [i, 0], 0);
            let (choice, u) = (sampler.next_1d(), sampler.next_2d());
            let sample = set.sample(from, choice, u).unwrap();
            let ray = Ray::new(from, sample.direction);
            if sample.end.is_some() {
                let hit = set.closest_hit(&ray).expect("samples lie on the rectangle");
                let pdf = set.hit_pdf(&ray, &hit);
                assert!((pdf / sample.pdf - 1.0).abs() < 1e-12, "{pdf} {}", sample.pdf);
                assert_eq!(set.hit_radiance(&ray, &hit), DVec3::splat(2.0));
                assert!(set.blocks(&ray, None) && !set.blocks(&ray, Some(0)));
                seen[0] += 1;
            } else {
                assert_eq!(sample.pdf, set.environment_pdf());
                seen[1] += 1;
            }
        }
        assert!(seen.iter().all(|n| (400..600).contains(n)), "chosen {seen:?}");
    }

    #[test]
    fn rectangles_shine_to_one_side() {
        let set = LightSet::try_new(&[square(1.0)]).unwrap();
        let u = DVec2::splat(0.25);
        assert_eq!(set.sample(DVec3::new(0.0, 0.0, 2.0), 0.5, u), None);
        assert_eq!(set.sample(DVec3::new(5.0, 0.0, 1.0), 0.5, u), None);
        let ray = Ray::new(DVec3::new(0.0, 0.0, 2.0), DVec3::NEG_Z);
        let back = set.closest_hit(&ray).unwrap();
        assert_eq!(set.hit_radiance(&ray, &back), DVec3::ZERO);
    }

    #[test]
    fn solid_angle_of_a_square() {
        // a face of the cube [-1, 1]³ seen from its centre: 4π/6
        let set = LightSet::try_new(&[square(1.0)]).unwrap();
        let mut sum = 0.0;
        for i in 0..100_000 {
            let u = Sampler::new(8, [i, 0], 0).next_2d();
            sum += 1.0 / set.sample(DVec3::ZERO, 0.0, u).unwrap().pdf;
        }
        let (got, want) = (sum / 1e5, 4.0 * std::f64::consts::PI / 6.0);
        assert!((got - want).abs() < 0.02, "got {got}, want {want}");
    }

    #[test]
    fn unusable_lights_are_refused() {
        let sky = Light::Constant { radiance: DVec3::ONE };
        let two = LightSet::try_new(&[sky, square(1.0), sky]);
        let want = LightError::TwoEnvironments { first: 0, second: 2 };
        assert_eq!(two, Err(want));
        let flat = Light::Rectangle {
            to_world: DAffine3::from_scale(DVec3::new(0.0, 1.0, 1.0)),
            radiance: DVec3::ONE,
        };
        assert_eq!(LightSet::try_new(&[flat]), Err(LightError::FlatRectangle { light: 0 }));
        assert_eq!(LightSet::default().sample(DVec3::ZERO, 0.0, DVec2::ZERO), None);
    }
}
