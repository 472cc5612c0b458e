//! The bytes of a glTF file's buffers, and the numbers of its accessors.
//!
//! Source: Khronos Group (2021), *glTF 2.0 Specification*, sections 3.6 and 4.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use super::file_error::{MeshFault, Place};
use super::gltf_fault::GltfFault;
use super::gltf_json::{Accessor, Document};
use super::obj_fault::quote;
use crate::input::read_whole;
use crate::memory::{MemoryLimit, Promise};

/// A fault at an element of the document.
pub(super) fn fault(path: String, kind: GltfFault) -> MeshFault {
    MeshFault { place: Place::Element(path), kind: kind.into() }
}

/// An element of a list, or that there is none.
pub(super) fn find<'a, T>(
    list: &'a [T],
    what: &'static str,
    index: usize,
    from: impl FnOnce() -> String,
) -> Result<&'a T, MeshFault> {
    let count = list.len();
    list.get(index).ok_or_else(|| fault(from(), GltfFault::OutOfRange { what, index, count }))
}

/// The text and the binary chunk of a binary file.
pub(super) fn chunks(file: &[u8]) -> Result<(&[u8], Option<&[u8]>), MeshFault> {
    let broken = |message: &str| MeshFault {
        place: Place::File,
        kind: GltfFault::Container(message.to_owned()).into(),
    };
    let word = |at: usize| {
        file.get(at..).and_then(|rest| rest.first_chunk()).map(|&word| u32::from_le_bytes(word) as usize)
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(broken("the file ends in its header"));
    };
    if version != 2 {
        let kind = GltfFault::Version(version.to_string()).into();
        return Err(MeshFault { place: Place::Byte(4), kind });
    }
    if length > file.len() {
        return Err(broken(&format!("the header says {length} bytes, but the file has {}", file.len())));
    }
    let chunk = |at: usize, kind: &[u8; 4]| {
        let length = word(at).filter(|_| file.get(at + 4..at + 8) == Some(kind))?;
        file.get(at + 8..)?.get(..length)
    };
    let text = chunk(12, b"JSON").ok_or_else(|| broken("no whole chunk `JSON` stands at byte 12"))?;
    let next = 12 + 8 + text.len();
    let binary = chunk(next, b"BIN\0");
    if binary.is_none() && file.get(next + 4..next + 8) == Some(b"BIN\0") {
        return Err(broken("the file ends in its chunk `BIN`"));
    }
    Ok((text, binary))
}

/// The bytes of all buffers.
pub(super) struct Buffers<'a> {
    bytes: Vec<Cow<'a, [u8]>>,
    _promises: Vec<Promise>,
}

impl<'a> Buffers<'a> {
    /// Reads the buffers of the document of this path; `binary` is the chunk of a binary file.
    pub(super) fn read(
        document: &Document,
        path: &Path,
        binary: Option<&'a [u8]>,
        memory: MemoryLimit,
    ) -> Result<Self, MeshFault> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut buffers = Self { bytes: Vec::new(), _promises: Vec::new() };
        for (index, buffer) in document.buffers.iter().enumerate() {
            let here = || format!("buffers[{index}]");
            let bytes = match (&buffer.uri, binary) {
                (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
                (None, _) => return Err(fault(here(), GltfFault::NoUri)),
                (Some(uri), _) if uri.starts_with("data:") => {
                    let data = from_data_uri(uri);
                    let data = data.ok_or_else(|| fault(here(), GltfFault::Uri(quote(uri))))?;
                    Cow::Owned(data)
                }
                (Some(uri), _) => {
                    let file = side_file(folder, uri);
                    let file = file.ok_or_else(|| fault(here(), GltfFault::Uri(quote(uri))))?;
                    let length = fs::metadata(&file).map_or(0, |there| there.len());
                    let promise = memory.ask(format_args!("mesh {}", file.display()), length);
                    buffers._promises.push(promise.map_err(|error| fault(here(), error.into()))?);
                    let read = read_whole(&file);
                    Cow::Owned(read.map_err(|error| {
                        fault(here(), GltfFault::Missing { path: file, reason: error.to_string() })
                    })?)
                }
            };
            if (bytes.len() as u64) < buffer.byte_length {
                let (needed, there) = (buffer.byte_length, bytes.len() as u64);
                return Err(fault(
                    here(),
                    GltfFault::TooShort { needed, what: "its data".to_owned(), there },
                ));
            }
            buffers.bytes.push(bytes);
        }
        Ok(buffers)
    }

