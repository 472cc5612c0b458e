//! Cameras.

use glam::{DMat4, DVec2, DVec3, DVec4};
use thiserror::Error;

use super::warp;
use crate::choice::Choice;
use crate::math::magnitude::{self, LARGEST, MagnitudeError};
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

impl Choice for FovAxis {
    const WHAT: &'static str = "fov_axis";
    const ALL: &'static [Self] = &[Self::X, Self::Y, Self::Diagonal, Self::Smaller, Self::Larger];

    fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Diagonal => "diagonal",
            Self::Smaller => "smaller",
            Self::Larger => "larger",
        }
    }
}

/// A camera as the scene file gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraSettings {
    /// The pinhole, the middle of the lens, or a point of the plane that parallel rays start from.
    pub origin: DVec3,
    /// A point in the picture's middle.
    pub target: DVec3,
    /// A direction that is up in the picture.
    pub up: DVec3,
    /// What of the space is seen.
    pub projection: Projection,
}

/// How space is projected to the film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Through a pinhole or a lens, as Mitsuba's `perspective` and `thinlens`.
    Perspective {
        /// Field of view in degrees, in `(0, 180)`.
        fov: f64,
        /// The axis of `fov`.
        fov_axis: FovAxis,
        /// None for a pinhole.
        lens: Option<ThinLens>,
    },
    /// Along the direction of view, as Mitsuba's `orthographic`.
    Orthographic {
        /// Width of the picture in world units (Mitsuba scales `to_world` by half of it).
        width: f64,
    },
}

/// A thin lens: what is not at its distance of focus is blurred.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinLens {
    /// Radius of the lens in world units, above 0.
    pub aperture_radius: f64,
    /// Distance, along the direction of view, of the plane in focus.
    pub focus_distance: f64,
}

/// Why a camera cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum CameraError {
    /// There is no direction to look along.
    #[error("camera: origin and target must be two different, finite points")]
    NoDirection,
    /// A coordinate of origin or target is too large to compute with.
    #[error("camera: {0}")]
    TooLarge(MagnitudeError),
    /// The picture's top is not determined.
    #[error("camera: up must not be zero or parallel to the direction of view")]
    NoUp,
    /// The field of view is no angle that a plane picture can have.
    #[error("camera: fov is {0} degrees, but must lie between 0 and 180")]
    Fov(f64),
    /// A parallel projection's picture has no width.
    #[error("camera: width is {0}, but must be above 0")]
    Width(f64),
    /// A lens without radius, or focused behind itself.
    #[error("camera: aperture_radius is {0} and focus_distance {1}, but both must be above 0")]
    Lens(f64, f64),
    /// The film has no pixels.
    #[error("camera: the film is {0}x{1} pixels, but must be at least 1x1")]
    EmptyFilm(u32, u32),
}

/// A camera over a film of `size` pixels, as Mitsuba's with `look_at`.
///
/// Pixel coordinates run from (0, 0), the picture's top left corner, to `size`, its bottom right one. The picture is not
/// mirrored: from (0, -5, 0) towards 0 with +z up, +x is on the right. Unlike Mitsuba's there are no clipping planes, so
/// that `t` is the distance from the pinhole, the point on the lens, or the plane of the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    origin: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Half the picture's width and height: at distance 1, or of parallel rays.
    half_extent: DVec2,
    size: DVec2,
    projection: Projection,
}

impl Camera {
    /// The camera of the settings for a film of `size` pixels (all of it, whatever the crop).
    ///
    /// # Errors
    /// Where origin, target, up, projection or size determine no picture.
    pub fn try_new(settings: &CameraSettings, size: [u32; 2]) -> Result<Self, CameraError> {
        let most = magnitude::greatest([settings.origin, settings.target]);
        if most > LARGEST && most < f64::INFINITY {
            return Err(CameraError::TooLarge(MagnitudeError::TooLarge(most)));
        }
        let forward = (settings.target - settings.origin).try_normalize().ok_or(CameraError::NoDirection)?;
        let right = settings
            .up
            .try_normalize()
            .and_then(|up| forward.cross(up).try_normalize())
            .ok_or(CameraError::NoUp)?;
        if size[0] == 0 || size[1] == 0 {
            return Err(CameraError::EmptyFilm(size[0], size[1]));
        }
        let pixels = DVec2::new(size[0].into(), size[1].into());
        let half_extent = match settings.projection {
            Projection::Perspective { fov, .. } if !(fov > 0.0 && fov < 180.0) => {
                return Err(CameraError::Fov(fov));
            }
            Projection::Perspective { lens: Some(lens), .. }
                if !(lens.aperture_radius > 0.0 && lens.focus_distance > 0.0) =>
            {
                return Err(CameraError::Lens(lens.aperture_radius, lens.focus_distance));
            }
            Projection::Perspective { fov, fov_axis, .. } => half_extent(fov, fov_axis, pixels),
            Projection::Orthographic { width } if !(width > 0.0 && width.is_finite()) => {
                return Err(CameraError::Width(width));
            }
            Projection::Orthographic { width } => pixels * (0.5 * width / pixels.x),
        };
        let up = right.cross(forward);
        let projection = settings.projection;
        Ok(Self { origin: settings.origin, right, up, forward, half_extent, size: pixels, projection })
    }

