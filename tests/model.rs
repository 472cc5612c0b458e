//! Objects through the library alone, without any file: all shapes, deformers and representations.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::{DAffine3, DVec2, DVec3, DVec4};
use trimray::analytic::{Expression, Extension, ExtensionMode, Region};
use trimray::deviation::{Deviation, deviation};
use trimray::mesh::{Corner, MeshParts, PolygonMesh};
use trimray::model::{
    Attributes, BuiltObject, Deformer, DragEdit, DragSources, DragUsing, Edit, EditError, Lattice,
    ModelError, MoveTo, Object, ObjectReport, Outside, PartsOutside, Representation, Shape,
};
use trimray::spline::Axis;
use trimray::surface;
use trimray::trace::{Ray, SurfaceInteraction, TracedScene};

/// A cube of quadrilaterals from (0, 0, 0) to (1, 1, 1), wound counter-clockwise seen from outside.
fn cube() -> MeshParts {
    let quads: [[u32; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let corner = |position| Corner { position, uv: None, normal: None };
    MeshParts {
        positions: (0..8).map(|i| DVec3::new((i & 1).into(), (i >> 1 & 1).into(), (i >> 2).into())).collect(),
        corners: quads.into_iter().flatten().map(corner).collect(),
        arities: vec![4; 6],
        face_objects: vec![0; 6],
        object_names: vec![String::new()],
        ..MeshParts::default()
    }
}

fn polygons() -> Shape {
    Shape::Polygons(Arc::new(PolygonMesh::try_new(cube()).expect("indices are within the cube")))
}

fn torus() -> surface::SplineSurface {
    let (center, axis) = (DVec3::splat(0.5), DVec3::new(0.2, 0.1, 1.0));
    surface::Shape::Torus { center, axis, major_radius: 1.0, minor_radius: 0.4 }
        .surface()
        .expect("its measures are positive")
}

/// A parallelogram, whose images under lattices are Bézier patches.
fn plane() -> surface::SplineSurface {
    let (u, v) = (DVec3::new(1.0, 0.0, 0.3), DVec3::new(0.2, 1.0, 0.0));
    surface::Shape::Plane { origin: DVec3::new(0.0, 0.0, 0.2), u, v }
        .surface()
        .expect("its measures are positive")
}

fn shapes() -> [(&'static str, Shape); 3] {
    [("cube", polygons()), ("torus", Shape::Surface(torus())), ("plane", Shape::Surface(plane()))]
}

/// Turns and moves; lengths stay.
fn placement() -> DAffine3 {
    let axis = DVec3::new(1.0, 2.0, 3.0).normalize();
    DAffine3::from_translation(DVec3::new(0.3, -0.2, 0.1)) * DAffine3::from_axis_angle(axis, 0.4)
}

fn object(shape: &Shape, deformers: &[Deformer]) -> Object {
    Object { placement: placement(), deformers: deformers.to_vec(), ..Object::new("it", shape.clone()) }
}

fn twisted() -> Lattice {
    let mut lattice = Lattice::new([2, 3, 2], [4, 5, 4]);
    lattice.edits.push(Edit::Twist { axis: Axis::Z, angle: 50.0 });
    lattice.edits.push(Edit::Move { index: [1, 2, 1], to: MoveTo::By(DVec3::new(0.1, 0.2, -0.1)) });
    lattice
}

/// A lattice of one knot box that is larger than the object: no border of a knot box crosses what is behind it.
fn weighted() -> Lattice {
    let bounds = Some([DVec3::splat(-3.0), DVec3::splat(4.0)]);
    let mut lattice = Lattice { bounds, ..Lattice::new([1, 2, 2], [2, 3, 3]) };
    lattice.edits.push(Edit::Bulge { axis: Axis::Y, amount: 0.3 });
    lattice.edits.push(Edit::Weight { index: [1, 1, 1], value: 2.0 });
    lattice
}

const CENTER: DVec3 = DVec3::new(0.4, 0.6, 0.5);

/// Stretches away from [`CENTER`] by exp(0.5 φ²) where φ <= 0.
fn stretched(bound: &str) -> Extension {
    let h = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]];
    let bound = Expression::parse(bound).expect("an expression");
    let region = Region { bound, center: CENTER, index: 2, h, epsilon: [[1.0; 3]; 3], factor: None };
    Extension::try_new(ExtensionMode::Radial, vec![region]).expect("the region is well made")
}

/// The same, in plain arithmetic.
fn stretch(phi: f64, point: DVec3) -> DVec3 {
    let e = if phi <= 0.0 { (0.5 * phi * phi).exp() } else { 1.0 };
    point + (e - 1.0) * (point - CENTER)
}

fn exact(shape: &Shape, deformers: &[Deformer]) -> (TracedScene, ObjectReport) {
    by(shape, deformers, Representation::Exact)
}

fn by(shape: &Shape, deformers: &[Deformer], representation: Representation) -> (TracedScene, ObjectReport) {
    let object = Object { representation, ..object(shape, deformers) };
    let BuiltObject { traced, report } = object.build().expect("it can be built");
    (TracedScene::new(vec![traced]), report)
}

/// Rays from a ball around a scene to places in its box, in the order of the golden ratio's multiples.
fn rays(scene: &TracedScene) -> Vec<Ray> {
    let [low, high] = scene.bounds();
    let size = (high - low).length();
    let part = |n: u32, step: f64| (f64::from(n) * step).fract();
    (1..1500)
        .map(|n| {
            let z = 2.0 * part(n, 0.754_877_666) - 1.0;
            let (sin, cos) = (std::f64::consts::TAU * part(n, 0.569_840_290)).sin_cos();
            let side = DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + z * DVec3::Z;
            let place = DVec3::new(part(n, 0.819_172_513), part(n, 0.671_043_606), part(n, 0.549_700_477));
            let origin = 0.5 * (low + high) + 1.5 * size * side;
            Ray::new(origin, low + place * (high - low) - origin)
        })
        .collect()
}

fn hits(scene: &TracedScene) -> Vec<SurfaceInteraction> {
    let found: Vec<_> = rays(scene).iter().filter_map(|ray| scene.closest_hit(ray)).collect();
    assert!(found.len() > 300, "only {} hits", found.len());
    found
}

/// Where lattices take a point, one after the other.
fn through(report: &ObjectReport, place: DVec3) -> DVec3 {
    let through = |place, lattice: &trimray::model::BuiltLattice| {
        let [low, high] = lattice.volume.bounds();
        lattice.volume.eval(DVec3::clamp(place, low, high)).expect("it is inside").position
    };
    report.lattices.iter().fold(place, through)
}

#[test]
fn shapes_are_where_they_are_placed() {
    for (name, shape) in shapes() {
        let (scene, report) = exact(&shape, &[]);
        assert!(report.lattices.is_empty() && report.warnings.is_empty());
        for hit in hits(&scene) {
            assert!(hit.rest.distance(hit.position) < 1e-12, "{name}: {}", hit.rest - hit.position);
            let back = placement().inverse().transform_point3(hit.position);
            let off = match &shape {
                Shape::Polygons(_) => (back - 0.5).abs().max_element() - 0.5,
                Shape::Surface(surface) => surface.eval(hit.uv).distance(back),
            };
            assert!(off.abs() < 1e-12, "{name}: off by {off:e}");
        }
    }
}

#[test]
fn identity_lattices_are_the_identity() {
    let identity: Deformer = Lattice::new([2, 3, 1], [4, 5, 3]).into();
    let coarse: Deformer = Lattice::new([1, 2, 3], [2, 3, 4]).into();
    for (name, shape) in shapes() {
        let (plain, _) = exact(&shape, &[]);
        for deformers in [vec![identity.clone()], vec![identity.clone(), coarse.clone()]] {
            let (scene, report) = exact(&shape, &deformers);
            assert_eq!(report.lattices.len(), deformers.len());
            for ray in rays(&plain) {
                let [a, b] = [&plain, &scene].map(|scene| scene.closest_hit(&ray));
                assert_eq!(a.is_some(), b.is_some(), "{name}: {ray:?}");
                let (Some(a), Some(b)) = (a, b) else { continue };
                assert!(a.position.distance(b.position) < 1e-10, "{name}: {}", a.position - b.position);
                assert!(a.normal.distance(b.normal) < 1e-8, "{name}: {} {}", a.normal, b.normal);
            }
        }
    }
}

#[test]
fn exact_hits_are_where_the_lattices_take_their_places() {
    for (name, shape) in shapes() {
        let chains = [vec![twisted().into()], vec![twisted().into(), weighted().into()]];
        for deformers in chains {
            let (scene, report) = exact(&shape, &deformers);
            for hit in hits(&scene) {
                let off = through(&report, hit.rest).distance(hit.position);
                assert!(off < 1e-10, "{name}, {} lattices: off by {off:e}", deformers.len());
            }
        }
    }
}

#[test]
fn exact_hits_are_where_the_formula_of_extension_functions_takes_their_parameters() {
    let disc = "(u-0.5)^2 + (v-0.5)^2 - 0.1";
    let phi = |uv: DVec2| (uv.x - 0.5).powi(2) + (uv.y - 0.5).powi(2) - 0.1;
    for (name, surface) in [("torus", torus()), ("plane", plane())] {
        let shape = Shape::Surface(surface.clone());
        let (extension, lattice): (Deformer, Deformer) = (stretched(disc).into(), twisted().into());
        let placed = |uv: DVec2| placement().transform_point3(surface.eval(uv));
        let (first, _) = exact(&shape, std::slice::from_ref(&extension));
        let (before, before_report) = exact(&shape, &[extension.clone(), lattice.clone()]);
        let (after, after_report) = exact(&shape, &[lattice, extension]);
        for hit in hits(&first) {
            let want = stretch(phi(hit.uv), placed(hit.uv));
            assert!(hit.position.distance(want) < 1e-10, "{name}: {} {want}", hit.position);
        }
        for hit in hits(&before) {
            let want = through(&before_report, stretch(phi(hit.uv), placed(hit.uv)));
            assert!(hit.position.distance(want) < 1e-10, "{name}: {} {want}", hit.position);
        }
        for hit in hits(&after) {
            let want = stretch(phi(hit.uv), through(&after_report, placed(hit.uv)));
            assert!(hit.position.distance(want) < 1e-10, "{name}: {} {want}", hit.position);
        }
    }
}

/// How far the triangles of a representation are from the exact shape.
fn distance(shape: &Shape, deformers: &[Deformer], representation: Representation) -> Deviation {
    let scenes = [Representation::Exact, representation].map(|way| by(shape, deformers, way).0);
    let [exact, flat] = scenes.each_ref().map(|scene| scene.objects()[0].faces());
    deviation(exact, flat, &AtomicBool::new(false)).expect("no border is a curve")
}

#[test]
fn adaptive_triangles_are_within_their_tolerance() {
    let tolerance = 2e-3;
    for (name, shape) in shapes() {
        let chains: Vec<Vec<Deformer>> = match shape {
            Shape::Polygons(_) => vec![vec![twisted().into()], vec![twisted().into(), weighted().into()]],
            // regions all over the surface, which have no border
            Shape::Surface(_) => vec![
                vec![weighted().into()],
                vec![stretched("-0.8").into()],
                vec![stretched("-0.5 - 0.2*u*v").into(), weighted().into()],
            ],
        };
        for deformers in chains {
            let representation = Representation::Adaptive { tolerance };
            let found = distance(&shape, &deformers, representation);
            assert!(found.max <= tolerance, "{name}: {} is above {tolerance}", found.max);
            assert!(found.max > 0.05 * tolerance || name != "torus", "{name}: far too fine, {}", found.max);
            let (scene, report) = by(&shape, &deformers, representation);
            assert_eq!(report.subpolygons, scene.objects()[0].faces().len());
        }
    }
}

#[test]
fn pointwise_triangles_come_four_times_closer_with_each_level() {
    let shape = polygons();
    for deformers in [vec![twisted().into()], vec![twisted().into(), weighted().into()]] {
        let error = |level| distance(&shape, &deformers, Representation::Pointwise { level }).max;
        let errors = [2, 3, 4].map(error);
        for pair in errors.windows(2) {
            assert!((pair[0] / pair[1] - 4.0).abs() < 0.8, "{errors:?}");
        }
        let (scene, _) = by(&shape, &deformers, Representation::Pointwise { level: 2 });
        assert_eq!(scene.objects()[0].faces().len(), 12 * 16);
    }
}

#[test]
fn triangular_patches_are_the_exact_shape() {
    let shape = polygons();
    for deformers in [vec![], vec![Deformer::from(twisted())], vec![weighted().into()]] {
        let (exact, _) = exact(&shape, &deformers);
        let (triangular, report) = by(&shape, &deformers, Representation::FengPeng);
        assert_eq!(report.triangular.map(|counts| counts.patches), Some(report.subpolygons));
        for ray in rays(&exact) {
            let [a, b] = [&exact, &triangular].map(|scene| scene.closest_hit(&ray));
            assert_eq!(a.is_some(), b.is_some(), "{ray:?}");
            let (Some(a), Some(b)) = (a, b) else { continue };
            assert!(a.position.distance(b.position) < 1e-11, "{}", a.position - b.position);
            assert_eq!(a.face, b.face);
        }
    }
}

#[test]
fn drags_take_points_and_what_rays_see_to_their_targets() {
    for (name, shape) in shapes() {
        let (before, _) = exact(&shape, &[twisted().into()]);
        let hit = hits(&before)[7];
        let ray = Ray::new(hit.position + hit.normal, -hit.normal);
        let target = hit.position + DVec3::new(0.05, -0.03, 0.1);
        let drag = |sources| {
            let mut lattice = twisted();
            let (targets, using) = (vec![target], DragUsing::Points);
            lattice.edits.push(Edit::Drag(DragEdit { sources, targets, using, least_squares: false }));
            exact(&shape, &[lattice.into()]).1.lattices.remove(0)
        };
        let [by_point, by_ray] =
            [DragSources::Points(vec![hit.rest]), DragSources::Rays(vec![ray])].map(drag);
        for built in [&by_point, &by_ray] {
            assert_eq!(built.drags[0].edit, 3, "{name}");
            assert!(built.drags[0].drags[0].residual < 1e-12, "{name}");
            assert!(built.volume.eval(hit.rest).unwrap().position.distance(target) < 1e-9, "{name}");
        }
        let pairs = by_point.lattice.points().iter().zip(by_ray.lattice.points());
        assert!(pairs.map(|(a, b): (&DVec4, &DVec4)| a.distance(*b)).fold(0.0, f64::max) < 1e-9, "{name}");
    }
}

#[test]
fn errors_say_which_deformer_and_edit_they_are_of() {
    let fault = |object: &Object| object.build().unwrap_err();
    let shape = polygons();
    let extended = object(&shape, &[twisted().into(), stretched("-1").into()]);
    assert_eq!(fault(&extended), ModelError::NeedsSurface { deformer: 1, name: "extension" });

    let mut far = twisted();
    far.edits.push(Edit::Weight { index: [4, 0, 0], value: 1.0 });
    let error = fault(&object(&shape, &[weighted().into(), far.into()]));
    assert_eq!((error.deformer(), error.edit()), (Some(1), Some(2)));
    let source = EditError::NoPoint { index: [4, 0, 0], last: [3, 4, 3] };
    assert_eq!(error, ModelError::Edit { deformer: 1, edit: 2, source });

    let mut unseen = twisted();
    let sources = DragSources::Rays(vec![Ray::new(DVec3::splat(9.0), DVec3::ONE)]);
    let using = DragUsing::Points;
    unseen.edits =
        vec![Edit::Drag(DragEdit { sources, targets: vec![DVec3::ZERO], using, least_squares: false })];
    let error = fault(&object(&shape, &[unseen.into()]));
    assert_eq!(error, ModelError::Edit { deformer: 0, edit: 0, source: EditError::Unseen { ray: 0 } });

    let bounds = Some([DVec3::ZERO, DVec3::new(1.0, 1.0, 0.5)]);
    let small = Lattice { bounds, outside: Outside::Error, ..twisted() };
    let outside = Object { placement: DAffine3::IDENTITY, ..object(&shape, &[small.clone().into()]) };
    let error = fault(&outside);
    let parts = PartsOutside::Faces(vec![1, 2, 3, 4, 5]);
    assert_eq!(error, ModelError::Outside { deformer: 0, parts });
    assert!(
        error.to_string().starts_with("5 faces are not wholly in the lattice's box (face 1, 2, 3, 4, 5);")
    );
    let error = fault(&object(&Shape::Surface(torus()), &[small.into()]));
    assert_eq!(error, ModelError::Outside { deformer: 0, parts: PartsOutside::Some });

    let flat = Lattice::new([2; 3], [2; 3]);
    assert!(matches!(fault(&object(&shape, &[flat.into()])), ModelError::Lattice { deformer: 0, .. }));
}

#[test]
fn representations_and_attributes_that_a_shape_has_not_are_errors() {
    let fault = |object: Object| object.build().unwrap_err();
    let (shape, surface) = (polygons(), Shape::Surface(torus()));
    for representation in [Representation::FengPeng, Representation::Pointwise { level: 1 }] {
        let object = Object { representation, ..object(&surface, &[]) };
        assert_eq!(fault(object), ModelError::NeedsPolygons);
    }
    let representation = Representation::FengPeng;
    let two = Object { representation, ..object(&shape, &[twisted().into(), weighted().into()]) };
    assert_eq!(fault(two), ModelError::OneLattice);
    let level = 12;
    let many = Object { representation: Representation::Pointwise { level }, ..object(&shape, &[]) };
    assert!(matches!(fault(many), ModelError::TooManyTriangles { level: 12, .. }));

    let attributes = Attributes { vertex_normals: true, texture_coordinates: false };
    assert_eq!(fault(Object { attributes, ..object(&shape, &[]) }), ModelError::NoNormals);
    let attributes = Attributes { vertex_normals: false, texture_coordinates: true };
    let error = fault(Object { attributes, ..object(&shape, &[]) });
    assert_eq!(error, ModelError::NoTextureCoordinates { face: 0 });
    let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 0.0));
    assert_eq!(fault(Object { placement: flat, ..object(&shape, &[]) }), ModelError::NoArea);
}

