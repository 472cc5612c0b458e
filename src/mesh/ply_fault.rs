//! What can be wrong in a PLY file.

use thiserror::Error;

/// A fault of a PLY file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PlyFault {
    /// It begins with something else.
    #[error("a PLY file begins with a line `ply`")]
    NoMark,
    /// The header does not end.
    #[error("the header has no end: a line `end_header` is needed")]
    NoEnd,
    /// No or another format.
    #[error("format `{0}`; valid are `ascii 1.0`, `binary_little_endian 1.0` and `binary_big_endian 1.0`")]
    Format(String),
    /// A line that means nothing.
    #[error(
        "`{0}` is no statement of a header; valid are format, comment, obj_info, element, property and end_header"
    )]
    Statement(String),
    /// An element without name and number.
    #[error("`{0}`; an element is given as `element NAME COUNT`")]
    Element(String),
    /// A property that cannot be read.
    #[error(
        "`{0}`; a property is given as `property TYPE NAME` or `property list TYPE TYPE NAME` behind its element"
    )]
    Property(String),
    /// A type that there is not.
    #[error(
        "unknown type `{0}`; valid are char, uchar, short, ushort, int, uint, float, double (int8 to float64)"
    )]
    Type(String),
    /// An element that is there twice.
    #[error("a second element `{0}`")]
    Twice(String),
    /// Vertices without a coordinate.
    #[error("element `vertex` has no property `{0}`; x, y and z are needed")]
    NoCoordinate(&'static str),
    /// No vertices, or no faces.
    #[error("has no element `{0}`; `vertex` with x, y, z and `face` with a list `vertex_indices` are needed")]
    NoElement(&'static str),
    /// Faces without their vertices.
    #[error("element `face` has no list of whole numbers `vertex_indices` (or `vertex_index`)")]
    NoIndices,
    /// Triangle strips alone.
    #[error("triangle strips are not read; faces as lists `vertex_indices` are")]
    Strips,
    /// More elements than the file has room for.
    #[error("the header says {count} × {element}, at least {needed} bytes, but only {left} follow")]
    Promise {
        /// The element.
        element: String,
        /// How many there should be.
        count: u64,
        /// Least bytes that they take.
        needed: u64,
        /// Bytes there are.
        left: usize,
    },
    /// The file ends too early.
    #[error("the file ends in {element} {index} of {count}")]
    Ends {
        /// The element.
        element: String,
        /// Which, from 0.
        index: u64,
        /// How many the header says.
        count: u64,
    },
    /// Text where a number should be.
    #[error("`{0}` is not a number")]
    NotANumber(String),
    /// A number that is not whole.
    #[error("`{0}` is not a whole number from 0 on")]
    NotWhole(String),
    /// A list of a length below 0.
    #[error("a list of {0} numbers")]
    Length(i64),
}
