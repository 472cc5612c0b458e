//! Objects ready to trace, and the queries rays ask of them.

use std::cell::RefCell;

use fearless_simd::{Level, dispatch};
use glam::{DVec2, DVec3};

use crate::math::rounding::gamma;
use crate::patch::{BezierPatch, PatchPoint, TrimLoop, TrimRegion, TrimmedPatch};

use super::bvh::{Bvh, Stack};
use super::interaction::{Geometry, SurfaceInteraction};
use super::leaf::{Cover, Cut, Leaf, Leaves, TANGENT_TOLERANCE};
use super::local::LocalSpace;
use super::packet::{self, PACKET};
use super::projection::{AcrossRay, ProjectedNet};
use super::query;
use super::ray::Ray;
use super::search::{SearchScratch, find_roots};
use super::statistics::{AccelerationStatistics, TraceStatistics};

/// Rounded operations of evaluating a patch's point: two passes of at most 13 products and sums, the basis, the
/// division by the weight.
const EVAL_OPERATIONS: u32 = 64;

/// Gives texture coordinates: of a prepared polygon at a point of the undeformed object; NaN where there are none.
pub trait UvLookup: Send + Sync + std::fmt::Debug {
    /// Texture coordinates of `polygon` at `rest`.
    fn uv(&self, polygon: u32, rest: DVec3) -> DVec2;
}

/// The texture coordinates of an object that has none.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoUvs;

impl UvLookup for NoUvs {
    fn uv(&self, _polygon: u32, _rest: DVec3) -> DVec2 {
        DVec2::NAN
    }
}

/// An object as patches.
#[derive(Debug)]
pub struct TracedObject {
    /// Its name in the scene file.
    pub name: String,
    /// Its surface.
    pub patches: Vec<TrimmedPatch>,
    /// Its texture coordinates.
    pub uvs: Box<dyn UvLookup>,
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

/// What the solver needs to know of a patch besides its control points.
#[derive(Clone, Copy, Debug)]
pub(super) struct PatchReference {
    object: u32,
    patch: u32,
    /// Greatest length of (w x, w y, w z).
    magnitude: f64,
    greatest_weight: f64,
    least_weight: f64,
}

/// All objects of a scene in one acceleration structure.
#[derive(Debug)]
pub struct TracedScene {
    objects: Vec<TracedObject>,
    references: Vec<PatchReference>,
    leaves: Vec<Leaf>,
    cuts: Vec<Cut>,
    bvh: Bvh,
    space: LocalSpace,
    /// The processor's vectors.
    level: Level,
}

/// Buffers and counts of one thread.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    pub(super) stack: Stack,
    pub(super) solver: Solver,
}

