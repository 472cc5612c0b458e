//! What the scene format has but this version does not: refused, never ignored.
//!
//! To make one of these available, delete it here and read it in `parse`.

/// A key that this version refuses.
struct LaterKey {
    /// The table it belongs to, as messages name it.
    table: &'static str,
    key: &'static str,
    /// The keys that do its work in this version.
    instead: &'static [&'static str],
    /// Keys that only stand beside it, and are refused with it.
    beside: &'static [&'static str],
}

const KEYS: &[LaterKey] =
    &[LaterKey { table: "[[object]]", key: "surface", instead: &["mesh"], beside: &[] }];

/// Names that this version refuses, by what they choose.
const NAMES: &[(&str, &[&str])] = &[("deform type", &["extension"]), ("method", &["adaptive"])];

/// Kinds of textured colour that this version refuses for lights, written `{ kind = … }`.
pub(super) const TEXTURES: &[&str] = &["texture", "checkerboard"];

/// Most deformations on one object.
pub(super) const MAX_DEFORMATIONS: usize = 1;

/// The keys to use instead, if `key` is one that this version refuses.
pub(super) fn key(table: &str, key: &str) -> Option<&'static [&'static str]> {
    KEYS.iter().find(|later| later.table == table && later.key == key).map(|later| later.instead)
}

/// Whether `key` only stands beside a refused key that `has` finds in the same table.
pub(super) fn beside(table: &str, key: &str, has: impl Fn(&str) -> bool) -> bool {
    KEYS.iter().any(|later| later.table == table && later.beside.contains(&key) && has(later.key))
}

/// Whether `name` is one that this version refuses.
pub(super) fn name(what: &str, name: &str) -> bool {
    NAMES.iter().any(|(later, names)| *later == what && names.contains(&name))
}

/// The message that refuses `thing` and names what there is.
pub(super) fn message(thing: &str, available: &str) -> String {
    format!("{thing} is not available in this version (available: {available})")
}
