//! Scene files: TOML to plain data, plain data to a scene ready to trace.

mod build;
mod description;
mod diagnostic;
mod face_materials;
mod film_area;
mod first_view;
mod lattice_file;
mod object;
mod parse;
mod reader;
mod source;
mod transform;
mod unavailable;

pub use crate::choice::Choice;
pub use build::{BuiltScene, SceneTimes};
pub use description::{
    Block, DeformDescription, DragPlaces, EditDescription, NamedMaterial, ObjectDescription, ObjectShape,
    SceneDescription,
};
pub use diagnostic::{Diagnostic, Located, Location, SceneError};
pub use film_area::{
    FilmAreaError, MAX_PIXELS, MAX_SIDE, parse_crop, parse_size, validate_crop, validate_film,
};
pub use parse::{MAX_CONTROL_POINTS, parse_scene, parse_scene_str};
