//! The deformed shape itself, as trimmed Bézier patches and cells of formulas.

use super::{Construction, Elements};
use crate::model::deformation::{Faces, PlacedShape};
use crate::model::error::ModelError;

/// All deformations, exactly.
pub(super) fn construct(shape: &PlacedShape<'_>) -> Result<Construction, ModelError> {
    let (steps, mut lattices) = shape.steps()?;
    let made = shape.after(&steps, true)?;
    made.record_knot_boxes(&mut lattices);
    let Faces { shell, subpolygons, times, .. } = made;
    let elements = Elements::Faces(shell);
    Ok(Construction { elements, subpolygons, steps, lattices, triangular: None, times })
}
