//! OBJ files.

use std::path::{Path, PathBuf};
use std::{fmt, fs, io};

use glam::{DVec2, DVec3};
use thiserror::Error;

use super::obj_scan::{ObjFault, Scan, scan};
use super::polygon_mesh::{Corner, MeshError, MeshParts};
use super::{FileFaults, MeshNotes, PolygonMesh};

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
    /// The file has bytes that are not text.
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
    /// The loader does not agree with the check before it; this is a bug of trimray.
    #[error("{}: the loader disagrees with the check before it: {what}", path.display())]
    Loader {
        /// The file.
        path: PathBuf,
        /// Where they differ.
        what: String,
    },
}

impl ObjError {
    /// See [`LoadError::faults`](super::LoadError::faults).
    pub(super) fn faults(&self) -> Option<FileFaults<'_>> {
        let Self::Faults { path, faults, more } = self else { return None };
        let listed = faults.iter().map(|fault| (Some([fault.line, fault.column]), fault.kind.to_string()));
        let rest = (*more > 0).then(|| (None, format!("and {more} more faults")));
        Some(FileFaults { path, listed: listed.chain(rest).collect() })
    }
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
/// forms of corners, continued lines (`\`), a fourth coordinate (it divides the others) and vertex colours (not used) are
/// understood; materials, smoothing groups, curves and surfaces are left out, the last two counted in the notes.
/// A face's object is named by the last `o` or `g` before it.
///
/// # Errors
/// See [`ObjError`]; all faults of a file come at once.
pub fn load_obj(path: impl AsRef<Path>) -> Result<(PolygonMesh, MeshNotes), ObjError> {
    let path = path.as_ref();
    let read_error = |source| ObjError::Read { path: path.to_owned(), source };
    if fs::metadata(path).map_err(read_error)?.is_dir() {
        return Err(ObjError::Folder { path: path.to_owned() });
    }
    let bytes = fs::read(path).map_err(read_error)?;
    parse_obj(path, &bytes)
}

/// [`load_obj`] of a file's content; `path` is for messages only.
fn parse_obj(path: &Path, bytes: &[u8]) -> Result<(PolygonMesh, MeshNotes), ObjError> {
    let text = text_of(path, bytes)?;
    let scan = scan(text).map_err(|faults| ObjError::Faults {
        path: path.to_owned(),
        faults: faults.listed,
        more: faults.more,
    })?;
    if scan.arities.is_empty() {
        return Err(ObjError::NoFaces { path: path.to_owned(), positions: scan.positions });
    }
    let loaded = load_plain(&scan).map_err(|what| ObjError::Loader { path: path.to_owned(), what })?;
    let mut notes = scan.notes;
    let parts = parts_of(loaded, scan.arities, scan.face_objects, scan.object_names);
    let mesh =
        PolygonMesh::try_new(parts).map_err(|source| ObjError::Mesh { path: path.to_owned(), source })?;
    notes.faces = mesh.face_count();
    notes.triangles = mesh.triangle_count();
    notes.positions = mesh.positions().len();
    notes.unused_positions = scan.positions - mesh.positions().len();
    Ok((mesh, notes))
}

/// The bytes as text without byte order mark, or where they stop being text.
fn text_of<'a>(path: &Path, bytes: &'a [u8]) -> Result<&'a str, ObjError> {
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
    if let Some(zero) = bytes.iter().position(|&byte| byte == 0) {
        return Err(not_text(&bytes[..zero], "it looks like a binary file"));
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.strip_prefix('\u{feff}').unwrap_or(text)),
        Err(error) => Err(not_text(&bytes[..error.valid_up_to()], "a byte that is not UTF-8")),
    }
}

/// Loads the rewritten file and checks the loader's result against the scan.
fn load_plain(scan: &Scan) -> Result<tobj::Mesh, String> {
    let options =
        tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..tobj::LoadOptions::default() };
    // never called: the rewritten file names no materials
    let no_materials = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut scan.text.as_bytes(), &options, no_materials)
        .map_err(|error| error.to_string())?;
    let [model] =
        <[tobj::Model; 1]>::try_from(models).map_err(|models| format!("{} models", models.len()))?;
    let mesh = model.mesh;
    // the loader leaves the arities out where all faces are triangles
    let same = if mesh.face_arities.is_empty() {
        scan.arities.iter().all(|&arity| arity == 3) && mesh.indices.len() == 3 * scan.arities.len()
    } else {
        mesh.face_arities == scan.arities
    };
    let corners = mesh.indices.len();
    if !same || mesh.texcoord_indices.len() != corners || mesh.normal_indices.len() != corners {
        return Err(format!("{} faces, {corners} corners in all", mesh.face_arities.len()));
    }
    Ok(mesh)
}

/// The loader's arrays as pieces of a mesh; the NaN entry becomes "none".
fn parts_of(
    loaded: tobj::Mesh,
    arities: Vec<u32>,
    face_objects: Vec<u32>,
    object_names: Vec<String>,
) -> MeshParts {
    let triples = |flat: &[f64]| -> Vec<DVec3> { flat.chunks_exact(3).map(DVec3::from_slice).collect() };
    let mut uvs: Vec<_> = loaded.texcoords.chunks_exact(2).map(DVec2::from_slice).collect();
    let mut normals = triples(&loaded.normals);
    let no_uv = take_out(&mut uvs, |uv| uv.is_nan());
    let no_normal = take_out(&mut normals, |normal| normal.is_nan());
    let corners = (loaded.indices.iter())
        .zip(loaded.texcoord_indices.iter().zip(&loaded.normal_indices))
        .map(|(&position, (&uv, &normal))| Corner {
            position,
            uv: without(uv, no_uv),
            normal: without(normal, no_normal),
        })
        .collect();
    MeshParts {
        positions: triples(&loaded.positions),
        uvs,
        normals,
        corners,
        arities,
        face_objects,
        object_names,
    }
}

/// Removes the first item of a kind and says where it was.
fn take_out<T>(items: &mut Vec<T>, is_it: impl Fn(&T) -> bool) -> Option<usize> {
    let found = items.iter().position(is_it)?;
    items.remove(found);
    Some(found)
}

/// `index` after the item at `removed` was taken out; `None` if it was that one.
fn without(index: u32, removed: Option<usize>) -> Option<u32> {
    match removed {
        Some(removed) if index as usize == removed => None,
        Some(removed) if index as usize > removed => Some(index - 1),
        _ => Some(index),
    }
}

#[cfg(test)]
mod tests;
