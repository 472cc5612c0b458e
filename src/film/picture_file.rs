//! Pictures read from files: textures and environment maps.

use std::path::{Path, PathBuf};

use thiserror::Error;

use super::{exr_file, image_file};

/// A picture as it lights or covers something.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height, neither 0.
    pub size: [u32; 2],
    /// Rows from the top, each from the left; linear Rec. 709 unless read raw.
    pub pixels: Vec<[f32; 3]>,
}

/// Why a file gives no picture.
#[derive(Debug, Error)]
pub enum PictureError {
    /// The file cannot be read.
    #[error("cannot read the picture {}: {reason}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        reason: std::io::Error,
    },
    /// The file's first bytes are of none of the formats.
    #[error("{}: is neither OpenEXR, Radiance HDR, PNG nor JPEG", path.display())]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// The file breaks its format's rules, or has a feature that is not supported.
    #[error("{}: is not a readable {format} picture: {reason}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// The format's name.
        format: &'static str,
        /// What the decoder says.
        reason: String,
    },
    /// An EXR file without colours.
    #[error("{}: has the channels {found}; a picture needs R, G and B, or Y alone", path.display())]
    Channels {
        /// The file.
        path: PathBuf,
        /// The names of its channels.
        found: String,
    },
}

/// Reads a picture: EXR (channels R, G, B, or Y), Radiance HDR, PNG or JPEG.
///
/// The format is told by the file's first bytes. PNG and JPEG hold sRGB, which is converted to
/// linear light unless `raw`; then their numbers are only scaled to `[0, 1]`, as for normal maps.
/// EXR and HDR are linear already. Alpha is left out, and a grey picture has three equal colours.
///
/// # Errors
/// If the file cannot be read, or is not such a picture.
pub fn read_picture(path: &Path, raw: bool) -> Result<Picture, PictureError> {
    let bytes = read_bytes(path)?;
    if exr_file::is_exr(&bytes) {
        exr_file::decode_picture(path, &bytes)
    } else {
        image_file::decode_picture(path, &bytes, raw)
    }
}

/// All of a file.
pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, PictureError> {
    std::fs::read(path).map_err(|reason| PictureError::Read { path: path.into(), reason })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let missing = read_picture(&folder.path().join("none.exr"), false).unwrap_err();
        assert!(matches!(missing, PictureError::Read { .. }), "{missing}");
        let cases: [(&str, &[u8], &str); 4] = [
            ("text.png", b"not a picture", "is neither OpenEXR, Radiance HDR, PNG nor JPEG"),
            ("cut.png", b"\x89PNG\r\n\x1a\n", "is not a readable PNG picture"),
            ("cut.exr", b"\x76\x2f\x31\x01", "is not a readable OpenEXR picture"),
            ("cut.hdr", b"#?RADIANCE\n", "is not a readable Radiance HDR picture"),
        ];
        for (name, bytes, want) in cases {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            let message = read_picture(&path, false).unwrap_err().to_string();
            assert!(message.contains(want) && message.contains(name), "{message}");
        }
    }
}
