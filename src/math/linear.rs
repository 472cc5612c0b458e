//! Kinds of linear maps.

use glam::{DMat3, DVec3};

/// How far the columns of a similarity may be from the same length and from right angles, in parts of
/// their length: far above the rounding of a few steps, far below what can be seen.
const ROUNDING: f64 = 1e-9;

/// The positive factor of a map that scales all directions alike, and turns or mirrors besides; none
/// of any other map.
pub(crate) fn similarity_scale(matrix: &DMat3) -> Option<f64> {
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    let scale = x.length();
    let as_long = |column: DVec3| (column.length() - scale).abs() <= ROUNDING * scale;
    let right = |a: DVec3, b: DVec3| a.dot(b).abs() <= ROUNDING * scale * scale;
    let similar = as_long(y) && as_long(z) && right(x, y) && right(y, z) && right(z, x);
    (similar && scale > 0.0 && scale.is_finite()).then_some(scale)
}

/// The unit vector along `v`, without overflow or underflow on the way; none for zero or infinite.
pub(crate) fn unit_vector(v: DVec3) -> Option<DVec3> {
    let largest = v.abs().max_element();
    (largest > 0.0 && largest.is_finite()).then(|| (v / largest).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn similarities_are_told_from_other_maps() {
        let turn = DMat3::from_rotation_x(0.3) * DMat3::from_rotation_z(2.0);
        for factor in [1.0, -1.0, 1e-100, 1e100] {
            let scale = similarity_scale(&(factor * turn)).unwrap();
            assert!((scale / factor.abs() - 1.0).abs() < 1e-14);
        }
        let mirror = DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0));
        assert_eq!(similarity_scale(&mirror), Some(1.0));
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(1e-6, 1.0, 0.0), DVec3::Z);
        for other in [shear, DMat3::from_diagonal(DVec3::new(1.0, 1.0, 1.001)), DMat3::ZERO, DMat3::NAN] {
            assert_eq!(similarity_scale(&other), None, "{other}");
        }
    }
}
