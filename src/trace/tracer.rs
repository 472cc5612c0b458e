//! One thread's way to trace rays through a scene.

use crate::math::lanes::with_vectors;

use super::coincident;
use super::geometry::{Geometry, RayTracer};
use super::interaction::SurfaceInteraction;
use super::object::PatchHit;
use super::packet::{self, PACKET};
use super::polish;
use super::query;
use super::ray::Ray;
use super::scene::TracedScene;
use super::scratch::Scratch;
use super::statistics::TraceStatistics;

/// Traces rays through a scene, for one thread: it keeps the buffers of the search from ray to ray, and counts.
///
/// What it has traced before changes no hit.
#[derive(Debug)]
pub struct Tracer<'a> {
    scene: &'a TracedScene,
    scratch: Scratch,
}

impl TracedScene {
    /// A tracer for one thread, whose counts start at zero.
    pub fn tracer(&self) -> Tracer<'_> {
        Tracer { scene: self, scratch: Scratch::default() }
    }

    /// As [`Tracer::closest`], by a tracer of its own: for more than a few rays, keep a [`Self::tracer`].
    pub fn closest(&self, ray: &Ray) -> Option<PatchHit> {
        self.tracer().closest(ray)
    }

    /// As [`Tracer::all`], by a tracer of its own: for more than a few rays, keep a [`Self::tracer`].
    pub fn all(&self, ray: &Ray) -> Vec<PatchHit> {
        self.tracer().all(ray)
    }

    /// As [`Tracer::closest_hit`], by a tracer of its own: for more than a few rays, keep a [`Self::tracer`].
    pub fn closest_hit(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        self.tracer().closest_hit(ray)
    }

    /// As [`Tracer::any`], by a tracer of its own: for more than a few rays, keep a [`Self::tracer`].
    pub fn any_hit(&self, ray: &Ray) -> bool {
        self.tracer().any(ray)
    }
}

impl<'a> Tracer<'a> {
    /// The scene that it traces rays through.
    pub fn scene(&self) -> &'a TracedScene {
        self.scene
    }

    /// What was counted since it was made, or since [`RayTracer::take_statistics`].
    pub fn statistics(&self) -> TraceStatistics {
        self.scratch.solver.statistics
    }

    /// The nearest hit.
    pub fn closest(&mut self, ray: &Ray) -> Option<PatchHit> {
        let Self { scene, scratch } = self;
        let hit = with_vectors!(scene.level(), simd => query::closest(simd, scene, ray, scratch));
        hit.map(|hit| on_surface(scene, hit, ray, &mut scratch.solver.statistics))
    }

    /// All hits, sorted along the ray: at an edge or a vertex one for each patch that has it.
    pub fn all(&mut self, ray: &Ray) -> Vec<PatchHit> {
        let Self { scene, scratch } = self;
        let mut hits = with_vectors!(scene.level(), simd => query::all(simd, scene, ray, scratch));
        for hit in &mut hits {
            *hit = on_surface(scene, *hit, ray, &mut scratch.solver.statistics);
        }
        query::sort(&mut hits);
        coincident::with_others(scene, ray, hits)
    }

    /// As [`Self::all`], but of hits in one place at edges and vertices of faces only the first: one that faces share counts once.
    pub fn all_once(&mut self, ray: &Ray) -> Vec<PatchHit> {
        let hits = self.all(ray);
        coincident::once(self.scene, ray, &hits)
    }

    /// Whether anything is hit at all; stops at the first proof.
    pub fn any(&mut self, ray: &Ray) -> bool {
        let Self { scene, scratch } = self;
        with_vectors!(scene.level(), simd => query::any(simd, scene, ray, scratch))
    }

    /// The nearest hits of rays, the same as by [`Self::closest`] for each.
    ///
    /// Consecutive rays that go close together, as those of neighbouring pixels do, are traced at a fraction of the cost.
    ///
    /// # Panics
    /// If there are not as many places for hits as rays.
    pub fn closest_of_each(&mut self, rays: &[Ray], hits: &mut [Option<PatchHit>]) {
        assert_eq!(rays.len(), hits.len(), "a place for each ray's hit");
        let Self { scene, scratch } = self;
        for chunk in rays.chunks(PACKET).zip(hits.chunks_mut(PACKET)) {
            with_vectors!(scene.level(), simd => packet::closest(simd, scene, chunk, scratch));
        }
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = hit.map(|hit| on_surface(scene, hit, ray, &mut scratch.solver.statistics));
        }
    }

    /// For each ray whether it hits anything, as [`Self::any`] says.
    ///
    /// # Panics
    /// If there are not as many places for answers as rays.
    pub fn any_of_each(&mut self, rays: &[Ray], found: &mut [bool]) {
        assert_eq!(rays.len(), found.len(), "a place for each ray's answer");
        let Self { scene, scratch } = self;
        for chunk in rays.chunks(PACKET).zip(found.chunks_mut(PACKET)) {
            with_vectors!(scene.level(), simd => packet::any(simd, scene, chunk, scratch));
        }
    }
}

