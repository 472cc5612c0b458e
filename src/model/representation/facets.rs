//! Objects of flat triangles in place of a deformed shape.

use glam::{DVec2, DVec3};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use crate::patch::{Facet, Place, Shell};
use crate::spline::{KnotBox, SplineVolume};
use crate::subdivide::VertexNumbers;
use crate::trace::VertexAttributes;

/// The faces of triangles and what is looked up at their hits. `exact` looks up where the shape itself would be; with
/// `vertex_normals` it is asked at the triangles' corners alone. `volume` is the first that deforms the object.
pub(in crate::model) fn facet_object(
    mut facets: Vec<Facet>,
    exact: Box<dyn VertexAttributes>,
    vertex_normals: bool,
    volume: Option<&SplineVolume>,
) -> (Shell, Box<dyn VertexAttributes>) {
    let shell = |facets: &[Facet]| {
        let faces: Vec<_> = facets.par_iter().map(Facet::to_face).collect();
        let count = facets.iter().flat_map(|facet| facet.vertices).max().map_or(0, |last| last + 1);
        let mut shell = Shell::new(VertexNumbers::new(count));
        for (facet, face) in facets.iter().zip(faces) {
            face.into_iter().for_each(|face| shell.push(face, &facet.vertices));
        }
        shell.shrink();
        shell
    };
    if !vertex_normals {
        return (shell(&facets), exact);
    }
    let normal = |polygon: u32, place: Place| {
        exact.normal(polygon, place, volume.and_then(|volume| volume.knot_box(place.coordinates())))
    };
    let corners = facets
        .par_iter()
        .map(|facet| {
            (
                facet.polygon,
                facet.rest.map(Place::coordinates),
                facet.rest.map(|rest| normal(facet.polygon, rest)),
            )
        })
        .collect();
    for (number, facet) in (0..).zip(&mut facets) {
        facet.polygon = number;
    }
    (shell(&facets), Box::new(InterpolatedNormals { exact, corners }))
}

/// Normals that are linear between the corners of each triangle, as renderers of meshes have them.
#[derive(Debug)]
struct InterpolatedNormals {
    exact: Box<dyn VertexAttributes>,
    /// For each triangle the prepared polygon, the corners before the deformation, and the deformed normals there.
    corners: Vec<(u32, [DVec3; 3], [Option<DVec3>; 3])>,
}

impl VertexAttributes for InterpolatedNormals {
    fn uv(&self, polygon: u32, place: Place) -> DVec2 {
        self.exact.uv(self.corners[polygon as usize].0, place)
    }

    fn uv_gradients(&self, polygon: u32, place: Place) -> Option<[DVec3; 2]> {
        self.exact.uv_gradients(self.corners[polygon as usize].0, place)
    }

    fn normal(&self, polygon: u32, place: Place, _knot_box: Option<KnotBox>) -> Option<DVec3> {
        let rest = place.coordinates();
        let (_, [a, b, c], normals) = &self.corners[polygon as usize];
        let [Some(of_a), Some(of_b), Some(of_c)] = *normals else { return None };
        let whole = (b - a).cross(c - a);
        let share = |p: DVec3, q: DVec3| (p - rest).cross(q - rest).dot(whole) / whole.length_squared();
        (of_a * share(*b, *c) + of_b * share(*c, *a) + of_c * share(*a, *b)).try_normalize()
    }

    fn rest(&self, polygon: u32, place: Place) -> DVec3 {
        self.exact.rest(self.corners[polygon as usize].0, place)
    }

    fn each_number(&self, visit: &mut dyn FnMut(f64)) {
        self.exact.each_number(visit);
        let normals = self.corners.iter().flat_map(|(_, _, normals)| normals).flatten();
        normals.flat_map(|normal| normal.to_array()).for_each(visit);
    }
}
