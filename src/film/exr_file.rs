//! EXR files; the only file that names the `exr` crate.

use std::io::Cursor;
use std::path::Path;

use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Layer};
use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, Chromaticities, IntegerBounds, Text};
use exr::meta::header::{ImageAttributes, LayerAttributes};
use exr::prelude::{ReadChannels, ReadLayers, WritableImage};
use glam::DMat4;

use super::image::Image;
use super::picture_file::{Picture, PictureError};
use crate::output::{OutputError, write_whole};

/// What the file's header says of how the picture was made.
#[derive(Clone, Debug, PartialEq)]
pub struct ExrHeader {
    /// World space to camera space, for column vectors; +x right, +y up, looking along -z.
    pub camera_from_world: DMat4,
    /// Width of the picture at distance 1 from the camera.
    pub screen_window_width: f64,
    /// Hash of the scene, `trimray/sceneHash`.
    pub scene_hash: String,
    /// `trimray/seed`: written as text, since it has 64 bits and the format's integers 32.
    pub seed: u64,
    /// `trimray/spp`.
    pub spp: u32,
    /// All that decides the pixels, as JSON: `trimray/settings`.
    pub settings: String,
}

/// Writes the picture as one part: R G B A and the layers, 32-bit floats, ZIP-compressed.
///
/// The same picture and header give the same bytes: there is no time stamp, and the attributes
/// are in the order of their names.
///
/// # Errors
/// If the file cannot be written; nothing is left half-written then.
pub fn write_exr(path: &Path, image: &Image, header: &ExrHeader) -> Result<(), OutputError> {
    let bytes = encode(image, header).map_err(|reason| OutputError::Encode { path: path.into(), reason })?;
    write_whole(path, &bytes)
}

/// The file's bytes, or what the encoder complains of.
fn encode(image: &Image, header: &ExrHeader) -> Result<Vec<u8>, String> {
    let window = image.data_window();
    let [width, height] = image.display_size();
    let channel = |channel: &super::image::Channel| {
        let values = FlatSamples::F32(channel.values.clone());
        AnyChannel::new(channel.name.as_str(), values)
    };
    let layer = Layer::new(
        (window.width as usize, window.height as usize),
        layer_attributes(image, header)?,
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(image.channels().iter().map(channel).collect()),
    );
    let display = IntegerBounds::from_dimensions((width as usize, height as usize));
    let mut attributes = ImageAttributes::new(display);
    attributes.chromaticities = Some(REC_709);
    let mut file = Cursor::new(Vec::new());
    exr::image::Image::new(attributes, layer)
        .write()
        .to_buffered(&mut file)
        .map_err(|error| error.to_string())?;
    sort_attributes(file.into_inner()).ok_or_else(|| "the header is not readable".to_owned())
}

/// Primaries and white of ITU-R BT.709 (white: D65).
const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.3, 0.6),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.329),
};

fn layer_attributes(image: &Image, header: &ExrHeader) -> Result<LayerAttributes, String> {
    let window = image.data_window();
    let signed = |value: u32| i32::try_from(value).map_err(|error| error.to_string());
    let mut attributes = LayerAttributes {
        layer_position: Vec2(signed(window.x)?, signed(window.y)?),
        software_name: Some(text(concat!("trimray ", env!("CARGO_PKG_VERSION")))),
        world_to_camera: Some(header.camera_from_world.as_mat4().to_cols_array()),
        screen_window_width: to_f32(header.screen_window_width),
        ..LayerAttributes::default()
    };
    let own = [
        ("version", AttributeValue::Text(text(env!("CARGO_PKG_VERSION")))),
        ("sceneHash", AttributeValue::Text(text(&header.scene_hash))),
        ("seed", AttributeValue::Text(text(&header.seed.to_string()))),
        ("spp", AttributeValue::I32(signed(header.spp)?)),
        ("settings", AttributeValue::Text(text(&header.settings))),
    ];
    for (name, value) in own {
        attributes.other.insert(text(&format!("trimray/{name}")), value);
    }
    Ok(attributes)
}

#[expect(clippy::cast_possible_truncation, reason = "the attribute is a 32-bit float")]
const fn to_f32(value: f64) -> f32 {
    value as f32
}

/// UTF-8 in the file, whatever the letters (the crate's own conversion knows Latin-1 alone).
fn text(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}

