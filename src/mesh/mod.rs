//! Input geometry: polygon meshes from OBJ, PLY, STL and glTF files, and the planar polygons that the next stage cuts.
//!
//! [`load_mesh`] reads a file into a [`PolygonMesh`] (faces as the file has them), [`prepare_polygons`] places it
//! in the world and makes a [`PolygonSet`] of it: convex planar polygons, each with the face it comes from.
//! What was odd about the mesh stands in [`MeshNotes`]; what makes it unusable is a [`LoadError`].

mod file_error;
mod finish;
mod format;
mod gltf;
mod gltf_data;
mod gltf_fault;
mod gltf_json;
mod load;
mod material;
mod mend;
mod mtl;
mod notes;
mod obj;
mod obj_fault;
mod obj_scan;
mod obj_words;
mod other_format;
mod ply;
mod ply_fault;
mod ply_header;
mod ply_numbers;
mod point_tree;
mod polygon_mesh;
mod polygon_set;
mod prepare;
mod stl;
mod stl_fault;
mod triangulate;
mod turn;

pub use file_error::{MeshFault, MeshFaultKind, MeshFileError, Place};
pub use gltf_fault::GltfFault;
pub use load::{FileFaults, LoadError, load_mesh, load_mesh_within};
pub use material::MeshMaterial;
pub use mtl::{MtlMaterial, load_mtl};
pub use notes::{FileNotes, MeshNotes};
pub use obj::{ObjError, load_obj};
pub use obj_fault::{FaultKind, ObjFault};
pub use ply_fault::PlyFault;
pub use polygon_mesh::{Corner, Face, MeshError, MeshParts, PolygonMesh};
pub use polygon_set::{Polygon, PolygonSet};
pub use prepare::{MeshTolerances, prepare_polygons};
pub use stl_fault::StlFault;
