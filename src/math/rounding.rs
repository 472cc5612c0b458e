//! Bounds on the rounding of chains of floating-point operations.

/// Half the distance from 1 to the next `f64`: the relative error of one correctly rounded operation.
pub(crate) const UNIT_ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// Bound on the relative error of `operations` rounded operations in a row: n u / (1 - n u).
///
/// Source: Higham, *Accuracy and Stability of Numerical Algorithms*, 2nd edition (2002), lemma 3.1.
pub(crate) const fn gamma(operations: u32) -> f64 {
    let bound = operations as f64 * UNIT_ROUNDOFF;
    bound / (1.0 - bound)
}
