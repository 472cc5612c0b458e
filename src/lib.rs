//! Ray tracing of exactly deformed shapes.

pub mod arrays;
pub mod cli;
pub mod export;
pub mod film;
mod math;
pub mod mesh;
pub mod output;
pub mod patch;
pub mod render;
pub mod scene;
pub mod shade;
pub mod spline;
pub mod subdivide;
#[cfg(test)]
mod test_support;
pub mod trace;
