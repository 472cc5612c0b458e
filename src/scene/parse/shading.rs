//! `[[light]]`, and names of materials and objects.

use std::collections::HashMap;

use glam::DVec3;

use crate::scene::diagnostic::{Located, Location};
use crate::scene::reader::{Table, Value};
use crate::scene::transform;
use crate::scene::unavailable::{self, TEXTURES};
use crate::shade::Light;

/// Names given so far, so that each is given once.
#[derive(Default)]
pub(super) struct Names {
    given: HashMap<String, Location>,
}

impl Names {
    /// The `name` of a table: not empty, and not given before.
    pub(super) fn read(&mut self, table: &Table<'_>) -> Option<Located<String>> {
        let name = table.required_located("name", "a string that is not empty", |value| {
            value.filled_text().map(str::to_owned)
        })?;
        if let Some(first) = self.given.get(&name.value) {
            let (value, line) = (&name.value, first.line);
            let message = format!("name {value:?} is already taken, in line {line}");
            table.report_value("name", message);
        } else {
            self.given.insert(name.value.clone(), name.location);
        }
        Some(name)
    }
}

/// A colour that may be left out; textures are refused by name.
fn read_colour(table: &Table<'_>, key: &str, expected: &str, test: impl Fn(f64) -> bool) -> Option<DVec3> {
    let value = table.value(key)?;
    if let Ok(kinds) = value.table("a texture")
        && let Some(kind) = TEXTURES.iter().find(|kind| kinds.has(kind))
    {
        value.report(unavailable::message(&format!("{kind:?}"), expected));
        return None;
    }
    table.optional(key, expected, |value| value.rgb(test))
}

/// Reads and checks all lights.
pub(super) fn read_lights(tables: Vec<Table<'_>>) -> Vec<Light> {
    let mut constant: Option<Location> = None;
    let mut lights = Vec::new();
    for table in tables {
        let location = table.location();
        let Some(light) = read_light(table, constant) else {
            continue;
        };
        if matches!(light, Light::Constant { .. }) {
            constant = constant.or(Some(location));
        }
        lights.push(light);
    }
    lights
}

/// One light; `constant` is where a constant light stands already.
fn read_light(mut table: Table<'_>, constant: Option<Location>) -> Option<Light> {
    if !table.has("type") {
        table.check_keys(&["type", "radiance", "intensity", "position", "shape", "to_world"]);
    }
    let kind = table.required_name("type", "light type", &["constant", "point", "area"])?;
    let radiance = |table: &Table<'_>, key| {
        let expected = "a number or [r, g, b], each at least 0";
        read_colour(table, key, expected, |value| value >= 0.0).unwrap_or(DVec3::ONE)
    };
    match kind {
        "constant" => {
            table.check_keys(&["type", "radiance"]);
            if let Some(Location { line, .. }) = constant {
                table.report_value(
                    "type",
                    format!("a scene has one constant light; the first is in line {line}"),
                );
            }
            let radiance = radiance(&table, "radiance");
            Some(Light::Constant { radiance })
        }
        "point" => {
            table.check_keys(&["type", "position", "intensity"]);
            let place = "a point [x, y, z] of finite numbers";
            let position = table.required("position", place, Value::vector);
            let intensity = radiance(&table, "intensity");
            Some(Light::Point { position: position?, intensity })
        }
        _ => {
            table.check_keys(&["type", "shape", "to_world", "radiance"]);
            let shape = table.required_name("shape", "light shape", &["rectangle"]);
            let to_world = transform::read(&table, "to_world");
            let radiance = radiance(&table, "radiance");
            shape?;
            Some(Light::Rectangle { to_world: to_world?, radiance })
        }
    }
}
