//! Stage 4: rays against trimmed patches.

mod box_tree;
mod brute_force;
mod bvh;
mod clipping;
mod collapse;
#[cfg(test)]
mod hard_cases;
mod interaction;
mod leaf;
mod leaf_test;
mod local;
mod net;
mod newton;
mod packet;
mod polish;
mod projection;
mod query;
mod rational_net;
mod ray;
mod scene;
mod search;
mod shape;
mod slabs;
mod statistics;
mod target;

pub(crate) use box_tree::BoxTree;
pub use brute_force::closest_hit_by_subdivision;
pub use interaction::{Geometry, SurfaceInteraction};
pub use ray::Ray;
pub use scene::{NoAttributes, PatchHit, TracedObject, TracedScene, VertexAttributes};
pub use statistics::{AccelerationStatistics, TraceStatistics};
pub(crate) use target::surface_error;
