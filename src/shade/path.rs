//! The path integrator: radiance along a camera ray by a random walk.

use glam::DVec3;

use super::light::LightHit;
use super::sampler::Sampler;
use super::scene::{SceneHit, ShadingScene};
use super::settings::{IntegratorKind, RenderSettings};
use super::spawn::spawn_ray;
use super::statistics::RenderStatistics;
use crate::film::{FirstHit, Sample, SurfaceIds};
use crate::trace::{Geometry, Ray, SurfaceInteraction};

/// Greatest probability with which Russian roulette lets a path go on, as in Mitsuba: a path
/// between white surfaces ends too, after some twenty more bounces.
const MAX_SURVIVAL: f64 = 0.95;

/// Path tracing as Mitsuba's `path`: at each surface one sample of the lights and one of the
/// material, weighted by the power heuristic (Veach 1997, section 9.2), and Russian roulette.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathIntegrator {
    /// Longest path in segments; none is unlimited.
    max_depth: Option<u32>,
    /// Depth from which Russian roulette may end a path; none is never.
    rr_depth: Option<u32>,
    hide_emitters: bool,
    /// Whether the picture is covered where the ray leaves the scene for a constant light.
    environment_covers: bool,
}

/// The walk's state between two surfaces.
struct Walk {
    radiance: DVec3,
    /// What radiance from here on is multiplied by on its way to the camera.
    throughput: DVec3,
    /// Density with which the last direction was drawn; none for the camera's.
    pdf: Option<f64>,
}

impl PathIntegrator {
    /// The integrator that the settings ask for.
    ///
    /// `direct` is Mitsuba's with its defaults: one light sample and one material sample, so a
    /// path of depth 2 without Russian roulette (`max_depth` and `rr_depth` do not apply), and
    /// it leaves alpha 0 where a ray leaves the scene even if a light is seen there.
    pub fn new(settings: &RenderSettings) -> Self {
        let hide_emitters = settings.hide_emitters;
        match settings.integrator {
            IntegratorKind::Path => Self {
                max_depth: u32::try_from(settings.max_depth).ok(),
                rr_depth: Some(settings.rr_depth),
                hide_emitters,
                environment_covers: !hide_emitters,
            },
            IntegratorKind::Direct => {
                Self { max_depth: Some(2), rr_depth: None, hide_emitters, environment_covers: false }
            }
        }
    }

    /// One sample of the radiance that comes back along a ray from the camera.
    ///
    /// Depths count segments: lights seen directly are at depth 1. `hide_emitters` lets camera
    /// rays through the shapes of lights and leaves the background black, as Mitsuba 3.9 does.
    pub fn sample<G: Geometry>(
        &self,
        scene: &ShadingScene<'_, G>,
        mut ray: Ray,
        sampler: &mut Sampler,
        statistics: &mut RenderStatistics,
    ) -> Sample {
        let mut hit = if self.hide_emitters {
            scene.surface_hit(&ray, statistics).map(SceneHit::Surface)
        } else {
            scene.closest_hit(&ray, statistics)
        };
        let mut sample = Sample {
            radiance: DVec3::ZERO,
            alpha: self.alpha(scene, hit.as_ref()),
            first_hit: hit.map(|hit| first_hit(scene, &ray, &hit)),
        };
        let mut walk = Walk { radiance: DVec3::ZERO, throughput: DVec3::ONE, pdf: None };
        let mut depth = 1;
        while self.reaches(depth) {
            let surface = match hit {
                None => {
                    if walk.pdf.is_some() || !self.hide_emitters {
                        walk.add_environment(scene);
                    }
                    break;
                }
                Some(SceneHit::Light(light)) => {
                    walk.add_light(scene, &ray, &light);
                    break;
                }
                Some(SceneHit::Surface(surface)) => surface,
            };
            depth += 1;
            if !self.reaches(depth) {
                break;
            }
            let Some(next) = walk.scatter(scene, &surface, -ray.direction, sampler, statistics) else {
                break;
            };
            let lucky = sampler.next_1d();
            if self.rr_depth.is_some_and(|rr_depth| depth > rr_depth) && !walk.survives(lucky) {
                break;
            }
            ray = next;
            hit = scene.closest_hit(&ray, statistics);
        }
        sample.radiance = walk.radiance;
        sample
    }

    /// Whether paths may have that many segments.
    fn reaches(&self, depth: u32) -> bool {
        self.max_depth.is_none_or(|max| depth <= max)
    }

