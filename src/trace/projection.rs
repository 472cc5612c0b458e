//! A patch seen along a ray: a net in the plane across the ray, where hits are the zeros.

use glam::{DVec2, DVec3, DVec4};

use crate::math::bernstein::{MAX_ORDER, basis};
use crate::math::bounds;
use crate::math::rounding::gamma;
use crate::patch::BezierPatch;

use super::Ray;

/// Rounded operations between a control point and its projection: the ray's point times the weight (1), the
/// difference (1), the product with a normal (3), the normal's own error (normalisation and cross product, 6 along
/// the ray's length), with room for the Newton step's evaluation of the net (2 degree sums, at most 24 + 24).
const PROJECTION_OPERATIONS: u32 = 64;

/// The plane across a ray, as two unit vectors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AcrossRay {
    origin: DVec3,
    along: DVec3,
    normals: [DVec3; 2],
}

impl AcrossRay {
    pub(crate) fn new(ray: &Ray) -> Self {
        let along = ray.direction.normalize();
        let (a, b) = along.any_orthonormal_pair();
        Self { origin: ray.origin, along, normals: [a, b] }
    }

    /// Offsets of a homogeneous point from the ray, times its weight.
    fn project(&self, point: DVec4) -> DVec2 {
        let offset = point.truncate() - point.w * self.origin;
        DVec2::new(self.normals[0].dot(offset), self.normals[1].dot(offset))
    }

    /// Place along the ray of a homogeneous point, times its weight, and the weight.
    fn depth(&self, point: DVec4) -> DVec2 {
        DVec2::new(self.along.dot(point.truncate() - point.w * self.origin), point.w)
    }

    /// Bound on the rounding of a patch's projection, in world units times weight.
    pub(crate) fn rounding(&self, magnitude: f64, greatest_weight: f64) -> f64 {
        gamma(PROJECTION_OPERATIONS) * (magnitude + greatest_weight * self.origin.length())
    }
}

/// The net of a patch across a ray: F(s, t) = Σ `F_ij` B(i, m)(s) B(j, n)(t), zero where the ray meets the patch.
///
/// Source: Nishita, Sederberg, Kakimoto (1990), section 3: the ray as two planes.
#[derive(Debug, Default)]
pub(crate) struct ProjectedNet {
    pub(crate) degree: [usize; 2],
    /// t fastest.
    pub(crate) points: Vec<DVec2>,
    /// Places along the ray, times weight, and weights, in the same order.
    depths: Vec<DVec2>,
    /// Bound on the error of each coordinate of F anywhere in the unit square.
    pub(crate) rounding: f64,
}

/// Value and partials of a [`ProjectedNet`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProjectedPoint {
    pub(crate) value: DVec2,
    pub(crate) by_s: DVec2,
    pub(crate) by_t: DVec2,
}

impl ProjectedNet {
    pub(crate) fn project(&mut self, patch: &BezierPatch, across: &AcrossRay, rounding: f64) {
        self.degree = patch.degree();
        self.rounding = rounding;
        self.points.clear();
        self.points.extend(patch.control_points().map(|point| across.project(point)));
        self.depths.clear();
        self.depths.extend(patch.control_points().map(|point| across.depth(point)));
    }

    /// Place along the ray, in world units.
    pub(crate) fn depth(&self, st: DVec2) -> f64 {
        let value = eval_net(&self.depths, self.degree, st).value;
        value.x / value.y
    }

    /// How far the control points reach along the ray and across it, whichever is more, in world units.
    pub(crate) fn extent(&self) -> f64 {
        let weighted = self.points.iter().zip(&self.depths);
        let places = weighted.map(|(across, depth)| across.extend(depth.x) / depth.y);
        let [low, high] = bounds::around(places);
        (high - low).max_element()
    }

    /// Whether no point of the patch is on the ray: the net's box excludes 0.
    pub(crate) fn misses(&self) -> bool {
        let [low, high] = range(&self.points);
        excludes_zero(low, high, self.rounding)
    }

    pub(crate) fn eval(&self, st: DVec2) -> ProjectedPoint {
        eval_net(&self.points, self.degree, st)
    }
}

/// Value and partials of a net at any real parameters.
pub(crate) fn eval_net(points: &[DVec2], [m, n]: [usize; 2], st: DVec2) -> ProjectedPoint {
    let along_s = basis::<MAX_ORDER, f64>(m, st.x);
    let along_t = basis::<MAX_ORDER, f64>(n, st.y);
    let mut sum = ProjectedPoint { value: DVec2::ZERO, by_s: DVec2::ZERO, by_t: DVec2::ZERO };
    for (i, row) in points.chunks_exact(n + 1).enumerate() {
        let (mut value, mut slope) = (DVec2::ZERO, DVec2::ZERO);
        for (j, &point) in row.iter().enumerate() {
            value += along_t.value[j] * point;
            slope += along_t.derivative[j] * point;
        }
        sum.value += along_s.value[i] * value;
        sum.by_s += along_s.derivative[i] * value;
        sum.by_t += along_s.value[i] * slope;
    }
    sum
}

pub(crate) fn range(points: &[DVec2]) -> [DVec2; 2] {
    points.iter().fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], &p| [low.min(p), high.max(p)])
}

pub(crate) fn excludes_zero(low: DVec2, high: DVec2, margin: f64) -> bool {
    low.cmpgt(DVec2::splat(margin)).any() || high.cmplt(DVec2::splat(-margin)).any()
}
