//! Deformers, each in a file of its own.

mod lattice;

pub use lattice::{DragOutcome, DragReport};
pub(super) use lattice::{EditedLattice, edited_lattice};