/// Buffers and counts of the search for roots.
#[derive(Debug, Default)]
pub(super) struct Solver {
    net: ProjectedNet,
    search: SearchScratch,
    pub(super) statistics: TraceStatistics,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

impl TracedScene {
    /// Builds the acceleration structure over all patches.
    pub fn new(objects: Vec<TracedObject>) -> Self {
        let patches = objects.iter().flat_map(|object| &object.patches);
        let hulls = patches.flat_map(|trimmed| trimmed.patch.hull_bounds());
        let all =
            hulls.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)]);
        let space = LocalSpace::around(all);
        let mut references = Vec::new();
        let mut leaves = Leaves::default();
        for (object, traced) in (0..).zip(&objects) {
            for (patch, trimmed) in (0..).zip(&traced.patches) {
                let reference = PatchReference::of(object, patch, trimmed);
                let number = u32::try_from(references.len()).expect("fewer than 2^32 patches fit in memory");
                let error = reference.position_error() + trimmed.boundary_error;
                leaves.add(number, trimmed, error, &space);
                references.push(reference);
            }
        }
        let Leaves { mut leaves, mut cuts, boxes } = leaves;
        let bvh = Bvh::build(&boxes);
        leaves.shrink_to_fit();
        cuts.shrink_to_fit();
        references.shrink_to_fit();
        Self { objects, references, leaves, cuts, bvh, space, level: Level::new() }
    }

    /// The objects.
    pub fn objects(&self) -> &[TracedObject] {
        &self.objects
    }

    /// What the acceleration structure is made of.
    pub fn acceleration(&self) -> AccelerationStatistics {
        let bytes = size_of_val(&*self.leaves) + size_of_val(&*self.cuts) + size_of_val(&*self.references);
        let leaves = self.leaves.len();
        let inside = self.leaves.iter().filter(|leaf| matches!(leaf.cover, Cover::Inside(_))).count();
        AccelerationStatistics {
            leaves,
            leaves_inside: inside,
            leaves_crossed: leaves - inside,
            nodes: self.bvh.nodes(),
            bytes: self.bvh.bytes() + bytes,
        }
    }

    /// Lowest and highest corner of a box around one object's surface; not the tightest.
    pub fn object_bounds(&self, object: usize) -> [DVec3; 2] {
        let points = self.objects[object].patches.iter().flat_map(TrimmedPatch::trimmed_bounds);
        points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
    }

    /// Lowest and highest corner of a box around all objects.
    pub fn bounds(&self) -> [DVec3; 2] {
        (0..self.objects.len())
            .map(|object| self.object_bounds(object))
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], [a, b]| [low.min(a), high.max(b)])
    }

    /// Takes the counts of the calling thread, leaving zeros.
    pub fn take_statistics() -> TraceStatistics {
        SCRATCH.with_borrow_mut(|scratch| std::mem::take(&mut scratch.solver.statistics))
    }

    /// Runs work on the calling thread and gives what it counted; a call around this one counts it too.
    ///
    /// The work must not be shared among threads in turn: each counts for itself.
    pub fn counting<T>(work: impl FnOnce() -> T) -> (T, TraceStatistics) {
        let before = Self::take_statistics();
        let result = work();
        let counted = Self::take_statistics();
        SCRATCH.with_borrow_mut(|scratch| {
            scratch.solver.statistics = before;
            scratch.solver.statistics += counted;
        });
        (result, counted)
    }

    /// The nearest hit.
    pub fn closest(&self, ray: &Ray) -> Option<PatchHit> {
        SCRATCH.with_borrow_mut(
            |scratch| dispatch!(self.level, simd => query::closest(simd, self, ray, scratch)),
        )
    }

    /// All hits, sorted along the ray.
    pub fn all(&self, ray: &Ray) -> Vec<PatchHit> {
        SCRATCH.with_borrow_mut(|scratch| dispatch!(self.level, simd => query::all(simd, self, ray, scratch)))
    }

    /// The nearest hits of rays, the same as by [`Self::closest`] for each.
    ///
    /// Consecutive rays that go close together, as those of neighbouring pixels do, are traced at a fraction of the cost.
    ///
    /// # Panics
    /// If there are not as many places for hits as rays.
    pub fn closest_of_each(&self, rays: &[Ray], hits: &mut [Option<PatchHit>]) {
        assert_eq!(rays.len(), hits.len(), "a place for each ray's hit");
        SCRATCH.with_borrow_mut(|scratch| {
            for chunk in rays.chunks(PACKET).zip(hits.chunks_mut(PACKET)) {
                dispatch!(self.level, simd => packet::closest(simd, self, chunk, scratch));
            }
        });
    }

    /// For each ray whether it hits anything, as [`Geometry::any_hit`] says.
    ///
    /// # Panics
    /// If there are not as many places for answers as rays.
    pub fn any_of_each(&self, rays: &[Ray], found: &mut [bool]) {
        assert_eq!(rays.len(), found.len(), "a place for each ray's answer");
        SCRATCH.with_borrow_mut(|scratch| {
            for chunk in rays.chunks(PACKET).zip(found.chunks_mut(PACKET)) {
                dispatch!(self.level, simd => packet::any(simd, self, chunk, scratch));
            }
        });
    }

    pub(super) fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    pub(super) fn space(&self) -> &LocalSpace {
        &self.space
    }

    #[inline(always)]
    pub(super) fn leaf(&self, index: usize) -> &Leaf {
        &self.leaves[index]
    }

    #[inline(always)]
    pub(super) fn target(&self, leaf: usize) -> Target<'_> {
        let leaf = &self.leaves[leaf];
        let reference = &self.references[leaf.patch as usize];
        let trimmed = &self.objects[reference.object as usize].patches[reference.patch as usize];
        let cuts = match leaf.cover {
            Cover::Inside(_) => &[],
            Cover::Crossed { start, end } => &self.cuts[start as usize..end as usize],
        };
        Target { leaf, cuts, reference, trimmed, space: &self.space }
    }

    fn reference(&self, hit: &PatchHit) -> &PatchReference {
        let first = self.references.partition_point(|r| (r.object, r.patch) < (hit.object, hit.patch));
        &self.references[first]
    }

    /// How far off the parameters of a ray's hit may be, for rounding.
    pub fn st_error(&self, hit: &PatchHit, ray: &Ray) -> DVec2 {
        let reference = self.reference(hit);
        let trimmed = &self.objects[hit.object as usize].patches[hit.patch as usize];
        let target = Target { leaf: &self.leaves[0], cuts: &[], reference, trimmed, space: &self.space };
        target.tolerance(hit.st, ray)
    }

    /// Everything shading needs of a hit.
    pub fn interaction(&self, hit: &PatchHit) -> SurfaceInteraction {
        let object = &self.objects[hit.object as usize];
        let trimmed = &object.patches[hit.patch as usize];
        let point = trimmed.patch.eval(hit.st);
        let rest = trimmed.frame.point(hit.st);
        SurfaceInteraction {
            t: hit.t,
            object: hit.object,
            face: hit.face,
            patch: hit.patch,
            st: hit.st,
            uv: object.uvs.uv(hit.polygon, rest),
            rest,
            position: point.position,
            position_error: self.position_error(hit),
            normal: normal(trimmed, hit.st, &point),
            dp_ds: point.dp_ds,
            dp_dt: point.dp_dt,
        }
    }

    fn position_error(&self, hit: &PatchHit) -> f64 {
        self.reference(hit).position_error()
    }
}

