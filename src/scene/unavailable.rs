//! What the scene format has but this version does not: refused, never ignored.
//!
//! To make one of these available, delete it here and read it in `parse`.

/// Kinds of textured colour that this version refuses for lights, written `{ kind = … }`.
pub(super) const TEXTURES: &[&str] = &["texture", "checkerboard"];

/// The message that refuses `thing` and names what there is.
pub(super) fn message(thing: &str, available: &str) -> String {
    format!("{thing} is not available in this version (available: {available})")
}
