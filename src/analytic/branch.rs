//! Which piece of a formula with several is meant.
//!
//! A lattice has a polynomial for each knot box, a region has an inside and an outside, |x| has two signs. Each piece is
//! analytic, also beyond its own borders. An evaluation asks for its pieces one after the other; what answers them says
//! whether the answer comes from the numbers at hand or from a list.

use std::ops::Range;

use glam::DVec3;

use crate::patch::Overlap;
use crate::spline::{KnotBox, KnotVector, SplineVolume};

use super::disc::Disc;
use super::jet::Jet;
use super::number::Number;

/// Most pieces that are told apart in one rectangle.
pub(super) const MOST_PIECES: usize = 12;

/// Most pieces that meet in a rectangle which cannot be halved further: knot planes of all axes of three lattices.
pub(super) const MOST_PIECES_AT_POINT: usize = 512;

/// One answer: of a lattice 0 for outside, else 1 and the knot box's number; of a sign 1 for x >= 0, else 0.
pub(super) type Branch = u32;

/// The answer of a lattice for a place that is outside.
const OUTSIDE: Branch = 0;

/// A number with its first partial derivatives, as far as they are known, else 0.
pub(super) type Linear<T> = [T; 3];

/// Answers which piece is meant.
///
/// Not generic over the order of derivatives: so formulas are compiled once for all that answer.
pub(super) trait SelectBranch<T> {
    /// The knot box of a place; `None` outside the lattice.
    fn knot_box(&mut self, volume: &SplineVolume, place: &[Linear<T>; 3]) -> Option<KnotBox>;

    /// Whether x >= 0.
    fn is_positive(&mut self, x: Linear<T>) -> bool;

    /// Passes over the signs that a region asks for, its own and those of its bound before, if it is known that the place is
    /// outside; else does nothing.
    fn passes_over(&mut self, _sign_queries: usize) -> bool {
        false
    }
}

/// The bound of a region where it is not above 0, else nothing. `bound` asks for so many signs itself, before.
pub(super) fn inside_region<T: Number, const N: usize>(
    select: &mut dyn SelectBranch<T>,
    sign_queries: usize,
    bound: impl FnOnce(&mut dyn SelectBranch<T>) -> Jet<T, N>,
) -> Option<Jet<T, N>> {
    if select.passes_over(sign_queries) {
        return None;
    }
    let bound = bound(select);
    select.is_positive(bound.scale(-1.0).to_linear()).then_some(bound)
}

fn number(volume: &SplineVolume, knot_box: Option<KnotBox>) -> Branch {
    let [_, ny, nz] = [0, 1, 2].map(|axis| volume.axes()[axis].intervals());
    let flat = knot_box.map_or(0, |[i, j, k]| 1 + (i * ny + j) * nz + k);
    Branch::try_from(flat).expect("fewer than 2^32 knot boxes fit in memory")
}

fn knot_box(volume: &SplineVolume, choice: Branch) -> Option<KnotBox> {
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

/// An interval of an axis; outermost ones reach beyond the ends by the volume's border.
fn interval(knots: &KnotVector, index: usize, border: f64) -> [f64; 2] {
    let ends = knots.breakpoints();
    let start = if index == 0 { ends[0] - border } else { ends[index] };
    let end = if index + 2 == ends.len() { ends[index + 1] + border } else { ends[index + 1] };
    [start, end]
}

/// By the numbers themselves.
#[derive(Debug, Default)]
pub(super) struct ByValue;

impl SelectBranch<f64> for ByValue {
    fn knot_box(&mut self, volume: &SplineVolume, place: &[Linear<f64>; 3]) -> Option<KnotBox> {
        let [low, high] = volume.bounds();
        let place = DVec3::from_array(place.map(|[value, ..]| value));
        let inside = place.clamp(low, high);
        // so written, NaN is outside
        let is_near = (place - inside).abs().cmple(DVec3::splat(border(volume))).all();
        if is_near { volume.knot_box(inside) } else { None }
    }

    fn is_positive(&mut self, x: Linear<f64>) -> bool {
        x[0] >= 0.0
    }
}

/// From a list, in the order in which signs are asked for.
#[derive(Debug)]
pub(super) struct BranchList<'a> {
    branches: std::slice::Iter<'a, Branch>,
}

impl BranchList<'_> {
    /// Passes over the signs that a region asks for if their last answer is that it is outside.
    fn skips(&mut self, sign_queries: usize) -> bool {
        let outside = self.branches.as_slice().get(sign_queries) == Some(&0);
        if outside {
            self.branches.nth(sign_queries);
        }
        outside
    }

    fn next(&mut self) -> Branch {
        self.branches.next().copied().expect("the list has an answer for each question of its piece")
    }
}

