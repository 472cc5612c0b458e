//! Stage 2: polygons cut at the knot planes, grouped by plane, each group in an affine frame.

mod coplanar;
mod cut;
mod frame;
mod triangular;
mod vertices;

pub(crate) use coplanar::{Group, group_coplanar};
pub(crate) use cut::{Pieces, cut_at_knot_planes};
pub use frame::{Frame, FrameChoice};
pub(crate) use frame::{FrameSettings, FramedPlane, frame_group};
pub(crate) use triangular::cut_into_triangles;
pub(crate) use vertices::{EdgePoint, Numbering, VertexNumbers};
