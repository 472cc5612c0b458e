//! Rays traced together: those of a packet go through the tree as one and are tested each at the leaves.
//!
//! A ray finds the same hit as alone, to the bit: the leaves' tests are the same code in each lane, and the tree only
//! leaves out boxes that no ray of the packet enters.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x8};
use glam::DVec2;

use crate::math::lanes::{LANES, Real, Truth, Vector};
use crate::patch::OrderWork;

use super::Ray;
use super::leaf::Leaf;
use super::leaf_test::{
    Approach, LocalRays, Roots, Seed, Sides, WorldRays, approach, newton, sides, trimmed_away,
};
use super::local::LocalSpace;
use super::object::PatchHit;
use super::query::{self, TransformedRay};
use super::scene::TracedScene;
use super::scratch::{Scratch, Solver};
use super::search::MOST_RAYS;
use super::slabs::{PacketSlabs, SpreadSlabs};
use super::target::{LeafRoot, Target};

/// Halves of a packet: as many lanes as there are vector registers to spare, twice.
const HALVES: usize = 2;

/// Rays in a packet.
pub(super) const PACKET: usize = HALVES * LANES;

const _: () = assert!(PACKET <= MOST_RAYS, "the search knows each ray of a packet");

/// Rays whose origins are within this part of the scene's size are traced as one whatever their directions: for those that
/// bounce off neighbouring points it takes a third less time, for those that start anywhere twice as much.
const TOGETHER: f64 = 0.05;

/// Leaves that a packet visits before its rays are traced alone after all: where leaves are smaller than the beam, they meet
/// many that single rays do not. As many visits take about as long as the rays alone.
const MAX_VISITS: usize = 64;

/// Which hits of a packet's rays are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum QueryKind {
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
    let Some(packet) = trace(simd, scene, rays, scratch, QueryKind::Closest) else {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = query::closest(simd, scene, ray, scratch);
        }
        return;
    };
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
    let Some(packet) = trace(simd, scene, rays, scratch, QueryKind::Any) else {
        for (ray, found) in rays.iter().zip(found) {
            *found = query::any(simd, scene, ray, scratch);
        }
        return;
    };
    for (lane, found) in found.iter_mut().enumerate() {
        let Half { best, .. } = &packet.halves[lane / LANES];
        *found = best.t[lane % LANES] < f64::INFINITY;
    }
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

/// `None` if the rays are too few or too different to be traced as one, or meet too many leaves.
#[inline(always)]
fn trace<S: Simd>(
    simd: S,
    scene: &TracedScene,
    rays: &[Ray],
    scratch: &mut Scratch,
    kind: QueryKind,
) -> Option<Packet<S>> {
    // a few lanes are not worth the work for all
    if rays.len() < PACKET / 4 {
        return None;
    }
    let halves = [Half::new(simd, scene.space(), (rays, 0)), Half::new(simd, scene.space(), (rays, LANES))];
    let together = PacketSlabs::new(simd, [&halves[0].local, &halves[1].local]);
    if together.is_none() && !start_together(&halves) {
        return None;
    }
    let mut packet = Packet { halves, apart: [None; PACKET] };
    let Scratch { stack, solver } = scratch;
    solver.search.start_packet();
    let mut visits = 0;
    if let Some(slabs) = together {
        scene.bvh().traverse_packet(
            &slabs,
            stack,
            #[inline(always)]
            |index| {
                visits += 1;
                if visits > MAX_VISITS {
                    return f64x8::splat(simd, f64::NEG_INFINITY);
                }
                for half in 0..HALVES {
                    packet.visit_leaf(simd, (scene, index), (rays, half), solver, kind);
                }
                packet.halves[0].local.t_max.greater(packet.halves[1].local.t_max)
            },
        );
    } else {
        let slabs = SpreadSlabs::new(simd, [&packet.halves[0].local, &packet.halves[1].local]);
        let far = slabs.distances([packet.halves[0].local.t_max, packet.halves[1].local.t_max]);
        scene.bvh().traverse_spread(
            &slabs,
            far,
            stack,
            #[inline(always)]
            |index, entered| {
                visits += 1;
                if visits > MAX_VISITS {
                    let nowhere = f64x8::splat(simd, f64::NEG_INFINITY);
                    return Some(slabs.distances([nowhere, nowhere]));
                }
                let mut changed = false;
                for half in 0..HALVES {
                    if entered >> (half * LANES) & 0xff != 0 {
                        changed |= packet.visit_leaf(simd, (scene, index), (rays, half), solver, kind);
                    }
                }
                changed.then(|| slabs.distances([packet.halves[0].local.t_max, packet.halves[1].local.t_max]))
            },
        );
    }
    if visits > MAX_VISITS {
        return None;
    }
    solver.statistics.rays += rays.len() as u64;
    Some(packet)
}

