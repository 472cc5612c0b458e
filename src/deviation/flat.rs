//! The triangles that stand for the surface.

use glam::DVec3;

use super::triangle;
use crate::math::bounds;
use crate::patch::Face;
use crate::trace::BoxTree;

/// A flat triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    pub(super) corners: [DVec3; 3],
    /// Before the deformation.
    pub(super) rest: [DVec3; 3],
    pub(super) face: u32,
    /// Unit normal.
    pub(super) normal: DVec3,
}

/// Triangles that can be asked for the nearest.
#[derive(Debug)]
pub(super) struct FlatMesh {
    pub(super) facets: Vec<Facet>,
    tree: BoxTree,
}

impl Facet {
    fn from_face(patch: &Face) -> Self {
        let points: Vec<_> = patch.patch.positions().collect();
        let corners = [points[0], points[2], points[1]];
        let [origin, s, t] = patch.chart.coordinates();
        Self {
            corners,
            rest: [origin, origin + s, origin + t],
            face: patch.region.trim_loop(0).face,
            normal: (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero(),
        }
    }

    pub(super) fn distance(&self, point: DVec3) -> f64 {
        triangle::distance(self.corners, point)
    }

    /// Signed distance from the plane.
    pub(super) fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point - self.corners[0])
    }

    /// How far a point is inside the plane through edge `edge` along `direction`.
    fn depth(&self, edge: usize, direction: DVec3, point: DVec3) -> f64 {
        let [from, to] = [self.corners[edge], self.corners[(edge + 1) % 3]];
        direction.cross(to - from).normalize_or_zero().dot(point - from)
    }

    fn bounds(&self) -> [DVec3; 2] {
        bounds::around(self.corners)
    }
}

impl FlatMesh {
    /// The triangles of faces as [`crate::patch::Facet::to_face`] makes them.
    pub(super) fn new(patches: &[Face]) -> Self {
        let facets: Vec<_> = patches.iter().map(Facet::from_face).collect();
        let boxes: Vec<_> = facets.iter().map(Facet::bounds).collect();
        Self { tree: BoxTree::build(&boxes), facets }
    }

    /// Distance of a point from the nearest triangle and its index, if that is below `within`; else `within`.
    pub(super) fn nearest(&self, point: DVec3, within: f64) -> (f64, Option<usize>) {
        let mut nearest = (within, None);
        self.tree.nearest(point, within, |index| {
            let distance = self.facets[index].distance(point);
            if distance < nearest.0 {
                nearest = (distance, Some(index));
            }
            nearest.0
        });
        nearest
    }

    /// The triangles that share an edge with one, by edge: with the same ends, the other way round.
    pub(super) fn neighbours(&self, index: usize) -> [Option<Neighbour>; 3] {
        let corners = self.facets[index].corners;
        [0, 1, 2].map(|edge| {
            let [from, to] = [corners[edge], corners[(edge + 1) % 3]];
            let middle = 0.5 * (from + to);
            let mut found = None;
            self.tree.overlapping([middle, middle], |other| {
                let facet = &self.facets[other];
                let shared =
                    (0..3).find(|&edge| facet.corners[edge] == to && facet.corners[(edge + 1) % 3] == from);
                if let (Some(shared), true) = (shared, other != index) {
                    found = Some(Neighbour { facet: *facet, shared });
                }
            });
            found
        })
    }
}

/// A triangle beside another one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Neighbour {
    facet: Facet,
    /// Its own edge that both have.
    shared: usize,
}

impl Neighbour {
    /// Bound of the distance of points from the two triangles: within `bend` of the convex hull of `points`, which must be over
    /// the triangles, seen along the first one's normal. Infinity if they are not.
    ///
    /// A point over either is as far from it, along the normal, as from its plane.
    pub(super) fn bound(&self, first: &Facet, edge: usize, points: [DVec3; 3], bend: f64) -> f64 {
        let up = first.normal;
        let cosine = up.dot(self.facet.normal);
        let over = |point: DVec3| {
            let inside = |facet: &Facet, shared: usize| {
                (1..3).all(|k| facet.depth((shared + k) % 3, up, point) >= bend)
            };
            inside(first, edge) && inside(&self.facet, self.shared)
        };
        // NaN is not over anything
        if !(cosine > 0.5 && points.iter().all(|&point| over(point))) {
            return f64::INFINITY;
        }
        let heights =
            points.map(|point| first.height(point).abs().max(self.facet.height(point).abs() / cosine));
        heights.into_iter().fold(0.0, f64::max) + bend / cosine
    }
}
