//! Stage 3: trimmed Bézier patches.

mod bezier_patch;
mod build;
mod compose;
mod evaluate;
mod exact;
mod facet;
mod interpolation;
mod triangular;
mod triangular_build;
mod trim;

pub(crate) use bezier_patch::Extent;
pub use bezier_patch::{BezierPatch, PatchPoint};
pub use build::{
    BuildError, BuildTimes, Deformation, DeformedPolygons, PlanarPolygon, TrimmedPatch, deform_polygons,
};
pub use compose::Composer;
pub(crate) use evaluate::{OrderWork, PointLanes};
pub use exact::{ExactSurface, Overlap};
pub use facet::Facet;
pub use interpolation::compose_by_interpolation;
pub use triangular::TriangularPatch;
pub use triangular_build::{DeformedTriangles, TriangularPiece, deform_triangles};
pub(crate) use trim::TrimBuilder;
pub use trim::{TrimLoop, TrimRegion};