/// Puts the header's attributes in the order of their names.
///
/// The crate keeps our own attributes in a hash map, whose order is another one in each run. The
/// header of a file of one part is, after 8 bytes, a run of (name, 0, type, 0, size as 4 bytes,
/// value) that an empty name ends (OpenEXR File Layout). Moving attributes within the run moves
/// nothing else, so the offsets after it stay right. None if the file is not of that form.
fn sort_attributes(mut file: Vec<u8>) -> Option<Vec<u8>> {
    const START: usize = 8;
    let mut attributes = Vec::new();
    let mut at = START;
    while *file.get(at)? != 0 {
        let name = zero_terminated(&file, at)?;
        let kind = zero_terminated(&file, name.end + 1)?;
        let size = file.get(kind.end + 1..kind.end + 5)?;
        let size = u32::from_le_bytes(size.try_into().ok()?);
        let end = (kind.end + 5).checked_add(size as usize)?;
        attributes.push((file.get(name)?.to_vec(), file.get(at..end)?.to_vec()));
        at = end;
    }
    attributes.sort();
    let sorted: Vec<u8> = attributes.into_iter().flat_map(|(_, bytes)| bytes).collect();
    file.get_mut(START..at)?.copy_from_slice(&sorted);
    Some(file)
}

/// The bytes from `start` to the next zero.
fn zero_terminated(file: &[u8], start: usize) -> Option<std::ops::Range<usize>> {
    let length = file.get(start..)?.iter().position(|&byte| byte == 0)?;
    Some(start..start + length)
}

/// Whether a file begins as an EXR file does.
pub(super) fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01])
}

/// Decodes the data window of an EXR file's first part: R, G and B, or Y for all three.
///
/// Chromaticities are not looked at: the numbers are taken to be of Rec. 709.
pub(super) fn decode_picture(path: &Path, bytes: &[u8]) -> Result<Picture, PictureError> {
    let failed = |reason: String| PictureError::Decode { path: path.into(), format: "OpenEXR", reason };
    let part = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| failed(error.to_string()))?
        .layer_data;
    let list = &part.channel_data.list;
    let channel = |name: &str| list.iter().find(|channel| channel.name.eq(name));
    let colours = match ["R", "G", "B"].map(channel) {
        [Some(red), Some(green), Some(blue)] => [red, green, blue],
        _ => match channel("Y") {
            Some(grey) => [grey; 3],
            None => {
                let names: Vec<_> = list.iter().map(|channel| channel.name.to_string()).collect();
                return Err(PictureError::Channels { path: path.into(), found: names.join(", ") });
            }
        },
    };
    if colours.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return Err(failed("its colours are subsampled; one sample for each pixel would do".to_owned()));
    }
    let side = |length: usize| u32::try_from(length).map_err(|error| failed(error.to_string()));
    let size = [side(part.size.0)?, side(part.size.1)?];
    let [red, green, blue] = colours.map(|channel| numbers(&channel.sample_data));
    let pixels = red.into_iter().zip(green).zip(blue).map(|((red, green), blue)| [red, green, blue]);
    Ok(Picture { size, pixels: pixels.collect() })
}

