//! The scene as the integrator sees it: surfaces, their materials, and lights.

use glam::DVec3;

use super::light::{LightHit, LightSample, LightSet};
use super::material::{ObjectMaterials, PreparedMaterial};
use super::spawn::{BOUNDS_AWAY, spawn_shadow_ray};
use super::statistics::RenderStatistics;
use crate::trace::{Geometry, Ray, RayTracer, SurfaceInteraction, TraceStatistics};

/// Everything that light meets.
#[derive(Debug)]
pub struct ShadingScene<'a, G> {
    /// The surfaces.
    pub geometry: &'a G,
    /// The materials of each object, by the object's index.
    pub object_materials: &'a [ObjectMaterials],
    /// The lights.
    pub lights: &'a LightSet,
}

/// What a ray meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SceneHit {
    /// An object, which may be a light as well.
    Surface(SurfaceInteraction),
    /// The shape of a light: black, but for the radiance that it emits.
    Light(LightHit),
}

/// One thread's tracer of the surfaces, and what is kept from one group of rays to the next.
#[derive(Debug)]
pub struct SceneBuffers<T> {
    tracer: T,
    surfaces: Vec<Option<SurfaceInteraction>>,
}

impl<T: RayTracer> SceneBuffers<T> {
    /// Buffers for one thread, with a tracer of the scene's geometry.
    pub const fn new(tracer: T) -> Self {
        Self { tracer, surfaces: Vec::new() }
    }

    /// What the tracer has counted since this was last called.
    pub fn take_statistics(&mut self) -> TraceStatistics {
        self.tracer.take_statistics()
    }
}

impl<G: Geometry> ShadingScene<'_, G> {
    /// The nearest hit of each ray, in place of what `hits` held; through the shapes of lights and the objects that are
    /// lights unless they are seen.
    ///
    /// A light that lies on a surface is in front of it, up to the error bounds of both, just as shadow rays have it.
    pub fn closest_hits(
        &self,
        rays: &[Ray],
        see_lights: bool,
        (buffers, statistics): (&mut SceneBuffers<G::Tracer<'_>>, &mut RenderStatistics),
        hits: &mut Vec<Option<SceneHit>>,
    ) {
        statistics.rays += rays.len() as u64;
        let SceneBuffers { tracer, surfaces } = buffers;
        tracer.closest_hits(rays, surfaces);
        hits.clear();
        hits.extend(rays.iter().zip(surfaces.drain(..)).map(|(ray, surface)| {
            if !see_lights {
                return self.past_lights(tracer, ray, surface).map(SceneHit::Surface);
            }
            match (surface, self.lights.closest_hit(ray)) {
                (Some(surface), Some(light)) if !is_in_front(ray, &light, &surface) => {
                    Some(SceneHit::Surface(surface))
                }
                (_, Some(light)) => Some(SceneHit::Light(light)),
                (surface, None) => surface.map(SceneHit::Surface),
            }
        }));
    }

    /// The nearest hit with an object that is no light, from `hit` on.
    fn past_lights(
        &self,
        tracer: &mut impl RayTracer,
        ray: &Ray,
        mut hit: Option<SurfaceInteraction>,
    ) -> Option<SurfaceInteraction> {
        let mut ray = *ray;
        while let Some(light) = hit.filter(|hit| self.lights.is_object_light(hit)) {
            let past = light.t + margin(&ray, light.normal, light.position_error);
            ray.t_min = past.max(light.t.next_up());
            hit = tracer.closest_hit(&ray);
        }
        hit
    }

    /// The ray from a surface to a light's sample; `None` if the shape of another light is in the way.
    #[must_use]
    pub fn shadow_ray(&self, from: &SurfaceInteraction, light: &LightSample) -> Option<Ray> {
        let ray = spawn_shadow_ray(from, light);
        let target = light.end.and_then(|end| end.light);
        (!self.lights.blocks(&ray, target)).then_some(ray)
    }

    /// Whether an object is in the way of each shadow ray, in place of what `blocked` held.
    pub fn blocked(
        &self,
        rays: &[Ray],
        (buffers, statistics): (&mut SceneBuffers<G::Tracer<'_>>, &mut RenderStatistics),
        blocked: &mut Vec<bool>,
    ) {
        statistics.shadow_rays += rays.len() as u64;
        buffers.tracer.any_hits(rays, blocked);
    }

    /// The material of the surface hit.
    ///
    /// # Panics
    /// If the object has no material: `object_materials` must have some for each object.
    #[must_use]
    pub fn material(&self, hit: &SurfaceInteraction) -> &PreparedMaterial {
        self.object_materials[hit.object as usize].at(hit.face)
    }
}

/// Whether the light is nearer than the surface, or as near up to their error bounds.
fn is_in_front(ray: &Ray, light: &LightHit, surface: &SurfaceInteraction) -> bool {
    let bounds = light.hit.position_error + surface.position_error;
    light.hit.t - margin(ray, light.hit.normal, bounds) <= surface.t
}

/// How far along the ray error bounds of a hit may reach.
///
/// A shift along the normal moves the crossing by the shift over the cosine; a curved surface, to which
/// the ray is tangent, ends before the cosine is lost in rounding.
fn margin(ray: &Ray, normal: DVec3, bounds: f64) -> f64 {
    let length = ray.direction.length();
    let cos = (ray.direction.dot(normal).abs() / length).max(f64::EPSILON.sqrt());
    BOUNDS_AWAY * bounds / (cos * length)
}
