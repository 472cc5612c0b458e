//! Scene files: TOML to plain data, plain data to a scene ready to trace.

mod attributes;
mod bounds;
mod build;
mod deformed;
mod description;
mod diagnostic;
mod edits;
mod facets;
mod film_area;
mod lattice_file;
mod names;
mod parse;
mod pointwise;
mod reader;
mod self_intersection;
mod source;
mod surface_object;
mod transform;
mod triangular;
mod unavailable;

pub use build::{BuiltObject, BuiltScene, SceneTimes};
pub use deformed::BuiltLattice;
pub use description::{
    DeformDescription, DragDescription, DragSources, DragUsing, Edit, FfdDescription, LightDescription,
    Method, MoveTo, NamedMaterial, ObjectDescription, ObjectShape, Outside, SceneDescription,
};
pub use diagnostic::{Diagnostic, Located, Location, SceneError};
pub use edits::{DragOutcome, DragReport};
pub use film_area::{MAX_PIXELS, MAX_SIDE, parse_crop, parse_size, validate_crop, validate_film};
pub use names::Choice;
pub use parse::{MAX_CONTROL_POINTS, parse_scene, parse_scene_str};
pub use triangular::TriangularCounts;
