//! One cell in place of several pieces that differ by little.

use std::sync::Arc;

use glam::{DVec2, DVec4};

use super::branch::Piece;
use super::cell::Cell;
use super::chain::Formula;
use super::interpolate::interpolate;

/// What becomes of pieces that may be one cell.
pub(super) enum Merge {
    /// The cell, with the degrees of its patch.
    Cell(Cell, [usize; 2]),
    /// The side to be halved.
    Halve(usize),
}

/// A piece of a formula, the degrees of a patch for it, and the patch's error.
pub(super) type Fitted<'a> = (&'a Piece, [usize; 2], f64);

/// One cell for all pieces of a rectangle, if they differ by at most `within` or are themselves no larger; else the side along
/// which they reach farther. `radius` is that of the largest.
///
/// The control points of the difference of two patches bound it, and each patch is within its error of its piece; so the
/// surface, which is some piece everywhere, is within the sum of both of the patch that is taken.
pub(super) fn merge(
    formula: &Arc<Formula>,
    fits: &[Fitted<'_>],
    [low, high]: [DVec2; 2],
    (radius, within): (f64, f64),
) -> Merge {
    let degree = fits.iter().fold([1; 2], |[m, n], (_, degree, _)| [m.max(degree[0]), n.max(degree[1])]);
    let net = |(piece, ..): &Fitted<'_>| {
        let point =
            |st: DVec2| formula.position(low + st * (high - low), &mut piece.branch_list()).extend(1.0);
        interpolate(degree, point).control_points
    };
    let nets: Vec<_> = fits.iter().map(net).collect();
    let pairs = nets
        .iter()
        .enumerate()
        .flat_map(|(number, net)| nets[..number].iter().map(move |other| (net, other)));
    let apart = pairs.flat_map(|(a, b)| a.iter().zip(b)).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
    let errors = fits.iter().map(|(.., error)| *error).fold(0.0, f64::max);
    // as small as this, any of them is as good as a point
    let error = if radius <= 0.5 * within { 2.0 * radius } else { apart } + errors;
    let holds = |(piece, ..): &&Fitted<'_>| formula.is_in(0.5 * (low + high), piece);
    match fits.iter().find(holds).or(fits.first()) {
        Some((piece, ..)) if error <= within => {
            let (formula, piece) = (formula.clone(), piece.without_borders());
            Merge::Cell(Cell { formula, low, size: high - low, piece, error, leads: true }, degree)
        }
        _ => Merge::Halve(nets.first().map_or(0, |net| longer_side(net, degree))),
    }
}

/// The side of a net along which its control points reach farther.
fn longer_side(net: &[DVec4], [m, n]: [usize; 2]) -> usize {
    let length = |from: usize, to: usize| (net[to] - net[from]).length();
    let row = |i: usize| (0..n).map(|j| length(i * (n + 1) + j, i * (n + 1) + j + 1)).sum();
    let column = |j: usize| (0..m).map(|i| length(i * (n + 1) + j, (i + 1) * (n + 1) + j)).sum();
    let along_s: f64 = (0..=n).map(column).fold(0.0, f64::max);
    let along_t: f64 = (0..=m).map(row).fold(0.0, f64::max);
    usize::from(along_t > along_s)
}
