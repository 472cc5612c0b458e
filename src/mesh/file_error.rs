//! What can be wrong in a PLY, STL or glTF file, and where.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::gltf_fault::GltfFault;
use super::obj_fault::MOST_FAULTS;
use super::ply_fault::PlyFault;
use super::polygon_mesh::MeshError;
use super::stl_fault::StlFault;
use crate::memory::OutOfMemory;

/// Why a mesh file of a format other than OBJ cannot be used. Each line of the message starts with the file's path.
#[derive(Debug, Error)]
#[error("{}", FaultList(self))]
pub struct MeshFileError {
    /// The file.
    pub path: PathBuf,
    /// The first faults in the order of the file, at most 20.
    pub faults: Vec<MeshFault>,
    /// How many more there are.
    pub more: usize,
}

/// A fault of a mesh file and where it is.
#[derive(Debug)]
pub struct MeshFault {
    /// Where.
    pub place: Place,
    /// What is wrong.
    pub kind: MeshFaultKind,
}

/// Where in a mesh file something is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// It concerns all of it.
    File,
    /// In text: line, and column in bytes, both from 1.
    Line([usize; 2]),
    /// Bytes before it.
    Byte(usize),
    /// The face of this number, from 0.
    Face(usize),
    /// The vertex of this number, from 0.
    Vertex(usize),
    /// An element of a JSON file by its path, such as `accessors[3]`.
    Element(String),
}

/// What can be wrong with a mesh file.
#[derive(Debug, Error)]
pub enum MeshFaultKind {
    /// It cannot be opened or read.
    #[error("cannot be read: {0}")]
    Read(io::Error),
    /// There are no faces.
    #[error("has no faces ({positions} vertices); at least one is needed")]
    NoFaces {
        /// How many vertices it has.
        positions: usize,
    },
    /// A corner's vertex is not there.
    #[error("vertex index {index} is out of range; {}", valid_range(*count))]
    OutOfRange {
        /// The index as the file has it.
        index: i64,
        /// How many vertices there are.
        count: usize,
    },
    /// A vertex of a face has no place.
    #[error("a coordinate is not a finite number")]
    NotFinite,
    /// The pieces make no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Of PLY files.
    #[error(transparent)]
    Ply(#[from] PlyFault),
    /// Of STL files.
    #[error(transparent)]
    Stl(#[from] StlFault),
    /// Of glTF files.
    #[error(transparent)]
    Gltf(#[from] GltfFault),
}

fn valid_range(count: usize) -> String {
    match count {
        0 => "there is no vertex".to_owned(),
        1 => "the only one is 0".to_owned(),
        _ => format!("valid are 0 to {}", count - 1),
    }
}

impl fmt::Display for Place {
    /// With what separates it from the message, after the path and a colon.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line([line, column]) => write!(f, "{line}:{column}: "),
            Self::Byte(byte) => write!(f, "byte {byte}: "),
            Self::Face(face) => write!(f, "face {face}: "),
            Self::Vertex(vertex) => write!(f, "vertex {vertex}: "),
            Self::Element(path) => write!(f, "{path}: "),
        }
    }
}

struct FaultList<'a>(&'a MeshFileError);

impl fmt::Display for FaultList<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let MeshFileError { path, faults, more } = self.0;
        for (i, MeshFault { place, kind }) in faults.iter().enumerate() {
            let (line_break, separator) =
                (if i == 0 { "" } else { "\n" }, if matches!(place, Place::Line(_)) { "" } else { " " });
            write!(f, "{line_break}{}:{separator}{place}{kind}", path.display())?;
        }
        if *more > 0 {
            write!(f, "\n{}: and {more} more faults", path.display())?;
        }
        Ok(())
    }
}

/// Why bytes were not read.
#[derive(Debug)]
pub(super) enum ReadError {
    Faults(MeshFaults),
    Memory(OutOfMemory),
}

impl From<MeshFaults> for ReadError {
    fn from(faults: MeshFaults) -> Self {
        Self::Faults(faults)
    }
}

/// The faults found so far: the first few, and how many more there are.
#[derive(Debug, Default)]
pub(super) struct MeshFaults {
    listed: Vec<MeshFault>,
    more: usize,
}

impl MeshFaults {
    /// Adds a fault.
    pub(super) fn push(&mut self, place: Place, kind: impl Into<MeshFaultKind>) {
        if self.listed.len() < MOST_FAULTS {
            self.listed.push(MeshFault { place, kind: kind.into() });
        } else {
            self.more += 1;
        }
    }

    /// Adds those of another part of the file.
    pub(super) fn append(&mut self, mut other: Self) {
        self.listed.append(&mut other.listed);
        self.more += other.more + self.listed.len().saturating_sub(MOST_FAULTS);
        self.listed.truncate(MOST_FAULTS);
    }

    /// Whether another one would be listed.
    pub(super) fn has_room(&self) -> bool {
        self.listed.len() < MOST_FAULTS
    }

    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.listed.is_empty()
    }

    /// Those of a file.
    pub(super) fn of_file(self, path: &Path) -> MeshFileError {
        MeshFileError { path: path.to_owned(), faults: self.listed, more: self.more }
    }
}
