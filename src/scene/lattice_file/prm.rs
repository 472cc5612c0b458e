//! Parameter files of `PyGeM`.
//!
//! Source: `PyGeM`, `pygem/ffd.py`: a box of Bernstein polynomials of one degree less than control points, which move by parts
//! of the box's lengths along its axes.

use std::collections::HashMap;

use glam::{DVec3, DVec4};

use super::FileLattice;
use super::words::{TextFault, fault, number};
use crate::scene::parse::MAX_CONTROL_POINTS;
use crate::suggestion::quoted;

/// A key's lines of words, each with its number.
type Entries<'a> = HashMap<(String, String), Vec<(usize, Vec<&'a str>)>>;

/// The control points after their moves.
pub(super) fn read(text: &str) -> Result<FileLattice, TextFault> {
    let entries = sections(text)?;
    let counts = three::<usize>(&entries, "n control points", "a whole number from 2 on")?;
    let total = counts.iter().try_fold(1_usize, |total, &count| total.checked_mul(count));
    if counts.iter().any(|&count| count < 2) || total.is_none_or(|total| total > MAX_CONTROL_POINTS) {
        let message = format!(
            "n control points {counts:?}; 2 each at least, and {MAX_CONTROL_POINTS} in all at most, are valid"
        );
        return Err(fault(0, message));
    }
    let length = DVec3::from_array(three(&entries, "box length", "a finite number above 0")?);
    let origin = DVec3::from_array(three(&entries, "box origin", "a finite number")?);
    let angles: [f64; 3] = three(&entries, "rotation angle", "a finite number of degrees")?;
    if length.min_element() <= 0.0 {
        return Err(fault(0, format!("box length {:?}; numbers above 0 are valid", length.to_array())));
    }
    if angles != [0.0; 3] {
        let message = format!(
            "rotation angles {angles:?}: boxes along the axes alone are read; turn the object instead"
        );
        return Err(fault(0, message));
    }
    let [nx, ny, nz] = counts;
    let mut points: Vec<DVec4> = Vec::new();
    for flat in 0..nx * ny * nz {
        let index = [flat / (ny * nz), flat / nz % ny, flat % nz];
        let part = [0, 1, 2].map(|axis| index[axis] as f64 / (counts[axis] - 1) as f64);
        points.push((origin + length * DVec3::from_array(part)).extend(1.0));
    }
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let key = ("parameters weights".to_owned(), format!("parameter {name}"));
        for (line, words) in entries.get(&key).into_iter().flatten() {
            let expected = "three indices of a control point and its move in box lengths are needed";
            let [i, j, k, moved] = words.as_slice() else {
                return Err(fault(*line, format!("{} words; {expected}", words.len())));
            };
            let index = [i, j, k].map(|word| number::<usize>(word));
            let ([Some(i), Some(j), Some(k)], Some(moved)) = (index, number::<f64>(moved)) else {
                return Err(fault(*line, format!("{}; {expected}", quoted(&words.join(" ")))));
            };
            if [i, j, k].iter().zip(counts).any(|(&index, count)| index >= count) {
                let last = counts.map(|count| count - 1);
                return Err(fault(
                    *line,
                    format!("there is no control point {:?}; the last is {last:?}", [i, j, k]),
                ));
            }
            points[(i * ny + j) * nz + k][axis] += length[axis] * moved;
        }
    }
    let degree = counts.map(|count| count - 1);
    let bounds = Some([origin, origin + length]);
    Ok(FileLattice { counts, points, degree: Some(degree), bounds, knots: None })
}

/// The numbers of a key's three axes in the section of the box.
fn three<T: super::words::Number + Copy + Default>(
    entries: &Entries<'_>,
    key: &str,
    expected: &str,
) -> Result<[T; 3], TextFault> {
    let mut numbers = [T::default(); 3];
    for (number, axis) in numbers.iter_mut().zip(["x", "y", "z"]) {
        let key = format!("{key} {axis}");
        let lines = entries.get(&("box info".to_owned(), key.clone()));
        let Some((line, words)) = lines.and_then(|lines| lines.first()) else {
            return Err(fault(0, format!("[Box info] has no `{key}: `, {expected}")));
        };
        let [word] = words.as_slice() else {
            return Err(fault(*line, format!("{key} has {} words; {expected} is needed", words.len())));
        };
        let read = super::words::number(word);
        *number =
            read.ok_or_else(|| fault(*line, format!("{key} is {}; {expected} is needed", quoted(word))))?;
    }
    Ok(numbers)
}

/// Keys by section, both in small letters, as Python's `configparser` reads them: values go on in lines that are indented.
fn sections(text: &str) -> Result<Entries<'_>, TextFault> {
    let mut entries = Entries::new();
    let (mut section, mut key) = (String::new(), None::<String>);
    for (line, content) in (1..).zip(text.lines()) {
        let trimmed = content.trim();
        if trimmed.is_empty() || trimmed.starts_with(['#', ';']) {
            continue;
        }
        if let Some(name) = trimmed.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            (section, key) = (name.to_lowercase(), None);
            continue;
        }
        let value = match (&key, content.starts_with(char::is_whitespace)) {
            (Some(_), true) => trimmed,
            _ => {
                let Some((name, value)) = trimmed.split_once([':', '=']) else {
                    return Err(fault(
                        line,
                        format!("{} is neither `key: value` nor a [section]", quoted(trimmed)),
                    ));
                };
                key = Some(name.trim().to_lowercase());
                value.trim()
            }
        };
        let words: Vec<&str> = value.split_whitespace().collect();
        if let Some(key) = key.as_ref().filter(|_| !words.is_empty()) {
            entries.entry((section.clone(), key.clone())).or_default().push((line, words));
        }
    }
    Ok(entries)
}
