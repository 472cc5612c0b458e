use proptest::prelude::*;

use super::super::polygon_mesh::{Corner, MeshParts};
use super::*;

/// A mesh of the faces given as positions, nothing shared.
fn mesh(faces: &[&[[f64; 3]]]) -> PolygonMesh {
    let positions: Vec<DVec3> = faces.iter().flat_map(|face| face.iter().map(|&p| p.into())).collect();
    PolygonMesh::try_new(MeshParts {
        corners: (0..u32::try_from(positions.len()).unwrap())
            .map(|i| Corner { position: i, uv: None, normal: None })
            .collect(),
        positions,
        arities: faces.iter().map(|face| u32::try_from(face.len()).unwrap()).collect(),
        face_objects: vec![0; faces.len()],
        object_names: vec!["test".into()],
        ..MeshParts::default()
    })
    .unwrap()
}

fn prepare(faces: &[&[[f64; 3]]]) -> (PolygonSet, MeshNotes) {
    prepare_polygons(&mesh(faces), DAffine3::IDENTITY, MeshTolerances::default())
}

fn area(polygon: &Polygon<'_>) -> f64 {
    newell(polygon.positions).dot(polygon.normal)
}

const SQUARE: [[f64; 3]; 4] = [[0., 0., 1.], [1., 0., 1.], [1., 1., 1.], [0., 1., 1.]];

#[test]
fn convex_faces_stay_whole_with_the_vertices_on_their_edges() {
    let supported = [[0., 0., 0.], [0., 0.3, 0.1], [0., 3., 1.], [1., 3., 1.], [1., 0., 0.]];
    let (polygons, notes) = prepare(&[&SQUARE, &supported]);
    assert_eq!(polygons.len(), 2);
    assert_eq!(polygons.polygon(1).positions.len(), 5);
    assert_eq!(polygons.polygon(0).normal, DVec3::Z);
    assert_eq!(polygons.polygon(1).corners, [4, 5, 6, 7, 8]);
    assert_eq!((notes.faces, notes.triangles, notes.polygons), (2, 5, 2));
    assert_eq!(notes.triangulated_concave + notes.triangulated_nonplanar, 0);
    assert_eq!(polygons.bounds(), Some([DVec3::ZERO, DVec3::new(1., 3., 1.)]));
}

#[test]
fn turned_faces_keep_the_vertices_on_their_edges() {
    // thirds and tenths: rounding puts many of them on the inner side of their edge
    let face: Vec<_> = (0..10)
        .map(|i| [f64::from(i) / 10.0, f64::from(i) / 30.0, 0.0])
        .chain([[1., 2., 0.], [0., 2., 0.]])
        .collect();
    let mesh = mesh(&[&face]);
    for turn in 0..50 {
        let axis = DVec3::new(1.0, f64::from(turn), 3.0).normalize();
        let transform = DAffine3::from_axis_angle(axis, f64::from(turn) * 0.37)
            * DAffine3::from_translation(DVec3::splat(5.0));
        let (polygons, notes) = prepare_polygons(&mesh, transform, MeshTolerances::default());
        assert_eq!((polygons.len(), polygons.corner_count()), (1, 12), "turn {turn}: {notes}");
    }
}

#[test]
fn concave_faces_become_triangles_of_one_plane() {
    let arrow = [[0., 0., 0.], [2., 1., 0.], [0., 2., 0.], [1., 1., 0.]];
    let (polygons, notes) = prepare(&[&arrow, &SQUARE]);
    assert_eq!(polygons.iter().map(|p| p.face).collect::<Vec<_>>(), [0, 0, 1]);
    assert!(polygons.iter().all(|p| p.normal == DVec3::Z && area(&p) > 0.0));
    assert_eq!(polygons.iter().take(2).map(|p| area(&p)).sum::<f64>(), 1.0);
    assert_eq!(notes.triangulated_concave, 1);
}

#[test]
fn nonplanar_quads_are_cut_along_the_shorter_diagonal() {
    let quad = [[0., 0., 0.], [2., 0., 0.5], [3., 2., 0.], [0., 1., 0.5]];
    let (polygons, notes) = prepare(&[&quad]);
    assert_eq!(polygons.iter().map(|p| p.corners.to_vec()).collect::<Vec<_>>(), [[1, 2, 3], [1, 3, 0]]);
    assert_eq!(notes.triangulated_nonplanar, 1);
    // concave seen from above: the shorter diagonal 1-3 is outside
    let dart = [[0., 0., 0.], [3., 1., 0.1], [1., 0., 0.], [3., -1., 0.]].map(|[x, y, z]| [x, -y, z]);
    let (polygons, notes) = prepare(&[&dart]);
    assert!(polygons.iter().all(|p| p.corners.contains(&0) && p.corners.contains(&2)), "{polygons:?}");
    assert_eq!((polygons.len(), notes.triangulated_nonplanar), (2, 1));
}

