//! Rounding to single precision.

/// The single-precision number nearest to `x`.
#[expect(clippy::cast_possible_truncation, reason = "rounding to single precision is the purpose")]
pub(crate) fn nearest(x: f64) -> f32 {
    x as f32
}

/// The least single-precision number not below `x`.
pub(crate) fn up(x: f64) -> f32 {
    let nearest = nearest(x);
    if f64::from(nearest) < x { nearest.next_up() } else { nearest }
}

/// The greatest single-precision number not above `x`.
pub(crate) fn down(x: f64) -> f32 {
    -up(-x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_outward() {
        for x in [0.1, -0.1, 1e-50, -1e-50, 16_777_217.0, 0.0, 1.0] {
            assert!(f64::from(down(x)) <= x && f64::from(up(x)) >= x, "{x}");
        }
    }
}
