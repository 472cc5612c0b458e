//! What rendering counts.

use std::ops::AddAssign;

use crate::trace::TraceStatistics;

/// Counts of a render, summed over all threads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct RenderStatistics {
    /// Rays traced for their nearest hit: from the camera and from surfaces.
    pub rays: u64,
    /// Rays traced to find whether a light is hidden.
    pub shadow_rays: u64,
    /// Samples taken.
    pub samples: u64,
    /// Samples that were infinite or not a number (as 32-bit floats); they count as black.
    pub non_finite_samples: u64,
    /// What the rays met in the geometry.
    pub trace: TraceStatistics,
}

impl AddAssign for RenderStatistics {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.shadow_rays += other.shadow_rays;
        self.samples += other.samples;
        self.non_finite_samples += other.non_finite_samples;
        self.trace += other.trace;
    }
}
