//! Materials and lights in a picture's header, by the scene file's names.

use std::borrow::Cow;
use std::path::Path;

use glam::DAffine2;
use serde_json::{Map, Value, json};

use super::digest::Digest;
use crate::choice::Choice;
use crate::film::Picture;
use crate::shade::{
    BitmapSource, Checkerboard, Light, Material, Parameter, Parameters, PictureSource, TextureSource,
};
use crate::trace::TracedObject;

/// All that decides the pixels; of textures' pictures the files' names, without folders.
pub(super) fn material_json(material: &Material) -> Value {
    let mut entries = parameters_json(material.parameters(), &[]);
    entries.insert("type".to_owned(), material.kind().into());
    if let Some(two_sided) = material.two_sided() {
        entries.insert("two_sided".to_owned(), two_sided.into());
    }
    Value::Object(entries)
}

/// All that decides the pixels; of objects that shine their names.
pub(super) fn light_json(light: &Light, objects: &[TracedObject]) -> Value {
    let mut entries = parameters_json(light.parameters(), objects);
    entries.insert("type".to_owned(), light.kind().into());
    if let Some(shape) = light.shape() {
        entries.insert("shape".to_owned(), shape.into());
    }
    Value::Object(entries)
}

fn parameters_json(parameters: Parameters<'_>, objects: &[TracedObject]) -> Map<String, Value> {
    let mut entries = Map::new();
    for (name, parameter) in parameters {
        let value = match parameter {
            Parameter::Number(number) => number.into(),
            Parameter::Flag(flag) => flag.into(),
            Parameter::Name(name) => name.into(),
            Parameter::Colour(value) | Parameter::Point(value) | Parameter::Vector(value) => {
                json!(value.to_array())
            }
            Parameter::Placement(map) => json!(map.to_cols_array()),
            Parameter::ColourTexture(source) | Parameter::NumberTexture(source) => texture_json(source),
            Parameter::Object(object) => objects[object].name.as_str().into(),
            Parameter::Picture(PictureSource::File(path)) => file_name(path).into(),
            // what the file is called does not matter
            Parameter::Picture(PictureSource::Read(picture)) => {
                entries.insert("size".to_owned(), json!(picture.size));
                entries.insert("pixels".to_owned(), picture_hash(picture).into());
                continue;
            }
        };
        entries.insert(name.to_owned(), value);
    }
    entries
}

fn texture_json(texture: &TextureSource) -> Value {
    match texture {
        TextureSource::Uniform(colour) => json!(colour.to_array()),
        TextureSource::Bitmap(BitmapSource { path, channel, filter, wrap, raw, to_uv }) => {
            let mut texture = json!({
                "texture": file_name(path), "filter": filter.name(), "wrap": wrap.name(), "raw": raw,
                "to_uv": columns(to_uv),
            });
            if let Some(channel) = channel {
                texture["channel"] = channel.as_str().into();
            }
            texture
        }
        TextureSource::Checkerboard(Checkerboard { colours: [color0, color1], to_uv }) => json!({
            "checkerboard": {
                "color0": color0.to_array(), "color1": color1.to_array(), "to_uv": columns(to_uv),
            },
        }),
    }
}

fn file_name(path: &Path) -> Cow<'_, str> {
    path.file_name().unwrap_or_default().to_string_lossy()
}

fn columns(map: &DAffine2) -> [f64; 6] {
    map.to_cols_array()
}

/// Hash of a picture's pixels, row by row, red, green, blue, each as a 32-bit float of little endian.
pub(super) fn picture_hash(picture: &Picture) -> String {
    let mut digest = Digest::default();
    picture.pixels.iter().flatten().for_each(|value| digest.bytes(&value.to_le_bytes()));
    digest.finish()
}
