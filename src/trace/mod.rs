//! Stage 4: rays against trimmed patches.

mod interaction;
mod ray;

pub use interaction::{Geometry, SurfaceInteraction};
pub use ray::Ray;
