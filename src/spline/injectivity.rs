//! Where a volume folds over: the sign of its Jacobian determinant, proved or refuted.

use std::collections::VecDeque;

use glam::{DVec3, DVec4};

use crate::math::bernstein;

use super::knot_vector::MAX_VOLUME_ORDER;
use super::volume::{KnotBox, SplineVolume};

/// Sub-boxes examined for one knot box before the question is left open.
///
/// A volume away from a fold is settled in 1 to 100; only one whose determinant comes close to 0 without reaching it
/// needs more.
const MAX_BOXES: usize = 4000;

/// The same for all knot boxes of a lattice together; each is examined to a few dozen in any case.
const MAX_BOXES_TOGETHER: usize = 400_000;

/// What is known of the Jacobian determinant over a knot box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Orientation {
    /// Proved positive throughout: the volume is one to one there, locally.
    Positive,
    /// A point was found where it is 0 or negative: the volume folds over.
    FoldsOver,
    /// Neither within the limit of work: it comes close to 0.
    Undecided,
}

/// The sign of the Jacobian determinant over a knot box.
///
/// The determinant's sign is that of the 4 × 4 determinant of the homogeneous value and its three partials. Interval
/// bounds of those from the control points of the Bézier form decide sub-boxes, which are halved until they do.
///
/// # Panics
/// If the volume has no such knot box.
#[must_use]
pub fn orientation(volume: &SplineVolume, knot_box: KnotBox) -> Orientation {
    orientation_within(volume, knot_box, MAX_BOXES)
}

/// The sign of the Jacobian determinant over each of some knot boxes, as [`orientation`]; of thousands of them each is examined
/// less closely.
///
/// # Panics
/// If the volume has no such knot box.
#[must_use]
pub fn orientations<'a>(
    volume: &SplineVolume,
    knot_boxes: impl ExactSizeIterator<Item = &'a KnotBox>,
) -> Vec<Orientation> {
    let most = (MAX_BOXES_TOGETHER / knot_boxes.len().max(1)).clamp(24, MAX_BOXES);
    knot_boxes.map(|&knot_box| orientation_within(volume, knot_box, most)).collect()
}

fn orientation_within(volume: &SplineVolume, knot_box: KnotBox, most: usize) -> Orientation {
    let mut queue = VecDeque::from([bezier_form(volume, knot_box)]);
    let degree = volume.degree();
    let mut boxes = 0;
    while let Some(net) = queue.pop_front() {
        boxes += 1;
        let determinant = bound(&net, degree);
        if determinant.low > 0.0 {
            continue;
        }
        if corner_determinant(&net, degree) <= 0.0 {
            return Orientation::FoldsOver;
        }
        if boxes >= most {
            return Orientation::Undecided;
        }
        let axis = widest(&net, degree);
        let (first, second) = halve(net, degree, axis);
        queue.push_back(first);
        queue.push_back(second);
    }
    Orientation::Positive
}

/// A knot box' piece in Bézier form: homogeneous control points, third index fastest.
struct Net(Vec<DVec4>);

fn flat(index: [usize; 3], degree: [usize; 3]) -> usize {
    (index[0] * (degree[1] + 1) + index[1]) * (degree[2] + 1) + index[2]
}

fn indices(degree: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let [u, v, w] = degree;
    (0..=u).flat_map(move |i| (0..=v).flat_map(move |j| (0..=w).map(move |k| [i, j, k])))
}

/// Bézier extraction: control point a of the piece is the polar form at (start^(k-a), end^a).
fn bezier_form(volume: &SplineVolume, knot_box: KnotBox) -> Net {
    let degree = volume.degree();
    let weights: [Vec<[f64; MAX_VOLUME_ORDER]>; 3] = std::array::from_fn(|axis| {
        let knots = &volume.axes()[axis];
        let (start, end) = (knots.breakpoints()[knot_box[axis]], knots.breakpoints()[knot_box[axis] + 1]);
        (0..=degree[axis])
            .map(|a| {
                let mut arguments = vec![start; degree[axis]];
                arguments[..a].fill(end);
                knots.polar_form(knot_box[axis], &arguments)
            })
            .collect()
    });
    let first = volume.first_point(knot_box);
    let point = |[a, b, c]: [usize; 3]| {
        indices(degree)
            .map(|[i, j, k]| {
                let weight = weights[0][a][i] * weights[1][b][j] * weights[2][c][k];
                weight * volume.homogeneous(first[0] + i, first[1] + j, first[2] + k)
            })
            .sum()
    };
    Net(indices(degree).map(point).collect())
}

/// A closed interval; rounding is not directed, so a bound this close to 0 that rounding decides it may be wrong.
#[derive(Clone, Copy, Debug)]
struct Interval {
    low: f64,
    high: f64,
}

impl Interval {
    const EMPTY: Self = Self { low: f64::INFINITY, high: f64::NEG_INFINITY };

    fn include(&mut self, x: f64) {
        self.low = self.low.min(x);
        self.high = self.high.max(x);
    }

    fn add(self, other: Self) -> Self {
        Self { low: self.low + other.low, high: self.high + other.high }
    }

    fn sub(self, other: Self) -> Self {
        Self { low: self.low - other.high, high: self.high - other.low }
    }

