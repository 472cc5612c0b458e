//! What deforms an object, each kind in a file of its own: lattices here, maps in [`analytic`](crate::analytic).

mod edit;
mod lattice;

pub use edit::{DragEdit, DragOutcome, DragReport, DragSources, DragUsing, Edit, EditError, MoveTo};
pub use lattice::{BuiltLattice, Lattice, Outside};

use crate::analytic::{Extension, Step};

/// One deformation of an object.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "an object has a few")]
pub enum Deformer {
    /// A control lattice with edits, around the object as the deformers before leave it.
    Lattice(Lattice),
    /// A map that does not depend on the object.
    Map(Step),
}

impl Deformer {
    /// The lattice, if it is one.
    #[must_use]
    pub const fn lattice(&self) -> Option<&Lattice> {
        match self {
            Self::Lattice(lattice) => Some(lattice),
            Self::Map(_) => None,
        }
    }

    /// The map, if it is one.
    #[must_use]
    pub const fn map(&self) -> Option<&Step> {
        match self {
            Self::Lattice(_) => None,
            Self::Map(map) => Some(map),
        }
    }
}

impl From<Lattice> for Deformer {
    fn from(lattice: Lattice) -> Self {
        Self::Lattice(lattice)
    }
}

impl From<Extension> for Deformer {
    fn from(extension: Extension) -> Self {
        Self::Map(Step::Extension(extension))
    }
}
