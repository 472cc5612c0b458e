//! Boxes for free-form deformation at the end of SU2's meshes.
//!
//! Source: SU2, `CFreeFormDefBox.cpp` and `CBSplineBlending.cpp`; its documentation, *Mesh file*.

use glam::{DVec3, DVec4};

use super::FileLattice;
use super::words::{TextFault, fault, number};
use crate::scene::description::Block;
use crate::scene::parse::MAX_CONTROL_POINTS;
use crate::suggestion::quoted;

/// Corners in the order of the file (VTK's hexahedron), each by the ends of the axes it is at.
const CORNERS: [[usize; 3]; 8] =
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];

/// A box as the file has it.
#[derive(Debug, Default)]
struct FfdBox {
    line: usize,
    tag: String,
    degree: [Option<usize>; 3],
    order: [Option<usize>; 3],
    is_spline: bool,
    corners: Vec<(usize, Vec<f64>)>,
    points: Option<Vec<(usize, [usize; 3], DVec3)>>,
}

/// The control points of one of the boxes.
pub(super) fn read(text: &str, block: Option<&Block>) -> Result<FileLattice, TextFault> {
    let boxes = boxes(text)?;
    let names = || boxes.iter().map(|ffd_box| quoted(&ffd_box.tag)).collect::<Vec<_>>().join(", ");
    let chosen = match (block, boxes.as_slice()) {
        (_, []) => return Err(fault(0, "has no FFD_TAG=, and so no box")),
        (None, [only]) => Some(only),
        (None, _) => {
            let message = format!("has {} boxes; block = \"NAME\" says which ({})", boxes.len(), names());
            return Err(fault(0, message));
        }
        (Some(Block::Number(number)), _) => number.checked_sub(1).and_then(|index| boxes.get(index)),
        (Some(Block::Name(name)), _) => boxes.iter().find(|ffd_box| ffd_box.tag == *name),
    };
    let Some(chosen) = chosen else {
        let asked = match block {
            Some(Block::Name(name)) => quoted(name),
            Some(Block::Number(number)) => number.to_string(),
            None => String::new(),
        };
        return Err(fault(0, format!("has no box {asked}; there are {}", names())));
    };
    chosen.lattice()
}

impl FfdBox {
    fn lattice(&self) -> Result<FileLattice, TextFault> {
        let fault = |message: String| Err(fault(self.line, format!("box {}: {message}", quoted(&self.tag))));
        let mut counts = [0; 3];
        for (axis, count) in counts.iter_mut().enumerate() {
            let name = ['I', 'J', 'K'][axis];
            match self.degree[axis] {
                Some(degree @ 1..=MAX_CONTROL_POINTS) => *count = degree + 1,
                _ => {
                    return fault(format!(
                        "needs FFD_DEGREE_{name}= from 1 on; boxes of two dimensions are not read"
                    ));
                }
            }
        }
        let total = counts.iter().try_fold(1_usize, |total, &count| total.checked_mul(count));
        let Some(total) = total.filter(|&total| total <= MAX_CONTROL_POINTS) else {
            return fault(format!("{counts:?} control points are more than {MAX_CONTROL_POINTS}"));
        };
        let degree = match (self.is_spline, self.order) {
            (false, _) => counts.map(|count| count - 1),
            (true, [Some(i @ 2..), Some(j @ 2..), Some(k @ 2..)]) => {
                let order = [i, j, k];
                [0, 1, 2].map(|axis| order[axis].min(counts[axis]) - 1)
            }
            (true, _) => return fault("needs BSPLINE_ORDER_I=, _J= and _K= from 2 on".to_owned()),
        };
        let bounds = self.bounds()?;
        let given = self.points.as_deref().unwrap_or_default();
        if given.len() != total {
            return fault(format!(
                "has {} control points of {total}; SU2_DEF computes them where FFD_CONTROL_POINTS= is 0",
                given.len()
            ));
        }
        let [_, ny, nz] = counts;
        let mut points = vec![DVec4::NAN; total];
        for &(line, [i, j, k], place) in given {
            if [i, j, k].iter().zip(counts).any(|(&index, count)| index >= count) {
                let last = counts.map(|count| count - 1);
                let message = format!("there is no control point {:?}; the last is {last:?}", [i, j, k]);
                return Err(super::words::fault(line, message));
            }
            points[(i * ny + j) * nz + k] = place.extend(1.0);
        }
        if let Some(flat) = points.iter().position(|point| point.is_nan()) {
            let index = [flat / (ny * nz), flat / nz % ny, flat % nz];
            return fault(format!("control point {index:?} is not given, another one twice"));
        }
        Ok(FileLattice { counts, points, degree: Some(degree), bounds: Some(bounds), knots: None })
    }

