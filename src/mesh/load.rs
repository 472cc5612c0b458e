//! Mesh files of any format that is read.

use std::fs;
use std::path::Path;

use thiserror::Error;

use super::file_error::{MeshFaults, MeshFileError, Place, ReadError};
use super::format::Format;
use super::gltf::read_gltf;
use super::obj::{ObjError, parse_obj};
use super::ply::read_ply;
use super::stl::read_stl;
use super::{MeshNotes, PolygonMesh};
use crate::input::read_whole;
use crate::memory::{MemoryLimit, OutOfMemory};

/// Memory that reading an OBJ file takes at most, in sizes of the file: the text, and the numbers that it stands for.
const OBJ_FACTOR: u64 = 4;

/// Why a mesh file cannot be used. Each message but that of memory starts with the file's path.
#[derive(Debug, Error)]
pub enum LoadError {
    /// An OBJ file.
    #[error(transparent)]
    Obj(#[from] ObjError),
    /// A PLY, STL or glTF file.
    #[error(transparent)]
    File(#[from] MeshFileError),
    /// It would take too much memory.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
}

/// What is wrong in a mesh file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileFaults<'a> {
    /// The file.
    pub path: &'a Path,
    /// Line and column of each, from 1, if it has a place in text; and what is wrong.
    pub listed: Vec<(Option<[usize; 2]>, String)>,
}

impl LoadError {
    /// The faults at places of their own in the file; `None` if it is at fault as a whole.
    #[must_use]
    pub fn faults(&self) -> Option<FileFaults<'_>> {
        match self {
            Self::Obj(ObjError::Faults { path, faults, more }) => {
                let listed =
                    faults.iter().map(|fault| (Some([fault.line, fault.column]), fault.kind.to_string()));
                Some(FileFaults { path, listed: listed.chain(rest(*more)).collect() })
            }
            Self::File(MeshFileError { path, faults, more }) => {
                if let [fault] = faults.as_slice()
                    && fault.place == Place::File
                {
                    return None;
                }
                let listed = faults.iter().map(|fault| match fault.place {
                    Place::Line(place) => (Some(place), fault.kind.to_string()),
                    ref place => (None, format!("{place}{}", fault.kind)),
                });
                Some(FileFaults { path, listed: listed.chain(rest(*more)).collect() })
            }
            Self::Obj(_) | Self::Memory(_) => None,
        }
    }
}

fn rest(more: usize) -> Option<(Option<[usize; 2]>, String)> {
    (more > 0).then(|| (None, format!("and {more} more faults")))
}

/// Reads a mesh file of any format: OBJ, PLY, STL or glTF by its content or, where that does not tell, the ending of its name.
///
/// # Errors
/// See [`LoadError`]; all faults of a text file come at once.
pub fn load_mesh(path: impl AsRef<Path>) -> Result<(PolygonMesh, MeshNotes), LoadError> {
    load_mesh_within(path, MemoryLimit::NONE)
}

/// [`load_mesh`], with what it takes asked for before it is taken.
///
/// # Errors
/// As [`load_mesh`].
pub fn load_mesh_within(
    path: impl AsRef<Path>,
    memory: MemoryLimit,
) -> Result<(PolygonMesh, MeshNotes), LoadError> {
    let path = path.as_ref();
    let read_error = |source| ObjError::Read { path: path.to_owned(), source };
    let there = fs::metadata(path).map_err(read_error)?;
    if there.is_dir() {
        return Err(ObjError::Folder { path: path.to_owned() }.into());
    }
    let promise = memory.ask(format_args!("mesh {}", path.display()), there.len())?;
    let bytes = read_whole(path).map_err(read_error)?;
    drop(promise);
    let what = path.display().to_string();
    let read = match Format::of_file(path, &bytes) {
        Format::Obj => {
            let more = there.len().saturating_mul(OBJ_FACTOR - 1);
            let _promise = memory.ask(format_args!("mesh {what}"), more)?;
            return Ok(parse_obj(path, &bytes)?);
        }
        Format::Ply => read_ply(&bytes, memory, &what),
        Format::Stl => read_stl(&bytes, memory, &what),
        Format::Gltf => read_gltf(&bytes, path, memory),
    };
    // what is made of the pieces does not need the file
    drop(bytes);
    let of_file = |faults: MeshFaults| faults.of_file(path);
    let reading = read.map_err(|error| match error {
        ReadError::Faults(faults) => LoadError::from(of_file(faults)),
        ReadError::Memory(error) => error.into(),
    })?;
    Ok(reading.finish().map_err(of_file)?)
}

#[cfg(test)]
mod tests;
