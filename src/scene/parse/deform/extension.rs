//! `[[object.deform]]` of type "extension", and its regions.

use glam::{DMat3, DVec3};

use crate::analytic::{Expression, Extension, ExtensionMode, Field, Region};
use crate::scene::description::DeformDescription;
use crate::scene::reader::{Converted, Table, Value};
use crate::suggestion::quoted;

pub(super) const KEYS: &[&str] = &["type", "mode", "center", "axes", "field", "region"];

const REGION_KEYS: &[&str] = &["bound", "center", "index", "h", "epsilon", "factor"];

const MODES: &[&str] = &["operator", "radial", "field"];

const FIELDS: &[&str] = &["normal", "tangent_u", "tangent_v"];

const POINT: &str = "a point [x, y, z] of finite numbers";

/// The greatest index: above it, extension functions are 1 but for rounding nearly everywhere.
const MAX_INDEX: i128 = 32;

/// Three unit axes whose volume is below this are taken for dependent.
const LEAST_VOLUME: f64 = 1e-4;

/// Reads and checks a deformation.
pub(super) fn read(mut table: Table<'_>) -> Option<DeformDescription> {
    table.check_keys(KEYS);
    let mode = table.required_name("mode", "mode", MODES);
    let center = table.optional("center", POINT, Value::vector);
    let regions = table.tables("region", "[[object.deform.region]]");
    if table.lacks("region") {
        table.report("an extension needs at least one [[object.deform.region]] with its bound".to_owned());
    }
    for (key, of_mode, why) in [
        ("axes", "operator", "axes are those of mode = \"operator\""),
        ("field", "field", "a field is that of mode = \"field\""),
    ] {
        if let Some(mode) = mode.filter(|mode| table.has(key) && *mode != of_mode) {
            table.report_key(key, format!("{why}, not of mode = {mode:?}"));
        }
    }
    if mode == Some("field") && table.has("center") {
        table.report_key("center", "mode = \"field\" has no center".to_owned());
    }
    let center = center.unwrap_or_default();
    let count = regions.as_ref().map_or(0, Vec::len);
    let read: Vec<_> = regions
        .unwrap_or_default()
        .into_iter()
        .filter_map(|region| read_region(region, mode, center))
        .collect();
    let mode = match mode? {
        "operator" => ExtensionMode::Operator { center, axes: read_axes(&table)? },
        "radial" => ExtensionMode::Radial,
        _ => ExtensionMode::Field(read_field(&table)?),
    };
    if count == 0 || read.len() < count {
        return None;
    }
    match Extension::try_new(mode, read) {
        Ok(extension) => Some(DeformDescription::Complete(extension.into())),
        Err(error) => {
            table.report(error.to_string());
            None
        }
    }
}

fn read_axes(table: &Table<'_>) -> Option<DMat3> {
    let expected = "three vectors [[x, y, z], [x, y, z], [x, y, z]] of finite numbers, none of them 0";
    let Some(axes) = table.optional("axes", expected, |value| {
        value.array(|axis| {
            let vector = axis.vector()?;
            vector.try_normalize().map_or_else(|| axis.mismatch(), Ok)
        })
    }) else {
        return (!table.has("axes")).then_some(DMat3::IDENTITY);
    };
    let [x, y, z]: [DVec3; 3] = axes;
    let axes = DMat3::from_cols(x, y, z);
    if axes.determinant().abs() <= LEAST_VOLUME {
        let message =
            "axes are dependent: they lie in one plane, so that no point has coordinates along them";
        table.report_value("axes", message.to_owned());
        return None;
    }
    Some(axes)
}

