//! The first of two readings of an OBJ file: finds every fault, and rewrites the file plainly for the loader.
//!
//! The loader (tobj) stops at the first fault without saying where, and reads some legal files wrongly: it knows neither
//! line continuation nor comments behind a statement, takes polylines of three or more points for faces, refuses `vt` with
//! one coordinate, mixes up vertices with and without colours, gives corners without texture coordinates those of the
//! corner before, and numbers vertices anew for each group. The rewritten file has none of this: only `v`, `vt`, `vn`
//! and `f`, one statement a line, with absolute indices. A corner without texture coordinates or normal refers to the
//! first `vt` or `vn`, which is NaN.

use std::collections::HashMap;
use std::fmt::Write;

use thiserror::Error;

use super::MeshNotes;

/// Most faults that are listed; the others are counted.
pub(super) const MOST_FAULTS: usize = 20;

/// Most different unknown keywords that are counted apart; a file of noise has no more lines to show for it.
const MOST_KEYWORDS: usize = 16;

/// Keywords and pieces of text longer than this are shortened in messages.
const LONGEST_QUOTE: usize = 32;

/// The name of faces before the first `o` or `g`.
const UNNAMED: &str = "unnamed";

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
    /// Wrong number of coordinates.
    #[error("`{keyword}` with {found} values; {expected}")]
    ValueCount {
        /// The statement.
        keyword: &'static str,
        /// How many values it has.
        found: usize,
        /// How many it may have.
        expected: &'static str,
    },
    /// The fourth coordinate is 0, or so small that the division overflows.
    #[error("the fourth coordinate `{0}` divides the others and must not be zero or next to it")]
    ZeroWeight(String),
    /// A face with one or two corners, or none.
    #[error("a face with {0} corners; at least 3 are needed (use `l` for lines, `p` for points)")]
    TooFewCorners(usize),
    /// A corner that cannot be read.
    #[error("`{0}` is not a corner; valid are v, v/vt, v//vn and v/vt/vn with whole numbers")]
    BadCorner(String),
    /// Index 0.
    #[error("{0} index 0; indices start at 1, or at -1 backwards")]
    ZeroIndex(IndexKind),
    /// An index beyond what the file has.
    #[error("{kind} index {index} is out of range; {}", valid_range(*kind, *count))]
    OutOfRange {
        /// What is referred to.
        kind: IndexKind,
        /// The index as it stands in the file.
        index: i64,
        /// For a positive index all of the file, for a negative one those before the face.
        count: usize,
    },
}

/// What a face's corner refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IndexKind {
    /// `v`
    Position,
    /// `vt`
    Uv,
    /// `vn`
    Normal,
}

impl std::fmt::Display for IndexKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Position => "vertex",
            Self::Uv => "texture coordinate",
            Self::Normal => "normal",
        })
    }
}

/// "valid are 1 to 8, or -8 to -1", for the message of an index out of range.
fn valid_range(kind: IndexKind, count: usize) -> String {
    match count {
        0 => format!("there is no {kind} to refer to"),
        1 => format!("there is one {kind}: 1, or -1"),
        _ => format!("valid are 1 to {count}, or -{count} to -1"),
    }
}

/// What the scan learns of a file without faults.
#[derive(Debug, Default)]
pub(super) struct Scan {
    /// The file rewritten for the loader, see the top of this module.
    pub(super) text: String,
    /// Corners of each face.
    pub(super) arities: Vec<u32>,
    /// Each face's index into `object_names`.
    pub(super) face_objects: Vec<u32>,
    /// Names of the objects with faces.
    pub(super) object_names: Vec<String>,
    /// Number of positions in the file.
    pub(super) positions: usize,
    /// Counts of what was met on the way.
    pub(super) notes: MeshNotes,
}

/// The faults found: the first few in the order of the file, and how many more there are.
#[derive(Debug)]
pub(super) struct Faults {
    pub(super) listed: Vec<ObjFault>,
    pub(super) more: usize,
}

/// Reads the text of an OBJ file; every statement is looked at, whatever is wrong with the ones before.
pub(super) fn scan(text: &str) -> Result<Scan, Faults> {
    let mut scanner = Scanner::new(text);
    let mut statement = Vec::new();
    let mut lines = text.split('\n').zip(1..);
    let mut start = 0;
    while let Some((line, number)) = lines.next() {
        statement.clear();
        let mut line_at = LineAt { start, number };
        let mut body = line;
        loop {
            start += body.len() + 1;
            let continued = add_tokens(body, line_at, &mut statement);
            let Some((next, number)) = continued.then(|| lines.next()).flatten() else {
                break;
            };
            body = next;
            line_at = LineAt { start, number };
        }
        scanner.statement(&statement);
    }
    scanner.finish()
}

/// Where a physical line starts in the text, and its number from 1.
#[derive(Clone, Copy)]
struct LineAt {
    start: usize,
    number: usize,
}

/// A word of a statement, and where it stands.
#[derive(Clone, Copy)]
struct Token<'a> {
    text: &'a str,
    /// Byte offset of the word in the file.
    at: usize,
    line: LineAt,
}

