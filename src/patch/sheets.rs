//! Faces over one unit square, with borders between them that are curves in the parameters.

use glam::DVec2;

use crate::math::polygon;

use super::face::Face;

/// Parameters this close to a border are on it, in parts of the square: far above rounding, far below what a picture shows.
const ON_BORDER: f64 = 1e-7;

/// Bisections of a border's place between two points: to the rounding of parameters.
const BISECTIONS: usize = 52;

/// Steps in which a border is looked for across an edge.
const STEPS: u32 = 8;

/// Squares along each side of a region's bounding rectangle in whose sides borders are looked for.
const GRID: u32 = 8;

/// The faces over one unit square, which share a region; each has the part of it on its own side of the curved borders.
#[derive(Clone, Copy, Debug)]
pub struct Sheets<'a> {
    faces: &'a [Face],
}

impl<'a> Sheets<'a> {
    /// The sheets that the faces of an object are, in their order.
    pub(crate) fn of_faces(faces: &'a [Face]) -> impl Iterator<Item = Self> {
        faces.chunk_by(|_, next| !next.leads()).map(|faces| Self { faces })
    }

    /// The faces.
    #[must_use]
    pub const fn faces(&self) -> &'a [Face] {
        self.faces
    }

    /// The number of the face that holds a place.
    #[must_use]
    pub fn holder(&self, st: DVec2) -> usize {
        let within = |tolerance| self.faces.iter().position(|face| face.holds(st, DVec2::splat(tolerance)));
        within(0.0).or_else(|| within(ON_BORDER)).unwrap_or(0)
    }

    /// All faces that hold a place or have it on their border, by bits; all of them if rounding leaves none.
    #[must_use]
    pub fn holders(&self, st: DVec2) -> u32 {
        let holds = |face: &Face| face.holds(st, DVec2::splat(ON_BORDER));
        let faces = (0..).zip(self.faces);
        let bits = faces.fold(0, |bits, (number, face)| bits | u32::from(holds(face)) << number);
        if bits == 0 { u32::MAX } else { bits }
    }

    /// Between two places with different holders, how far from the first to the second the holder changes.
    #[must_use]
    pub fn crossing(&self, [from, to]: [DVec2; 2]) -> f64 {
        let own = self.holder(from);
        let (mut inside, mut outside) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (inside + outside);
            if self.holder(from.lerp(to, middle)) == own { inside = middle } else { outside = middle }
        }
        0.5 * (inside + outside)
    }

    /// The place on a border nearest to a place beside it, across an edge that has its ends on the border; `None` if there is
    /// none within half the edge's length. It is the same seen from both sides.
    #[must_use]
    pub fn on_border(&self, [from, to]: [DVec2; 2], st: DVec2) -> Option<DVec2> {
        let is_reversed = (to.x, to.y) < (from.x, from.y);
        let across = if is_reversed { (from - to).perp() } else { (to - from).perp() };
        let own = self.holder(st);
        let mut last = 0.0;
        for step in 1..=STEPS {
            let next = 0.5 * f64::from(step) / f64::from(STEPS);
            for sign in [1.0, -1.0] {
                let ends = [last, next].map(|part| st + sign * part * across);
                if self.holder(ends[1]) != own && self.holder(ends[0]) == own {
                    return Some(ends[0].lerp(ends[1], self.crossing(ends)));
                }
            }
            last = next;
        }
        None
    }

    /// Whether two of the faces are farther apart than `distance` where they meet inside of a loop of their region: looked for
    /// along a grid of lines.
    #[must_use]
    pub fn are_torn(&self, outline: &[DVec2], distance: f64) -> bool {
        let may_be_torn = |face: &Face| face.exact.as_ref().is_some_and(|exact| exact.may_be_torn());
        let (true, Some([low, high])) =
            (self.faces.iter().any(may_be_torn), polygon::bounds(outline.iter().copied()))
        else {
            return false;
        };
        let at = |i: u32, j: u32| low + (high - low) * DVec2::new(i.into(), j.into()) / f64::from(GRID);
        let is_apart = |[(from, a), (to, b)]: [(DVec2, usize); 2]| {
            a != b && {
                let st = from.lerp(to, self.crossing([from, to]));
                let [a, b] = [a, b].map(|face| self.faces[face].eval(st).position);
                a.distance(b) > distance
            }
        };
        let mut above: Vec<(DVec2, usize)> = Vec::new();
        (0..=GRID).any(|i| {
            let row: Vec<_> = (0..=GRID).map(|j| (at(i, j), self.holder(at(i, j)))).collect();
            let torn = row.windows(2).any(|pair| is_apart([pair[0], pair[1]]))
                || above.iter().zip(&row).any(|(a, b)| is_apart([*a, *b]));
            above = row;
            torn
        })
    }
}
