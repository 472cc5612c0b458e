//! Stage 4: rays against trimmed patches.

mod attributes;
mod batch;
mod box_tree;
mod brute_force;
mod bvh;
mod clipping;
mod coincident;
mod collapse;
mod geometry;
#[cfg(test)]
mod hard_cases;
mod height_graph;
mod interaction;
mod leaf;
mod leaf_test;
mod local;
mod net;
mod newton;
mod object;
mod overlaps;
mod packet;
mod polish;
mod projection;
mod query;
mod rational_net;
mod ray;
mod scene;
mod scratch;
mod search;
mod single_precision;
mod slabs;
mod statistics;
mod target;
mod tracer;

pub use attributes::{NoAttributes, VertexAttributes};
pub use batch::{HitArrays, Interrupted};
pub(crate) use box_tree::BoxTree;
pub use brute_force::closest_hit_by_subdivision;
pub use geometry::{Geometry, RayTracer};
pub use interaction::SurfaceInteraction;
pub use object::{PatchHit, TracedObject};
pub use ray::Ray;
pub use scene::TracedScene;
pub use statistics::{AccelerationStatistics, TraceStatistics};
pub(crate) use target::surface_error;
pub use tracer::Tracer;
