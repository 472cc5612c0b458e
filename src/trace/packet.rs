//! Rays traced together: those of a packet go through the tree as one and are told apart at the leaves.
//!
//! A ray finds the same hit as alone, to the bit: the leaves' tests are the same code in each lane, and the tree only
//! leaves out boxes that no ray of the packet enters.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x8};
use glam::DVec2;

use crate::math::lanes::{LANES, Real, Truth, Vector};
use crate::patch::OrderWork;

use super::Ray;
use super::bvh::PacketSlabs;
use super::leaf::{Cover, Leaf};
use super::leaf_test::{
    Approach, LocalRays, Roots, Seed, Sides, WorldRays, approach, newton, sides, trimmed_away,
};
use super::local::{LocalRay, LocalSpace};
use super::query;
use super::scene::{LeafRoot, PatchHit, Scratch, Solver, Target, TracedScene};

/// Halves of a packet: as many lanes as there are vector registers to spare, twice.
const HALVES: usize = 2;

/// Rays in a packet.
pub(super) const PACKET: usize = HALVES * LANES;

/// What is asked of the rays of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Question {
    /// The nearest hit.
    Closest,
    /// Any hit at all: the first one found.
    Any,
}

/// The nearest hits of up to [`PACKET`] rays.
#[inline(always)]
pub(super) fn closest<S: Simd>(
    simd: S,
    scene: &TracedScene,
    (rays, hits): (&[Ray], &mut [Option<PatchHit>]),
    scratch: &mut Scratch,
) {
    let Some(slabs) = coherent(simd, scene.space(), rays) else {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = query::closest(simd, scene, ray, scratch);
        }
        return;
    };
    let packet = trace(simd, scene, (rays, slabs), scratch, Question::Closest);
    for (lane, hit) in hits.iter_mut().enumerate() {
        *hit = packet.hit(scene, lane);
    }
}

/// Which of up to [`PACKET`] rays hit anything.
#[inline(always)]
pub(super) fn any<S: Simd>(
    simd: S,
    scene: &TracedScene,
    (rays, found): (&[Ray], &mut [bool]),
    scratch: &mut Scratch,
) {
    let Some(slabs) = coherent(simd, scene.space(), rays) else {
        for (ray, found) in rays.iter().zip(found) {
            *found = query::any(simd, scene, ray, scratch);
        }
        return;
    };
    let packet = trace(simd, scene, (rays, slabs), scratch, Question::Any);
    for (lane, found) in found.iter_mut().enumerate() {
        let Half { best, .. } = &packet.halves[lane / LANES];
        *found = best.t[lane % LANES] < f64::INFINITY;
    }
}

/// Slabs for rays that are close enough together to be worth tracing as one.
#[inline(always)]
fn coherent<S: Simd>(simd: S, space: &LocalSpace, rays: &[Ray]) -> Option<PacketSlabs<S>> {
    // a few lanes are not worth the work for all
    if rays.len() < PACKET / 4 {
        return None;
    }
    PacketSlabs::new(
        simd,
        rays.iter().map(
            #[inline(always)]
            |ray| (space.ray(ray), [ray.t_min, ray.t_max]),
        ),
    )
}

/// Half a packet.
struct Half<S: Simd> {
    local: LocalRays<f64x8<S>>,
    world: WorldRays<f64x8<S>>,
    best: Best<S>,
}

/// The best hit of each lane so far.
struct Best<S: Simd> {
    /// Infinity if there is none.
    t: f64x8<S>,
    st: [f64x8<S>; 2],
    leaf: f64x8<S>,
    /// The patch's number, which decides between equal distances.
    patch: f64x8<S>,
    trim_loop: f64x8<S>,
}

/// A packet and what it has hit.
struct Packet<S: Simd> {
    halves: [Half<S>; HALVES],
    /// Hits that were found for one ray apart, while they are the best of their lane.
    apart: [Option<PatchHit>; PACKET],
}

