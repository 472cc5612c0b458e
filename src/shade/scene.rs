//! The scene as the integrator sees it: surfaces, their materials, and lights.

use super::light::{LightHit, LightSample, LightSet};
use super::prepared_material::PreparedMaterial;
use super::spawn::{BOUNDS_AWAY, spawn_shadow_ray};
use super::statistics::RenderStatistics;
use crate::trace::{Geometry, Ray, SurfaceInteraction};

/// Everything that light meets.
#[derive(Debug)]
pub struct ShadingScene<'a, G> {
    /// The surfaces.
    pub geometry: &'a G,
    /// The material of each object, by the object's index.
    pub object_materials: &'a [PreparedMaterial],
    /// The lights.
    pub lights: &'a LightSet,
}

/// What a ray meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SceneHit {
    /// An object.
    Surface(SurfaceInteraction),
    /// The shape of a light: black, but for the radiance that it emits.
    Light(LightHit),
}

impl<G: Geometry> ShadingScene<'_, G> {
    /// The nearest hit. A light that lies on a surface is in front of it, up to the error bounds
    /// of both, just as shadow rays have it.
    pub fn closest_hit(&self, ray: &Ray, statistics: &mut RenderStatistics) -> Option<SceneHit> {
        let light = self.lights.closest_hit(ray);
        let surface = self.surface_hit(ray, statistics);
        match (surface, light) {
            (Some(surface), Some(light)) if !is_in_front(ray, &light, &surface) => {
                Some(SceneHit::Surface(surface))
            }
            (_, Some(light)) => Some(SceneHit::Light(light)),
            (surface, None) => surface.map(SceneHit::Surface),
        }
    }

    /// The nearest hit with an object, through the shapes of lights.
    pub fn surface_hit(&self, ray: &Ray, statistics: &mut RenderStatistics) -> Option<SurfaceInteraction> {
        statistics.rays += 1;
        self.geometry.closest_hit(ray)
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
        let target = light.end.and_then(|end| end.rectangle);
        !self.lights.blocks(&ray, target) && !self.geometry.any_hit(&ray)
    }

    /// The material of the surface hit.
    ///
    /// # Panics
    /// If the object has no material: `object_materials` must have one for each object.
    pub fn material(&self, hit: &SurfaceInteraction) -> &PreparedMaterial {
        &self.object_materials[hit.object as usize]
    }
}

/// Whether the light is nearer than the surface, or as near up to their error bounds.
fn is_in_front(ray: &Ray, light: &LightHit, surface: &SurfaceInteraction) -> bool {
    let bounds = light.hit.position_error + surface.position_error;
    let margin = BOUNDS_AWAY * bounds / ray.direction.dot(light.hit.normal).abs();
    light.hit.t - margin <= surface.t
}
