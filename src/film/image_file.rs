//! PNG files, written as previews and read, and JPEG and Radiance HDR files, read; the only file
//! that names the `image` crate.

use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageFormat, Rgba, RgbaImage};

use super::image::Image;
use super::picture_file::{Picture, PictureError};
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

/// Decodes a PNG, JPEG or Radiance HDR file; sRGB becomes linear light unless `raw`.
pub(super) fn decode_picture(path: &Path, bytes: &[u8], raw: bool) -> Result<Picture, PictureError> {
    let (format, name) = match image::guess_format(bytes) {
        Ok(format @ ImageFormat::Png) => (format, "PNG"),
        Ok(format @ ImageFormat::Jpeg) => (format, "JPEG"),
        Ok(format @ ImageFormat::Hdr) => (format, "Radiance HDR"),
        _ => return Err(PictureError::Format { path: path.into() }),
    };
    let decoded = image::load_from_memory_with_format(bytes, format).map_err(|error| {
        PictureError::Decode { path: path.into(), format: name, reason: error.to_string() }
    })?;
    let size = [decoded.width(), decoded.height()];
    let to_light = |share: f64| to_f32(if raw { share } else { from_srgb(share) });
    let pixels = match decoded {
        DynamicImage::ImageRgb32F(linear) => linear.pixels().map(|pixel| pixel.0).collect(),
        // 8 bits become 16 without loss: 255 divides 65535
        other => {
            let table: Vec<f32> = (0..=u16::MAX).map(|n| to_light(f64::from(n) / 65535.0)).collect();
            let wide = other.into_rgb16();
            wide.pixels().map(|pixel| pixel.0.map(|n| table[usize::from(n)])).collect()
        }
    };
    Ok(Picture { size, pixels })
}

/// The linear value of a number on the sRGB curve (IEC 61966-2-1).
fn from_srgb(share: f64) -> f64 {
    if share <= 0.040_45 { share / 12.92 } else { libm::pow((share + 0.055) / 1.055, 2.4) }
}

#[expect(clippy::cast_possible_truncation, reason = "pictures are kept in single precision")]
const fn to_f32(value: f64) -> f32 {
    value as f32
}

#[cfg(test)]
mod tests {
    use image::{ImageBuffer, Luma, Rgb, Rgb32FImage, RgbImage};

    use super::*;
    use crate::film::{Window, read_picture};

    fn saved(image: impl Into<DynamicImage>, name: &str, raw: bool) -> Picture {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        image.into().save(&path).unwrap();
        read_picture(&path, raw).unwrap()
    }

    #[test]
    fn every_byte_comes_back_as_light() {
        let bytes = RgbImage::from_fn(16, 16, |x, y| Rgb([(16 * y + x) as u8, 0, 255]));
        let read = saved(bytes.clone(), "a.png", false);
        assert_eq!(read.size, [16, 16]);
        for (n, pixel) in read.pixels.iter().enumerate() {
            assert_eq!(pixel.map(to_srgb), [n as u8, 0, 255]);
        }
        // IEC 61966-2-1: 188 is 0.5029, and 10 is on the straight part
        assert!((read.pixels[188][0] - 0.502_886).abs() < 1e-6, "{}", read.pixels[188][0]);
        assert_eq!(read.pixels[10][0], (10.0 / 255.0 / 12.92) as f32);
        let raw = saved(bytes, "a.png", true);
        assert!(raw.pixels.iter().enumerate().all(|(n, pixel)| pixel[0] == (n as f64 / 255.0) as f32));
    }

    #[test]
    fn sixteen_bits_and_grey_come_back() {
        let wide = ImageBuffer::from_fn(2, 1, |x, _| Rgb([1000 + x as u16, 65535, 0]));
        let read = saved(wide, "a.png", true);
        assert_eq!(read.pixels, [[1000.0 / 65535.0, 1.0, 0.0], [1001.0 / 65535.0, 1.0, 0.0]]);
        let grey = ImageBuffer::from_pixel(1, 2, Luma([51_u8]));
        assert_eq!(saved(grey, "a.png", true).pixels, [[0.2; 3]; 2]);
    }

    #[test]
    fn jpeg_comes_back_nearly() {
        let read = saved(RgbImage::from_pixel(8, 8, Rgb([200, 100, 50])), "a.jpg", true);
        for (got, want) in read.pixels[20].iter().zip([200.0, 100.0, 50.0]) {
            assert!((got - want / 255.0).abs() < 0.02, "{got}");
        }
    }

    #[test]
    fn radiance_comes_back() {
        // powers of two have no rounding in the shared exponent; rows are from the top
        let radiance = Rgb32FImage::from_fn(9, 3, |x, y| Rgb([2.0_f32.powi(x as i32), 1.0, y as f32]));
        let read = saved(radiance, "a.hdr", false);
        assert_eq!(read.size, [9, 3]);
        assert_eq!(read.pixels[0], [1.0, 1.0, 0.0]);
        assert_eq!(read.pixels[9 + 4], [16.0, 1.0, 1.0]);
        assert_eq!(read.pixels[2 * 9 + 1], [2.0, 1.0, 2.0]);
    }

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