/// A leaf with its patch.
#[derive(Clone, Copy)]
pub(super) struct Target<'a> {
    pub(super) leaf: &'a Leaf,
    pub(super) cuts: &'a [Cut],
    pub(super) reference: &'a PatchReference,
    pub(super) trimmed: &'a TrimmedPatch,
    space: &'a LocalSpace,
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
        let trim_loop = &self.trimmed.trim.loops()[trim_loop as usize];
        self.hit_in_loop(root, trim_loop, false)
    }

    #[inline(always)]
    fn hit_in_loop(&self, root: &LeafRoot, trim_loop: &TrimLoop, on_border: bool) -> PatchHit {
        PatchHit {
            t: root.t,
            object: self.reference.object,
            patch: self.reference.patch,
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
        let tolerance = self.tolerance(root.st, ray);
        let found = match self.leaf.cover {
            Cover::Inside(trim_loop) => {
                find_loop(&self.trimmed.trim, std::iter::once(trim_loop), root.st, tolerance)
            }
            Cover::Crossed { .. } => {
                let loops =
                    self.cuts.chunk_by(|a, b| a.trim_loop == b.trim_loop).map(|cuts| cuts[0].trim_loop);
                find_loop(&self.trimmed.trim, loops, root.st, tolerance)
            }
        };
        let Some((trim_loop, on_border)) = found else {
            statistics.trimmed += 1;
            return None;
        };
        statistics.on_border += u64::from(on_border);
        Some(self.hit_in_loop(root, trim_loop, on_border))
    }

    /// How far off a root's parameters may be, for the errors of the ray, the surface and its border.
    ///
    /// An error across the ray moves the root by that over the sine of the angle between ray and surface; no farther than
    /// [`TANGENT_TOLERANCE`], however, along the surface.
    fn tolerance(&self, st: DVec2, ray: &Ray) -> DVec2 {
        let point = self.trimmed.patch.eval(st);
        let normal = point.dp_ds.cross(point.dp_dt);
        let way = ray.direction.normalize();
        let across = DVec2::new(point.dp_dt.cross(way).length(), point.dp_ds.cross(way).length());
        let along = DVec2::new(point.dp_dt.length(), point.dp_ds.length());
        let error = self.reference.position_error()
            + self.trimmed.boundary_error
            + 4.0 * f64::EPSILON * (ray.origin.abs().element_sum() + self.reference.magnitude);
        let most = along * (TANGENT_TOLERANCE / self.space.length(1.0)) / normal.length();
        let sensitive = across * (error / normal.dot(way).abs());
        // a patch without normal, and a tangent ray, give NaN or infinity
        let least = |a: f64, b: f64| if a < b { a } else { b };
        let bound = DVec2::new(least(sensitive.x, most.x), least(sensitive.y, most.y));
        let finite = |x: f64| if x < 1.0 { x } else { f64::EPSILON.sqrt() };
        DVec2::new(finite(bound.x), finite(bound.y)) + 4.0 * f64::EPSILON
    }
}

