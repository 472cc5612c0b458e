//! Preview pictures; the only file that names the `image` crate.

use std::io::Cursor;
use std::path::Path;

use image::{ImageFormat, Rgba, RgbaImage};

use super::image::Image;
use crate::output::{OutputError, write_whole};

/// Least coverage by which colours are divided: half a step of an 8-bit alpha. Below it the pixel
/// is transparent in the file, and its colour shows nowhere.
const MIN_ALPHA: f32 = 0.5 / 255.0;

/// Writes R, G, B, A as an 8-bit sRGB preview of the data window.
///
/// Colours are clamped to `[0, 1]`. The picture's colours are multiplied by its alpha
/// (a pixel half covered is half as bright), PNG's are not, so they are divided by it; where that
/// makes them brighter than 1 they are clamped. A missing alpha is 1, a missing colour 0.
///
/// # Errors
/// If the file cannot be written; nothing is left half-written then.
pub fn write_png(path: &Path, picture: &Image) -> Result<(), OutputError> {
    let window = picture.data_window();
    let channels = ["R", "G", "B", "A"].map(|name| picture.channel(name));
    let pixel = |x: u32, y: u32| {
        let index = y as usize * window.width as usize + x as usize;
        let value = |channel: usize, missing| channels[channel].map_or(missing, |v| v[index]);
        let alpha = value(3, 1.0);
        let straight = |channel| to_srgb(value(channel, 0.0) / alpha.max(MIN_ALPHA));
        Rgba([straight(0), straight(1), straight(2), to_byte(f64::from(alpha))])
    };
    let bytes = RgbaImage::from_fn(window.width, window.height, pixel);
    let mut file = Cursor::new(Vec::new());
    bytes
        .write_to(&mut file, ImageFormat::Png)
        .map_err(|error| OutputError::Encode { path: path.into(), reason: error.to_string() })?;
    write_whole(path, file.get_ref())
}

/// The sRGB curve (IEC 61966-2-1) of a linear value, as a byte.
fn to_srgb(linear: f32) -> u8 {
    let linear = f64::from(linear);
    to_byte(if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 })
}

/// `[0, 1]` to the nearest of 0..=255; what is outside is clamped, NaN is 0.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the clamped value is in range, and the cast takes NaN to 0"
)]
fn to_byte(value: f64) -> u8 {
    (255.0 * value.clamp(0.0, 1.0)).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Window;

    #[test]
    fn colours_are_srgb_and_straight() {
        let window = Window { x: 1, y: 0, width: 2, height: 2 };
        let names = ["R", "G", "B", "A"].map(str::to_owned);
        let mut image = Image::new([4, 4], window, &names);
        #[rustfmt::skip]
        image.put_tile(window, &[
            0.0, 0.5, 2.0, 1.0,   0.25, 0.1, -1.0, 0.5,
            0.0, 0.0, 0.0, 0.0,   f32::NAN, 0.002, 1.0, 1.0,
        ]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_png(&path, &image).unwrap();
        let back = image::open(&path).unwrap().into_rgba8();
        assert_eq!(back.dimensions(), (2, 2));
        let want = [[0, 188, 255, 255], [188, 124, 0, 128], [0, 0, 0, 0], [0, 7, 255, 255]];
        let got: Vec<[u8; 4]> = back.pixels().map(|pixel| pixel.0).collect();
        assert_eq!(got, want);
    }
}