    fn mul(self, other: Self) -> Self {
        let products =
            [self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high];
        let mut product = Self::EMPTY;
        products.into_iter().for_each(|x| product.include(x));
        product
    }
}

/// Bounds of the determinant over a box.
fn bound(net: &Net, degree: [usize; 3]) -> Interval {
    // about the middle, so that the value's row is small; the determinant does not change
    let centre = net.0[net.0.len() / 2];
    let centre = centre.truncate() / centre.w;
    let about = |point: DVec4| (point.truncate() - point.w * centre).extend(point.w);
    let mut rows = [[Interval::EMPTY; 4]; 4];
    for index in indices(degree) {
        let here = about(net.0[flat(index, degree)]);
        include(&mut rows[3], here);
        for axis in 0..3 {
            if index[axis] < degree[axis] {
                let mut next = index;
                next[axis] += 1;
                include(&mut rows[axis], about(net.0[flat(next, degree)]) - here);
            }
        }
    }
    determinant(&rows)
}

fn include(row: &mut [Interval; 4], value: DVec4) {
    for (interval, x) in row.iter_mut().zip(value.to_array()) {
        interval.include(x);
    }
}

/// 4 × 4 determinant by 2 × 2 minors of the upper and lower rows.
fn determinant(rows: &[[Interval; 4]; 4]) -> Interval {
    let minor = |upper: usize, a: usize, b: usize| {
        rows[upper][a].mul(rows[upper + 1][b]).sub(rows[upper][b].mul(rows[upper + 1][a]))
    };
    let product = |a: usize, b: usize, c: usize, d: usize| minor(0, a, b).mul(minor(2, c, d));
    product(0, 1, 2, 3)
        .sub(product(0, 2, 1, 3))
        .add(product(0, 3, 1, 2))
        .add(product(1, 2, 0, 3))
        .sub(product(1, 3, 0, 2))
        .add(product(2, 3, 0, 1))
}

/// The determinant at the box's first corner, where values and partials are differences of control points.
fn corner_determinant(net: &Net, degree: [usize; 3]) -> f64 {
    let here = net.0[0];
    let position = here.truncate() / here.w;
    let partial = |axis: usize| {
        let mut next = [0; 3];
        next[axis] = 1;
        let difference = net.0[flat(next, degree)] - here;
        difference.truncate() - difference.w * position
    };
    let (u, v, w): (DVec3, DVec3, DVec3) = (partial(0), partial(1), partial(2));
    u.cross(v).dot(w)
}

/// The axis along which the control points differ most from a straight course.
fn widest(net: &Net, degree: [usize; 3]) -> usize {
    let spread = |axis: usize| {
        let mut interval = [Interval::EMPTY; 4];
        for index in indices(degree) {
            if index[axis] < degree[axis] {
                let mut next = index;
                next[axis] += 1;
                let difference = net.0[flat(next, degree)] - net.0[flat(index, degree)];
                include(&mut interval, difference);
            }
        }
        interval.iter().map(|i| i.high - i.low).fold(0.0, f64::max)
    };
    // partials vary along every axis, so halve them in turn where one does not stand out
    (0..3).max_by(|&a, &b| spread(a).total_cmp(&spread(b))).unwrap_or(0)
}

fn halve(mut net: Net, degree: [usize; 3], axis: usize) -> (Net, Net) {
    let strides = [(degree[1] + 1) * (degree[2] + 1), degree[2] + 1, 1];
    let mut second = net.0.clone();
    for index in indices(degree) {
        if index[axis] == 0 {
            let start = flat(index, degree);
            bernstein::split(&mut net.0[start..], &mut second[start..], strides[axis], degree[axis], 0.5);
        }
    }
    (net, Net(second))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spline::{Axis, ControlLattice};

    fn lattice() -> ControlLattice {
        ControlLattice::identity([2, 3, 2], [4, 5, 4], [DVec3::ZERO, DVec3::ONE], 0).unwrap()
    }

    #[test]
    fn the_identity_and_a_twist_are_positive() {
        let mut lattice = lattice();
        let identity = lattice.volume().unwrap();
        assert_eq!(orientation(&identity, [1, 0, 1]), Orientation::Positive);
        lattice.twist(Axis::Z, 60.0);
        for k in 0..2 {
            assert_eq!(orientation(&lattice.volume().unwrap(), [0, 1, k]), Orientation::Positive);
        }
        lattice.set_weight([1, 1, 1], 5.0).unwrap();
        assert_eq!(orientation(&lattice.volume().unwrap(), [0, 0, 0]), Orientation::Positive);
    }

    #[test]
    fn a_mirrored_and_a_folded_lattice_fold_over() {
        let mut folded = lattice();
        folded.move_by([1, 2, 1], DVec3::X * 3.0).unwrap();
        assert_eq!(orientation(&folded.volume().unwrap(), [0, 0, 0]), Orientation::FoldsOver);
        let mut mirrored = lattice();
        mirrored.taper(Axis::Z, [-1.0, 1.0]);
        assert_eq!(orientation(&mirrored.volume().unwrap(), [0, 0, 1]), Orientation::FoldsOver);
    }
}
