//! Typed reading of TOML that collects faults instead of stopping at the first.
//!
//! A read that fails reports the fault and gives `None`. As a scene with faults is never used, the
//! caller may go on with any value in its place.

use std::cell::RefCell;
use std::ops::RangeInclusive;
use std::path::PathBuf;

use glam::DVec3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::diagnostic::{Diagnostic, Located, Location};
use super::source::Source;
use crate::choice::Choice;
use crate::suggestion::{closest, did_you_mean, lookup, quoted, shortened};

/// The faults found so far.
pub(super) struct Faults<'a> {
    source: &'a Source<'a>,
    found: RefCell<Vec<Diagnostic>>,
}

impl<'a> Faults<'a> {
    pub(super) fn new(source: &'a Source<'a>) -> Self {
        Self { source, found: RefCell::default() }
    }

    /// Reports a fault at a byte of the text.
    pub(super) fn report(&self, byte: usize, message: String) {
        let location = Some(self.source.locate(byte));
        self.push(location, message);
    }

    /// Reports a fault of the file as a whole.
    pub(super) fn report_file(&self, message: String) {
        self.push(None, message);
    }

    fn push(&self, location: Option<Location>, message: String) {
        let file = self.source.path.to_owned();
        self.found.borrow_mut().push(Diagnostic { file, location, message, lacks_memory: false });
    }

    /// All faults in the file's order, those of the whole file last.
    pub(super) fn into_sorted(self) -> Vec<Diagnostic> {
        let mut found = self.found.into_inner();
        found.sort_by_key(|fault| (fault.location.is_none(), fault.location));
        found
    }
}

/// A value that is not what it must be.
pub(super) struct Mismatch {
    byte: usize,
    found: String,
}

/// What a [`Value`] converts to, or all that it is not.
pub(super) type Converted<T> = Result<T, Vec<Mismatch>>;

/// A value in the document.
#[derive(Clone, Copy)]
pub(super) struct Value<'a> {
    node: &'a Spanned<DeValue<'a>>,
    faults: &'a Faults<'a>,
}

impl<'a> Value<'a> {
    pub(super) fn location(self) -> Location {
        self.faults.source.locate(self.node.span().start)
    }

    pub(super) fn report(self, message: String) {
        self.faults.report(self.node.span().start, message);
    }

    /// Refuses the value; the message names what it is.
    pub(super) fn mismatch<T>(self) -> Converted<T> {
        Err(vec![Mismatch { byte: self.node.span().start, found: describe(self.node.get_ref()) }])
    }