/// Whether rays start close enough together to have the first boxes in common.
#[inline(always)]
fn start_together<S: Simd>([a, b]: &[Half<S>; HALVES]) -> bool {
    let extent = |p: f64x8<S>, q: f64x8<S>| p.greater(q).reduce_max() - p.lesser(q).reduce_min();
    let (a, b) = (&a.local.origin, &b.local.origin);
    extent(a.x, b.x).max(extent(a.y, b.y)).max(extent(a.z, b.z)) <= TOGETHER
}

impl<S: Simd> Packet<S> {
    /// Whether it hit anything.
    #[inline(always)]
    fn visit_leaf(
        &mut self,
        simd: S,
        (scene, index): (&TracedScene, usize),
        (rays, half): (&[Ray], usize),
        solver: &mut Solver,
        kind: QueryKind,
    ) -> bool {
        let Half { local, world, best } = &mut self.halves[half];
        solver.statistics.leaf_tests += LANES as u64;
        let Some(Approach { undecided, seeds }) = approach(scene.leaf(index), local) else { return false };
        let target = &scene.target(index);
        let mut apart = undecided;
        let mut changed = false;
        for mut seed in seeds {
            seed.wanted = seed.wanted & !apart & !trimmed_away(target.cuts, &seed);
            if !seed.wanted.any() {
                continue;
            }
            let steps = &mut solver.statistics.newton_steps;
            let roots = target.trimmed.patch.with_orders(Seek { simd, target, world, seed: &seed, steps });
            apart |= seed.wanted & !roots.found;
            let t = roots.ray_t;
            let number = t.all(number_of(target.leaf));
            let nearer = best.is_preceded_by([t, number, roots.s, roots.t]);
            let hit = roots.inside & nearer & local.t_min.lt(t) & t.lt(local.t_limit);
            if !hit.any() {
                continue;
            }
            let Sides { trim_loop, inside, unclear } = sides(target.leaf, target.cuts, [roots.s, roots.t]);
            apart |= hit & unclear;
            solver.statistics.trimmed += (hit & !inside & !unclear).count();
            let hit = hit & inside;
            changed = true;
            best.take(hit, [t, roots.s, roots.t], [t.all(index as f64), number, trim_loop]);
            clear(&mut self.apart[half * LANES..], hit.to_bitmask());
        }
        if apart.any() {
            changed = true;
            self.test_alone(simd, (scene, index), (rays, half, apart.to_bitmask()), solver);
        }
        let Half { local, best, .. } = &mut self.halves[half];
        local.t_max = match kind {
            QueryKind::Closest => local.t_max.lesser(best.t),
            QueryKind::Any => {
                let found = best.t.lt(best.t.all(f64::INFINITY));
                f64x8::select(found, best.t.all(f64::NEG_INFINITY), local.t_max)
            }
        };
        changed
    }

