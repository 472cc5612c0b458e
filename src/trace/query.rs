//! The queries of rays, each compiled for several kinds of processor.
//!
//! What is called from here is `#[inline(always)]` down to the vectors, so that all of it is compiled for the processor's
//! vectors. The same Rust code runs whatever their width, and nothing is fused or reordered: the bits are the same.

use fearless_simd::Simd;
use glam::{DVec2, DVec3};

use crate::math::lanes::Vector;
use crate::patch::{OrderWork, PatchPoint, PointLanes};

use super::Ray;
use super::leaf_test::{LocalRays, Roots, Seed, Sides, WorldRays, approach, newton, sides, trimmed_away};
use super::local::LocalRay;
use super::object::PatchHit;
use super::scene::TracedScene;
use super::scratch::{Scratch, Solver};
use super::target::{LeafRoot, Target, clip_leaf};

/// The nearest hit.
#[inline(always)]
pub(super) fn closest<S: Simd>(
    simd: S,
    scene: &TracedScene,
    ray: &Ray,
    scratch: &mut Scratch,
) -> Option<PatchHit> {
    let mut best: Option<PatchHit> = None;
    visit(
        simd,
        scene,
        ray,
        scratch,
        #[inline(always)]
        |hit, t_max| keep_nearer(&mut best, hit, t_max),
    );
    best
}

/// Keeps the nearer hit, at equal distances the first in the scene's order, whatever the traversal's; returns the new
/// greatest `t`.
#[inline(always)]
pub(super) fn keep_nearer(best: &mut Option<PatchHit>, hit: PatchHit, t_max: f64) -> f64 {
    let key = |hit: &PatchHit| (hit.t, hit.object, hit.patch, hit.st.x, hit.st.y);
    if best.as_ref().is_none_or(|best| key(&hit) < key(best)) {
        *best = Some(hit);
    }
    t_max.min(hit.t)
}

/// Every hit, sorted along the ray.
#[inline(always)]
pub(super) fn all<S: Simd>(simd: S, scene: &TracedScene, ray: &Ray, scratch: &mut Scratch) -> Vec<PatchHit> {
    let mut hits: Vec<PatchHit> = Vec::new();
    visit(simd, scene, ray, scratch, |hit, t_max| {
        // leaves of a patch overlap by rounding
        let same = |other: &&mut PatchHit| {
            (other.object, other.patch) == (hit.object, hit.patch)
                && (other.st - hit.st)
                    .abs()
                    .cmple(2.0 * (scene.st_error(&hit, ray) + scene.st_error(other, ray)))
                    .all()
        };
        match hits.iter_mut().find(same) {
            Some(known) if hit.t < known.t => *known = hit,
            Some(_) => {}
            None => hits.push(hit),
        }
        t_max
    });
    sort(&mut hits);
    hits
}

/// Sorts hits along the ray.
pub(super) fn sort(hits: &mut [PatchHit]) {
    hits.sort_by(|a, b| a.t.total_cmp(&b.t).then((a.object, a.patch).cmp(&(b.object, b.patch))));
}

/// Whether there is a hit.
#[inline(always)]
pub(super) fn any<S: Simd>(simd: S, scene: &TracedScene, ray: &Ray, scratch: &mut Scratch) -> bool {
    let mut found = false;
    visit(
        simd,
        scene,
        ray,
        scratch,
        #[inline(always)]
        |_, _| {
            found = true;
            f64::NEG_INFINITY
        },
    );
    found
}

/// Calls `accept` with every hit of the leaves met on the way; it returns the new greatest `t`.
#[inline(always)]
fn visit<S: Simd>(
    simd: S,
    scene: &TracedScene,
    ray: &Ray,
    scratch: &mut Scratch,
    mut accept: impl FnMut(PatchHit, f64) -> f64,
) {
    let Scratch { stack, solver } = scratch;
    solver.statistics.rays += 1;
    solver.search.start_ray();
    let local = scene.space().ray(ray);
    let transformed = TransformedRay { ray, local: &local };
    scene.bvh().traverse(
        simd,
        (&local, [ray.t_min, ray.t_max]),
        stack,
        #[inline(always)]
        |index, t_max| visit_leaf(simd, (scene, index), &transformed, (solver, t_max), &mut accept),
    );
}

/// A ray in the world and in local coordinates.
#[derive(Clone, Copy)]
pub(super) struct TransformedRay<'a> {
    pub(super) ray: &'a Ray,
    pub(super) local: &'a LocalRay,
}

