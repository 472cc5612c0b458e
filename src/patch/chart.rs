//! Where the parameters of a face are on the undeformed object.

use glam::{DVec2, DVec3};

use crate::subdivide::Frame;

/// The map from a face's unit square to the undeformed object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Chart {
    /// To a plane in space, of which polygons are pieces.
    Plane(Frame),
    /// To the parameters (u, v) of a parametric surface.
    Parameters(ParameterFrame),
}

/// The affine map from a face's unit square to the parameters of a surface: `origin + s · frame.s + t · frame.t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterFrame {
    /// The parameters at (0, 0).
    pub origin: DVec2,
    /// From (0, 0) to (1, 0).
    pub s: DVec2,
    /// From (0, 0) to (0, 1).
    pub t: DVec2,
}

/// A place on the undeformed object, as a [`Chart`] gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// A point in space.
    Point(DVec3),
    /// The parameters (u, v) of a surface.
    Parameters(DVec2),
}

impl Chart {
    /// The map that takes (0, 0), (1, 0) and (0, 1) to these places, all in space or all parameters.
    pub(crate) fn through([origin, along_s, along_t]: [Place; 3]) -> Self {
        match origin {
            Place::Point(origin) => {
                let [s, t] = [along_s, along_t].map(|place| place.coordinates() - origin);
                Self::Plane(Frame { origin, s, t })
            }
            Place::Parameters(origin) => {
                let [s, t] = [along_s, along_t].map(|place| place.coordinates().truncate() - origin);
                Self::Parameters(ParameterFrame { origin, s, t })
            }
        }
    }

    /// The place of a face's parameters.
    #[must_use]
    pub fn place(&self, st: DVec2) -> Place {
        match self {
            Self::Plane(frame) => Place::Point(frame.point(st)),
            Self::Parameters(frame) => Place::Parameters(frame.parameters(st)),
        }
    }

    /// The map of the rectangle `[low, high]`, as the unit square of a face of its own.
    pub(crate) fn restricted(&self, low: DVec2, high: DVec2) -> Self {
        match self {
            Self::Plane(frame) => Self::Plane(frame.restricted(low, high)),
            Self::Parameters(frame) => {
                let size = high - low;
                let origin = frame.parameters(low);
                Self::Parameters(ParameterFrame { origin, s: size.x * frame.s, t: size.y * frame.t })
            }
        }
    }

    /// Origin, s and t: of a plane in space, of parameters as (u, v, 0).
    #[must_use]
    pub fn coordinates(&self) -> [DVec3; 3] {
        match self {
            Self::Plane(frame) => [frame.origin, frame.s, frame.t],
            Self::Parameters(frame) => [frame.origin, frame.s, frame.t].map(|uv| uv.extend(0.0)),
        }
    }
}

impl ParameterFrame {
    /// The surface's parameters at a face's.
    #[must_use]
    pub fn parameters(&self, st: DVec2) -> DVec2 {
        self.origin + st.x * self.s + st.y * self.t
    }
}

impl Place {
    /// A point in space as it is, parameters as (u, v, 0).
    #[must_use]
    pub const fn coordinates(self) -> DVec3 {
        match self {
            Self::Point(point) => point,
            Self::Parameters(uv) => DVec3::new(uv.x, uv.y, 0.0),
        }
    }
}
