//! PLY files.
//!
//! Read here and not by a crate: `ply-rs-bw` makes a value of every number and a hash table of every element, which takes
//! many times the memory of the file.
//!
//! Source: Turk (1994), *The PLY Polygon File Format*; names of texture coordinates as `MeshLab`, Blender and Mitsuba write them.

use glam::{DVec2, DVec3};

use super::file_error::{MeshFaultKind, MeshFaults, Place, ReadError};
use super::finish::Reading;
use super::ply_fault::PlyFault;
use super::ply_header::{Element, Encoding, Header, Property};
use super::ply_numbers::{Binary, End, Numbers, Text};
use super::polygon_mesh::{NONE, References};
use crate::memory::MemoryLimit;

/// Bytes that a vertex takes, with normal and texture coordinates and while unused ones are looked for.
const VERTEX_BYTES: u64 = 24 + 24 + 16 + 1;

/// Bytes that a face takes, of three corners.
const FACE_BYTES: u64 = 4 + 3 * 4;

/// Reads the bytes of a PLY file, in text or binary of either order.
///
/// Vertices may have normals (`nx ny nz`) and texture coordinates (`u v`, `s t` or `texture_u texture_v`), v upwards; faces of
/// any number of corners may have texture coordinates of their own (`texcoord`). Other elements and properties are counted.
///
/// # Errors
/// If the file has faults, or would take more memory than there is.
pub(super) fn read_ply(file: &[u8], memory: MemoryLimit, what: &str) -> Result<Reading, ReadError> {
    let header = Header::parse(file)?;
    check(&header, file.len())?;
    let count = |name: &str| header.elements.iter().find(|e| e.name == name).map_or(0, |e| e.count);
    let bytes = count("vertex").saturating_mul(VERTEX_BYTES).saturating_add(count("face") * FACE_BYTES);
    let _promise = memory.ask(format_args!("mesh {what}"), bytes).map_err(ReadError::Memory)?;
    let (at, line) = (header.bytes, header.lines + 1);
    let reading = match header.encoding {
        Encoding::Ascii => read(&header, Text::new(file, at, line)),
        Encoding::LittleEndian => read(&header, Binary::<'_, false> { file, at }),
        Encoding::BigEndian => read(&header, Binary::<'_, true> { file, at }),
    };
    Ok(reading?)
}

/// Refuses headers without what a mesh needs, and with more than the file has room for.
fn check(header: &Header, file_bytes: usize) -> Result<(), MeshFaults> {
    let mut faults = MeshFaults::default();
    let named = |name: &str| header.elements.iter().find(|element| element.name == name);
    match named("vertex") {
        None => faults.push(Place::File, PlyFault::NoElement("vertex")),
        Some(vertex) => {
            let is_scalar = |name: &str| {
                vertex.property(name).is_some_and(|index| vertex.properties[index].length.is_none())
            };
            for name in ["x", "y", "z"].into_iter().filter(|name| !is_scalar(name)) {
                faults.push(Place::File, PlyFault::NoCoordinate(name));
            }
        }
    }
    match named("face") {
        None if named("tristrips").is_some() => faults.push(Place::File, PlyFault::Strips),
        None => faults.push(Place::File, PlyFault::NoElement("face")),
        Some(face) if !face.properties.iter().any(is_indices) => {
            faults.push(Place::File, PlyFault::NoIndices);
        }
        Some(_) => {}
    }
    let mut left = file_bytes - header.bytes;
    for element in &header.elements {
        let needed = element.count.saturating_mul(element.least_size(header.encoding));
        // the last number in text needs nothing behind it
        let slack = u64::from(header.encoding == Encoding::Ascii);
        if needed > left as u64 + slack {
            let (element, count) = (element.name.clone(), element.count);
            faults.push(Place::File, PlyFault::Promise { element, count, needed, left });
            break;
        }
        left = left.saturating_sub(usize::try_from(needed).unwrap_or(usize::MAX));
    }
    if faults.is_empty() { Ok(()) } else { Err(faults) }
}

fn is_indices(property: &Property) -> bool {
    matches!(property.name.as_str(), "vertex_indices" | "vertex_index")
        && property.length.is_some()
        && property.scalar.is_whole()
}

fn read<N: Numbers>(header: &Header, mut numbers: N) -> Result<Reading, MeshFaults> {
    let mut reading = Reading::default();
    reading.columns.face_starts.push(0);
    for element in &header.elements {
        let mut index = 0;
        let outcome = match element.name.as_str() {
            "vertex" => read_vertices(element, &mut numbers, &mut reading, &mut index),
            "face" => read_faces(element, &mut numbers, &mut reading, &mut index),
            _ => {
                if element.count > 0 {
                    let count = usize::try_from(element.count).unwrap_or(usize::MAX);
                    reading.notes.ignored_statements.push((element.name.clone(), count));
                }
                skip_element(element, &mut numbers, &mut index)
            }
        };
        if let Err(stop) = outcome {
            let fault = match stop {
                Stop::End => {
                    Some(PlyFault::Ends { element: element.name.clone(), index, count: element.count })
                }
                Stop::Fault(fault) => Some(fault),
                Stop::Noted => None,
            };
            let place = numbers.place();
            let mut faults = numbers.into_faults();
            faults.append(reading.faults);
            if let Some(fault) = fault {
                faults.push(place, fault);
            }
            return Err(faults);
        }
    }
    reading.faults.append(numbers.into_faults());
    Ok(reading)
}

/// Why reading cannot go on.
enum Stop {
    End,
    Fault(PlyFault),
    /// Its fault is among those of the numbers.
    Noted,
}

impl From<End> for Stop {
    fn from(_: End) -> Self {
        Self::End
    }
}

/// What a vertex' property is.
const NAMES: [&[&str]; 8] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx"],
    &["ny"],
    &["nz"],
    &["u", "s", "texture_u", "texture_s"],
    &["v", "t", "texture_v", "texture_t"],
];
const NORMAL: usize = 3;
const UV: usize = 6;
const OTHER: usize = NAMES.len();

fn read_vertices(
    element: &Element,
    numbers: &mut impl Numbers,
    reading: &mut Reading,
    index: &mut u64,
) -> Result<(), Stop> {
    let slot = |property: &Property| {
        let known = NAMES.iter().position(|names| names.contains(&property.name.as_str()));
        known.filter(|_| property.length.is_none()).unwrap_or(OTHER)
    };
    let slots: Vec<usize> = element.properties.iter().map(slot).collect();
    let has = |range: std::ops::Range<usize>| range.into_iter().all(|slot| slots.contains(&slot));
    // faces' own texture coordinates come first, wherever they stand
    let has_uvs = has(UV..OTHER) && reading.columns.corner_uvs == References::Absent;
    let has_normals = has(NORMAL..UV);
    let names: Vec<&str> = element.properties.iter().map(|property| property.name.as_str()).collect();
    let count = usize::try_from(element.count).unwrap_or(usize::MAX);
    if ["red", "green", "blue"].iter().all(|name| names.contains(name)) {
        reading.notes.coloured_positions = count;
    }
    let columns = &mut reading.columns;
    columns.positions.reserve_exact(count);
    columns.normals.reserve_exact(if has_normals { count } else { 0 });
    columns.uvs.reserve_exact(if has_uvs { count } else { 0 });
    while *index < element.count {
        let mut values = [0.0; OTHER + 1];
        for (property, &slot) in element.properties.iter().zip(&slots) {
            match property.length {
                None => values[slot] = numbers.real(property.scalar)?,
                Some(_) => skip_property(property, numbers)?,
            }
        }
        let [x, y, z, nx, ny, nz, u, v, _] = values;
        columns.positions.push(DVec3::new(x, y, z));
        if has_normals {
            columns.normals.push(DVec3::new(nx, ny, nz));
        }
        if has_uvs {
            columns.uvs.push(DVec2::new(u, v));
        }
        *index += 1;
    }
    if has_normals {
        columns.corner_normals = References::AsPositions;
    }
    if has_uvs {
        columns.corner_uvs = References::AsPositions;
    }
    Ok(())
}

fn read_faces(
    element: &Element,
    numbers: &mut impl Numbers,
    reading: &mut Reading,
    index: &mut u64,
) -> Result<(), Stop> {
    let indices = element.properties.iter().position(is_indices);
    let is_texcoord = |property: &Property| property.name == "texcoord" && property.length.is_some();
    let texcoord = element.properties.iter().position(is_texcoord);
    let count = usize::try_from(element.count).unwrap_or(usize::MAX);
    let columns = &mut reading.columns;
    columns.face_starts.reserve_exact(count);
    columns.corner_positions.reserve_exact(count.saturating_mul(3));
    // those of the vertices give way to the faces' own
    let (mut uvs, mut corner_uvs) = (Vec::new(), Vec::new());
    let mut values = Vec::new();
    while *index < element.count {
        let start = columns.corner_positions.len();
        values.clear();
        for (number, property) in element.properties.iter().enumerate() {
            if Some(number) == indices {
                let corners = list_length(property, numbers)?;
                for _ in 0..corners {
                    let vertex = numbers.whole(property.scalar)?;
                    if vertex < 0 {
                        let (place, count) = (corner_place(*index), columns.positions.len());
                        reading.faults.push(place, MeshFaultKind::OutOfRange { index: vertex, count });
                    }
                    columns.corner_positions.push(u32::try_from(vertex.max(0)).unwrap_or(NONE));
                }
            } else if Some(number) == texcoord {
                for _ in 0..list_length(property, numbers)? {
                    values.push(numbers.real(property.scalar)?);
                }
            } else {
                skip_property(property, numbers)?;
            }
        }
        let corners = columns.corner_positions.len() - start;
        // a face of one or two corners keeps its number, and like others without area it is skipped later
        reading.notes.short_faces += usize::from(corners < 3);
        for _ in corners..3 {
            columns.corner_positions.push(columns.corner_positions.last().copied().unwrap_or(0));
        }
        if texcoord.is_some() {
            let given = values.len() == 2 * corners && corners > 0;
            reading.notes.absent_uvs += if given { 0 } else { corners };
            for corner in 0..corners.max(3) {
                let pair = values.get(2 * corner..2 * corner + 2).filter(|_| given);
                corner_uvs.push(match pair {
                    Some(pair) => {
                        uvs.push(DVec2::new(pair[0], pair[1]));
                        u32::try_from(uvs.len() - 1).unwrap_or(NONE)
                    }
                    None => NONE,
                });
            }
        }
        // what does not fit is refused with the mesh
        columns.face_starts.push(u32::try_from(columns.corner_positions.len()).unwrap_or(NONE));
        *index += 1;
    }
    if !uvs.is_empty() {
        (columns.uvs, columns.corner_uvs) = (uvs, References::Own(corner_uvs));
    }
    Ok(())
}

fn corner_place(face: u64) -> Place {
    Place::Face(usize::try_from(face).unwrap_or(usize::MAX))
}

/// The length of the list that comes next; the file has room for it.
fn list_length(property: &Property, numbers: &mut impl Numbers) -> Result<usize, Stop> {
    let length = numbers.whole(property.length.unwrap_or(property.scalar))?;
    if length == i64::MAX {
        // text that is no number; where the list ends cannot be told
        return Err(Stop::Noted);
    }
    let count = usize::try_from(length).map_err(|_| Stop::Fault(PlyFault::Length(length)))?;
    // a number takes a byte at least
    if count > numbers.left() { Err(Stop::End) } else { Ok(count) }
}

fn skip_property(property: &Property, numbers: &mut impl Numbers) -> Result<(), Stop> {
    let count = match property.length {
        None => 1,
        Some(_) => list_length(property, numbers)?,
    };
    Ok(numbers.skip(property.scalar, count)?)
}

fn skip_element(element: &Element, numbers: &mut impl Numbers, index: &mut u64) -> Result<(), Stop> {
    // an element without properties takes nothing
    let count = if element.properties.is_empty() { 0 } else { element.count };
    while *index < count {
        element.properties.iter().try_for_each(|property| skip_property(property, numbers))?;
        *index += 1;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
