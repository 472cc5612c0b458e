//! Cofactors.

use glam::DMat3;

/// The matrix of cofactors of a linear map: it takes normals of surfaces to normals of their images, and is the inverse
/// transpose times the determinant, but for a determinant of 0 too.
pub(crate) fn cofactor(map: DMat3) -> DMat3 {
    DMat3::from_cols(map.y_axis.cross(map.z_axis), map.z_axis.cross(map.x_axis), map.x_axis.cross(map.y_axis))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn normals_stay_normal() {
        let map = DMat3::from_cols(
            DVec3::new(1.0, 0.2, 0.0),
            DVec3::new(-0.3, 2.0, 0.5),
            DVec3::new(0.1, 0.0, -0.7),
        );
        let (a, b) = (DVec3::new(0.3, 0.7, -0.2), DVec3::new(-0.6, 0.1, 0.9));
        let want = (map * a).cross(map * b);
        assert!((cofactor(map) * a.cross(b) - want).length() < 1e-15);
    }
}
