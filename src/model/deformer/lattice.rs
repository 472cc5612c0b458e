//! Deformation by a control lattice: what is given, its edits, and the volume that they make.
//!
//! Source: Sederberg, Parry (1986), *Free-form deformation of solid geometric models*; its B-spline form as in Feng, Nishita,
//! Jin, Peng (2002).

use std::collections::BTreeSet;

use glam::DVec3;

use super::edit::{DragReport, Edit, EditError, Seen, check_points};
use crate::choice::Choice;
use crate::math::magnitude;
use crate::model::error::{ModelError, PartsOutside};
use crate::spline::{ControlLattice, KnotBox, KnotLayout, SplineVolume, VolumeError};
use crate::subdivide::FrameChoice;

/// A flat axis of an object's box is widened by this part of the box's longest side to both sides, so that the lattice
/// has room to bend.
const FLAT_AXIS_PADDING: f64 = 0.25;

/// A free-form deformation by a B-spline volume over a box.
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    /// Degree along each axis, in `1..=8`.
    pub degree: [usize; 3],
    /// Control points along each axis, more than the degree.
    pub points: [usize; 3],
    /// Least and greatest corner of the lattice's box, with extent along every axis; if none, the bounding box of the object
    /// as the lattice receives it.
    pub bounds: Option<[DVec3; 2]>,
    /// How the knots lie over the box.
    pub knots: KnotLayout,
    /// What happens to parts of the object outside the box.
    pub outside: Outside,
    /// Outermost layers of control points that stay.
    pub hold: usize,
    /// The frames of the patches.
    pub frame: FrameChoice,
    /// Edits of the lattice, in the order they apply.
    pub edits: Vec<Edit>,
}

/// What happens to parts of an object outside the lattice's box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Outside {
    /// They stay as they are.
    #[default]
    Keep,
    /// They are an error.
    Error,
}

impl Choice for FrameChoice {
    const WHAT: &'static str = "frame";
    const ALL: &'static [Self] = &[Self::Parallelogram, Self::Rectangle];

    fn name(self) -> &'static str {
        match self {
            Self::Parallelogram => "parallelogram",
            Self::Rectangle => "rectangle",
        }
    }
}

impl Choice for Outside {
    const WHAT: &'static str = "outside";
    const ALL: &'static [Self] = &[Self::Keep, Self::Error];

    fn name(self) -> &'static str {
        match self {
            Self::Keep => "keep",
            Self::Error => "error",
        }
    }
}

/// A lattice of an object after all edits.
#[derive(Clone, Debug)]
pub struct BuiltLattice {
    /// Number of the deformer among the object's, from 1.
    pub deformer: usize,
    /// The volume.
    pub volume: SplineVolume,
    /// Its lattice.
    pub lattice: ControlLattice,
    /// What drags did to it.
    pub drags: Vec<DragReport>,
    /// The knot boxes that hold a part of the object.
    pub knot_boxes: BTreeSet<KnotBox>,
}

impl BuiltLattice {
    /// The one place, to rounding, of all control points that act on a box's part inside the lattice; none if there are
    /// several.
    pub(in crate::model) fn collapsed(&self, [low, high]: [DVec3; 2]) -> Option<DVec3> {
        // some units in the last place of the sums of a basis
        const ROUNDING: f64 = 16.0 * f64::EPSILON;
        let lattice = &self.lattice;
        let [least, greatest] = lattice.bounds();
        let acting = |corner: DVec3| -> Option<Vec<[usize; 3]>> {
            let basis = lattice.basis(corner.clamp(least, greatest))?;
            Some(basis.into_iter().map(|(flat, _)| lattice.index_of(flat)).collect())
        };
        // the basis counts up along each axis
        let (first, last) = (*acting(low)?.first()?, *acting(high)?.last()?);
        let acts = |flat: &usize| {
            let index = lattice.index_of(*flat);
            (0..3).all(|axis| (first[axis]..=last[axis]).contains(&index[axis]))
        };
        let places =
            || (0..lattice.points().len()).filter(acts).map(|flat| lattice.points()[flat].truncate());
        let place = places().next()?;
        let size = places().fold(0.0, |size: f64, place| size.max(place.abs().max_element()));
        places().all(|other| (other - place).abs().max_element() <= ROUNDING * size).then_some(place)
    }
}

impl Lattice {
    /// A lattice around the object, without edits.
    #[must_use]
    pub fn new(degree: [usize; 3], points: [usize; 3]) -> Self {
        Self {
            degree,
            points,
            bounds: None,
            knots: KnotLayout::default(),
            outside: Outside::default(),
            hold: 0,
            frame: FrameChoice::default(),
            edits: Vec::new(),
        }
    }

    /// The volume after all edits, over `object_bounds` if the lattice has no box of its own. The deformer is of this index;
    /// no knot boxes are known yet.
    pub(in crate::model) fn built(
        &self,
        deformer: usize,
        object_bounds: [DVec3; 2],
        seen: Seen<'_>,
    ) -> Result<BuiltLattice, ModelError> {
        let bounds = self.bounds.unwrap_or_else(|| padded(object_bounds));
        magnitude::check(bounds)
            .map_err(|source| ModelError::Magnitude { deformer: Some(deformer), source })?;
        let fault = |source: VolumeError| ModelError::Lattice { deformer, source };
        let axes = self.knots.axes(self.degree, self.points, bounds).map_err(fault)?;
        let mut lattice = ControlLattice::identity_of(axes, self.hold);
        let mut drags = Vec::new();
        for (number, edit) in self.edits.iter().enumerate() {
            let fault = |source: EditError| ModelError::Edit { deformer, edit: number, source };
            let report = edit.apply(&mut lattice, seen).map_err(fault)?;
            check_points(&lattice).map_err(fault)?;
            drags.extend(report.map(|report| DragReport { edit: number + 1, ..report }));
        }
        let volume = lattice.volume().map_err(fault)?;
        Ok(BuiltLattice { deformer: deformer + 1, volume, lattice, drags, knot_boxes: BTreeSet::new() })
    }

    /// Refuses parts of the object outside the box, if they are an error.
    pub(in crate::model) fn check_outside(
        &self,
        deformer: usize,
        parts: impl FnOnce() -> Option<PartsOutside>,
    ) -> Result<(), ModelError> {
        match self.outside {
            Outside::Keep => Ok(()),
            Outside::Error => parts().map_or(Ok(()), |parts| Err(ModelError::Outside { deformer, parts })),
        }
    }
}

/// The box with flat axes widened.
fn padded([low, high]: [DVec3; 2]) -> [DVec3; 2] {
    let size = high - low;
    let padding = DVec3::splat(FLAT_AXIS_PADDING * size.max_element());
    let padding = DVec3::select(size.cmple(DVec3::ZERO), padding, DVec3::ZERO);
    [low - padding, high + padding]
}
