//! EXR files; the only file that names the `exr` crate.

use std::io::Cursor;
use std::path::Path;

use exr::compression::Compression;
use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Layer};
use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Chromaticities, IntegerBounds, Text};
use exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use exr::prelude::{ReadChannels, ReadLayers, WritableImage};
use glam::{DMat3, DMat4, DVec3};

use super::image::Image;
use super::layers::{Area, LayeredChannel, LayeredPicture, Numbers, Part, Recorded, SampleKind};
use super::picture::{Picture, PictureError};
use super::picture_limits::{PictureLimits, check_memory, check_promise};
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
    /// `reference/scene`: the hash of the scene's files, if the picture is one that others are tested against.
    pub reference_scene: Option<String>,
}

impl ExrHeader {
    /// What a reader of the file finds recorded.
    #[must_use]
    pub fn recorded(&self) -> Recorded {
        Recorded {
            software: Some(SOFTWARE.to_owned()),
            version: Some(env!("CARGO_PKG_VERSION").to_owned()),
            scene_hash: Some(self.scene_hash.clone()),
            seed: Some(self.seed.to_string()),
            spp: Some(self.spp.to_string()),
            settings: Some(self.settings.clone()),
            reference_scene: self.reference_scene.clone(),
            reference_command: None,
        }
    }
}

/// The attribute `software`.
const SOFTWARE: &str = concat!("trimray ", env!("CARGO_PKG_VERSION"));

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
        software_name: Some(text(SOFTWARE)),
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
    if let Some(hash) = &header.reference_scene {
        attributes.other.insert(text("reference/scene"), AttributeValue::Text(text(hash)));
    }
    Ok(attributes)
}

#[expect(clippy::cast_possible_truncation, reason = "pixels and attributes are 32-bit floats")]
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

/// Whether the second word of the header, the version with its flags, says that there is deep data (OpenEXR File Layout).
fn is_deep(bytes: &[u8]) -> bool {
    bytes.get(5).is_some_and(|flags| flags & 0x08 != 0)
}

/// Refuses what the header says, before the decoder takes memory for it: deep data, luminance and chroma, too many pixels, or
/// more of them than so short a file can hold.
fn check_header(path: &Path, bytes: &[u8], limits: PictureLimits) -> Result<(), PictureError> {
    if is_deep(bytes) {
        return Err(PictureError::Deep { path: path.into() });
    }
    let header = MetaData::read_from_buffered(Cursor::new(bytes), false);
    let header = header.map_err(|error| PictureError::Decode {
        path: path.into(),
        format: "OpenEXR",
        reason: error.to_string(),
    })?;
    for part in &header.headers {
        let has = |name: &str| part.channels.list.iter().any(|channel| channel.name.eq(name));
        if ["Y", "RY", "BY"].into_iter().all(has) {
            return Err(PictureError::LuminanceChroma { path: path.into() });
        }
        let size = [part.layer_size.width() as u64, part.layer_size.height() as u64];
        limits.check(path, size)?;
        check_promise(path, "OpenEXR", size, least_bytes(part), bytes.len() as u64)?;
    }
    // the numbers as decoded, and as 32-bit floats
    let numbers = header.headers.iter().map(|part| {
        let size = (part.layer_size.width() as u64).saturating_mul(part.layer_size.height() as u64);
        size.saturating_mul(part.channels.list.len() as u64)
    });
    check_memory(path, numbers.fold(0, u64::saturating_add).saturating_mul(2 * 4), limits.memory)
}

/// The least number of bytes that a part takes: its table of chunks, and its largest picture as tightly as its method packs.
fn least_bytes(part: &Header) -> u64 {
    // RLE repeats a byte 127 times at most; deflate reaches 1032, after PXR24 has left out a quarter; PIZ and B44 reach less;
    // DWA keeps one of 64 values and deflates that
    let ratio = match part.compression {
        Compression::Uncompressed => 1,
        Compression::RLE => 64,
        Compression::DWAA(_) | Compression::DWAB(_) => 1 << 17,
        _ => 2064,
    };
    let [width, height] = [part.layer_size.width() as u64, part.layer_size.height() as u64];
    let samples = part.channels.list.iter().map(|channel| {
        let [x, y] = [channel.sampling.x().max(1) as u64, channel.sampling.y().max(1) as u64];
        (width / x).saturating_mul(height / y).saturating_mul(channel.sample_type.bytes_per_sample() as u64)
    });
    let pixels = samples.fold(0, u64::saturating_add);
    // the offset of each chunk in the table, then in the chunk itself at least its place and its size
    const CHUNK: u64 = 16;
    (part.chunk_count as u64).saturating_mul(CHUNK).saturating_add(pixels / ratio)
}

