//! The path integrator: radiance along a camera ray by a random walk.

use glam::DVec3;

use super::sampler::Sampler;
use super::scene::{SceneBuffers, SceneHit, ShadingScene};
use super::settings::{IntegratorKind, RenderSettings};
use super::spawn::spawn_ray;
use super::statistics::RenderStatistics;
use crate::film::{FirstHit, Sample, SurfaceIds};
use crate::trace::{Geometry, Ray, RayTracer, SurfaceInteraction, TraceStatistics};

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
    /// Whether the picture is covered where the ray leaves the scene for a light that surrounds it.
    environment_covers: bool,
}

/// The start of a path: a ray from the camera, and the random numbers that go on from it.
#[derive(Clone, Debug)]
pub struct PathStart {
    /// The camera's ray.
    pub ray: Ray,
    /// The path's numbers.
    pub sampler: Sampler,
}

/// A path's state between two surfaces.
#[derive(Debug)]
struct Walk {
    /// Index of its sample.
    sample: usize,
    sampler: Sampler,
    ray: Ray,
    /// What radiance from here on is multiplied by on its way to the camera.
    throughput: DVec3,
    /// Density with which the last direction was drawn; none where lights could not have been sampled instead: from the
    /// camera or by a delta distribution.
    pdf: Option<f64>,
    /// Product of the relative indices of refraction on the way.
    eta: f64,
    /// Whether it ends here.
    is_over: bool,
}

/// Light that reaches a sample if nothing is in the way.
#[derive(Debug)]
struct Connection {
    sample: usize,
    radiance: DVec3,
}

/// What one thread keeps from one group of paths to the next: buffers, and a tracer of the scene's geometry.
#[derive(Debug)]
pub struct PathBuffers<T> {
    walks: Vec<Walk>,
    rays: Vec<Ray>,
    hits: Vec<Option<SceneHit>>,
    connections: Vec<Connection>,
    shadow_rays: Vec<Ray>,
    blocked: Vec<bool>,
    scene: SceneBuffers<T>,
}

impl<T: RayTracer> PathBuffers<T> {
    /// Buffers for one thread, with a tracer of the scene's geometry.
    pub const fn new(tracer: T) -> Self {
        Self {
            walks: Vec::new(),
            rays: Vec::new(),
            hits: Vec::new(),
            connections: Vec::new(),
            shadow_rays: Vec::new(),
            blocked: Vec::new(),
            scene: SceneBuffers::new(tracer),
        }
    }

    /// What the tracer has counted since this was last called.
    pub fn take_statistics(&mut self) -> TraceStatistics {
        self.scene.take_statistics()
    }
}

impl PathIntegrator {
    /// The integrator that the settings ask for.
    ///
    /// `direct` is Mitsuba's with its defaults: one light sample and one material sample, so a
    /// path of depth 2 without Russian roulette (`max_depth` and `rr_depth` do not apply), and
    /// it leaves alpha 0 where a ray leaves the scene even if a light is seen there.
    #[must_use]
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

    /// One sample for each start of the radiance that comes back along its ray, in their order, appended to `samples`.
    ///
    /// All paths of the group are followed side by side, so that rays are traced together; each has the bits that it has
    /// alone. Depths count segments: lights seen directly are at depth 1. `hide_emitters` lets camera rays through the
    /// shapes of lights and leaves the background black, as Mitsuba 3.9 does.
    pub fn sample<G: Geometry>(
        &self,
        scene: &ShadingScene<'_, G>,
        starts: impl IntoIterator<Item = PathStart>,
        (buffers, statistics): (&mut PathBuffers<G::Tracer<'_>>, &mut RenderStatistics),
        samples: &mut Vec<Sample>,
    ) {
        let PathBuffers { walks, rays, hits, connections, shadow_rays, blocked, scene: scene_buffers } =
            buffers;
        let first = samples.len();
        walks.clear();
        walks.extend((first..).zip(starts).map(|(sample, start)| Walk::new(sample, start)));
        let mut depth = 1;
        loop {
            rays.clear();
            rays.extend(walks.iter().map(|walk| walk.ray));
            let see_lights = depth > 1 || !self.hide_emitters;
            scene.closest_hits(rays, see_lights, (scene_buffers, statistics), hits);
            if depth == 1 {
                samples.extend(
                    rays.iter().zip(hits.iter()).map(|(ray, hit)| self.unlit(scene, ray, hit.as_ref())),
                );
            }
            if !self.reaches(depth) {
                return;
            }
            connections.clear();
            shadow_rays.clear();
            for (walk, hit) in walks.iter_mut().zip(hits.iter()) {
                let radiance = &mut samples[walk.sample].radiance;
                *radiance += walk.emission(scene, hit.as_ref(), see_lights);
                let Some(SceneHit::Surface(surface)) = hit else {
                    walk.is_over = true;
                    continue;
                };
                if !self.reaches(depth + 1) {
                    walk.is_over = true;
                    continue;
                }
                if !(surface.normal.is_finite() && surface.position.is_finite()) {
                    // shading would take it for the black side; this way the sample is counted
                    *radiance = DVec3::NAN;
                    walk.is_over = true;
                    continue;
                }
                if let Some((connection, ray)) = walk.scatter(scene, surface) {
                    connections.push(connection);
                    shadow_rays.push(ray);
                }
                let lucky = walk.sampler.next_1d();
                if !walk.is_over && self.rr_depth.is_some_and(|rr_depth| depth + 1 > rr_depth) {
                    walk.is_over = !walk.survives(lucky);
                }
            }
            scene.blocked(shadow_rays, (scene_buffers, statistics), blocked);
            for (connection, blocked) in connections.iter().zip(blocked.iter()) {
                if !blocked {
                    samples[connection.sample].radiance += connection.radiance;
                }
            }
            walks.retain(|walk| !walk.is_over);
            if walks.is_empty() {
                return;
            }
            depth += 1;
        }
    }

    /// What a camera ray meets, still black.
    fn unlit<G: Geometry>(&self, scene: &ShadingScene<'_, G>, ray: &Ray, hit: Option<&SceneHit>) -> Sample {
        Sample {
            radiance: DVec3::ZERO,
            alpha: self.alpha(scene, hit),
            first_hit: hit.map(|hit| first_hit(scene, ray, hit)),
        }
    }

    /// Whether paths may have that many segments.
    fn reaches(&self, depth: u32) -> bool {
        self.max_depth.is_none_or(|max| depth <= max)
    }

    /// Whether the picture is covered here, as Mitsuba's `path` has it: where a light surrounds
    /// the scene (unless hidden), where a light's shape or an object that is a light is seen, and where
    /// a surface is seen that the path is long enough to shade.
    fn alpha<G>(&self, scene: &ShadingScene<'_, G>, hit: Option<&SceneHit>) -> f64 {
        let covered = match hit {
            Some(SceneHit::Surface(_)) if self.reaches(2) => true,
            Some(SceneHit::Light(_)) => self.reaches(1),
            Some(SceneHit::Surface(surface)) if scene.lights.is_object_light(surface) => self.reaches(1),
            _ => self.reaches(1) && self.environment_covers && scene.lights.has_environment(),
        };
        f64::from(u8::from(covered))
    }
}

impl Walk {
    const fn new(sample: usize, PathStart { ray, sampler }: PathStart) -> Self {
        Self { sample, sampler, ray, throughput: DVec3::ONE, pdf: None, eta: 1.0, is_over: false }
    }

