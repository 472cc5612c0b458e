//! Which piece of a formula with several is meant.
//!
//! A lattice has a polynomial for each knot box, a region has an inside and an outside, |x| has two signs. Each piece is
//! analytic, also beyond its own borders. An evaluation asks for its pieces one after the other; what they are asked of says
//! whether the answer comes from the numbers at hand or from a list.

use std::ops::Range;

use crate::patch::Overlap;
use crate::spline::{Cell, SplineVolume};

use super::disc::Disc;
use super::jet::{Jet, Point};
use super::number::Number;

/// Most pieces that are told apart in one rectangle.
pub(super) const MOST_PIECES: usize = 12;

/// One answer: of a lattice 0 for outside, else 1 and the knot box's number; of a sign 1 for x >= 0, else 0.
pub(super) type Choice = u32;

/// Answers which piece is meant.
pub(super) trait Choose<T> {
    /// The knot box of a place; `None` outside the lattice.
    fn cell<const N: usize>(&mut self, volume: &SplineVolume, place: &Point<T, N>) -> Option<Cell>;

    /// Whether x >= 0.
    fn is_positive<const N: usize>(&mut self, x: &Jet<T, N>) -> bool;

    /// The bound of a region where it is not above 0, else nothing. `bound` asks so many questions itself, before.
    fn region<const N: usize>(
        &mut self,
        _questions: usize,
        bound: impl FnOnce(&mut Self) -> Jet<T, N>,
    ) -> Option<Jet<T, N>>
    where
        T: Number,
        Self: Sized,
    {
        let bound = bound(self);
        self.is_positive(&bound.scale(-1.0)).then_some(bound)
    }
}

fn number(volume: &SplineVolume, cell: Option<Cell>) -> Choice {
    let [_, ny, nz] = [0, 1, 2].map(|axis| volume.axes()[axis].intervals());
    let flat = cell.map_or(0, |[i, j, k]| 1 + (i * ny + j) * nz + k);
    Choice::try_from(flat).expect("fewer than 2^32 knot boxes fit in memory")
}

fn cell(volume: &SplineVolume, choice: Choice) -> Option<Cell> {
    let [_, ny, nz] = [0, 1, 2].map(|axis| volume.axes()[axis].intervals());
    let flat = (choice as usize).checked_sub(1)?;
    Some([flat / (ny * nz), flat / nz % ny, flat % nz])
}

/// A place no farther outside a volume than this is inside, in the outermost knot boxes: a surface in a face of the volume's
/// box must not fall apart by its rounding. In the units of its parameters, of which it is the size's rounding by some
/// thousand operations.
fn border(volume: &SplineVolume) -> f64 {
    let [low, high] = volume.bounds();
    4096.0 * f64::EPSILON * (high - low).max_element().max(low.abs().max(high.abs()).max_element())
}

fn domain(volume: &SplineVolume, axis: usize) -> [f64; 2] {
    let ends = volume.axes()[axis].breakpoints();
    [ends[0], ends[ends.len() - 1]]
}

/// An interval of an axis; outermost ones reach beyond the ends.
fn interval(volume: &SplineVolume, axis: usize, index: usize) -> [f64; 2] {
    let ends = volume.axes()[axis].breakpoints();
    let start = if index == 0 { ends[0] - border(volume) } else { ends[index] };
    let end = if index + 2 == ends.len() { ends[index + 1] + border(volume) } else { ends[index + 1] };
    [start, end]
}

/// By the numbers themselves.
#[derive(Debug, Default)]
pub(super) struct ByValue;

impl Choose<f64> for ByValue {
    fn cell<const N: usize>(&mut self, volume: &SplineVolume, place: &Point<f64, N>) -> Option<Cell> {
        let mut inside = [0.0; 3];
        for axis in 0..3 {
            let [start, end] = domain(volume, axis);
            let value = place[axis].value();
            inside[axis] = value.clamp(start, end);
            // so written, NaN is outside
            if (value - inside[axis]).abs() > border(volume) || value.is_nan() {
                return None;
            }
        }
        volume.cell(inside.into())
    }

    fn is_positive<const N: usize>(&mut self, x: &Jet<f64, N>) -> bool {
        x.value() >= 0.0
    }
}

/// From a list, in the order of the questions.
#[derive(Debug)]
pub(super) struct Listed<'a> {
    choices: std::slice::Iter<'a, Choice>,
}

impl<'a> Listed<'a> {
    pub(super) fn new(choices: &'a [Choice]) -> Self {
        Self { choices: choices.iter() }
    }

    /// Passes over a region's questions if their last answer is that it is outside.
    fn skips(&mut self, questions: usize) -> bool {
        let outside = self.choices.as_slice().get(questions) == Some(&0);
        if outside {
            self.choices.nth(questions);
        }
        outside
    }

    fn next(&mut self) -> Choice {
        self.choices.next().copied().expect("the list has an answer for each question of its piece")
    }
}