    /// Whether the picture is covered here, as Mitsuba's `path` has it: where a light surrounds
    /// the scene (unless hidden), where a light's shape is seen, and where a surface is seen that
    /// the path is long enough to shade.
    fn alpha<G>(&self, scene: &ShadingScene<'_, G>, hit: Option<&SceneHit>) -> f64 {
        let covered = match hit {
            Some(SceneHit::Surface(_)) if self.reaches(2) => true,
            Some(SceneHit::Light(_)) => self.reaches(1),
            _ => self.reaches(1) && self.environment_covers && scene.lights.environment().is_some(),
        };
        f64::from(u8::from(covered))
    }
}

impl Walk {
    /// The walk leaves the scene.
    fn add_environment<G>(&mut self, scene: &ShadingScene<'_, G>) {
        if let Some(radiance) = scene.lights.environment() {
            self.add(radiance, scene.lights.environment_pdf());
        }
    }

    /// The walk ends at a light.
    fn add_light<G>(&mut self, scene: &ShadingScene<'_, G>, ray: &Ray, light: &LightHit) {
        let radiance = scene.lights.hit_radiance(ray, light);
        self.add(radiance, scene.lights.hit_pdf(ray, light));
    }

    /// Adds radiance met by following the walk, that the lights' sampling finds with `light_pdf`.
    fn add(&mut self, radiance: DVec3, light_pdf: f64) {
        let weight = self.pdf.map_or(1.0, |pdf| mis_weight(pdf, light_pdf));
        self.radiance += weight * self.throughput * radiance;
    }

    /// Adds what a light sends to the surface directly, and draws the ray that goes on.
    fn scatter<G: Geometry>(
        &mut self,
        scene: &ShadingScene<'_, G>,
        surface: &SurfaceInteraction,
        to_viewer: DVec3,
        sampler: &mut Sampler,
        statistics: &mut RenderStatistics,
    ) -> Option<Ray> {
        if !(surface.normal.is_finite() && surface.position.is_finite()) {
            // shading would take it for the black side; this way the sample is counted
            self.radiance = DVec3::NAN;
            return None;
        }
        let bsdf = scene.material(surface).bsdf(surface);
        let to_viewer = to_viewer.normalize();

        // the lights
        let (choice, u) = (sampler.next_1d(), sampler.next_2d());
        if let Some(light) = scene.lights.sample(surface.position, choice, u) {
            let value = bsdf.eval(to_viewer, light.direction);
            if value.value != DVec3::ZERO && scene.is_lit(surface, &light, statistics) {
                let weight = if light.is_delta { 1.0 } else { mis_weight(light.pdf, value.pdf) };
                self.radiance += weight * self.throughput * value.value * light.weight;
            }
        }

        // the material
        let next = bsdf.sample(to_viewer, sampler.next_1d(), sampler.next_2d())?;
        self.throughput *= next.weight;
        self.pdf = Some(next.pdf);
        (self.throughput != DVec3::ZERO).then(|| spawn_ray(surface, next.to_light))
    }

    /// Russian roulette: goes on with probability min(max(throughput), 0.95), made up for.
    fn survives(&mut self, lucky: f64) -> bool {
        let survival = self.throughput.max_element().min(MAX_SURVIVAL);
        self.throughput /= survival;
        lucky < survival
    }
}

/// Power heuristic with exponent 2 of one sample each: a² / (a² + b²).
fn mis_weight(pdf: f64, other_pdf: f64) -> f64 {
    // the quotient first, so that a density near the greatest double does not overflow
    if pdf > 0.0 {
        let ratio = other_pdf / pdf;
        1.0 / (1.0 + ratio * ratio)
    } else {
        0.0
    }
}

/// What the layers show of the camera ray's hit. A light's shape is black and has no ids; its
/// place, normal and texture coordinates are shown, as in Mitsuba.
fn first_hit<G: Geometry>(scene: &ShadingScene<'_, G>, ray: &Ray, hit: &SceneHit) -> FirstHit {
    let per_t = ray.direction.length();
    match hit {
        SceneHit::Surface(surface) => FirstHit {
            depth: surface.t * per_t,
            position: surface.position,
            normal: surface.shading_normal,
            geo_normal: surface.normal,
            uv: surface.uv,
            st: surface.st,
            rest: surface.rest,
            ids: Some(SurfaceIds { object: surface.object, face: surface.face, patch: surface.patch }),
            albedo: scene.material(surface).albedo(surface, -ray.direction),
        },
        SceneHit::Light(light) => FirstHit {
            depth: light.hit.t * per_t,
            position: light.hit.position,
            normal: light.hit.normal,
            geo_normal: light.hit.normal,
            uv: light.hit.uv,
            st: light.hit.uv,
            rest: light.hit.position,
            ids: None,
            albedo: DVec3::ZERO,
        },
    }
}
