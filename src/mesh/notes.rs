//! What is worth telling about a mesh.

use std::fmt;

/// Face numbers that a line of the notes names before it says "…".
const FACES_NAMED: usize = 8;

/// Counts for the statistics, and everything about a mesh that its author may want to know.
///
/// [`load_obj`](super::load_obj) fills what the file decides, [`prepare_polygons`](super::prepare_polygons) the rest;
/// [`merged`](Self::merged) puts the two together. `Display` writes one line for each thing that is not zero.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeshNotes {
    /// Faces of the input.
    pub faces: usize,
    /// Triangles that the faces make when fanned: the sum of (corners - 2).
    pub triangles: usize,
    /// Positions that a face uses.
    pub positions: usize,
    /// Positions that no face uses; they are left out.
    pub unused_positions: usize,
    /// Polygons made of the faces.
    pub polygons: usize,
    /// Faces of no area (all vertices on a line, or fewer than three distinct ones), skipped; in ascending order.
    pub degenerate_faces: Vec<u32>,
    /// Corners dropped because they repeat the corner before them.
    pub repeated_corners: usize,
    /// Planar faces with a reflex corner, cut into triangles.
    pub triangulated_concave: usize,
    /// Faces that lie in no plane, cut into triangles.
    pub triangulated_nonplanar: usize,
    /// Faces whose outline crosses itself by rounding alone, cut into triangles as if it touched itself.
    pub mended_faces: usize,
    /// Faces whose outline crosses itself by more, cut into a fan of triangles; in ascending order.
    pub self_intersecting_faces: Vec<u32>,
    /// What of the file is not used.
    pub file: FileNotes,
}

/// What of a mesh file is not used, or could not be, and how often.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FileNotes {
    /// Positions with a fourth coordinate other than 1.
    pub weighted_positions: usize,
    /// Positions with a colour.
    pub coloured_positions: usize,
    /// Positions, texture coordinates and normals with more values than they have a use for.
    pub surplus_values: usize,
    /// Positions, texture coordinates and normals that cannot be read and that no face uses.
    pub unreadable_unused: usize,
    /// Texture coordinates that are not finite; corners that name them have none.
    pub non_finite_uvs: usize,
    /// Normals that are not finite; corners that name them have none.
    pub non_finite_normals: usize,
    /// Corners that name texture coordinates which are not there.
    pub absent_uvs: usize,
    /// Corners that name normals which are not there.
    pub absent_normals: usize,
    /// Corners at places of corners before, which became one vertex with them, in files that have places alone.
    pub joined_corners: usize,
    /// Triangles with an attribute, of binary STL files.
    pub attributes: usize,
    /// Faces of one or two corners.
    pub short_faces: usize,
    /// Bytes that are not UTF-8, in names or comments.
    pub foreign_bytes: usize,
    /// Zero bytes at the end.
    pub trailing_zeros: usize,
    /// Statements that mean nothing to a polygon mesh, by keyword in alphabetical order.
    pub ignored_statements: Vec<(String, usize)>,
}

impl FileNotes {
    /// Counts texture coordinates, or else a normal, that are not finite.
    pub(super) fn count_non_finite(&mut self, is_uv: bool) {
        *(if is_uv { &mut self.non_finite_uvs } else { &mut self.non_finite_normals }) += 1;
    }

    /// Counts a corner without the texture coordinates, or else the normal, that it names.
    pub(super) fn count_absent(&mut self, is_uv: bool) {
        *(if is_uv { &mut self.absent_uvs } else { &mut self.absent_normals }) += 1;
    }
}

impl MeshNotes {
    /// Notes of the file (`self`) together with notes of its polygons (`prepared`).
    #[must_use]
    pub fn merged(self, prepared: Self) -> Self {
        Self { unused_positions: self.unused_positions, file: self.file, ..prepared }
    }

    /// How many faces have an outline that crosses itself.
    #[must_use]
    pub fn self_intersecting(&self) -> usize {
        self.self_intersecting_faces.len()
    }
}

