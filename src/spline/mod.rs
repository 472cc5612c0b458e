//! Stage 1: knot vectors and the B-spline volume.

mod knot_vector;
mod volume;

pub use knot_vector::{KnotError, KnotVector, MAX_VOLUME_DEGREE};
pub use volume::{Cell, SplineVolume, VolumeError, VolumePoint};
