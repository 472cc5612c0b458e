use std::collections::HashMap;
use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};

use super::*;
use crate::patch::{Deformation, DeformedPolygons, Place, PlanarPolygon, Shell, deform_polygons};
use crate::spline::KnotBox;
use crate::spline::{Axis, ControlLattice, SplineVolume};
use crate::subdivide::FrameChoice;
use crate::surface::Shape;
use crate::test_support::{Noise, ball_triangles, cube_triangles, deform, random_volume};
use crate::trace::{NoAttributes, VertexAttributes};

fn object(shell: Shell) -> TracedObject {
    TracedObject { name: "test".into(), shell, attributes: Box::new(NoAttributes) }
}

fn made(object: &TracedObject, fineness: Fineness) -> Tessellation {
    tessellate(object, fineness, &AtomicBool::new(false)).unwrap()
}

/// Each directed edge between positions, and how often it is there.
fn directed_edges(mesh: &Tessellation) -> HashMap<[[u64; 3]; 2], i32> {
    let place = |vertex: u32| (mesh.positions[vertex as usize] + 0.0).to_array().map(f64::to_bits);
    let mut edges = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            *edges.entry([place(from), place(to)]).or_default() += 1;
        }
    }
    edges
}

/// Every edge once in each direction.
fn assert_closed(mesh: &Tessellation, what: &str) {
    let edges = directed_edges(mesh);
    for ([from, to], count) in &edges {
        assert_eq!(*count, 1, "{what}: an edge is there twice in one direction");
        assert_eq!(edges.get(&[*to, *from]), Some(&1), "{what}: an edge has no partner");
    }
    assert!(!mesh.triangles.is_empty(), "{what}");
}

/// Six times the volume that the triangles enclose.
fn volume_times_six(mesh: &Tessellation) -> f64 {
    let corner = |vertex: u32| mesh.positions[vertex as usize];
    mesh.triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c)))).sum()
}

#[test]
fn closed_solids_stay_closed() {
    let mut noise = Noise(5);
    for (name, solid) in [("cube", cube_triangles()), ("ball", ball_triangles())] {
        for (degree, rational) in [([1, 2, 3], false), ([2, 2, 2], true), ([3, 3, 3], false)] {
            let volume = random_volume(&mut noise, degree, [4, 5, 4], 0.1, rational);
            for frame in [FrameChoice::Parallelogram, FrameChoice::Rectangle] {
                let object = object(deform(&solid, Some(&volume), frame));
                for fineness in [Fineness::Level(0), Fineness::Level(2), Fineness::Tolerance(1e-3)] {
                    let mesh = made(&object, fineness);
                    assert_closed(&mesh, &format!("{name} {degree:?} {frame:?} {fineness:?}"));
                    assert!(volume_times_six(&mesh) > 1.0, "triangles face outwards");
                }
            }
        }
    }
}

/// The ball with each of its vertices moved at random, to just beside a knot plane: those at 1/n, 2/n, … of `planes` n.
fn badly_placed_ball(noise: &mut Noise, planes: u32) -> Vec<[DVec3; 3]> {
    let mut moved: HashMap<[u64; 3], DVec3> = HashMap::new();
    let mut place = |vertex: DVec3| {
        *moved.entry(vertex.to_array().map(f64::to_bits)).or_insert_with(|| {
            let mut point = vertex.lerp(DVec3::splat(0.5), 0.2) + 0.08 * noise.vector();
            // one axis each: needles along two planes are not all closed by index
            let axis = [0, 1, 2][usize::from(noise.next() > 0.0) + usize::from(noise.next() > 0.0)];
            // not the faces of the box, where what is outside is torn off
            let plane = (point[axis] * f64::from(planes)).round().clamp(1.0, f64::from(planes - 1));
            let off = 10_f64.powf(-10.0 + 7.0 * noise.next());
            point[axis] = plane / f64::from(planes) + if noise.next() > 0.0 { off } else { -off };
            point
        })
    };
    ball_triangles().into_iter().map(|triangle| triangle.map(&mut place)).collect()
}

/// Every edge is there once in each direction, by the vertices' numbers.
fn assert_closed_by_index(mesh: &Tessellation, what: &str) {
    let mut edges: HashMap<[u32; 2], u32> = HashMap::new();
    let first = |vertex: u32| mesh.first_at_point[vertex as usize];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(first);
        for edge in [[a, b], [b, c], [c, a]] {
            *edges.entry(edge).or_default() += 1;
        }
    }
    let open = edges.iter().filter(|([a, b], count)| **count != 1 || !edges.contains_key(&[*b, *a])).count();
    assert_eq!(open, 0, "{what}: of {} edges", edges.len());
}

#[test]
fn solids_with_badly_placed_vertices_are_closed_by_index() {
    let mut noise = Noise(77);
    for number in 0..200 {
        let solid = badly_placed_ball(&mut noise, 3);
        let volume = random_volume(&mut noise, [2; 3], [5; 3], 0.05, number % 2 == 1);
        let frame = if number % 4 < 2 { FrameChoice::Parallelogram } else { FrameChoice::Rectangle };
        let mesh = made(&object(deform(&solid, Some(&volume), frame)), Fineness::Level(0));
        assert_closed_by_index(&mesh, &format!("solid {number}"));
    }
}

