//! Stage 3: trimmed Bézier patches.

mod bezier_patch;
mod build;
mod compose;
mod evaluate;
mod interpolation;
mod trim;

pub use bezier_patch::{BezierPatch, PatchPoint};
pub use build::{
    BuildError, BuildTimes, Deformation, DeformedPolygons, PlanarPolygon, TrimmedPatch, deform_polygons,
};
pub use compose::Composer;
pub(crate) use evaluate::{OrderWork, PointLanes};
pub use interpolation::compose_by_interpolation;
pub use trim::{TrimLoop, TrimRegion};
