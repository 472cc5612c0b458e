//! Input geometry: polygon meshes from OBJ files, and the planar polygons that the next stage cuts.
//!
//! [`load_mesh`] reads a file into a [`PolygonMesh`] (faces as the file has them), [`prepare_polygons`] places it
//! in the world and makes a [`PolygonSet`] of it: convex planar polygons, each with the face it comes from.
//! What was odd about the mesh stands in [`MeshNotes`]; what makes it unusable is a [`LoadError`].

mod mend;
mod mtl;
mod notes;
mod obj;
mod obj_fault;
mod obj_scan;
mod obj_words;
mod other_format;
mod point_tree;
mod polygon_mesh;
mod polygon_set;
mod prepare;
mod triangulate;
mod turn;

use std::path::Path;

use thiserror::Error;

pub use mtl::{MtlMaterial, load_mtl};
pub use notes::{FileNotes, MeshNotes};
pub use obj::{ObjError, load_obj};
pub use obj_fault::{FaultKind, ObjFault};
pub use polygon_mesh::{Corner, Face, MeshError, MeshParts, PolygonMesh};
pub use polygon_set::{Polygon, PolygonSet};
pub use prepare::{MeshTolerances, prepare_polygons};

/// Reads a mesh from a file.
type Loader = fn(&Path) -> Result<(PolygonMesh, MeshNotes), LoadError>;

/// The formats of mesh files by the endings of their names; the first is that of names with any other ending.
const FORMATS: &[(&str, Loader)] = &[("obj", |path| Ok(load_obj(path)?))];

/// Why a mesh file cannot be used. Each message starts with the file's path.
#[derive(Debug, Error)]
pub enum LoadError {
    /// An OBJ file.
    #[error(transparent)]
    Obj(#[from] ObjError),
}

/// What is wrong in the text of a mesh file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileFaults<'a> {
    /// The file.
    pub path: &'a Path,
    /// Line and column of each, from 1, if it has a place; and what is wrong.
    pub listed: Vec<(Option<[usize; 2]>, String)>,
}

impl LoadError {
    /// The faults at places of their own in the file; `None` if it is at fault as a whole.
    #[must_use]
    pub fn faults(&self) -> Option<FileFaults<'_>> {
        match self {
            Self::Obj(error) => error.faults(),
        }
    }
}

/// Reads a mesh file, of the format that the ending of its name says.
///
/// # Errors
/// See [`LoadError`]; all faults of a text file come at once.
pub fn load_mesh(path: impl AsRef<Path>) -> Result<(PolygonMesh, MeshNotes), LoadError> {
    let path = path.as_ref();
    let ending = path.extension().unwrap_or_default();
    let (_, load) =
        FORMATS.iter().find(|(known, _)| ending.eq_ignore_ascii_case(known)).unwrap_or(&FORMATS[0]);
    load(path)
}
