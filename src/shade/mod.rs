//! Stage 5: cameras, lights, materials, samplers and integrators.

mod camera;
mod light;
mod material;
mod settings;

pub use camera::{CameraSettings, FovAxis};
pub use light::Light;
pub use material::Material;
pub use settings::{IntegratorKind, RenderSettings};
