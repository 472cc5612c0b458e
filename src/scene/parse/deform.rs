//! `[[object.deform]]`.

use super::{extension, ffd};
use crate::analytic::MAX_FIELDS;
use crate::scene::description::DeformDescription;
use crate::scene::diagnostic::Located;
use crate::scene::reader::Table;

/// Reads and checks the deformations of an object, which may be a surface.
pub(super) fn read_all(tables: Vec<Table<'_>>, is_surface: bool) -> Vec<Located<DeformDescription>> {
    let mut fields = 0;
    let mut read_one = |mut table: Table<'_>| {
        const KINDS: &[&str] = &["ffd", "extension"];
        if !table.has("type") {
            table.check_keys(&[ffd::KEYS, &extension::KEYS[1..]].concat());
        }
        let kind = table.required_name("type", "deform type", KINDS)?;
        let location = table.location();
        let value = if kind == "ffd" {
            DeformDescription::Ffd(ffd::read(table)?)
        } else {
            if !is_surface {
                table.report_value(
                    "type",
                    "extension functions deform surfaces, and this object is a mesh".to_owned(),
                );
            }
            let field = table.value("field");
            let extension = extension::read(table)?;
            if extension.takes_derivatives() {
                fields += 1;
                if let Some(field) = field.filter(|_| fields == MAX_FIELDS + 1) {
                    field.report(format!(
                        "more than {MAX_FIELDS} deformations of one object follow a normal or tangents"
                    ));
                }
            }
            DeformDescription::Extension(extension)
        };
        Some(Located { value, location })
    };
    tables.into_iter().filter_map(&mut read_one).collect()
}
