//! Surfaces that are no Bézier patches, behind patches that come as near to them as rounding.

use glam::{DVec2, DVec3};

use super::bezier_patch::PatchPoint;

/// How much of a rectangle of parameters belongs to a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overlap {
    /// All of it.
    Whole,
    /// Perhaps some of it.
    Partial,
    /// Nothing.
    None,
}

/// A surface over the unit square that a Bézier patch stands for: no point of the patch is farther than [`Self::error`] from
/// the point of the same parameters.
///
/// Besides the patch's trim it may have borders that are curves in the parameters. Then there are others over the same unit
/// square and trim, in patches that follow one another; together they are whole.
pub trait ExactSurface: Send + Sync + std::fmt::Debug {
    /// Point and partial derivatives, also a little outside the borders.
    fn eval(&self, st: DVec2) -> PatchPoint;

    /// The point alone.
    fn position(&self, st: DVec2) -> DVec3;

    /// Point and partial derivatives of the whole surface: beyond a curved border, of what is there.
    fn eval_whole(&self, st: DVec2) -> PatchPoint;

    /// Whether of all surfaces that share a unit square, with curved borders between them, this is the first.
    fn leads(&self) -> bool;

    /// The point before the last deformation.
    fn received(&self, st: DVec2) -> DVec3;

    /// Proven bound of the patch's distance, less roundings of the evaluation of both.
    fn error(&self) -> f64;

    /// Whether it has curved borders.
    fn has_borders(&self) -> bool;

    /// Whether a place that may be off by `tolerance` is inside the curved borders, and whether it is without tolerance.
    fn sides(&self, st: DVec2, tolerance: DVec2) -> [bool; 2];

    /// The first of [`Self::sides`].
    fn holds(&self, st: DVec2, tolerance: DVec2) -> bool {
        self.sides(st, tolerance)[0]
    }

    /// Whether its curved borders may be tears: if not, the surface goes on there without a gap.
    fn may_be_torn(&self) -> bool;

    /// What of the rectangle `[low, high]` is inside the curved borders.
    fn overlap(&self, low: DVec2, high: DVec2) -> Overlap;

    /// Memory in bytes.
    fn bytes(&self) -> usize;
}
