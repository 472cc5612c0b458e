//! `[[material]]`.

use std::collections::HashMap;

use glam::DVec3;

use crate::scene::description::NamedMaterial;
use crate::scene::diagnostic::{Located, Location};
use crate::scene::reader::{Table, Value};
use crate::scene::unavailable::{self, TEXTURES};
use crate::shade::Material;

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

/// The materials of a scene.
pub(super) struct Materials {
    /// Those without fault.
    pub(super) described: Vec<NamedMaterial>,
    /// All names, also of materials with other faults, in the order of `described` if there are no
    /// faults.
    pub(super) names: Vec<String>,
}

/// Reads and checks all materials.
pub(super) fn read_materials(tables: Vec<Table<'_>>) -> Materials {
    let mut names = Names::default();
    let mut materials = Materials { described: Vec::new(), names: Vec::new() };
    for table in tables {
        let name = names.read(&table);
        materials.names.extend(name.iter().map(|name| name.value.clone()));
        if let (Some(name), Some(material)) = (name, read_material(table)) {
            materials.described.push(NamedMaterial { name, material });
        }
    }
    materials
}

fn read_material(mut table: Table<'_>) -> Option<Material> {
    const KEYS: &[&str] = &["name", "type", "reflectance", "two_sided"];
    if !table.has("type") {
        table.check_keys(KEYS);
    }
    table.required_name("type", "material type", &["diffuse"])?;
    table.check_keys(KEYS);
    let expected = "a number or [r, g, b], each in [0, 1]";
    let reflectance = read_colour(&table, "reflectance", expected, |share| (0.0..=1.0).contains(&share));
    let two_sided = table.optional("two_sided", "true or false", Value::boolean);
    let Material::Diffuse { reflectance: default_reflectance, two_sided: default_two_sided } =
        Material::default();
    Some(Material::Diffuse {
        reflectance: reflectance.unwrap_or(default_reflectance),
        two_sided: two_sided.unwrap_or(default_two_sided),
    })
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
