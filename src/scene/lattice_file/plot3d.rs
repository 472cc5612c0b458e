//! `Plot3D` grids in text, as pyGeo writes its boxes (`DVGeometry.writePlot3d`).
//!
//! Source: Walatka, Buning, Pierce, Elson (1990), *PLOT3D User's Manual*, NASA TM 101067, section 8.2, of several grids; pyGeo,
//! `pyBlock.py`.

use glam::DVec4;

use super::FileLattice;
use super::words::{TextFault, Words, fault};
use crate::scene::description::Block;
use crate::scene::parse::MAX_CONTROL_POINTS;

/// The control points of one of the grids: their number, the extents of all, then of each all x, all y and all z, the first index
/// fastest.
pub(super) fn read(text: &str, block: Option<&Block>) -> Result<FileLattice, TextFault> {
    let mut words = Words::new(text);
    let blocks: usize = words.number(|| "the number of grids".to_owned())?;
    let mut extents = Vec::new();
    for block in 1..=blocks {
        let mut counts = [0; 3];
        for (axis, count) in counts.iter_mut().enumerate() {
            *count = words.number(|| format!("extent {} of grid {block}", axis + 1))?;
        }
        let total = counts.iter().try_fold(1_usize, |total, &count| total.checked_mul(count));
        if !total.is_some_and(|total| (1..=MAX_CONTROL_POINTS).contains(&total)) {
            return Err(fault(
                0,
                format!(
                    "grid {block} has the extents {counts:?}; all above 0, and {MAX_CONTROL_POINTS} points at most, are valid"
                ),
            ));
        }
        extents.push(counts);
    }
    let chosen = choose(block, &extents)?;
    for (block, &[nx, ny, nz]) in extents.iter().enumerate().take(chosen + 1) {
        let count = nx * ny * nz;
        // no more than the file has, whatever it says
        let mut coordinates = [Vec::new(), Vec::new(), Vec::new()];
        for (list, name) in coordinates.iter_mut().zip(["x", "y", "z"]) {
            for place in 1..=count {
                list.push(words.number(|| format!("{name} {place} of {count} of grid {}", block + 1))?);
            }
        }
        if block == chosen {
            // the first index is fastest in the file, the last one here
            let place = |flat: usize| flat / (ny * nz) + nx * (flat / nz % ny + ny * (flat % nz));
            let [x, y, z] = &coordinates;
            let point = |i: usize| DVec4::new(x[i], y[i], z[i], 1.0);
            let points = (0..count).map(|flat| point(place(flat))).collect();
            return Ok(FileLattice { counts: [nx, ny, nz], points, ..FileLattice::default() });
        }
    }
    Err(fault(0, "has no grid".to_owned()))
}

/// The index of the grid that is asked for.
fn choose(block: Option<&Block>, extents: &[[usize; 3]]) -> Result<usize, TextFault> {
    let list = || {
        let list = extents.iter().enumerate().map(|(i, [x, y, z])| format!("{}: {x} x {y} x {z}", i + 1));
        list.collect::<Vec<_>>().join(", ")
    };
    match (block, extents) {
        (None, [_]) => Ok(0),
        (None, []) => Err(fault(0, "has no grid".to_owned())),
        (None, _) => {
            Err(fault(0, format!("has {} grids; block = 1 and so on says which ({})", extents.len(), list())))
        }
        (Some(Block::Number(number)), _) if (1..=extents.len()).contains(number) => Ok(number - 1),
        (Some(Block::Number(number)), _) => {
            Err(fault(0, format!("has no grid {number}; there are {}", list())))
        }
        (Some(Block::Name(_)), _) => {
            Err(fault(0, format!("grids have no names; block = 1 and so on says which ({})", list())))
        }
    }
}
