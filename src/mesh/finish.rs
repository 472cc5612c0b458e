//! What readers of every format but OBJ end with: pieces checked, and what no face uses left out.

use std::mem;

use super::file_error::{MeshFaultKind, MeshFaults, Place};
use super::polygon_mesh::{MeshColumns, NONE, PolygonMesh, References};
use super::{FileNotes, MeshNotes};

/// What a file was read into; indices may be out of range and numbers not finite.
#[derive(Debug, Default)]
pub(super) struct Reading {
    pub(super) columns: MeshColumns,
    pub(super) notes: FileNotes,
    pub(super) faults: MeshFaults,
}

impl Reading {
    /// The mesh, and notes of its file.
    ///
    /// Positions that no face uses are left out, and texture coordinates and normals that are not finite.
    ///
    /// # Errors
    /// All faults met so far, and the first few of faces that name vertices that are not there or have no place.
    pub(super) fn finish(self) -> Result<(PolygonMesh, MeshNotes), MeshFaults> {
        let Self { mut columns, mut notes, mut faults } = self;
        let read = columns.positions.len();
        if columns.face_starts.len() < 2 {
            faults.push(Place::File, MeshFaultKind::NoFaces { positions: read });
            return Err(faults);
        }
        let used = used_positions(&columns, &mut faults);
        let odd = columns.positions.iter().zip(&used).enumerate();
        for (vertex, _) in odd.filter(|(_, (position, used))| **used && !position.is_finite()) {
            faults.push(Place::Vertex(vertex), MeshFaultKind::NotFinite);
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        leave_out_unused(&mut columns, &used);
        drop(used);
        leave_out_odd_values(&mut columns, &mut notes);
        if columns.object_names.is_empty() {
            columns.object_names.push("unnamed".to_owned());
        }
        let mesh = PolygonMesh::from_columns(columns).map_err(|error| {
            faults.push(Place::File, error);
            faults
        })?;
        let notes = MeshNotes {
            faces: mesh.face_count(),
            triangles: mesh.triangle_count(),
            positions: mesh.positions().len(),
            unused_positions: read - mesh.positions().len(),
            file: notes,
            ..MeshNotes::default()
        };
        Ok((mesh, notes))
    }
}

/// Which positions a face uses; indices out of range are faults.
fn used_positions(columns: &MeshColumns, faults: &mut MeshFaults) -> Vec<bool> {
    let count = columns.positions.len();
    let mut used = vec![false; count];
    for (face, range) in columns.face_starts.windows(2).enumerate() {
        for &index in &columns.corner_positions[range[0] as usize..range[1] as usize] {
            match used.get_mut(index as usize) {
                Some(used) => *used = true,
                None => {
                    faults.push(Place::Face(face), MeshFaultKind::OutOfRange { index: index.into(), count })
                }
            }
        }
    }
    used
}

fn leave_out_unused(columns: &mut MeshColumns, used: &[bool]) {
    if used.iter().all(|&used| used) {
        return;
    }
    let number = |next: &mut u32, &used: &bool| {
        let number = *next;
        *next += u32::from(used);
        Some(number)
    };
    let numbers: Vec<u32> = used.iter().scan(0, number).collect();
    keep(&mut columns.positions, used);
    if columns.corner_uvs == References::AsPositions {
        keep(&mut columns.uvs, used);
    }
    if columns.corner_normals == References::AsPositions {
        keep(&mut columns.normals, used);
    }
    for index in &mut columns.corner_positions {
        *index = numbers[*index as usize];
    }
}

fn keep<T>(items: &mut Vec<T>, used: &[bool]) {
    let mut used = used.iter();
    items.retain(|_| used.next().is_some_and(|&used| used));
}

/// Corners whose texture coordinates, or normals, are not finite have none.
fn leave_out_odd_values(columns: &mut MeshColumns, notes: &mut FileNotes) {
    let MeshColumns { uvs, normals, corner_positions, corner_uvs, corner_normals, .. } = columns;
    notes.non_finite_uvs += leave_out(uvs, glam::DVec2::is_finite, corner_uvs, corner_positions);
    notes.non_finite_normals += leave_out(normals, glam::DVec3::is_finite, corner_normals, corner_positions);
}

/// How many of the values are not finite.
fn leave_out<T: Copy + Default>(
    values: &mut [T],
    is_finite: fn(T) -> bool,
    references: &mut References,
    corner_positions: &[u32],
) -> usize {
    let odd = values.iter().filter(|value| !is_finite(**value)).count();
    if odd == 0 {
        return 0;
    }
    let given = match mem::take(references) {
        References::Absent => return odd,
        References::AsPositions => corner_positions.to_vec(),
        References::Own(indices) => indices,
    };
    let is_there =
        |index: u32| index != NONE && values.get(index as usize).is_none_or(|&value| is_finite(value));
    let kept = given.into_iter().map(|index| if is_there(index) { index } else { NONE });
    *references = References::Own(kept.collect());
    values.iter_mut().filter(|value| !is_finite(**value)).for_each(|value| *value = T::default());
    odd
}
