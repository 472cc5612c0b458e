//! Names of materials and objects.

use std::collections::HashMap;

use crate::scene::diagnostic::{Located, Location};
use crate::scene::reader::Table;

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
