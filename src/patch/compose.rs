//! A volume's piece along a plane: the control points of the Bézier patch, by direct composition.
//!
//! Source: Feng, Nishita, Jin, Peng (2002), section 3.4.1, first solution; by polar forms as in `DeRose`, Goldman,
//! Hagen, Mann (1993). No linear system is solved, so the control points are right to a few roundings, where the
//! interpolation of section 3.4.2 loses up to the condition of its matrices.

use std::array;

use glam::{DVec3, DVec4};

use crate::math::bernstein::binomial;
use crate::spline::{Cell, KnotVector, MAX_VOLUME_DEGREE, SplineVolume};
use crate::subdivide::Frame;

use super::bezier_patch::BezierPatch;

/// Coefficients of an axis' factor: both of its degrees at most [`MAX_VOLUME_DEGREE`].
const FACTOR_SIZE: usize = (MAX_VOLUME_DEGREE + 1) * (MAX_VOLUME_DEGREE + 1);

/// The basis functions of one axis along the frame, as polynomials in (s, t).
struct AxisFactor {
    /// Degrees in s and t: the axis' degree, or 0 where the frame's direction does not change the axis.
    degree: [usize; 2],
    /// Scaled Bernstein coefficients (coefficient times binomials) of each basis function, t fastest.
    scaled: [[f64; FACTOR_SIZE]; MAX_VOLUME_DEGREE + 1],
}

/// Composes volume pieces with frames; keeps its buffers from patch to patch.
#[derive(Debug, Default)]
pub struct Composer {
    from: Vec<DVec4>,
    to: Vec<DVec4>,
}

impl Composer {
    /// The patch `(s, t) -> volume piece of the cell at frame.point(s, t)`.
    ///
    /// Its degrees are the sums of the volume's degrees over the axes that change along the frame's directions
    /// (zeros in `frame.s` and `frame.t` must be exact). With x = c + p s + q t along an axis of degree k, the basis
    /// function with polar form f has the Bernstein coefficients
    /// `b_xy` = `Σ_l` C(k,l) C(k-l,x-l) C(k-x,y-l) / (C(k,x) C(k,y)) f((c+p+q)^l, (c+p)^(x-l), (c+q)^(y-l), c^(k-x-y+l));
    /// the three factors are multiplied in scaled Bernstein form and summed over the cell's control points, one axis
    /// after the other.
    ///
    /// # Panics
    /// If the volume has no such cell.
    pub fn compose(&mut self, volume: &SplineVolume, cell: Cell, frame: &Frame) -> BezierPatch {
        let factors: [AxisFactor; 3] =
            array::from_fn(|axis| axis_factor(&volume.axes()[axis], cell[axis], axis, frame));
        let order = axis_order(&factors);
        self.load(volume, cell, order);
        let mut degree = [0, 0];
        for axis in order.into_iter().rev() {
            self.contract(&factors[axis], volume.axes()[axis].degree(), degree);
            degree = [degree[0] + factors[axis].degree[0], degree[1] + factors[axis].degree[1]];
        }
        let control_points = unscale(&self.from, degree, volume.is_rational());
        BezierPatch::new(degree, control_points)
    }

    /// Copies the cell's control points, the last axis of `order` fastest.
    fn load(&mut self, volume: &SplineVolume, cell: Cell, order: [usize; 3]) {
        let degree = volume.degree();
        self.from.clear();
        let mut index = [0; 3];
        for a in 0..=degree[order[0]] {
            index[order[0]] = cell[order[0]] + a;
            for b in 0..=degree[order[1]] {
                index[order[1]] = cell[order[1]] + b;
                for c in 0..=degree[order[2]] {
                    index[order[2]] = cell[order[2]] + c;
                    self.from.push(volume.homogeneous(index[0], index[1], index[2]));
                }
            }
        }
    }

    /// Sums over the fastest remaining index: polynomials of `degree` become ones of the summed degree.
    fn contract(&mut self, factor: &AxisFactor, axis_degree: usize, degree: [usize; 2]) {
        let [fm, fn_] = factor.degree;
        let [m, n] = degree;
        let size = (m + 1) * (n + 1);
        let (rows, row) = (m + fm + 1, n + fn_ + 1);
        self.to.clear();
        for group in self.from.chunks_exact(size * (axis_degree + 1)) {
            let start = self.to.len();
            self.to.resize(start + rows * row, DVec4::ZERO);
            let sum = &mut self.to[start..];
            for (polynomial, scaled) in group.chunks_exact(size).zip(&factor.scaled) {
                for x in 0..=fm {
                    for y in 0..=fn_ {
                        let weight = scaled[x * (fn_ + 1) + y];
                        for (i, source) in polynomial.chunks_exact(n + 1).enumerate() {
                            let target = &mut sum[(i + x) * row + y..][..n + 1];
                            for (target, &source) in target.iter_mut().zip(source) {
                                *target += weight * source;
                            }
                        }
                    }
                }
            }
        }
        std::mem::swap(&mut self.from, &mut self.to);
    }
}

/// The order of summation: the axis with the largest factor first in memory, so last in time.
fn axis_order(factors: &[AxisFactor; 3]) -> [usize; 3] {
    let size = |axis: usize| (factors[axis].degree[0] + 1) * (factors[axis].degree[1] + 1);
    let mut order = [0, 1, 2];
    order.sort_by_key(|&axis| std::cmp::Reverse(size(axis)));
    order
}

/// Divides the scaled coefficients by their binomials; weights of a volume that is not rational are exactly 1.
fn unscale(scaled: &[DVec4], [m, n]: [usize; 2], rational: bool) -> Vec<DVec4> {
    let mut control_points = Vec::with_capacity(scaled.len());
    for (i, row) in scaled.chunks_exact(n + 1).enumerate() {
        for (j, &sum) in row.iter().enumerate() {
            let point = sum / (binomial(m, i) * binomial(n, j));
            control_points.push(if rational { point } else { point.truncate().extend(1.0) });
        }
    }
    control_points
}

fn axis_factor(knots: &KnotVector, interval: usize, axis: usize, frame: &Frame) -> AxisFactor {
    let k = knots.degree();
    let (c, p, q) = (frame.origin[axis], frame.s[axis], frame.t[axis]);
    let corners = [c + p + q, c + p, c + q, c];
    let degree = [if p != 0.0 { k } else { 0 }, if q != 0.0 { k } else { 0 }];
    let mut factor = AxisFactor { degree, scaled: [[0.0; FACTOR_SIZE]; MAX_VOLUME_DEGREE + 1] };
    for x in 0..=degree[0] {
        for y in 0..=degree[1] {
            for l in (x + y).saturating_sub(k)..=x.min(y) {
                let mut arguments = [c; MAX_VOLUME_DEGREE];
                arguments[..l].fill(corners[0]);
                arguments[l..x].fill(corners[1]);
                arguments[x..x + y - l].fill(corners[2]);
                let values = knots.polar_form(interval, &arguments[..k]);
                let weight = binomial(k, l) * binomial(k - l, x - l) * binomial(k - x, y - l);
                for (scaled, value) in factor.scaled.iter_mut().zip(values) {
                    scaled[x * (degree[1] + 1) + y] += weight * value;
                }
            }
        }
    }
    factor
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
