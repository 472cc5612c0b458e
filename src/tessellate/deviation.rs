//! How far a triangle is from the exact surface.

use glam::{DVec2, DVec3};

use super::corners::Part;
use crate::math::polygon;

/// Steps along each side of the grid of points at which a triangle is measured.
const STEPS: usize = 4;

/// The same for the triangles of the sub-polygons, where the surface may have more than one wave.
const FIRST_STEPS: usize = 12;

/// Parameters this close to a sub-polygon are inside it: far above rounding, far below what a distance tells.
const ON_BORDER: f64 = 1e-9;

/// Cosine of the angle between a triangle and the surface below which the distance along the normal says too little.
const OBLIQUE: f64 = 0.9;

/// Greatest distances from the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Distances {
    /// On the edges 0-1, 1-2 and 2-0.
    pub(super) edges: [f64; 3],
    /// At the points inside.
    pub(super) inside: f64,
}

impl Distances {
    pub(super) fn greatest(&self) -> f64 {
        self.edges.iter().fold(self.inside, |most, &edge| most.max(edge))
    }

    /// Takes a distance in; NaN counts as infinitely far.
    fn add(&mut self, distance: f64, on: [bool; 3]) {
        let distance = if distance.is_nan() { f64::INFINITY } else { distance };
        if on == [false; 3] {
            self.inside = self.inside.max(distance);
        }
        for (edge, on) in self.edges.iter_mut().zip(on) {
            if on {
                *edge = edge.max(distance);
            }
        }
    }
}

/// Whether the line between two places is part of one of some edges' lines.
fn is_border(edges: &[[DVec2; 2]], [from, to]: [DVec2; 2]) -> bool {
    let near = |point: DVec2, a: DVec2, along: DVec2| {
        (point - a).perp_dot(along).abs() <= ON_BORDER * along.length()
    };
    edges.iter().any(|&[a, b]| near(from, a, b - a) && near(to, a, b - a))
}

/// Distances of a flat triangle from the surface over the triangle `st` of a patch's parameters, at the points of a grid and
/// the centroid.
///
/// A point's distance is that from the surface's point at the same parameters if they matter, as they do for texture
/// coordinates. Else it is that from the tangent plane where the surface is nearest, after one step of Newton's method
/// from these parameters: a point on the surface but not where its parameters would be counts as exact. Where the
/// triangle leans away from the tangent plane, it is the first in any case; and where the surface would be nearest beyond the
/// border of the sub-polygon, which may be a crease, it is that from the nearer of the surface's points there and at the same
/// parameters. On edges that are part of a crease it is no less than that of the surface's border from the edge's line:
/// beyond a crease there may be nothing of the triangles that is nearer. The same holds of edges along a curved border where
/// the surface is torn, with the border's points beside the edge.
pub(super) fn distances(
    part: &Part<'_>,
    st: [DVec2; 3],
    corners: [DVec3; 3],
    along_tear: [bool; 3],
    (is_first, parameters_matter): (bool, bool),
) -> Distances {
    let facet = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
    let distance = |weights: DVec3| {
        let at = weights.x * st[0] + weights.y * st[1] + weights.z * st[2];
        let flat = weights.x * corners[0] + weights.y * corners[1] + weights.z * corners[2];
        let exact = part.eval(at);
        let offset = flat - exact.position;
        if parameters_matter || exact.normal().dot(facet).abs() <= OBLIQUE {
            return offset.length();
        }
        let foot = at + exact.step_along(offset);
        let inside = polygon::nearest(part.outline, foot);
        let nearer = part.eval(inside);
        if inside.distance_squared(foot) > ON_BORDER * ON_BORDER {
            return offset.length().min(flat.distance(nearer.position));
        }
        (flat - nearer.position).dot(nearer.normal()).abs()
    };
    let ends = |edge: usize| [st[edge], st[(edge + 1) % 3]];
    let is_edge = [0, 1, 2].map(|edge| along_tear[edge] || is_border(&part.creases, ends(edge)));
    let from_line = |weights: DVec3, edge: usize| {
        let at = weights.x * st[0] + weights.y * st[1] + weights.z * st[2];
        let [from, along] = [corners[edge], (corners[(edge + 1) % 3] - corners[edge]).normalize_or_zero()];
        let at = if along_tear[edge] { part.sheets.on_border(ends(edge), at).unwrap_or(at) } else { at };
        (part.eval(at).position - from).cross(along).length()
    };
    let steps = if is_first { FIRST_STEPS } else { STEPS };
    let mut found = Distances::default();
    found.add(distance(DVec3::splat(1.0 / 3.0)), [false; 3]);
    for j in 0..=steps {
        for i in 0..=steps - j {
            let k = steps - i - j;
            if i.max(j).max(k) == steps {
                continue;
            }
            let weights = DVec3::new(k as f64, i as f64, j as f64) / steps as f64;
            let on = [j == 0, k == 0, i == 0];
            let border = (0..3).find(|&edge| on[edge] && is_edge[edge]);
            found.add(border.map_or(0.0, |edge| from_line(weights, edge)).max(distance(weights)), on);
        }
    }
    found
}
