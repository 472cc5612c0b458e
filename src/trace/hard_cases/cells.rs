//! Surfaces that are no patches: rays planted on the formula itself, at borders and at grazing angles, are found.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};

use crate::analytic::{
    Chain, CoverSettings, Expression, Extension, ExtensionMode, Field, Region, Step, cover,
};
use crate::patch::{BezierPatch, Chart, Face, Shell};
use crate::spline::{Axis, ControlLattice};
use crate::subdivide::{Frame, FrameChoice};
use crate::test_support::{Noise, ball_triangles, cube_triangles, deform, random_volume, scene_of};
use crate::trace::{Ray, TracedScene};

fn region(bound: &str, index: u32, h: f64) -> Region {
    Region {
        bound: Expression::parse(bound).unwrap(),
        center: DVec3::splat(0.2),
        index,
        h: [[h, 0.0, 0.0], [0.0, 0.5 * h, 0.0], [0.0, 0.0, h]],
        epsilon: [[1.0; 3]; 3],
        factor: None,
    }
}

fn sheet(noise: &mut Noise) -> Face {
    let points = (0..16).map(|k| {
        let flat = DVec3::new(f64::from(k / 4) / 3.0, f64::from(k % 4) / 3.0, 0.5);
        (flat + 0.1 * noise.vector()).extend(1.0)
    });
    let frame = Frame { origin: DVec3::ZERO, s: DVec3::X, t: DVec3::Y };
    Face::untrimmed(Chart::Plane(frame), BezierPatch::new([3, 3], points.collect()))
}

/// Chains with low and high contact, creases and tears.
fn scenes() -> Vec<(&'static str, TracedScene)> {
    let mut noise = Noise(41);
    let base = Shell::from(vec![sheet(&mut noise)]);
    let circles = || {
        vec![
            region("((u-0.4)^2 + (v-0.5)^2)/0.08 - 1", 2, 0.9),
            region("((u-0.65)^2 + (v-0.6)^2)/0.06 - 1", 3, 0.7),
        ]
    };
    let operator = Step::Extension(
        Extension::try_new(ExtensionMode::Operator { center: DVec3::ZERO, axes: DMat3::IDENTITY }, circles())
            .unwrap(),
    );
    let normal = Step::Extension(Extension::try_new(ExtensionMode::Field(Field::Normal), circles()).unwrap());
    let diamond = Step::Extension(
        Extension::try_new(ExtensionMode::Radial, vec![region("abs(u-0.5) + abs(v-0.5) - 0.3", 2, 6.0)])
            .unwrap(),
    );
    let smooth = Step::Volume(random_volume(&mut noise, [2, 3, 2], [5, 5, 4], 0.1, false));
    let rational = Step::Volume(random_volume(&mut noise, [2, 2, 2], [4, 4, 4], 0.1, true));
    let creased = Step::Volume(random_volume(&mut noise, [1, 1, 1], [4, 4, 3], 0.1, false));
    let mut ball = deform(&ball_triangles(), None, FrameChoice::Parallelogram).into_faces();
    ball.truncate(12);
    let ball = Shell::from(ball);
    let made = |name, base: &Shell, steps: Vec<Step>| {
        let covered =
            cover(base, &Arc::new(Chain::try_new(steps).unwrap()), CoverSettings::default()).unwrap();
        (name, scene_of(covered.shell))
    };
    vec![
        made("operator", &base, vec![operator.clone()]),
        made("normal field", &base, vec![normal.clone()]),
        made("diamond", &base, vec![diamond]),
        made("volume", &base, vec![smooth.clone()]),
        made("creases and tears", &base, vec![creased]),
        made("volume after normal field", &base, vec![normal, rational.clone()]),
        made("operator between volumes", &base, vec![smooth.clone(), operator, rational.clone()]),
        made("two volumes on a ball", &ball, vec![smooth, rational]),
    ]
}

/// A place of a patch that is surface, often at its border or at a curve between pieces.
fn place(noise: &mut Noise, patch: &Face, kind: usize) -> Option<DVec2> {
    let corners = patch.region.corners(&patch.region.trim_loop(0));
    let weights: Vec<f64> = corners.iter().map(|_| noise.next() + 0.5).collect();
    let sum: f64 = weights.iter().sum();
    let mut st = corners.iter().zip(&weights).map(|(corner, weight)| *corner * (weight / sum)).sum::<DVec2>();
    match kind % 4 {
        0 => {
            let [a, b] = [corners[0], corners[1]];
            st = a.lerp(b, noise.next() + 0.5);
        }
        1 => {
            // towards a place outside the piece, by bisection
            let outside = corners.iter().copied().find(|corner| !patch.holds(*corner, DVec2::ZERO));
            let inside = corners.iter().copied().find(|corner| patch.holds(*corner, DVec2::ZERO));
            if let (Some(mut outside), Some(mut inside)) = (outside, inside) {
                for _ in 0..48 {
                    let middle = 0.5 * (inside + outside);
                    if patch.holds(middle, DVec2::ZERO) {
                        inside = middle;
                    } else {
                        outside = middle;
                    }
                }
                st = inside;
            }
        }
        _ => {}
    }
    patch.holds(st, DVec2::ZERO).then_some(st)
}

