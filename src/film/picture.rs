//! Pictures of colours alone, for textures and environment maps.

use std::path::PathBuf;

use thiserror::Error;

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