impl fmt::Display for MeshNotes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}, {}, {}",
            counted(self.faces, "face"),
            counted(self.triangles, "triangle"),
            counted(self.positions, "vertex")
        )?;
        if !self.degenerate_faces.is_empty() {
            let faces = named_faces(&self.degenerate_faces);
            write!(f, "\nof no area, skipped: {faces}")?;
        }
        if !self.self_intersecting_faces.is_empty() {
            let faces = named_faces(&self.self_intersecting_faces);
            write!(f, "\nself-intersecting, cut into fans of triangles: {faces}")?;
        }
        let counts = [
            (self.triangulated_nonplanar, "face", "not planar, triangulated"),
            (self.triangulated_concave, "face", "concave, triangulated"),
            (self.mended_faces, "face", "crossing itself by rounding, taken as touching"),
            (self.repeated_corners, "corner", "the same as the one before, dropped"),
            (self.unused_positions, "vertex", "used by no face"),
        ];
        write_counts(f, &counts)?;
        self.file.fmt(f)
    }
}

/// A line for each count that is not zero, each line begun by a line break.
impl fmt::Display for FileNotes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_counts(
            f,
            &[
                (self.weighted_positions, "vertex", "with a fourth coordinate, not used"),
                (self.coloured_positions, "vertex", "with a colour, not used"),
                (self.surplus_values, "statement", "with more values than are used"),
                (self.unreadable_unused, "statement", "not readable, used by no face"),
                (self.non_finite_uvs, "texture coordinate", "not finite, left out"),
                (self.non_finite_normals, "normal", "not finite, left out"),
                (self.absent_uvs, "corner", "naming a texture coordinate that is not there"),
                (self.absent_normals, "corner", "naming a normal that is not there"),
                (self.joined_corners, "corner", "at the place of one before, joined"),
                (self.attributes, "triangle", "with an attribute, not used"),
                (self.short_faces, "face", "with fewer than 3 corners"),
                (self.foreign_bytes, "byte", "not UTF-8, in names or comments"),
                (self.trailing_zeros, "zero byte", "at the end, left out"),
            ],
        )?;
        if !self.ignored_statements.is_empty() {
            f.write_str("\nstatements ignored:")?;
            for (i, (keyword, count)) in self.ignored_statements.iter().enumerate() {
                write!(f, "{} {count} × {keyword}", if i == 0 { "" } else { "," })?;
            }
        }
        Ok(())
    }
}

/// A line for each count that is not zero: the count, what is counted, and what is said of it.
fn write_counts(f: &mut fmt::Formatter<'_>, counts: &[(usize, &str, &str)]) -> fmt::Result {
    for &(count, noun, what) in counts {
        if count > 0 {
            write!(f, "\n{} {what}", counted(count, noun))?;
        }
    }
    Ok(())
}

/// "1 face", "2 faces", "2 vertices".
fn counted(count: usize, noun: &str) -> String {
    match (count, noun) {
        (1, _) => format!("1 {noun}"),
        (_, "vertex") => format!("{count} vertices"),
        _ => format!("{count} {noun}s"),
    }
}

/// "3 faces (4, 7, 9)", the first few by number.
fn named_faces(faces: &[u32]) -> String {
    let mut text = counted(faces.len(), "face");
    for (i, face) in faces.iter().take(FACES_NAMED).enumerate() {
        text.push_str(if i == 0 { " (" } else { ", " });
        text.push_str(&face.to_string());
    }
    text.push_str(if faces.len() > FACES_NAMED { ", …)" } else { ")" });
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_read_as_a_list() {
        let notes = MeshNotes {
            faces: 12,
            triangles: 24,
            positions: 14,
            unused_positions: 1,
            degenerate_faces: (0..11).collect(),
            triangulated_concave: 1,
            self_intersecting_faces: vec![5],
            file: FileNotes {
                absent_uvs: 4,
                short_faces: 1,
                ignored_statements: vec![("curv".into(), 2), ("vp".into(), 9)],
                ..FileNotes::default()
            },
            ..MeshNotes::default()
        };
        assert_eq!(
            notes.to_string(),
            "12 faces, 24 triangles, 14 vertices\n\
             of no area, skipped: 11 faces (0, 1, 2, 3, 4, 5, 6, 7, …)\n\
             self-intersecting, cut into fans of triangles: 1 face (5)\n\
             1 face concave, triangulated\n\
             1 vertex used by no face\n\
             4 corners naming a texture coordinate that is not there\n\
             1 face with fewer than 3 corners\n\
             statements ignored: 2 × curv, 9 × vp"
        );
    }

    #[test]
    fn merging_keeps_what_only_the_file_knows() {
        let file = FileNotes { coloured_positions: 3, ..FileNotes::default() };
        let read = MeshNotes { file, ..MeshNotes::default() };
        let prepared = MeshNotes { polygons: 5, ..MeshNotes::default() };
        let both = read.merged(prepared);
        assert_eq!((both.file.coloured_positions, both.polygons), (3, 5));
    }
}
