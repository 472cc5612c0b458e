//! Names that users choose from, and what to say of any other name.

/// The known name that `name` is most likely a misspelling of.
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

/// Index of `name` in `known`.
///
/// # Errors
/// A message with the known names if it is not among them.
pub(crate) fn lookup(what: &str, known: &[&str], name: &str) -> Result<usize, String> {
    if let Some(index) = known.iter().position(|known| *known == name) {
        return Ok(index);
    }
    let list = known.join(", ");
    Err(format!("unknown {what} {} (known: {list}){}", quoted(name), did_you_mean(name, known)))
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
