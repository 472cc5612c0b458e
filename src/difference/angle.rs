//! Angles between the directions of two layers.

use serde::Serialize;

use super::pairing::{ChannelPair, PartPair};
use super::pixels::FAIL;

/// Angles in degrees. Where a direction has no length or is not finite in one picture alone the angle is 180; in both alike there is
/// none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Angles {
    /// The greatest.
    pub max: f64,
    /// Its column.
    pub x: i32,
    /// Its row.
    pub y: i32,
    /// The mean over the pixels that have one.
    pub mean: f64,
}

/// Measures three channels X, Y, Z, and flags pixels whose angle is above the limit.
///
/// The angle of unit vectors a and b is 2 atan2(|a - b|, |a + b|), which is exact for small ones too (Kahan).
pub(super) fn angles(
    part: &PartPair<'_>,
    channels: [ChannelPair<'_>; 3],
    limit: f32,
    flags: &mut [u8],
) -> Angles {
    let mut vectors = vec![[[0.0_f64; 3]; 2]; part.area.pixels()];
    for (axis, channel) in channels.into_iter().enumerate() {
        part.each(channel, |index, a, b| {
            (vectors[index][0][axis], vectors[index][1][axis]) = (a.number(), b.number());
        });
    }
    let mut found = Angles::default();
    let (mut sum, mut count) = (0.0, 0_usize);
    for (index, [a, b]) in vectors.into_iter().enumerate() {
        let degrees = match (unit(a), unit(b)) {
            (Some(a), Some(b)) => angle(a, b).to_degrees(),
            (None, None) => continue,
            _ => 180.0,
        };
        sum += degrees;
        count += 1;
        if degrees > found.max {
            let [x, y] = part.area.place(index);
            found = Angles { max: degrees, x, y, ..found };
        }
        if degrees > f64::from(limit) {
            flags[index] |= FAIL;
        }
    }
    Angles { mean: sum / count.max(1) as f64, ..found }
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let length = length(v);
    (length > 0.0 && length.is_finite()).then(|| v.map(|x| x / length))
}

fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let difference = [0, 1, 2].map(|i| a[i] - b[i]);
    let sum = [0, 1, 2].map(|i| a[i] + b[i]);
    2.0 * libm::atan2(length(difference), length(sum))
}

#[cfg(test)]
mod tests {
    use super::super::pairing::pair;
    use super::*;
    use crate::difference::testing::{picture, values};

    #[test]
    fn angles_are_measured() {
        let names = [("normal.X", 0.0), ("normal.Y", 0.0), ("normal.Z", 2.0)];
        let (mut a, mut b) = (picture([5, 1], &names), picture([5, 1], &names));
        let tilt = 0.25_f32.to_radians();
        values(&mut b, "normal.X")[1] = tilt.sin();
        values(&mut b, "normal.Z")[1] = tilt.cos();
        values(&mut b, "normal.Z")[2] = -1.0;
        values(&mut b, "normal.Z")[3] = 0.0;
        for picture in [&mut a, &mut b] {
            values(picture, "normal.Z")[4] = 0.0;
        }
        let (pairs, _) = pair(&a, &b, false).unwrap();
        let channels = [0, 1, 2].map(|axis| pairs[0].layers[0].channels[axis]);
        let mut flags = vec![0; 5];
        let found = angles(&pairs[0], channels, 0.2, &mut flags);
        assert_eq!((found.max, found.x, found.y), (180.0, 2, 0));
        assert!((found.mean - (0.25 + 180.0 + 180.0) / 4.0).abs() < 1e-6, "{}", found.mean);
        assert_eq!(flags, [0, FAIL, FAIL, FAIL, 0]);
    }
}
