//! A volume's piece along a plane: the control points of the Bézier patch, by direct composition.
//!
//! Source: Feng, Nishita, Jin, Peng (2002), section 3.4.1, first solution; the products of Bernstein polynomials as in
//! `DeRose`, Goldman, Hagen, Mann (1993). No linear system is solved, so the control points are right to a few roundings,
//! where the interpolation of section 3.4.2 loses up to the condition of its matrices.

use glam::{DVec3, DVec4};

use crate::math::bernstein::inverse_binomial;
use crate::spline::{BernsteinRows, KnotBox, KnotVector, MAX_VOLUME_DEGREE, MAX_VOLUME_ORDER, SplineVolume};
use crate::subdivide::Frame;

use super::bezier_patch::BezierPatch;

/// Numbers of an axis' factor: both of its degrees, and its basis functions, are at most those of a volume.
const FACTOR_SIZE: usize = MAX_VOLUME_ORDER * MAX_VOLUME_ORDER * MAX_VOLUME_ORDER;

/// The basis functions of one axis along the frame, as polynomials in (s, t).
#[derive(Debug)]
struct AxisFactor {
    /// Degrees in s and t: the axis' degree, or 0 where the frame's direction does not change the axis.
    degree: [usize; 2],
    /// Scaled Bernstein coefficients (coefficient times binomials), t fastest: in each place those of all the basis
    /// functions, one more than the axis' degree.
    scaled: Vec<f64>,
}

impl Default for AxisFactor {
    fn default() -> Self {
        Self { degree: [0; 2], scaled: vec![0.0; FACTOR_SIZE] }
    }
}

/// Composes volume pieces with frames; keeps its buffers from patch to patch.
#[derive(Debug, Default)]
pub struct Composer {
    factors: [AxisFactor; 3],
    from: Vec<DVec4>,
    to: Vec<DVec4>,
}

impl Composer {
    /// The patch `(s, t) -> volume piece of the knot box at frame.point(s, t)`.
    ///
    /// Its degrees are the sums of the volume's degrees over the axes that change along the frame's directions
    /// (zeros in `frame.s` and `frame.t` must be exact). Each axis' basis functions are Bernstein polynomials of
    /// a = (x - start) / (end - start) over the knot box, x = c + p s + q t; with a as a polynomial of degree (1, 1) in
    /// scaled Bernstein form (coefficients times binomials) their powers are plain convolutions. The three axes'
    /// factors are multiplied in the same form and summed over the knot box's control points, one axis after the other.
    ///
    /// # Panics
    /// If the volume has no such knot box.
    pub fn compose(&mut self, volume: &SplineVolume, knot_box: KnotBox, frame: &Frame) -> BezierPatch {
        let axes = volume.axes();
        for axis in 0..3 {
            let line = AxisLine::new(&axes[axis], knot_box[axis], axis, frame);
            self.factors[axis].set(&axes[axis], knot_box[axis], line);
        }
        let order = axis_order(&self.factors);
        self.load(volume, volume.first_point(knot_box), order);
        let mut degree = [0, 0];
        for axis in order {
            degree = self.contract(axis, axes[axis].degree(), degree);
        }
        let control_points = unscale(&self.from, degree);
        if volume.is_rational() {
            BezierPatch::new(degree, control_points.collect())
        } else {
            // the sums' weights are 1 but for rounding
            BezierPatch::polynomial(degree, control_points.map(DVec4::truncate))
        }
    }

    /// Copies the control points from the first of a knot box on, the last axis of `order` fastest.
    fn load(&mut self, volume: &SplineVolume, first: [usize; 3], order: [usize; 3]) {
        let degree = volume.degree();
        self.from.clear();
        let mut index = [0; 3];
        for a in 0..=degree[order[0]] {
            index[order[0]] = first[order[0]] + a;
            for b in 0..=degree[order[1]] {
                index[order[1]] = first[order[1]] + b;
                for c in 0..=degree[order[2]] {
                    index[order[2]] = first[order[2]] + c;
                    self.from.push(volume.homogeneous(index[0], index[1], index[2]));
                }
            }
        }
    }

