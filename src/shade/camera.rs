//! The camera.

use glam::{DMat4, DVec2, DVec3, DVec4};
use thiserror::Error;

use crate::trace::Ray;

/// The image axis that the field of view is measured along, as in Mitsuba.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum FovAxis {
    /// The image's width.
    #[default]
    X,
    /// The image's height.
    Y,
    /// The image's diagonal.
    Diagonal,
    /// The shorter of width and height.
    Smaller,
    /// The longer of width and height.
    Larger,
}

/// A perspective camera as the scene file gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraSettings {
    /// The pinhole.
    pub origin: DVec3,
    /// A point in the picture's middle.
    pub target: DVec3,
    /// A direction that is up in the picture.
    pub up: DVec3,
    /// Field of view in degrees, in `(0, 180)`.
    pub fov: f64,
    /// The axis of `fov`.
    pub fov_axis: FovAxis,
}

/// Why a camera cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum CameraError {
    /// There is no direction to look along.
    #[error("camera: origin and target must be two different, finite points")]
    NoDirection,
    /// The picture's top is not determined.
    #[error("camera: up must not be zero or parallel to the direction of view")]
    NoUp,
    /// The field of view is no angle that a plane picture can have.
    #[error("camera: fov is {0} degrees, but must lie between 0 and 180")]
    Fov(f64),
    /// The film has no pixels.
    #[error("camera: the film is {0}x{1} pixels, but must be at least 1x1")]
    EmptyFilm(u32, u32),
}

/// A pinhole camera over a film of `size` pixels, as Mitsuba's `perspective` with `look_at`.
///
/// Pixel coordinates run from (0, 0), the picture's top left corner, to `size`, its bottom right
/// one. The picture is not mirrored: from (0, -5, 0) towards 0 with +z up, +x is on the right.
/// Unlike Mitsuba's there are no clipping planes, so that `t` is the distance from the pinhole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerspectiveCamera {
    origin: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Half the picture's width and height at distance 1.
    half_extent: DVec2,
    size: DVec2,
}

impl PerspectiveCamera {
    /// The camera of the settings for a film of `size` pixels (all of it, whatever the crop).
    ///
    /// # Errors
    /// Where origin, target, up, field of view or size determine no picture.
    pub fn try_new(settings: &CameraSettings, size: [u32; 2]) -> Result<Self, CameraError> {
        let forward = (settings.target - settings.origin).try_normalize().ok_or(CameraError::NoDirection)?;
        let right = settings
            .up
            .try_normalize()
            .and_then(|up| forward.cross(up).try_normalize())
            .ok_or(CameraError::NoUp)?;
        if !(settings.fov > 0.0 && settings.fov < 180.0) {
            return Err(CameraError::Fov(settings.fov));
        }
        if size[0] == 0 || size[1] == 0 {
            return Err(CameraError::EmptyFilm(size[0], size[1]));
        }
        let size = DVec2::new(size[0].into(), size[1].into());
        Ok(Self {
            origin: settings.origin,
            right,
            up: right.cross(forward),
            forward,
            half_extent: half_extent(settings.fov, settings.fov_axis, size),
            size,
        })
    }

    /// The ray through the film at `pixel` (pixel centres are at +0.5), its direction of length 1.
    pub fn ray(&self, pixel: DVec2) -> Ray {
        // [-1, 1]² over the film, y upwards
        let x = 2.0 * pixel.x / self.size.x - 1.0;
        let y = 1.0 - 2.0 * pixel.y / self.size.y;
        let direction = self.forward + x * self.half_extent.x * self.right + y * self.half_extent.y * self.up;
        Ray::new(self.origin, direction.normalize())
    }

    /// World space to camera space: +x right, +y up, looking along -z (OpenEXR `worldToCamera`).
    ///
    /// For column vectors; OpenEXR's row vectors make its rows these columns, so that
    /// `to_cols_array` is the attribute's 16 numbers in file order.
    pub fn camera_from_world(&self) -> DMat4 {
        let row = |axis: DVec3| axis.extend(-axis.dot(self.origin));
        DMat4::from_cols(row(self.right), row(self.up), row(-self.forward), DVec4::W).transpose()
    }

    /// Width of the picture at distance 1 (OpenEXR `screenWindowWidth`).
    pub fn screen_window_width(&self) -> f64 {
        2.0 * self.half_extent.x
    }
}

