//! Stage 1: knot vectors and the B-spline volume.

mod axis;
mod injectivity;
mod knot_vector;
mod lattice;
mod volume;

pub use axis::{Axis, SignedAxis};
pub use injectivity::{Orientation, orientation, orientations};
pub(crate) use knot_vector::{BernsteinRows, MAX_VOLUME_ORDER, polar_form};
pub use knot_vector::{KnotError, KnotVector, MAX_VOLUME_DEGREE};
pub use lattice::{ControlLattice, HeldPoint};
pub use volume::{KnotBox, KnotLayout, SplineVolume, VolumeError, VolumePoint};
