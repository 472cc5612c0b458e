//! One face: a surface over the unit square, and the region of it that belongs to the object.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::spline::KnotBox;

use super::bezier_patch::{BezierPatch, PatchPoint};
use super::chart::Chart;
use super::exact::{ExactSurface, Overlap};
use super::region::{LoopCorner, Region, RegionBuilder, UNIT_SQUARE};

/// A surface over the unit square, with the region of it that belongs to the object.
///
/// Which of its edges are those of other faces is the [`Shell`](super::Shell)'s to say.
#[derive(Clone, Debug)]
pub struct Face {
    /// See [`Self::knot_box`].
    pub(super) knot_box: Option<[u32; 3]>,
    /// From the unit square to the undeformed object.
    pub chart: Chart,
    /// The surface.
    pub patch: BezierPatch,
    /// The part of the unit square that belongs to the object.
    pub region: Region,
    /// Bound on the distance between the trim's corners on the patch and the true deformed corners: vertices are
    /// moved onto knot planes and into shared planes by rounding-sized steps.
    pub boundary_error: f64,
    /// The surface itself, if it is no Bézier patch.
    pub exact: Option<Arc<dyn ExactSurface>>,
}

impl PartialEq for Face {
    fn eq(&self, other: &Self) -> bool {
        let exact = |patch: &Self| patch.exact.as_ref().map(Arc::as_ptr).map(|exact| exact.cast::<()>());
        self.knot_box == other.knot_box
            && self.chart == other.chart
            && self.patch == other.patch
            && self.region == other.region
            && self.boundary_error == other.boundary_error
            && exact(self) == exact(other)
    }
}

impl Face {
    /// A patch that is surface all over: one loop, of polygon and face 0, around the unit square.
    pub fn untrimmed(chart: Chart, patch: BezierPatch) -> Self {
        let mut region = RegionBuilder::default();
        region.push(0, 0, UNIT_SQUARE.map(|st| LoopCorner { st, vertex: 0 }));
        Self::undeformed(chart, patch, region.finish().0)
    }

    /// A patch of no knot box.
    pub(super) const fn undeformed(chart: Chart, patch: BezierPatch, region: Region) -> Self {
        Self { knot_box: None, chart, patch, region, boundary_error: 0.0, exact: None }
    }

    /// A part of this one's place in the knot box and the object, with a surface of its own.
    pub(crate) fn replaced(
        &self,
        chart: Chart,
        patch: BezierPatch,
        region: Region,
        (boundary_error, exact): (f64, Option<Arc<dyn ExactSurface>>),
    ) -> Self {
        Self { knot_box: self.knot_box, chart, patch, region, boundary_error, exact }
    }

    /// Point and partial derivatives of the surface.
    pub fn eval(&self, st: DVec2) -> PatchPoint {
        self.exact.as_ref().map_or_else(|| self.patch.eval(st), |exact| exact.eval(st))
    }

    /// The same, beyond borders that are curves, of the surface there: see [`ExactSurface::eval_whole`].
    pub fn eval_whole(&self, st: DVec2) -> PatchPoint {
        self.exact.as_ref().map_or_else(|| self.patch.eval(st), |exact| exact.eval_whole(st))
    }

    /// Whether no patch before it has the same surface beyond borders that are curves.
    pub fn leads(&self) -> bool {
        self.exact.as_ref().is_none_or(|exact| exact.leads())
    }

    /// Bound on how far the patch is from the surface, trim included, less the rounding of evaluations.
    pub fn error(&self) -> f64 {
        self.boundary_error + self.exact.as_ref().map_or(0.0, |exact| exact.error())
    }

    /// Whether a place that may be off by `tolerance` is inside borders that are curves.
    pub(crate) fn holds(&self, st: DVec2, tolerance: DVec2) -> bool {
        self.exact.as_ref().is_none_or(|exact| exact.holds(st, tolerance))
    }

    /// See [`ExactSurface::sides`].
    pub(crate) fn sides(&self, st: DVec2, tolerance: DVec2) -> [bool; 2] {
        self.exact.as_ref().map_or([true; 2], |exact| exact.sides(st, tolerance))
    }

    /// What of a rectangle of parameters is inside borders that are curves.
    pub(crate) fn overlap(&self, low: DVec2, high: DVec2) -> Overlap {
        self.exact.as_ref().map_or(Overlap::Whole, |exact| exact.overlap(low, high))
    }

    /// The knot box it is the image of; `None` outside the lattice, where the surface is undeformed.
    pub fn knot_box(&self) -> Option<KnotBox> {
        self.knot_box.map(|knot_box| knot_box.map(|interval| interval as usize))
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        let exact = self.exact.as_ref().map_or(0, |exact| exact.bytes());
        size_of::<Self>() + self.patch.bytes() + self.region.bytes() + exact
    }

    /// Lowest and highest corner of a box that holds the whole patch, whatever the trim leaves of it.
    pub(crate) fn hull_bounds(&self) -> [DVec3; 2] {
        let [low, high] = self.patch.hull_bounds();
        [low - self.error(), high + self.error()]
    }

    /// Lowest and highest corner of a box that holds the trimmed surface: the control points of those parts of a
    /// 4 × 4 grid that the trim reaches.
    pub fn trimmed_bounds(&self) -> [DVec3; 2] {
        const GRID: u32 = 4;
        let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for i in 0..GRID {
            for j in 0..GRID {
                let low = DVec2::new(f64::from(i), f64::from(j)) / f64::from(GRID);
                let high = DVec2::new(f64::from(i + 1), f64::from(j + 1)) / f64::from(GRID);
                if self.region.reaches(low, high) {
                    let [a, b] = self.patch.subpatch(low, high).hull_bounds();
                    bounds = [bounds[0].min(a - self.error()), bounds[1].max(b + self.error())];
                }
            }
        }
        bounds
    }
}