impl<T> Choose<T> for Listed<'_> {
    fn cell<const N: usize>(&mut self, volume: &SplineVolume, _place: &Point<T, N>) -> Option<Cell> {
        cell(volume, self.next())
    }

    fn is_positive<const N: usize>(&mut self, _x: &Jet<T, N>) -> bool {
        self.next() == 1
    }

    fn region<const N: usize>(
        &mut self,
        questions: usize,
        bound: impl FnOnce(&mut Self) -> Jet<T, N>,
    ) -> Option<Jet<T, N>>
    where
        T: Number,
    {
        if self.skips(questions) {
            return None;
        }
        let bound = bound(self);
        <Self as Choose<T>>::is_positive(self, &bound.scale(-1.0)).then_some(bound)
    }
}

/// As another, keeping the knot boxes.
#[derive(Debug)]
pub(super) struct Recorded<'a, C> {
    pub(super) choose: &'a mut C,
    pub(super) cells: Vec<Option<Cell>>,
}

impl<T, C: Choose<T>> Choose<T> for Recorded<'_, C> {
    fn cell<const N: usize>(&mut self, volume: &SplineVolume, place: &Point<T, N>) -> Option<Cell> {
        let cell = self.choose.cell(volume, place);
        self.cells.push(cell);
        cell
    }

    fn is_positive<const N: usize>(&mut self, x: &Jet<T, N>) -> bool {
        self.choose.is_positive(x)
    }
}

/// From a list, with how far a place is inside the piece.
#[derive(Debug)]
pub(super) struct Margins<'a> {
    listed: Listed<'a>,
    /// Whether the answers are in doubt.
    open: std::slice::Iter<'a, bool>,
    /// How far off the parameters may be.
    tolerance: [f64; 2],
    /// Whether the place is inside all borders, or no farther outside than the tolerance.
    pub(super) inside: bool,
    /// Whether it is inside all of them without tolerance.
    pub(super) strictly: bool,
}

impl<'a> Margins<'a> {
    pub(super) fn new(choices: &'a [Choice], open: &'a [bool], tolerance: [f64; 2]) -> Self {
        Self { listed: Listed::new(choices), open: open.iter(), tolerance, inside: true, strictly: true }
    }

    fn is_open(&mut self) -> bool {
        self.open.next().copied().unwrap_or(false)
    }

    /// How far x may be from its value for the error of the parameters and of its own rounding.
    fn slack<const N: usize>(&self, x: &Jet<f64, N>) -> f64 {
        let slopes =
            x.coefficients.iter().skip(1).zip(self.tolerance).map(|(slope, error)| slope.abs() * error);
        slopes.sum::<f64>() + 8.0 * f64::EPSILON * x.value().abs().max(1.0)
    }

    /// How far a coordinate is inside an interval.
    fn depth<const N: usize>(&self, x: &Jet<f64, N>, [low, high]: [f64; 2]) -> f64 {
        (x.value() - low).min(high - x.value()) + self.slack(x)
    }
}

impl Choose<f64> for Margins<'_> {
    fn cell<const N: usize>(&mut self, volume: &SplineVolume, place: &Point<f64, N>) -> Option<Cell> {
        let chosen = cell(volume, self.listed.next());
        if self.is_open() {
            let inside = |cell: Cell| (0..3).map(move |axis| (axis, interval(volume, axis, cell[axis])));
            match chosen {
                // so written, NaN is outside
                Some(cell) => {
                    let depths = inside(cell)
                        .map(|(axis, ends)| (self.depth(&place[axis], ends), self.slack(&place[axis])));
                    let depths: Vec<_> = depths.collect();
                    self.inside &= depths.iter().all(|(depth, _)| *depth >= 0.0);
                    self.strictly &= depths.iter().all(|(depth, slack)| depth - slack >= 0.0);
                }
                None => {
                    let outside = (0..3).any(|axis| {
                        let [start, end] = domain(volume, axis);
                        let beyond = [start - border(volume), end + border(volume)];
                        self.depth(&place[axis], beyond) < 2.0 * self.slack(&place[axis])
                    });
                    self.inside &= outside;
                    self.strictly &= outside;
                }
            }
        }
        chosen
    }

    fn is_positive<const N: usize>(&mut self, x: &Jet<f64, N>) -> bool {
        let positive = self.listed.next() == 1;
        if self.is_open() {
            let inward = if positive { x.value() } else { -x.value() };
            self.inside &= inward + self.slack(x) >= 0.0;
            self.strictly &= inward >= 0.0;
        }
        positive
    }

    fn region<const N: usize>(
        &mut self,
        questions: usize,
        bound: impl FnOnce(&mut Self) -> Jet<f64, N>,
    ) -> Option<Jet<f64, N>> {
        let open = self.open.as_slice().get(..=questions).is_none_or(|open| open.contains(&true));
        if !open && self.listed.skips(questions) {
            self.open.nth(questions);
            return None;
        }
        let bound = bound(self);
        self.is_positive(&bound.scale(-1.0)).then_some(bound)
    }
}