    /// Lanes that the leaf's bounds or single precision cannot decide, each as a ray alone.
    #[cold]
    #[inline(never)]
    fn test_alone(
        &mut self,
        simd: S,
        (scene, index): (&TracedScene, usize),
        (rays, half, mut lanes): (&[Ray], usize, u64),
        solver: &mut Solver,
    ) {
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let ray = &rays[half * LANES + lane];
            solver.search.take_ray(half * LANES + lane);
            let before = self.hit(scene, half * LANES + lane);
            let t_max = before.map_or(ray.t_max, |hit| hit.t);
            let mut best = before;
            let mut accept = |hit: PatchHit, t_max: f64| query::keep_nearer(&mut best, hit, t_max);
            let transformed = TransformedRay { ray, local: &scene.space().ray(ray) };
            simd.vectorize(
                #[inline(always)]
                || query::visit_leaf(simd, (scene, index), &transformed, (solver, t_max), &mut accept),
            );
            if let Some(hit) = best.filter(|_| best != before) {
                let lanes = &mut self.halves[half].best;
                lanes.t[lane] = hit.t;
                lanes.patch[lane] = number_of(scene.leaf(index));
                (lanes.st[0][lane], lanes.st[1][lane]) = (hit.st.x, hit.st.y);
                lanes.leaf[lane] = index as f64;
                self.apart[half * LANES + lane] = Some(hit);
            }
        }
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "indices of 32 bits, kept as they are"
    )]
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
        let root = LeafRoot { st: DVec2::new(best.st[0][at], best.st[1][at]), t: best.t[at], tangent: false };
        Some(scene.target(best.leaf[at] as usize).hit(&root, best.trim_loop[at]))
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
    fn run<const M: usize, const N: usize, const STRIDE: usize>(self) -> Roots<f64x8<S>> {
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
                    |st| patch.eval_lanes::<M, N, STRIDE, S>(simd, st),
                    steps,
                )
            },
        )
    }
}

impl<S: Simd> Half<S> {
    /// The half with the rays from `first` on. Lanes without a ray have a direction of the others and never hit.
    #[inline(always)]
    fn new(simd: S, space: &LocalSpace, (rays, first): (&[Ray], usize)) -> Self {
        let row = |lane: usize| -> f64x8<S> {
            let live = rays.get(first + lane);
            let ray = live.unwrap_or(&rays[0]);
            let t_max = if live.is_some() { ray.t_max } else { f64::NEG_INFINITY };
            let (o, d) = (ray.origin, ray.direction);
            [o.x, o.y, o.z, d.x, d.y, d.z, ray.t_min, t_max].simd_into(simd)
        };
        let rows = [row(0), row(1), row(2), row(3), row(4), row(5), row(6), row(7)];
        let [ox, oy, oz, dx, dy, dz, t_min, t_max] = transpose(rows);
        let world = WorldRays { origin: Vector::new(ox, oy, oz), direction: Vector::new(dx, dy, dz) };
        let (origin, rounding) = space.points(world.origin);
        let direction = space.vectors(world.direction);
        let zero = f64x8::splat(simd, 0.0);
        let infinity = f64x8::splat(simd, f64::INFINITY);
        Self {
            world,
            local: LocalRays { origin, direction, rounding, t_min, t_max, t_limit: t_max },
            best: Best { t: infinity, st: [zero; 2], leaf: zero, patch: infinity, trim_loop: zero },
        }
    }
}

/// Rows become columns: interleaving the rows of the first half with those of the second, three times.
#[inline(always)]
fn transpose<S: Simd>(rows: [f64x8<S>; LANES]) -> [f64x8<S>; LANES] {
    let mut rows = rows;
    for _ in 0..3 {
        let (a, b) = rows[0].interleave(rows[4]);
        let (c, d) = rows[1].interleave(rows[5]);
        let (e, f) = rows[2].interleave(rows[6]);
        let (g, h) = rows[3].interleave(rows[7]);
        rows = [a, b, c, d, e, f, g, h];
    }
    rows
}

