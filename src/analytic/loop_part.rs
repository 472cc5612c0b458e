//! Loops of a base face's region, clipped to the rectangles of its cells.

use glam::DVec2;

use crate::math::polygon::Side;
use crate::patch::{LineCuts, LoopCorner, Region, RegionBuilder, has_area};

/// What of a loop is in a rectangle.
pub(super) struct LoopPart {
    pub(super) polygon: u32,
    pub(super) face: u32,
    pub(super) corners: Vec<LoopCorner>,
}

impl LoopPart {
    /// What of it is in a rectangle, if that has an area.
    pub(super) fn clipped(&self, rectangle: [DVec2; 2], cuts: &mut LineCuts<'_>) -> Option<Self> {
        let (mut corners, mut kept) = (self.corners.clone(), Vec::new());
        for axis in 0..2 {
            for (end, side) in rectangle.iter().zip([Side::Above, Side::Below]) {
                let line = [axis as u64, end[axis].to_bits()];
                cuts.clip(&corners, (axis, end[axis], side), line, &mut kept);
                std::mem::swap(&mut corners, &mut kept);
            }
        }
        has_area(&corners).then_some(Self { corners, ..*self })
    }
}

/// The region of parts in a rectangle, whose unit square it is in, with the vertices of its corners.
pub(super) fn local_region(parts: &[LoopPart], [low, high]: [DVec2; 2]) -> (Region, Vec<u32>) {
    let mut builder = RegionBuilder::default();
    for part in parts {
        let local = part.corners.iter().map(|&LoopCorner { st, vertex }| LoopCorner {
            st: ((st - low) / (high - low)).clamp(DVec2::ZERO, DVec2::ONE),
            vertex,
        });
        builder.push(part.polygon, part.face, local);
    }
    builder.finish()
}
