//! Which faces of a plane overlap.

use std::collections::HashMap;

use glam::DVec2;

use crate::math::polygon;
use crate::patch::{Face, Region};

use super::object::{PatchHit, TracedObject};

/// Loops overlap if they have more in common than this part of the smaller one's area: neighbours overlap by rounding.
const COMMON: f64 = 1e-12;

/// Loops that overlap others of the same face: faces of a plane with the same winding share a patch.
#[derive(Debug, Default)]
pub(super) struct Overlaps {
    /// By object, patch and polygon, the other loops of the patch that overlap the polygon's.
    others: HashMap<[u32; 3], Vec<u32>>,
}

impl Overlaps {
    /// Those of all faces.
    pub(super) fn new(objects: &[TracedObject]) -> Self {
        let mut overlaps = Self::default();
        for (object, traced) in (0..).zip(objects) {
            for (patch, face) in (0..).zip(traced.faces()) {
                if face.region.len() > 1 {
                    overlaps.add([object, patch], face);
                }
            }
        }
        overlaps
    }

    fn add(&mut self, [object, patch]: [u32; 2], face: &Face) {
        for [a, b] in overlapping(&face.region) {
            for [one, other] in [[a, b], [b, a]] {
                let polygon = face.region.trim_loop(one).polygon;
                let other = u32::try_from(other).expect("fewer than 2^32 loops fit in memory");
                self.others.entry([object, patch, polygon]).or_default().push(other);
            }
        }
    }

    /// The other loops of its patch that overlap the one that a hit is in.
    pub(super) fn others(&self, hit: &PatchHit) -> &[u32] {
        self.others.get(&[hit.object, hit.patch, hit.polygon]).map_or(&[], Vec::as_slice)
    }

    /// Whether no loop overlaps another.
    pub(super) fn is_empty(&self) -> bool {
        self.others.is_empty()
    }
}

/// Pairs of loops with an area in common.
fn overlapping(region: &Region) -> Vec<[usize; 2]> {
    let loops: Vec<_> = region.loops().map(|trim_loop| region.corners(&trim_loop)).collect();
    let boxes: Vec<_> = loops.iter().filter_map(|corners| polygon::bounds(corners.iter().copied())).collect();
    let grid = Grid { side: (loops.len() as f64).sqrt().ceil() };
    let mut cells: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
    let mut found = Vec::new();
    for (number, &[low, high]) in boxes.iter().enumerate() {
        let ([from_s, from_t], [to_s, to_t]) = (grid.cell(low), grid.cell(high));
        for cell in (from_s..=to_s).flat_map(|s| (from_t..=to_t).map(move |t| [s, t])) {
            let here = cells.entry(cell).or_default();
            for &other in &*here {
                let [least, greatest] = [low.max(boxes[other][0]), high.min(boxes[other][1])];
                // each pair in the first cell of what their boxes share
                let meets = least.cmplt(greatest).all() && grid.cell(least) == cell;
                if meets && have_area(loops[number], loops[other]) {
                    found.push([other, number]);
                }
            }
            here.push(number);
        }
    }
    found
}

fn have_area(a: &[DVec2], b: &[DVec2]) -> bool {
    let smaller = polygon::doubled_area(a).min(polygon::doubled_area(b));
    polygon::doubled_area(&polygon::clip_to_convex(a, b)) > COMMON * smaller
}

/// The unit square in square cells.
struct Grid {
    side: f64,
}

impl Grid {
    #[expect(clippy::cast_possible_truncation, reason = "a cell of a small grid")]
    fn cell(&self, st: DVec2) -> [i64; 2] {
        (st * self.side).to_array().map(|x| x.floor() as i64)
    }
}
