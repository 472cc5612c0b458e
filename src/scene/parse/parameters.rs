//! Tables of lights and materials as sources of parameters.

use std::path::PathBuf;

use glam::{DAffine3, DVec3};

use super::texture;
use crate::scene::reader::{Table, Value};
use crate::scene::transform;
use crate::scene::unavailable::{self, TEXTURES};
use crate::shade::{ParameterSource, TextureRange, TextureSource};
use crate::suggestion::{did_you_mean, quoted};

/// A table whose keys are parameters.
pub(super) struct ParameterTable<'t, 'a> {
    pub(super) table: &'t Table<'a>,
    /// The names of the scene's objects.
    pub(super) objects: &'t [String],
}

impl ParameterSource for ParameterTable<'_, '_> {
    fn has(&self, key: &str) -> bool {
        self.table.has(key)
    }

    fn report_value(&self, key: &str, message: String) {
        self.table.report_value(key, message);
    }

    fn report_key(&self, key: &str, message: String) {
        self.table.report_key(key, message);
    }

    fn flag(&self, key: &str) -> Option<bool> {
        self.table.optional(key, "true or false", Value::boolean)
    }

    fn number(&self, key: &str, expected: &str, accepts: &dyn Fn(f64) -> bool) -> Option<f64> {
        self.table.optional(key, expected, |value| value.number_where(accepts))
    }

    fn colour(&self, key: &str, expected: &str, accepts: &dyn Fn(f64) -> bool) -> Option<DVec3> {
        self.table.optional(key, expected, |value| value.rgb(accepts))
    }

    /// Textures are refused by name.
    fn emission(&self, key: &str) -> DVec3 {
        let expected = "a number or [r, g, b], each at least 0";
        let texture = self.table.value(key).and_then(|value| value.table("a texture").ok());
        if let Some(texture) = texture
            && let Some(kind) = TEXTURES.iter().find(|kind| texture.has(kind))
        {
            self.report_value(key, unavailable::message(&format!("{kind:?}"), expected));
            return DVec3::ONE;
        }
        self.colour(key, expected, &|value| value >= 0.0).unwrap_or(DVec3::ONE)
    }

    fn texture(&self, key: &str, range: TextureRange) -> Option<TextureSource> {
        texture::read(self.table, key, range)
    }

    fn vector(&self, key: &str, expected: &str) -> Option<DVec3> {
        self.table.optional(key, expected, Value::vector)
    }

    fn placement(&self, key: &str) -> Option<DAffine3> {
        transform::read(self.table, key)
    }

    fn text(&self, key: &str) -> Option<&str> {
        self.table.value(key)?.text().ok()
    }

    fn name(&self, key: &str, what: &str, known: &[&'static str]) -> Option<usize> {
        self.table.name_index(key, what, known)
    }

    fn file(&self, key: &str, expected: &str) -> Option<PathBuf> {
        self.table.required(key, expected, Value::path)
    }

    fn object(&self, key: &str) -> Option<usize> {
        let name = self.table.required(key, "the name of an [[object]]", Value::filled_text)?;
        let found = self.objects.iter().position(|known| known == name);
        if found.is_none() {
            let known: Vec<&str> =
                self.objects.iter().map(String::as_str).filter(|name| !name.is_empty()).collect();
            let (list, suggestion) = (known.join(", "), did_you_mean(name, &known));
            let message = format!("unknown object {} (known: {list}){suggestion}", quoted(name));
            self.report_value(key, message);
        }
        found
    }

    fn require(&self, key: &str, expected: &str) {
        self.table.require(key, expected);
    }
}

/// All of the names once, in the order they first come.
pub(super) fn each_once(names: impl IntoIterator<Item = &'static str>) -> Vec<&'static str> {
    let mut once = Vec::new();
    for name in names {
        if !once.contains(&name) {
            once.push(name);
        }
    }
    once
}
