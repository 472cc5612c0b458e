//! Stage 5b: objects: a shape, deformed and represented, ready to trace.

mod attributes;
mod bounds;
mod deformation;
mod deformer;
mod representation;
mod self_intersection;

pub(crate) use attributes::{CarriedNormals, PolygonAttributes, SurfaceObject, surface_object};
pub(crate) use bounds::farthest_reach;
pub use deformation::BuiltLattice;
pub(crate) use deformation::{Deformed, Deforming, Undeformed};
pub use deformer::{DragOutcome, DragReport};
pub use representation::TriangularCounts;
pub(crate) use representation::{MAX_LEVEL, deform_pointwise, facet_object};
pub(crate) use self_intersection::self_intersection;
