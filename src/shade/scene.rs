//! The scene as the integrator sees it: surfaces, their materials, and lights.

use glam::DVec3;

use super::light::{LightHit, LightSample, LightSet};
use super::material::Material;
use super::spawn::{BOUNDS_AWAY, spawn_shadow_ray};
use super::statistics::RenderStatistics;
use crate::trace::{Geometry, Ray, SurfaceInteraction};

/// Everything that light meets.
#[derive(Debug)]
pub struct ShadingScene<'a, G> {
    /// The surfaces.
    pub geometry: &'a G,
    /// The material of each object, by the object's index.
    pub object_materials: &'a [Material],
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

impl<G: Geometry> ShadingScene<'_, G> {
    /// The nearest hit. A light that lies on a surface is in front of it, up to the error bounds
    /// of both, just as shadow rays have it.
    pub fn closest_hit(&self, ray: &Ray, statistics: &mut RenderStatistics) -> Option<SceneHit> {
        statistics.rays += 1;
        let light = self.lights.closest_hit(ray);
        let surface = self.geometry.closest_hit(ray);
        match (surface, light) {
            (Some(surface), Some(light)) if !is_in_front(ray, &light, &surface) => {
                Some(SceneHit::Surface(surface))
            }
            (_, Some(light)) => Some(SceneHit::Light(light)),
            (surface, None) => surface.map(SceneHit::Surface),
        }
    }

    /// The nearest hit with an object that is no light, through the shapes of lights and the objects
    /// that are.
    pub fn surface_hit(&self, ray: &Ray, statistics: &mut RenderStatistics) -> Option<SurfaceInteraction> {
        statistics.rays += 1;
        let mut ray = *ray;
        loop {
            let hit = self.geometry.closest_hit(&ray)?;
            if !self.lights.is_object_light(hit.object) {
                return Some(hit);
            }
            let past = hit.t + margin(&ray, hit.normal, hit.position_error);
            ray.t_min = past.max(hit.t.next_up());
        }
    }

    /// Whether nothing is between the surface and the light's sample.
    pub fn is_lit(
        &self,
        from: &SurfaceInteraction,
        light: &LightSample,
        statistics: &mut RenderStatistics,
    ) -> bool {
        statistics.shadow_rays += 1;
        let ray = spawn_shadow_ray(from, light);
        let target = light.end.and_then(|end| end.light);
        !self.lights.blocks(&ray, target) && !self.geometry.any_hit(&ray)
    }

    /// The material of the surface hit.
    ///
    /// # Panics
    /// If the object has no material: `object_materials` must have one for each object.
    pub fn material(&self, hit: &SurfaceInteraction) -> &Material {
        &self.object_materials[hit.object as usize]
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