#[test]
fn faces_without_area_are_left_out_and_named() {
    let line = [[0., 0., 0.], [1., 1., 1.], [3., 3., 3.], [2., 2., 2.]];
    let point = [[1., 1., 1.]; 5];
    let two = [[0., 0., 0.], [1., 0., 0.], [1., 0., 0.], [0., 0., 0.]];
    let thin = [[0., 0., 0.], [1., 0., 0.], [0.5, 1e-15, 0.]];
    let (polygons, notes) = prepare(&[&line, &SQUARE, &point, &two, &thin]);
    assert_eq!(polygons.len(), 1);
    assert_eq!(notes.degenerate_faces, [0, 2, 3, 4]);
    assert_eq!(notes.repeated_corners, 4 + 2);
    let needle = [[0., 0., 0.], [1., 0., 0.], [0.5, 1e-12, 0.]];
    assert_eq!(prepare(&[&SQUARE, &needle]).0.len(), 2, "a hole as wide would let rays pass");
}

#[test]
fn repeated_corners_are_dropped() {
    let face = [SQUARE[0], SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[3], SQUARE[3], SQUARE[0]];
    let (polygons, notes) = prepare(&[&face]);
    assert_eq!(polygons.polygon(0).corners, [0, 2, 3, 4]);
    assert_eq!(notes.repeated_corners, 3);
}

#[test]
fn holes_whose_slits_cross_by_rounding_stay() {
    // the corner that the slit starts from is off by 1e-6 when it comes back
    let slit = [
        [0., 0.],
        [4., 0.],
        [4., 4.],
        [0., 4.],
        [1e-6, -2e-6],
        [1., 1.],
        [1., 3.],
        [3., 3.],
        [3., 1.],
        [1., 1.],
    ];
    for height in [0.0, 0.1] {
        let face = slit.map(|[x, y]| [x, y, height * x * y]);
        let (polygons, notes) = prepare(&[&face]);
        let flat: f64 = polygons.iter().map(|p| newell(p.positions).z).sum();
        assert!((flat - 12.0).abs() < 1e-4, "{flat}");
        assert_eq!((notes.mended_faces, notes.self_intersecting()), (1, 0));
        assert_eq!(notes.triangulated_concave + notes.triangulated_nonplanar, 1);
    }
}

#[test]
fn crossing_faces_become_fans() {
    let bow_tie = [[0., 0., 0.], [1., 1., 0.], [1., 0., 0.], [0., 1., 0.]];
    let lopsided = [[0., 0., 0.], [3., 3., 0.], [3., 0., 0.], [0., 1., 0.]];
    let star: Vec<_> = (0..5)
        .map(|i| DVec2::from_angle(f64::from(2 * i) * std::f64::consts::TAU / 5.0))
        .map(|p| [p.x, p.y, 0.0])
        .collect();
    let (polygons, notes) = prepare(&[&bow_tie, &lopsided, &star]);
    assert_eq!(notes.self_intersecting_faces, [0, 1, 2]);
    assert_eq!(notes.self_intersecting(), 3);
    assert_eq!(polygons.iter().map(|p| p.face).collect::<Vec<_>>(), [0, 0, 1, 1, 2, 2, 2]);
    assert!(polygons.iter().all(|p| area(&p) > 0.0));
}

#[test]
fn mirrored_meshes_keep_the_order_of_corners() {
    let transform = DAffine3::from_scale(DVec3::new(1., 1., -1.));
    let (polygons, _) = prepare_polygons(&mesh(&[&SQUARE]), transform, MeshTolerances::default());
    assert_eq!(polygons.polygon(0).corners, [0, 1, 2, 3]);
    assert_eq!(polygons.polygon(0).normal, DVec3::Z);
}

