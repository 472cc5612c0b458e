//! Ray tracing of exactly deformed shapes.

mod film;
mod math;
mod mesh;
mod patch;
mod render;
mod scene;
mod shade;
pub mod spline;
mod subdivide;
mod trace;
