//! Newton's method on a projected net.

use glam::{DMat2, DVec2};

use super::projection::{ProjectedNet, ProjectedPoint};

/// Most Newton steps. From a point where the Jacobian varies by less than half, each step at least halves the error
/// and soon squares it: 10 reach rounding from anywhere in the unit square, the rest is room.
const MAX_STEPS: usize = 16;

/// How far outside its box, in parts of the box and of its zero's rounding, a step may lead before the search is given
/// back to clipping.
const REACH: f64 = 2.0;

/// What Newton's method did.
#[derive(Clone, Copy, Debug)]
pub(crate) enum NewtonOutcome {
    /// Converged to a zero, up to rounding.
    Root {
        st: DVec2,
        /// Inverse of the Jacobian there.
        inverse: DMat2,
    },
    /// Left the neighbourhood of the box, met a singular Jacobian, or took too many steps.
    NotConverged,
}

/// Newton's method from `start`, within a neighbourhood of the box `[low, high]`.
///
/// `slack` is how far rounding may move the box's zero: near a tangent ray that is more than the whole box.
///
/// Ends when a step no longer lessens the residual that is already within the net's rounding, so that the root is as
/// good as the net's evaluation allows.
pub(crate) fn newton(
    net: &ProjectedNet,
    start: DVec2,
    [low, high]: [DVec2; 2],
    slack: DVec2,
    steps: &mut u64,
) -> NewtonOutcome {
    let reach = REACH * (high - low + slack);
    let (from, to) = (low - reach, high + reach);
    let mut st = start;
    let mut best: Option<(f64, DVec2, DMat2)> = None;
    for _ in 0..MAX_STEPS {
        *steps += 1;
        let point = net.eval(st);
        let Some(inverse) = inverse(&point) else { return NewtonOutcome::NotConverged };
        let residual = point.value.abs().max_element();
        let improved = best.is_none_or(|(least, ..)| residual < least);
        if improved {
            best = Some((residual, st, inverse));
        }
        if let Some((least, st, inverse)) = best
            && least <= net.rounding
            && (!improved || least == 0.0)
        {
            return NewtonOutcome::Root { st, inverse };
        }
        st -= inverse * point.value;
        // written so that NaN fails
        if !(st.cmpge(from).all() && st.cmple(to).all()) {
            return NewtonOutcome::NotConverged;
        }
    }
    match best {
        Some((residual, st, inverse)) if residual <= net.rounding => NewtonOutcome::Root { st, inverse },
        _ => NewtonOutcome::NotConverged,
    }
}

/// Inverse of the Jacobian; `None` if it is singular or not finite.
pub(crate) fn inverse(point: &ProjectedPoint) -> Option<DMat2> {
    let determinant = point.by_s.perp_dot(point.by_t);
    let inverse = DMat2::from_cols(
        DVec2::new(point.by_t.y, -point.by_s.y) / determinant,
        DVec2::new(-point.by_t.x, point.by_s.x) / determinant,
    );
    inverse.is_finite().then_some(inverse)
}
