//! `[[material]]`: the names and defaults are Mitsuba's.

use super::names::Names;
use super::parameters::{ParameterTable, each_once};
use crate::scene::description::NamedMaterial;
use crate::scene::reader::Table;
use crate::shade::Material;
use crate::shade::material::MaterialKind;

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

/// The keys that every material has.
const COMMON_KEYS: &[&str] = &["name", "type"];

fn read_material(mut table: Table<'_>) -> Option<Material> {
    let kinds = Material::kinds();
    if !table.has("type") {
        let all = COMMON_KEYS.iter().copied().chain(kinds.iter().flat_map(MaterialKind::keys));
        table.check_keys(&each_once(all));
    }
    let names: Vec<&str> = kinds.iter().map(|kind| kind.name).collect();
    let name = table.required_name("type", "material type", &names)?;
    let kind = kinds.iter().find(|kind| kind.name == name)?;
    table.check_keys(&[COMMON_KEYS, &kind.keys()].concat());
    (kind.read)(&ParameterTable { table: &table, objects: &[] })
}
