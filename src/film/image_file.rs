//! PNG files, written as previews and read, and JPEG, Radiance HDR, TIFF, BMP, WebP and TGA files, read; the only file
//! that names the `image` crate.

use std::io::Cursor;
use std::path::Path;

use image::codecs::png::PngEncoder;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits, RgbImage, Rgba, RgbaImage};

use super::image::Image;
use super::layers::{Area, LayeredChannel, LayeredPicture, Numbers, Part, Recorded, SampleKind};
use super::picture::{EncodeError, Picture, PictureError};
use super::picture_limits::{PictureLimits, check_memory, check_promise};
use super::raster::{Raster, to_byte};
use crate::output::{OutputError, write_whole};

/// Least coverage by which colours are divided: half a step of an 8-bit alpha. Below it the pixel
/// is transparent in the file, and its colour shows nowhere.
const MIN_ALPHA: f32 = 0.5 / 255.0;

/// Writes a picture as [`encode_png`] has it.
///
/// # Errors
/// If the file cannot be written; nothing is left half-written then.
pub fn write_png(path: &Path, picture: &Image) -> Result<(), OutputError> {
    let bytes = encode_png(picture)
        .map_err(|error| OutputError::Encode { path: path.into(), reason: error.to_string() })?;
    write_whole(path, &bytes)
}

/// R, G, B, A as an 8-bit sRGB preview of the data window: the bytes of a PNG file.
///
/// Colours are clamped to `[0, 1]`. The picture's colours are multiplied by its alpha
/// (a pixel half covered is half as bright), PNG's are not, so they are divided by it; where that
/// makes them brighter than 1 they are clamped. A missing alpha is 1, a missing colour 0.
///
/// # Errors
/// If the picture has no pixels.
pub fn encode_png(picture: &Image) -> Result<Vec<u8>, EncodeError> {
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
    encode(&bytes.into())
}

/// The bytes of a PNG file of a raster.
///
/// # Errors
/// If there are no pixels.
pub fn encode_raster(raster: &Raster) -> Result<Vec<u8>, EncodeError> {
    let [width, height] = raster.size;
    let bytes = raster.pixels.as_flattened().to_vec();
    let picture = RgbImage::from_raw(width, height, bytes).ok_or(EncodeError::PixelCount)?;
    encode(&picture.into())
}

/// The encoder is named, not the format: by the format the writers of all others would be compiled too.
fn encode(picture: &DynamicImage) -> Result<Vec<u8>, EncodeError> {
    let mut file = Vec::new();
    let written = picture.write_with_encoder(PngEncoder::new(&mut file));
    written.map_err(|error| EncodeError::Encoder(error.to_string()))?;
    Ok(file)
}

/// The sRGB curve (IEC 61966-2-1) of a linear value, as a byte; what is outside of `[0, 1]` is clamped, NaN is 0.
fn to_srgb(linear: f32) -> u8 {
    let linear = f64::from(linear);
    to_byte(if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 })
}

/// Decodes a file of any of these formats; sRGB becomes linear light unless `raw`.
pub(super) fn decode_picture(
    path: &Path,
    bytes: &[u8],
    raw: bool,
    limits: PictureLimits,
) -> Result<Picture, PictureError> {
    let (decoded, _) = decode(path, bytes, limits)?;
    let size = [decoded.width(), decoded.height()];
    let to_light = |share: f64| to_f32(if raw { share } else { from_srgb(share) });
    let pixels = match decoded {
        linear @ (DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_)) => {
            linear.into_rgb32f().pixels().map(|pixel| pixel.0).collect()
        }
        // 8 bits become 16 without loss: 255 divides 65535
        other => {
            let table: Vec<f32> = (0..=u16::MAX).map(|n| to_light(f64::from(n) / 65535.0)).collect();
            let wide = other.into_rgb16();
            wide.pixels().map(|pixel| pixel.0.map(|n| table[usize::from(n)])).collect()
        }
    };
    Ok(Picture { size, pixels })
}

/// The picture and the name of its format.
fn decode(
    path: &Path,
    bytes: &[u8],
    limits: PictureLimits,
) -> Result<(DynamicImage, &'static str), PictureError> {
    let (decoder, name) = checked_decoder(path, bytes, limits)?;
    let decoded = DynamicImage::from_decoder(decoder);
    let decoded = decoded.map_err(|error| failed(path, name, &error))?;
    Ok((decoded, name))
}

