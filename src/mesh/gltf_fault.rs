//! What can be wrong in a glTF file.

use std::path::PathBuf;

use thiserror::Error;

use crate::memory::OutOfMemory;

/// A fault of a glTF file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum GltfFault {
    /// The container is not as it should be.
    #[error("{0}; a binary glTF file has a header of 12 bytes, then a chunk `JSON`, then at most one `BIN`")]
    Container(String),
    /// The text is no JSON, or of other types than glTF's.
    #[error("{0}")]
    Json(String),
    /// Another version.
    #[error("version `{0}` of glTF; 2.0 is read")]
    Version(String),
    /// Needs an extension.
    #[error("needs the extension `{name}`, which is not read{}", advice(name))]
    Extension {
        /// Its name.
        name: String,
    },
    /// An index that leads nowhere.
    #[error("refers to {what} {index}, but there are {count}")]
    OutOfRange {
        /// The list.
        what: &'static str,
        /// The index.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A node that is its own ancestor, or has two parents.
    #[error("is reached twice; a node has one parent at most")]
    NotATree,
    /// Sparse accessors.
    #[error("sparse accessors are not read; write the values in full")]
    Sparse,
    /// An accessor without data.
    #[error("has no bufferView, and so no data")]
    NoData,
    /// An accessor of another kind than its use asks for.
    #[error("{found}; {expected}")]
    Kind {
        /// What it is.
        found: String,
        /// What it should be.
        expected: &'static str,
    },
    /// Beyond the end of what it lies in.
    #[error("needs {needed} bytes, but {what} has {there}")]
    TooShort {
        /// Where its end is.
        needed: u64,
        /// What it lies in.
        what: String,
        /// Bytes there.
        there: u64,
    },
    /// A buffer that is not there.
    #[error("the file {} cannot be read: {reason}", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// A buffer without data.
    #[error("has no uri, which only the first buffer of a .glb file may lack")]
    NoUri,
    /// An address that is no file and no data.
    #[error("`{0}` is neither a file's path nor base64 data")]
    Uri(String),
    /// A mode of drawing that there is not.
    #[error("mode {0}; valid are 0 to 6, of which 4 (triangles), 5 (strips) and 6 (fans) are read")]
    Mode(u64),
    /// A transform that is not finite.
    #[error("its transform is not of finite numbers")]
    Transform,
    /// Too much.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
}

fn advice(name: &str) -> &'static str {
    match name {
        "KHR_draco_mesh_compression" => ": meshes compressed by Draco; write the file without compression",
        "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            ": buffers compressed by meshopt; write the file without compression"
        }
        _ => "; KHR_mesh_quantization, KHR_texture_transform and those of materials are",
    }
}
