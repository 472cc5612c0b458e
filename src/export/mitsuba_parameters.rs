//! Materials, textures and lights for Mitsuba 3.

use std::io;

use glam::{DAffine2, DAffine3, DMat3, DVec3};

use super::folder::Pictures;
use super::xml::Element;
use crate::choice::Choice;
use crate::shade::{Light, Material, Parameter, Parameters, PictureSource, TextureSource};

/// The plugin of a material.
pub(super) fn bsdf(material: &Material, pictures: &mut Pictures) -> io::Result<Element> {
    let plugin = Element::plugin("bsdf", material.kind());
    let model = with_parameters(plugin, material.mitsuba_parameters(), pictures)?;
    let two_sided = material.two_sided() == Some(true);
    Ok(if two_sided { Element::plugin("bsdf", "twosided").child(model) } else { model })
}

/// The plugin of a light; of an area light the shape, which is black otherwise.
pub(super) fn emitter(light: &Light, pictures: &mut Pictures) -> io::Result<Element> {
    let plugin = Element::plugin("emitter", light.kind());
    let parameters = light.mitsuba_parameters();
    let Some(shape) = light.shape() else { return with_parameters(plugin, parameters, pictures) };
    let is_place = |(_, value): &(_, Parameter<'_>)| matches!(value, Parameter::Placement(_));
    let (place, emission) = parameters.into_iter().partition(is_place);
    let shape = with_parameters(Element::plugin("shape", shape), place, pictures)?;
    Ok(shape
        .child(Element::plugin("bsdf", "diffuse").rgb("reflectance", DVec3::ZERO))
        .child(with_parameters(plugin, emission, pictures)?))
}

/// What makes a shape shine.
pub(super) fn area_emitter(radiance: DVec3) -> Element {
    Element::plugin("emitter", "area").rgb("radiance", radiance)
}

fn with_parameters(
    plugin: Element,
    parameters: Parameters<'_>,
    pictures: &mut Pictures,
) -> io::Result<Element> {
    parameters.into_iter().try_fold(plugin, |element, (name, parameter)| {
        Ok(match parameter {
            Parameter::Number(number) => element.float(name, number),
            Parameter::Flag(flag) => element.boolean(name, flag),
            Parameter::Name(text) => element.string(name, text),
            Parameter::Colour(colour) => element.rgb(name, colour),
            Parameter::Point(point) => element.point(name, point),
            Parameter::Vector(vector) => element.vector(name, vector),
            Parameter::Placement(map) => element.transform(name, &map),
            Parameter::ColourTexture(source) => {
                textured(element, name, source, pictures, |element, colour| element.rgb(name, colour))?
            }
            Parameter::NumberTexture(source) => {
                textured(element, name, source, pictures, |element, number| element.float(name, number.x))?
            }
            Parameter::Picture(PictureSource::File(path)) => element.string(name, &pictures.take(path)?),
            Parameter::Picture(PictureSource::Read(_)) => {
                return Err(io::Error::new(io::ErrorKind::InvalidInput, format!("{name} is in no file")));
            }
            Parameter::Object(_) => element,
        })
    })
}

/// The element with a texture, or with what `uniform` adds for a colour that is the same everywhere.
fn textured(
    element: Element,
    name: &'static str,
    source: &TextureSource,
    pictures: &mut Pictures,
    uniform: impl FnOnce(Element, DVec3) -> Element,
) -> io::Result<Element> {
    let texture = match source {
        TextureSource::Uniform(colour) => return Ok(uniform(element, *colour)),
        TextureSource::Bitmap(bitmap) => {
            // Mitsuba takes no single channel: that is a picture of its own, in linear light
            let (file, raw) = match &bitmap.channel {
                None => (pictures.take(&bitmap.path)?, bitmap.raw),
                Some(channel) => (pictures.take_channel(&bitmap.path, channel, bitmap.raw)?, true),
            };
            Element::plugin("texture", "bitmap")
                .string("filename", &file)
                .string("filter_type", bitmap.filter.name())
                .string("wrap_mode", bitmap.wrap.name())
                .boolean("raw", raw)
                .transform("to_uv", &in_space(&bitmap.to_uv))
        }
        TextureSource::Checkerboard(board) => Element::plugin("texture", "checkerboard")
            .rgb("color0", board.colours[0])
            .rgb("color1", board.colours[1])
            .transform("to_uv", &in_space(&board.to_uv)),
    };
    Ok(element.child(texture.attribute("name", name)))
}

/// A map of the plane as one of space.
fn in_space(map: &DAffine2) -> DAffine3 {
    let [x, y] = [map.matrix2.x_axis, map.matrix2.y_axis].map(|axis| axis.extend(0.0));
    DAffine3::from_mat3_translation(DMat3::from_cols(x, y, DVec3::Z), map.translation.extend(0.0))
}