/// A decoder that has read the header, which does not ask for too much; and the name of the format.
fn checked_decoder<'a>(
    path: &Path,
    bytes: &'a [u8],
    limits: PictureLimits,
) -> Result<(impl ImageDecoder + 'a, &'static str), PictureError> {
    let (format, name) = match image::guess_format(bytes) {
        Ok(format @ ImageFormat::Png) => (format, "PNG"),
        Ok(format @ ImageFormat::Jpeg) => (format, "JPEG"),
        Ok(format @ ImageFormat::Hdr) => (format, "Radiance HDR"),
        Ok(format @ ImageFormat::Tiff) => (format, "TIFF"),
        Ok(format @ ImageFormat::Bmp) => (format, "BMP"),
        Ok(format @ ImageFormat::WebP) => (format, "WebP"),
        // nothing at its beginning tells a TGA file
        _ if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("tga")) => {
            (ImageFormat::Tga, "TGA")
        }
        _ => return Err(PictureError::Format { path: path.into() }),
    };
    let decoder = ImageReader::with_format(Cursor::new(bytes), format).into_decoder();
    let mut decoder = decoder.map_err(|error| failed(path, name, &error))?;
    let (width, height) = decoder.dimensions();
    let size = [u64::from(width), u64::from(height)];
    limits.check(path, size)?;
    check_promise(path, name, size, least_bytes(format, bytes, size), bytes.len() as u64)?;
    // the numbers as decoded, as 32-bit floats of four channels, and these channel by channel
    let floats = size[0].saturating_mul(size[1]).saturating_mul(2 * 4 * 4);
    check_memory(path, decoder.total_bytes().saturating_add(floats), limits.memory)?;
    // for one strip or tile of a TIFF file beside the whole
    let mut allowed = Limits::no_limits();
    allowed.max_alloc = Some(decoder.total_bytes().saturating_mul(2).saturating_add(1 << 24));
    decoder.set_limits(allowed).map_err(|error| failed(path, name, &error))?;
    Ok((decoder, name))
}

fn failed(path: &Path, format: &'static str, error: &image::ImageError) -> PictureError {
    PictureError::Decode { path: path.into(), format, reason: error.to_string() }
}

/// The least number of bytes that a picture takes in a format.
fn least_bytes(format: ImageFormat, bytes: &[u8], [width, height]: [u64; 2]) -> u64 {
    let pixels = width.saturating_mul(height);
    match format {
        // deflate packs 1032 bytes into one at most; IHDR begins the file, with the bits of a number and the kind of colours
        ImageFormat::Png => {
            let bits = u64::from(bytes.get(24).copied().unwrap_or(1));
            let channels = match bytes.get(25) {
                Some(2) => 3,
                Some(4) => 2,
                Some(6) => 4,
                _ => 1,
            };
            pixels.saturating_mul(bits * channels) / 8 / 1032
        }
        // at least one bit for each block of 8 x 8, which stands for up to 4 x 4 times as many pixels
        ImageFormat::Jpeg => pixels / (64 * 16 * 8),
        // whole rows of one colour take next to nothing
        ImageFormat::WebP | ImageFormat::Tiff | ImageFormat::Bmp => 0,
        // a run of 128 takes 2 bytes
        ImageFormat::Tga => pixels / 64,
        // at least one pixel for each row; a run of runs is of 256 times as many pixels
        _ => (4 * height).max(pixels / (1 << 13)),
    }
}

/// Decodes a file of any of these formats, with its numbers as they are.
pub(super) fn decode_layers(
    path: &Path,
    bytes: &[u8],
    limits: PictureLimits,
) -> Result<LayeredPicture, PictureError> {
    let (decoded, format) = decode(path, bytes, limits)?;
    let display = Area { x: 0, y: 0, width: decoded.width(), height: decoded.height() };
    let bytes =
        |raw: Vec<u8>| (SampleKind::Byte, raw.into_iter().map(|n| f32::from(n) / 255.0).collect::<Vec<_>>());
    let shorts = |raw: Vec<u16>| {
        (SampleKind::Short, raw.into_iter().map(|n| f32::from(n) / 65535.0).collect::<Vec<_>>())
    };
    let (grey, grey_alpha, rgb, rgba) =
        (&["Y"][..], &["Y", "A"][..], &["R", "G", "B"][..], &["R", "G", "B", "A"][..]);
    let (names, (kind, values)) = match decoded {
        DynamicImage::ImageLuma8(picture) => (grey, bytes(picture.into_raw())),
        DynamicImage::ImageLumaA8(picture) => (grey_alpha, bytes(picture.into_raw())),
        DynamicImage::ImageRgb8(picture) => (rgb, bytes(picture.into_raw())),
        DynamicImage::ImageRgba8(picture) => (rgba, bytes(picture.into_raw())),
        DynamicImage::ImageLuma16(picture) => (grey, shorts(picture.into_raw())),
        DynamicImage::ImageLumaA16(picture) => (grey_alpha, shorts(picture.into_raw())),
        DynamicImage::ImageRgb16(picture) => (rgb, shorts(picture.into_raw())),
        DynamicImage::ImageRgba16(picture) => (rgba, shorts(picture.into_raw())),
        DynamicImage::ImageRgba32F(picture) => (rgba, (SampleKind::Float, picture.into_raw())),
        other => (rgb, (SampleKind::Float, other.into_rgb32f().into_raw())),
    };
    let channels = names.iter().enumerate().map(|(at, name)| {
        let values = values.iter().skip(at).step_by(names.len()).copied().collect();
        LayeredChannel { name: (*name).to_owned(), kind, numbers: Numbers::Real(values) }
    });
    let parts = vec![Part { name: None, data: display, channels: channels.collect() }];
    let srgb_encoded = kind != SampleKind::Float;
    let notes = if srgb_encoded {
        vec![format!("{format}: the numbers are on the sRGB curve and compared as they are, not as light")]
    } else {
        Vec::new()
    };
    Ok(LayeredPicture { format, display, parts, srgb_encoded, recorded: Recorded::default(), notes })
}

