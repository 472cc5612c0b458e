//! Surfaces without a normal somewhere, and rays in a flat surface.

use super::*;
use crate::test_support::cube_triangles;

/// A patch whose edge t = 0 is one point, as a pole of a sphere is.
fn pole(noise: &mut Noise) -> BezierPatch {
    let patch = random_patch(noise, [3, 2], 0.3, 1.0);
    let apex = noise.vector().extend(1.0);
    let points = patch.control_points().enumerate();
    let points = points.map(|(index, point)| if index % 3 == 0 { apex } else { point }).collect();
    BezierPatch::new([3, 2], points)
}

/// A ray through the point at (s, t) of a patch with a pole, from a side from which the surface near it is seen.
fn assert_pole_hit(noise: &mut Noise, scene: &TracedScene, st: DVec2) {
    let patch = &scene.objects()[0].faces()[0].patch;
    let near = patch.eval(DVec2::new(0.5, 1e-3));
    let normal = near.dp_ds.cross(near.dp_dt).normalize();
    let direction = (normal + 0.5 * noise.vector()).normalize();
    let target = patch.eval(st).position;
    let ray = Ray::new(target - REACH * direction, direction);
    let hits = scene.all(&ray);
    assert_no_ghosts(scene, &ray, &hits, BOUND);
    // where the ray is all but tangent, rounding across it is more along it
    let slide = |hit: &PatchHit| {
        let (error, point) = (scene.st_error(hit, &ray), patch.eval(hit.st));
        error.x * point.dp_ds.length() + error.y * point.dp_dt.length()
    };
    let found = hits.iter().any(|hit| (ray.at(hit.t) - target).length() < BOUND + slide(hit));
    assert!(found, "at {st:?}, {ray:?}: {hits:?}");
}

#[test]
fn a_collapsed_edge_is_hit() {
    let mut noise = Noise(301);
    for _ in 0..40 {
        let scene = scene_of(vec![whole(pole(&mut noise))]);
        for number in 0..40 {
            let t = if number % 4 == 0 { 0.0 } else { libm::pow(10.0, -13.0 * (noise.next() + 0.5)) };
            let s = if t > 1e-4 { biased_parameter(&mut noise) } else { 0.5 + 0.9 * noise.next() };
            assert_pole_hit(&mut noise, &scene, DVec2::new(s, t));
        }
    }
}

#[test]
fn the_seams_at_a_collapsed_edge_are_hit() {
    let mut noise = Noise(306);
    for _ in 0..40 {
        let scene = scene_of(vec![whole(pole(&mut noise))]);
        for number in 0..40 {
            let t = libm::pow(10.0, -13.0 * (noise.next() + 0.5));
            assert_pole_hit(&mut noise, &scene, DVec2::new(f64::from(number % 2), t));
        }
    }
}

/// (x³, y, x²): the partial by x is 0 along a cusp's ridge.
#[test]
fn a_cusp_is_hit() {
    let square: [f64; 4] = [1.0, -1.0 / 3.0, -1.0 / 3.0, 1.0];
    let scene = one_patch([3, 1], |i, j| DVec3::new(CUBE[i], X1[j], square[i]));
    let mut noise = Noise(302);
    for number in 0..400 {
        let y = noise.next();
        let x = match number % 4 {
            0 => 0.0,
            1 => 0.9 * noise.next(),
            _ => noise.next().signum() * libm::pow(10.0, -14.0 * (noise.next() + 0.5)),
        };
        let target = DVec3::new(x, y, libm::pow(libm::cbrt(x), 2.0));
        let direction = DVec3::new(0.0, 0.3 * noise.next(), 1.0);
        let ray = Ray::new(target - REACH * direction, direction);
        let hits = scene.all(&ray);
        let near: Vec<_> = hits.iter().filter(|hit| (ray.at(hit.t) - target).length() < 1e-8).collect();
        assert!(!near.is_empty(), "x {x:e}, y {y}: {hits:?}");
    }
}

