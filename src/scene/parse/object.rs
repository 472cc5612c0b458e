//! `[[object]]`.

use super::material::Materials;
use super::names::Names;
use super::{deform, surface};
use crate::model::{ModelError, Representation};
use crate::scene::description::{ObjectDescription, ObjectShape};
use crate::scene::diagnostic::Located;
use crate::scene::reader::{Table, Value};
use crate::scene::transform;
use crate::suggestion::{did_you_mean, quoted};

/// The names of all objects, also of those with other faults; empty where there is none.
pub(super) fn names(tables: &[Table<'_>]) -> Vec<String> {
    let names = tables.iter().map(|table| table.value("name").and_then(|value| value.text().ok()));
    names.map(|name| name.unwrap_or_default().to_owned()).collect()
}

/// Reads and checks all objects.
pub(super) fn read_all(tables: Vec<Table<'_>>, materials: &Materials) -> Vec<ObjectDescription> {
    let mut names = Names::default();
    tables.into_iter().filter_map(|table| read(table, &mut names, materials)).collect()
}

fn read(mut table: Table<'_>, names: &mut Names, materials: &Materials) -> Option<ObjectDescription> {
    table.check_keys(&[
        "name",
        "mesh",
        "surface",
        "material",
        "materials",
        "transform",
        "normals",
        "method",
        "deform",
    ]);
    let name = names.read(&table);
    let shape = read_shape(&table);
    let material = read_material(&table, materials);
    let by_name = read_materials(&table, materials);
    let transform = transform::read(&table, "transform");
    let normals = table.name_index("normals", "normals", &["face", "vertex"]);
    let method = table
        .optional("method", "\"exact\", \"pointwise:L\", \"adaptive:TOL\" or \"triangular\"", Value::text)
        .and_then(|method| {
            table.converted("method", method.parse::<Representation>().map_err(|error| error.to_string()))
        });
    if table.has("surface") && method.is_some_and(Representation::needs_polygons) {
        table.report_value("method", ModelError::NeedsPolygons.to_string());
    }
    let deform = table.tables("deform", "[[object.deform]]");
    let deform = deform::read_all(deform.unwrap_or_default(), table.has("surface"));
    Some(ObjectDescription {
        name: name?,
        shape: shape?,
        material,
        materials: by_name,
        transform: transform?,
        vertex_normals: normals == Some(1),
        method: method.unwrap_or_default(),
        deform,
    })
}

/// The mesh or the surface, one of which there must be.
fn read_shape(table: &Table<'_>) -> Option<ObjectShape> {
    let file = "the path of an OBJ, PLY, STL or glTF file, from the scene file's folder";
    if !table.has("surface") {
        return table.required_located("mesh", file, Value::path).map(ObjectShape::Mesh);
    }
    if table.has("mesh") {
        table.report_key("surface", "an object has either a mesh or a surface, not both".to_owned());
        return None;
    }
    if table.has("normals") {
        table.report_key("normals", "a surface has its own normals".to_owned());
    }
    let inner = table.table("surface", "a surface")?;
    let surface = surface::read(inner)?;
    let location = table.value("surface")?.location();
    Some(ObjectShape::Surface(Located { value: surface, location }))
}

/// Materials for names of the mesh's file.
fn read_materials(table: &Table<'_>, materials: &Materials) -> Vec<(Located<String>, usize)> {
    let Some(inner) = table.table("materials", "[object.materials]") else { return Vec::new() };
    let refused = match () {
        () if table.has("material") => Some("an object has either a material or materials by name, not both"),
        () if table.has("surface") => Some("materials by name are for meshes, whose files have names"),
        () => None,
    };
    if let Some(message) = refused {
        table.report_key("materials", message.to_owned());
        return Vec::new();
    }
    let keys = inner.keys();
    let read = |name: Located<String>| Some((read_named(&inner, &name.value, materials)?, name));
    keys.into_iter().filter_map(read).map(|(index, name)| (name, index)).collect()
}

/// Index of the object's material.
fn read_material(table: &Table<'_>, materials: &Materials) -> Option<usize> {
    read_named(table, "material", materials)
}

/// Index of the material that a key names.
fn read_named(table: &Table<'_>, key: &str, materials: &Materials) -> Option<usize> {
    let expected = "the name of a [[material]]";
    let name = table.optional(key, expected, Value::text)?;
    let index = materials.names.iter().position(|known| known == name);
    if index.is_none() {
        let known: Vec<&str> = materials.names.iter().map(String::as_str).collect();
        let list = match known.as_slice() {
            [] => "the scene has no [[material]]".to_owned(),
            known => format!("known: {}", known.join(", ")),
        };
        let suggestion = did_you_mean(name, &known);
        let message = format!("unknown material {} ({list}){suggestion}", quoted(name));
        table.report_value(key, message);
    }
    index
}
