//! Ray tracing of exactly deformed shapes.

pub mod film;
pub mod mesh;
pub mod render;
pub mod scene;
pub mod shade;
pub mod trace;
