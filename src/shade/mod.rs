//! Stage 5: cameras, lights, materials, samplers and integrators.

mod bsdf;
mod camera;
mod distribution;
mod light;
mod material;
mod path;
mod prepared_material;
mod sampler;
mod scene;
mod settings;
mod spawn;
mod statistics;
#[cfg(test)]
pub(crate) mod testing;
mod texture;
mod warp;

pub use bsdf::{
    Bsdf, BsdfSample, BsdfValue, METAL_NAMES, MicrofacetDistribution, REFRACTIVE_INDICES, metal,
    refractive_index,
};
pub use camera::{Camera, CameraError, CameraSettings, FovAxis, Projection, ThinLens};
pub use light::{Light, LightEnd, LightError, LightHit, LightSample, LightSet, ShapeHit};
pub use material::{
    CoatSource, DEFAULT_ALPHA, GlassSource, Material, MetalSource, PrincipledInterface, PrincipledSource,
    Roughness,
};
pub use path::{PathBuffers, PathIntegrator, PathStart};
pub use prepared_material::{MaterialError, PreparedMaterial};
pub use sampler::{Sampler, SamplerKind};
pub use scene::{SceneBuffers, SceneHit, ShadingScene};
pub use settings::{IntegratorKind, RenderSettings};
pub use spawn::{spawn_ray, spawn_shadow_ray};
pub use statistics::RenderStatistics;
pub use texture::{BitmapSource, Checkerboard, TextureFilter, TextureSource, TextureWrap};
pub use warp::uniform_sphere;