/// Splits a physical line into words, to the comment if there is one; true if the statement goes on in the next line.
fn add_tokens<'a>(line: &'a str, line_at: LineAt, statement: &mut Vec<Token<'a>>) -> bool {
    let trimmed = line.trim_end();
    let before = statement.len();
    let (body, continued) = match trimmed.strip_suffix('\\') {
        Some(body) => (body, true),
        None => (trimmed, false),
    };
    for text in body.split_whitespace() {
        let names = matches!(statement.first(), Some(first) if matches!(first.text, "o" | "g"));
        if text.starts_with('#') && !names {
            // a comment takes the rest of its line, its own backslash included
            return false;
        }
        let offset = text.as_ptr() as usize - line.as_ptr() as usize;
        statement.push(Token { text, at: line_at.start + offset, line: line_at });
    }
    // a lone backslash on a line by itself goes on only if there is something to go on with
    continued && (statement.len() > before || before > 0)
}

/// An index larger than what has been defined so far: legal if the file defines it later.
struct ForwardReference {
    at: usize,
    line: LineAt,
    kind: IndexKind,
    index: i64,
}

struct Scanner<'a> {
    file: &'a str,
    scan: Scan,
    faults: Vec<ObjFault>,
    more: usize,
    forward: Vec<ForwardReference>,
    /// How many `v`, `vt` and `vn` were read, faulty ones included (else one fault would make many).
    counts: [usize; 3],
    names: HashMap<String, u32>,
    name: String,
    ignored: HashMap<String, usize>,
}

impl<'a> Scanner<'a> {
    fn new(file: &'a str) -> Self {
        let mut scan = Scan::default();
        scan.text.reserve(file.len() + file.len() / 4);
        scan.text.push_str("vt NaN NaN\nvn NaN NaN NaN\n");
        Self {
            file,
            scan,
            faults: Vec::new(),
            more: 0,
            forward: Vec::new(),
            counts: [0; 3],
            names: HashMap::new(),
            name: UNNAMED.to_owned(),
            ignored: HashMap::new(),
        }
    }

    fn statement(&mut self, tokens: &[Token<'a>]) {
        let Some((keyword, values)) = tokens.split_first() else {
            return;
        };
        match keyword.text {
            "v" => self.position(keyword, values),
            "vt" => self.uv(keyword, values),
            "vn" => self.normal(keyword, values),
            "f" => self.face(keyword, values),
            "o" | "g" => {
                let words: Vec<_> = values.iter().map(|token| token.text).collect();
                self.name = if words.is_empty() { UNNAMED.to_owned() } else { words.join(" ") };
            }
            "s" | "usemtl" | "mtllib" => {}
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
        self.counts[0] += 1;
        if !matches!(values.len(), 3 | 4 | 6) {
            let expected = "3 are needed, 4 with a divisor, 6 with a colour";
            return self.wrong_count(keyword, "v", values.len(), expected);
        }
        let Some(numbers) = self.numbers(values) else {
            return;
        };
        match numbers[3..] {
            [] => {}
            [w] => {
                if !numbers[..3].iter().all(|x| (x / w).is_finite()) {
                    return self.fault(&values[3], FaultKind::ZeroWeight(quote(values[3].text)));
                }
                self.scan.notes.weighted_positions += usize::from(w != 1.0);
            }
            _ => self.scan.notes.coloured_positions += 1,
        }
        let kept = if values.len() == 4 { 4 } else { 3 };
        self.write_numbers("v", &values[..kept]);
    }

    fn uv(&mut self, keyword: &Token<'_>, values: &[Token<'_>]) {
        self.counts[1] += 1;
        if !matches!(values.len(), 1..=3) {
            return self.wrong_count(keyword, "vt", values.len(), "1 to 3 are needed");
        }
        if self.numbers(values).is_none() {
            return;
        }
        if values.len() == 1 {
            let v = Token { text: "0", ..values[0] };
            self.write_numbers("vt", &[values[0], v]);
        } else {
            self.write_numbers("vt", &values[..2]);
        }
    }

    fn normal(&mut self, keyword: &Token<'_>, values: &[Token<'_>]) {
        self.counts[2] += 1;
        if values.len() != 3 {
            return self.wrong_count(keyword, "vn", values.len(), "3 are needed");
        }
        if self.numbers(values).is_some() {
            self.write_numbers("vn", values);
        }
    }

