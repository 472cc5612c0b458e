//! Beside the pipeline: how far flat triangles are from the exact surface that they stand for, with a proof.
//!
//! The Hausdorff distance: the greatest distance of a point of either from the nearest of the other. Both are cut into
//! sections, triangles of a patch's parameters under one flat triangle. The second partials bound how far the surface of a
//! section is from the triangle of its corners, so a few evaluations bound the distances of a whole section; sections that
//! could still have a distance above the greatest one found are halved. Where the surface has borders that are curves, all
//! sheets that meet there are searched, and what lies beyond its own border is left out as soon as it is known to be
//! beyond. (Guthe, Borodin and Klein 2005, *Fast and accurate Hausdorff distance calculation between meshes*, is the same
//! for meshes.)

mod flat;
mod order;
mod search;
mod surface;
#[cfg(test)]
mod tests;
mod triangle;

use std::sync::atomic::AtomicBool;

use serde::Serialize;
use thiserror::Error;

use crate::patch::Face;
use flat::FlatMesh;
use search::Search;
use surface::Surface;

/// How much greater than the greatest distance found another one may be.
pub const CERTAINTY: f64 = 0.01;

/// How far triangles are from a surface; lengths in world units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Deviation {
    /// The greatest distance found: some point of the one is as far from the nearest of the other.
    pub max: f64,
    /// No point of the one is farther from the other than this: at most 1 % more than `max`, or more than rounding.
    pub bound: f64,
    /// Mean distance of the surface from the plane of the triangle that stands for it, by area.
    pub mean: f64,
    /// Greatest angle between a triangle and the surface it stands for, at corners and centroids; degrees.
    pub normal_max_degrees: f64,
    /// The mean by area at centroids.
    pub normal_mean_degrees: f64,
}

/// Why there is no certified distance.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum DeviationError {
    /// It was asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// Some part of the surface has no triangle, or several.
    #[error("the triangles stand for {share:.6} of the surface, not for all of it once")]
    NotWhole {
        /// The share, by area before the deformation.
        share: f64,
    },
    /// Too many cells.
    #[error("the distance is not certain: between {found:.3e} and {bound:.3e}")]
    Uncertain {
        /// The greatest found.
        found: f64,
        /// No distance is greater.
        bound: f64,
    },
}

/// How far triangles are from exact patches, both ways. `triangles` stand for the whole surface, each a
/// [`crate::patch::Facet`] at rest in the frames of `exact`. `cancel` is set by another thread to stop.
///
/// # Errors
/// If the triangles do not stand for the whole surface once, if certainty takes too long, or on `cancel`.
pub fn deviation(
    exact: &[Face],
    triangles: &[Face],
    cancel: &AtomicBool,
) -> Result<Deviation, DeviationError> {
    let (surface, mesh) = (Surface::new(exact), FlatMesh::new(triangles));
    Search::new(&surface, &mesh, cancel).deviation()
}
