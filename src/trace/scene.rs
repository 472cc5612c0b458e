//! Objects ready to trace, and the queries rays ask of them.

use std::cell::RefCell;

use fearless_simd::{Level, dispatch};
use glam::{DVec2, DVec3};

use crate::math::bounds;
use crate::patch::{PatchPoint, TrimmedPatch};
use crate::spline::KnotBox;

use super::bvh::{Bvh, Stack};
use super::interaction::{Geometry, SurfaceInteraction};
use super::leaf::{Cover, Cut, Leaf, Leaves};
use super::local::LocalSpace;
use super::packet::{self, PACKET};
use super::polish;
use super::projection::ProjectedNet;
use super::query;
use super::ray::Ray;
use super::search::SearchScratch;
use super::statistics::{AccelerationStatistics, TraceStatistics};
use super::target::{Target, position_error, surface_error, tolerance};

/// Gives what the corners of a mesh say of the points between them.
pub trait VertexAttributes: Send + Sync + std::fmt::Debug {
    /// Texture coordinates of `polygon` (a prepared one) at a point of the undeformed object; NaN where there are none.
    fn uv(&self, polygon: u32, rest: DVec3) -> DVec2;

    /// Gradients of both texture coordinates over the undeformed polygon.
    fn uv_gradients(&self, polygon: u32, rest: DVec3) -> Option<[DVec3; 2]>;

    /// A unit normal for shading, in the deformed space, if it is not the surface's own; `knot_box` is the knot box of the
    /// point, if it is in the lattice.
    fn normal(&self, polygon: u32, rest: DVec3, knot_box: Option<KnotBox>) -> Option<DVec3>;

    /// The place on the undeformed object of a point in a patch's frame: the point itself, unless the patches are made of
    /// polygons that were deformed before.
    fn rest(&self, _polygon: u32, place: DVec3) -> DVec3 {
        place
    }

    /// Calls `visit` with all numbers that decide what is looked up, besides the patches.
    fn each_number(&self, _visit: &mut dyn FnMut(f64)) {}
}

/// The attributes of an object whose mesh has none.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoAttributes;

impl VertexAttributes for NoAttributes {
    fn uv(&self, _polygon: u32, _rest: DVec3) -> DVec2 {
        DVec2::NAN
    }

    fn uv_gradients(&self, _polygon: u32, _rest: DVec3) -> Option<[DVec3; 2]> {
        None
    }

    fn normal(&self, _polygon: u32, _rest: DVec3, _knot_box: Option<KnotBox>) -> Option<DVec3> {
        None
    }
}

/// An object as patches.
#[derive(Debug)]
pub struct TracedObject {
    /// Its name in the scene file.
    pub name: String,
    /// Its surface.
    pub patches: Vec<TrimmedPatch>,
    /// Its texture coordinates and normals for shading.
    pub attributes: Box<dyn VertexAttributes>,
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

/// All objects of a scene in one acceleration structure.
#[derive(Debug)]
pub struct TracedScene {
    objects: Vec<TracedObject>,
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
    pub(super) net: ProjectedNet,
    pub(super) search: SearchScratch,
    pub(super) statistics: TraceStatistics,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

impl TracedScene {
    /// Builds the acceleration structure over all patches.
    pub fn new(objects: Vec<TracedObject>) -> Self {
        let patches = objects.iter().flat_map(|object| &object.patches);
        let all = bounds::around(patches.flat_map(|trimmed| trimmed.patch.hull_bounds()));
        let space = LocalSpace::around(all);
        let mut leaves = Leaves::default();
        for (object, traced) in (0..).zip(&objects) {
            for (patch, trimmed) in (0..).zip(&traced.patches) {
                leaves.add([object, patch], trimmed, surface_error(trimmed), &space);
            }
        }
        let Leaves { mut leaves, mut cuts, boxes } = leaves;
        let bvh = Bvh::build(&boxes);
        leaves.shrink_to_fit();
        cuts.shrink_to_fit();
        Self { objects, leaves, cuts, bvh, space, level: Level::new() }
    }

    /// The objects.
    pub fn objects(&self) -> &[TracedObject] {
        &self.objects
    }

    /// What the acceleration structure is made of.
    pub fn acceleration(&self) -> AccelerationStatistics {
        let bytes = size_of_val(&*self.leaves) + size_of_val(&*self.cuts);
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
        bounds::around(self.objects[object].patches.iter().flat_map(TrimmedPatch::trimmed_bounds))
    }

    /// Lowest and highest corner of a box around all objects.
    pub fn bounds(&self) -> [DVec3; 2] {
        bounds::around((0..self.objects.len()).flat_map(|object| self.object_bounds(object)))
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
        SCRATCH.with_borrow_mut(|scratch| {
            let hit = dispatch!(self.level, simd => query::closest(simd, self, ray, scratch));
            hit.map(|hit| self.on_surface(hit, ray, &mut scratch.solver.statistics))
        })
    }

