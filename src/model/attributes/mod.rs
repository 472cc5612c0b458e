//! What is looked up at a hit on an object.

mod polygons;
mod surface;

pub(crate) use polygons::{CarriedNormals, PolygonAttributes};
pub(super) use surface::plane_corners;
pub(crate) use surface::{SurfaceObject, surface_object};