/// Decodes the data window of an EXR file's first part: R, G and B, or Y or the only channel for all three.
///
/// Colours of other primaries are converted to Rec. 709, without adaptation to its white, as Mitsuba
/// does.
pub(super) fn decode_picture(
    path: &Path,
    bytes: &[u8],
    limits: PictureLimits,
) -> Result<Picture, PictureError> {
    check_header(path, bytes, limits)?;
    let failed = |reason: String| PictureError::Decode { path: path.into(), format: "OpenEXR", reason };
    let image = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| failed(error.to_string()))?;
    let part = image.layer_data;
    let list = &part.channel_data.list;
    let channel = |name: &str| list.iter().find(|channel| channel.name.eq(name));
    let mut to_rec_709 = None;
    let colours = match ["R", "G", "B"].map(channel) {
        [Some(red), Some(green), Some(blue)] => {
            let primaries = image.attributes.chromaticities.filter(|primaries| *primaries != REC_709);
            to_rec_709 =
                primaries.map(|primaries| xyz_from_rgb(&REC_709).inverse() * xyz_from_rgb(&primaries));
            [red, green, blue]
        }
        // with RY and BY it would be a coloured picture; one channel alone is grey, whatever its name
        _ => match (channel("Y").filter(|_| channel("RY").is_none()), list.as_slice()) {
            (Some(grey), _) | (None, [grey]) => [grey; 3],
            _ => {
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
    let mut pixels: Vec<_> = pixels.collect();
    if let Some(matrix) = to_rec_709 {
        if !matrix.is_finite() {
            return Err(failed("its chromaticities make no colour space".to_owned()));
        }
        for pixel in &mut pixels {
            *pixel = (matrix * DVec3::from_array(pixel.map(f64::from))).to_array().map(to_f32);
        }
    }
    Ok(Picture { size, pixels })
}

/// From a space's colours to CIE XYZ, its white having Y = 1 (SMPTE RP 177-1993).
fn xyz_from_rgb(space: &Chromaticities) -> DMat3 {
    let place = |xy: Vec2<f32>| {
        let (x, y) = (f64::from(xy.x()), f64::from(xy.y()));
        DVec3::new(x, y, 1.0 - x - y)
    };
    let primaries = DMat3::from_cols(place(space.red), place(space.green), place(space.blue));
    let white = place(space.white);
    primaries * DMat3::from_diagonal(primaries.inverse() * (white / white.y))
}

#[expect(clippy::cast_precision_loss, reason = "pictures are kept in single precision")]
fn numbers(samples: &FlatSamples) -> Vec<f32> {
    match samples {
        FlatSamples::F16(halves) => halves.iter().map(|half| half.to_f32()).collect(),
        FlatSamples::F32(floats) => floats.clone(),
        FlatSamples::U32(whole) => whole.iter().map(|&whole| whole as f32).collect(),
    }
}

/// Decodes all parts of an EXR file, with every channel as it is.
pub(super) fn decode_layers(
    path: &Path,
    bytes: &[u8],
    limits: PictureLimits,
) -> Result<LayeredPicture, PictureError> {
    check_header(path, bytes, limits)?;
    let failed = |reason: String| PictureError::Decode { path: path.into(), format: "OpenEXR", reason };
    let image = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| failed(error.to_string()))?;
    let mut notes = Vec::new();
    if let Some(primaries) = image.attributes.chromaticities.filter(|primaries| *primaries != REC_709) {
        let xy = |name, place: Vec2<f32>| format!("{name} {}, {}", place.x(), place.y());
        notes.push(format!(
            "the colours are not of Rec. 709 but of other primaries: {}, {}, {}, {}",
            xy("red", primaries.red),
            xy("green", primaries.green),
            xy("blue", primaries.blue),
            xy("white", primaries.white)
        ));
    }
    let recorded = image.layer_data.first().map(|part| recorded(&part.attributes, &image.attributes));
    let display = image.attributes.display_window;
    let display = area(display.position, display.size)
        .ok_or_else(|| failed("its display window is too large".into()))?;
    let mut parts = Vec::new();
    for part in image.layer_data {
        let data = area(part.attributes.layer_position, part.size);
        let data = data.ok_or_else(|| failed("a data window is too large".to_owned()))?;
        let mut channels = Vec::new();
        for channel in part.channel_data.list {
            let name = string(&channel.name);
            if channel.sampling != Vec2(1, 1) {
                let reason = format!("its channel {name} is subsampled; one sample for each pixel would do");
                return Err(failed(reason));
            }
            let (kind, numbers) = match channel.sample_data {
                samples @ FlatSamples::F16(_) => (SampleKind::Half, Numbers::Real(numbers(&samples))),
                FlatSamples::F32(floats) => (SampleKind::Float, Numbers::Real(floats)),
                FlatSamples::U32(whole) => (SampleKind::Uint, Numbers::Whole(whole)),
            };
            channels.push(LayeredChannel { name, kind, numbers });
        }
        parts.push(Part { name: part.attributes.layer_name.as_ref().map(string), data, channels });
    }
    let recorded = recorded.unwrap_or_default();
    Ok(LayeredPicture { format: "OpenEXR", display, parts, srgb_encoded: false, recorded, notes })
}

fn area(position: Vec2<i32>, size: Vec2<usize>) -> Option<Area> {
    let (width, height) = (i32::try_from(size.0).ok()?, i32::try_from(size.1).ok()?);
    position.0.checked_add(width)?;
    position.1.checked_add(height)?;
    Some(Area { x: position.0, y: position.1, width: width.unsigned_abs(), height: height.unsigned_abs() })
}

/// Text of a file, which is UTF-8 if this program wrote it.
fn string(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

/// What the attributes say of how the picture was made.
fn recorded(part: &LayerAttributes, shared: &ImageAttributes) -> Recorded {
    let attribute = |name: &str| {
        let key = text(name);
        match part.other.get(&key).or_else(|| shared.other.get(&key))? {
            AttributeValue::Text(value) => Some(string(value)),
            AttributeValue::I32(value) => Some(value.to_string()),
            _ => None,
        }
    };
    let own = |name: &str| attribute(&format!("trimray/{name}"));
    Recorded {
        software: part.software_name.as_ref().map(string),
        version: own("version"),
        scene_hash: own("sceneHash"),
        seed: own("seed"),
        spp: own("spp"),
        settings: own("settings"),
        reference_scene: attribute("reference/scene"),
        reference_command: attribute("reference/command"),
    }
}

/// Writes parts with all their channels, ZIP-compressed, without further attributes.
///
/// # Errors
/// If the file cannot be written; nothing is left half-written then.
pub fn write_layers(path: &Path, picture: &LayeredPicture) -> Result<(), OutputError> {
    let bytes = encode_layers(picture);
    let bytes = bytes.map_err(|reason| OutputError::Encode { path: path.into(), reason })?;
    write_whole(path, &bytes)
}

/// The bytes of the file that [`write_layers`] writes.
///
/// # Errors
/// What the encoder says.
pub fn encode_layers(picture: &LayeredPicture) -> Result<Vec<u8>, String> {
    let several = picture.parts.len() > 1;
    let mut layers = Vec::new();
    for (index, part) in picture.parts.iter().enumerate() {
        let list = part.channels.iter().map(|channel| {
            let samples = match &channel.numbers {
                Numbers::Real(values) => FlatSamples::F32(values.clone()),
                Numbers::Whole(values) => FlatSamples::U32(values.clone()),
            };
            AnyChannel::new(text(&channel.name), samples)
        });
        // a file of several parts needs their names
        let name = part.name.clone().or_else(|| several.then(|| format!("part{index}")));
        let attributes = LayerAttributes {
            layer_name: name.map(|name| text(&name)),
            layer_position: Vec2(part.data.x, part.data.y),
            software_name: Some(text(SOFTWARE)),
            ..LayerAttributes::default()
        };
        let size = (part.data.width as usize, part.data.height as usize);
        layers.push(Layer::new(
            size,
            attributes,
            Encoding::SMALL_LOSSLESS,
            AnyChannels::sort(list.collect()),
        ));
    }
    let Area { x, y, width, height } = picture.display;
    let display = IntegerBounds::new((x, y), (width as usize, height as usize));
    let mut file = Cursor::new(Vec::new());
    exr::image::Image::from_layers(ImageAttributes::new(display), layers)
        .write()
        .to_buffered(&mut file)
        .map_err(|error| error.to_string())?;
    Ok(file.into_inner())
}

#[cfg(test)]
mod tests;
