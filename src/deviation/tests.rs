use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3, DVec4};

use super::{Deviation, deviation};
use crate::analytic::{Chain, CoverSettings, Step, cover};
use crate::patch::{
    BezierPatch, Chart, Deformation, Face, Facet, Place, PlanarPolygon, Shell, deform_polygons,
};
use crate::spline::SplineVolume;
use crate::subdivide::{Frame, FrameChoice};
use crate::tessellate::facets;
use crate::test_support::{Noise, cube_triangles, deform, random_volume};

/// Facets with their corners on the deformed shape: each triangle in 4^level.
fn pointwise(triangles: &[[DVec3; 3]], volume: &SplineVolume, level: u32) -> Vec<Face> {
    let n = 1 << level;
    let mut patches = Vec::new();
    for (face, [a, b, c]) in (0..).zip(triangles) {
        let at = |i: u32, j: u32| {
            let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(n));
            *a * (1.0 - u - v) + *b * u + *c * v
        };
        let mut push = |rest: [DVec3; 3]| {
            let corners = rest.map(|rest| volume.eval(rest).unwrap().position);
            patches.extend(
                Facet { polygon: face, face, rest: rest.map(Place::Point), corners, vertices: [0, 1, 2] }
                    .to_face(),
            );
        };
        for i in 0..n {
            for j in 0..n - i {
                push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                if i + j + 1 < n {
                    push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
    }
    patches
}

fn between(exact: &[Face], flat: &[Face]) -> Deviation {
    deviation(exact, flat, &AtomicBool::new(false)).unwrap()
}

/// The square [0, 1]² at height 0.5, bent so that its height is `rise` x (1 - x), and its two triangles.
fn arch(rise: f64) -> (Vec<Face>, Vec<Face>) {
    let identity = SplineVolume::identity([2, 1, 1], [3, 2, 2], [DVec3::ZERO, DVec3::ONE]).unwrap();
    let mut points = identity.control_points();
    // Bernstein form of x (1 - x): only the middle, by 1/2
    for point in &mut points {
        if point.x == 0.5 {
            *point += DVec4::new(0.0, 0.0, 0.5 * rise, 0.0);
        }
    }
    let volume = SplineVolume::try_new(identity.axes().clone(), &points).unwrap();
    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.5);
    let triangles = [
        [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0)],
        [corner(0.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)],
    ];
    (
        deform(&triangles, Some(&volume), FrameChoice::Parallelogram).into_faces(),
        pointwise(&triangles, &volume, 0),
    )
}

#[test]
fn the_height_of_an_arch_is_found() {
    for rise in [1e-6, 1e-3, 0.1, 1.0, 4.0] {
        let (exact, flat) = arch(rise);
        let found = between(&exact, &flat);
        let want = 0.25 * rise;
        assert!(found.max <= want * (1.0 + 1e-9) && want <= found.bound, "{rise}: {found:?}");
        assert!(found.bound <= 1.0101 * found.max, "{rise}: {found:?}");
        // the mean of x (1 - x) is 1/6
        assert!(rise > 0.01 || (found.mean - rise / 6.0).abs() < 1e-3 * rise, "{rise}: {found:?}");
        let steepest = libm::atan(rise).to_degrees();
        assert!((found.normal_max_degrees - steepest).abs() < 1e-6, "{rise}: {found:?}");
    }
}

/// The greatest distance of many points of the surface from the triangles, and of many points of the triangles from many of
/// the surface.
fn sampled(exact: &[Face], flat: &[Face]) -> [f64; 2] {
    let points = |patches: &[Face], steps: u32| -> Vec<DVec3> {
        let of_patch = |patch: &Face| {
            let mut points = Vec::new();
            for trim_loop in patch.region.loops() {
                let corners = patch.region.corners(&trim_loop);
                for k in 1..corners.len() - 1 {
                    for i in 0..=steps {
                        for j in 0..=steps - i {
                            let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(steps));
                            let st: DVec2 = corners[0] * (1.0 - u - v) + corners[k] * u + corners[k + 1] * v;
                            points.push(patch.patch.eval(st).position);
                        }
                    }
                }
            }
            points
        };
        patches.iter().flat_map(of_patch).collect()
    };
    let triangles: Vec<[DVec3; 3]> = flat
        .iter()
        .map(|patch| {
            let p: Vec<_> = patch.patch.positions().collect();
            [p[0], p[2], p[1]]
        })
        .collect();
    let to_flat =
        |p: &DVec3| triangles.iter().map(|t| super::triangle::distance(*t, *p)).fold(f64::INFINITY, f64::min);
    let surface = points(exact, 10);
    let to_surface = |p: DVec3| surface.iter().map(|q| p.distance(*q)).fold(f64::INFINITY, f64::min);
    [
        surface.iter().map(to_flat).fold(0.0, f64::max),
        points(flat, 6).into_iter().map(to_surface).fold(0.0, f64::max),
    ]
}