#[inline(always)]
fn trace<S: Simd>(
    simd: S,
    scene: &TracedScene,
    (rays, slabs): (&[Ray], PacketSlabs<S>),
    scratch: &mut Scratch,
    question: Question,
) -> Packet<S> {
    let Scratch { stack, solver } = scratch;
    solver.statistics.rays += rays.len() as u64;
    let mut packet = Packet::new(simd, scene.space(), rays);
    scene.bvh().traverse_packet(
        &slabs,
        stack,
        #[inline(always)]
        |index| {
            let target = scene.target(index);
            for half in 0..HALVES {
                packet.visit_leaf(simd, (index, &target), (rays, half), solver, question);
            }
            packet.halves[0].local.t_max.greater(packet.halves[1].local.t_max)
        },
    );
    packet
}

impl<S: Simd> Packet<S> {
    #[inline(always)]
    fn new(simd: S, space: &LocalSpace, rays: &[Ray]) -> Self {
        let half = |half: usize| Half::new(simd, space, &rays[(half * LANES).min(rays.len())..]);
        Self { halves: [half(0), half(1)], apart: [None; PACKET] }
    }

    #[inline(always)]
    fn visit_leaf(
        &mut self,
        simd: S,
        (index, target): (usize, &Target<'_>),
        (rays, half): (&[Ray], usize),
        solver: &mut Solver,
        question: Question,
    ) {
        let Half { local, world, best } = &mut self.halves[half];
        let Some(Approach { undecided, seeds }) = approach(target.leaf, local) else { return };
        solver.statistics.leaf_tests += LANES as u64;
        let mut apart = undecided;
        for mut seed in seeds {
            seed.wanted = seed.wanted & !apart & !trimmed_away(target.leaf, target.cuts, &seed);
            if !seed.wanted.any() {
                continue;
            }
            let steps = &mut solver.statistics.newton_steps;
            let roots = target.trimmed.patch.with_orders(Seek { simd, target, world, seed: &seed, steps });
            apart = apart | (seed.wanted & !roots.found);
            let t = roots.ray_t;
            let number = t.all(f64::from(target.leaf.patch));
            let nearer = t.lt(best.t) | (t.le(best.t) & number.lt(best.patch));
            let hit = roots.inside & nearer & local.t_min.lt(t) & t.lt(local.t_limit);
            if !hit.any() {
                continue;
            }
            let (trim_loop, hit) = match target.leaf.cover {
                Cover::Inside(trim_loop) => (t.all(f64::from(trim_loop)), hit),
                Cover::Crossed { .. } => {
                    let Sides { trim_loop, inside, unclear } =
                        sides(target.leaf, target.cuts, [roots.s, roots.t]);
                    apart = apart | (hit & unclear);
                    solver.statistics.trimmed += (hit & !inside & !unclear).count();
                    (trim_loop, hit & inside)
                }
            };
            best.take(hit, [t, roots.s, roots.t], [t.all(index as f64), number, trim_loop]);
            clear(&mut self.apart[half * LANES..], hit.to_bitmask());
        }
        if apart.any() {
            self.ask_apart((index, target), (rays, half, apart.to_bitmask()), solver);
        }
        let Half { local, best, .. } = &mut self.halves[half];
        local.t_max = match question {
            Question::Closest => local.t_max.lesser(best.t),
            Question::Any => {
                let found = best.t.lt(best.t.all(f64::INFINITY));
                f64x8::select(found, best.t.all(f64::NEG_INFINITY), local.t_max)
            }
        };
    }

    /// Lanes that the leaf's bounds or single precision cannot decide, one at a time.
    #[cold]
    #[inline(never)]
    fn ask_apart(
        &mut self,
        (index, target): (usize, &Target<'_>),
        (rays, half, mut lanes): (&[Ray], usize, u64),
        solver: &mut Solver,
    ) {
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let best = &mut self.halves[half].best;
            let ray = &rays[half * LANES + lane];
            query::clipped(target, ray, (solver, best.t[lane]), &mut |hit, t_max| {
                let number = f64::from(target.leaf.patch);
                if hit.t < t_max || (hit.t == t_max && number < best.patch[lane]) {
                    best.t[lane] = hit.t;
                    best.patch[lane] = number;
                    best.leaf[lane] = index as f64;
                    self.apart[half * LANES + lane] = Some(hit);
                }
                t_max.min(hit.t)
            });
        }
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "indices of 32 bits, kept as they are")]
    #[inline(always)]
    fn hit(&self, scene: &TracedScene, lane: usize) -> Option<PatchHit> {
        let Half { best, .. } = &self.halves[lane / LANES];
        let at = lane % LANES;
        if best.t[at] == f64::INFINITY {
            return None;
        }
        if let Some(hit) = self.apart[lane] {
            return Some(hit);
        }
        let root = LeafRoot { st: DVec2::new(best.st[0][at], best.st[1][at]), t: best.t[at], clipped: None };
        Some(scene.target(best.leaf[at] as usize).hit(&root, best.trim_loop[at] as u32))
    }
}

