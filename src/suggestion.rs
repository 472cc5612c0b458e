//! What a misspelt name may have been meant to be.

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