/// One leaf of [`visit`].
#[inline(always)]
pub(super) fn visit_leaf<S: Simd>(
    simd: S,
    (scene, index): (&TracedScene, usize),
    transformed: &TransformedRay<'_>,
    (solver, mut t_max): (&mut Solver, f64),
    accept: &mut impl FnMut(PatchHit, f64) -> f64,
) -> f64 {
    solver.statistics.leaf_tests += 1;
    let ray = transformed.ray;
    let local = LocalRays {
        origin: vector(transformed.local.origin),
        direction: vector(transformed.local.direction),
        rounding: transformed.local.rounding,
        t_min: ray.t_min,
        t_max,
        t_limit: ray.t_max,
    };
    let Some(found) = approach(scene.leaf(index), &local) else { return t_max };
    let target = &scene.target(index);
    let mut undecided = found.undecided;
    if !undecided {
        for seed in found.seeds {
            if !seed.wanted || trimmed_away(target.cuts, &seed) {
                continue;
            }
            let world = WorldRays { origin: vector(ray.origin), direction: vector(ray.direction) };
            let steps = &mut solver.statistics.newton_steps;
            match target.trimmed.patch.with_orders(Seek { simd, target, world, seed: &seed, steps }) {
                SeedOutcome::Outside => {}
                SeedOutcome::Undecided => undecided = true,
                SeedOutcome::Root(root) => {
                    if let Some(hit) = trimmed_hit(target, ray, &root, [ray.t_min, t_max], solver) {
                        t_max = accept(hit, t_max);
                    }
                }
            }
        }
    }
    if undecided { clipped(target, ray, (solver, t_max), accept) } else { t_max }
}

/// What became of a seed.
enum SeedOutcome {
    /// Its root is in the leaf.
    Root(LeafRoot),
    /// Its root is not in the leaf.
    Outside,
    /// Newton's method did not reach it.
    Undecided,
}

/// Newton's method from a seed.
struct Seek<'a, S> {
    simd: S,
    target: &'a Target<'a>,
    world: WorldRays<f64>,
    seed: &'a Seed<f64>,
    steps: &'a mut u64,
}

impl<S: Simd> OrderWork for Seek<'_, S> {
    type Output = SeedOutcome;

    #[inline(always)]
    fn run<const M: usize, const N: usize, const STRIDE: usize>(self) -> SeedOutcome {
        let Self { simd, target, world, seed, steps } = self;
        simd.vectorize(
            #[inline(always)]
            || {
                let patch = &target.trimmed.patch;
                let Roots { found, inside, s, t, ray_t } = newton(
                    target.leaf,
                    &world,
                    seed,
                    #[inline(always)]
                    |[s, t]| point(&patch.eval_one::<M, N, STRIDE, S>(simd, DVec2::new(s, t))),
                    steps,
                );
                if inside {
                    SeedOutcome::Root(LeafRoot { st: DVec2::new(s, t), t: ray_t, tangent: false })
                } else if found {
                    SeedOutcome::Outside
                } else {
                    SeedOutcome::Undecided
                }
            },
        )
    }
}

/// The hit of a root, if it is in the range of the ray and inside the trim.
#[inline(always)]
fn trimmed_hit(
    target: &Target<'_>,
    ray: &Ray,
    root: &LeafRoot,
    [t_min, t_max]: [f64; 2],
    solver: &mut Solver,
) -> Option<PatchHit> {
    if !(root.t > t_min && root.t < ray.t_max && root.t <= t_max) {
        return None;
    }
    let Sides { trim_loop, inside, unclear } = sides(target.leaf, target.cuts, root.st.to_array());
    if inside {
        Some(target.hit(root, trim_loop))
    } else if unclear {
        target.hit_near_border(ray, root, &mut solver.statistics)
    } else {
        solver.statistics.trimmed += 1;
        None
    }
}

/// What Bézier clipping finds in a leaf of which nothing is proved.
#[cold]
#[inline(never)]
fn clipped(
    target: &Target<'_>,
    ray: &Ray,
    (solver, mut t_max): (&mut Solver, f64),
    accept: &mut impl FnMut(PatchHit, f64) -> f64,
) -> f64 {
    for root in clip_leaf(target, ray, solver) {
        if let Some(hit) = trimmed_hit(target, ray, &root, [ray.t_min, t_max], solver) {
            t_max = accept(hit, t_max);
        }
    }
    t_max
}

#[inline(always)]
fn vector(v: DVec3) -> Vector<f64> {
    Vector { x: v.x, y: v.y, z: v.z }
}

#[inline(always)]
fn point(point: &PatchPoint) -> PointLanes<f64> {
    PointLanes { position: vector(point.position), dp_ds: vector(point.dp_ds), dp_dt: vector(point.dp_dt) }
}
