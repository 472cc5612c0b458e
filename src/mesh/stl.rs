//! STL files, in binary and in text; corners at the same place become one vertex.
//!
//! Read here and not by a crate: `stl_io` keeps every triangle in single precision before it joins corners, in text as well,
//! and stops at the first fault without its place.
//!
//! Source: 3D Systems (1989), *Stereo Lithography Interface Specification*.

use std::collections::HashMap;

use glam::DVec3;

use super::file_error::{MeshFaults, Place, ReadError};
use super::finish::Reading;
use super::obj_fault::quote;
use super::ply_numbers::{Text, number};
use super::polygon_mesh::NONE;
use super::stl_fault::StlFault;
use crate::memory::MemoryLimit;

/// Bytes of a binary file before its first triangle.
const HEADER: usize = 84;

/// Bytes of a triangle in a binary file: normal, corners, and two for whatever a program likes.
const TRIANGLE: usize = 50;

/// Bytes that a triangle takes, if half a vertex is its own: as of closed meshes.
const TRIANGLE_BYTES: u64 = 3 * 4 + 4 + 24 / 2 + 40;

/// Least bytes of a triangle in text.
const SHORTEST_FACET: usize = 80;

/// Whether the length is that of as many triangles as stand behind the header of 80 bytes; in text that number is much larger.
pub(super) fn is_binary_stl(bytes: &[u8]) -> bool {
    triangle_count(bytes).is_some_and(|count| count > 0 && bytes.len() as u64 == length(count))
}

fn triangle_count(bytes: &[u8]) -> Option<u32> {
    bytes.get(HEADER - 4..)?.first_chunk().map(|&count| u32::from_le_bytes(count))
}

fn length(triangles: u32) -> u64 {
    HEADER as u64 + TRIANGLE as u64 * u64::from(triangles)
}

/// Reads the bytes of an STL file. Normals are left out: they are those of the faces.
///
/// # Errors
/// If the file has faults, or would take more memory than there is.
pub(super) fn read_stl(file: &[u8], memory: MemoryLimit, what: &str) -> Result<Reading, ReadError> {
    let is_text = !is_binary_stl(file) && begins_as_text(file);
    let triangles = file.len() / if is_text { SHORTEST_FACET } else { TRIANGLE };
    let _promise = memory
        .ask(format_args!("mesh {what}"), TRIANGLE_BYTES.saturating_mul(triangles as u64))
        .map_err(ReadError::Memory)?;
    let reading = if is_text { read_text(file)? } else { read_binary(file)? };
    Ok(reading)
}

/// Whether the first word is `solid`, and no byte of the first line is 0.
fn begins_as_text(file: &[u8]) -> bool {
    let text = file.trim_ascii_start();
    let line = text.split(|byte| matches!(byte, b'\n' | b'\r')).next().unwrap_or_default();
    line.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && !line.contains(&0)
}

/// Vertices by their places.
struct Join {
    reading: Reading,
    /// By the bits of the coordinates, none of them a negative zero.
    known: HashMap<[u64; 3], u32>,
}

impl Join {
    fn new(triangles: usize) -> Self {
        let mut reading = Reading::default();
        reading.columns.face_starts.reserve_exact(triangles + 1);
        reading.columns.face_starts.push(0);
        reading.columns.corner_positions.reserve_exact(3 * triangles);
        // a closed mesh has half as many vertices as triangles, and two more
        let vertices = triangles / 2 + 2;
        reading.columns.positions.reserve(vertices);
        Self { reading, known: HashMap::with_capacity(vertices) }
    }

    fn corner(&mut self, place: DVec3) {
        // -0 is 0
        let place = place + DVec3::ZERO;
        let positions = &mut self.reading.columns.positions;
        let index = *self.known.entry(place.to_array().map(f64::to_bits)).or_insert_with(|| {
            positions.push(place);
            u32::try_from(positions.len() - 1).unwrap_or(NONE)
        });
        self.reading.columns.corner_positions.push(index);
    }

    /// Ends a face.
    fn face(&mut self) {
        let columns = &mut self.reading.columns;
        // what does not fit is refused with the mesh
        columns.face_starts.push(u32::try_from(columns.corner_positions.len()).unwrap_or(NONE));
    }

    fn finish(mut self) -> Reading {
        let columns = &self.reading.columns;
        self.reading.notes.joined_corners = columns.corner_positions.len() - columns.positions.len();
        self.reading
    }
}