#[test]
fn vertex_normals_are_carried_by_every_representation() {
    let mut parts = cube();
    parts.normals = parts.positions.iter().map(|position| *position - 0.5).collect();
    for corner in &mut parts.corners {
        corner.normal = Some(corner.position);
    }
    let shape = Shape::Polygons(Arc::new(PolygonMesh::try_new(parts).unwrap()));
    let attributes = Attributes { vertex_normals: true, texture_coordinates: false };
    for representation in [
        Representation::Exact,
        Representation::FengPeng,
        Representation::Pointwise { level: 3 },
        Representation::Adaptive { tolerance: 1e-3 },
    ] {
        let object = Object { representation, attributes, ..object(&shape, &[]) };
        let scene = TracedScene::new(vec![object.build().unwrap().traced]);
        for hit in hits(&scene) {
            // the corners' normals interpolated over a cube are the direction from its middle
            let back = placement().inverse().transform_point3(hit.position) - 0.5;
            let want = placement().transform_vector3(back).normalize();
            let off = hit.shading_normal.distance(want);
            // those of split triangles are made unit vectors at their corners, which changes their lengths between
            let most = if representation.level().is_some() { 0.02 } else { 1e-9 };
            assert!(off < most, "{representation}: {} {want}", hit.shading_normal);
        }
    }
}