    /// The numbers of an accessor that is used as something.
    pub(super) fn values<'b>(
        &'b self,
        document: &'b Document,
        index: usize,
        usage: Usage,
    ) -> Result<Values<'b>, MeshFault> {
        let here = || format!("accessors[{index}]");
        let accessor = &document.accessors[index];
        let (component, components) = usage.check(accessor).map_err(|kind| fault(here(), kind))?;
        if accessor.sparse.is_some() {
            return Err(fault(here(), GltfFault::Sparse));
        }
        let view = accessor.buffer_view.ok_or_else(|| fault(here(), GltfFault::NoData))?;
        let of_view = || format!("bufferViews[{view}]");
        let view = find(&document.buffer_views, "bufferView", view, here)?;
        if let Some(name) = view.extensions.keys().find(|name| name.contains("meshopt")) {
            return Err(fault(of_view(), GltfFault::Extension { name: name.clone() }));
        }
        find(&document.buffers, "buffer", view.buffer, of_view)?;
        let buffer = &*self.bytes[view.buffer];
        let too_short = |needed: u64, what: String, there: u64| GltfFault::TooShort { needed, what, there };
        let end = view.byte_offset.saturating_add(view.byte_length);
        if end > buffer.len() as u64 {
            let what = format!("buffers[{}]", view.buffer);
            return Err(fault(of_view(), too_short(end, what, buffer.len() as u64)));
        }
        let size = component.size() as u64 * components as u64;
        let stride = view.byte_stride.unwrap_or(size).max(1);
        let last = accessor.count.saturating_sub(1).saturating_mul(stride).saturating_add(size);
        let needed = if accessor.count == 0 { 0 } else { accessor.byte_offset.saturating_add(last) };
        if needed > view.byte_length {
            return Err(fault(here(), too_short(needed, of_view(), view.byte_length)));
        }
        // all of it is inside of the buffer, whose length is a usize
        let at = |offset: u64| usize::try_from(offset).unwrap_or(usize::MAX);
        let bytes = if needed == 0 { &[] } else { &buffer[at(view.byte_offset + accessor.byte_offset)..] };
        let (stride, count, normalized) = (at(stride), at(accessor.count), accessor.normalized);
        Ok(Values { bytes, stride, count, component, normalized })
    }
}

/// The file that an address leads to; none if it is none.
pub(super) fn side_file(folder: &Path, uri: &str) -> Option<PathBuf> {
    // a scheme, which is longer than a drive's letter
    if uri.is_empty() || uri.split_once(':').is_some_and(|(scheme, _)| scheme.len() > 1) {
        return None;
    }
    let mut bytes = Vec::new();
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let escaped = after.first_chunk::<2>().filter(|_| byte == b'%');
        let escaped = escaped.and_then(|hex| u8::from_str_radix(std::str::from_utf8(hex).ok()?, 16).ok());
        bytes.push(escaped.unwrap_or(byte));
        rest = if escaped.is_some() { &after[2..] } else { after };
    }
    Some(folder.join(String::from_utf8(bytes).ok()?))
}

/// The bytes of `data:…;base64,…`.
fn from_data_uri(uri: &str) -> Option<Vec<u8>> {
    let (kind, text) = uri.split_once(',')?;
    kind.ends_with(";base64").then(|| from_base64(text))?
}

/// Source: Josefsson (2006), RFC 4648, section 4.
fn from_base64(text: &str) -> Option<Vec<u8>> {
    let digits = text.trim_end_matches('=').as_bytes();
    if digits.len() % 4 == 1 || text.len() - digits.len() > 2 {
        return None;
    }
    let value = |digit: u8| {
        Some(match digit {
            b'A'..=b'Z' => digit - b'A',
            b'a'..=b'z' => digit - b'a' + 26,
            b'0'..=b'9' => digit - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        })
    };
    let mut bytes = Vec::with_capacity(digits.len() / 4 * 3 + 2);
    for group in digits.chunks(4) {
        let bits = group.iter().try_fold(0_u32, |bits, &digit| Some(bits << 6 | u32::from(value(digit)?)))?;
        let bits = bits << (6 * (4 - group.len()));
        bytes.extend_from_slice(&bits.to_be_bytes()[1..group.len()]);
    }
    Some(bytes)
}

