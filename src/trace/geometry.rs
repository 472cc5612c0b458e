//! What the renderer asks of anything that rays can be traced against.

use super::interaction::SurfaceInteraction;
use super::ray::Ray;
use super::statistics::TraceStatistics;

/// Anything rays can be traced against, by any number of threads.
pub trait Geometry: Sync {
    /// What one thread traces rays with.
    type Tracer<'a>: RayTracer
    where
        Self: 'a;

    /// A tracer for one thread, whose counts start at zero.
    fn tracer(&self) -> Self::Tracer<'_>;
}

/// One thread's way to trace rays: it keeps buffers from ray to ray, and counts.
pub trait RayTracer {
    /// The hit nearest to the ray's origin, if any.
    fn closest_hit(&mut self, ray: &Ray) -> Option<SurfaceInteraction>;

    /// Whether anything is hit at all; stops at the first proof.
    fn any_hit(&mut self, ray: &Ray) -> bool;

    /// As [`Self::closest_hit`] for each ray, in place of what `hits` held; rays that are alike are faster side by side.
    fn closest_hits(&mut self, rays: &[Ray], hits: &mut Vec<Option<SurfaceInteraction>>) {
        hits.clear();
        hits.extend(rays.iter().map(|ray| self.closest_hit(ray)));
    }

    /// As [`Self::any_hit`] for each ray, in place of what `hit` held.
    fn any_hits(&mut self, rays: &[Ray], hit: &mut Vec<bool>) {
        hit.clear();
        hit.extend(rays.iter().map(|ray| self.any_hit(ray)));
    }

    /// The counts since the tracer was made or this was last called; zeros where nothing is counted.
    fn take_statistics(&mut self) -> TraceStatistics {
        TraceStatistics::default()
    }
}