fn read_field(table: &Table<'_>) -> Option<Field> {
    let expected = "\"normal\", \"tangent_u\", \"tangent_v\", a vector [x, y, z] or three expressions [\"…\", \"…\", \"…\"]";
    let Some(value) = table.value("field") else {
        table.report(format!("mode = \"field\" needs field: {expected}"));
        return None;
    };
    if value.text().is_ok() {
        let index = table.name_index("field", "field", FIELDS)?;
        let [normal, tangent_u, tangent_v] = [Field::Normal, Field::TangentU, Field::TangentV];
        return Some(if index == 0 {
            normal
        } else if index == 1 {
            tangent_u
        } else {
            tangent_v
        });
    }
    if value.elements().is_ok_and(|mut elements| elements.any(|element| element.text().is_ok())) {
        let texts: [&str; 3] = value.accept("field", expected, value.array(Value::text))?;
        let parts = texts.map(|text| parse(value, "field", text));
        let [Some(x), Some(y), Some(z)] = parts else { return None };
        return Some(Field::Expressions(Box::new([x, y, z])));
    }
    let vector = value.accept("field", expected, value.vector())?;
    if vector.try_normalize().is_none() {
        value.report("field is [0, 0, 0], which has no direction".to_owned());
        return None;
    }
    Some(Field::Constant(vector))
}

fn read_region(mut table: Table<'_>, mode: Option<&str>, center: DVec3) -> Option<Region> {
    table.check_keys(REGION_KEYS);
    let bound = expression(&table, "bound", true);
    let factor = expression(&table, "factor", false);
    let index: Option<u32> = table.required(
        "index",
        &format!("an integer from 2 to {MAX_INDEX}: derivatives of lower order are kept"),
        |value| value.integer(2..=MAX_INDEX),
    );
    let h = table.required("h", "a number, [h11, h22, h33], or three rows of three numbers", matrix);
    let epsilon = table.optional("epsilon", "three rows of three signs, +1 or -1", |value| {
        value.array(|row| row.array(|sign| sign.number_where(|sign| sign.abs() == 1.0)))
    });
    let is_off = |epsilon: &[[f64; 3]; 3]| (0..3).any(|i| epsilon[i][i] != 1.0);
    if epsilon.as_ref().is_some_and(is_off) {
        let message = "epsilon has the signs off the diagonal; on it they are 1 always";
        table.report_value("epsilon", message.to_owned());
    }
    if mode == Some("radial") && table.has("epsilon") {
        table.report_key("epsilon", "mode = \"radial\" has no epsilon".to_owned());
    }
    let own = table.optional("center", POINT, Value::vector);
    if mode.is_some_and(|mode| mode != "radial") && table.has("center") {
        let message = "a region has a center of its own in mode = \"radial\" alone";
        table.report_key("center", message.to_owned());
    }
    if let Some(h) = h.filter(|_| mode == Some("radial")) {
        let alike = h[0][0] == h[1][1] && h[1][1] == h[2][2];
        let diagonal = (0..9).all(|k| k / 3 == k % 3 || h[k / 3][k % 3] == 0.0);
        if !alike || !diagonal {
            table.report_value(
                "h",
                "mode = \"radial\" stretches alike along all axes: h is one number".to_owned(),
            );
        }
    }
    if (factor.is_none() && table.has("factor")) || (epsilon.is_none() && table.has("epsilon")) {
        return None;
    }
    Some(Region {
        bound: bound?,
        center: own.unwrap_or(center),
        index: index?,
        h: h?,
        epsilon: epsilon.unwrap_or([[1.0; 3]; 3]),
        factor,
    })
}

/// One number or three for the diagonal, or a whole matrix.
fn matrix(value: Value<'_>) -> Converted<[[f64; 3]; 3]> {
    let diagonal = |[a, b, c]: [f64; 3]| [[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]];
    if !value.is_array() {
        return value.number().map(|h| diagonal([h; 3]));
    }
    if value.elements()?.any(Value::is_array) {
        return value.array(|row| row.array(Value::number));
    }
    value.array(Value::number).map(diagonal)
}

fn expression(table: &Table<'_>, key: &str, required: bool) -> Option<Expression> {
    let expected = "an expression of u and v, such as \"(u-0.5)^2 + (v-0.5)^2 - 0.04\"";
    let text = if required {
        table.required(key, expected, Value::text)
    } else {
        table.optional(key, expected, Value::text)
    };
    parse(table.value(key)?, key, text?)
}

/// An expression at a value, or the fault reported there.
fn parse(value: Value<'_>, key: &str, text: &str) -> Option<Expression> {
    Expression::parse(text).map_err(|error| value.report(format!("{key} {}, {error}", quoted(text)))).ok()
}