#[test]
fn distances_are_those_of_many_points() {
    let mut noise = Noise(91);
    let triangles = cube_triangles();
    for case in 0..4 {
        let degree = [[2, 2, 2], [3, 2, 1], [1, 3, 2]][case % 3];
        let volume = random_volume(&mut noise, degree, degree.map(|k| k + 2), 0.15, case == 3);
        let exact = deform(&triangles, Some(&volume), FrameChoice::Parallelogram).into_faces();
        for level in 0..2 {
            let flat = pointwise(&triangles, &volume, level);
            let found = between(&exact, &flat);
            let [of_surface, of_triangles] = sampled(&exact, &flat);
            assert!(of_surface <= found.bound, "case {case}, level {level}: {of_surface:e}, {found:?}");
            assert!(found.max <= found.bound && found.bound <= 1.0101 * found.max, "{found:?}");
            let sampled = of_surface.max(of_triangles);
            assert!(sampled > 0.9 * found.max, "case {case}, level {level}: {sampled:e}, {found:?}");
        }
    }
}

#[test]
fn flat_surfaces_are_where_their_triangles_are() {
    let volume = SplineVolume::identity([2; 3], [4; 3], [DVec3::ZERO, DVec3::ONE]).unwrap();
    let triangles = cube_triangles();
    let exact = deform(&triangles, Some(&volume), FrameChoice::Parallelogram).into_faces();
    let found = between(&exact, &pointwise(&triangles, &volume, 2));
    assert!(found.max < 1e-14 && found.bound < 1e-11, "{found:?}");
}

/// A triangle that reaches beyond the surface: only its own points tell.
#[test]
fn points_of_triangles_count_too() {
    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let triangle = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)];
    let polygons = [PlanarPolygon { face: 0, corners: &triangle }];
    let exact = deform_polygons(&polygons, Deformation::default()).unwrap().shell.into_faces();
    let corners = [triangle[0], corner(1.5, 0.0), corner(0.0, 1.0)];
    let flat = Facet { polygon: 0, face: 0, rest: triangle.map(Place::Point), corners, vertices: [0, 1, 2] }
        .to_face()
        .unwrap();
    let found = between(&exact, &[flat]);
    assert!(found.max <= 0.5 && 0.5 <= found.bound && found.bound < 0.51, "{found:?}");
}

#[test]
fn missing_triangles_are_told() {
    let (exact, flat) = arch(1.0);
    let error = deviation(&exact, &flat[1..], &AtomicBool::new(false)).unwrap_err();
    assert!(error.to_string().contains("stand for 0.5"), "{error}");
    let stopped = deviation(&exact, &flat, &AtomicBool::new(true)).unwrap_err();
    assert_eq!(stopped.to_string(), "interrupted");
}

/// The unit square, of which a lattice whose box ends at x = 0.3 lowers its part by 1: with a border within cells.
fn torn_square() -> Vec<Face> {
    let corners = [DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 0.0)].map(|p| p.extend(1.0));
    let base = Face::untrimmed(
        Chart::Plane(Frame { origin: DVec3::ZERO, s: DVec3::X, t: DVec3::Y }),
        BezierPatch::new([1, 1], corners.to_vec()),
    );
    let [low, high] = [DVec3::splat(-2.0), DVec3::new(0.3, 2.0, 2.0)];
    let identity = SplineVolume::identity([1; 3], [2; 3], [low, high]).unwrap();
    let points: Vec<_> =
        identity.control_points().iter().map(|point| *point - DVec4::new(0.0, 0.0, 1.0, 0.0)).collect();
    let volume = SplineVolume::try_new(identity.axes().clone(), &points).unwrap();
    let chain = Arc::new(Chain::try_new(vec![Step::Volume(volume)]).unwrap());
    cover(&Shell::from(vec![base]), &chain, CoverSettings::default()).unwrap().shell.into_faces()
}