/// The linear value of a number on the sRGB curve (IEC 61966-2-1).
pub(crate) fn from_srgb(share: f64) -> f64 {
    if share <= 0.040_45 { share / 12.92 } else { libm::pow((share + 0.055) / 1.055, 2.4) }
}

#[expect(clippy::cast_possible_truncation, reason = "pictures are kept in single precision")]
const fn to_f32(value: f64) -> f32 {
    value as f32
}

#[cfg(test)]
mod tests {
    use image::{ImageBuffer, Luma, Rgb, Rgb32FImage};

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
        let ramp: Vec<u8> = (0..=255).flat_map(|n| [n, 0, 255]).collect();
        let bytes = RgbImage::from_vec(16, 16, ramp).unwrap();
        let read = saved(bytes.clone(), "a.png", false);
        assert_eq!(read.size, [16, 16]);
        for (n, pixel) in (0..=255).zip(&read.pixels) {
            assert_eq!(pixel.map(to_srgb), [n, 0, 255]);
        }
        // IEC 61966-2-1: 188 is 0.5029, and 10 is on the straight part
        assert!((read.pixels[188][0] - 0.502_886).abs() < 1e-6, "{}", read.pixels[188][0]);
        assert_eq!(read.pixels[10][0], to_f32(10.0 / 255.0 / 12.92));
        let raw = saved(bytes, "a.png", true);
        assert!((0..=255_u8).zip(&raw.pixels).all(|(n, pixel)| pixel[0] == to_f32(f64::from(n) / 255.0)));
    }

    #[test]
    fn sixteen_bits_and_grey_come_back() {
        let wide: ImageBuffer<Rgb<u16>, _> =
            ImageBuffer::from_vec(2, 1, vec![1000, 65535, 0, 1001, 65535, 0]).unwrap();
        let read = saved(wide, "a.png", true);
        assert_eq!(read.pixels, [[1000.0 / 65535.0, 1.0, 0.0], [1001.0 / 65535.0, 1.0, 0.0]]);
        let grey = ImageBuffer::from_pixel(1, 2, Luma([51_u8]));
        assert_eq!(saved(grey, "a.png", true).pixels, [[0.2; 3]; 2]);
    }

    #[test]
    fn layers_are_the_numbers_of_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let read = |image: DynamicImage, name: &str| {
            let path = folder.path().join(name);
            image.save(&path).unwrap();
            crate::film::read_layers(&path).unwrap()
        };
        let eight = read(RgbaImage::from_pixel(2, 1, Rgba([51, 102, 153, 255])).into(), "a.png");
        let part = &eight.parts[0];
        let names: Vec<_> = part.channels.iter().map(|channel| channel.name.as_str()).collect();
        assert_eq!(names, ["R", "G", "B", "A"]);
        assert_eq!(part.channels[1].numbers, Numbers::Real(vec![0.4; 2]));
        assert!(eight.srgb_encoded && eight.notes.len() == 1, "{:?}", eight.notes);
        let wide: ImageBuffer<Luma<u16>, _> = ImageBuffer::from_pixel(1, 2, Luma([13107_u16]));
        let wide = read(wide.into(), "b.png");
        assert_eq!(wide.parts[0].channels[0].kind, SampleKind::Short);
        assert_eq!(wide.parts[0].channels[0].numbers, Numbers::Real(vec![0.2; 2]));
        let light = read(Rgb32FImage::from_pixel(1, 1, Rgb([2.0, 1.0, 0.5])).into(), "a.hdr");
        assert!(!light.srgb_encoded);
        assert_eq!(light.parts[0].channels[0].numbers, Numbers::Real(vec![2.0]));
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
