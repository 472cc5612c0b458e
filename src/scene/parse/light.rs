//! `[[light]]`: the names and defaults are Mitsuba's.

use std::collections::HashMap;

use super::parameters::{ParameterTable, each_once};
use crate::scene::diagnostic::{Located, Location};
use crate::scene::reader::Table;
use crate::shade::Light;
use crate::shade::light::LightKind;
use crate::suggestion::quoted;

/// What lights have in common.
struct Lights<'a> {
    /// The names of the scene's objects.
    objects: &'a [String],
    /// Where the light stands that surrounds the scene.
    environment: Option<Location>,
    /// Where the light stands that an object is.
    shining: HashMap<usize, Location>,
}

/// Reads and checks all lights of a scene whose objects have these names.
pub(super) fn read_all(tables: Vec<Table<'_>>, objects: &[String]) -> Vec<Located<Light>> {
    let mut lights = Lights { objects, environment: None, shining: HashMap::new() };
    tables.into_iter().filter_map(|table| lights.read(table)).collect()
}

/// The keys of one kind of light or of several.
fn keys<'k>(kinds: impl IntoIterator<Item = &'k LightKind>) -> Vec<&'static str> {
    each_once(std::iter::once("type").chain(kinds.into_iter().flat_map(|kind| kind.keys).copied()))
}

impl Lights<'_> {
    fn read(&mut self, mut table: Table<'_>) -> Option<Located<Light>> {
        let kind = read_kind(&mut table)?;
        if kind.surrounds {
            self.surround(&table);
        }
        let light = (kind.read)(&ParameterTable { table: &table, objects: self.objects })?;
        if let Light::Object(shining) = &light {
            self.shine(&table, shining.object);
        }
        let location = table.value("file").map_or(table.location(), |file| file.location());
        Some(Located { value: light, location })
    }

    /// Notes that a light surrounds the scene.
    fn surround(&mut self, table: &Table<'_>) {
        if let Some(Location { line, .. }) = self.environment {
            let message = "a scene has one light around it, constant or envmap; the first is in line";
            table.report_value("type", format!("{message} {line}"));
        }
        self.environment = self.environment.or(Some(table.location()));
    }

    /// Notes that an object is a light.
    fn shine(&mut self, table: &Table<'_>, object: usize) {
        if let Some(Location { line, .. }) = self.shining.get(&object) {
            let name = quoted(&self.objects[object]);
            let message = format!("object {name} shines already, by the light in line {line}");
            table.report_value("object", message);
        } else {
            self.shining.insert(object, table.location());
        }
    }
}

/// The kind of a light, by its type and, of area lights, its shape; reports keys that it does not have.
fn read_kind(table: &mut Table<'_>) -> Option<&'static LightKind> {
    if !table.has("type") {
        table.check_keys(&keys(Light::kinds()));
    }
    let names = each_once(Light::kinds().map(|kind| kind.name));
    let name = table.required_name("type", "light type", &names)?;
    let kinds: Vec<_> = Light::kinds().filter(|kind| kind.name == name).collect();
    let kind = match kinds[..] {
        [only] => only,
        _ => {
            if !table.has("shape") {
                table.check_keys(&keys(kinds.iter().copied()));
            }
            let shapes: Vec<_> = kinds.iter().filter_map(|kind| kind.shape).collect();
            let shape = table.required_name("shape", "light shape", &shapes)?;
            kinds.into_iter().find(|kind| kind.shape == Some(shape))?
        }
    };
    table.check_keys(&keys([kind]));
    Some(kind)
}