/// Two flat rectangles that meet at x = `border`, the left one lowered by 1.
fn torn_rectangles(border: f64) -> Vec<Face> {
    let mut patches = Vec::new();
    for ([from, to], z) in [([0.0, border], -1.0), ([border, 1.0], 0.0)] {
        let rest = [(from, 0.0), (to, 0.0), (to, 1.0), (from, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            let rest = [rest[a], rest[b], rest[c]];
            let corners = rest.map(|rest| rest + DVec3::new(0.0, 0.0, z));
            patches.extend(
                Facet { polygon: 0, face: 0, rest: rest.map(Place::Point), corners, vertices: [0, 1, 2] }
                    .to_face(),
            );
        }
    }
    patches
}

#[test]
fn both_sides_of_a_tear_count() {
    let exact = torn_square();
    assert!(exact.iter().any(|patch| !patch.leads()), "the border is within cells");
    let whole = between(&exact, &torn_rectangles(0.3));
    assert!(whole.max < 1e-13 && whole.bound < 1e-8, "{whole:?}");
    for off in [-0.15, 0.2] {
        let found = between(&exact, &torn_rectangles(0.3 + off));
        let want: f64 = off.abs();
        assert!(found.max <= want * (1.0 + 1e-9) && want <= found.bound * (1.0 + 1e-9), "{off}: {found:?}");
        assert!(found.bound <= 1.0101 * found.max, "{off}: {found:?}");
    }
}

/// A paraboloid over the unit square, of which a lattice whose box ends at height 0.09 lowers its part by 1: the cap inside
/// a circle of radius 0.3.
fn torn_paraboloid() -> Shell {
    let square = [0.25, -0.25, 0.25];
    let points = (0..9).map(|n| {
        let (i, j) = (n / 3, n % 3);
        DVec4::new(0.5 * i as f64, 0.5 * j as f64, square[i] + square[j], 1.0)
    });
    let base = Face::untrimmed(
        Chart::Plane(Frame { origin: DVec3::ZERO, s: DVec3::X, t: DVec3::Y }),
        BezierPatch::new([2, 2], points.collect()),
    );
    let ends = [DVec3::splat(-2.0), DVec3::new(2.0, 2.0, 0.09)];
    let identity = SplineVolume::identity([1; 3], [2; 3], ends).unwrap();
    let points: Vec<_> =
        identity.control_points().iter().map(|point| *point - DVec4::new(0.0, 0.0, 1.0, 0.0)).collect();
    let volume = SplineVolume::try_new(identity.axes().clone(), &points).unwrap();
    let chain = Arc::new(Chain::try_new(vec![Step::Volume(volume)]).unwrap());
    cover(&Shell::from(vec![base]), &chain, CoverSettings::default()).unwrap().shell
}

#[test]
fn tears_along_curves_are_followed() {
    let shell = torn_paraboloid();
    let patches = shell.faces();
    assert!(patches.iter().any(|patch| !patch.leads()), "the border is within cells");
    let cancel = AtomicBool::new(false);
    for tolerance in [1e-2, 1e-3] {
        let made = facets(&shell, tolerance, &cancel).unwrap();
        for facet in &made {
            let radius = |p: DVec3| (p.truncate() - 0.5).length();
            let lowered = facet.corners.map(|p| {
                let height = radius(p) * radius(p);
                assert!((p.z - height).abs() < 1e-9 || (p.z - height + 1.0).abs() < 1e-9, "{p}");
                p.z < height - 0.5
            });
            assert!(lowered == [lowered[0]; 3], "no triangle bridges the tear");
            let inside = |p: DVec3| if lowered[0] { radius(p) < 0.3 + 1e-6 } else { radius(p) > 0.3 - 1e-6 };
            assert!(facet.corners.into_iter().all(inside), "{facet:?}");
        }
        let triangles: Vec<_> = made.iter().filter_map(Facet::to_face).collect();
        let found = deviation(patches, &triangles, &cancel).unwrap();
        assert!(found.bound <= 1.0101 * found.max && found.bound <= tolerance, "{tolerance}: {found:?}");
        assert!(made.len() < 4000, "{}", made.len());
    }
}
