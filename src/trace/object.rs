//! An object that rays are traced against, and the place on it that a ray hits.

use glam::{DVec2, DVec3};

use crate::math::bounds;
use crate::patch::{Face, Shell};

use super::attributes::VertexAttributes;

/// An object as faces.
#[derive(Debug)]
pub struct TracedObject {
    /// Its name in the scene file.
    pub name: String,
    /// Its surface.
    pub shell: Shell,
    /// Its texture coordinates and normals for shading.
    pub attributes: Box<dyn VertexAttributes>,
}

impl TracedObject {
    /// Its faces.
    #[must_use]
    pub fn faces(&self) -> &[Face] {
        self.shell.faces()
    }

    /// Lowest and highest corner of a box around its surface; not the tightest.
    pub fn bounds(&self) -> [DVec3; 2] {
        self.faces().iter().fold(bounds::NONE, |known, face| {
            // most faces of a mesh are deep inside, which their control points tell at once
            let whole = face.hull_bounds();
            let is_inside = whole[0].cmpge(known[0]).all() && whole[1].cmple(known[1]).all();
            let [low, high] = if is_inside { whole } else { face.trimmed_bounds() };
            [known[0].min(low), known[1].max(high)]
        })
    }
}

/// A hit on a patch, before anything but its place is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchHit {
    /// Ray parameter.
    pub t: f64,
    /// Index of the object.
    pub object: u32,
    /// Index of the patch within the object.
    pub patch: u32,
    /// Parameters in the patch.
    pub st: DVec2,
    /// Index of the input face.
    pub face: u32,
    /// Index of the prepared polygon.
    pub polygon: u32,
    /// Whether the ray is tangent to the patch there, within rounding.
    pub tangent: bool,
    /// Whether the point belongs to the trim only for its tolerance: it is within rounding of a border.
    pub on_border: bool,
}