/// Half the picture's width and height at distance 1, for a field of view in degrees.
///
/// The half extent along the axis of the field of view is tan(fov/2); pixels are square.
fn half_extent(fov: f64, axis: FovAxis, size: DVec2) -> DVec2 {
    let along_axis = match axis {
        FovAxis::X => size.x,
        FovAxis::Y => size.y,
        FovAxis::Diagonal => size.length(),
        FovAxis::Smaller => size.min_element(),
        FovAxis::Larger => size.max_element(),
    };
    size * (libm::tan(0.5 * fov.to_radians()) / along_axis)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(fov_axis: FovAxis) -> CameraSettings {
        CameraSettings {
            origin: DVec3::new(0.0, -5.0, 0.0),
            target: DVec3::ZERO,
            up: DVec3::Z,
            fov: 40.0,
            fov_axis,
        }
    }

    #[test]
    fn rays_agree_with_mitsuba() {
        // direction through the top left corner, printed by Mitsuba 3.9.1 for 16x12 and 12x16
        let cases = [
            (FovAxis::X, [-0.331294, 0.910223, 0.248471], [-0.31119, 0.854987, 0.41492]),
            (FovAxis::Y, [-0.41492, 0.854987, 0.31119], [-0.248471, 0.910223, 0.331294]),
            (FovAxis::Diagonal, [-0.273616, 0.939693, 0.205212], [-0.205212, 0.939693, 0.273616]),
            (FovAxis::Smaller, [-0.41492, 0.854987, 0.31119], [-0.31119, 0.854987, 0.41492]),
            (FovAxis::Larger, [-0.331294, 0.910223, 0.248471], [-0.248471, 0.910223, 0.331294]),
        ];
        for (axis, landscape, portrait) in cases {
            for (size, want) in [([16, 12], landscape), ([12, 16], portrait)] {
                let camera = PerspectiveCamera::try_new(&settings(axis), size).unwrap();
                let got = camera.ray(DVec2::ZERO).direction;
                let want = DVec3::from_array(want);
                assert!(got.distance(want) < 2e-6, "{axis:?} {size:?}: got {got}, want {want}");
            }
        }
    }

    #[test]
    fn picture_is_not_mirrored() {
        let camera = PerspectiveCamera::try_new(&settings(FovAxis::X), [16, 12]).unwrap();
        let centre = camera.ray(DVec2::new(8.0, 6.0));
        assert_eq!(centre.direction, DVec3::Y);
        assert_eq!(centre.origin, DVec3::new(0.0, -5.0, 0.0));
        assert!(camera.ray(DVec2::new(12.0, 6.0)).direction.x > 0.0, "+x is on the right");
        assert!(camera.ray(DVec2::new(8.0, 3.0)).direction.z > 0.0, "+z is up");
    }

    #[test]
    fn matrix_takes_a_rays_points_to_its_pixel() {
        let mut skew = settings(FovAxis::X);
        skew.origin = DVec3::new(3.0, -4.0, 2.0);
        skew.target = DVec3::new(0.5, 0.25, -0.125);
        let camera = PerspectiveCamera::try_new(&skew, [64, 48]).unwrap();
        let pixel = DVec2::new(50.25, 9.5);
        let point = camera.ray(pixel).at(7.0);
        let seen = camera.camera_from_world().transform_point3(point);
        assert!(seen.z < 0.0, "the camera looks along -z");
        let film = DVec2::new(seen.x, seen.y) / -seen.z;
        let width = camera.screen_window_width();
        let got = DVec2::new(film.x / width + 0.5, 0.5 - film.y / (width * 48.0 / 64.0));
        let want = pixel / DVec2::new(64.0, 48.0);
        assert!(got.distance(want) < 1e-14, "got {got}, want {want}");
        // row vectors: the last four numbers are the translation
        let row = camera.camera_from_world().to_cols_array();
        assert_eq!([row[3], row[7], row[11], row[15]], [0.0, 0.0, 0.0, 1.0]);
        assert!((row[14] - skew.origin.dot(camera.forward)).abs() < 1e-14);
    }

    #[test]
    fn cameras_without_a_picture_are_refused() {
        let good = settings(FovAxis::X);
        let with = |change: fn(&mut CameraSettings)| {
            let mut bad = good;
            change(&mut bad);
            PerspectiveCamera::try_new(&bad, [4, 4])
        };
        assert_eq!(with(|c| c.target = c.origin), Err(CameraError::NoDirection));
        assert_eq!(with(|c| c.target.x = f64::NAN), Err(CameraError::NoDirection));
        assert_eq!(with(|c| c.up = DVec3::NEG_Y), Err(CameraError::NoUp));
        assert_eq!(with(|c| c.up = DVec3::ZERO), Err(CameraError::NoUp));
        assert_eq!(with(|c| c.fov = 180.0), Err(CameraError::Fov(180.0)));
        assert!(matches!(with(|c| c.fov = f64::NAN), Err(CameraError::Fov(_))));
        let empty = PerspectiveCamera::try_new(&good, [0, 4]);
        assert_eq!(empty, Err(CameraError::EmptyFilm(0, 4)));
    }
}
