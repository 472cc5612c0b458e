//! Beside the pipeline: the exact result, or triangles close to it, in files of other programs.

mod folder;
mod json;
mod meshes;
mod mitsuba;
mod mitsuba_parameters;
mod step;
pub(crate) mod xml;

pub use folder::ExportedFile;
pub use json::{exact_patches, to_json, write_exact_patches};
pub use meshes::{NamedMesh, Precision, obj, ply};
pub use mitsuba::{MITSUBA_NAMES, MITSUBA_SCENE, is_exported, mitsuba_scene};
pub use step::{LengthUnit, MAX_STEP_DEGREE, Schema, StepError, StepObject, StepReport, StepSettings, step};
