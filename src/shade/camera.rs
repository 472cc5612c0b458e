//! The camera.

use glam::DVec3;

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