    /// All hits, sorted along the ray.
    pub fn all(&self, ray: &Ray) -> Vec<PatchHit> {
        SCRATCH.with_borrow_mut(|scratch| {
            let mut hits = dispatch!(self.level, simd => query::all(simd, self, ray, scratch));
            for hit in &mut hits {
                *hit = self.on_surface(*hit, ray, &mut scratch.solver.statistics);
            }
            query::sort(&mut hits);
            hits
        })
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
            for (ray, hit) in rays.iter().zip(hits) {
                *hit = hit.map(|hit| self.on_surface(hit, ray, &mut scratch.solver.statistics));
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
        let trimmed = &self.objects[leaf.object as usize].patches[leaf.patch as usize];
        let cuts = match leaf.cover {
            Cover::Inside(_) => &[],
            Cover::Crossed { start, end } => &self.cuts[start as usize..end as usize],
        };
        Target { leaf, cuts, trimmed, space: &self.space }
    }

    /// The hit of a patch that stands for another surface, moved to that surface by Newton's method.
    #[inline]
    fn on_surface(&self, hit: PatchHit, ray: &Ray, statistics: &mut TraceStatistics) -> PatchHit {
        let trimmed = &self.objects[hit.object as usize].patches[hit.patch as usize];
        match &trimmed.exact {
            Some(exact) if !hit.tangent => {
                let point = polish::point(self.level, &trimmed.patch, hit.st);
                polish::on_surface(&point, exact.as_ref(), hit, ray, statistics)
            }
            _ => hit,
        }
    }

    /// How far off the parameters of a ray's hit may be, for rounding.
    pub fn st_error(&self, hit: &PatchHit, ray: &Ray) -> DVec2 {
        let trimmed = &self.objects[hit.object as usize].patches[hit.patch as usize];
        tolerance(trimmed, &self.space, hit.st, ray)
    }

    /// Everything shading needs of a hit.
    pub fn interaction(&self, hit: &PatchHit) -> SurfaceInteraction {
        let object = &self.objects[hit.object as usize];
        let trimmed = &object.patches[hit.patch as usize];
        let point = trimmed.eval(hit.st);
        let rest = trimmed.frame.point(hit.st);
        let normal = normal(trimmed, hit.st, &point);
        SurfaceInteraction {
            t: hit.t,
            object: hit.object,
            face: hit.face,
            patch: hit.patch,
            st: hit.st,
            uv: object.attributes.uv(hit.polygon, rest),
            rest: object.attributes.rest(hit.polygon, rest),
            position: point.position,
            position_error: position_error(&trimmed.patch)
                + trimmed.exact.as_ref().map_or(0.0, |exact| exact.error()),
            normal,
            shading_normal: object.attributes.normal(hit.polygon, rest, trimmed.knot_box()).unwrap_or(normal),
            dp_du: object
                .attributes
                .uv_gradients(hit.polygon, rest)
                .map_or(DVec3::NAN, |gradients| along_u(gradients, trimmed, &point)),
            dp_ds: point.dp_ds,
            dp_dt: point.dp_dt,
        }
    }
}

/// Partial derivative of the position by the texture coordinate u, v fixed.
fn along_u(gradients: [DVec3; 2], trimmed: &TrimmedPatch, point: &PatchPoint) -> DVec3 {
    let [u, v] = gradients.map(|gradient| [gradient.dot(trimmed.frame.s), gradient.dot(trimmed.frame.t)]);
    (point.dp_ds * v[1] - point.dp_dt * v[0]) / (u[0] * v[1] - u[1] * v[0])
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
        .or_else(|| [1e-9, 1e-6, 1e-3].into_iter().find_map(|step| cross(&trimmed.eval(st + step * toward))))
        .unwrap_or_else(|| trimmed.frame.s.cross(trimmed.frame.t).normalize_or(DVec3::Z))
}

impl Geometry for TracedScene {
    fn closest_hit(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        self.closest(ray).map(|hit| self.interaction(&hit))
    }

    fn any_hit(&self, ray: &Ray) -> bool {
        SCRATCH.with_borrow_mut(|scratch| dispatch!(self.level, simd => query::any(simd, self, ray, scratch)))
    }

    fn closest_hits(&self, rays: &[Ray], hits: &mut Vec<Option<SurfaceInteraction>>) {
        hits.clear();
        let mut found = [None; PACKET];
        for rays in rays.chunks(PACKET) {
            let found = &mut found[..rays.len()];
            self.closest_of_each(rays, found);
            hits.extend(found.iter().map(|hit| hit.map(|hit| self.interaction(&hit))));
        }
    }

    fn any_hits(&self, rays: &[Ray], hit: &mut Vec<bool>) {
        hit.clear();
        hit.resize(rays.len(), false);
        self.any_of_each(rays, hit);
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
