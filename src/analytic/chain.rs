//! A base patch and the deformations it goes through.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use thiserror::Error;

use crate::patch::{BezierPatch, Chart, PatchPoint};
use crate::spline::KnotBox;

use super::branch::{ByValue, Piece, Recorded, SelectBranch};
use super::jet::{Jet, Point};
use super::number::{MAX_ORDER, Number};
use super::step::Step;
use super::taylor::on_patch;

/// Deformations that follow a normal or tangents of the surface, at most, in one chain: each takes one order of derivatives.
pub const MAX_FIELDS: usize = MAX_ORDER - 1;

/// Roundings that a step's coordinates go through, about.
const ROUNDINGS: f64 = 16.0;

/// Why deformations make no chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum ChainError {
    /// Each that follows a normal or tangents takes a derivative of what is before it.
    #[error("{fields} deformations follow a normal or tangents; {MAX_FIELDS} are the most")]
    Fields {
        /// How many there are.
        fields: usize,
    },
}

/// Deformations one after the other.
#[derive(Clone, Debug, Default)]
pub struct Chain {
    pub(super) steps: Vec<Step>,
    /// How many take derivatives of the surface.
    fields: usize,
}

impl Chain {
    /// The chain of deformations, in the order they apply.
    ///
    /// # Errors
    /// If more than [`MAX_FIELDS`] follow a normal or tangents.
    pub fn try_new(steps: Vec<Step>) -> Result<Self, ChainError> {
        let fields = steps.iter().filter(|step| step.takes_derivatives()).count();
        if fields > MAX_FIELDS { Err(ChainError::Fields { fields }) } else { Ok(Self { steps, fields }) }
    }

    /// The deformations.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }
}

/// A map from a patch's unit square to space: the patch, then a chain of deformations.
#[derive(Clone, Debug)]
pub(super) struct Formula {
    pub(super) base: BezierPatch,
    /// From its unit square to the undeformed object, of a surface to its (u, v).
    pub(super) chart: Chart,
    pub(super) chain: Arc<Chain>,
    /// How many of the chain's steps are in the patch already.
    pub(super) done: usize,
}

impl Formula {
    /// The point at (s, t) after some of the steps, with derivatives by both as far as steps along fields leave them.
    fn at<T: Number, const N: usize>(
        &self,
        [s, t]: [T; 2],
        steps: usize,
        choose: &mut dyn SelectBranch<T>,
    ) -> Point<T, N> {
        let (s, t) = (Jet::linear(s, [1.0, 0.0]), Jet::linear(t, [0.0, 1.0]));
        let mut point = on_patch(&self.base, &[s, t]);
        let [origin, by_s, by_t] = self.chart.coordinates();
        let uv = [0, 1].map(|axis| s.scale(by_s[axis]).add(&t.scale(by_t[axis])).plus(origin[axis]));
        for step in &self.chain.steps[self.done..steps.max(self.done)] {
            point = step.apply(point, &uv, choose);
        }
        point
    }

    /// Point and partial derivatives.
    pub(super) fn eval(&self, st: DVec2, choose: &mut dyn SelectBranch<f64>) -> PatchPoint {
        let (st, steps) = (st.to_array(), self.steps());
        match self.chain.fields {
            0 => patch_point(&self.at::<_, 3>(st, steps, choose)),
            1 => patch_point(&self.at::<_, 6>(st, steps, choose)),
            2 => patch_point(&self.at::<_, 10>(st, steps, choose)),
            _ => patch_point(&self.at::<_, 15>(st, steps, choose)),
        }
    }

    /// Whether a place is in a piece, borders included.
    pub(super) fn is_in(&self, st: DVec2, piece: &Piece) -> bool {
        let mut margins = piece.margins([0.0; 2]);
        self.eval(st, &mut margins);
        margins.inside
    }

    /// Asks for all pieces; derivatives of places are missing what fields take, those of parameters are not.
    pub(super) fn ask(&self, st: DVec2, choose: &mut dyn SelectBranch<f64>) {
        self.at::<_, 3>(st.to_array(), self.steps(), choose);
    }

    /// The point.
    pub(super) fn position(&self, st: DVec2, choose: &mut dyn SelectBranch<f64>) -> DVec3 {
        DVec3::from_array(self.range(st.to_array(), choose))
    }

    /// The point after some of the steps.
    pub(super) fn position_after(&self, st: DVec2, steps: usize) -> DVec3 {
        DVec3::from_array(self.values(st.to_array(), steps, &mut ByValue))
    }

    /// The number or set of each coordinate.
    pub(super) fn range<T: Number>(&self, st: [T; 2], choose: &mut dyn SelectBranch<T>) -> [T; 3] {
        self.values(st, self.steps(), choose)
    }

    fn values<T: Number>(&self, st: [T; 2], steps: usize, choose: &mut dyn SelectBranch<T>) -> [T; 3] {
        match self.chain.fields {
            0 => self.at::<_, 1>(st, steps, choose).map(|x| x.value()),
            1 => self.at::<_, 3>(st, steps, choose).map(|x| x.value()),
            2 => self.at::<_, 6>(st, steps, choose).map(|x| x.value()),
            _ => self.at::<_, 10>(st, steps, choose).map(|x| x.value()),
        }
    }

    /// Estimate of the rounding of a point whose coordinates are no greater than `magnitude`.
    pub(super) fn rounding(&self, magnitude: f64) -> f64 {
        let growth: f64 = self.chain.steps[self.done..].iter().map(|step| step.largest_term(magnitude)).sum();
        ROUNDINGS * f64::EPSILON * growth
    }

    /// Partial derivatives before a step.
    pub(super) fn partials(&self, st: DVec2, step: usize) -> [DVec3; 2] {
        let point = patch_point(&self.at::<_, 15>(st.to_array(), step, &mut ByValue));
        [point.dp_ds, point.dp_dt]
    }

    /// The knot boxes that a point is in, by step; `None` outside a volume.
    pub(super) fn knot_boxes(
        &self,
        choose: &mut dyn SelectBranch<f64>,
        st: DVec2,
    ) -> Vec<(usize, Option<KnotBox>)> {
        let mut recorded = Recorded { choose, knot_boxes: Vec::new() };
        self.position(st, &mut recorded);
        let steps = (self.done..).zip(&self.chain.steps[self.done..]);
        let volumes = steps.filter(|(_, step)| matches!(step, Step::Volume(_))).map(|(step, _)| step);
        volumes.zip(recorded.knot_boxes).collect()
    }

    /// Where (s, t) is on the undeformed object: of a surface its (u, v).
    pub(super) fn place(&self, st: DVec2) -> DVec2 {
        self.chart.place(st).coordinates().truncate()
    }

    /// How many steps there are.
    pub(super) fn steps(&self) -> usize {
        self.chain.steps.len()
    }
}

fn patch_point<const N: usize>(point: &Point<f64, N>) -> PatchPoint {
    let [position, dp_ds, dp_dt] =
        [0, 1, 2].map(|k| DVec3::from_array(point.each_ref().map(|x| x.coefficients[k])));
    PatchPoint { position, dp_ds, dp_dt }
}