/// (x², y, x) with x from 0: the partial by x is 0 at an edge.
#[test]
fn an_edge_without_a_partial_is_hit() {
    let scene = one_patch([2, 1], |i, j| DVec3::new([0.0, 0.0, 1.0][i], X1[j], [0.0, 0.0, 1.0][i]));
    let mut noise = Noise(303);
    for number in 0..400 {
        let y = if number % 5 == 0 { 1.0 } else { 2.0 * noise.next() };
        let x = if number % 4 == 0 { 0.0 } else { libm::pow(10.0, -15.0 * (noise.next() + 0.5)) };
        let target = DVec3::new(x, y, x);
        let direction = DVec3::new(0.3 * noise.next(), 0.3 * noise.next(), 1.0);
        let found = offsets(&mut scene.tracer(), target, direction);
        assert!(found.iter().any(|l| l.abs() < BOUND), "x {x:e}, y {y}: {found:?}");
    }
}

/// Rays in a face of a cube, exactly and all but: they end, and hit the faces across them at their borders.
#[test]
fn rays_in_a_face_hit_the_faces_across() {
    let scene = scene_of(deform(&cube_triangles(), None, FrameChoice::Parallelogram));
    let mut noise = Noise(304);
    let mut tracer = scene.tracer();
    for number in 0..600 {
        let axis = number % 3;
        let side = if number / 3 % 2 == 0 { 0.0 } else { 1.0 };
        let (mut from, mut to) = (0.5 + noise.vector(), 0.5 + noise.vector());
        (from[axis], to[axis]) = (side, side);
        // along an edge of the cube, along the diagonal that two triangles share, or anywhere
        let other = (axis + 1) % 3;
        match number / 6 % 3 {
            0 => (from[other], to[other]) = (0.0, 0.0),
            1 => (from, to) = (DVec3::ZERO.with_axis(axis, side), DVec3::ONE.with_axis(axis, side)),
            _ => {}
        }
        let direction = (to - from).normalize();
        let tilt = if number % 4 == 0 { 0.0 } else { libm::pow(10.0, -17.0 - 3.0 * noise.next()) };
        let origin = 0.5 * (from + to) - REACH * direction;
        let mut ray = Ray::new(origin, direction);
        ray.direction[axis] += tilt;
        let hits = tracer.all(&ray);
        let enters = (0..3)
            .filter(|&a| a != axis && direction[a] != 0.0)
            .map(|a| ((0.0 - origin[a]) / direction[a]).min((1.0 - origin[a]) / direction[a]))
            .fold(f64::NEG_INFINITY, f64::max);
        assert!(
            hits.iter().any(|hit| (hit.t - enters).abs() < BOUND),
            "ray {number} enters at {enters}: {ray:?} {hits:?}"
        );
        assert!(tracer.any(&ray) && tracer.closest(&ray).is_some());
    }
    let statistics = tracer.statistics();
    assert!(statistics.in_surface > 100 && statistics.not_converged == 0, "{statistics:?}");
    assert!(statistics.boxes < 2000 * 64, "the search ends soon: {statistics:?}");
}

#[test]
fn a_zero_of_either_sign_is_the_same_direction() {
    let scene = scene_of(deform(&cube_triangles(), None, FrameChoice::Parallelogram));
    let origin = DVec3::new(-1.0, 0.3, 0.4);
    let hits = |direction| scene.all(&Ray::new(origin, direction));
    assert_eq!(hits(DVec3::new(1.0, 0.0, 0.0)).len(), 2);
    assert_eq!(hits(DVec3::new(1.0, 0.0, -0.0)), hits(DVec3::new(1.0, 0.0, 0.0)));
}

/// A flat patch whose parameters are bent, with the plane's rays.
#[test]
fn rays_in_a_flat_patch_of_high_degree_end() {
    let mut noise = Noise(305);
    for degree in [[1, 1], [2, 3], [4, 4], [8, 8]] {
        let bent = random_patch(&mut noise, degree, 0.1, 1.0);
        let points = bent.control_points().map(|point| point.with_z(0.0)).collect();
        let scene = scene_of(vec![whole(BezierPatch::new(degree, points))]);
        let mut tracer = scene.tracer();
        for _ in 0..100 {
            let target = 0.5 + 0.5 * noise.vector().truncate();
            let direction = noise.vector().truncate().normalize().extend(0.0);
            tracer.all(&Ray::new(target.extend(0.0) - REACH * direction, direction));
        }
        let statistics = tracer.statistics();
        assert!(statistics.in_surface >= 100 && statistics.not_converged == 0, "{degree:?}: {statistics:?}");
    }
}

trait WithAxis {
    fn with_axis(self, axis: usize, value: f64) -> Self;
}

impl WithAxis for DVec3 {
    fn with_axis(mut self, axis: usize, value: f64) -> Self {
        self[axis] = value;
        self
    }
}
