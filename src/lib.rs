//! Ray tracing of exactly deformed shapes.

mod film;
pub mod mesh;
mod scene;
mod shade;
mod trace;
mod render;
