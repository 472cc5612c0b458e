//! Names that users choose from, and what to say of any other name.

use thiserror::Error;

/// The known name that `name` is most likely a misspelling of.
#[must_use]
pub fn closest<'k>(name: &str, known: &[&'k str]) -> Option<&'k str> {
    // a name far longer than any other is no misspelling, and the distance costs its square
    if name.len() > 64 {
        return None;
    }
    let name = name.to_lowercase();
    known
        .iter()
        .map(|known| (strsim::damerau_levenshtein(&name, &known.to_lowercase()), *known))
        // a third of the letters wrong still reads as the word meant; one of two does not
        .filter(|(distance, known)| *distance <= known.chars().count().div_ceil(3).min(3))
        .filter(|(distance, known)| *distance < known.chars().count())
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, known)| known)
}

/// `; did you mean "…"?`, or nothing.
pub fn did_you_mean(name: &str, known: &[&str]) -> String {
    closest(name, known).map_or_else(String::new, |known| format!("; did you mean {known:?}?"))
}

/// A name that is not among the known ones.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("unknown {what} {} (known: {}){suggestion}", quoted(.name), .known.join(", "))]
pub struct UnknownName {
    /// What was to be chosen.
    what: String,
    /// The name given.
    name: String,
    /// The names that there are.
    known: Vec<String>,
    /// Which of them was most likely meant, as the end of the message; may be empty.
    suggestion: String,
}

impl UnknownName {
    /// The error of `name` where one of `known` must stand.
    pub(crate) fn new(what: &str, known: &[&str], name: &str) -> Self {
        Self {
            what: what.to_owned(),
            name: name.to_owned(),
            known: known.iter().map(|&known| known.to_owned()).collect(),
            suggestion: did_you_mean(name, known),
        }
    }
}

/// Index of `name` in `known`.
///
/// # Errors
/// If it is not among them.
pub(crate) fn lookup(what: &str, known: &[&str], name: &str) -> Result<usize, UnknownName> {
    known.iter().position(|known| *known == name).ok_or_else(|| UnknownName::new(what, known, name))
}

/// A user's text in quotes, on one line and shortened.
pub(crate) fn quoted(text: &str) -> String {
    format!("{:?}", shortened(text))
}

/// The beginning of a user's text.
pub(crate) fn shortened(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut shown: String = text.chars().take(LONGEST).collect();
    if shown.len() < text.len() {
        shown.push('…');
    }
    shown
}
