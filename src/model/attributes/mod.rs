//! What is looked up at a hit on an object.

mod polygons;
mod surface;

pub(super) use polygons::{CarriedNormals, PolygonAttributes};
pub(super) use surface::{SurfaceAttributes, placed_shell, plane_corners};
