//! Colours and numbers that may be textures.

use glam::{DAffine2, DMat2, DVec2};

use crate::math::angle::sin_cos_deg;
use crate::scene::reader::{Converted, Table, Value};
use crate::shade::{BitmapSource, Checkerboard, TextureRange, TextureSource};

/// A texture, or a colour or number of the range.
pub(super) fn read(table: &Table<'_>, key: &str, range: TextureRange) -> Option<TextureSource> {
    if let Ok(texture) = table.value(key)?.table("a texture") {
        return read_texture(texture);
    }
    let expected = match range {
        TextureRange::Colour => "a number or [r, g, b], each in [0, 1], or a texture",
        TextureRange::Share => "a number in [0, 1], or a texture",
        TextureRange::Roughness => "a number of at least 0, or a texture",
    };
    table.optional(key, expected, |value| match range {
        TextureRange::Colour => value.rgb(is_share).map(TextureSource::from),
        TextureRange::Share => value.number_where(is_share).map(TextureSource::from),
        TextureRange::Roughness => value.number_where(|alpha| alpha >= 0.0).map(TextureSource::from),
    })
}

fn is_share(value: f64) -> bool {
    (0.0..=1.0).contains(&value)
}

fn read_texture(mut table: Table<'_>) -> Option<TextureSource> {
    const BITMAP: &[&str] = &["texture", "channel", "filter", "wrap", "raw", "to_uv"];
    const BOARD: &[&str] = &["checkerboard"];
    if table.has("checkerboard") {
        table.check_keys(BOARD);
        let board = table
            .required("checkerboard", "a table, empty for Mitsuba's colours", |v| v.table("checkerboard"))?;
        return read_board(board).map(TextureSource::Checkerboard);
    }
    table.check_keys(&[BITMAP, BOARD].concat());
    if !table.has("texture") {
        if !table.is_excused("texture") && !table.is_excused("checkerboard") {
            table.report("a texture needs texture = \"a file\" or checkerboard = {}".to_owned());
        }
        return None;
    }
    let path = table.required("texture", "the path of a picture, from the scene file's folder", Value::path);
    let channel = table.optional("channel", "the name of a channel, such as \"R\"", Value::filled_text);
    let (filter, wrap) = (table.choice("filter"), table.choice("wrap"));
    let raw = table.optional("raw", "true or false", Value::boolean);
    let to_uv = read_to_uv(&table);
    Some(TextureSource::Bitmap(BitmapSource {
        path: path?,
        channel: channel.map(str::to_owned),
        filter: filter.unwrap_or_default(),
        wrap: wrap.unwrap_or_default(),
        raw: raw.unwrap_or_default(),
        to_uv: to_uv?,
    }))
}

fn read_board(mut table: Table<'_>) -> Option<Checkerboard> {
    table.check_keys(&["color0", "color1", "to_uv"]);
    let expected = "a number or [r, g, b], each in [0, 1]";
    let [first, second] =
        ["color0", "color1"].map(|key| table.optional(key, expected, |value| value.rgb(is_share)));
    let default = Checkerboard::default();
    let colours = [first.unwrap_or(default.colours[0]), second.unwrap_or(default.colours[1])];
    read_to_uv(&table).map(|to_uv| Checkerboard { colours, to_uv })
}

/// The kinds of step.
const STEPS: &[&str] = &["scale", "rotate", "translate"];

/// The map that the steps compose to, first step first; the identity without any.
fn read_to_uv(table: &Table<'_>) -> Option<DAffine2> {
    let expected = "a list of steps, such as [ { scale = 2.0 }, { rotate = 45 }, { translate = [0.5, 0] } ]";
    let Some(value) = table.value("to_uv") else {
        return Some(DAffine2::IDENTITY);
    };
    let steps: Vec<_> = value.accept("to_uv", expected, value.elements())?.map(read_step).collect();
    let steps: Option<Vec<DAffine2>> = steps.into_iter().collect();
    let composed = steps?.into_iter().fold(DAffine2::IDENTITY, |before, step| step * before);
    if !composed.is_finite() {
        value.report("the steps of to_uv together overflow double precision".to_owned());
        return None;
    }
    Some(composed)
}

fn read_step(step: Value<'_>) -> Option<DAffine2> {
    let expected = "a list of steps, each a table such as { scale = 2.0 }";
    let mut table = step.accept("to_uv", expected, step.table("a step of to_uv"))?;
    table.check_keys(STEPS);
    let kinds: Vec<&str> = STEPS.iter().copied().filter(|kind| table.has(kind)).collect();
    match kinds.as_slice() {
        [] => {
            if !STEPS.iter().any(|kind| table.is_excused(kind)) {
                table.report(format!("a step of to_uv needs one of {}", STEPS.join(", ")));
            }
            None
        }
        ["scale"] => {
            table.required("scale", "a number or [u, v], without 0", scale).map(DAffine2::from_scale)
        }
        ["rotate"] => {
            let (sin, cos) =
                sin_cos_deg(table.required("rotate", "a finite number of degrees", Value::number)?);
            Some(DAffine2::from_mat2(DMat2::from_cols(DVec2::new(cos, sin), DVec2::new(-sin, cos))))
        }
        [_] => table
            .required("translate", "[u, v] of finite numbers", |value| value.array(Value::number))
            .map(|offset: [f64; 2]| DAffine2::from_translation(offset.into())),
        [first, second, ..] => {
            let message =
                format!("a step of to_uv does one thing, not {first} and {second}: write two steps");
            table.report_key(second, message);
            None
        }
    }
}

/// Factors along u and v.
fn scale(value: Value<'_>) -> Converted<DVec2> {
    let factor = |value: Value<'_>| value.number_where(|factor| factor != 0.0);
    if value.is_array() {
        value.array(factor).map(DVec2::from_array)
    } else {
        factor(value).map(DVec2::splat)
    }
}