    /// Sums over the slowest remaining axis: polynomials of `degree` become ones of the degree returned.
    fn contract(&mut self, axis: usize, axis_degree: usize, degree: [usize; 2]) -> [usize; 2] {
        let factor = &self.factors[axis];
        let summed = [degree[0] + factor.degree[0], degree[1] + factor.degree[1]];
        let size = |[m, n]: [usize; 2]| (m + 1) * (n + 1);
        let run = self.from.len() / (size(degree) * (axis_degree + 1));
        self.to.clear();
        self.to.resize(size(summed) * run, DVec4::ZERO);
        let product = Product { factor, degree, run };
        match axis_degree {
            1 => product.add::<2>(&self.from, &mut self.to),
            2 => product.add::<3>(&self.from, &mut self.to),
            3 => product.add::<4>(&self.from, &mut self.to),
            4 => product.add::<5>(&self.from, &mut self.to),
            5 => product.add::<6>(&self.from, &mut self.to),
            6 => product.add::<7>(&self.from, &mut self.to),
            7 => product.add::<8>(&self.from, &mut self.to),
            8 => product.add::<9>(&self.from, &mut self.to),
            other => unreachable!("an axis has degree 1 to {MAX_VOLUME_DEGREE}, not {other}"),
        }
        std::mem::swap(&mut self.from, &mut self.to);
        summed
    }
}

/// The product of an axis' factor with polynomials whose coefficients are arrays over the axes that are still to sum.
struct Product<'a> {
    factor: &'a AxisFactor,
    /// The polynomials' degree.
    degree: [usize; 2],
    /// Points for each coefficient and basis function.
    run: usize,
}

impl Product<'_> {
    /// Adds the product, summed over the axis' `ORDER` basis functions.
    ///
    /// `from`: s coefficient, t coefficient, basis function, array, the last fastest; `to` the same without the basis
    /// function. The loops over basis functions and over a factor's row have lengths known when compiling, so that sums
    /// stay in registers.
    fn add<const ORDER: usize>(&self, from: &[DVec4], to: &mut [DVec4]) {
        if self.factor.degree[1] == 0 {
            self.add_rows::<ORDER, 1>(from, to);
        } else {
            self.add_rows::<ORDER, ORDER>(from, to);
        }
    }

    fn add_rows<const ORDER: usize, const ROW: usize>(&self, from: &[DVec4], to: &mut [DVec4]) {
        let (run, n) = (self.run, self.degree[1]);
        let stride = (n + ROW) * run;
        let (weights, _) = self.factor.scaled.as_chunks::<ORDER>();
        let (weights, _) = weights.as_chunks::<ROW>();
        let weights = &weights[..=self.factor.degree[0]];
        for (i, from_row) in from.chunks_exact((n + 1) * ORDER * run).enumerate() {
            for (j, from) in from_row.chunks_exact(ORDER * run).enumerate() {
                for (x, weights) in weights.iter().enumerate() {
                    let to = &mut to[(i + x) * stride + j * run..][..ROW * run];
                    add_run::<ORDER, ROW>(run, from, weights, to);
                }
            }
        }
    }
}

/// Adds to each of the `ROW` arrays of `to` the sum of the `ORDER` arrays of `from` with its weights.
fn add_run<const ORDER: usize, const ROW: usize>(
    run: usize,
    from: &[DVec4],
    weights: &[[f64; ORDER]; ROW],
    to: &mut [DVec4],
) {
    for j in 0..run {
        let points: [DVec4; ORDER] = std::array::from_fn(|r| from[r * run + j]);
        for (sum, weights) in to[j..].iter_mut().step_by(run).zip(weights) {
            for r in 0..ORDER {
                *sum += weights[r] * points[r];
            }
        }
    }
}

/// The order of summation: the axis with the largest factor last, when the fewest sums are left.
fn axis_order(factors: &[AxisFactor; 3]) -> [usize; 3] {
    let size = |axis: usize| (factors[axis].degree[0] + 1) * (factors[axis].degree[1] + 1);
    let mut order = [0, 1, 2];
    order.sort_by_key(|&axis| size(axis));
    order
}

/// Divides the scaled coefficients by their binomials.
fn unscale(scaled: &[DVec4], [m, n]: [usize; 2]) -> impl Iterator<Item = DVec4> {
    scaled.chunks_exact(n + 1).enumerate().flat_map(move |(i, row)| {
        let row_factor = inverse_binomial(m, i);
        row.iter().enumerate().map(move |(j, &sum)| sum * (row_factor * inverse_binomial(n, j)))
    })
}

/// An axis' parameter along the frame, from 0 to 1 over the knot interval: c + p s + q t.
#[derive(Clone, Copy)]
struct AxisLine {
    c: f64,
    p: f64,
    q: f64,
}

