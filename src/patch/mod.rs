//! Stage 3: trimmed Bézier patches.

mod bezier_patch;
mod build;
mod chart;
mod compose;
mod curve;
mod evaluate;
mod exact;
mod face;
mod face_bounds;
mod facet;
mod interpolation;
mod region;
mod sheets;
mod shell;
mod topology;
mod triangular;
mod triangular_build;

pub(crate) use bezier_patch::Extent;
pub use bezier_patch::{BezierPatch, PatchPoint};
pub(crate) use build::deform_polygons_within;
pub use build::{BuildError, BuildTimes, Deformation, DeformedPolygons, PlanarPolygon, deform_polygons};
pub use chart::{Chart, ParameterFrame, Place};
pub use compose::Composer;
pub use curve::BezierCurve;
pub(crate) use evaluate::{OrderWork, PointLanes};
pub use exact::{ExactSurface, Overlap};
pub use face::Face;
pub use face_bounds::{BoundUse, Component, FaceBounds, Joint, OrientedEdge, components};
pub use facet::Facet;
pub use interpolation::compose_by_interpolation;
pub(crate) use region::{LineCuts, LoopCorner, LoopPosition, RegionBuilder, has_area};
pub use region::{Region, TrimLoop};
pub use sheets::Sheets;
pub use shell::Shell;

pub use topology::{Corner, Edge, EdgeUse, Outline, Topology};
pub use triangular::TriangularPatch;
pub use triangular_build::{DeformedTriangles, TriangularPiece, deform_triangles};
