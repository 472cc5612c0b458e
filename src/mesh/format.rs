//! Formats of mesh files, told by their content, then by the ending of the name.

use std::path::Path;

use super::other_format::other_format;
use super::stl::is_binary_stl;

/// A format that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Obj,
    Ply,
    Stl,
    Gltf,
}

impl Format {
    /// That of a file of this name and content.
    pub(super) fn of_file(path: &Path, bytes: &[u8]) -> Self {
        let ending = path.extension().unwrap_or_default();
        let ends = |known: &str| ending.eq_ignore_ascii_case(known);
        match other_format(bytes) {
            Some("a PLY file") => Self::Ply,
            Some("an STL file in text" | "a binary STL file") => Self::Stl,
            Some("a binary glTF file" | "a JSON file (glTF?)") => Self::Gltf,
            // the reader of OBJ files says what it is
            Some(_) => Self::Obj,
            None if ends("ply") => Self::Ply,
            None if ends("stl") || is_binary_stl(bytes) => Self::Stl,
            None if ends("gltf") || ends("glb") => Self::Gltf,
            None => Self::Obj,
        }
    }
}
