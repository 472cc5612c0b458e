//! Headers of PLY files.
//!
//! Source: Turk (1994), *The PLY Polygon File Format*.

use super::file_error::{MeshFaults, Place};
use super::obj_fault::quote;
use super::ply_fault::PlyFault;

/// How the numbers behind the header are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Types of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of one.
    pub(super) const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Whether it is of whole numbers.
    pub(super) const fn is_whole(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

/// What stands for one name in an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub(super) name: String,
    /// The type of the length, if it is a list.
    pub(super) length: Option<Scalar>,
    pub(super) scalar: Scalar,
}

/// A run of things of one kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// Least bytes of one: with all lists empty.
    pub(super) fn least_size(&self, encoding: Encoding) -> u64 {
        let sizes = self.properties.iter().map(|property| property.length.unwrap_or(property.scalar).size());
        match encoding {
            // a digit and what separates it from the next
            Encoding::Ascii => 2 * self.properties.len() as u64,
            Encoding::LittleEndian | Encoding::BigEndian => sizes.sum::<usize>() as u64,
        }
    }

    /// The property of this name.
    pub(super) fn property(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|property| property.name == name)
    }
}

/// What a header says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Length of the header in bytes.
    pub(super) bytes: usize,
    /// Its number of lines.
    pub(super) lines: usize,
}

impl Header {
    /// Reads the header at the beginning of a file.
    ///
    /// # Errors
    /// All faults of its lines.
    pub(super) fn parse(file: &[u8]) -> Result<Self, MeshFaults> {
        let mut faults = MeshFaults::default();
        let (mut encoding, mut elements) = (None, Vec::new());
        let (mut at, mut number) = (0, 0);
        while at < file.len() {
            let (line, next) = line_at(file, at);
            number += 1;
            at = next;
            let text = String::from_utf8_lossy(line);
            let words: Vec<&str> = text.split_whitespace().collect();
            let place = Place::Line([number, 1]);
            match words.as_slice() {
                ["ply"] if number == 1 => {}
                _ if number == 1 => {
                    faults.push(place, PlyFault::NoMark);
                    return Err(faults);
                }
                ["format", rest @ ..] => {
                    encoding = encoding_named(rest);
                    if encoding.is_none() {
                        faults.push(place, PlyFault::Format(quote(&rest.join(" "))));
                        return Err(faults);
                    }
                }
                [] | ["comment" | "obj_info", ..] => {}
                ["element", rest @ ..] => match element(rest, &text) {
                    Ok(element) if elements.iter().any(|other: &Element| other.name == element.name) => {
                        faults.push(place, PlyFault::Twice(quote(&element.name)));
                    }
                    Ok(element) => elements.push(element),
                    Err(fault) => faults.push(place, fault),
                },
                ["property", rest @ ..] => match (property(rest, &text), elements.last_mut()) {
                    (Ok(property), Some(element)) => element.properties.push(property),
                    (Ok(_), None) => faults.push(place, PlyFault::Property(quote(text.trim()))),
                    (Err(fault), _) => faults.push(place, fault),
                },
                ["end_header"] => {
                    if encoding.is_none() {
                        faults.push(place, PlyFault::Format(String::new()));
                    }
                    return match encoding.filter(|_| faults.is_empty()) {
                        Some(encoding) => Ok(Self { encoding, elements, bytes: at, lines: number }),
                        None => Err(faults),
                    };
                }
                _ => {
                    faults.push(place, PlyFault::Statement(quote(text.trim())));
                    // behind a header without an end there may be much that is none
                    if !faults.has_room() {
                        return Err(faults);
                    }
                }
            }
        }
        faults.push(Place::File, PlyFault::NoEnd);
        Err(faults)
    }
}

/// The line that begins at a byte, without its end (LF, CR LF or CR), and where the next one begins.
fn line_at(file: &[u8], at: usize) -> (&[u8], usize) {
    let rest = &file[at..];
    let length = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(rest.len());
    let end = match rest[length..] {
        [b'\r', b'\n', ..] => 2,
        [] => 0,
        _ => 1,
    };
    (&rest[..length], at + length + end)
}

fn encoding_named(words: &[&str]) -> Option<Encoding> {
    match words {
        ["ascii", "1.0"] => Some(Encoding::Ascii),
        ["binary_little_endian", "1.0"] => Some(Encoding::LittleEndian),
        ["binary_big_endian", "1.0"] => Some(Encoding::BigEndian),
        _ => None,
    }
}

fn element(words: &[&str], line: &str) -> Result<Element, PlyFault> {
    if let [name, count] = words
        && let Ok(count) = count.parse()
    {
        return Ok(Element { name: (*name).to_owned(), count, properties: Vec::new() });
    }
    Err(PlyFault::Element(quote(line.trim())))
}

fn property(words: &[&str], line: &str) -> Result<Property, PlyFault> {
    let scalar = |name: &str| Scalar::named(name).ok_or_else(|| PlyFault::Type(quote(name)));
    match words {
        ["list", length, item, name] => {
            let (length, scalar) = (scalar(length)?, scalar(item)?);
            if !length.is_whole() {
                return Err(PlyFault::Property(quote(line.trim())));
            }
            Ok(Property { name: (*name).to_owned(), length: Some(length), scalar })
        }
        [kind, name] if *kind != "list" => {
            Ok(Property { name: (*name).to_owned(), length: None, scalar: scalar(kind)? })
        }
        _ => Err(PlyFault::Property(quote(line.trim()))),
    }
}