impl<T> SelectBranch<T> for BranchList<'_> {
    fn knot_box(&mut self, volume: &SplineVolume, _place: &[Linear<T>; 3]) -> Option<KnotBox> {
        knot_box(volume, self.next())
    }

    fn is_positive(&mut self, _x: Linear<T>) -> bool {
        self.next() == 1
    }

    fn passes_over(&mut self, sign_queries: usize) -> bool {
        self.skips(sign_queries)
    }
}

/// As another, keeping the knot boxes.
pub(super) struct Recorded<'a, T> {
    pub(super) choose: &'a mut dyn SelectBranch<T>,
    pub(super) knot_boxes: Vec<Option<KnotBox>>,
}

impl<T> SelectBranch<T> for Recorded<'_, T> {
    fn knot_box(&mut self, volume: &SplineVolume, place: &[Linear<T>; 3]) -> Option<KnotBox> {
        let knot_box = self.choose.knot_box(volume, place);
        self.knot_boxes.push(knot_box);
        knot_box
    }

    fn is_positive(&mut self, x: Linear<T>) -> bool {
        self.choose.is_positive(x)
    }
}

/// From a list, with how far a place is inside the piece.
#[derive(Debug)]
pub(super) struct Margins<'a> {
    list: BranchList<'a>,
    /// Whether the answers are in doubt.
    open: std::slice::Iter<'a, bool>,
    /// How far off the parameters may be.
    tolerance: [f64; 2],
    /// Whether the place is inside all borders, or no farther outside than the tolerance.
    pub(super) inside: bool,
    /// Whether it is inside all of them without tolerance.
    pub(super) strictly: bool,
}

impl Margins<'_> {
    fn is_open(&mut self) -> bool {
        self.open.next().copied().unwrap_or(false)
    }

    /// How far x may be from its value for the error of the parameters and of its own rounding.
    fn slack(&self, [value, slopes @ ..]: Linear<f64>) -> f64 {
        let slopes = slopes.iter().zip(self.tolerance).map(|(slope, error)| slope.abs() * error);
        slopes.sum::<f64>() + 8.0 * f64::EPSILON * value.abs().max(1.0)
    }
}

/// How far x is inside an interval.
fn depth([x, ..]: Linear<f64>, [low, high]: [f64; 2]) -> f64 {
    (x - low).min(high - x)
}

impl SelectBranch<f64> for Margins<'_> {
    fn knot_box(&mut self, volume: &SplineVolume, place: &[Linear<f64>; 3]) -> Option<KnotBox> {
        let chosen = knot_box(volume, self.list.next());
        if self.is_open() {
            let border = border(volume);
            match chosen {
                Some(knot_box) => {
                    for axis in 0..3 {
                        let depth =
                            depth(place[axis], interval(&volume.axes()[axis], knot_box[axis], border));
                        // so written, NaN is outside
                        self.inside &= depth + self.slack(place[axis]) >= 0.0;
                        self.strictly &= depth >= 0.0;
                    }
                }
                None => {
                    let [low, high] = volume.bounds();
                    let outside = (0..3).any(|axis| {
                        let ends = [low[axis] - border, high[axis] + border];
                        depth(place[axis], ends) < self.slack(place[axis])
                    });
                    self.inside &= outside;
                    self.strictly &= outside;
                }
            }
        }
        chosen
    }

    fn is_positive(&mut self, x: Linear<f64>) -> bool {
        let positive = self.list.next() == 1;
        if self.is_open() {
            let inward = if positive { x[0] } else { -x[0] };
            self.inside &= inward + self.slack(x) >= 0.0;
            self.strictly &= inward >= 0.0;
        }
        positive
    }

    fn passes_over(&mut self, sign_queries: usize) -> bool {
        let open = self.open.as_slice().get(..=sign_queries).is_none_or(|open| open.contains(&true));
        let passes = !open && self.list.skips(sign_queries);
        if passes {
            self.open.nth(sign_queries);
        }
        passes
    }
}

/// A question.
#[derive(Debug)]
struct BranchQuery {
    chosen: Branch,
    /// All answers that are possible.
    all: Vec<Branch>,
    /// Whether it is about a place in a volume.
    by_place: bool,
}

/// All pieces that real numbers of a rectangle can be in: the answers so far come from a list, those after it from discs.
#[derive(Debug, Default)]
pub(super) struct Possible {
    /// The first answer of each question, with the others that are possible.
    queries: Vec<BranchQuery>,
    /// Answers that are given.
    given: Vec<Branch>,
}

impl Possible {
    /// With the answers of a piece.
    pub(super) fn given(piece: &Piece) -> Self {
        Self { queries: Vec::new(), given: piece.branches.to_vec() }
    }

