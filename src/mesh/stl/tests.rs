use std::path::Path;

use super::*;
use crate::mesh::{MeshNotes, PolygonMesh};

fn read_mesh(file: &[u8]) -> Result<(PolygonMesh, MeshNotes), String> {
    let text = |faults: MeshFaults| faults.of_file(Path::new("a.stl")).to_string();
    let reading = read_stl(file, MemoryLimit::NONE, "a.stl").map_err(|error| match error {
        ReadError::Faults(faults) => text(faults),
        ReadError::Memory(error) => error.to_string(),
    })?;
    reading.finish().map_err(text)
}

/// A tetrahedron, with a negative zero.
const TETRAHEDRON: [[[f32; 3]; 3]; 4] = [
    [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, -0.0, 1.5]],
    [[-0.0, 0.0, 0.0], [0.0, 0.0, 1.5], [0.0, 1.0, 0.0]],
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.5]],
];

fn binary(title: &[u8]) -> Vec<u8> {
    let mut bytes = title.to_vec();
    bytes.resize(80, 0);
    bytes.extend(4_u32.to_le_bytes());
    for (number, triangle) in TETRAHEDRON.iter().enumerate() {
        bytes.extend([0; 12]);
        triangle.as_flattened().iter().for_each(|coordinate| bytes.extend(coordinate.to_le_bytes()));
        bytes.extend([u8::from(number == 2), 0]);
    }
    bytes
}

fn ascii() -> String {
    let mut text = "solid left half\n".to_owned();
    for triangle in TETRAHEDRON {
        text += "  facet normal 0 0 0\n    outer loop\n";
        for [x, y, z] in triangle {
            text += &format!("      vertex {x:e} {y} {z:?}\n");
        }
        text += "    endloop\n  endfacet\n";
    }
    text + "endsolid left half\n"
}

#[test]
fn text_and_binary_are_the_same_mesh() {
    let (mesh, notes) = read_mesh(ascii().as_bytes()).unwrap();
    assert_eq!((mesh.face_count(), mesh.positions().len(), notes.file.joined_corners), (4, 4, 8));
    assert_eq!(mesh.object_names(), ["left half"]);
    assert!(notes.to_string().contains("8 corners at the place of one before, joined"), "{notes}");
    // headers of binary files begin as those of text more often than not
    for title in ["", "solid left half\n facet"] {
        let (other, notes) = read_mesh(&binary(title.as_bytes())).unwrap();
        assert_eq!(other.positions(), mesh.positions());
        for corner in 0..12 {
            assert_eq!(other.corner(corner), mesh.corner(corner));
        }
        assert_eq!((notes.file.joined_corners, notes.file.attributes), (8, 1));
    }
}

#[test]
fn solids_are_objects() {
    let text = ascii() + &ascii().replace("left", "RIGHT").replace("facet", "FACET");
    let (mesh, _) = read_mesh(text.as_bytes()).unwrap();
    assert_eq!(mesh.object_names(), ["left half", "RIGHT half"]);
    assert_eq!((mesh.face(3).object(), mesh.face(4).object()), (0, 1));
    assert_eq!(mesh.positions().len(), 4, "corners are joined over all solids");
}

#[test]
fn faults_have_places() {
    let mut lying = binary(b"");
    lying[80] = 5;
    assert_eq!(
        read_mesh(&lying).unwrap_err(),
        "a.stl: byte 80: the header says 5 triangles, which take 334 bytes, but the file has 284, those of 4"
    );
    assert!(read_mesh(&lying[..280]).unwrap_err().ends_with("but the file has 280"));
    let mut none = binary(b"");
    none.truncate(84);
    none[80] = 0;
    assert_eq!(read_mesh(&none).unwrap_err(), "a.stl: has no faces (0 vertices); at least one is needed");
    assert!(read_mesh(&none[..83]).unwrap_err().starts_with("a.stl: 83 bytes are no STL file"));
    let mut infinite = binary(b"");
    infinite[84 + 12..84 + 16].copy_from_slice(&f32::INFINITY.to_le_bytes());
    assert_eq!(read_mesh(&infinite).unwrap_err(), "a.stl: vertex 0: a coordinate is not a finite number");
    let good = ascii();
    let cases = [
        ("vertex 0e0 0 0.0", "vertex 0e0 O 0.0", "a.stl:4:18: `O` is not a number"),
        ("outer", "inner", "a.stl:3:5: `inner` where `outer` is needed"),
        ("endfacet", "facet", "a.stl:8:3: `facet` where `endfacet` is needed"),
        ("      vertex 0e0 1 0.0\n", "", "a.stl:4:7: a facet with 2 vertices; 3 are needed"),
        ("endsolid left half\n", "", "a.stl: the file ends where `endsolid` is needed"),
        ("  facet normal", "facets normal", "a.stl:2:1: `facets` where `facet` is needed"),
    ];
    for (from, to, want) in cases {
        let message = read_mesh(good.replacen(from, to, 1).as_bytes()).unwrap_err();
        assert_eq!(message.lines().next(), Some(want));
    }
    for length in 6..good.len() - "endsolid left half\n".len() {
        assert!(read_mesh(&good.as_bytes()[..length]).is_err(), "{length}");
    }
    assert!(read_mesh(b"solid nothing\nendsolid\n").unwrap_err().contains("has no faces"));
}