impl AxisLine {
    fn new(knots: &KnotVector, interval: usize, axis: usize, frame: &Frame) -> Self {
        let [start, end] = [knots.breakpoints()[interval], knots.breakpoints()[interval + 1]];
        let scale = 1.0 / (end - start);
        let c = (frame.origin[axis] - start) * scale;
        Self { c, p: frame.s[axis] * scale, q: frame.t[axis] * scale }
    }
}

impl AxisFactor {
    fn set(&mut self, knots: &KnotVector, interval: usize, line: AxisLine) {
        let rows = knots.bernstein_rows(interval);
        match knots.degree() {
            1 => self.set_order::<2>(rows, line),
            2 => self.set_order::<3>(rows, line),
            3 => self.set_order::<4>(rows, line),
            4 => self.set_order::<5>(rows, line),
            5 => self.set_order::<6>(rows, line),
            6 => self.set_order::<7>(rows, line),
            7 => self.set_order::<8>(rows, line),
            8 => self.set_order::<9>(rows, line),
            other => unreachable!("an axis has degree 1 to {MAX_VOLUME_DEGREE}, not {other}"),
        }
    }

    fn set_order<const ORDER: usize>(&mut self, rows: &BernsteinRows, line: AxisLine) {
        match (line.p != 0.0, line.q != 0.0) {
            (false, false) => self.combine::<ORDER, 0, 0>(rows, line),
            (false, true) => self.combine::<ORDER, 0, 1>(rows, line),
            (true, false) => self.combine::<ORDER, 1, 0>(rows, line),
            (true, true) => self.combine::<ORDER, 1, 1>(rows, line),
        }
    }

    /// The basis functions as sums of the powers of a line of degree (`M`, `N`).
    fn combine<const ORDER: usize, const M: usize, const N: usize>(
        &mut self,
        rows: &BernsteinRows,
        line: AxisLine,
    ) {
        let k = ORDER - 1;
        self.degree = [M * k, N * k];
        let powers = line.powers::<ORDER, M, N>();
        let (scaled, _) = self.scaled.as_chunks_mut::<ORDER>();
        for x in 0..=M * k {
            for y in 0..=N * k {
                let mut sums = [0.0; ORDER];
                for (r, sum) in sums.iter_mut().enumerate() {
                    for (i, power) in powers.iter().enumerate() {
                        *sum += power[x][y] * rows[i][r];
                    }
                }
                scaled[x * (N * k + 1) + y] = sums;
            }
        }
    }
}

/// A polynomial in scaled Bernstein form, of degree below `ORDER` in s (rows) and in t.
type Scaled<const ORDER: usize> = [[f64; ORDER]; ORDER];

impl AxisLine {
    /// a^i (1 - a)^(k - i) for all i, where a = c + p s + q t is of degree (`M`, `N`), 0 or 1 each.
    fn powers<const ORDER: usize, const M: usize, const N: usize>(self) -> [Scaled<ORDER>; ORDER] {
        let Self { c, p, q } = self;
        let line = [[c, c + q], [c + p, c + p + q]];
        let rest = line.map(|row| row.map(|a| 1.0 - a));
        let mut powers = [[[0.0; ORDER]; ORDER]; ORDER];
        powers[0][0][0] = 1.0;
        for level in 1..ORDER {
            for i in (0..level).rev() {
                powers[i + 1] = times_line::<ORDER, M, N>(&powers[i], line, level);
            }
            powers[0] = times_line::<ORDER, M, N>(&powers[0], rest, level);
        }
        powers
    }
}

/// The product of a polynomial of `level` coefficients (1 where the line is constant) with a line.
#[inline(always)]
fn times_line<const ORDER: usize, const M: usize, const N: usize>(
    polynomial: &Scaled<ORDER>,
    line: [[f64; 2]; 2],
    level: usize,
) -> Scaled<ORDER> {
    let mut product = [[0.0; ORDER]; ORDER];
    let (rows, row) = (if M == 0 { 1 } else { level }, if N == 0 { 1 } else { level });
    for x in 0..rows {
        for y in 0..row {
            for dx in 0..=M {
                for dy in 0..=N {
                    product[x + dx][y + dy] += line[dx][dy] * polynomial[x][y];
                }
            }
        }
    }
    product
}

/// The undeformed polygon's plane as a patch of degree 1 × 1.
pub(crate) fn flat_patch(frame: &Frame) -> BezierPatch {
    let corner = |s: DVec3, t: DVec3| (frame.origin + s + t).extend(1.0);
    let zero = DVec3::ZERO;
    BezierPatch::new(
        [1, 1],
        vec![corner(zero, zero), corner(zero, frame.t), corner(frame.s, zero), corner(frame.s, frame.t)],
    )
}