    /// Whether rays depend on a place on the lens.
    #[must_use]
    pub const fn has_lens(&self) -> bool {
        matches!(self.projection, Projection::Perspective { lens: Some(_), .. })
    }

    /// The ray through the film at `pixel` (pixel centres are at +0.5), its direction of length 1, by way of the place on the
    /// lens that uniform `on_lens` in `[0, 1)²` gives.
    #[must_use]
    pub fn ray(&self, pixel: DVec2, on_lens: DVec2) -> Ray {
        // [-1, 1]² over the film, y upwards
        let x = (2.0 * pixel.x / self.size.x - 1.0) * self.half_extent.x;
        let y = (1.0 - 2.0 * pixel.y / self.size.y) * self.half_extent.y;
        let across = x * self.right + y * self.up;
        match self.projection {
            Projection::Orthographic { .. } => Ray::new(self.origin + across, self.forward),
            Projection::Perspective { lens: None, .. } => {
                Ray::new(self.origin, (self.forward + across).normalize())
            }
            Projection::Perspective { lens: Some(lens), .. } => {
                let disk = lens.aperture_radius * warp::concentric_disk(on_lens);
                let from = disk.x * self.right + disk.y * self.up;
                let to = lens.focus_distance * (self.forward + across);
                Ray::new(self.origin + from, (to - from).normalize())
            }
        }
    }

    /// Where a point is in the picture, in pixels, if it is before the camera; by a lens's middle.
    #[must_use]
    pub fn project(&self, point: DVec3) -> Option<DVec2> {
        let seen = point - self.origin;
        let depth = match self.projection {
            Projection::Orthographic { .. } => 1.0,
            Projection::Perspective { .. } => seen.dot(self.forward),
        };
        let place = DVec2::new(seen.dot(self.right), -seen.dot(self.up)) / (depth * self.half_extent);
        (depth > 0.0).then(|| 0.5 * (place + 1.0) * self.size)
    }

    /// World space to camera space: +x right, +y up, looking along -z (OpenEXR `worldToCamera`).
    ///
    /// For column vectors; OpenEXR's row vectors make its rows these columns, so that
    /// `to_cols_array` is the attribute's 16 numbers in file order.
    #[must_use]
    pub fn camera_from_world(&self) -> DMat4 {
        let row = |axis: DVec3| axis.extend(-axis.dot(self.origin));
        DMat4::from_cols(row(self.right), row(self.up), row(-self.forward), DVec4::W).transpose()
    }

