//! What can be wrong in an OBJ file, and where.

use thiserror::Error;

/// Most faults that are listed; the others are counted.
pub(super) const MOST_FAULTS: usize = 20;

/// Keywords and pieces of text longer than this are shortened in messages.
pub(super) const LONGEST_QUOTE: usize = 32;

/// A fault of an OBJ file and where it is.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{line}:{column}: {kind}")]
pub struct ObjFault {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong.
    pub kind: FaultKind,
}

/// What can be wrong with a statement.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FaultKind {
    /// Text where a number should be.
    #[error("`{0}` is not a number")]
    NotANumber(String),
    /// NaN, infinite, or too large for a double.
    #[error("`{0}` is not finite")]
    NotFinite(String),
    /// Too few coordinates.
    #[error("`{keyword}` with {found} values; {expected}")]
    ValueCount {
        /// The statement.
        keyword: &'static str,
        /// How many values it has.
        found: usize,
        /// How many it needs.
        expected: &'static str,
    },
    /// A corner that cannot be read.
    #[error("`{0}` is not a corner; valid are v, v/vt, v//vn and v/vt/vn with whole numbers")]
    BadCorner(String),
    /// Vertex index 0.
    #[error("vertex index 0; indices start at 1, or at -1 backwards")]
    ZeroIndex,
    /// A vertex index beyond what the file has.
    #[error("vertex index {index} is out of range; {}", valid_range(*count))]
    OutOfRange {
        /// The index as it stands in the file.
        index: i64,
        /// For a positive index all of the file, for a negative one those before the face.
        count: usize,
    },
}

/// "valid are 1 to 8, or -8 to -1", for the message of an index out of range.
fn valid_range(count: usize) -> String {
    match count {
        0 => "there is no vertex to refer to".to_owned(),
        1 => "there is one vertex: 1, or -1".to_owned(),
        _ => format!("valid are 1 to {count}, or -{count} to -1"),
    }
}

/// The faults found: the first few in the order of the file, and how many more there are.
#[derive(Debug, Default)]
pub(super) struct Faults {
    pub(super) listed: Vec<ObjFault>,
    pub(super) more: usize,
}

impl Faults {
    /// Adds a fault; only the first few of a run in the file's order are kept.
    pub(super) fn push(&mut self, fault: ObjFault) {
        if self.listed.len() < MOST_FAULTS {
            self.listed.push(fault);
        } else {
            self.more += 1;
        }
    }

    /// Both together, in the order of the file.
    pub(super) fn merged(mut self, mut other: Self) -> Self {
        self.listed.append(&mut other.listed);
        self.listed.sort_by_key(|fault| (fault.line, fault.column));
        self.more += other.more + self.listed.len().saturating_sub(MOST_FAULTS);
        self.listed.truncate(MOST_FAULTS);
        self
    }
}

/// A piece of the file for a message: short, and without control characters.
pub(super) fn quote(text: &str) -> String {
    let mut quoted: String =
        text.chars().take(LONGEST_QUOTE).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if text.chars().nth(LONGEST_QUOTE).is_some() {
        quoted.push('…');
    }
    quoted
}
