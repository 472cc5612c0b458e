//! Distances in units in the last place.

use super::pairing::Value;
use crate::film::SampleKind;

/// How many numbers of the file's sample type lie from one value to the other; 0 for equal ones, also for 0 and -0.
///
/// Both must be finite. Whole numbers and the steps of 8 and 16 bits are counted as such.
pub(super) fn ulp_distance(kind: SampleKind, a: Value, b: Value) -> u64 {
    match (kind, a, b) {
        (SampleKind::Half, Value::Real(a), Value::Real(b)) => half_order(a).abs_diff(half_order(b)),
        (SampleKind::Byte, ..) => steps(255.0, a, b),
        (SampleKind::Short, ..) => steps(65535.0, a, b),
        (_, Value::Whole(a), Value::Whole(b)) => u64::from(a.abs_diff(b)),
        _ => {
            #[expect(clippy::cast_possible_truncation, reason = "of a whole number the nearest single")]
            let [a, b] = [a, b].map(|value| value.number() as f32);
            float_order(a).abs_diff(float_order(b))
        }
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "both values are in [0, 1]")]
fn steps(levels: f64, a: Value, b: Value) -> u64 {
    (levels * (a.number() - b.number()).abs()).round() as u64
}

/// The value's place among all singles: neighbours differ by 1, and 0 and -0 are both 0.
fn float_order(value: f32) -> i64 {
    let magnitude = i64::from(value.abs().to_bits());
    if value.is_sign_negative() { -magnitude } else { magnitude }
}

/// As [`float_order`], among halves; the value must be one.
fn half_order(value: f32) -> i64 {
    /// The least half that is not subnormal, and the unit in the last place below it.
    const NORMAL: f32 = 6.103_515_625e-5;
    const SUBNORMAL_UNIT: f32 = 5.960_464_477_539_063e-8;
    let magnitude = value.abs();
    let order = if magnitude < NORMAL {
        #[expect(clippy::cast_possible_truncation, reason = "less than 1024")]
        let units = (magnitude / SUBNORMAL_UNIT) as i64;
        units
    } else {
        // 13 bits of the fraction are more than a half has, and its exponent's bias is 15 instead of 127
        i64::from(magnitude.to_bits() >> 13) - ((127 - 15) << 10)
    };
    if value.is_sign_negative() { -order } else { order }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn between(kind: SampleKind, a: f32, b: f32) -> u64 {
        ulp_distance(kind, Value::Real(a), Value::Real(b))
    }

    #[test]
    fn singles_are_counted() {
        let kind = SampleKind::Float;
        assert_eq!(between(kind, 1.0, 1.0 + f32::EPSILON), 1);
        assert_eq!(between(kind, 1.0, 2.0), 1 << 23);
        assert_eq!(between(kind, 0.0, -0.0), 0);
        let least = f32::from_bits(1);
        assert_eq!(between(kind, -least, least), 2);
    }

    #[test]
    fn halves_are_counted() {
        let kind = SampleKind::Half;
        assert_eq!(between(kind, 1.0, 1.0 + 1.0 / 1024.0), 1);
        assert_eq!(between(kind, 1.0, 2.0), 1024);
        // 65504 is the largest, 0x7bff; 2^-14 is 0x0400, 2^-24 is 0x0001
        assert_eq!(between(kind, 0.0, 65504.0), 0x7bff);
        assert_eq!(between(kind, 0.0, 2.0_f32.powi(-14)), 0x400);
        assert_eq!(between(kind, -(2.0_f32.powi(-24)), 2.0_f32.powi(-24)), 2);
        assert_eq!(between(kind, 2.0_f32.powi(-14), 2.0_f32.powi(-14) - 2.0_f32.powi(-24)), 1);
    }

    #[test]
    fn steps_and_whole_numbers_are_counted() {
        assert_eq!(between(SampleKind::Byte, 10.0 / 255.0, 13.0 / 255.0), 3);
        assert_eq!(between(SampleKind::Short, 10.0 / 65535.0, 9.0 / 65535.0), 1);
        let ids = ulp_distance(SampleKind::Uint, Value::Whole(u32::MAX), Value::Whole(u32::MAX - 1));
        assert_eq!(ids, 1, "single precision would not tell them apart");
    }
}
