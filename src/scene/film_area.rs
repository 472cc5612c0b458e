//! The film's size and crop: their limits, shared by the scene file and the command line.

use thiserror::Error;

use crate::film::FilmSettings;

/// Most pixels along a side: what common image programs open, and far beyond any print.
pub const MAX_SIDE: u32 = 65_536;

/// Most pixels of a picture, or of its crop where it has one.
///
/// Colour and alpha of 2²⁸ pixels take 4 GiB; a picture beyond that is better made of crops.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Why a film cannot be of a size, or have a crop.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FilmAreaError {
    /// A side has no pixels, or too many.
    #[error("size {} x {} is not valid: each side is 1 to {MAX_SIDE} pixels", size[0], size[1])]
    Side {
        /// Width and height.
        size: [u32; 2],
    },
    /// A crop without pixels.
    #[error("crop {crop:?} is empty: its width and height (the last two) are at least 1")]
    EmptyCrop {
        /// Left, top, width and height.
        crop: [u32; 4],
    },
    /// A crop that is not within its film.
    #[error(
        "crop {crop:?} reaches outside the film of {} x {} pixels: {sum} is {end}, at most {most}", size[0], size[1]
    )]
    Outside {
        /// Left, top, width and height.
        crop: [u32; 4],
        /// Width and height of the film.
        size: [u32; 2],
        /// What is too much.
        sum: &'static str,
        /// How much it is.
        end: u64,
        /// How much it may be.
        most: u32,
    },
    /// More pixels than are kept in memory.
    #[error(
        "{what} {} x {} is more than {MAX_PIXELS} pixels, the most that are kept in memory: render it in crops",
        size[0], size[1]
    )]
    TooLarge {
        /// Whether it is the size or the crop.
        what: &'static str,
        /// Width and height.
        size: [u32; 2],
    },
    /// A text that is no size.
    #[error("size {0:?} is not WIDTHxHEIGHT in pixels, as 640x480 would be")]
    SizeText(String),
    /// A text that is no crop.
    #[error("crop {0:?} is not X,Y,WIDTH,HEIGHT in pixels, as 0,0,64,64 would be")]
    CropText(String),
}

/// Checks a film: its size and, where it has one, its crop.
///
/// # Errors
/// If it is not valid; the message says what would be.
pub fn validate_film(film: &FilmSettings) -> Result<(), FilmAreaError> {
    validate_sides(film.size)?;
    match film.crop {
        Some(crop) => validate_crop(crop, film.size),
        None => validate_pixels("size", film.size),
    }
}

fn validate_sides(size: [u32; 2]) -> Result<(), FilmAreaError> {
    if size.iter().all(|side| (1..=MAX_SIDE).contains(side)) {
        return Ok(());
    }
    Err(FilmAreaError::Side { size })
}

/// Checks the crop `[x, y, width, height]` of a film.
///
/// # Errors
/// If it is not valid; the message says what would be.
pub fn validate_crop(crop: [u32; 4], size: [u32; 2]) -> Result<(), FilmAreaError> {
    let [x, y, width, height] = crop;
    if width == 0 || height == 0 {
        return Err(FilmAreaError::EmptyCrop { crop });
    }
    for (sum, start, length, most) in [("x + width", x, width, size[0]), ("y + height", y, height, size[1])] {
        let end = u64::from(start) + u64::from(length);
        if end > u64::from(most) {
            return Err(FilmAreaError::Outside { crop, size, sum, end, most });
        }
    }
    validate_pixels("crop", [width, height])
}

fn validate_pixels(what: &'static str, size: [u32; 2]) -> Result<(), FilmAreaError> {
    if u64::from(size[0]) * u64::from(size[1]) > MAX_PIXELS {
        return Err(FilmAreaError::TooLarge { what, size });
    }
    Ok(())
}

/// Reads `WIDTHxHEIGHT` and checks the sides; the rest is for [`validate_film`], once the crop is
/// known.
///
/// # Errors
/// If it is not valid; the message says what would be.
pub fn parse_size(text: &str) -> Result<[u32; 2], FilmAreaError> {
    let size: [u32; 2] =
        integers(text, ['x', 'X']).ok_or_else(|| FilmAreaError::SizeText(text.to_owned()))?;
    validate_sides(size)?;
    Ok(size)
}

/// Reads `X,Y,WIDTH,HEIGHT`; whether it fits is for [`validate_crop`], once the size is known.
///
/// # Errors
/// If it is not valid; the message says what would be.
pub fn parse_crop(text: &str) -> Result<[u32; 4], FilmAreaError> {
    integers(text, [',', ',']).ok_or_else(|| FilmAreaError::CropText(text.to_owned()))
}

fn integers<const N: usize>(text: &str, separators: [char; 2]) -> Option<[u32; N]> {
    let parts: Option<Vec<u32>> = text.split(separators).map(|part| part.trim().parse().ok()).collect();
    parts?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(parse_size("640x480"), Ok([640, 480]));
        assert_eq!(parse_size("65536X65536"), Ok([65536, 65536]));
        for (text, message) in [
            ("640", r#"size "640" is not WIDTHxHEIGHT in pixels, as 640x480 would be"#),
            ("1x2x3", r#"size "1x2x3" is not WIDTHxHEIGHT in pixels, as 640x480 would be"#),
            ("0x480", "size 0 x 480 is not valid: each side is 1 to 65536 pixels"),
            ("1x65537", "size 1 x 65537 is not valid: each side is 1 to 65536 pixels"),
        ] {
            assert_eq!(parse_size(text).unwrap_err().to_string(), message);
        }
    }

    #[test]
    fn a_film_too_large_for_memory_needs_a_crop() {
        let mut film = FilmSettings { size: [65536, 65536], ..FilmSettings::default() };
        let message = "size 65536 x 65536 is more than 268435456 pixels, the most that are kept in memory: render it in crops";
        assert_eq!(validate_film(&film).unwrap_err().to_string(), message);
        film.crop = Some([65535, 65535, 1, 1]);
        assert_eq!(validate_film(&film), Ok(()));
        film.size[1] = 0;
        assert!(validate_film(&film).is_err());
    }

    #[test]
    fn crops() {
        assert_eq!(parse_crop("1, 2,3,4"), Ok([1, 2, 3, 4]));
        assert!(parse_crop("1,2,3").is_err());
        assert!(parse_crop("-1,2,3,4").is_err());
        assert_eq!(validate_crop([1, 2, 3, 4], [4, 6]), Ok(()));
        for (crop, message) in [
            ([0, 0, 0, 4], "crop [0, 0, 0, 4] is empty: its width and height (the last two) are at least 1"),
            (
                [2, 0, 3, 4],
                "crop [2, 0, 3, 4] reaches outside the film of 4 x 6 pixels: x + width is 5, at most 4",
            ),
            (
                [0, u32::MAX, 1, u32::MAX],
                "crop [0, 4294967295, 1, 4294967295] reaches outside the film of 4 x 6 pixels: y + height is 8589934590, at most 6",
            ),
        ] {
            assert_eq!(validate_crop(crop, [4, 6]).unwrap_err().to_string(), message);
        }
    }
}
