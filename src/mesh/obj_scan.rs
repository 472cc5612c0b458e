//! The statements of an OBJ file to the pieces of a mesh, or to all of its faults.
//!
//! Only what a face refers to can be at fault: a statement that cannot be read and that nothing uses is counted. Texture
//! coordinates and normals that are not there, or not finite, leave their corners without.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::FileNotes;
use super::obj_fault::{FaultKind, Faults, LONGEST_QUOTE, ObjFault, quote};
use super::obj_words::{LineAt, Token, for_each_statement, is_no_number, joined};
use super::polygon_mesh::{Corner, MeshParts};

/// Most different unknown keywords that are counted apart; a file of noise has no more lines to show for it.
const MOST_KEYWORDS: usize = 16;

/// The name of faces before the first `o` or `g`.
const UNNAMED: &str = "unnamed";

/// What corners refer to, as indices of arrays.
const POSITION: usize = 0;
const UV: usize = 1;
const NORMAL: usize = 2;

/// What the scan makes of a file without faults.
#[derive(Debug)]
pub(super) struct Scan {
    /// The faces, and what they refer to in the order of the first reference.
    pub(super) parts: MeshParts,
    /// Number of positions in the file.
    pub(super) positions: usize,
    /// Counts of what was met on the way.
    pub(super) notes: FileNotes,
}

/// Reads the text of an OBJ file; every statement is looked at, whatever is wrong with the ones before.
pub(super) fn scan(text: &str) -> Result<Scan, Faults> {
    let mut scanner = Scanner { file: text, ..Scanner::default() };
    for_each_statement(text, |statement| scanner.statement(statement));
    scanner.finish()
}

/// An index larger than what has been defined so far: legal if the file defines it later.
#[derive(Debug)]
struct ForwardReference {
    at: usize,
    line: LineAt,
    /// Its number among all corners.
    corner: usize,
    /// What it refers to.
    what: usize,
    index: i64,
}

/// A statement that cannot be read: a fault if a face refers to what it defines.
#[derive(Debug)]
struct Unreadable {
    /// [`POSITION`], [`UV`] or [`NORMAL`].
    what: usize,
    /// The first index of a file is 1.
    index: u32,
    fault: ObjFault,
}

#[derive(Default)]
struct Scanner<'a> {
    file: &'a str,
    positions: Vec<DVec3>,
    /// Not finite where there are none.
    uvs: Vec<DVec2>,
    /// Not finite where there are none.
    normals: Vec<DVec3>,
    /// Indices of positions, texture coordinates and normals; the first of the file is 1, and 0 stands for none.
    corners: Vec<[u32; 3]>,
    arities: Vec<u32>,
    face_objects: Vec<u32>,
    object_names: Vec<String>,
    names: HashMap<String, u32>,
    /// The last `o` or `g`.
    name: Option<String>,
    /// The last `usemtl`: its place in `material_names`, counted from 1, or 0.
    material: u32,
    materials: HashMap<String, u32>,
    material_names: Vec<String>,
    face_materials: Vec<u32>,
    libraries: Vec<String>,
    faults: Faults,
    unreadable: Vec<Unreadable>,
    forward: Vec<ForwardReference>,
    ignored: HashMap<String, usize>,
    notes: FileNotes,
}

impl<'a> Scanner<'a> {
    fn statement(&mut self, tokens: &[Token<'a>]) {
        let Some((keyword, values)) = tokens.split_first() else {
            return;
        };
        match keyword.text {
            "v" => self.position(keyword, values),
            "vt" => self.uv(keyword, values),
            "vn" => self.normal(keyword, values),
            "f" if values.is_empty() => self.ignore("f"),
            "f" => self.face(values),
            "o" | "g" => {
                self.name = (!values.is_empty()).then(|| joined(values));
            }
            "usemtl" => self.material = self.material_named(&joined(values)),
            "mtllib" => self.libraries.extend(Some(joined(values)).filter(|name| !name.is_empty())),
            "s" => {}
            other => self.ignore(other),
        }
    }

    fn ignore(&mut self, keyword: &str) {
        let keyword = if keyword.len() > LONGEST_QUOTE { "other" } else { keyword };
        if let Some(count) = self.ignored.get_mut(keyword) {
            *count += 1;
        } else {
            let named = self.ignored.len() < MOST_KEYWORDS;
            let keyword = if named { keyword } else { "other" };
            *self.ignored.entry(keyword.to_owned()).or_default() += 1;
        }
    }

    fn position(&mut self, keyword: &Token<'_>, values: &[Token<'_>]) {
        match values.len() {
            0..=3 => {}
            4 => self.notes.weighted_positions += usize::from(values[3].text.parse() != Ok(1.0)),
            6 | 7 => self.notes.coloured_positions += 1,
            _ => self.notes.surplus_values += 1,
        }
        let position = self.coordinates(POSITION, keyword, values, "3 are needed");
        self.positions.push(DVec3::from_array(position));
    }

