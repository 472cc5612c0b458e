//! Roots planted where they are likely to be lost: at edges and corners, on halves of the parameters, along rays that all
//! but lie in the tangent plane, on nets of all kinds.

use super::*;
use crate::test_support::{ball_triangles, cube_triangles, random_volume};

/// Angles to the tangent plane at which the last Newton step is not to be relied on.
const NEARLY_TANGENT: f64 = 1e-3;

/// Angles to the tangent plane. Smaller ones make a rounding move a hit beyond the trim's tolerance.
const TILTS: [f64; 5] = [1.0, 0.3, 1e-1, 1e-2, 1e-4];

/// How far from the planted point its hit may be, for a ray at this angle to the tangent plane: a rounding of a
/// hundredth of `bound` across the ray moves it by that over the angle, and by its root at most.
fn reach(tilt: f64, bound: f64) -> f64 {
    bound + (0.01 * bound / tilt).min(0.3 * bound.sqrt())
}

/// Where a root is planted, and what is asked of it.
#[derive(Clone, Copy, Debug)]
struct Planted {
    patch: usize,
    st: DVec2,
    /// About the sine of the ray's angle to the tangent plane.
    tilt: f64,
    /// Greatest distance of a hit from its ray.
    bound: f64,
    /// Whether a hit at the same place on a neighbour will do.
    any_patch: bool,
}

/// Shoots through the point at `st` of a patch and requires a hit there, none elsewhere that is not one, and of the
/// closest that it is the nearest.
fn assert_planted(scene: &TracedScene, planted: Planted, direction: DVec3) {
    let Planted { patch, st, tilt, bound, .. } = planted;
    let target = scene.objects()[0].faces()[patch].patch.eval(st).position;
    let ray = Ray::new(target - REACH * direction, direction);
    let mut tracer = scene.tracer();
    let hits = tracer.all(&ray);
    let statistics = tracer.statistics();
    let what = format!("{planted:?}, {ray:?}: {hits:?} {statistics:?}");
    let distance = |hit: &PatchHit| (patch_of(scene, hit).patch.eval(hit.st).position - target).length();
    let found = |hit: &PatchHit| {
        (hit.patch as usize == patch || planted.any_patch) && distance(hit) <= reach(tilt, bound)
    };
    assert!(hits.iter().any(found), "{what}");
    assert_no_ghosts(scene, &ray, &hits, bound);
    let first = scene.closest(&ray).expect("as one of all").t;
    assert!((first - hits[0].t).abs() <= reach(tilt, bound), "closest is {first}: {what}");
}

/// The closest hit against bisection.
fn assert_as_bisected(scene: &TracedScene, ray: &Ray, border: f64, bound: f64) {
    let hit = scene.closest_hit(ray);
    let got = hit.map_or(f64::INFINITY, |hit| hit.t);
    let want = closest_hit_by_subdivision(scene, ray, border);
    let cos = hit.map_or(1.0, |hit| hit.normal.dot(ray.direction.normalize()).abs());
    let difference = (got - want).abs() * ray.direction.length() * cos;
    assert!(got == want || difference <= bound, "{got}, by bisection {want}: {ray:?}");
}

/// Planted roots of one random net, each with rays at all angles; those at wide ones are compared with bisection too, if
/// asked.
fn plant(noise: &mut Noise, patch: &BezierPatch, tilts: &[f64], bound: f64, bisected: bool) -> usize {
    let scene = scene_of(vec![whole(patch.clone())]);
    let mut count = 0;
    for _ in 0..if bisected { 10 } else { 60 } {
        let st = DVec2::new(biased_parameter(noise), biased_parameter(noise));
        for &tilt in tilts {
            let Some(direction) = near_tangent(noise, patch, st, tilt) else { continue };
            let bound = if tilt > NEARLY_TANGENT { bound } else { 100.0 * bound };
            assert_planted(&scene, Planted { patch: 0, st, tilt, bound, any_patch: false }, direction);
            count += 1;
            if bisected && tilt >= 1e-2 {
                let target = patch.eval(st).position;
                assert_as_bisected(&scene, &Ray::new(target - REACH * direction, direction), 1e-9, bound);
            }
        }
    }
    count
}