/// All roots of a leaf by Bézier clipping, with a last Newton step on the patch.
pub(super) fn clip_leaf(target: &Target<'_>, ray: &Ray, solver: &mut Solver) -> Vec<LeafRoot> {
    let Target { leaf, reference, trimmed, .. } = target;
    let Solver { net, search, statistics } = solver;
    statistics.fallbacks += 1;
    search.roots.clear();
    let across = AcrossRay::new(ray);
    net.project(&trimmed.patch, &across, across.rounding(reference.magnitude, reference.greatest_weight));
    if net.misses() {
        return Vec::new();
    }
    find_roots(net, leaf.rectangle(), search, statistics);
    let roots = search.roots.iter().map(|root| {
        let st = if root.degenerate { root.st } else { polished(&trimmed.patch, ray, root.st) };
        let position = trimmed.patch.eval(st).position;
        let t = (position - ray.origin).dot(ray.direction) / ray.direction.length_squared();
        LeafRoot { st, t, tangent: root.degenerate }
    });
    roots.collect()
}

/// A root after one Newton step on the exact patch, if that brings it nearer to the ray.
fn polished(patch: &BezierPatch, ray: &Ray, st: DVec2) -> DVec2 {
    let across = |st: DVec2| {
        let point = patch.eval(st);
        (point, ray.direction.cross(point.position - ray.origin))
    };
    let (point, off) = across(st);
    let inverse = 1.0 / point.dp_ds.cross(point.dp_dt).dot(ray.direction);
    let next = st + DVec2::new(-point.dp_dt.dot(off), point.dp_ds.dot(off)) * inverse;
    if across(next).1.length_squared() < off.length_squared() { next } else { st }
}

impl PatchReference {
    fn of(object: u32, patch: u32, trimmed: &TrimmedPatch) -> Self {
        let points = trimmed.patch.control_points();
        let weights = points.iter().map(|point| point.w);
        Self {
            object,
            patch,
            magnitude: points.iter().map(|point| point.truncate().length()).fold(0.0, f64::max),
            greatest_weight: weights.clone().fold(0.0, f64::max),
            least_weight: weights.fold(f64::INFINITY, f64::min),
        }
    }

    /// Bound on the rounding of each coordinate of an evaluated point.
    fn position_error(&self) -> f64 {
        gamma(EVAL_OPERATIONS) * self.magnitude / self.least_weight
            * (self.greatest_weight / self.least_weight)
    }
}

/// The first of some loops that holds a point, else the first within the tolerance; and whether it took that.
fn find_loop(
    trim: &TrimRegion,
    loops: impl Iterator<Item = u32> + Clone,
    st: DVec2,
    tolerance: DVec2,
) -> Option<(&TrimLoop, bool)> {
    let find = |tolerance| {
        let mut candidates = loops.clone().map(|index| &trim.loops()[index as usize]);
        candidates.find(|trim_loop| trim.holds(trim_loop, st, tolerance))
    };
    find(DVec2::ZERO).map(|found| (found, false)).or_else(|| find(tolerance).map(|found| (found, true)))
}

