//! Flat triangles as patches: what approximations of a deformed shape are made of.

use glam::{DVec2, DVec3};

use super::bezier_patch::BezierPatch;
use super::chart::{Chart, Place};
use super::face::Face;
use super::region::{LoopCorner, RegionBuilder};

/// A flat triangle in place of a part of a deformed surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// Index of the prepared polygon it stands for a part of.
    pub polygon: u32,
    /// Index of the input face.
    pub face: u32,
    /// Its corners before the deformation, all in space or all parameters.
    pub rest: [Place; 3],
    /// Its corners, counter-clockwise seen from the side of the input face's winding.
    pub corners: [DVec3; 3],
    /// The numbers of its corners' vertices: those of triangles that share a corner are the same.
    pub vertices: [u32; 3],
}

impl Facet {
    /// The triangle as a face of degree 1 × 1 over the parallelogram of its sides, with the half that it is as its region; its
    /// chart is that of the corners before the deformation. `None` if it has no area, or none before the deformation.
    #[must_use]
    pub fn to_face(&self) -> Option<Face> {
        let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).length();
        // NaN has no area either
        if !(area(self.corners) > 0.0 && area(self.rest.map(Place::coordinates)) > 0.0) {
            return None;
        }
        let [a, b, c] = self.corners;
        let net = [a, c, b, b + (c - a)].map(|point| point.extend(1.0));
        let mut region = RegionBuilder::default();
        let st = [DVec2::ZERO, DVec2::X, DVec2::Y].into_iter().zip(self.vertices);
        region.push(self.polygon, self.face, st.map(|(st, vertex)| LoopCorner { st, vertex }));
        let (region, _) = region.finish();
        Some(Face::undeformed(Chart::through(self.rest), BezierPatch::new([1, 1], net.to_vec()), region))
    }
}
