//! Pictures of colours alone, for textures and environment maps.

use std::path::PathBuf;

use thiserror::Error;

use crate::memory::OutOfMemory;

/// A picture as it lights or covers something.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height, neither 0.
    pub size: [u32; 2],
    /// Rows from the top, each from the left; linear Rec. 709 unless read raw.
    pub pixels: Vec<[f32; 3]>,
}

/// Why pictures cannot be encoded.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum EncodeError {
    /// The encoder refuses them, such as for having no pixels.
    #[error("{0}")]
    Encoder(String),
    /// A raster that has not as many pixels as its size says.
    #[error("not as many pixels as its size says")]
    PixelCount,
    /// There is no picture.
    #[error("no pictures")]
    NoPictures,
    /// Pictures to be shown in turn that differ in size.
    #[error("the pictures' sizes differ")]
    Sizes,
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
    #[error("{}: is neither OpenEXR, Radiance HDR, PNG, JPEG, TIFF, BMP, WebP nor TGA", path.display())]
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
    /// The picture has more pixels than are allowed.
    #[error("{}: has {}x{} pixels, more than the {max_pixels} that a picture may have; --max-pixels N allows more",
            path.display(), size[0], size[1])]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its width and height.
        size: [u64; 2],
        /// The limit.
        max_pixels: u64,
    },
    /// The picture takes more memory than is allowed.
    #[error(transparent)]
    Limit(#[from] OutOfMemory),
    /// There is not enough memory for the picture.
    #[error("{}: takes {bytes} bytes of memory, more than there are", path.display())]
    Memory {
        /// The file.
        path: PathBuf,
        /// What decoding it takes at most.
        bytes: u64,
    },
    /// An EXR file with any number of samples in a pixel.
    #[error("{}: is a deep OpenEXR picture, with any number of samples in a pixel; flatten it first", path.display())]
    Deep {
        /// The file.
        path: PathBuf,
    },
    /// An EXR file with colours as luminance and chroma.
    #[error(
        "{}: is a luminance-chroma OpenEXR picture, with the channels Y, RY and BY; convert it to R, G and B first",
        path.display()
    )]
    LuminanceChroma {
        /// The file.
        path: PathBuf,
    },
    /// A picture without the channel that is asked for.
    #[error("{}: has no channel {wanted:?}, but {found}", path.display())]
    NoChannel {
        /// The file.
        path: PathBuf,
        /// The channel's name.
        wanted: String,
        /// The names of its channels.
        found: String,
    },
    /// An EXR file without colours.
    #[error("{}: has the channels {found}; a picture needs R, G and B, or one channel alone", path.display())]
    Channels {
        /// The file.
        path: PathBuf,
        /// The names of its channels.
        found: String,
    },
}