#[test]
fn on_random_nets() {
    let mut noise = Noise(201);
    let mut planted = 0;
    for case in 0..64 {
        let degree = [1 + case % 4, 1 + case / 4 % 4];
        // weights that differ by a factor of 9 let a rounding count as much more
        let (spread, bound) = if case % 8 == 4 { (3.0, 10.0 * BOUND) } else { (1.0, BOUND) };
        let patch = random_patch(&mut noise, degree, 0.5, spread);
        planted += plant(&mut noise, &patch, &TILTS, bound, case % 4 == 0);
    }
    assert!(planted > 12_000, "most places have a normal: {planted}");
}

#[test]
fn on_nets_of_high_degree() {
    let mut noise = Noise(202);
    let mut planted = 0;
    for degree in [[8, 12], [12, 8], [8, 8], [12, 12], [1, 12]] {
        let patch = random_patch(&mut noise, degree, 0.5, 1.0);
        planted += plant(&mut noise, &patch, &TILTS, BOUND, false);
    }
    let patch = random_patch(&mut noise, [8, 12], 0.5, 1.0);
    planted += plant(&mut noise, &patch, &[1.0], BOUND, true);
    assert!(planted > 1500, "most places have a normal: {planted}");
}

#[test]
fn under_weights_from_a_thousandth_to_a_thousand() {
    let mut noise = Noise(203);
    let mut planted = 0;
    for case in 0..32 {
        let degree = [1 + case % 4, 1 + case / 4 % 4];
        let patch = random_patch(&mut noise, degree, 0.4, 1e3);
        // a rounding of the heaviest point counts a million times at the lightest
        planted += plant(&mut noise, &patch, &TILTS[..3], 1e6 * BOUND, false);
    }
    assert!(planted > 2000, "{planted}");
}

/// A point of a loop: a corner, a point of an edge, or one inside.
#[expect(clippy::cast_possible_truncation, reason = "an index of a few corners")]
fn biased_place(noise: &mut Noise, corners: &[DVec2]) -> DVec2 {
    let index = (corners.len() as f64 * (noise.next() + 0.5)) as usize;
    let (a, b) = (corners[index], corners[(index + 1) % corners.len()]);
    let on_edge = a.lerp(b, biased_parameter(noise));
    let middle = corners.iter().sum::<DVec2>() / corners.len() as f64;
    if noise.next() < 0.2 { on_edge } else { on_edge.lerp(middle, biased_parameter(noise)) }
}

/// Planted roots in the trims of a deformed solid.
fn plant_in_trims(noise: &mut Noise, scene: &TracedScene, tilts: &[f64], any_patch: bool) -> usize {
    let mut count = 0;
    for (patch, trimmed) in scene.objects()[0].faces().iter().enumerate() {
        for trim_loop in trimmed.region.loops() {
            for &tilt in tilts {
                let st = biased_place(noise, trimmed.region.corners(&trim_loop));
                let Some(direction) = near_tangent(noise, &trimmed.patch, st, tilt) else { continue };
                let bound = if tilt > NEARLY_TANGENT { BOUND } else { 100.0 * BOUND };
                assert_planted(scene, Planted { patch, st, tilt, bound, any_patch }, direction);
                count += 1;
            }
        }
    }
    count
}

#[test]
fn in_the_trims_of_deformed_solids() {
    let mut noise = Noise(204);
    let mut planted = 0;
    for case in 0..24 {
        let degree = [1 + case % 4, 1 + case / 4 % 4, 1 + case / 16 % 4];
        let volume = random_volume(&mut noise, degree, degree.map(|k| k + 2), 0.3, case % 4 == 3);
        let triangles = if case % 2 == 0 { cube_triangles() } else { ball_triangles() };
        let frame = if case / 2 % 2 == 0 { FrameChoice::Parallelogram } else { FrameChoice::Rectangle };
        let scene = scene_of(deform(&triangles, Some(&volume), frame));
        planted += plant_in_trims(&mut noise, &scene, &TILTS, false);
    }
    assert!(planted > 9000, "{planted}");
}

