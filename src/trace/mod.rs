//! Stage 4: rays against trimmed patches.

mod brute_force;
mod bvh;
mod clipping;
#[cfg(test)]
mod hard_cases;
mod interaction;
mod leaf;
mod leaf_test;
mod local;
mod newton;
mod packet;
mod projection;
mod query;
mod ray;
mod scene;
mod search;
mod shape;
mod statistics;

pub use brute_force::closest_hit_by_subdivision;
pub use interaction::{Geometry, SurfaceInteraction};
pub use ray::Ray;
pub use scene::{NoUvs, PatchHit, TracedObject, TracedScene, UvLookup};
pub use statistics::{AccelerationStatistics, TraceStatistics};