fn read_binary(file: &[u8]) -> Result<Reading, MeshFaults> {
    let mut faults = MeshFaults::default();
    let Some(said) = triangle_count(file) else {
        faults.push(Place::File, StlFault::TooShort(file.len()));
        return Err(faults);
    };
    if file.len() as u64 != length(said) {
        faults.push(Place::Byte(HEADER - 4), StlFault::Promise { said, bytes: file.len() });
        return Err(faults);
    }
    let triangles = file[HEADER..].chunks_exact(TRIANGLE);
    let mut join = Join::new(triangles.len());
    for triangle in triangles {
        let coordinate = |index: usize| {
            let at = 4 * index;
            f64::from(f32::from_le_bytes([
                triangle[at],
                triangle[at + 1],
                triangle[at + 2],
                triangle[at + 3],
            ]))
        };
        // the normal comes first
        for corner in 1..4 {
            join.corner(DVec3::from_array([0, 1, 2].map(|axis| coordinate(3 * corner + axis))));
        }
        join.face();
        join.reading.notes.attributes += usize::from(triangle[TRIANGLE - 2..] != [0, 0]);
    }
    Ok(join.finish())
}

/// The words of a file in text, and what is wrong with them.
struct Words<'a> {
    text: Text<'a>,
    faults: MeshFaults,
}

impl<'a> Words<'a> {
    /// The next word, if it is this one; what else it is is a fault, after which nothing can be told.
    fn expect(&mut self, expected: &'static str) -> Option<()> {
        match self.text.word() {
            Some(word) if word.eq_ignore_ascii_case(expected.as_bytes()) => Some(()),
            found => self.unexpected(found, expected),
        }
    }

    fn unexpected<T>(&mut self, found: Option<&'a [u8]>, expected: &'static str) -> Option<T> {
        match found {
            Some(word) => {
                let found = quote(&String::from_utf8_lossy(word));
                self.faults.push(self.text.place_of(word), StlFault::Word { found, expected });
            }
            None => self.faults.push(Place::File, StlFault::Ends(expected)),
        }
        None
    }

    /// Three numbers; what is none is a fault and stands as 0.
    fn vector(&mut self, is_used: bool) -> Option<DVec3> {
        let mut vector = DVec3::ZERO;
        for axis in 0..3 {
            let Some(word) = self.text.word() else {
                return self.unexpected(None, "a number");
            };
            if !is_used {
                continue;
            }
            match number(word) {
                Some(number) => vector[axis] = number,
                None => {
                    let quoted = quote(&String::from_utf8_lossy(word));
                    self.faults.push(self.text.place_of(word), StlFault::NotANumber(quoted));
                }
            }
        }
        Some(vector)
    }

    /// A facet behind its first word; none after a fault that hides where it ends.
    fn facet(&mut self, join: &mut Join) -> Option<()> {
        self.expect("normal")?;
        self.vector(false)?;
        self.expect("outer")?;
        self.expect("loop")?;
        let mut corners = 0;
        let place = self.text.here();
        loop {
            match self.text.word() {
                Some(word) if word.eq_ignore_ascii_case(b"vertex") => {
                    join.corner(self.vector(true)?);
                    corners += 1;
                }
                Some(word) if word.eq_ignore_ascii_case(b"endloop") => break,
                found => return self.unexpected(found, "endloop"),
            }
        }
        self.expect("endfacet")?;
        if corners != 3 {
            self.faults.push(place, StlFault::Corners(corners));
        }
        join.face();
        Some(())
    }

    /// All solids; none after a fault that hides what follows.
    fn solids(&mut self, join: &mut Join) -> Option<()> {
        let mut solid: Option<u32> = None;
        while let Some(word) = self.text.word() {
            if word.eq_ignore_ascii_case(b"solid") {
                let name = String::from_utf8_lossy(self.text.rest_of_line().trim_ascii()).into_owned();
                let names = &mut join.reading.columns.object_names;
                solid = Some(u32::try_from(names.len()).unwrap_or(NONE));
                names.push(if name.is_empty() { "unnamed".to_owned() } else { name });
            } else if word.eq_ignore_ascii_case(b"endsolid") {
                self.text.rest_of_line();
                solid = None;
            } else if word.eq_ignore_ascii_case(b"facet") {
                let Some(solid) = solid else {
                    return self.unexpected(Some(word), "solid");
                };
                self.facet(join)?;
                join.reading.columns.face_objects.push(solid);
            } else {
                let expected = if solid.is_some() { "facet" } else { "solid" };
                return self.unexpected(Some(word), expected);
            }
        }
        if solid.is_some() {
            return self.unexpected(None, "endsolid");
        }
        Some(())
    }
}

fn read_text(file: &[u8]) -> Result<Reading, MeshFaults> {
    let mut words = Words { text: Text::new(file, 0, 1), faults: MeshFaults::default() };
    let mut join = Join::new(file.len() / SHORTEST_FACET / 3);
    words.solids(&mut join);
    if !words.faults.is_empty() {
        return Err(words.faults);
    }
    let columns = &mut join.reading.columns;
    if columns.object_names.len() <= 1 {
        columns.face_objects = Vec::new();
    }
    Ok(join.finish())
}

#[cfg(test)]
mod tests;
