//! What the corners of a mesh say of the points between them.

use glam::{DVec2, DVec3};

use crate::patch::Place;
use crate::spline::KnotBox;

/// Gives what the corners of a mesh say of the points between them.
pub trait VertexAttributes: Send + Sync + std::fmt::Debug {
    /// Texture coordinates of `polygon` (a prepared one) at a point of the undeformed object; NaN where there are none.
    fn uv(&self, polygon: u32, place: Place) -> DVec2;

    /// Gradients of both texture coordinates over the undeformed polygon.
    fn uv_gradients(&self, polygon: u32, place: Place) -> Option<[DVec3; 2]>;

    /// A unit normal for shading, in the deformed space, if it is not the surface's own; `knot_box` is the knot box of the
    /// point, if it is in the lattice.
    fn normal(&self, polygon: u32, place: Place, knot_box: Option<KnotBox>) -> Option<DVec3>;

    /// The point in space of a place on the undeformed object.
    fn rest(&self, _polygon: u32, place: Place) -> DVec3 {
        place.coordinates()
    }

    /// Calls `visit` with all numbers that decide what is looked up, besides the patches.
    fn each_number(&self, _visit: &mut dyn FnMut(f64)) {}
}

/// The attributes of an object whose mesh has none.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoAttributes;

impl VertexAttributes for NoAttributes {
    fn uv(&self, _polygon: u32, _place: Place) -> DVec2 {
        DVec2::NAN
    }

    fn uv_gradients(&self, _polygon: u32, _place: Place) -> Option<[DVec3; 2]> {
        None
    }

    fn normal(&self, _polygon: u32, _place: Place, _knot_box: Option<KnotBox>) -> Option<DVec3> {
        None
    }
}
