//! Stage 5: cameras, lights, materials, samplers and integrators.

mod bsdf;
mod camera;
mod distribution;
mod light;
mod material;
mod path;
mod sampler;
mod scene;
mod settings;
mod spawn;
mod statistics;
#[cfg(test)]
pub(crate) mod testing;
mod warp;

pub use bsdf::{Bsdf, BsdfSample, BsdfValue};
pub use camera::{Camera, CameraError, CameraSettings, FovAxis, Projection, ThinLens};
pub use light::{Light, LightEnd, LightError, LightHit, LightSample, LightSet, ShapeHit};
pub use material::Material;
pub use path::{PathBuffers, PathIntegrator, PathStart};
pub use sampler::{Sampler, SamplerKind};
pub use scene::{SceneBuffers, SceneHit, ShadingScene};
pub use settings::{IntegratorKind, RenderSettings};
pub use spawn::{spawn_ray, spawn_shadow_ray};
pub use statistics::RenderStatistics;
pub use warp::uniform_sphere;
