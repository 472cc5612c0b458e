//! A ray at a leaf: roots by clipping, their tolerance, and the trim.

use glam::{DVec2, DVec3};

use crate::math::rounding::gamma;
use crate::patch::{BezierPatch, Extent, Face, Region, TrimLoop};

use super::Ray;
use super::leaf::{Cover, Cut, Leaf, TANGENT_TOLERANCE, by_loop};
use super::local::LocalSpace;
use super::object::PatchHit;
use super::polish;
use super::projection::AcrossRay;
use super::scratch::Solver;
use super::search::find_roots;
use super::statistics::TraceStatistics;

/// Rounded operations of evaluating a patch's point: two passes of at most 13 products and sums, the basis, the
/// division by the weight.
const EVAL_OPERATIONS: u32 = 64;

/// Rays from no farther than this, in local units, have the tolerance of tangents that leaves are made with.
const NEAR_RAYS: f64 = 8.0;

/// Ratio of weights above which the rounding of a point is bounded by the control points one by one: the extent alone, which is
/// known without looking at them, gives a bound that grows with the ratio's square.
const LARGE_RATIO: f64 = 100.0;

/// A leaf with its patch.
#[derive(Clone, Copy)]
pub(super) struct Target<'a> {
    pub(super) leaf: &'a Leaf,
    pub(super) cuts: &'a [Cut],
    pub(super) trimmed: &'a Face,
    pub(super) space: &'a LocalSpace,
}

/// A root in a leaf, before trimming.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeafRoot {
    pub(super) st: DVec2,
    pub(super) t: f64,
    /// Whether the ray is tangent there, within rounding.
    pub(super) tangent: bool,
}

impl Target<'_> {
    /// The hit of a root that is inside a loop.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "an index, kept as a number of a lane"
    )]
    #[inline(always)]
    pub(super) fn hit(&self, root: &LeafRoot, trim_loop: f64) -> PatchHit {
        let trim_loop = self.trimmed.region.trim_loop(trim_loop as usize);
        self.hit_in_loop(root, trim_loop, false)
    }

    #[inline(always)]
    fn hit_in_loop(&self, root: &LeafRoot, trim_loop: TrimLoop, on_border: bool) -> PatchHit {
        PatchHit {
            t: root.t,
            object: self.leaf.object,
            patch: self.leaf.patch,
            st: root.st,
            face: trim_loop.face,
            polygon: trim_loop.polygon,
            tangent: root.tangent,
            on_border,
        }
    }

    /// The hit of a root near an edge of the trim, if it is inside or within rounding of it.
    #[cold]
    #[inline(never)]
    pub(super) fn hit_near_border(
        &self,
        ray: &Ray,
        root: &LeafRoot,
        statistics: &mut TraceStatistics,
    ) -> Option<PatchHit> {
        let tolerance = tolerance(self.trimmed, self.space, root.st, ray);
        let found = match self.leaf.cover {
            Cover::Inside(trim_loop) => {
                find_loop(&self.trimmed.region, std::iter::once(trim_loop), root.st, tolerance)
            }
            Cover::Crossed { .. } => {
                let loops = by_loop(self.cuts).map(|cuts| cuts[0].trim_loop);
                find_loop(&self.trimmed.region, loops, root.st, tolerance)
            }
        };
        let [held, strictly] = self.trimmed.sides(root.st, tolerance);
        let found = found.filter(|_| held);
        let Some((trim_loop, on_border)) = found else {
            statistics.trimmed += 1;
            return None;
        };
        let on_border = on_border || !strictly;
        statistics.on_border += u64::from(on_border);
        Some(self.hit_in_loop(root, trim_loop, on_border))
    }
}