/// What an accessor's numbers are used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Usage {
    Indices,
    /// Positions and normals.
    Vectors,
    TextureCoordinates,
}

/// Types of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

impl Usage {
    /// The type of the accessor's numbers, and how many there are in one.
    fn check(self, accessor: &Accessor) -> Result<(Component, usize), GltfFault> {
        let component = match accessor.component_type {
            5120 => Some(Component::I8),
            5121 => Some(Component::U8),
            5122 => Some(Component::I16),
            5123 => Some(Component::U16),
            5125 => Some(Component::U32),
            5126 => Some(Component::F32),
            _ => None,
        };
        let (kind, count, expected) = match self {
            Self::Indices => ("SCALAR", 1, "indices are SCALAR of unsigned bytes, shorts or ints"),
            Self::Vectors => ("VEC3", 3, "positions and normals are VEC3 of floats, bytes or shorts"),
            Self::TextureCoordinates => {
                ("VEC2", 2, "texture coordinates are VEC2 of floats, bytes or shorts")
            }
        };
        let is_index =
            |component: &Component| matches!(component, Component::U8 | Component::U16 | Component::U32);
        let fits = |component: &Component| match self {
            Self::Indices => is_index(component),
            Self::Vectors | Self::TextureCoordinates => *component != Component::U32,
        };
        match component.filter(|component| fits(component) && accessor.kind == kind) {
            Some(component) => Ok((component, count)),
            None => {
                let found = format!("{} of componentType {}", quote(&accessor.kind), accessor.component_type);
                Err(GltfFault::Kind { found, expected })
            }
        }
    }
}

/// Numbers in a buffer that has room for all of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Values<'a> {
    bytes: &'a [u8],
    stride: usize,
    pub(super) count: usize,
    component: Component,
    normalized: bool,
}

impl Values<'_> {
    /// The numbers at `index`, which is below the count.
    pub(super) fn reals<const N: usize>(&self, index: usize) -> [f64; N] {
        let start = &self.bytes[index * self.stride..];
        std::array::from_fn(|i| {
            let at = &start[i * self.component.size()..];
            let scaled = |value: f64, greatest: f64| {
                if self.normalized { (value / greatest).max(-1.0) } else { value }
            };
            match self.component {
                Component::I8 => scaled(i8::from_le_bytes([at[0]]).into(), 127.0),
                Component::U8 => scaled(at[0].into(), 255.0),
                Component::I16 => scaled(i16::from_le_bytes([at[0], at[1]]).into(), 32_767.0),
                Component::U16 => scaled(u16::from_le_bytes([at[0], at[1]]).into(), 65_535.0),
                Component::U32 => u32::from_le_bytes([at[0], at[1], at[2], at[3]]).into(),
                Component::F32 => f32::from_le_bytes([at[0], at[1], at[2], at[3]]).into(),
            }
        })
    }

    /// The whole number at `index`, which is below the count.
    pub(super) fn index(&self, index: usize) -> u32 {
        let at = &self.bytes[index * self.stride..];
        match self.component {
            Component::U8 | Component::I8 => at[0].into(),
            Component::U16 | Component::I16 => u16::from_le_bytes([at[0], at[1]]).into(),
            Component::U32 | Component::F32 => u32::from_le_bytes([at[0], at[1], at[2], at[3]]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_standard() {
        for (text, want) in [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYmFy", "foobar")]
        {
            assert_eq!(from_base64(text).as_deref(), Some(want.as_bytes()), "{text}");
        }
        assert_eq!(from_base64("+/8="), Some(vec![0xfb, 0xff]));
        for text in ["Z", "Zg===", "Z$==", "Zm9v\n"] {
            assert_eq!(from_base64(text), None, "{text}");
        }
    }

    #[test]
    fn addresses_are_files_beside() {
        let folder = Path::new("models");
        assert_eq!(side_file(folder, "a%20b/c%C3%A9.bin"), Some("models/a b/cé.bin".into()));
        assert_eq!(side_file(folder, "100%.bin"), Some("models/100%.bin".into()));
        assert_eq!(side_file(folder, "https://example.org/a.bin"), None);
        assert_eq!(side_file(folder, ""), None);
    }
}