    /// The box of the corners, which must lie along the axes.
    fn bounds(&self) -> Result<[DVec3; 2], TextFault> {
        let mut corners = [DVec3::ZERO; 8];
        if self.corners.len() != 8 {
            let message = format!(
                "box {}: {} corners; 8 are needed (4 are of two dimensions)",
                quoted(&self.tag),
                self.corners.len()
            );
            return Err(fault(self.line, message));
        }
        for (corner, (line, numbers)) in corners.iter_mut().zip(&self.corners) {
            let [x, y, z] = numbers[..] else {
                return Err(fault(*line, "a corner is x, y and z".to_owned()));
            };
            *corner = DVec3::new(x, y, z);
        }
        let ends = [corners[0], corners[6]];
        let is_box = CORNERS
            .iter()
            .zip(corners)
            .all(|(&[i, j, k], corner)| corner == DVec3::new(ends[i].x, ends[j].y, ends[k].z));
        if !is_box || (ends[1] - ends[0]).min_element() <= 0.0 {
            let message = format!(
                "box {}: its corners are no box along the axes, first the least corner; others are not read",
                quoted(&self.tag)
            );
            return Err(fault(self.line, message));
        }
        Ok(ends)
    }
}

/// All boxes of the file.
fn boxes(text: &str) -> Result<Vec<FfdBox>, TextFault> {
    let mut boxes: Vec<FfdBox> = Vec::new();
    let mut lines = (1..).zip(text.lines());
    while let Some((line, content)) = lines.next() {
        let content = content.split('%').next().unwrap_or_default();
        let Some((key, value)) = content.split_once('=') else { continue };
        let (key, value) = (key.trim(), value.trim());
        let whole = || {
            number::<usize>(value)
                .ok_or_else(|| fault(line, format!("{key}= {}; a whole number is needed", quoted(value))))
        };
        if key == "FFD_TAG" {
            boxes.push(FfdBox { line, tag: value.to_owned(), ..FfdBox::default() });
            continue;
        }
        let Some(ffd_box) = boxes.last_mut() else { continue };
        match key {
            "FFD_DEGREE_I" => ffd_box.degree[0] = Some(whole()?),
            "FFD_DEGREE_J" => ffd_box.degree[1] = Some(whole()?),
            "FFD_DEGREE_K" => ffd_box.degree[2] = Some(whole()?),
            "BSPLINE_ORDER_I" | "FFD_BSPLINE_ORDER_I" => ffd_box.order[0] = Some(whole()?),
            "BSPLINE_ORDER_J" | "FFD_BSPLINE_ORDER_J" => ffd_box.order[1] = Some(whole()?),
            "BSPLINE_ORDER_K" | "FFD_BSPLINE_ORDER_K" => ffd_box.order[2] = Some(whole()?),
            "FFD_BLENDING" => match value {
                "BEZIER" => {}
                "BSPLINE_UNIFORM" => ffd_box.is_spline = true,
                other => {
                    let message =
                        format!("FFD_BLENDING= {}; valid are BEZIER and BSPLINE_UNIFORM", quoted(other));
                    return Err(fault(line, message));
                }
            },
            "FFD_CORNER_POINTS" => {
                for _ in 0..whole()? {
                    ffd_box.corners.push(numbers(lines.next(), "a corner")?);
                }
            }
            "FFD_CONTROL_POINTS" => {
                let mut points = Vec::new();
                for _ in 0..whole()? {
                    let (line, numbers) = numbers(lines.next(), "a control point, i j k x y z,")?;
                    let [i, j, k, x, y, z] = numbers[..] else {
                        return Err(fault(
                            line,
                            format!("{} numbers; a control point is i j k x y z", numbers.len()),
                        ));
                    };
                    #[expect(clippy::cast_possible_truncation, reason = "what is cut off is compared")]
                    let index = [i, j, k].map(|index| index as usize);
                    if index.map(|index| index as f64) != [i, j, k] {
                        return Err(fault(line, "i, j and k must be whole numbers from 0 on".to_owned()));
                    }
                    points.push((line, index, DVec3::new(x, y, z)));
                }
                ffd_box.points = Some(points);
            }
            _ => {}
        }
    }
    Ok(boxes)
}

/// The numbers of a line.
fn numbers(line: Option<(usize, &str)>, what: &str) -> Result<(usize, Vec<f64>), TextFault> {
    let Some((line, content)) = line else {
        return Err(fault(0, format!("ends where {what} is needed")));
    };
    let numbers: Option<Vec<f64>> = content.split_whitespace().map(number).collect();
    numbers
        .map(|numbers| (line, numbers))
        .ok_or_else(|| fault(line, format!("{} is not {what} of finite numbers", quoted(content.trim()))))
}