/// The hit of a patch that stands for another surface, moved to that surface by Newton's method.
#[inline]
fn on_surface(scene: &TracedScene, hit: PatchHit, ray: &Ray, statistics: &mut TraceStatistics) -> PatchHit {
    let trimmed = scene.trimmed(&hit);
    match &trimmed.exact {
        Some(exact) if !hit.tangent => {
            let point = polish::point(scene.level(), &trimmed.patch, hit.st);
            polish::on_surface(&point, exact.as_ref(), hit, ray, statistics)
        }
        _ => hit,
    }
}

impl Geometry for TracedScene {
    type Tracer<'a> = Tracer<'a>;

    fn tracer(&self) -> Tracer<'_> {
        self.tracer()
    }
}

impl RayTracer for Tracer<'_> {
    fn closest_hit(&mut self, ray: &Ray) -> Option<SurfaceInteraction> {
        self.closest(ray).map(|hit| self.scene.interaction(&hit))
    }

    fn any_hit(&mut self, ray: &Ray) -> bool {
        self.any(ray)
    }

    fn closest_hits(&mut self, rays: &[Ray], hits: &mut Vec<Option<SurfaceInteraction>>) {
        hits.clear();
        let mut found = [None; PACKET];
        for rays in rays.chunks(PACKET) {
            let found = &mut found[..rays.len()];
            self.closest_of_each(rays, found);
            hits.extend(found.iter().map(|hit| hit.map(|hit| self.scene.interaction(&hit))));
        }
    }

    fn any_hits(&mut self, rays: &[Ray], hit: &mut Vec<bool>) {
        hit.clear();
        hit.resize(rays.len(), false);
        self.any_of_each(rays, hit);
    }

    fn take_statistics(&mut self) -> TraceStatistics {
        std::mem::take(&mut self.scratch.solver.statistics)
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::Level;
    use glam::{DVec2, DVec3};

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
            for (number, trimmed) in object.faces().iter().enumerate() {
                let corners = trimmed.region.corners(&trimmed.region.trim_loop(0));
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
                with_vectors!(Level::baseline(), simd => query::closest(simd, &scene, &ray, &mut scratch));
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
            for trimmed in scene.objects()[0].faces() {
                for trim_loop in trimmed.region.loops() {
                    let corners = trimmed.region.corners(&trim_loop);
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
        let mut tracer = scene.tracer();
        let in_face = Ray::new(DVec3::new(-1.0, 0.3, 0.0), DVec3::X);
        let hit = tracer.closest(&in_face).expect("the faces across the ray are hit at their border");
        assert!((hit.t - 1.0).abs() < 1e-12);
        let statistics = tracer.statistics();
        assert!(statistics.in_surface > 0 && statistics.not_converged == 0, "{statistics:?}");
    }
}
