//! Stage 5: cameras, lights, materials, samplers and integrators.

mod camera;
mod light;
mod material;
mod sampler;
mod settings;
mod warp;

pub use camera::{CameraError, CameraSettings, FovAxis, PerspectiveCamera};
pub use light::Light;
pub use material::{BsdfSample, BsdfValue, Material};
pub use sampler::Sampler;
pub use settings::{IntegratorKind, RenderSettings};