    fn uv(&mut self, keyword: &Token<'_>, values: &[Token<'_>]) {
        self.notes.surplus_values += usize::from(values.len() > 3);
        let uv = match values {
            [_] => {
                let [u] = self.coordinates(UV, keyword, values, "");
                [u, 0.0]
            }
            _ => self.coordinates(UV, keyword, values, "1 to 3 are needed"),
        };
        self.uvs.push(uv.into());
    }

    fn normal(&mut self, keyword: &Token<'_>, values: &[Token<'_>]) {
        self.notes.surplus_values += usize::from(values.len() > 3);
        let normal = self.coordinates(NORMAL, keyword, values, "3 are needed");
        self.normals.push(normal.into());
    }

    /// The first values as numbers; with NaN where they cannot be read, or are not finite.
    fn coordinates<const N: usize>(
        &mut self,
        what: usize,
        keyword: &Token<'_>,
        values: &[Token<'_>],
        expected: &'static str,
    ) -> [f64; N] {
        let Some(first) = values.first_chunk::<N>() else {
            let name = ["v", "vt", "vn"][what];
            let kind = FaultKind::ValueCount { keyword: name, found: values.len(), expected };
            self.unreadable(what, keyword, kind);
            return [f64::NAN; N];
        };
        let faults = self.unreadable.len();
        let numbers = first.map(|token| match token.text.parse::<f64>() {
            Ok(number) if number.is_finite() => number,
            // without texture coordinates and normals there is still a face
            _ if what != POSITION && is_not_finite(token.text) => f64::NAN,
            _ => {
                let quoted = quote(token.text);
                let kind = match is_not_finite(token.text) {
                    true => FaultKind::NotFinite(quoted),
                    false => FaultKind::NotANumber(quoted),
                };
                self.unreadable(what, &token, kind);
                f64::NAN
            }
        });
        if self.unreadable.len() == faults && numbers.iter().any(|number| number.is_nan()) {
            self.notes.count_non_finite(what == UV);
        }
        numbers
    }

    fn face(&mut self, values: &[Token<'_>]) {
        for token in values {
            self.corner(token);
        }
        // a face of one or two corners keeps its number, and like others without area it is skipped later
        for _ in values.len()..3 {
            self.corners.extend(self.corners.last().copied());
        }
        self.notes.short_faces += usize::from(values.len() < 3);
        // more corners than this do not fit in memory as text; the mesh's constructor checks the sum
        self.arities.push(u32::try_from(values.len().max(3)).unwrap_or(u32::MAX));
        let next = u32::try_from(self.names.len()).unwrap_or(u32::MAX);
        let name = self.name.as_deref().unwrap_or(UNNAMED);
        let object = match self.names.get(name) {
            Some(&object) => object,
            None => {
                self.names.insert(name.to_owned(), next);
                self.object_names.push(name.to_owned());
                next
            }
        };
        self.face_objects.push(object);
        self.face_materials.push(self.material);
    }

    /// The index of a material, plus 1; 0 is no material.
    fn material_named(&mut self, name: &str) -> u32 {
        if name.is_empty() {
            return 0;
        }
        if let Some(&known) = self.materials.get(name) {
            return known;
        }
        self.material_names.push(name.to_owned());
        let number = u32::try_from(self.material_names.len()).unwrap_or(u32::MAX);
        self.materials.insert(name.to_owned(), number);
        number
    }

    fn corner(&mut self, token: &Token<'_>) {
        let indices = self.indices(token);
        if indices.is_none() {
            self.fault(token, FaultKind::BadCorner(quote(token.text)));
        }
        self.corners.push(indices.unwrap_or_default());
    }

    /// What a corner refers to; none if it cannot be read.
    fn indices(&mut self, token: &Token<'_>) -> Option<[u32; 3]> {
        let mut given = [0; 3];
        let mut is_given = [true, false, false];
        for (what, part) in token.text.split('/').enumerate() {
            if what == POSITION || !part.is_empty() {
                *given.get_mut(what)? = part.parse::<i64>().ok()?;
                is_given[what] = true;
            } else if what > NORMAL {
                return None;
            }
        }
        let mut indices = [0; 3];
        for what in (POSITION..=NORMAL).filter(|&what| is_given[what]) {
            indices[what] = self.resolve(token, what, given[what]);
        }
        Some(indices)
    }

    /// An index from 1 of what the file has or may come to have; 0 after noting that there is none.
    fn resolve(&mut self, token: &Token<'_>, what: usize, index: i64) -> u32 {
        let count = [self.positions.len(), self.uvs.len(), self.normals.len()][what];
        let magnitude = usize::try_from(index.unsigned_abs()).unwrap_or(usize::MAX);
        let resolved = match index {
            1.. => {
                if magnitude > count {
                    let corner = self.corners.len();
                    let reference = ForwardReference { at: token.at, line: token.line, corner, what, index };
                    self.forward.push(reference);
                }
                magnitude
            }
            0 => 0,
            _ => (count + 1).saturating_sub(magnitude),
        };
        if resolved == 0 {
            match (what, index) {
                (POSITION, 0) => self.fault(token, FaultKind::ZeroIndex),
                (POSITION, _) => self.fault(token, FaultKind::OutOfRange { index, count }),
                _ => self.notes.count_absent(what == UV),
            }
        }
        // beyond what a mesh may have at all; the constructor says so
        u32::try_from(resolved).unwrap_or(u32::MAX)
    }

    fn fault(&mut self, token: &Token<'_>, kind: FaultKind) {
        self.faults.push(placed(self.file, token.at, token.line, kind));
    }

    fn unreadable(&mut self, what: usize, token: &Token<'_>, kind: FaultKind) {
        let before = [self.positions.len(), self.uvs.len(), self.normals.len()][what];
        let index = u32::try_from(before + 1).unwrap_or(u32::MAX);
        let fault = placed(self.file, token.at, token.line, kind);
        self.unreadable.push(Unreadable { what, index, fault });
    }

    fn finish(mut self) -> Result<Scan, Faults> {
        let late = self.late_faults();
        let broken = self.used_unreadable();
        let faults = self.faults.merged(late).merged(broken);
        if !faults.listed.is_empty() {
            return Err(faults);
        }
        let mut ignored: Vec<_> = self.ignored.into_iter().collect();
        ignored.sort();
        self.notes.ignored_statements = ignored;
        let file_positions = self.positions.len();
        let [mut positions, mut uvs, mut normals] =
            [file_positions, self.uvs.len(), self.normals.len()].map(Order::new);
        let finite_uv = |index: &u32| self.uvs[*index as usize - 1].is_finite();
        let finite_normal = |index: &u32| self.normals[*index as usize - 1].is_finite();
        let given = |index: u32| (index > 0).then_some(index);
        let corners = self.corners.iter().map(|&[position, uv, normal]| Corner {
            position: positions.number(position),
            uv: given(uv).filter(finite_uv).map(|uv| uvs.number(uv)),
            normal: given(normal).filter(finite_normal).map(|normal| normals.number(normal)),
        });
        let corners = corners.collect();
        let parts = MeshParts {
            positions: positions.taken(&self.positions),
            uvs: uvs.taken(&self.uvs),
            normals: normals.taken(&self.normals),
            corners,
            arities: self.arities,
            face_objects: self.face_objects,
            object_names: self.object_names,
            face_materials: if self.material_names.is_empty() { Vec::new() } else { self.face_materials },
            material_names: self.material_names,
            material_libraries: self.libraries,
            materials: Vec::new(),
        };
        Ok(Scan { parts, positions: file_positions, notes: self.notes })
    }

    /// Settles the references to what the file was to define later.
    fn late_faults(&mut self) -> Faults {
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        let mut late = Faults::default();
        for ForwardReference { at, line, corner, what, index } in std::mem::take(&mut self.forward) {
            let count = counts[what];
            if usize::try_from(index).is_ok_and(|index| index <= count) {
                continue;
            }
            if what == POSITION {
                late.push(placed(self.file, at, line, FaultKind::OutOfRange { index, count }));
            } else {
                self.corners[corner][what] = 0;
                self.notes.count_absent(what == UV);
            }
        }
        late
    }

    /// The faults of what faces refer to; the others are counted.
    fn used_unreadable(&mut self) -> Faults {
        let mut faults = Faults::default();
        if self.unreadable.is_empty() {
            return faults;
        }
        let used = [POSITION, UV, NORMAL].map(|what| {
            let mut used: Vec<u32> = self.corners.iter().map(|corner| corner[what]).collect();
            used.sort_unstable();
            used
        });
        let mut counted = None;
        for Unreadable { what, index, fault } in std::mem::take(&mut self.unreadable) {
            if used[what].binary_search(&index).is_ok() {
                faults.push(fault);
            } else if counted.replace((what, index)) != Some((what, index)) {
                self.notes.unreadable_unused += 1;
            }
        }
        faults
    }
}

/// New numbers for what is used, in the order of the first use.
struct Order {
    /// By the old number, which counts from 1; [`u32::MAX`] where it was not used yet.
    numbers: Vec<u32>,
    /// The old numbers in the new order.
    used: Vec<u32>,
}

impl Order {
    fn new(count: usize) -> Self {
        Self { numbers: vec![u32::MAX; count], used: Vec::new() }
    }

    fn number(&mut self, old: u32) -> u32 {
        let new = &mut self.numbers[old as usize - 1];
        if *new == u32::MAX {
            *new = u32::try_from(self.used.len()).unwrap_or(u32::MAX);
            self.used.push(old);
        }
        *new
    }

    fn taken<T: Copy>(&self, from: &[T]) -> Vec<T> {
        self.used.iter().map(|&old| from[old as usize - 1]).collect()
    }
}

/// Whether a word stands for NaN or infinity, or a number too large for a double.
fn is_not_finite(word: &str) -> bool {
    is_no_number(word) || word.parse::<f64>().is_ok_and(|number| !number.is_finite())
}

fn placed(file: &str, at: usize, line: LineAt, kind: FaultKind) -> ObjFault {
    ObjFault { line: line.number, column: file[line.start..at].chars().count() + 1, kind }
}

#[cfg(test)]
mod tests;
