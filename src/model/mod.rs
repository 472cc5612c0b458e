//! Stage 5c: objects: a shape, placed, deformed and represented, ready to trace.
//!
//! An [`Object`] says what is to be made, [`Object::build`] makes it; nothing here needs a file. Scene files are one way to
//! describe objects, see the module `scene`.

mod attributes;
mod bounds;
mod deformation;
mod deformer;
mod error;
mod object;
mod representation;
mod self_intersection;
mod settings;

pub use crate::analytic::Borders;
pub use crate::math::magnitude::MagnitudeError;
pub use bounds::bounds_of;
pub(crate) use bounds::farthest_reach;
pub use deformer::{
    BuiltLattice, Deformer, DragEdit, DragOutcome, DragReport, DragSources, DragUsing, Edit, EditError,
    Lattice, MoveTo, Outside,
};
pub use error::{ModelError, PartsOutside};
pub use object::{Attributes, BuiltObject, FaceGroups, Object, ObjectReport, ObjectTimes, Shape};
pub use representation::{Representation, RepresentationError, TriangularCounts};
pub use settings::BuildSettings;
