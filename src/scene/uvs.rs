//! Texture coordinates at a point of the undeformed object.

use glam::{DVec2, DVec3};

use crate::mesh::{Polygon, PolygonSet};
use crate::trace::UvLookup;

/// Looks texture coordinates up in the polygons they were given for.
#[derive(Debug)]
pub(super) struct PolygonUvs(pub(super) PolygonSet);

impl UvLookup for PolygonUvs {
    /// Linear over the triangles of the polygon's fan; NaN where a corner has none.
    fn uv(&self, polygon: u32, rest: DVec3) -> DVec2 {
        let polygon = self.0.polygon(polygon as usize);
        let fan = 1..polygon.positions.len() - 1;
        let best = fan
            .map(|i| (i, barycentric(&polygon, i, rest)))
            .max_by(|a, b| a.1.min_element().total_cmp(&b.1.min_element()));
        match best {
            Some((i, weights)) if !polygon.uvs.is_empty() => {
                weights.x * polygon.uvs[0] + weights.y * polygon.uvs[i] + weights.z * polygon.uvs[i + 1]
            }
            _ => DVec2::NAN,
        }
    }
}

/// Barycentric coordinates of a point in triangle (0, i, i + 1) of a polygon's fan.
fn barycentric(polygon: &Polygon<'_>, i: usize, point: DVec3) -> DVec3 {
    let [a, b, c] = [0, i, i + 1].map(|corner| polygon.positions[corner]);
    let area = polygon.normal.dot((b - a).cross(c - a));
    let of_b = polygon.normal.dot((point - a).cross(c - a)) / area;
    let of_c = polygon.normal.dot((b - a).cross(point - a)) / area;
    let weights = DVec3::new(1.0 - of_b - of_c, of_b, of_c);
    // a fan's triangle without area holds no point
    if weights.is_finite() { weights } else { DVec3::splat(f64::NEG_INFINITY) }
}
