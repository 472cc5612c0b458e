//! Beside the pipeline: the exact result in files of other programs.

mod json;

pub use json::{exact_patches, to_json};