/// A question.
#[derive(Debug)]
struct Asked {
    chosen: Choice,
    /// All answers that are possible.
    all: Vec<Choice>,
    /// Whether it is about a place in a volume.
    by_place: bool,
}

/// All pieces that real numbers of a rectangle can be in: the answers so far come from a list, those after it from discs.
#[derive(Debug, Default)]
pub(super) struct Possible {
    /// The first answer of each question, with the others that are possible.
    asked: Vec<Asked>,
    /// Answers that are given.
    given: Vec<Choice>,
}

impl Possible {
    /// With the first answers given.
    pub(super) fn given(choices: &[Choice]) -> Self {
        Self { asked: Vec::new(), given: choices.to_vec() }
    }

    /// How the answers given are among those possible.
    pub(super) fn overlap(&self) -> Overlap {
        if self.asked.iter().any(|asked| !asked.all.contains(&asked.chosen)) {
            Overlap::None
        } else if self.asked.iter().all(|asked| asked.all.len() == 1) {
            Overlap::Whole
        } else {
            Overlap::Partial
        }
    }

    fn answer(&mut self, by_place: bool, possible: impl FnOnce() -> Vec<Choice>) -> Choice {
        let all = possible();
        let chosen = self.given.get(self.asked.len()).copied().unwrap_or(all[0]);
        self.asked.push(Asked { chosen, all, by_place });
        chosen
    }
}

impl Choose<Disc> for Possible {
    fn cell<const N: usize>(&mut self, volume: &SplineVolume, place: &Point<Disc, N>) -> Option<Cell> {
        let chosen = self.answer(true, || {
            let ranges: [_; 3] = std::array::from_fn(|axis| range(volume, axis, place[axis].value()));
            let mut all = Vec::new();
            for i in ranges[0].0.clone() {
                for j in ranges[1].0.clone() {
                    for k in ranges[2].0.clone() {
                        all.push(number(volume, Some([i, j, k])));
                        if all.len() > MOST_PIECES {
                            return all;
                        }
                    }
                }
            }
            if ranges.iter().any(|(_, beyond)| *beyond) {
                all.push(number(volume, None));
            }
            all
        });
        cell(volume, chosen)
    }

    fn is_positive<const N: usize>(&mut self, x: &Jet<Disc, N>) -> bool {
        let (centre, radius) = (x.value().centre(), x.value().reach()[0]);
        let chosen = self.answer(false, || {
            if centre >= radius {
                vec![1]
            } else if centre < -radius {
                vec![0]
            } else {
                vec![1, 0]
            }
        });
        chosen == 1
    }
}

/// The intervals of an axis that real numbers of a disc can be in, and whether they can be outside all.
fn range(volume: &SplineVolume, axis: usize, x: Disc) -> (Range<usize>, bool) {
    let (low, high) = (x.centre() - x.reach()[0], x.centre() + x.reach()[0]);
    let last = volume.axes()[axis].intervals() - 1;
    let ([start, _], [_, end]) = (interval(volume, axis, 0), interval(volume, axis, last));
    if high < start || low > end {
        return (0..0, true);
    }
    let reached = |index: &usize| {
        let [start, end] = interval(volume, axis, *index);
        // so written, NaN may be anywhere
        !(high < start || low > end)
    };
    let first = (0..=last).find(reached).unwrap_or(0);
    let after = (0..=last).rev().find(reached).map_or(0, |index| index + 1);
    (first..after, !(low >= start && high <= end))
}

/// A piece of a formula: its answers, and which of them other numbers of the rectangle would give differently.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Piece {
    pub(super) choices: Box<[Choice]>,
    pub(super) open: Box<[bool]>,
    /// Whether such an answer depends on a place in a volume, and not on the parameters alone.
    pub(super) open_by_place: bool,
}

/// All pieces; `None` if there are more than [`MOST_PIECES`]. `evaluate` evaluates the formula over a rectangle.
pub(super) fn pieces(mut evaluate: impl FnMut(&mut Possible)) -> Option<Vec<Piece>> {
    let mut found = Vec::new();
    let mut waiting = vec![Vec::new()];
    while let Some(given) = waiting.pop() {
        let from = given.len();
        let mut possible = Possible { asked: Vec::new(), given };
        evaluate(&mut possible);
        let asked = possible.asked;
        for (place, Asked { all, .. }) in asked.iter().enumerate().skip(from) {
            for &other in &all[1..] {
                let mut given: Vec<_> = asked[..place].iter().map(|asked| asked.chosen).collect();
                given.push(other);
                waiting.push(given);
            }
        }
        found.push(Piece {
            choices: asked.iter().map(|asked| asked.chosen).collect(),
            open: asked.iter().map(|asked| asked.all.len() > 1).collect(),
            open_by_place: asked.iter().any(|asked| asked.by_place && asked.all.len() > 1),
        });
        if found.len() + waiting.len() > MOST_PIECES {
            return None;
        }
    }
    found.sort_by(|a, b| a.choices.cmp(&b.choices));
    Some(found)
}
