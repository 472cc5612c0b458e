use proptest::prelude::*;

use super::*;

fn load(content: impl AsRef<[u8]>) -> Result<(PolygonMesh, MeshNotes), ObjError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.obj");
    fs::write(&path, content).unwrap();
    load_obj(&path)
}

fn error(content: impl AsRef<[u8]>) -> String {
    let error = load(content).expect_err("the file is faulty").to_string();
    let at = error.find("mesh.obj").expect("the message names the file");
    error[at..].to_owned()
}

fn face_positions(mesh: &PolygonMesh, face: u32) -> Vec<[f64; 3]> {
    let corners = mesh.face(face).corners();
    corners.map(|corner| mesh.positions()[corner.position as usize].to_array()).collect()
}

#[test]
fn objects_polygons_and_mixed_corners() {
    let text = "mtllib nowhere.mtl\r\no first\r\nv 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nv 0 0 1\r\n\
        vt 0 0\r\nvt 1 0\r\nvt 1 1\r\nvn 0 0 1\r\nvn 0 1 0\r\n\
        usemtl red\r\nf 1 2/2 3//2 4/3/1\r\ng second group\r\nusemtl\r\nf -5 -4 -1\r\no first\r\nf 5//1 4 3\r\n";
    let (mesh, notes) = load(text).unwrap();
    assert_eq!(mesh.object_names(), ["first", "second group"]);
    assert_eq!(mesh.faces().map(|f| f.object()).collect::<Vec<_>>(), [0, 1, 0]);
    assert_eq!(mesh.faces().map(|f| f.arity()).collect::<Vec<_>>(), [4, 3, 3]);
    assert_eq!(face_positions(&mesh, 1), [[0., 0., 0.], [1., 0., 0.], [0., 0., 1.]]);
    assert_eq!(face_positions(&mesh, 2), [[0., 0., 1.], [0., 1., 0.], [1., 1., 0.]]);
    // positions are shared over the groups
    assert_eq!(mesh.positions().len(), 5);
    let quad: Vec<_> = mesh.face(0).corners().collect();
    let uvs: Vec<_> = quad.iter().map(|c| c.uv.map(|uv| mesh.uvs()[uv as usize].to_array())).collect();
    assert_eq!(uvs, [None, Some([1., 0.]), None, Some([1., 1.])]);
    let normals: Vec<_> =
        quad.iter().map(|c| c.normal.map(|n| mesh.normals()[n as usize].to_array())).collect();
    assert_eq!(normals, [None, None, Some([0., 1., 0.]), Some([0., 0., 1.])]);
    assert!(mesh.face(1).corners().all(|c| c.uv.is_none() && c.normal.is_none()));
    assert_eq!((notes.faces, notes.triangles, notes.positions), (3, 4, 5));
    assert!(notes.file.ignored_statements.is_empty());
}

#[test]
fn colours_weights_continuation_comments_and_later_vertices() {
    let text = "\u{feff}# made by hand \\\nf 1 2 \\\n 3 # behind\nv 0 0 0 1 0 0\nv 2 4 6 2\nv \\\n1 \\\n0 0\nv 9 9 9\nl 1 2 3 4\np 1\ns off\ncurv 0 1 2\n";
    let (mesh, notes) = load(text).unwrap();
    assert_eq!(mesh.face_count(), 1);
    assert_eq!(face_positions(&mesh, 0), [[0., 0., 0.], [2., 4., 6.], [1., 0., 0.]]);
    assert_eq!(
        (notes.unused_positions, notes.file.weighted_positions, notes.file.coloured_positions),
        (1, 1, 1)
    );
    let ignored: Vec<_> = notes.file.ignored_statements.iter().map(|(word, n)| (word.as_str(), *n)).collect();
    assert_eq!(ignored, [("curv", 1), ("l", 1), ("p", 1)]);
}

#[test]
fn numbers_are_read_in_double_precision() {
    let (mesh, _) = load("v 0.1 1e-300 -.5\nv 1. +2 3\nv 0 0 0\nf 1 2 3").unwrap();
    assert_eq!(mesh.positions()[0].to_array(), [0.1, 1e-300, -0.5]);
}