/// A volume over part of the unit cube, whose boundary stays in place to its tangents.
fn held_volume() -> SplineVolume {
    let bounds = [DVec3::new(0.2, 0.0, 0.3), DVec3::new(0.8, 1.0, 1.0)];
    let mut lattice = ControlLattice::identity([2; 3], [7; 3], bounds, 2).unwrap();
    lattice.twist(Axis::Z, 40.0);
    lattice.volume().unwrap()
}

#[test]
fn solids_partly_outside_the_lattice_stay_closed() {
    // the pieces outside are not cut at the knot planes, so their edges have corners of pieces inside on them
    for solid in [cube_triangles(), ball_triangles()] {
        let object = object(deform(&solid, Some(&held_volume()), FrameChoice::default()));
        assert!(object.faces().iter().any(|patch| patch.knot_box().is_none()));
        for fineness in [Fineness::Level(0), Fineness::Level(2), Fineness::Tolerance(1e-4)] {
            assert_closed(&made(&object, fineness), &format!("{fineness:?}"));
        }
    }
}

/// A tetrahedron of random corners in the unit cube, outward.
fn tetrahedron(noise: &mut Noise) -> [[DVec3; 3]; 4] {
    let mut corner = || DVec3::new(noise.next(), noise.next(), noise.next()) + 0.5;
    let [a, b, c, d] = [corner(), corner(), corner(), corner()];
    let [b, c] = if (b - a).cross(c - a).dot(d - a) < 0.0 { [b, c] } else { [c, b] };
    [[a, b, c], [a, d, b], [b, d, c], [c, d, a]]
}

#[test]
fn patches_halved_for_their_weights_stay_closed() {
    // the halves end within edges of neighbours that are not halved, or at other places
    let mut noise = Noise(8);
    let mut halved = 0;
    for _ in 0..40 {
        let solid = tetrahedron(&mut noise);
        let polygons: Vec<_> =
            (0..).zip(&solid).map(|(face, corners)| PlanarPolygon { face, corners }).collect();
        let bounds = [DVec3::ZERO, DVec3::ONE];
        let mut lattice = ControlLattice::identity([3; 3], [5; 3], bounds, 0).unwrap();
        for place in 0..125 {
            let weight = libm::exp(12.0 * noise.next());
            lattice.set_weight([place / 25, place / 5 % 5, place % 5], weight).unwrap();
        }
        let volume = lattice.volume().unwrap();
        let deformation = Deformation { volume: Some(&volume), ..Deformation::default() };
        let DeformedPolygons { shell, subpolygons, .. } = deform_polygons(&polygons, deformation).unwrap();
        halved += shell.faces().iter().map(|face| face.region.len()).sum::<usize>() - subpolygons;
        assert_closed(&made(&object(shell), Fineness::Level(1)), "halved");
    }
    assert!(halved > 0, "the weights are extreme enough");
}

/// The unit square raised to the parabola `z = 2 h x (1 - x)`.
fn arch(h: f64) -> TracedObject {
    let bounds = [DVec3::new(0.0, 0.0, -0.5), DVec3::new(1.0, 1.0, 0.5)];
    let mut lattice = ControlLattice::identity([2, 1, 1], [3, 2, 2], bounds, 0).unwrap();
    for (j, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        lattice.move_by([1, j, k], h * DVec3::Z).unwrap();
    }
    let volume = lattice.volume().unwrap();
    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let square = [
        [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0)],
        [corner(0.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)],
    ];
    object(deform(&square, Some(&volume), FrameChoice::default()))
}

#[test]
fn the_deviation_is_that_of_a_parabolas_chords() {
    // a chord over a width w of a parabola of second derivative 4 h is off by w² 4 h / 8 at its middle, measured upwards;
    // the arch is so flat that this is nearly the distance
    let h = 1e-3;
    let object = arch(h);
    for level in 0..5_u32 {
        let mesh = made(&object, Fineness::Level(level));
        assert_eq!(mesh.triangles.len(), 2 * 4_usize.pow(level));
        let want = 0.25_f64.powi(level as i32) * 4.0 * h / 8.0;
        assert!((mesh.deviation / want - 1.0).abs() < 1e-3, "level {level}: {}, want {want}", mesh.deviation);
    }
}

#[test]
fn the_tolerance_is_kept_where_nobody_measured() {
    let steep = arch(0.8);
    let mut before = 0;
    for tolerance in [1e-2, 1e-3, 1e-4] {
        let mesh = made(&steep, Fineness::Tolerance(tolerance));
        assert!(mesh.deviation <= tolerance);
        let mut worst: f64 = 0.0;
        let mut noise = Noise(2);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            for _ in 0..20 {
                let (u, v) = (noise.next() + 0.5, noise.next() + 0.5);
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let p = a + u * (b - a) + v * (c - a);
                let slope = 1.6 * (1.0 - 2.0 * p.x);
                worst = worst.max((p.z - 1.6 * p.x * (1.0 - p.x)).abs() / (1.0 + slope * slope).sqrt());
            }
        }
        assert!(worst <= 1.05 * tolerance && worst > 0.1 * tolerance, "{tolerance}: {worst}");
        assert!(mesh.triangles.len() > before, "no finer than before");
        before = mesh.triangles.len();
    }
    let even = made(&steep, Fineness::Level(6));
    assert!(even.deviation > 0.5e-4 && even.deviation <= 1e-4, "an even one for the last tolerance");
    // a quarter but for the tenth of the tolerance that is kept in hand
    assert!(3 * before < even.triangles.len(), "straight one way, so less is enough: {before}");
}

