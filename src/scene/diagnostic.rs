//! What is wrong with a scene file, and where.

use std::fmt;
use std::path::PathBuf;

use thiserror::Error;

/// A place in a text file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Location {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

/// A value and where the scene file gives it, for faults that only show later.
#[derive(Clone, Debug, PartialEq)]
pub struct Located<T> {
    /// The value.
    pub value: T,
    /// Where it stands in the scene file.
    pub location: Location,
}

/// One fault of a scene file.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Diagnostic {
    /// The file at fault.
    pub file: PathBuf,
    /// The place in it; none if the file as a whole is at fault.
    pub location: Option<Location>,
    /// What is wrong, and what would be valid; one line.
    pub message: String,
    /// Whether nothing is wrong with the file but that there is too little memory for it.
    pub lacks_memory: bool,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(Location { line, column }) = self.location {
            write!(f, ":{line}:{column}")?;
        }
        write!(f, ": {}", self.message)
    }
}

/// All faults of a scene file, in the file's order; shown one per line.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}", one_per_line(.diagnostics))]
pub struct SceneError {
    /// The faults, at least one.
    pub diagnostics: Vec<Diagnostic>,
}

impl SceneError {
    /// Whether nothing is wrong but that there is too little memory.
    #[must_use]
    pub fn lacks_memory(&self) -> bool {
        self.diagnostics.iter().all(|diagnostic| diagnostic.lacks_memory)
    }
}

impl From<Diagnostic> for SceneError {
    fn from(diagnostic: Diagnostic) -> Self {
        Self { diagnostics: vec![diagnostic] }
    }
}

fn one_per_line(diagnostics: &[Diagnostic]) -> String {
    let lines: Vec<String> = diagnostics.iter().map(Diagnostic::to_string).collect();
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shows_file_line_and_column() {
        let located = Diagnostic {
            file: PathBuf::from("scenes/wave.toml"),
            location: Some(Location { line: 12, column: 7 }),
            message: "a fault".to_owned(),
            lacks_memory: false,
        };
        let whole = Diagnostic { location: None, ..located.clone() };
        assert_eq!(located.to_string(), "scenes/wave.toml:12:7: a fault");
        assert_eq!(whole.to_string(), "scenes/wave.toml: a fault");
        let error = SceneError { diagnostics: vec![located, whole] };
        assert_eq!(error.to_string(), "scenes/wave.toml:12:7: a fault\nscenes/wave.toml: a fault");
    }
}
