//! Flat triangles as patches: what approximations of a deformed shape are made of.

use glam::{DVec2, DVec3};

use super::bezier_patch::BezierPatch;
use super::build::TrimmedPatch;
use super::trim::TrimBuilder;
use crate::subdivide::Frame;

/// A flat triangle in place of a part of a deformed surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// Index of the prepared polygon it stands for a part of.
    pub polygon: u32,
    /// Index of the input face.
    pub face: u32,
    /// Its corners before the deformation, in the frame of the exact patches.
    pub rest: [DVec3; 3],
    /// Its corners, counter-clockwise seen from the side of the input face's winding.
    pub corners: [DVec3; 3],
}

impl Facet {
    /// The triangle as a patch of degree 1 × 1 over the parallelogram of its sides, trimmed to the half that it is; its frame
    /// is that of the corners before the deformation. `None` if it has no area, or none before the deformation.
    pub fn patch(&self) -> Option<TrimmedPatch> {
        let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).length();
        // NaN has no area either
        if !(area(self.corners) > 0.0 && area(self.rest) > 0.0) {
            return None;
        }
        let [a, b, c] = self.corners;
        let net = [a, c, b, b + (c - a)].map(|point| point.extend(1.0));
        let [origin, s, t] = [self.rest[0], self.rest[1] - self.rest[0], self.rest[2] - self.rest[0]];
        let mut trim = TrimBuilder::default();
        trim.push(self.polygon, self.face, [DVec2::ZERO, DVec2::X, DVec2::Y]);
        Some(TrimmedPatch::undeformed(
            Frame { origin, s, t },
            BezierPatch::new([1, 1], net.to_vec()),
            trim.finish(),
        ))
    }
}
