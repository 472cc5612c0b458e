//! Surfaces with closed forms, and patches against de Boor's algorithm.

use glam::{DVec2, DVec3};

use super::*;
use crate::test_support::Noise;

fn places(noise: &mut Noise, surface: &SplineSurface) -> Vec<DVec2> {
    let [u, v] = surface.domain();
    let along = |[low, high]: [f64; 2], x: f64| low + (high - low) * (x + 0.5);
    (0..300).map(|_| DVec2::new(along(u, noise.next()), along(v, noise.next()))).collect()
}

/// Every patch is the surface on its rectangle.
fn assert_patches(surface: &SplineSurface, noise: &mut Noise) {
    for trimmed in surface.shell().faces() {
        for _ in 0..20 {
            let st = DVec2::new(noise.next() + 0.5, noise.next() + 0.5);
            let want = surface.eval(trimmed.chart.place(st).coordinates().truncate());
            let got = trimmed.patch.eval(st).position;
            assert!(got.distance(want) < 1e-14 * (1.0 + want.length()), "{st}: {got}, want {want}");
        }
    }
}

#[test]
fn shapes_are_what_they_are_called() {
    let mut noise = Noise(41);
    let (origin, axis) = (DVec3::new(1.0, -2.0, 0.5), DVec3::new(0.3, 0.4, 1.2));
    type Case<'a> = (Shape, usize, &'a dyn Fn(DVec3) -> f64);
    let shapes: [Case<'_>; 5] = [
        (Shape::Plane { origin, u: DVec3::X, v: DVec3::new(0.5, 2.0, 1.0) }, 1, &|p| {
            (p - origin).dot(DVec3::new(0.0, -1.0, 2.0))
        }),
        (Shape::Sphere { center: origin, radius: 1.5 }, 8, &|p| p.distance(origin) - 1.5),
        (Shape::Cylinder { origin, axis, radius: 0.7 }, 4, &|p| {
            (p - origin).reject_from(axis).length() - 0.7
        }),
        (Shape::Cone { origin, axis, radius: 0.7 }, 4, &|p| {
            let height = (p - origin).dot(axis) / axis.length_squared();
            (p - origin).reject_from(axis).length() - 0.7 * (1.0 - height)
        }),
        (Shape::Torus { center: origin, axis, major_radius: 2.0, minor_radius: 0.6 }, 16, &|p| {
            let (up, across) = ((p - origin).project_onto(axis), (p - origin).reject_from(axis));
            (across - across.normalize() * 2.0 + up).length() - 0.6
        }),
    ];
    for (shape, count, off) in shapes {
        let surface = shape.surface().unwrap();
        assert_eq!(surface.shell().faces().len(), count, "{shape:?}");
        assert_patches(&surface, &mut noise);
        for uv in places(&mut noise, &surface) {
            assert!(
                off(surface.eval(uv)).abs() < 1e-14 * 4.0,
                "{shape:?} at {uv}: {:e}",
                off(surface.eval(uv))
            );
        }
        let part = surface.restricted([[0.1, 0.6], [0.3, 0.9]]).unwrap();
        assert_patches(&part, &mut noise);
    }
}

#[test]
fn normals_point_outwards() {
    let sphere = Shape::Sphere { center: DVec3::ZERO, radius: 2.0 }.surface().unwrap();
    let torus = Shape::Torus { center: DVec3::ZERO, axis: DVec3::Z, major_radius: 3.0, minor_radius: 1.0 };
    for trimmed in sphere.shell().faces() {
        let point = trimmed.patch.eval(DVec2::new(0.4, 0.6));
        assert!(point.normal().distance(point.position / 2.0) < 1e-14);
    }
    for trimmed in torus.surface().unwrap().shell().faces() {
        let point = trimmed.patch.eval(DVec2::new(0.4, 0.6));
        let ring = point.position.reject_from(DVec3::Z).normalize() * 3.0;
        assert!(point.normal().distance(point.position - ring) < 1e-13);
    }
}

#[test]
fn splines_with_uneven_knots_are_their_patches() {
    let mut noise = Noise(42);
    for rational in [false, true] {
        let knots_u = vec![-1.0, -1.0, 0.0, 0.5, 0.5, 2.0, 2.5, 2.5, 2.5];
        let knots_v = vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
        let points: Vec<_> = (0..6 * 5).map(|_| noise.vector()).collect();
        let weights: Vec<_> =
            if rational { points.iter().map(|_| 1.0 + noise.next()).collect() } else { Vec::new() };
        let surface = SplineSurface::try_new([2, 3], [knots_u, knots_v], &points, &weights).unwrap();
        assert_eq!(surface.domain(), [[0.0, 2.5], [3.0, 5.0]]);
        assert_eq!(surface.shell().faces().len(), 3 * 2);
        assert_patches(&surface, &mut noise);
        // neighbours meet
        let patches = surface.shell().into_faces();
        for t in [0.0, 0.3, 1.0] {
            let a = patches[0].patch.eval(DVec2::new(1.0, t)).position;
            let b = patches[2].patch.eval(DVec2::new(0.0, t)).position;
            assert!(a.distance(b) < 1e-14);
        }
    }
}

#[test]
fn wrong_surfaces_are_refused() {
    let four = [DVec3::ZERO; 4];
    let say = |error: SurfaceError| error.to_string();
    assert_eq!(
        say(SplineSurface::bezier([1, 2], &four, &[]).unwrap_err()),
        "4 control points given, 6 needed"
    );
    assert_eq!(say(SplineSurface::bezier([0, 2], &four, &[]).unwrap_err()), "degree 0 is not one of 1 to 12");
    let weights = [1.0, 1.0, -1.0, 1.0];
    assert_eq!(
        say(SplineSurface::bezier([1, 1], &four, &weights).unwrap_err()),
        "weight 2 is -1, but must be above 0"
    );
    let knots = |u: &[f64]| SplineSurface::try_new([1, 1], [u.to_vec(), clamped_knots(1, 2)], &four, &[]);
    assert_eq!(
        say(knots(&[0.0, 0.0, 1.0]).unwrap_err()),
        "knots_u: 3 knots given, but degree 1 needs at least 4"
    );
    assert_eq!(
        say(knots(&[0.0, 0.0, 1.0, 0.5]).unwrap_err()),
        "knots_u: knot 3 is 0.5, below the one before"
    );
    assert_eq!(say(knots(&[0.0; 4]).unwrap_err()), "knots_u: the domain, from knot 1 on, is empty: 0 to 0");
    let plane = SplineSurface::bezier([1, 1], &four, &[]).unwrap();
    let outside = plane.restricted([[0.0, 1.0], [0.5, 1.5]]).unwrap_err();
    assert_eq!(say(outside), "domain: 0.5 to 1.5 along v is not a part of 0 to 1");
    assert!(Shape::Sphere { center: DVec3::ZERO, radius: 0.0 }.surface().is_err());
    let still = Shape::Cone { origin: DVec3::ZERO, axis: DVec3::ZERO, radius: 1.0 };
    assert_eq!(say(still.surface().unwrap_err()), "the axis must not be [0, 0, 0]");
}
