//! Pictures read from files of any known format.

use std::path::Path;

use super::layers::LayeredPicture;
use super::picture::{Picture, PictureError};
use super::picture_limits::PictureLimits;
use super::{exr_file, image_file};
use crate::input::read_whole;

/// Reads a picture: EXR (channels R, G, B, or one alone), Radiance HDR, PNG, JPEG, TIFF, BMP, WebP or TGA.
///
/// The format is told by the file's first bytes, that of TGA by the ending of its name. All but EXR and HDR hold sRGB, which is converted to
/// linear light unless `raw`; then their numbers are only scaled to `[0, 1]`, as for normal maps.
/// EXR and HDR are linear already. Alpha is left out, and a grey picture has three equal colours.
///
/// # Errors
/// If the file cannot be read, is not such a picture, or has more pixels than [`PictureLimits::default`] allows.
pub fn read_picture(path: &Path, raw: bool) -> Result<Picture, PictureError> {
    read_picture_within(path, raw, PictureLimits::default())
}

/// [`read_picture`] with other limits.
///
/// # Errors
/// As [`read_picture`].
pub fn read_picture_within(path: &Path, raw: bool, limits: PictureLimits) -> Result<Picture, PictureError> {
    let bytes = read_bytes(path)?;
    if exr_file::is_exr(&bytes) {
        exr_file::decode_picture(path, &bytes, limits)
    } else {
        image_file::decode_picture(path, &bytes, raw, limits)
    }
}

/// One channel of a picture as three equal colours, by its full name: of an EXR file's first part that has it, or `R`, `G`, `B`,
/// `Y` or `A`.
///
/// Numbers on the sRGB curve become linear light unless `raw`; alpha is linear in all formats.
///
/// # Errors
/// As [`read_layers`]; and if there is no such channel.
pub fn read_channel_within(
    path: &Path,
    channel: &str,
    raw: bool,
    limits: PictureLimits,
) -> Result<Picture, PictureError> {
    let layers = read_layers_within(path, limits)?;
    let found = layers.parts.iter().find_map(|part| part.channel(channel).map(|found| (part, found)));
    let Some((part, found)) = found else {
        let names: Vec<_> =
            layers.parts.iter().flat_map(|part| &part.channels).map(|known| &*known.name).collect();
        let (path, found) = (path.into(), names.join(", "));
        return Err(PictureError::NoChannel { path, wanted: channel.to_owned(), found });
    };
    let to_light = layers.srgb_encoded && !raw && channel != "A";
    let pixels = (0..part.data.pixels()).map(|index| {
        let value = found.value(index);
        [to_f32(if to_light { image_file::from_srgb(value) } else { value }); 3]
    });
    Ok(Picture { size: [part.data.width, part.data.height], pixels: pixels.collect() })
}

#[expect(clippy::cast_possible_truncation, reason = "pictures are kept in single precision")]
const fn to_f32(value: f64) -> f32 {
    value as f32
}

/// Reads all that a picture's file holds, in any format that [`read_picture`] reads.
///
/// EXR: every part with every channel, whole numbers kept exactly; of pictures at several resolutions the largest. The others
/// have one part of channels `R`, `G`, `B`, or `Y`, and `A` if there is one: n/255 or n/65535, with the sRGB curve left as it
/// is. No colour is converted.
///
/// # Errors
/// If the file cannot be read, is not such a picture, or has more pixels than [`PictureLimits::default`] allows; and for EXR
/// files with deep data, luminance and chroma, or subsampled channels.
pub fn read_layers(path: &Path) -> Result<LayeredPicture, PictureError> {
    read_layers_within(path, PictureLimits::default())
}

/// [`read_layers`] with other limits.
///
/// # Errors
/// As [`read_layers`].
pub fn read_layers_within(path: &Path, limits: PictureLimits) -> Result<LayeredPicture, PictureError> {
    let bytes = read_bytes(path)?;
    if exr_file::is_exr(&bytes) {
        exr_file::decode_layers(path, &bytes, limits)
    } else {
        image_file::decode_layers(path, &bytes, limits)
    }
}

/// All of a file.
fn read_bytes(path: &Path) -> Result<Vec<u8>, PictureError> {
    read_whole(path).map_err(|reason| PictureError::Read { path: path.into(), reason })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Area, LayeredChannel, Numbers, Part, Recorded, SampleKind};

    #[test]
    fn other_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let missing = read_picture(&folder.path().join("none.exr"), false).unwrap_err();
        assert!(matches!(missing, PictureError::Read { .. }), "{missing}");
        let cases: [(&str, &[u8], &str); 4] = [
            (
                "text.png",
                b"not a picture",
                "is neither OpenEXR, Radiance HDR, PNG, JPEG, TIFF, BMP, WebP nor TGA",
            ),
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

    fn picture() -> LayeredPicture {
        let channel = |name: &str, kind, numbers| LayeredChannel { name: name.into(), kind, numbers };
        let real = |values: &[f32]| Numbers::Real(values.to_vec());
        let area = Area { x: -1, y: 2, width: 2, height: 1 };
        let ids = Numbers::Whole(vec![u32::MAX, u32::MAX - 1]);
        let first = Part {
            name: Some("first".into()),
            data: area,
            channels: vec![
                channel("A", SampleKind::Float, real(&[1.0, 0.5])),
                channel("crypto.layer.I", SampleKind::Uint, ids),
            ],
        };
        let second = Part {
            name: Some("second".into()),
            data: Area { x: 0, y: 0, width: 1, height: 2 },
            channels: vec![channel("Y", SampleKind::Float, real(&[f32::INFINITY, -0.0]))],
        };
        LayeredPicture {
            format: "OpenEXR",
            display: Area { x: -3, y: 0, width: 10, height: 5 },
            parts: vec![first, second],
            srgb_encoded: false,
            recorded: Recorded { software: Some("trimray 0.1.0".into()), ..Recorded::default() },
            notes: Vec::new(),
        }
    }

    #[test]
    fn parts_windows_and_whole_numbers_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        exr_file::write_layers(&path, &picture()).unwrap();
        let back = read_layers(&path).unwrap();
        assert_eq!(back, picture());
        let crypto = &back.parts[0].channels[1];
        assert_eq!((crypto.layer(), crypto.short_name()), ("crypto.layer", "I"));
        assert_eq!(crypto.value(1), f64::from(u32::MAX - 1));
        // a file that is cut off is an error
        let bytes = std::fs::read(&path).unwrap();
        for length in [8, 60, bytes.len() / 2, bytes.len() - 3] {
            std::fs::write(&path, &bytes[..length]).unwrap();
            let error = read_layers(&path).unwrap_err();
            assert!(matches!(error, PictureError::Decode { .. }), "{error}");
        }
    }
}