#[test]
fn files_that_are_no_meshes() {
    let folder = tempfile::tempdir().unwrap();
    let missing = load_obj(folder.path().join("none.obj")).unwrap_err();
    assert!(matches!(missing, ObjError::Read { .. }), "{missing}");
    let directory = load_obj(folder.path()).unwrap_err().to_string();
    assert!(directory.ends_with("is a folder, an OBJ file is expected"), "{directory}");
    assert_eq!(error(""), "mesh.obj: has no faces (0 vertices); at least one `f` statement is needed");
    assert_eq!(
        error("v 0 0 0\nl 1 1"),
        "mesh.obj: has no faces (1 vertices); at least one `f` statement is needed"
    );
    let expect = "not text in UTF-8 (it looks like a binary file); an OBJ file is plain text";
    assert_eq!(error(b"\x07K\x03\x04\x00\x01"), format!("mesh.obj:1:5: {expect}"));
    assert_eq!(error(b"PK\x03\x04\x00\x01"), "mesh.obj: is a ZIP archive, not an OBJ file");
    let expect = "not text in UTF-8 (it looks like UTF-16); an OBJ file is plain text";
    assert_eq!(error(b"\xff\xfev\0 \0"), format!("mesh.obj:1:1: {expect}"));
}

#[test]
fn faults_are_listed_with_path_and_place() {
    let expected = "mesh.obj:2:1: `v` with 2 values; 3 are needed\n\
        PATHmesh.obj:3:7: `zero` is not a number\n\
        PATHmesh.obj:4:7: vertex index 4 is out of range; valid are 1 to 3, or -3 to -1";
    let found = error("v 0 0 0\nv 1 0\nv 0 1 zero\nf 1 2 4\nf 1 2 3\n");
    for (line, expected) in found.lines().zip(expected.split("\nPATH")) {
        assert!(line.ends_with(expected), "{line}");
    }
    assert_eq!(found.lines().count(), 3);
    let message = error("f 1 2 3\n".repeat(10));
    assert_eq!(message.lines().count(), 21);
    assert!(message.ends_with("mesh.obj: and 10 more faults"), "{message}");
}

