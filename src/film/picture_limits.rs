//! What a picture may ask for before memory is taken for it.

use std::path::Path;

use crate::memory::MemoryLimit;

use super::picture::PictureError;

/// Bounds on the pictures that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureLimits {
    /// Most pixels of one picture (of an EXR file: of one part), columns times rows.
    pub max_pixels: u64,
    /// The most memory that the process may have.
    pub memory: MemoryLimit,
}

impl Default for PictureLimits {
    /// 2^30 pixels: 32768 x 32768.
    fn default() -> Self {
        Self { max_pixels: 1 << 30, ..Self::NONE }
    }
}

impl PictureLimits {
    /// Any number of pixels.
    pub const NONE: Self = Self { max_pixels: u64::MAX, memory: MemoryLimit::NONE };

    /// Refuses pictures of more pixels than are allowed.
    pub(super) fn check(self, path: &Path, size: [u64; 2]) -> Result<(), PictureError> {
        let pixels = size[0].checked_mul(size[1]);
        match pixels.is_some_and(|pixels| pixels <= self.max_pixels) {
            true => Ok(()),
            false => Err(PictureError::TooLarge { path: path.into(), size, max_pixels: self.max_pixels }),
        }
    }
}

/// Refuses a file shorter than the pixels that its header promises can be packed into.
///
/// `needed` is the least number of bytes that so many pixels take, saturated; `length` is the file's.
pub(super) fn check_promise(
    path: &Path,
    format: &'static str,
    size: [u64; 2],
    needed: u64,
    length: u64,
) -> Result<(), PictureError> {
    if needed <= length {
        return Ok(());
    }
    let [width, height] = size;
    let reason = format!(
        "its header promises {width}x{height} pixels, which take at least {needed} bytes; the file has {length}"
    );
    Err(PictureError::Decode { path: path.into(), format, reason })
}

/// Refuses a picture whose decoding takes more memory than is allowed, or than there is: running out of it would end the
/// program without a word.
pub(super) fn check_memory(path: &Path, bytes: u64, limit: MemoryLimit) -> Result<(), PictureError> {
    limit.ask(format_args!("picture {}", path.display()), bytes).map(drop)?;
    let mut space = Vec::<u8>::new();
    let is_there = usize::try_from(bytes).is_ok_and(|bytes| space.try_reserve_exact(bytes).is_ok());
    // else nobody would ask the system for what nobody uses
    std::hint::black_box(&space);
    if is_there { Ok(()) } else { Err(PictureError::Memory { path: path.into(), bytes }) }
}