/// All roots of a leaf by Bézier clipping, with a last Newton step on the patch.
pub(super) fn clip_leaf(target: &Target<'_>, ray: &Ray, solver: &mut Solver) -> Vec<LeafRoot> {
    let Target { leaf, trimmed, .. } = target;
    let Solver { net, search, statistics } = solver;
    statistics.fallbacks += 1;
    search.roots.clear();
    let across = AcrossRay::new(ray);
    let extent = trimmed.patch.extent();
    net.project(&trimmed.patch, &across, across.rounding(extent.magnitude, extent.greatest_weight));
    if net.misses() {
        return Vec::new();
    }
    find_roots(net, leaf.rectangle(), search, statistics);
    let roots = search.roots.iter().map(|root| {
        let st = if root.degenerate { root.st } else { polish::on_patch(&trimmed.patch, ray, root.st) };
        let position = trimmed.patch.eval(st).position;
        let t = (position - ray.origin).dot(ray.direction) / ray.direction.length_squared();
        LeafRoot { st, t, tangent: root.degenerate }
    });
    roots.collect()
}

/// Bound on the rounding of each coordinate of a patch's evaluated point.
pub(super) fn position_error(patch: &BezierPatch) -> f64 {
    let Extent { magnitude, greatest_weight, least_weight } = patch.extent();
    let ratio = greatest_weight / least_weight;
    if ratio > LARGE_RATIO {
        // sums of w P and of w are of positive terms: their roundings are in parts of themselves, and the weights cancel out
        let places = patch.control_points().map(|point| point.truncate().length() / point.w);
        return 2.0 * gamma(EVAL_OPERATIONS) * places.fold(0.0, f64::max);
    }
    gamma(EVAL_OPERATIONS) * magnitude / least_weight * ratio
}

/// The same with the error of the trim's border, and of a patch that stands for another surface.
pub(crate) fn surface_error(trimmed: &Face) -> f64 {
    position_error(&trimmed.patch) + trimmed.error()
}

/// How far off a root's parameters may be, for the errors of the ray, the surface and its border.
///
/// An error across the ray moves the root by that over the sine of the angle between ray and surface; no farther than
/// [`TANGENT_TOLERANCE`], however, along the surface, or for a ray from far away, whose error grows with the distance, what its
/// square root makes of that.
pub(super) fn tolerance(trimmed: &Face, space: &LocalSpace, st: DVec2, ray: &Ray) -> DVec2 {
    let point = trimmed.patch.eval(st);
    let [m, n] = trimmed.patch.degree();
    let normal = point.dp_ds.cross(point.dp_dt);
    // at a pole it is made of rounding
    let rounding = position_error(&trimmed.patch) * m.max(n) as f64;
    let is_known = normal.length() > rounding * (point.dp_ds.length() + point.dp_dt.length());
    let normal = if is_known { normal } else { DVec3::ZERO };
    let way = ray.direction.normalize();
    let across = DVec2::new(point.dp_dt.cross(way).length(), point.dp_ds.cross(way).length());
    let along = DVec2::new(point.dp_dt.length(), point.dp_ds.length());
    let error = surface_error(trimmed)
        + 4.0 * f64::EPSILON * (ray.origin.abs().element_sum() + trimmed.patch.extent().magnitude);
    let distance = space.point(ray.origin).abs().element_sum();
    let tangent = TANGENT_TOLERANCE * (distance / NEAR_RAYS).max(1.0).sqrt();
    let most = along * (tangent / space.length(1.0)) / normal.length();
    let sensitive = across * (error / normal.dot(way).abs());
    // a patch without normal, and a tangent ray, give NaN or infinity
    let least = |a: f64, b: f64| if a < b { a } else { b };
    let bound = DVec2::new(least(sensitive.x, most.x), least(sensitive.y, most.y));
    let finite = |x: f64| if x < 1.0 { x } else { f64::EPSILON.sqrt() };
    DVec2::new(finite(bound.x), finite(bound.y)) + 4.0 * f64::EPSILON
}

/// The first of some loops that holds a point, else the first within the tolerance; and whether it took that.
fn find_loop(
    trim: &Region,
    loops: impl Iterator<Item = u32> + Clone,
    st: DVec2,
    tolerance: DVec2,
) -> Option<(TrimLoop, bool)> {
    let find = |tolerance| {
        let mut candidates = loops.clone().map(|index| trim.trim_loop(index as usize));
        candidates.find(|trim_loop| trim.holds(trim_loop, st, tolerance))
    };
    find(DVec2::ZERO).map(|found| (found, false)).or_else(|| find(tolerance).map(|found| (found, true)))
}
