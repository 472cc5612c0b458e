//! Hits where they are hardest to find, with answers that are planted or known in closed form.
//!
//! All scenes here measure about 1, so that figures are in parts of the diagonal.

mod cells;
mod contact;
mod degenerate;
mod placement;
mod planted;

use glam::{DVec2, DVec3, DVec4};

use crate::patch::{BezierPatch, Face};
use crate::subdivide::FrameChoice;
use crate::test_support::{Noise, deform, scene_of};

use super::{PatchHit, Ray, RayTracer, TracedScene, Tracer, closest_hit_by_subdivision};

/// Rays start this far from the point they aim at.
const REACH: f64 = 3.0;

/// Bound on a hit's distance from its ray and from the surface, in parts of the diagonal.
const BOUND: f64 = 1e-11;

/// Coefficients of x over [-1, 1] in degrees 1 to 3, of x² in degree 2 and of x³ in degree 3.
const X1: [f64; 2] = [-1.0, 1.0];
const X2: [f64; 3] = [-1.0, 0.0, 1.0];
const X3: [f64; 4] = [-1.0, -1.0 / 3.0, 1.0 / 3.0, 1.0];
const SQUARE: [f64; 3] = [1.0, -1.0, 1.0];
const CUBE: [f64; 4] = [-1.0, 1.0, -1.0, 1.0];

/// A patch over the whole unit square.
fn whole(patch: BezierPatch) -> Face {
    let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
    let halves = [[square[0], square[1], square[2]], [square[0], square[2], square[3]]];
    let mut trimmed = deform(&halves, None, FrameChoice::Parallelogram).into_faces().remove(0);
    assert_eq!(trimmed.chart.place(DVec2::new(0.25, 0.75)).coordinates(), DVec3::new(0.25, 0.75, 0.0));
    trimmed.patch = patch;
    trimmed
}

/// The scene of one patch without weights; the place of control point (i, j) is given.
fn one_patch([m, n]: [usize; 2], place: impl Fn(usize, usize) -> DVec3) -> TracedScene {
    let places = (0..=m).flat_map(|i| (0..=n).map(move |j| (i, j)));
    let points = places.map(|(i, j)| place(i, j).extend(1.0)).collect();
    scene_of(vec![whole(BezierPatch::new([m, n], points))])
}

/// Hits of the line through `target`, in lengths of `direction` from it.
fn offsets(tracer: &mut Tracer<'_>, target: DVec3, direction: DVec3) -> Vec<f64> {
    let ray = Ray::new(target - REACH * direction, direction);
    tracer.all(&ray).iter().map(|hit| hit.t - REACH).collect()
}

fn patch_of<'a>(scene: &'a TracedScene, hit: &PatchHit) -> &'a Face {
    &scene.objects()[hit.object as usize].faces()[hit.patch as usize]
}

/// Fails unless every hit is on its ray, on its patch and in its trim, all within `bound`.
fn assert_no_ghosts(scene: &TracedScene, ray: &Ray, hits: &[PatchHit], bound: f64) {
    for hit in hits {
        let trimmed = patch_of(scene, hit);
        let position = trimmed.patch.eval(hit.st).position;
        let across = (position - ray.origin).cross(ray.direction.normalize()).length();
        assert!(across <= bound, "{across:e} from the ray: {hit:?} of {ray:?}");
        let along = (position - ray.at(hit.t)).length();
        assert!(along <= bound, "{along:e} from the point at t: {hit:?} of {ray:?}");
        let tolerance = 2.0 * scene.st_error(hit, ray) + BOUND;
        assert!(trimmed.region.find(hit.st, tolerance).is_some(), "outside the trim: {hit:?} of {ray:?}");
    }
}

/// A parameter in [0, 1]: an end, very close to one, a half, a quarter or an eighth, or anything.
fn biased_parameter(noise: &mut Noise) -> f64 {
    let choice = 6.0 * (noise.next() + 0.5);
    let random = noise.next() + 0.5;
    let tiny = libm::pow(10.0, -14.0 * random);
    match choice {
        c if c < 1.0 => 0.0,
        c if c < 2.0 => 1.0,
        c if c < 2.5 => tiny,
        c if c < 3.0 => 1.0 - tiny,
        c if c < 4.0 => (8.0 * random).floor() / 8.0,
        _ => random,
    }
}

/// A unit vector in the tangent plane plus `tilt` times the normal; `None` where there is no normal.
fn near_tangent(noise: &mut Noise, patch: &BezierPatch, st: DVec2, tilt: f64) -> Option<DVec3> {
    let point = patch.eval(st);
    let normal = point.dp_ds.cross(point.dp_dt);
    let scale = point.dp_ds.length() * point.dp_dt.length();
    if normal.length() < 1e-3 * scale {
        return None;
    }
    let normal = normal.normalize();
    let along = point.dp_ds.normalize();
    let turn = std::f64::consts::TAU * noise.next();
    let tangent = libm::cos(turn) * along + libm::sin(turn) * normal.cross(along);
    Some((tangent + tilt * normal).normalize())
}

/// A net over the unit square shaken by `amount`, with weights up to `spread` and down to its inverse.
fn random_patch(noise: &mut Noise, [m, n]: [usize; 2], amount: f64, spread: f64) -> BezierPatch {
    let mut points = Vec::new();
    for i in 0..=m {
        for j in 0..=n {
            let rest = DVec3::new(i as f64 / m as f64, j as f64 / n as f64, 0.0);
            let weight = libm::pow(spread, 2.0 * noise.next());
            let place = rest + amount * noise.vector();
            points.push(DVec4::from((place * weight, weight)));
        }
    }
    BezierPatch::new([m, n], points)
}