    pub(super) fn text(self) -> Converted<&'a str> {
        match self.node.get_ref().as_str() {
            Some(text) => Ok(text),
            None => self.mismatch(),
        }
    }

    /// A text that is not empty.
    pub(super) fn filled_text(self) -> Converted<&'a str> {
        match self.text()? {
            "" => self.mismatch(),
            text => Ok(text),
        }
    }

    /// A path, joined onto the scene file's folder.
    pub(super) fn path(self) -> Converted<PathBuf> {
        let path = self.filled_text()?;
        let folder = self.faults.source.path.parent();
        Ok(folder.map_or_else(|| PathBuf::from(path), |folder| folder.join(path)))
    }

    pub(super) fn boolean(self) -> Converted<bool> {
        match self.node.get_ref() {
            DeValue::Boolean(value) => Ok(*value),
            _ => self.mismatch(),
        }
    }

    /// A finite number.
    pub(super) fn number(self) -> Converted<f64> {
        let number = match self.node.get_ref() {
            DeValue::Integer(_) => self.wide_integer().map(|integer| integer as f64),
            DeValue::Float(float) => float.as_str().parse().ok(),
            _ => None,
        };
        match number {
            Some(number) if number.is_finite() => Ok(number),
            _ => self.mismatch(),
        }
    }

    /// A finite number that passes `test`.
    pub(super) fn number_where(self, test: impl Fn(f64) -> bool) -> Converted<f64> {
        let number = self.number()?;
        if test(number) { Ok(number) } else { self.mismatch() }
    }

    fn wide_integer(self) -> Option<i128> {
        let integer = self.node.get_ref().as_integer()?;
        i128::from_str_radix(integer.as_str(), integer.radix()).ok()
    }

    /// An integer within both the range and the type.
    pub(super) fn integer<T: TryFrom<i128>>(self, range: RangeInclusive<i128>) -> Converted<T> {
        let within = self.wide_integer().filter(|value| range.contains(value));
        match within.and_then(|value| T::try_from(value).ok()) {
            Some(value) => Ok(value),
            None => self.mismatch(),
        }
    }

    /// The elements of an array of any length.
    pub(super) fn elements(self) -> Converted<impl Iterator<Item = Self>> {
        let faults = self.faults;
        match self.node.get_ref().as_array() {
            Some(array) => Ok(array.iter().map(move |node| Self { node, faults })),
            None => self.mismatch(),
        }
    }

    /// An array of `N` elements.
    pub(super) fn array<T, const N: usize>(
        self,
        element: impl Fn(Self) -> Converted<T>,
    ) -> Converted<[T; N]> {
        let mut converted = Vec::with_capacity(N);
        let mut mismatches = Vec::new();
        for result in self.elements()?.map(element) {
            match result {
                Ok(value) => converted.push(value),
                Err(mismatch) => mismatches.extend(mismatch),
            }
        }
        if !mismatches.is_empty() {
            return Err(mismatches);
        }
        converted.try_into().or_else(|_| self.mismatch())
    }

    /// `[x, y, z]`, finite.
    pub(super) fn vector(self) -> Converted<DVec3> {
        self.array(Self::number).map(DVec3::from_array)
    }

    /// `[r, g, b]` or one number for all three, each passing `test`.
    pub(super) fn rgb(self, test: impl Fn(f64) -> bool) -> Converted<DVec3> {
        if self.node.get_ref().is_array() {
            return self.array(|value| value.number_where(&test)).map(DVec3::from_array);
        }
        self.number_where(test).map(DVec3::splat)
    }

    /// Whether this is an array.
    pub(super) fn is_array(self) -> bool {
        self.node.get_ref().is_array()
    }

    /// The table that this is, named `label` in messages.
    pub(super) fn table(self, label: &'static str) -> Converted<Table<'a>> {
        match self.node.get_ref() {
            DeValue::Table(entries) => Ok(Table {
                label,
                byte: self.node.span().start,
                entries,
                faults: self.faults,
                excused: Vec::new(),
            }),
            _ => self.mismatch(),
        }
    }

    /// The result of a conversion, or the fault reported.
    pub(super) fn accept<T>(self, name: &str, expected: &str, converted: Converted<T>) -> Option<T> {
        converted
            .map_err(|mismatches| {
                for Mismatch { byte, found } in mismatches {
                    let message = format!("{name} must be {expected}, not {found}");
                    self.faults.report(byte, message);
                }
            })
            .ok()
    }
}

/// A value as messages name it.
fn describe(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) if text.is_empty() => "an empty string".to_owned(),
        DeValue::String(text) => format!("the string {}", quoted(text)),
        DeValue::Integer(integer) => shortened(&integer.to_string()),
        DeValue::Float(float) => shortened(float.as_str()),
        DeValue::Boolean(boolean) => boolean.to_string(),
        DeValue::Datetime(_) => "a date or time".to_owned(),
        DeValue::Array(array) if array.is_empty() => "an empty array".to_owned(),
        DeValue::Array(array) => format!("an array of {}", array.len()),
        DeValue::Table(_) => "a table".to_owned(),
    }
}

/// A table in the document.
pub(super) struct Table<'a> {
    label: &'static str,
    byte: usize,
    entries: &'a DeTable<'a>,
    faults: &'a Faults<'a>,
    /// Keys that another reported key stands for, so that their absence is not a second fault.
    excused: Vec<&'static str>,
}

impl<'a> Table<'a> {
    /// The whole document.
    pub(super) fn root(entries: &'a DeTable<'a>, faults: &'a Faults<'a>) -> Self {
        Self { label: "the scene", byte: 0, entries, faults, excused: Vec::new() }
    }

    /// Reports every key that is not in `known`.
    pub(super) fn check_keys(&mut self, known: &[&'static str]) {
        for (key, _) in self.entries {
            let (byte, key) = (key.span().start, key.get_ref());
            if known.contains(&key.as_ref()) {
                continue;
            }
            let message = format!(
                "unknown key {} in {} (known: {}){}",
                quoted(key),
                self.label,
                known.join(", "),
                did_you_mean(key, known)
            );
            self.faults.report(byte, message);
            self.excused.extend(closest(key, known));
        }
    }

    /// Whether the absence of `key` is already reported.
    pub(super) fn is_excused(&self, key: &str) -> bool {
        self.excused.contains(&key)
    }

    pub(super) fn location(&self) -> Location {
        self.faults.source.locate(self.byte)
    }

    pub(super) fn report(&self, message: String) {
        self.faults.report(self.byte, message);
    }

    /// Reports a fault of the file as a whole.
    pub(super) fn report_file(&self, message: String) {
        self.faults.report_file(message);
    }

    /// Reports a fault at a key.
    pub(super) fn report_key(&self, key: &str, message: String) {
        let found = self.entries.keys().find(|found| found.get_ref() == key);
        self.faults.report(found.map_or(self.byte, |found| found.span().start), message);
    }

    /// Reports a fault at a key's value, or at the table if the key is not there.
    pub(super) fn report_value(&self, key: &str, message: String) {
        match self.value(key) {
            Some(value) => value.report(message),
            None => self.report(message),
        }
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.value(key).is_some()
    }

    /// All keys, in the order of the file.
    pub(super) fn keys(&self) -> Vec<Located<String>> {
        let mut keys: Vec<_> = self.entries.iter().map(|(key, _)| key).collect();
        keys.sort_by_key(|key| key.span().start);
        let source = self.faults.source;
        keys.into_iter()
            .map(|key| Located {
                value: key.get_ref().to_string(),
                location: source.locate(key.span().start),
            })
            .collect()
    }

    pub(super) fn value(&self, key: &str) -> Option<Value<'a>> {
        let faults = self.faults;
        self.entries.get(key).map(|node| Value { node, faults })
    }

