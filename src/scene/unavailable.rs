//! What the scene format has but this version does not: refused, never ignored.
//!
//! To make one of these available, delete it here and read it in `parse`.

/// Names that this version refuses, by what they choose.
const NAMES: &[(&str, &[&str])] = &[("method", &["adaptive"])];

/// Kinds of textured colour that this version refuses for lights, written `{ kind = … }`.
pub(super) const TEXTURES: &[&str] = &["texture", "checkerboard"];

/// Whether `name` is one that this version refuses.
pub(super) fn name(what: &str, name: &str) -> bool {
    NAMES.iter().any(|(later, names)| *later == what && names.contains(&name))
}

/// The message that refuses `thing` and names what there is.
pub(super) fn message(thing: &str, available: &str) -> String {
    format!("{thing} is not available in this version (available: {available})")
}