    /// What is emitted where the ray ends.
    fn emission<G>(&self, scene: &ShadingScene<'_, G>, hit: Option<&SceneHit>, see_lights: bool) -> DVec3 {
        match hit {
            None if see_lights => {
                let direction = self.ray.direction;
                let radiance = scene.lights.environment_radiance(direction);
                self.weighted(radiance, || scene.lights.environment_pdf(direction))
            }
            Some(SceneHit::Light(light)) => {
                let radiance = scene.lights.hit_radiance(&self.ray, light);
                self.weighted(radiance, || scene.lights.hit_pdf(&self.ray, light))
            }
            Some(SceneHit::Surface(surface)) => {
                let direction = self.ray.direction;
                let radiance = scene.lights.object_radiance(surface, direction);
                let distance = || surface.t * direction.length();
                self.weighted(radiance, || scene.lights.object_pdf(surface, direction, distance()))
            }
            None => DVec3::ZERO,
        }
    }

    /// Radiance met by following the walk, that the lights' sampling finds with `light_pdf`.
    fn weighted(&self, radiance: DVec3, light_pdf: impl Fn() -> f64) -> DVec3 {
        if radiance == DVec3::ZERO {
            return DVec3::ZERO;
        }
        let weight = self.pdf.map_or(1.0, |pdf| mis_weight(pdf, light_pdf()));
        weight * self.throughput * radiance
    }

    /// Samples a light, and draws the ray that goes on.
    fn scatter<G: Geometry>(
        &mut self,
        scene: &ShadingScene<'_, G>,
        surface: &SurfaceInteraction,
    ) -> Option<(Connection, Ray)> {
        let bsdf = scene.material(surface).bsdf(surface);
        let to_viewer = -self.ray.direction.normalize();
        let (choice, u) = (self.sampler.next_1d(), self.sampler.next_2d());
        let light =
            if bsdf.has_smooth_part() { scene.lights.sample(surface.position, choice, u) } else { None };
        let connection = light.and_then(|light| {
            let value = bsdf.eval(to_viewer, light.direction);
            if value.value == DVec3::ZERO {
                return None;
            }
            let ray = scene.shadow_ray(surface, &light)?;
            let weight = if light.is_delta { 1.0 } else { mis_weight(light.pdf, value.pdf) };
            let radiance = weight * self.throughput * value.value * light.weight;
            Some((Connection { sample: self.sample, radiance }, ray))
        });
        let (choice, u) = (self.sampler.next_1d(), self.sampler.next_2d());
        match bsdf.sample(to_viewer, choice, u) {
            Some(next) => {
                self.throughput *= next.weight;
                self.eta *= next.eta;
                self.pdf = (!next.is_delta).then_some(next.pdf);
                self.ray = spawn_ray(surface, next.to_light);
                self.is_over = self.throughput == DVec3::ZERO;
            }
            None => self.is_over = true,
        }
        connection
    }

    /// Russian roulette: goes on with probability min(max(throughput) eta², 0.95), made up for.
    fn survives(&mut self, lucky: f64) -> bool {
        let survival = (self.throughput.max_element() * self.eta * self.eta).min(MAX_SURVIVAL);
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
