//! OBJ files.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::{fmt, fs, io};

use thiserror::Error;

use super::obj_fault::ObjFault;
use super::obj_scan::scan;
use super::other_format::other_format;
use super::polygon_mesh::MeshError;
use crate::input::read_whole;

use super::{FileNotes, MeshNotes, PolygonMesh};

/// Why an OBJ file cannot be used. Each message starts with the file's path.
#[derive(Debug, Error)]
pub enum ObjError {
    /// The file cannot be opened or read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The path leads to a folder.
    #[error("{}: is a folder, an OBJ file is expected", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
    },
    /// The file is not text at all.
    #[error("{}:{line}:{column}: not text in UTF-8 ({found}); an OBJ file is plain text", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// Line of the first such byte, from 1.
        line: usize,
        /// Its column, from 1.
        column: usize,
        /// What it looks like instead.
        found: &'static str,
    },
    /// The file is of another format.
    #[error("{}: is {format}, not an OBJ file", path.display())]
    OtherFormat {
        /// The file.
        path: PathBuf,
        /// What it is, with its article.
        format: &'static str,
    },
    /// The file is empty, or only vertices, lines and points are in it.
    #[error("{}: has no faces ({positions} vertices); at least one `f` statement is needed", path.display())]
    NoFaces {
        /// The file.
        path: PathBuf,
        /// How many vertices it has.
        positions: usize,
    },
    /// Statements of the file are wrong.
    #[error("{}", FaultList { path, faults, more: *more })]
    Faults {
        /// The file.
        path: PathBuf,
        /// The first faults in the order of the file, at most 20.
        faults: Vec<ObjFault>,
        /// How many more there are.
        more: usize,
    },
    /// The mesh is too large for 32-bit indices.
    #[error("{}: {source}", path.display())]
    Mesh {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        source: MeshError,
    },
}

/// Faults as one message a line, each with path, line and column.
struct FaultList<'a> {
    path: &'a Path,
    faults: &'a [ObjFault],
    more: usize,
}

impl fmt::Display for FaultList<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, fault) in self.faults.iter().enumerate() {
            let separator = if i == 0 { "" } else { "\n" };
            write!(f, "{separator}{}:{fault}", self.path.display())?;
        }
        if self.more > 0 {
            write!(f, "\n{}: and {} more faults", self.path.display(), self.more)?;
        }
        Ok(())
    }
}

/// Reads an OBJ file: `v`, `vt`, `vn` and `f` in double precision, over all objects and groups.
///
/// Faces keep the order of their `f` statements and their corners; positions, texture coordinates and normals are those
/// that a face refers to, in the order of the first reference. Negative indices, faces of any number of corners, mixed
/// forms of corners, continued lines (`\`), lines that end with CR alone and comments right behind a word are understood.
/// A face's object is named by the last `o` or `g` before it.
///
/// What is not used cannot make a file illegal; it is counted in the notes: a fourth coordinate, colours, statements that
/// no face refers to, curves and surfaces, bytes that are not UTF-8. Corners whose texture coordinates or normals are not
/// there or not finite have none. Faces of one or two corners keep their number and have no area. The names of materials
/// are kept, smoothing groups left out.
///
/// # Errors
/// See [`ObjError`]; all faults of a file come at once.
pub fn load_obj(path: impl AsRef<Path>) -> Result<(PolygonMesh, MeshNotes), ObjError> {
    let path = path.as_ref();
    let read_error = |source| ObjError::Read { path: path.to_owned(), source };
    if fs::metadata(path).map_err(read_error)?.is_dir() {
        return Err(ObjError::Folder { path: path.to_owned() });
    }
    let bytes = read_whole(path).map_err(read_error)?;
    parse_obj(path, &bytes)
}

/// [`load_obj`] of a file's content; `path` is for messages only.
pub(super) fn parse_obj(path: &Path, bytes: &[u8]) -> Result<(PolygonMesh, MeshNotes), ObjError> {
    parse_text(path, bytes).map_err(|error| match other_format(bytes) {
        Some(format) => ObjError::OtherFormat { path: path.to_owned(), format },
        None => error,
    })
}

fn parse_text(path: &Path, bytes: &[u8]) -> Result<(PolygonMesh, MeshNotes), ObjError> {
    let (text, of_bytes) = text_of(path, bytes)?;
    let scan = scan(&text).map_err(|faults| ObjError::Faults {
        path: path.to_owned(),
        faults: faults.listed,
        more: faults.more,
    })?;
    if scan.parts.arities.is_empty() {
        return Err(ObjError::NoFaces { path: path.to_owned(), positions: scan.positions });
    }
    let mesh = PolygonMesh::try_new(scan.parts)
        .map_err(|source| ObjError::Mesh { path: path.to_owned(), source })?;
    let notes = MeshNotes {
        faces: mesh.face_count(),
        triangles: mesh.triangle_count(),
        positions: mesh.positions().len(),
        unused_positions: scan.positions - mesh.positions().len(),
        file: FileNotes {
            foreign_bytes: of_bytes.foreign_bytes,
            trailing_zeros: of_bytes.trailing_zeros,
            ..scan.notes
        },
        ..MeshNotes::default()
    };
    Ok((mesh, notes))
}

/// The bytes as text without byte order mark and without zeros at the end, or where they are no text.
fn text_of<'a>(path: &Path, bytes: &'a [u8]) -> Result<(Cow<'a, str>, FileNotes), ObjError> {
    let not_text = |before: &[u8], found| ObjError::NotText {
        path: path.to_owned(),
        line: before.iter().filter(|&&byte| byte == b'\n').count() + 1,
        column: String::from_utf8_lossy(before.rsplit(|&byte| byte == b'\n').next().unwrap_or_default())
            .chars()
            .count()
            + 1,
        found,
    };
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(not_text(&[], "it looks like UTF-16"));
    }
    let end = bytes.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
    let (text, zeros) = bytes.split_at(end);
    if let Some(zero) = text.iter().position(|&byte| byte == 0) {
        return Err(not_text(&text[..zero], "it looks like a binary file"));
    }
    let notes = FileNotes {
        foreign_bytes: text.utf8_chunks().map(|chunk| chunk.invalid().len()).sum(),
        trailing_zeros: zeros.len(),
        ..FileNotes::default()
    };
    let text = text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(text);
    Ok((String::from_utf8_lossy(text), notes))
}

#[cfg(test)]
mod tests;
