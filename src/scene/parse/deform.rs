//! `[[object.deform]]`, each kind in a file of its own.

mod extension;
mod ffd;

use crate::analytic::{MAX_FIELDS, Step};
use crate::scene::description::DeformDescription;
use crate::scene::diagnostic::Located;
use crate::scene::reader::Table;

pub use ffd::MAX_CONTROL_POINTS;

/// A kind of deformation.
struct Kind {
    /// The value of `type`.
    name: &'static str,
    /// The keys of its table, `type` first.
    keys: &'static [&'static str],
    /// Why it does not deform meshes, if it does not.
    refuses_meshes: Option<&'static str>,
    /// Reads and checks the table.
    read: fn(Table<'_>) -> Option<DeformDescription>,
}

const KINDS: &[Kind] = &[
    Kind { name: "ffd", keys: ffd::KEYS, refuses_meshes: None, read: ffd::read },
    Kind {
        name: "extension",
        keys: extension::KEYS,
        refuses_meshes: Some("extension functions deform surfaces, and this object is a mesh"),
        read: extension::read,
    },
];

/// Reads and checks the deformations of an object, which may be a surface.
pub(super) fn read_all(tables: Vec<Table<'_>>, is_surface: bool) -> Vec<Located<DeformDescription>> {
    let names: Vec<_> = KINDS.iter().map(|kind| kind.name).collect();
    let mut fields = 0;
    let mut read_one = |mut table: Table<'_>| {
        if !table.has("type") {
            let keys = KINDS.iter().flat_map(|kind| &kind.keys[1..]).copied();
            table.check_keys(&["type"].into_iter().chain(keys).collect::<Vec<_>>());
        }
        let name = table.required_name("type", "deform type", &names)?;
        let location = table.location();
        let kind = KINDS.iter().find(|kind| kind.name == name)?;
        if let Some(reason) = kind.refuses_meshes.filter(|_| !is_surface) {
            table.report_value("type", reason.to_owned());
        }
        let field = table.value("field");
        let value = (kind.read)(table)?;
        if takes_derivatives(&value) {
            fields += 1;
            if let Some(field) = field.filter(|_| fields == MAX_FIELDS + 1) {
                field.report(format!(
                    "more than {MAX_FIELDS} deformations of one object follow a normal or tangents"
                ));
            }
        }
        Some(Located { value, location })
    };
    tables.into_iter().filter_map(&mut read_one).collect()
}

fn takes_derivatives(deform: &DeformDescription) -> bool {
    let DeformDescription::Complete(deformer) = deform else { return false };
    deformer.map().is_some_and(Step::takes_derivatives)
}
