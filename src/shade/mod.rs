//! Stage 5: cameras, lights, materials, samplers and integrators.

mod bsdf;
mod camera;
mod light;
mod material;
mod path;
mod prepared_material;
mod rectangle;
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
pub use camera::{CameraError, CameraSettings, FovAxis, PerspectiveCamera};
pub use light::{Light, LightEnd, LightError, LightHit, LightSample, LightSet};
pub use material::{
    CoatSource, DEFAULT_ALPHA, GlassSource, Material, MetalSource, PrincipledInterface, PrincipledSource,
    Roughness,
};
pub use path::PathIntegrator;
pub use prepared_material::{MaterialError, PreparedMaterial};
pub use rectangle::{Rectangle, RectangleHit};
pub use sampler::Sampler;
pub use scene::{SceneHit, ShadingScene};
pub use settings::{IntegratorKind, RenderSettings};
pub use spawn::{spawn_ray, spawn_shadow_ray};
pub use statistics::RenderStatistics;
pub use texture::{BitmapSource, Checkerboard, TextureFilter, TextureSource, TextureWrap};
pub use warp::uniform_sphere;
