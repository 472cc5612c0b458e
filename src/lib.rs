//! Ray tracing of exactly deformed shapes.

mod film;
mod mesh;
mod scene;
mod shade;
mod trace;
mod render;