/// Two triangles about 1 long and `width` wide, in a general plane or along the axes.
fn sliver(noise: &mut Noise, width: f64, along_axes: bool) -> TracedScene {
    let (a, b) = (0.5 + 0.9 * noise.vector(), 0.5 + 0.9 * noise.vector());
    let middle = a.lerp(b, noise.next() + 0.5);
    let mut corners = [a, b, middle + width * noise.unit_vector()];
    if along_axes {
        let flat = corners[0].z;
        corners.iter_mut().for_each(|corner| corner.z = flat);
        corners[1].y = corners[0].y;
        corners[2].y = corners[0].y + width;
    }
    let volume = random_volume(noise, [2, 3, 2], [4, 5, 4], 0.2, false);
    let triangles = [corners, [corners[1], corners[0], corners[2] + 0.1 * DVec3::ONE]];
    scene_of(deform(&triangles, Some(&volume), FrameChoice::Parallelogram))
}

#[test]
fn in_slivers() {
    let mut noise = Noise(205);
    let mut planted = 0;
    for case in 0..140_u32 {
        let width = libm::pow(10.0, -f64::from(case % 7) - 1.0);
        let along_axes = case % 2 == 1;
        let scene = sliver(&mut noise, width, along_axes);
        // a sliver along the axes has a patch as thin as itself
        let tilts = [1.0, 1.0, 0.5, 0.3, 0.1, 0.1, 1e-2, 1e-2, 1e-3];
        let within_cap: Vec<_> =
            tilts.into_iter().filter(|tilt| !along_axes || tilt * width > 1e-6).collect();
        planted += plant_in_trims(&mut noise, &scene, &within_cap, true);
    }
    assert!(planted > 2000, "{planted}");
}

#[test]
fn in_slivers_seen_at_a_small_angle() {
    let mut noise = Noise(207);
    for case in 0..70_u32 {
        let width = libm::pow(10.0, -f64::from(case % 7) - 1.0);
        let scene = sliver(&mut noise, width, true);
        plant_in_trims(&mut noise, &scene, &[1.0, 0.5, 0.1, 1e-2, 1e-3], true);
    }
}

#[test]
fn nearly_tangent_hits_are_on_their_rays() {
    let mut noise = Noise(208);
    for case in 0..64 {
        let patch = random_patch(&mut noise, [1 + case % 4, 1 + case / 4 % 4], 0.5, 1.0);
        let scene = scene_of(vec![whole(patch.clone())]);
        for _ in 0..100 {
            let st = noise.vector().truncate() + 0.5;
            let tilt = libm::pow(10.0, -3.0 - 5.0 * (noise.next() + 0.5));
            let Some(direction) = near_tangent(&mut noise, &patch, st, tilt) else { continue };
            let ray = Ray::new(patch.eval(st).position - REACH * direction, direction);
            assert_no_ghosts(&scene, &ray, &scene.all(&ray), BOUND);
        }
    }
}

/// All hits in turn, each the nearest after the one before, on volumes that fold over.
#[test]
fn all_hits_of_folded_volumes_are_those_of_bisection() {
    let mut noise = Noise(206);
    let (mut hits, mut folded) = (0, 0);
    for case in 0..6 {
        let volume = random_volume(&mut noise, [2 + case % 2; 3], [4; 3], 1.5, case == 5);
        for _ in 0..50 {
            let rest = noise.vector() + 0.5;
            folded += usize::from(volume.eval(rest).unwrap().jacobian.determinant() < 0.0);
        }
        let scene = scene_of(deform(&cube_triangles(), Some(&volume), FrameChoice::Parallelogram));
        for _ in 0..40 {
            let target = 0.5 + 0.5 * noise.vector();
            let origin = 0.5 + 2.0 * noise.unit_vector();
            let mut ray = Ray::new(origin, target - origin);
            for hit in scene.all(&ray) {
                assert_as_bisected(&scene, &ray, 1e-13, BOUND);
                ray.t_min = hit.t + 1e-9;
                hits += 1;
            }
            assert_as_bisected(&scene, &ray, 1e-13, BOUND);
        }
    }
    assert!(folded > 30, "a part of the volumes is inside out: {folded}");
    assert!(hits > 600, "{hits}");
}