impl<S: Simd> Best<S> {
    /// As [`query::keep_nearer`] compares, in each lane: hits by t, patch, and parameters.
    #[inline(always)]
    fn is_preceded_by(&self, [t, patch, s, t_of_patch]: [f64x8<S>; 4]) -> <f64x8<S> as Real>::Truth {
        let by_place = s.lt(self.st[0]) | (s.le(self.st[0]) & t_of_patch.lt(self.st[1]));
        let by_patch = patch.lt(self.patch) | (patch.le(self.patch) & by_place);
        t.lt(self.t) | (t.le(self.t) & by_patch)
    }

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

/// A patch's place in the scene's order: exact, for fewer than 2^21 objects.
fn number_of(leaf: &Leaf) -> f64 {
    f64::from(leaf.object) * 4_294_967_296.0 + f64::from(leaf.patch)
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

#[cfg(test)]
mod tests {
    use crate::math::lanes::with_vectors;
    use fearless_simd::Level;
    use glam::DVec3;

    use super::*;
    use crate::subdivide::FrameChoice;
    use crate::test_support::{Noise, ball_triangles, deform, random_volume, scene_of};

    /// What makes a hit, to the bit.
    fn bits(hit: Option<PatchHit>) -> Option<[u64; 9]> {
        hit.map(|hit| {
            let [t, s, t_of_patch] = [hit.t, hit.st.x, hit.st.y].map(f64::to_bits);
            let [object, patch, face, polygon] =
                [hit.object, hit.patch, hit.face, hit.polygon].map(u64::from);
            let [tangent, on_border] = [hit.tangent, hit.on_border].map(u64::from);
            [t, s, t_of_patch, object, patch, face, polygon, tangent, on_border]
        })
    }

    /// Rays of one eye in a narrow cone, of one point in all directions, or of anywhere; some short, some at borders.
    fn rays(noise: &mut Noise, kind: usize, count: usize, scene: &TracedScene) -> Vec<Ray> {
        let eye = DVec3::splat(0.5) + 2.0 * noise.unit_vector();
        let aim = DVec3::splat(0.5) + 0.5 * noise.vector() - eye;
        let inside = DVec3::splat(0.5) + 0.1 * noise.vector();
        let patches = scene.objects()[0].faces();
        let mut ray = |number: usize| {
            let mut ray = match kind {
                0 => Ray::new(eye, aim + 0.05 * noise.vector()),
                1 => Ray::new(inside, noise.unit_vector()),
                2 => Ray::new(DVec3::splat(0.5) + 2.0 * noise.unit_vector(), noise.vector()),
                _ => {
                    let trimmed = &patches[number * 31 % patches.len()];
                    let corner = trimmed.region.corners(&trimmed.region.trim_loop(0))[number % 3];
                    Ray::new(eye, trimmed.patch.eval(corner).position - eye)
                }
            };
            if number % 5 == 4 {
                (ray.t_min, ray.t_max) = (0.2, 1.2);
            }
            ray
        };
        (0..count).map(&mut ray).collect()
    }

    #[test]
    fn a_ray_finds_the_same_bits_in_a_packet_and_alone() {
        let mut noise = Noise(61);
        for case in 0..4 {
            let volume = random_volume(&mut noise, [2, 3, 2], [5, 5, 6], 0.25, case % 2 == 1);
            let scene = scene_of(deform(&ball_triangles(), Some(&volume), FrameChoice::Parallelogram));
            let mut found = 0;
            for number in 0..400 {
                let rays = rays(&mut noise, number % 4, 1 + number * 7 % (2 * PACKET), &scene);
                let alone: Vec<_> = rays.iter().map(|ray| bits(scene.closest(ray))).collect();
                let mut hits = vec![None; rays.len()];
                scene.tracer().closest_of_each(&rays, &mut hits);
                let together: Vec<_> = hits.iter().map(|&hit| bits(hit)).collect();
                assert_eq!(together, alone, "case {case}, rays {number}");
                let mut any = vec![false; rays.len()];
                scene.tracer().any_of_each(&rays, &mut any);
                let each: Vec<_> = rays.iter().map(|ray| scene.any_hit(ray)).collect();
                assert_eq!(any, each, "case {case}, rays {number}");
                let rays = &rays[..rays.len().min(PACKET)];
                let hits = &mut hits[..rays.len()];
                let scratch = &mut Scratch::default();
                with_vectors!(Level::baseline(), simd => closest(simd, &scene, (rays, hits), scratch));
                let plain: Vec<_> = hits.iter().map(|&hit| bits(hit)).collect();
                assert_eq!(plain, alone[..rays.len()], "case {case}, rays {number}, narrow vectors");
                found += hits.iter().flatten().count();
            }
            assert!(found > 1000, "{found}");
        }
    }
}
