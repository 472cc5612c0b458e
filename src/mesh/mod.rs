//! Input geometry: polygon meshes from OBJ files, and the planar polygons that the next stage cuts.
//!
//! [`load_obj`] reads a file into a [`PolygonMesh`] (faces as the file has them), [`prepare_polygons`] places it
//! in the world and makes a [`PolygonSet`] of it: convex planar polygons, each with the face it comes from.
//! What was odd about the mesh stands in [`MeshNotes`]; what makes it unusable is an [`ObjError`].

mod notes;
mod obj;
mod obj_scan;
mod polygon_mesh;
mod polygon_set;
mod prepare;
mod triangulate;

pub use notes::MeshNotes;
pub use obj::{ObjError, load_obj};
pub use obj_scan::{FaultKind, IndexKind, ObjFault};
pub use polygon_mesh::{Corner, Face, MeshError, MeshParts, PolygonMesh};
pub use polygon_set::{Polygon, PolygonSet};
pub use prepare::{MeshTolerances, prepare_polygons};
