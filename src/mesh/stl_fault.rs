//! What can be wrong in an STL file.

use thiserror::Error;

/// A fault of an STL file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StlFault {
    /// Shorter than a header, and no text.
    #[error(
        "{0} bytes are no STL file: a binary one has a header of 80 bytes and a number of triangles, one in text begins with `solid`"
    )]
    TooShort(usize),
    /// The number of triangles does not fit the file.
    #[error(
        "the header says {said} triangles, which take {} bytes, but the file has {bytes}{}", 84 + 50 * u64::from(*said), fitting(*bytes)
    )]
    Promise {
        /// Number of triangles that the file gives.
        said: u32,
        /// Length of the file.
        bytes: usize,
    },
    /// A word in the wrong place.
    #[error("`{found}` where `{expected}` is needed")]
    Word {
        /// What is there.
        found: String,
        /// What should be.
        expected: &'static str,
    },
    /// Text where a number should be.
    #[error("`{0}` is not a number")]
    NotANumber(String),
    /// The file ends within a facet.
    #[error("the file ends where `{0}` is needed")]
    Ends(&'static str),
    /// Fewer or more corners than a triangle has.
    #[error("a facet with {0} vertices; 3 are needed")]
    Corners(usize),
}

/// How many triangles a file of so many bytes has room for, as the end of a message.
fn fitting(bytes: usize) -> String {
    let rest = bytes.saturating_sub(84);
    if rest.is_multiple_of(50) { format!(", those of {}", rest / 50) } else { String::new() }
}