#[test]
fn texture_coordinates_come_along() {
    let parts = MeshParts {
        positions: SQUARE.map(DVec3::from).to_vec(),
        uvs: vec![DVec2::new(0.25, 0.75)],
        corners: (0..4)
            .map(|position| Corner { position, uv: (position == 2).then_some(0), normal: None })
            .collect(),
        arities: vec![4],
        face_objects: vec![0],
        object_names: vec!["test".into()],
        ..MeshParts::default()
    };
    let mesh = PolygonMesh::try_new(parts).unwrap();
    let (polygons, _) = prepare_polygons(&mesh, DAffine3::IDENTITY, MeshTolerances::default());
    let uvs = polygons.polygon(0).uvs;
    assert_eq!(uvs[2], DVec2::new(0.25, 0.75));
    assert!(uvs[0].is_nan() && uvs[1].is_nan() && uvs[3].is_nan());
}

#[test]
fn size_does_not_matter() {
    for size in [1e-280, 1e-30, 1.0, 1e30, 1e280] {
        let faces: Vec<_> = [[[0., 0., 0.], [2., 1., 0.], [0., 2., 0.], [1., 1., 0.]], SQUARE]
            .map(|face| face.map(|p| p.map(|x| x * size)))
            .to_vec();
        let (polygons, notes) = prepare(&[&faces[0], &faces[1]]);
        assert_eq!((polygons.len(), notes.triangulated_concave), (3, 1), "size {size:e}: {notes}");
    }
}

#[test]
fn faces_that_the_transform_makes_infinite_are_left_out() {
    let transform = DAffine3::from_scale(DVec3::splat(1e308));
    let far = SQUARE.map(|p| p.map(|x| x * 100.0));
    let (polygons, notes) = prepare_polygons(&mesh(&[&far, &SQUARE]), transform, MeshTolerances::default());
    assert_eq!((polygons.len(), notes.degenerate_faces), (1, vec![0]));
}

/// Outlines of a prism's side turned into space: simple, planar, mostly concave.
fn turned_outline() -> impl Strategy<Value = (Vec<[f64; 3]>, DAffine3, f64)> {
    let radii = proptest::collection::vec(0.1..1.0f64, 4..24);
    (radii, 0.0..6.0f64, -3.0..3.0f64, -3.0..3.0f64).prop_map(|(radii, angle, x, y)| {
        let step = std::f64::consts::TAU / radii.len() as f64;
        let points: Vec<_> =
            radii.iter().zip(0..).map(|(&r, i)| DVec2::from_angle(f64::from(i) * step) * r).collect();
        let area = super::super::triangulate::twice_area(&points) / 2.0;
        let transform = DAffine3::from_axis_angle(DVec3::new(x, y, 1.0).normalize(), angle)
            * DAffine3::from_translation(DVec3::new(x, y, 7.0));
        (points.iter().map(|p| [p.x, p.y, 0.0]).collect(), transform, area)
    })
}

proptest! {
    #[test]
    fn area_is_kept_and_winding_too((outline, transform, expected) in turned_outline()) {
        let (polygons, notes) = prepare_polygons(&mesh(&[&outline]), transform, MeshTolerances::default());
        prop_assert_eq!(notes.self_intersecting() + notes.triangulated_nonplanar + notes.degenerate_faces.len(), 0);
        let normal = transform.transform_vector3(DVec3::Z);
        prop_assert!(polygons.iter().all(|p| p.normal.dot(normal) > 1.0 - 1e-12 && area(&p) > 0.0));
        let sum: f64 = polygons.iter().map(|p| area(&p)).sum();
        prop_assert!((sum - expected).abs() < 1e-12, "{} and {}", sum, expected);
    }

    #[test]
    fn any_mesh_gives_sound_polygons(
        faces in proptest::collection::vec(proptest::collection::vec([0..3i8, 0..3i8, 0..2i8], 3..9), 1..6),
        size in prop_oneof![Just(1.0), Just(0.1), Just(1e300), Just(1e-300)],
    ) {
        let faces: Vec<Vec<_>> =
            faces.iter().map(|face| face.iter().map(|p| p.map(|x| f64::from(x) * size)).collect()).collect();
        let refs: Vec<_> = faces.iter().map(Vec::as_slice).collect();
        let (polygons, notes) = prepare(&refs);
        for polygon in polygons.iter() {
            prop_assert!((polygon.normal.length() - 1.0).abs() < 1e-12, "{}", notes);
            prop_assert!(polygon.positions.len() >= 3);
        }
        let with_polygons = polygons.iter().map(|p| p.face).collect::<std::collections::BTreeSet<_>>().len();
        prop_assert_eq!(with_polygons + notes.degenerate_faces.len(), faces.len(), "{}", notes);
    }
}