/// Unit normal on the side of the face's winding; where the partials are parallel, that of a point close by.
fn normal(trimmed: &TrimmedPatch, st: DVec2, point: &PatchPoint) -> DVec3 {
    let cross = |point: &PatchPoint| {
        let normal = point.dp_ds.cross(point.dp_dt);
        let scale = point.dp_ds.length() * point.dp_dt.length();
        (normal.length() > 16.0 * f64::EPSILON * scale).then(|| normal.normalize())
    };
    // towards the middle of the patch, where a collapsed edge or a cusp has its one-sided limit
    let toward = DVec2::splat(0.5) - st;
    cross(point)
        .or_else(|| {
            [1e-9, 1e-6, 1e-3].into_iter().find_map(|step| cross(&trimmed.patch.eval(st + step * toward)))
        })
        .unwrap_or_else(|| trimmed.frame.s.cross(trimmed.frame.t).normalize_or(DVec3::Z))
}

impl Geometry for TracedScene {
    fn closest_hit(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        self.closest(ray).map(|hit| self.interaction(&hit))
    }

    fn any_hit(&self, ray: &Ray) -> bool {
        SCRATCH.with_borrow_mut(|scratch| dispatch!(self.level, simd => query::any(simd, self, ray, scratch)))
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::Level;

    use super::*;
    use crate::subdivide::FrameChoice;
    use crate::test_support::{Noise, ball_triangles, cube_triangles, deform, random_volume, scene_of};
    use crate::trace::closest_hit_by_subdivision;

    const FRAMES: [FrameChoice; 2] = [FrameChoice::Parallelogram, FrameChoice::Rectangle];

    #[test]
    fn an_undeformed_cube_is_hit_where_arithmetic_says() {
        let scene = scene_of(deform(&cube_triangles(), None, FrameChoice::Parallelogram));
        let ray = Ray::new(DVec3::new(0.3, 0.4, -2.0), DVec3::new(0.0, 0.0, 2.0));
        let hits = scene.all(&ray);
        assert_eq!(hits.iter().map(|h| h.t).collect::<Vec<_>>(), [1.0, 1.5]);
        let hit = scene.closest_hit(&ray).unwrap();
        assert!((hit.position - DVec3::new(0.3, 0.4, 0.0)).length() <= f64::EPSILON, "{}", hit.position);
        assert_eq!(hit.normal, DVec3::NEG_Z);
        assert!(hit.uv.is_nan());
        assert!(scene.any_hit(&ray));
        assert!(!scene.any_hit(&Ray { t_max: 0.99, ..ray }));
        assert!(scene.closest_hit(&Ray { t_min: 1.6, ..ray }).is_none());
    }

    #[test]
    fn planted_roots_are_found() {
        let mut noise = Noise(17);
        for case in 0..60 {
            let degree = [1 + case % 4, 1 + case / 4 % 4, 1 + case / 16 % 4];
            let volume = random_volume(&mut noise, degree, degree.map(|k| k + 2), 0.3, case % 3 == 0);
            let patches = deform(&ball_triangles(), Some(&volume), FRAMES[case % 2]);
            let scene = scene_of(patches);
            let [object] = scene.objects() else { panic!("one object") };
            for (number, trimmed) in object.patches.iter().enumerate() {
                let corners = trimmed.trim.corners(&trimmed.trim.loops()[0]);
                let st = corners.iter().sum::<DVec2>() / corners.len() as f64;
                let target = trimmed.patch.eval(st).position;
                let direction = noise.unit_vector();
                let ray = Ray::new(target - 3.0 * direction, direction);
                let found = scene.all(&ray).into_iter().any(|hit| {
                    hit.patch as usize == number
                        && (hit.st - st).abs().max_element() < 1e-9
                        && (hit.t - 3.0).abs() < 1e-9
                });
                assert!(found, "case {case} degree {degree:?} patch {number} at {st} along {direction}");
            }
        }
    }

    #[test]
    fn closest_hits_agree_with_subdivision() {
        let mut noise = Noise(23);
        for case in 0..8 {
            let degree = [2 + case % 2; 3];
            let volume = random_volume(&mut noise, degree, [5; 3], 0.25, case % 2 == 1);
            let triangles = if case < 4 { cube_triangles() } else { ball_triangles() };
            let scene = scene_of(deform(&triangles, Some(&volume), FRAMES[case / 2 % 2]));
            let mut hits = 0;
            for number in 0..400 {
                let target = DVec3::splat(0.5) + 0.6 * noise.vector();
                let origin = DVec3::splat(0.5) + 2.0 * noise.unit_vector();
                let ray = Ray::new(origin, target - origin);
                let want = closest_hit_by_subdivision(&scene, &ray, 1e-13);
                let got = scene.closest(&ray).map_or(f64::INFINITY, |hit| hit.t);
                assert!(
                    got == want || (got - want).abs() < 1e-11,
                    "case {case} ray {number}: {got}, want {want}"
                );
                hits += usize::from(got.is_finite());
            }
            assert!(hits > 100, "most rays aim at the solid: {hits}");
        }
    }

    #[test]
    fn wide_vectors_give_the_same_bits() {
        let mut noise = Noise(41);
        let volume = random_volume(&mut noise, [2, 3, 2], [5, 5, 6], 0.2, false);
        let scene = scene_of(deform(&ball_triangles(), Some(&volume), FrameChoice::Parallelogram));
        let mut scratch = Scratch::default();
        let mut hits = 0;
        for _ in 0..20_000 {
            let origin = DVec3::splat(0.5) + 2.0 * noise.unit_vector();
            let ray = Ray::new(origin, DVec3::splat(0.5) + noise.vector() - origin);
            let plain =
                dispatch!(Level::baseline(), simd => query::closest(simd, &scene, &ray, &mut scratch));
            let widest = scene.closest(&ray);
            let bits = |hit: Option<PatchHit>| {
                hit.map(|hit| (hit.t.to_bits(), hit.st.to_array().map(f64::to_bits), hit.patch))
            };
            assert_eq!(bits(plain), bits(widest));
            hits += usize::from(plain.is_some());
        }
        assert!(hits > 5000, "{hits}");
    }

    #[test]
    fn rays_from_inside_never_leak() {
        let mut noise = Noise(31);
        let volume = random_volume(&mut noise, [2, 3, 2], [5, 5, 6], 0.1, false);
        for triangles in [cube_triangles(), ball_triangles()] {
            let scene = scene_of(deform(&triangles, Some(&volume), FrameChoice::Parallelogram));
            let inside = volume.eval(DVec3::splat(0.5)).unwrap().position;
            for number in 0..20_000 {
                let ray = Ray::new(inside, noise.unit_vector());
                assert!(scene.any_hit(&ray), "ray {number} along {}", ray.direction);
            }
            // straight at the corners of trims: vertices, cut points, and points of shared edges
            for trimmed in &scene.objects()[0].patches {
                for trim_loop in trimmed.trim.loops() {
                    let corners = trimmed.trim.corners(trim_loop);
                    for (i, &a) in corners.iter().enumerate() {
                        let b = corners[(i + 1) % corners.len()];
                        for part in [0.0, 0.5, 0.123] {
                            let target = trimmed.patch.eval(a.lerp(b, part)).position;
                            let ray = Ray::new(inside, target - inside);
                            assert!(scene.any_hit(&ray), "aimed at {target}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn rays_in_a_face_and_along_edges_end_and_are_counted() {
        let scene = scene_of(deform(&cube_triangles(), None, FrameChoice::Parallelogram));
        TracedScene::take_statistics();
        let in_face = Ray::new(DVec3::new(-1.0, 0.3, 0.0), DVec3::X);
        let hit = scene.closest(&in_face).expect("the faces across the ray are hit at their border");
        assert!((hit.t - 1.0).abs() < 1e-12);
        let statistics = TracedScene::take_statistics();
        assert!(statistics.in_surface > 0 && statistics.not_converged == 0, "{statistics:?}");
    }
}