    /// How the answers given are among those possible.
    pub(super) fn overlap(&self) -> Overlap {
        if self.queries.iter().any(|query| !query.all.contains(&query.chosen)) {
            Overlap::None
        } else if self.queries.iter().all(|query| query.all.len() == 1) {
            Overlap::Whole
        } else {
            Overlap::Partial
        }
    }

    fn answer(&mut self, by_place: bool, possible: impl FnOnce() -> Vec<Branch>) -> Branch {
        let all = possible();
        let chosen = self.given.get(self.queries.len()).copied().unwrap_or(all[0]);
        self.queries.push(BranchQuery { chosen, all, by_place });
        chosen
    }
}

impl SelectBranch<Disc> for Possible {
    fn knot_box(&mut self, volume: &SplineVolume, place: &[Linear<Disc>; 3]) -> Option<KnotBox> {
        let chosen = self.answer(true, || {
            let ranges: [_; 3] =
                std::array::from_fn(|axis| range(&volume.axes()[axis], border(volume), place[axis][0]));
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
        knot_box(volume, chosen)
    }

    fn is_positive(&mut self, x: Linear<Disc>) -> bool {
        let (centre, radius) = (x[0].centre(), x[0].reach()[0]);
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
fn range(knots: &KnotVector, border: f64, x: Disc) -> (Range<usize>, bool) {
    let (low, high) = (x.centre() - x.reach()[0], x.centre() + x.reach()[0]);
    let last = knots.intervals() - 1;
    let ([start, _], [_, end]) = (interval(knots, 0, border), interval(knots, last, border));
    if high < start || low > end {
        return (0..0, true);
    }
    let ends = knots.breakpoints();
    let clamped = |x: f64| x.clamp(ends[0], ends[last + 1]);
    // NaN may be anywhere
    let first = knots.interval(clamped(low)).unwrap_or(0);
    let after = knots.interval(clamped(high)).unwrap_or(last) + 1;
    (first..after, !(low >= start && high <= end))
}

/// A piece of a formula: its answers, and which of them other numbers of the rectangle would give differently.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Piece {
    pub(super) branches: Box<[Branch]>,
    pub(super) open: Box<[bool]>,
    /// Whether such an answer depends on a place in a volume, and not on the parameters alone.
    pub(super) open_by_place: bool,
    /// Whether some of the rectangle is in a volume and some is not: all other pieces meet without a gap.
    pub(super) may_be_torn: bool,
}

impl Piece {
    /// Answers as this piece has them.
    pub(super) fn branch_list(&self) -> BranchList<'_> {
        BranchList { branches: self.branches.iter() }
    }

    /// The same, with how far places are inside, whose parameters may be off by a tolerance.
    pub(super) fn margins(&self, tolerance: [f64; 2]) -> Margins<'_> {
        Margins { list: self.branch_list(), open: self.open.iter(), tolerance, inside: true, strictly: true }
    }

    /// The same piece, taken to be all of its rectangle.
    pub(super) fn without_borders(&self) -> Self {
        Self { open: self.open.iter().map(|_| false).collect(), ..self.clone() }
    }

    /// Whether it is not all of its rectangle.
    pub(super) fn has_borders(&self) -> bool {
        self.open.contains(&true)
    }
}

/// All pieces, each with its value; `None` if there are more than `most`. `evaluate` evaluates the formula over a rectangle.
pub(super) fn pieces<R>(
    most: usize,
    mut evaluate: impl FnMut(&mut Possible) -> R,
) -> Option<Vec<(Piece, R)>> {
    let mut found = Vec::new();
    let mut waiting = vec![Vec::new()];
    while let Some(given) = waiting.pop() {
        let from = given.len();
        let mut possible = Possible { queries: Vec::new(), given };
        let value = evaluate(&mut possible);
        let queries = possible.queries;
        for (place, BranchQuery { all, .. }) in queries.iter().enumerate().skip(from) {
            for &other in &all[1..] {
                let mut given: Vec<_> = queries[..place].iter().map(|query| query.chosen).collect();
                given.push(other);
                waiting.push(given);
            }
        }
        let piece = Piece {
            branches: queries.iter().map(|query| query.chosen).collect(),
            open: queries.iter().map(|query| query.all.len() > 1).collect(),
            open_by_place: queries.iter().any(|query| query.by_place && query.all.len() > 1),
            may_be_torn: queries
                .iter()
                .any(|query| query.by_place && query.all.len() > 1 && query.all.contains(&OUTSIDE)),
        };
        found.push((piece, value));
        if found.len() + waiting.len() > most {
            return None;
        }
    }
    found.sort_by(|(a, _), (b, _)| a.branches.cmp(&b.branches));
    Some(found)
}