#[expect(clippy::cast_precision_loss, reason = "pictures are kept in single precision")]
fn numbers(samples: &FlatSamples) -> Vec<f32> {
    match samples {
        FlatSamples::F16(halves) => halves.iter().map(|half| half.to_f32()).collect(),
        FlatSamples::F32(floats) => floats.clone(),
        FlatSamples::U32(whole) => whole.iter().map(|&whole| whole as f32).collect(),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use exr::prelude::{FlatImage, MetaData, read_all_flat_layers_from_file};
    use glam::DVec3;

    use super::*;
    use crate::film::{Aov, Film, FilmSettings, read_picture};

    fn picture() -> Image {
        let settings = FilmSettings { size: [40, 30], crop: Some([7, 11, 5, 3]), ..FilmSettings::default() };
        let film = Film::try_new(&settings, &Aov::ALL).unwrap();
        let mut image = film.image();
        let count = image.channels().len();
        let values: Vec<f32> = (0..15 * count).map(|i| i as f32 * 0.1 - 3.0).collect();
        image.put_tile(film.window(), &values);
        image
    }

    fn header() -> ExrHeader {
        ExrHeader {
            camera_from_world: DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0)),
            screen_window_width: 0.75,
            scene_hash: "abc".to_owned(),
            seed: u64::MAX,
            spp: 64,
            settings: "{\"object\":\"Würfel 立方体\"}".to_owned(),
        }
    }

    fn write(folder: &Path, name: &str) -> std::path::PathBuf {
        let path = folder.join(name);
        write_exr(&path, &picture(), &header()).unwrap();
        path
    }

    #[test]
    fn channels_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = write(folder.path(), "a.exr");
        let back: FlatImage = read_all_flat_layers_from_file(&path).unwrap();
        assert_eq!(back.layer_data.len(), 1, "one part");
        let image = picture();
        let channels = &back.layer_data[0].channel_data.list;
        assert_eq!(channels.len(), image.channels().len());
        for channel in channels {
            let name = channel.name.to_string();
            let want = image.channel(&name).expect("no channel that was not asked for");
            let FlatSamples::F32(got) = &channel.sample_data else {
                panic!("{name} is not 32-bit float");
            };
            assert_eq!(got, want, "{name}");
        }
        for name in ["R", "A", "depth.T", "st.S", "object.I", "variance.B", "geo_normal.Z"] {
            assert!(channels.iter().any(|c| c.name.eq(name)), "{name}");
        }
    }

    #[test]
    fn pictures_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = write(folder.path(), "a.exr");
        let read = read_picture(&path, false).unwrap();
        assert_eq!(read.size, [5, 3], "the data window");
        let image = picture();
        let colours = ["R", "G", "B"].map(|name| image.channel(name).unwrap());
        for (i, pixel) in read.pixels.iter().enumerate() {
            assert_eq!(*pixel, colours.map(|colour| colour[i]));
        }
        assert_ne!(read.pixels[0], read.pixels[5]);
    }

    fn written_by_the_crate(channels: &[(&str, FlatSamples)]) -> Result<Picture, PictureError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let list = channels.iter().map(|(name, samples)| AnyChannel::new(*name, samples.clone()));
        let channels = AnyChannels::sort(list.collect());
        exr::image::Image::from_channels((2, 1), channels).write().to_file(&path).unwrap();
        read_picture(&path, true)
    }

    #[test]
    fn luminance_halves_and_missing_channels() {
        let halves = [0.5, 0.1].map(exr::prelude::f16::from_f32);
        let grey = written_by_the_crate(&[("Y", FlatSamples::F16(halves.to_vec()))]).unwrap();
        assert_eq!(grey.pixels, [[0.5; 3], [halves[1].to_f32(); 3]]);
        let depth = FlatSamples::F32(vec![1.0, 2.0]);
        let error = written_by_the_crate(&[("Z", depth.clone()), ("R", depth)]).unwrap_err().to_string();
        assert!(
            error.ends_with("a.exr: has the channels R, Z; a picture needs R, G and B, or Y alone"),
            "{error}"
        );
    }

    #[test]
    fn header_says_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = write(folder.path(), "a.exr");
        let meta = MetaData::read_from_file(&path, true).unwrap();
        let part = &meta.headers[0];
        let shared = &part.shared_attributes;
        assert_eq!(shared.display_window, IntegerBounds::new((0, 0), (40, 30)));
        assert_eq!(part.data_window(), IntegerBounds::new((7, 11), (5, 3)));
        assert_eq!(shared.chromaticities, Some(REC_709));
        let own = &part.own_attributes;
        assert!(own.software_name.as_ref().unwrap().to_string().starts_with("trimray "));
        let matrix = own.world_to_camera.unwrap();
        assert_eq!(matrix[12..], [1.0, 2.0, 3.0, 1.0], "row vectors");
        assert_eq!(own.screen_window_width, 0.75);
        let want = [
            ("trimray/version", AttributeValue::Text(text(env!("CARGO_PKG_VERSION")))),
            ("trimray/sceneHash", AttributeValue::Text(text("abc"))),
            ("trimray/seed", AttributeValue::Text(text("18446744073709551615"))),
            ("trimray/spp", AttributeValue::I32(64)),
            ("trimray/settings", AttributeValue::Text(text(&header().settings))),
        ];
        for (name, value) in want {
            assert_eq!(own.other.get(&text(name)), Some(&value), "{name}");
        }
        assert_eq!(own.capture_date, None);
    }

    #[test]
    fn bytes_are_the_same_each_time() {
        let folder = tempfile::tempdir().unwrap();
        let first = fs::read(write(folder.path(), "first.exr")).unwrap();
        for i in 0..8 {
            let again = fs::read(write(folder.path(), "again.exr")).unwrap();
            assert!(first == again, "run {i} differs");
        }
    }

    #[test]
    fn missing_folder_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("none/a.exr");
        let error = write_exr(&path, &picture(), &header()).unwrap_err();
        assert!(matches!(error, OutputError::NoFolder { .. }), "{error}");
    }
}
