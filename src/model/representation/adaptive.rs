//! Flat triangles with corners on the deformed shape, halved until they are close enough to it.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::{Construction, Elements, exact};
use crate::model::deformation::PlacedShape;
use crate::model::error::ModelError;
use crate::tessellate::facets_within;

/// Triangles in place of the exact patches, nowhere farther from them than `tolerance`.
pub(super) fn construct(shape: &PlacedShape<'_>, tolerance: f64) -> Result<Construction, ModelError> {
    let mut made = exact::construct(shape)?;
    let Elements::Faces(shell) = &made.elements else { return Ok(made) };
    let started = Instant::now();
    let facets = facets_within(shell, tolerance, &AtomicBool::new(false), shape.settings.memory)
        .map_err(|source| ModelError::Tessellate { tolerance, source })?;
    made.times.compose += started.elapsed();
    made.subpolygons = facets.len();
    made.elements = Elements::Facets(facets);
    Ok(made)
}
