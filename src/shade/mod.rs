//! Stage 5: cameras, lights, materials, samplers and integrators.

mod camera;
mod distribution;
pub mod light;
pub mod material;
mod parameters;
mod path;
mod sampler;
mod scene;
mod settings;
mod spawn;
mod statistics;
#[cfg(test)]
pub(crate) mod testing;
mod texture;
mod warp;

pub use camera::{Camera, CameraError, CameraSettings, FovAxis, Projection, ThinLens};
pub use light::{Light, LightError, LightHit, LightSample, LightSet};
pub use material::{
    DiffuseSource, Material, MaterialError, MicrofacetDistribution, ObjectMaterials, PreparedMaterial,
    PrincipledInterface, PrincipledSource,
};
pub use parameters::{Parameter, ParameterSource, Parameters, PictureSource, TextureRange};
pub use path::{PathBuffers, PathIntegrator, PathStart};
pub use sampler::{Sampler, SamplerKind};
pub use scene::{SceneBuffers, SceneHit, ShadingScene};
pub use settings::{IntegratorKind, RenderSettings};
pub use spawn::{spawn_ray, spawn_shadow_ray};
pub use statistics::RenderStatistics;
pub use texture::{BitmapSource, Checkerboard, TextureFilter, TextureSource, TextureWrap};
pub use warp::uniform_sphere;