    fn face(&mut self, keyword: &Token<'_>, values: &[Token<'_>]) {
        if values.len() < 3 {
            return self.fault(keyword, FaultKind::TooFewCorners(values.len()));
        }
        self.scan.text.push('f');
        for token in values {
            self.corner(token);
        }
        self.scan.text.push('\n');
        // more corners than this do not fit in memory as text; the mesh's constructor checks the sum
        self.scan.arities.push(u32::try_from(values.len()).unwrap_or(u32::MAX));
        let next = u32::try_from(self.names.len()).unwrap_or(u32::MAX);
        let object = match self.names.get(&self.name) {
            Some(&object) => object,
            None => {
                self.names.insert(self.name.clone(), next);
                self.scan.object_names.push(self.name.clone());
                next
            }
        };
        self.scan.face_objects.push(object);
    }

    fn corner(&mut self, token: &Token<'_>) {
        if token.text.split('/').count() > 3 {
            return self.fault(token, FaultKind::BadCorner(quote(token.text)));
        }
        let mut parts = token.text.split('/');
        let kinds = [IndexKind::Position, IndexKind::Uv, IndexKind::Normal];
        // the first `vt` and `vn` of the rewritten file stand for "none"
        let mut absolute = [0, 1, 1];
        for (slot, kind) in kinds.into_iter().enumerate() {
            match parts.next() {
                None | Some("") if slot > 0 => {}
                Some(part) => match part.parse::<i64>() {
                    Ok(index) => match self.resolve(token, kind, slot, index) {
                        Some(resolved) => absolute[slot] = resolved + usize::from(slot > 0),
                        None => return,
                    },
                    Err(_) => return self.fault(token, FaultKind::BadCorner(quote(token.text))),
                },
                None => return,
            }
        }
        let [v, vt, vn] = absolute;
        write!(self.scan.text, " {v}/{vt}/{vn}").expect("writing to a String cannot fail");
    }

    /// The index counted from 1, or `None` after noting the fault.
    fn resolve(&mut self, token: &Token<'_>, kind: IndexKind, slot: usize, index: i64) -> Option<usize> {
        let count = self.counts[slot];
        if index == 0 {
            self.fault(token, FaultKind::ZeroIndex(kind));
            return None;
        }
        let Ok(magnitude) = usize::try_from(index.unsigned_abs()) else {
            self.fault(token, FaultKind::OutOfRange { kind, index, count });
            return None;
        };
        if index > 0 {
            if magnitude > count {
                self.forward.push(ForwardReference { at: token.at, line: token.line, kind, index });
            }
            return Some(magnitude);
        }
        if magnitude > count {
            self.fault(token, FaultKind::OutOfRange { kind, index, count });
            return None;
        }
        Some(count - magnitude + 1)
    }

    /// The values as finite numbers, or `None` after noting every fault.
    fn numbers(&mut self, values: &[Token<'_>]) -> Option<Vec<f64>> {
        let mut numbers = Vec::with_capacity(values.len());
        for token in values {
            match token.text.parse::<f64>() {
                Ok(number) if number.is_finite() => numbers.push(number),
                Ok(_) => self.fault(token, FaultKind::NotFinite(quote(token.text))),
                Err(_) => self.fault(token, FaultKind::NotANumber(quote(token.text))),
            }
        }
        (numbers.len() == values.len()).then_some(numbers)
    }

    fn write_numbers(&mut self, keyword: &str, values: &[Token<'_>]) {
        self.scan.text.push_str(keyword);
        for token in values {
            self.scan.text.push(' ');
            self.scan.text.push_str(token.text);
        }
        self.scan.text.push('\n');
    }

    fn wrong_count(
        &mut self,
        token: &Token<'_>,
        keyword: &'static str,
        found: usize,
        expected: &'static str,
    ) {
        self.fault(token, FaultKind::ValueCount { keyword, found, expected });
    }

    fn fault(&mut self, token: &Token<'_>, kind: FaultKind) {
        if self.faults.len() < MOST_FAULTS {
            self.faults.push(placed(self.file, token.at, token.line, kind));
        } else {
            self.more += 1;
        }
    }

    fn finish(mut self) -> Result<Scan, Faults> {
        let mut late = Vec::new();
        for reference in std::mem::take(&mut self.forward) {
            let ForwardReference { at, line, kind, index } = reference;
            let count = self.counts[kind as usize];
            if usize::try_from(index).is_ok_and(|index| index <= count) {
                continue;
            }
            if late.len() < MOST_FAULTS {
                let kind = FaultKind::OutOfRange { kind, index, count };
                late.push(placed(self.file, at, line, kind));
            } else {
                self.more += 1;
            }
        }
        self.faults.append(&mut late);
        self.faults.sort_by_key(|fault| (fault.line, fault.column));
        self.more += self.faults.len().saturating_sub(MOST_FAULTS);
        self.faults.truncate(MOST_FAULTS);
        if !self.faults.is_empty() {
            return Err(Faults { listed: self.faults, more: self.more });
        }
        let mut ignored: Vec<_> = self.ignored.into_iter().collect();
        ignored.sort();
        self.scan.notes.ignored_statements = ignored;
        self.scan.positions = self.counts[0];
        Ok(self.scan)
    }
}

fn placed(file: &str, at: usize, line: LineAt, kind: FaultKind) -> ObjFault {
    ObjFault { line: line.number, column: file[line.start..at].chars().count() + 1, kind }
}

/// A piece of the file for a message: short, and without control characters.
fn quote(text: &str) -> String {
    let mut quoted: String =
        text.chars().take(LONGEST_QUOTE).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if text.chars().nth(LONGEST_QUOTE).is_some() {
        quoted.push('…');
    }
    quoted
}

#[cfg(test)]
mod tests;