    /// Width of the picture, at distance 1 if rays are not parallel (OpenEXR `screenWindowWidth`).
    #[must_use]
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
            projection: Projection::Perspective { fov: 40.0, fov_axis, lens: None },
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
                let camera = Camera::try_new(&settings(axis), size).unwrap();
                let got = camera.ray(DVec2::ZERO, DVec2::ZERO).direction;
                let want = DVec3::from_array(want);
                assert!(got.distance(want) < 2e-6, "{axis:?} {size:?}: got {got}, want {want}");
            }
        }
    }

    #[test]
    fn picture_is_not_mirrored() {
        let camera = Camera::try_new(&settings(FovAxis::X), [16, 12]).unwrap();
        let centre = camera.ray(DVec2::new(8.0, 6.0), DVec2::ZERO);
        assert_eq!(centre.direction, DVec3::Y);
        assert_eq!(centre.origin, DVec3::new(0.0, -5.0, 0.0));
        assert!(camera.ray(DVec2::new(12.0, 6.0), DVec2::ZERO).direction.x > 0.0, "+x is on the right");
        assert!(camera.ray(DVec2::new(8.0, 3.0), DVec2::ZERO).direction.z > 0.0, "+z is up");
    }

    #[test]
    fn matrix_takes_a_rays_points_to_its_pixel() {
        let mut skew = settings(FovAxis::X);
        skew.origin = DVec3::new(3.0, -4.0, 2.0);
        skew.target = DVec3::new(0.5, 0.25, -0.125);
        let camera = Camera::try_new(&skew, [64, 48]).unwrap();
        let pixel = DVec2::new(50.25, 9.5);
        let point = camera.ray(pixel, DVec2::ZERO).at(7.0);
        let seen = camera.camera_from_world().transform_point3(point);
        assert!(seen.z < 0.0, "the camera looks along -z");
        let film = DVec2::new(seen.x, seen.y) / -seen.z;
        let width = camera.screen_window_width();
        let got = DVec2::new(film.x / width + 0.5, 0.5 - film.y / (width * 48.0 / 64.0));
        let want = pixel / DVec2::new(64.0, 48.0);
        assert!(got.distance(want) < 1e-14, "got {got}, want {want}");
        assert!(camera.project(point).unwrap().distance(pixel) < 1e-12);
        assert_eq!(camera.project(camera.ray(pixel, DVec2::ZERO).at(-1.0)), None);
        // row vectors: the last four numbers are the translation
        let row = camera.camera_from_world().to_cols_array();
        assert_eq!([row[3], row[7], row[11], row[15]], [0.0, 0.0, 0.0, 1.0]);
        assert!((row[14] - skew.origin.dot(camera.forward)).abs() < 1e-14);
    }

    #[test]
    fn cameras_without_a_picture_are_refused() {
        let good = settings(FovAxis::X);
        let with = |change: &dyn Fn(&mut CameraSettings)| {
            let mut bad = good;
            change(&mut bad);
            Camera::try_new(&bad, [4, 4])
        };
        assert_eq!(with(&|c| c.target = c.origin), Err(CameraError::NoDirection));
        assert_eq!(with(&|c| c.target.x = f64::NAN), Err(CameraError::NoDirection));
        assert_eq!(with(&|c| c.up = DVec3::NEG_Y), Err(CameraError::NoUp));
        assert_eq!(with(&|c| c.up = DVec3::ZERO), Err(CameraError::NoUp));
        let fov = |fov| Projection::Perspective { fov, fov_axis: FovAxis::X, lens: None };
        assert_eq!(with(&|c| c.projection = fov(180.0)), Err(CameraError::Fov(180.0)));
        assert!(matches!(with(&|c| c.projection = fov(f64::NAN)), Err(CameraError::Fov(_))));
        let flat = Projection::Orthographic { width: 0.0 };
        assert_eq!(with(&|c| c.projection = flat), Err(CameraError::Width(0.0)));
        let empty = Camera::try_new(&good, [0, 4]);
        assert_eq!(empty, Err(CameraError::EmptyFilm(0, 4)));
    }

    #[test]
    fn lens_rays_meet_in_the_plane_of_focus() {
        let pinhole = Camera::try_new(&settings(FovAxis::X), [16, 12]).unwrap();
        let lens = Some(ThinLens { aperture_radius: 0.3, focus_distance: 4.0 });
        let projection = Projection::Perspective { fov: 40.0, fov_axis: FovAxis::X, lens };
        let camera =
            Camera::try_new(&CameraSettings { projection, ..settings(FovAxis::X) }, [16, 12]).unwrap();
        assert!(camera.has_lens() && !pinhole.has_lens());
        let pixel = DVec2::new(3.25, 10.5);
        let sharp = pinhole.ray(pixel, DVec2::ZERO);
        let focus = sharp.at(4.0 / sharp.direction.y);
        for u in [DVec2::ZERO, DVec2::new(0.9, 0.2), DVec2::new(0.5, 0.99)] {
            let ray = camera.ray(pixel, u);
            let off = focus - ray.origin;
            assert!(off.cross(ray.direction).length() < 1e-14, "{u} misses the focus");
            let radius = ray.origin.distance(DVec3::new(0.0, -5.0, 0.0));
            assert!(radius <= 0.3 && ray.origin.y == -5.0, "{u} is off the lens");
        }
        let corner = camera.ray(pixel, DVec2::ZERO).origin;
        assert!(
            (corner.distance(DVec3::new(0.0, -5.0, 0.0)) - 0.3).abs() < 1e-15,
            "the lens is used to its rim"
        );
    }

    #[test]
    fn parallel_rays_start_on_a_plane() {
        let projection = Projection::Orthographic { width: 8.0 };
        let camera =
            Camera::try_new(&CameraSettings { projection, ..settings(FovAxis::X) }, [16, 12]).unwrap();
        let ray = camera.ray(DVec2::new(12.0, 3.0), DVec2::ZERO);
        assert_eq!((ray.origin, ray.direction), (DVec3::new(2.0, -5.0, 1.5), DVec3::Y));
        assert_eq!(camera.screen_window_width(), 8.0);
        assert!(camera.project(ray.at(3.0)).unwrap().distance(DVec2::new(12.0, 3.0)) < 1e-12);
    }
}