/// Newton's method from seeds.
struct Seek<'a, S: Simd> {
    simd: S,
    target: &'a Target<'a>,
    world: &'a WorldRays<f64x8<S>>,
    seed: &'a Seed<f64x8<S>>,
    steps: &'a mut u64,
}

impl<S: Simd> OrderWork for Seek<'_, S> {
    type Output = Roots<f64x8<S>>;

    #[inline(always)]
    fn run<const M: usize, const N: usize>(self) -> Roots<f64x8<S>> {
        let Self { simd, target, world, seed, steps } = self;
        simd.vectorize(
            #[inline(always)]
            || {
                let patch = &target.trimmed.patch;
                newton(
                    target.leaf,
                    world,
                    seed,
                    #[inline(always)]
                    |st| patch.eval_lanes::<M, N, S>(simd, st),
                    steps,
                )
            },
        )
    }
}

impl<S: Simd> Half<S> {
    /// Of the first [`LANES`] rays; lanes without a ray never hit.
    #[inline(always)]
    fn new(simd: S, space: &LocalSpace, rays: &[Ray]) -> Self {
        let count = rays.len().min(LANES);
        let mut numbers = [[0.0; LANES]; 15];
        for lane in 0..LANES {
            let Some(ray) = rays.get(lane.min(count.saturating_sub(1))) else { break };
            let LocalRay { origin, direction, rounding } = space.ray(ray);
            let [t_min, t_max] = if lane < count { [ray.t_min, ray.t_max] } else { [0.0, f64::NEG_INFINITY] };
            let vectors = [ray.origin, ray.direction, origin, direction].map(|v| v.to_array());
            for (row, &number) in
                numbers.iter_mut().zip(vectors.as_flattened().iter().chain(&[rounding, t_min, t_max]))
            {
                row[lane] = number;
            }
        }
        if count == 0 {
            numbers[14] = [f64::NEG_INFINITY; LANES];
        }
        let row = |index: usize| -> f64x8<S> { numbers[index].simd_into(simd) };
        let vector = |first: usize| Vector::new(row(first), row(first + 1), row(first + 2));
        let zero = f64x8::splat(simd, 0.0);
        let infinity = f64x8::splat(simd, f64::INFINITY);
        Self {
            world: WorldRays { origin: vector(0), direction: vector(3) },
            local: LocalRays {
                origin: vector(6),
                direction: vector(9),
                rounding: row(12),
                t_min: row(13),
                t_max: row(14),
                t_limit: row(14),
            },
            best: Best { t: infinity, st: [zero; 2], leaf: zero, patch: infinity, trim_loop: zero },
        }
    }
}

impl<S: Simd> Best<S> {
    #[inline(always)]
    fn take(
        &mut self,
        hit: <f64x8<S> as Real>::Truth,
        [t, s, t_of_patch]: [f64x8<S>; 3],
        [leaf, patch, trim_loop]: [f64x8<S>; 3],
    ) {
        let take = |new, old| f64x8::select(hit, new, old);
        self.t = take(t, self.t);
        self.st = [take(s, self.st[0]), take(t_of_patch, self.st[1])];
        self.leaf = take(leaf, self.leaf);
        self.patch = take(patch, self.patch);
        self.trim_loop = take(trim_loop, self.trim_loop);
    }
}

/// Forgets the hits of the lanes whose bits are set.
#[inline(always)]
fn clear(apart: &mut [Option<PatchHit>], lanes: u64) {
    for (lane, hit) in apart.iter_mut().enumerate().take(LANES) {
        if hit.is_some() && lanes >> lane & 1 == 1 {
            *hit = None;
        }
    }
}

const _: () = assert!(size_of::<Leaf>() <= 192, "a leaf is to fit three cache lines");
