//! Angles in degrees.

/// Sine and cosine of an angle in degrees: exact at multiples of 90, the same on every machine.
pub(crate) fn sin_cos_deg(angle: f64) -> (f64, f64) {
    let quarters = (angle / 90.0).round();
    let rest = (angle - 90.0 * quarters).to_radians();
    let (sin, cos) = libm::sincos(rest);
    match quarters.rem_euclid(4.0) {
        1.0 => (cos, -sin),
        2.0 => (-sin, -cos),
        3.0 => (-cos, sin),
        _ => (sin, cos),
    }
}