/// What is told of a triangle with a change.
fn notes_of(content: impl AsRef<[u8]>) -> String {
    let (mesh, notes) = load(content).unwrap();
    assert_eq!(face_positions(&mesh, 0), [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
    notes.to_string().lines().skip(1).collect::<Vec<_>>().join("; ")
}

#[test]
fn what_is_not_used_is_counted_and_refuses_nothing() {
    let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let with = |more: &str| format!("{three}{more}");
    let cases = [
        (with("f 1//1 2//2 3//3\n"), "3 corners naming a normal that is not there"),
        (with("f 1/1 2/0 3/-7\n"), "3 corners naming a texture coordinate that is not there"),
        (
            with("vt nan 1\nvt -1.#IND 0\nvt 0 1e999\nf 1/1 2/2 3/3\n"),
            "3 texture coordinates not finite, left out",
        ),
        (with("vn NaN 0 0\nf 1//1 2//1 3\n"), "1 normal not finite, left out"),
        (
            with("v nan 1.#QNAN inf\nv 1 2\nv x\nvt one\nf 1 2 3\n"),
            "3 vertices used by no face; 4 statements not readable, used by no face",
        ),
        (
            with("v 1 1 1 0\nv 1 1 1 1\nf 1 2 3\n"),
            "2 vertices used by no face; 1 vertex with a fourth coordinate, not used",
        ),
        (
            with("v 1 1 1 1 1 1 0.5\nv 1 1 1 nan - x\nv 1 1 1 5 5\nf 1 2 3\n"),
            "3 vertices used by no face; 2 vertices with a colour, not used; 1 statement with more values than are used",
        ),
        (with("vt 0 0 0 1\nf 1/1 2/1 3/1\n"), "1 statement with more values than are used"),
        (with("f 1 2 3\nf 1 2\nf 3\nf\n"), "2 faces with fewer than 3 corners; statements ignored: 1 × f"),
        (with("f 1 2 3").replace('\n', "\r"), ""),
        (with("f 1 2 3#three\n").replace(" 0\n", " 0#zero\n"), ""),
        (with("f 1 2 3\n\0\0"), "2 zero bytes at the end, left out"),
    ];
    for (text, want) in cases {
        assert_eq!(notes_of(&text), want, "{text}");
    }
}

#[test]
fn names_in_other_encodings_are_shown_as_far_as_they_go() {
    let mut text = b"# \xe9\xe8\nusemtl H\xf6lz\no W\xfcrfel\n".to_vec();
    text.extend(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    assert_eq!(notes_of(&text), "4 bytes not UTF-8, in names or comments");
    assert_eq!(load(&text).unwrap().0.object_names(), ["W\u{fffd}rfel"]);
    // in a number it is a fault
    assert!(
        error(b"v 0 0 0\nv 1 0 0\nv 0 \xb9 0\nf 1 2 3\n")
            .ends_with("mesh.obj:3:5: `\u{fffd}` is not a number")
    );
}

#[test]
fn corners_without_what_they_name_keep_the_rest() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/9/1 2/1/9 3/2/1\nvt 5 6\nvt nan 0\nvn 0 0 2\n";
    let (mesh, notes) = load(text).unwrap();
    let corners: Vec<_> = mesh.face(0).corners().map(|corner| (corner.uv, corner.normal)).collect();
    assert_eq!(corners, [(None, Some(0)), (Some(0), None), (None, Some(0))]);
    assert_eq!(
        (mesh.uvs(), mesh.normals()),
        (&[glam::DVec2::new(5.0, 6.0)][..], &[glam::DVec3::Z * 2.0][..])
    );
    assert_eq!((notes.file.absent_uvs, notes.file.absent_normals, notes.file.non_finite_uvs), (1, 1, 1));
}

#[test]
fn faces_of_too_few_corners_keep_their_numbers() {
    let (mesh, _) = load("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\nf 3 2 1\n").unwrap();
    assert_eq!(mesh.face_count(), 2);
    assert_eq!(face_positions(&mesh, 1), [[0., 1., 0.], [1., 0., 0.], [0., 0., 0.]]);
}

#[test]
fn files_of_other_formats_are_named() {
    assert_eq!(
        error("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"),
        "mesh.obj: is an STL file in text, not an OBJ file"
    );
    let mut stl = vec![7_u8; 84 + 50];
    stl[80..84].copy_from_slice(&1_u32.to_le_bytes());
    assert_eq!(error(stl), "mesh.obj: is a binary STL file, not an OBJ file");
    assert_eq!(error("<html><body>404"), "mesh.obj: is an HTML page, not an OBJ file");
    // whatever it begins with, a file with faces is an OBJ file
    load("solid ground\nfacet\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
}

/// A random legal file, and what must come of it: per face the corners' numbers of `v`, `vt` and `vn`.
fn legal_file() -> impl Strategy<Value = (String, Vec<Vec<[Option<f64>; 3]>>)> {
    let corner = (0..9usize, proptest::option::of(0..4usize), proptest::option::of(0..3usize), any::<bool>());
    let face = proptest::collection::vec(corner, 3..7);
    proptest::collection::vec((face, any::<bool>(), any::<bool>()), 1..8).prop_map(|faces| {
        let mut text = String::new();
        (0..9).for_each(|i| text += &format!("v {i} 0.5 {}\n", i * i));
        (0..4).for_each(|i| text += &format!("vt {i} 0\n"));
        (0..3).for_each(|i| text += &format!("vn {i} 0 1\n"));
        let mut expected = Vec::new();
        for (face, group, continued) in faces {
            text += if group { "g part\nf" } else { "f" };
            for &(v, vt, vn, relative) in &face {
                let number = |index: usize, count: usize| match relative {
                    true => (index as i64 - count as i64).to_string(),
                    false => (index + 1).to_string(),
                };
                text += &format!(" {}", number(v, 9));
                match (vt, vn) {
                    (None, None) => {}
                    (Some(vt), None) => text += &format!("/{}", number(vt, 4)),
                    (None, Some(vn)) => text += &format!("//{}", number(vn, 3)),
                    (Some(vt), Some(vn)) => text += &format!("/{}/{}", number(vt, 4), number(vn, 3)),
                }
                text += if continued { " \\\n" } else { "" };
            }
            text += "\n";
            expected.push(
                face.iter()
                    .map(|&(v, vt, vn, _)| [Some(v), vt, vn].map(|index| index.map(|index| index as f64)))
                    .collect(),
            );
        }
        (text, expected)
    })
}

proptest! {
    #[test]
    fn legal_files_come_out_as_written((text, expected) in legal_file()) {
        let (mesh, _) = parse_obj(Path::new("x.obj"), text.as_bytes()).expect("the file is legal");
        let found: Vec<Vec<[Option<f64>; 3]>> = mesh
            .faces()
            .map(|face| {
                face.corners()
                    .map(|corner| {
                        let v = mesh.positions()[corner.position as usize].x;
                        let vt = corner.uv.map(|uv| mesh.uvs()[uv as usize].x);
                        let vn = corner.normal.map(|n| mesh.normals()[n as usize].x);
                        [Some(v), vt, vn]
                    })
                    .collect()
            })
            .collect();
        prop_assert_eq!(found, expected);
    }

    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = parse_obj(Path::new("x.obj"), &bytes);
    }

    #[test]
    fn random_statements_never_panic(
        text in "((v|vt|vn|f|o|l|#|\\\\)?( -?[0-9]{1,2}| [0-9]/[0-9]?/[0-9]| 1e[0-9]{3}|é|\\\\| #)*\r?\n){0,12}"
    ) {
        if let Ok((mesh, _)) = parse_obj(Path::new("x.obj"), text.as_bytes()) {
            prop_assert!(mesh.face_count() > 0);
        }
    }
}