#[test]
fn flat_objects_stay_coarse() {
    let object = object(deform(&cube_triangles(), None, FrameChoice::default()));
    assert_eq!(made(&object, Fineness::Tolerance(1e-12)).triangles.len(), 12);
}

#[test]
fn torn_surfaces_stay_apart() {
    // the lattice covers half of the cube, and its boundary moves
    let bounds = [DVec3::ZERO, DVec3::new(1.0, 1.0, 0.5)];
    let mut lattice = ControlLattice::identity([2; 3], [4; 3], bounds, 0).unwrap();
    lattice.move_by([1, 1, 3], DVec3::new(0.0, 0.0, 0.1)).unwrap();
    lattice.move_by([1, 0, 3], DVec3::new(0.0, 0.0, 0.1)).unwrap();
    let volume = lattice.volume().unwrap();
    let object = object(deform(&cube_triangles(), Some(&volume), FrameChoice::default()));
    let mesh = made(&object, Fineness::Tolerance(1e-4));
    assert!(mesh.deviation <= 1e-4, "no vertex is shared across the tear");
    let edges = directed_edges(&mesh);
    assert!(edges.keys().any(|[from, to]| !edges.contains_key(&[*to, *from])), "there is a tear");
}

/// x and y of the undeformed object; another map for odd polygons.
#[derive(Debug)]
struct Planar;

impl VertexAttributes for Planar {
    fn uv(&self, polygon: u32, place: Place) -> DVec2 {
        let rest = place.coordinates();
        DVec2::new(rest.x + f64::from(polygon % 2), rest.y)
    }

    fn uv_gradients(&self, _polygon: u32, _place: Place) -> Option<[DVec3; 2]> {
        Some([DVec3::X, DVec3::Y])
    }

    fn normal(&self, _polygon: u32, place: Place, _knot_box: Option<KnotBox>) -> Option<DVec3> {
        (place.coordinates().x > 0.5).then_some(DVec3::Z)
    }
}

#[test]
fn vertices_are_doubled_where_texture_coordinates_change() {
    let mut object = arch(0.3);
    let plain = made(&object, Fineness::Level(3));
    assert!(plain.uvs.is_empty());
    assert_eq!(plain.positions.len(), 81);
    object.attributes = Box::new(Planar);
    let mesh = made(&object, Fineness::Level(3));
    assert_eq!((mesh.uvs.len(), mesh.positions.len()), (90, 90), "the diagonal's nine are there twice");
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
        assert!((normal.length() - 1.0).abs() < 1e-12, "{normal}");
        assert!(position.x <= 0.5 + 1e-9 || *normal == DVec3::Z, "{position} {normal}");
    }
    for (position, uv) in mesh.positions.iter().zip(&mesh.uvs) {
        assert!(
            (uv.x.rem_euclid(1.0) - position.x.rem_euclid(1.0)).abs() < 1e-12
                && (uv.y - position.y).abs() < 1e-12
        );
    }
}

#[test]
fn work_that_cannot_be_done_is_refused() {
    let object = arch(0.3);
    let stopped = tessellate(&object, Fineness::Level(1), &AtomicBool::new(true));
    assert_eq!(stopped, Err(TessellateError::Interrupted));
    let go_on = AtomicBool::new(false);
    let fine = tessellate(&object, Fineness::Level(14), &go_on);
    assert_eq!(fine, Err(TessellateError::TooMany));
}

#[test]
fn triangles_beside_a_curved_edge_are_near_the_surface() {
    // about the circle where a torus stands, triangles within the circle's plane are tangent to it, but far from it
    let torus = Shape::Torus { center: DVec3::ZERO, axis: DVec3::Z, major_radius: 2.0, minor_radius: 0.8 };
    let object = object(torus.surface().unwrap().shell());
    for tolerance in [1e-2, 1e-3] {
        let mesh = made(&object, Fineness::Tolerance(tolerance));
        let off = |p: DVec3| {
            let across = p.reject_from(DVec3::Z);
            ((across - 2.0 * across.normalize() + p.project_onto(DVec3::Z)).length() - 0.8).abs()
        };
        let mut worst: f64 = 0.0;
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            for (u, v) in [(1.0 / 3.0, 1.0 / 3.0), (0.5, 0.5), (0.5, 0.0), (0.0, 0.5)] {
                worst = worst.max(off(a + u * (b - a) + v * (c - a)));
            }
        }
        assert!(worst <= 1.05 * tolerance, "{tolerance}: {worst}");
    }
}
