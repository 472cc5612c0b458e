//! Patches in one knot box of a volume of low degree, composed with it instead of being covered.

use crate::patch::BezierPatch;
use crate::spline::{KnotBox, SplineVolume};

use super::interpolate::{Interpolant, interpolate};

/// A patch in one knot box is composed with the lattice's piece if the degrees are no higher.
const MAX_COMPOSED_DEGREE: usize = 9;

/// A patch in one knot box, composed with the volume's piece, if the degrees are modest: its degrees times the sum of the
/// volume's.
pub(super) fn composed(patch: &BezierPatch, volume: &SplineVolume) -> Option<(BezierPatch, KnotBox)> {
    let total: usize = volume.degree().iter().sum();
    let degree = patch.degree().map(|degree| degree * total);
    if degree.iter().any(|&degree| degree > MAX_COMPOSED_DEGREE) {
        return None;
    }
    let [low, high] = patch.hull_bounds();
    let knot_box = volume.knot_box(low)?;
    for axis in 0..3 {
        let ends = &volume.axes()[axis].breakpoints()[knot_box[axis]..];
        if !(low[axis] >= ends[0] && high[axis] <= ends[1]) {
            return None;
        }
    }
    let rational = patch.is_rational() || volume.is_rational();
    let power = i32::try_from(total).ok()?;
    let Interpolant { mut control_points, .. } = interpolate(degree, |st| {
        let (point, weight) = patch.homogeneous(st);
        volume.homogeneous_in_knot_box(knot_box, point) * weight.powi(power)
    });
    if !rational {
        control_points.iter_mut().for_each(|point| point.w = 1.0);
    }
    let made = BezierPatch::new(degree, control_points);
    (made.has_positive_weights() && made.is_finite()).then_some((made, knot_box))
}