    /// The value of a key that may be left out.
    pub(super) fn optional<T>(
        &self,
        key: &str,
        expected: &str,
        convert: impl FnOnce(Value<'a>) -> Converted<T>,
    ) -> Option<T> {
        let value = self.value(key)?;
        value.accept(key, expected, convert(value))
    }

    /// The value of a key that must be there.
    pub(super) fn required<T>(
        &self,
        key: &str,
        expected: &str,
        convert: impl FnOnce(Value<'a>) -> Converted<T>,
    ) -> Option<T> {
        self.require(key, expected);
        self.optional(key, expected, convert)
    }

    /// Reports `key` if it is not there.
    pub(super) fn require(&self, key: &str, expected: &str) {
        if !self.has(key) && !self.is_excused(key) {
            self.report(format!("{} needs {key}: {expected}", self.label));
        }
    }

    /// Whether a list of tables has none.
    pub(super) fn lacks(&self, key: &str) -> bool {
        match self.entries.get(key).map(Spanned::get_ref) {
            Some(DeValue::Array(array)) => array.is_empty(),
            Some(_) => false,
            None => !self.is_excused(key),
        }
    }

    /// As [`Table::required`], with the place of the value.
    pub(super) fn required_located<T>(
        &self,
        key: &str,
        expected: &str,
        convert: impl FnOnce(Value<'a>) -> Converted<T>,
    ) -> Option<Located<T>> {
        let value = self.required(key, expected, convert)?;
        let location = self.value(key)?.location();
        Some(Located { value, location })
    }

    /// A value chosen by name that may be left out.
    pub(super) fn choice<C: Choice>(&self, key: &str) -> Option<C> {
        let names = C::names();
        self.name_index(key, C::WHAT, &names).map(|index| C::ALL[index])
    }

    /// A value chosen by name that must be there.
    pub(super) fn required_choice<C: Choice>(&self, key: &str) -> Option<C> {
        self.require(key, &one_of(&C::names()));
        self.choice(key)
    }

    /// The text of a key that must be there and must be one of `known`.
    pub(super) fn required_name(
        &self,
        key: &str,
        what: &str,
        known: &[&'static str],
    ) -> Option<&'static str> {
        self.require(key, &one_of(known));
        self.name_index(key, what, known).map(|index| known[index])
    }

    /// Index of a key's text in `known`.
    pub(super) fn name_index(&self, key: &str, what: &str, known: &[&str]) -> Option<usize> {
        let name = self.optional(key, &one_of(known), Value::text)?;
        self.converted(key, lookup(what, known, name))
    }

    /// The result of a conversion that has its own message.
    pub(super) fn converted<T>(&self, key: &str, result: Result<T, impl ToString>) -> Option<T> {
        result.map_err(|error| self.report_value(key, error.to_string())).ok()
    }

    /// The table under a key that may be left out.
    pub(super) fn table(&self, key: &str, label: &'static str) -> Option<Self> {
        let expected = format!("a table, {label}");
        self.optional(key, &expected, |value| value.table(label))
    }

    /// The list of tables under a key that may be left out.
    pub(super) fn tables(&self, key: &str, label: &'static str) -> Option<Vec<Self>> {
        let value = self.value(key)?;
        let expected = format!("a list of tables, each headed {label}");
        if let Ok(table) = value.table(label) {
            // most likely single brackets: its content still shows what else is wrong
            value.report(format!("{key} must be {expected}, not a single table: double the brackets"));
            return Some(vec![table]);
        }
        let elements = value.accept(key, &expected, value.elements())?;
        let tables =
            elements.filter_map(|element| element.accept(key, &expected, element.table(label))).collect();
        Some(tables)
    }
}

fn one_of(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("{name:?}")).collect();
    match quoted.as_slice() {
        [only] => only.clone(),
        several => format!("one of {}", several.join(", ")),
    }
}