#[test]
fn planted_rays_are_found_on_the_formula() {
    for (name, scene) in scenes() {
        let mut noise = Noise(43);
        let patches = scene.objects()[0].faces();
        let (mut planted, mut all, mut tangent) = (0, 0, 0);
        for (number, patch) in patches.iter().enumerate() {
            for kind in 0..12 {
                let Some(st) = place(&mut noise, patch, kind) else { continue };
                let point = patch.eval(st);
                let normal = point.dp_ds.cross(point.dp_dt).normalize();
                let mut direction = noise.unit_vector();
                if kind % 3 == 0 {
                    // at a grazing angle
                    let tilt = libm::pow(10.0, -4.0 * (noise.next() + 0.5));
                    direction =
                        (direction.reject_from_normalized(normal).normalize() + tilt * normal).normalize();
                }
                let steep = direction.dot(normal).abs();
                if steep < 1e-5 {
                    continue;
                }
                planted += 1;
                let ray = Ray::new(point.position - 2.0 * direction, direction);
                let hits = scene.all(&ray);
                let found = hits.iter().map(|hit| {
                    let position = patches[hit.patch as usize].eval(hit.st).position;
                    let on_ray = (position - ray.origin).cross(direction).length();
                    let limit = if hit.tangent { patches[hit.patch as usize].error() } else { 1e-14 };
                    assert!(on_ray < limit, "{name}, patch {number}: {on_ray:e} from the ray, {hit:?}");
                    tangent += usize::from(hit.tangent);
                    all += 1;
                    position.distance(point.position)
                });
                let nearest = found.fold(f64::INFINITY, f64::min);
                assert!(
                    nearest < 1e-13 / steep,
                    "{name}, patch {number}, {st} along {direction}: {nearest:e} away, {steep:e} steep"
                );
                let closest = scene.closest(&ray).unwrap();
                assert!(closest.t <= 2.0 + 1e-12 / steep, "{name}, patch {number}: {closest:?}");
            }
        }
        assert!(
            planted > 500 && 1000 * tangent <= all,
            "{name}: {planted} rays, {all} hits, {tangent} tangent"
        );
    }
}

#[test]
fn packets_find_the_bits_of_single_rays_on_cells() {
    for (name, scene) in scenes() {
        let mut noise = Noise(47);
        let eye = DVec3::new(0.4, 0.3, 3.0);
        let rays: Vec<_> =
            (0..400).map(|_| Ray::new(eye, DVec3::new(0.5, 0.5, 0.5) + 0.6 * noise.vector() - eye)).collect();
        let mut hits = vec![None; rays.len()];
        scene.tracer().closest_of_each(&rays, &mut hits);
        let bits = |hit: Option<crate::trace::PatchHit>| {
            hit.map(|hit| ([hit.t, hit.st.x, hit.st.y].map(f64::to_bits), hit.patch))
        };
        let mut found = 0;
        for (ray, hit) in rays.iter().zip(hits) {
            assert_eq!(bits(scene.closest(ray)), bits(hit), "{name}");
            found += usize::from(hit.is_some());
        }
        assert!(found > 50, "{name}: {found}");
    }
}

#[test]
fn a_surface_in_a_face_of_a_lattices_box_is_there_once() {
    // coordinates of the face are off by their rounding, to both sides
    let mut lattice = ControlLattice::identity([2; 3], [4; 3], [DVec3::ZERO, DVec3::ONE], 0).unwrap();
    lattice.twist(Axis::Z, 50.0);
    let twisted = lattice.volume().unwrap();
    let cube = deform(&cube_triangles(), Some(&twisted), FrameChoice::Parallelogram);
    let bounds = [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(2.0, 2.0, 1.0)];
    let mut lattice = ControlLattice::identity([2; 3], [4; 3], bounds, 0).unwrap();
    lattice.bend(Axis::Z, 40.0, "x".parse().unwrap());
    let bent = lattice.volume().unwrap();
    let covered =
        cover(&cube, &Arc::new(Chain::try_new(vec![Step::Volume(bent)]).unwrap()), CoverSettings::default())
            .unwrap();
    let scene = scene_of(covered.shell);
    let mut noise = Noise(53);
    let mut through = 0;
    for _ in 0..4000 {
        let target = DVec3::splat(0.5) + 0.8 * noise.vector();
        let direction = noise.unit_vector();
        let hits = scene.all(&Ray::new(target - 4.0 * direction, direction));
        assert_eq!(hits.len() % 2, 0, "{target} along {direction}: {hits:?}");
        for hit in &hits {
            let patch = &scene.objects()[0].faces()[hit.patch as usize];
            let apart = patch.eval(hit.st).position.distance(patch.eval_whole(hit.st).position);
            assert!(apart < 1e-12, "{hit:?} is {apart:e} from the surface");
        }
        through += usize::from(!hits.is_empty());
    }
    assert!(through > 2000, "{through}");
}
