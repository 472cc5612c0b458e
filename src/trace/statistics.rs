//! Counts of what the solver met.

use std::ops::AddAssign;

use serde::Serialize;

/// Every outcome of the search for hits, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct TraceStatistics {
    /// Rays traced.
    pub rays: u64,
    /// Leaves (parts of patches) whose box a ray entered.
    pub leaf_tests: u64,
    /// Leaves for which nothing was proved, so that Bézier clipping decided.
    pub fallbacks: u64,
    /// Parameter boxes examined by Bézier clipping.
    pub boxes: u64,
    /// Steps of Newton's method.
    pub newton_steps: u64,
    /// Roots found, before trimming.
    pub roots: u64,
    /// Roots at which the ray is tangent to the patch, within rounding.
    pub degenerate: u64,
    /// Patches that a ray lies in, within rounding: no single point is hit there.
    pub in_surface: u64,
    /// Searches given up at the limit of boxes.
    pub not_converged: u64,
    /// Roots outside the trim.
    pub trimmed: u64,
    /// Hits accepted only for the tolerance of the trim: within rounding of a border.
    pub on_border: u64,
}

impl AddAssign for TraceStatistics {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.leaf_tests += other.leaf_tests;
        self.fallbacks += other.fallbacks;
        self.boxes += other.boxes;
        self.newton_steps += other.newton_steps;
        self.roots += other.roots;
        self.degenerate += other.degenerate;
        self.in_surface += other.in_surface;
        self.not_converged += other.not_converged;
        self.trimmed += other.trimmed;
        self.on_border += other.on_border;
    }
}
