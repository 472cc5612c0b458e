//! Lights.

use glam::{DAffine3, DVec3};

/// A light as the scene file gives it; colours are linear RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// The same radiance from every direction.
    Constant {
        /// Radiance.
        radiance: DVec3,
    },
    /// A point that shines alike in all directions.
    Point {
        /// Where it is.
        position: DVec3,
        /// Radiant intensity (power per solid angle).
        intensity: DVec3,
    },
    /// The rectangle `[-1, 1]²` of the plane z = 0, shining to the side of +z, placed by `to_world`.
    Rectangle {
        /// Places the rectangle in the world.
        to_world: DAffine3,
        /// Radiance emitted.
        radiance: DVec3,
    },
}
