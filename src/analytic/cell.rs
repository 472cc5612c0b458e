//! A rectangle of parameters of one piece of a formula.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::patch::{ExactSurface, Overlap, PatchPoint};

use super::branch::{ByValue, Piece, Possible};
use super::chain::Formula;
use super::disc::Disc;
use super::number::{Number, SIZES};

/// A cell: one analytic piece of a formula over a rectangle of the base patch's parameters, which are its unit square.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    pub(super) formula: Arc<Formula>,
    pub(super) low: DVec2,
    pub(super) size: DVec2,
    pub(super) piece: Piece,
    pub(super) error: f64,
    /// Whether it is the first of the pieces of its rectangle.
    pub(super) leads: bool,
}

impl Cell {
    fn base(&self, st: DVec2) -> DVec2 {
        self.low + st * self.size
    }

    /// Point and partial derivatives by the base patch's parameters, scaled to this one's.
    fn scaled(&self, point: PatchPoint) -> PatchPoint {
        PatchPoint { dp_ds: point.dp_ds * self.size.x, dp_dt: point.dp_dt * self.size.y, ..point }
    }
}

/// Sets of a rectangle's parameters, as large as `scale` says for each set along s and along t.
pub(super) fn rectangle([low, high]: [DVec2; 2], scale: [[f64; SIZES]; 2]) -> [Disc; 2] {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    // rounding of the middle
    let half = half + 2.0 * f64::EPSILON;
    [0, 1].map(|axis| Disc::around(middle[axis], || scale[axis].map(|scale| scale * half[axis])))
}

/// What of a rectangle of a formula's base patch belongs to a piece.
pub(super) fn overlap(formula: &Formula, piece: &Piece, rectangle: [Disc; 2]) -> Overlap {
    let mut possible = Possible::given(piece);
    formula.range(rectangle, &mut possible);
    possible.overlap()
}

impl ExactSurface for Cell {
    fn eval(&self, st: DVec2) -> PatchPoint {
        self.scaled(self.formula.eval(self.base(st), &mut self.piece.branch_list()))
    }

    fn position(&self, st: DVec2) -> DVec3 {
        self.formula.position(self.base(st), &mut self.piece.branch_list())
    }

    fn eval_whole(&self, st: DVec2) -> PatchPoint {
        self.scaled(self.formula.eval(self.base(st), &mut ByValue))
    }

    fn leads(&self) -> bool {
        self.leads
    }

    fn received(&self, st: DVec2) -> DVec3 {
        self.formula.position_after(self.base(st), self.formula.steps() - 1)
    }

    fn error(&self) -> f64 {
        self.error
    }

    fn has_borders(&self) -> bool {
        self.piece.has_borders()
    }

    fn sides(&self, st: DVec2, tolerance: DVec2) -> [bool; 2] {
        if !self.has_borders() {
            return [true; 2];
        }
        let mut margins = self.piece.margins((tolerance * self.size).to_array());
        if self.piece.open_by_place {
            self.formula.eval(self.base(st), &mut margins);
        } else {
            self.formula.ask(self.base(st), &mut margins);
        }
        [margins.inside, margins.strictly]
    }

    fn may_be_torn(&self) -> bool {
        self.piece.may_be_torn
    }

    fn overlap(&self, low: DVec2, high: DVec2) -> Overlap {
        if !self.has_borders() {
            return Overlap::Whole;
        }
        overlap(&self.formula, &self.piece, rectangle([self.base(low), self.base(high)], [[1.0; SIZES]; 2]))
    }

    fn bytes(&self) -> usize {
        size_of::<Self>() + size_of_val(&*self.piece.branches) + size_of_val(&*self.piece.open)
    }
}
