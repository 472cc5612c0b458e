use std::path::Path;

use super::*;
use crate::mesh::{Corner, MeshNotes, PolygonMesh};

fn read_mesh(file: &[u8]) -> Result<(PolygonMesh, MeshNotes), String> {
    let text = |faults: MeshFaults| faults.of_file(Path::new("a.ply")).to_string();
    let reading = read_ply(file, MemoryLimit::NONE, "a.ply").map_err(|error| match error {
        ReadError::Faults(faults) => text(faults),
        ReadError::Memory(error) => error.to_string(),
    })?;
    reading.finish().map_err(text)
}

/// A roof of a quad and two triangles, with normals and texture coordinates and an edge.
const HEADER: &str = "\
comment a roof
obj_info none
element vertex 6
property float x
property double y
property short z
property float nx
property float ny
property float nz
property float s
property float t
property uchar red
property uchar green
property uchar blue
element edge 1
property int vertex1
property int vertex2
element face 3
property uchar flags
property list uchar uint vertex_indices
property list int float quality
end_header
";

const VERTICES: [[f64; 8]; 6] = [
    [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0],
    [1.5, 1.25, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0],
    [0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0],
    [-1.0, 0.1, -7.0, 0.0, 1.0, 0.0, 0.5, 0.5],
    [9.0, 9.0, 9.0, 0.0, 1.0, 0.0, 0.5, 0.5],
];

const FACES: [&[u32]; 3] = [&[0, 1, 2, 3], &[0, 3, 4], &[4, 1]];

fn ascii() -> Vec<u8> {
    let mut text = format!("ply\nformat ascii 1.0\n{HEADER}");
    for vertex in VERTICES {
        let words = vertex.map(|number| number.to_string());
        text += &format!("{} 255 0 0\n", words.join(" "));
    }
    text += "0 1\n";
    for face in FACES {
        let words: Vec<_> = face.iter().map(u32::to_string).collect();
        text += &format!("7 {} {} 1 0.5\n", face.len(), words.join(" "));
    }
    text.into_bytes()
}

fn binary(is_big: bool) -> Vec<u8> {
    let name = if is_big { "big" } else { "little" };
    let mut bytes = format!("ply\nformat binary_{name}_endian 1.0\n{HEADER}").into_bytes();
    let mut push = |number: &[u8]| {
        if is_big { bytes.extend(number.iter().rev()) } else { bytes.extend(number) }
    };
    #[expect(clippy::cast_possible_truncation, reason = "numbers of the test fit")]
    for [x, y, z, rest @ ..] in VERTICES {
        push(&(x as f32).to_le_bytes());
        push(&y.to_le_bytes());
        push(&(z as i16).to_le_bytes());
        rest.iter().for_each(|number| push(&(*number as f32).to_le_bytes()));
        [255, 0, 0].iter().for_each(|byte| push(&[*byte]));
    }
    push(&0_i32.to_le_bytes());
    push(&1_i32.to_le_bytes());
    for face in FACES {
        push(&[7]);
        push(&[u8::try_from(face.len()).unwrap()]);
        face.iter().for_each(|index| push(&index.to_le_bytes()));
        push(&1_i32.to_le_bytes());
        push(&0.5_f32.to_le_bytes());
    }
    bytes
}

#[test]
fn text_and_both_binaries_are_the_same_mesh() {
    let (mesh, notes) = read_mesh(&ascii()).unwrap();
    assert_eq!((mesh.face_count(), mesh.triangle_count(), mesh.positions().len()), (3, 4, 5));
    assert_eq!(mesh.face(0).arity(), 4, "polygons are kept");
    assert_eq!(mesh.positions()[2], DVec3::new(1.5, 1.25, 0.0));
    assert_eq!(mesh.corner(2), Corner { position: 2, uv: Some(2), normal: Some(2) });
    assert_eq!((mesh.uvs()[2], mesh.normals()[4]), (DVec2::ONE, DVec3::Y));
    assert_eq!((notes.unused_positions, notes.file.short_faces, notes.file.coloured_positions), (1, 1, 6));
    assert_eq!(notes.file.ignored_statements, [("edge".to_owned(), 1)]);
    for is_big in [false, true] {
        let other = read_mesh(&binary(is_big)).unwrap();
        assert_eq!(other, (mesh.clone(), notes.clone()), "big endian: {is_big}");
    }
    let windows = String::from_utf8(ascii()).unwrap().replace('\n', "\r\n");
    assert_eq!(read_mesh(windows.as_bytes()).unwrap().0, mesh);
}

#[test]
fn every_end_inside_is_a_fault() {
    for file in [ascii(), binary(false), binary(true)] {
        for length in 0..file.len() - 3 {
            // the last number of a text may lose digits
            let outcome = read_mesh(&file[..length]);
            assert!(outcome.is_err(), "{length} of {}", file.len());
        }
    }
}

#[test]
fn faces_may_have_texture_coordinates_of_their_own() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                property float u\nproperty float v\n\
                element face 2\nproperty list uchar int vertex_index\nproperty list uchar float texcoord\nend_header\n\
                0 0 0 9 9\n1 0 0 9 9\n0 1 0 9 9\n1 1 0 nan 9\n3 0 1 2 6 0 0 1 0 0 1\n3 1 3 2 0\n";
    let (mesh, notes) = read_mesh(text.as_bytes()).unwrap();
    let uvs: Vec<_> = (0..6).map(|corner| mesh.corner(corner).uv.map(|uv| mesh.uvs()[uv as usize])).collect();
    assert_eq!(uvs[..3], [Some(DVec2::ZERO), Some(DVec2::X), Some(DVec2::Y)]);
    assert_eq!((&uvs[3..], notes.file.absent_uvs), ([None; 3].as_slice(), 3));
}

#[test]
fn normals_that_are_not_finite_are_left_out() {
    let text = String::from_utf8(ascii()).unwrap().replace("1 0 0 0 0 1 1 0", "1 0 0 0 nan 1 1 0");
    let (mesh, notes) = read_mesh(text.as_bytes()).unwrap();
    assert_eq!((mesh.corner(0).normal, mesh.corner(1).normal), (Some(0), None));
    assert_eq!(notes.file.non_finite_normals, 1);
}

#[test]
fn faults_have_places() {
    let good = String::from_utf8(ascii()).unwrap();
    let cases: [(&str, &str, &str); 15] = [
        (
            "format ascii 1.0\n",
            "",
            "a.ply:23:1: format ``; valid are `ascii 1.0`, `binary_little_endian 1.0` and",
        ),
        ("format ascii", "format text", "a.ply:2:1: format `text 1.0`; valid are"),
        ("property float x", "property quad x", "a.ply:6:1: unknown type `quad`; valid are char, uchar"),
        ("property double y\n", "", "a.ply: element `vertex` has no property `y`; x, y and z are needed"),
        ("element edge 1", "element face 1", "a.ply:20:1: a second element `face`"),
        ("element edge 1", "element edge -1", "a.ply:17:1: `element edge -1`; an element is given as"),
        ("element face 3", "element tristrips 3", "a.ply: triangle strips are not read"),
        ("uint vertex_indices", "float vertex_indices", "a.ply: element `face` has no list of whole numbers"),
        (
            "element vertex 6",
            "element vertex 4000000000",
            "a.ply: the header says 4000000000 × vertex, at least",
        ),
        ("comment a roof", "roof", "a.ply:3:1: `roof` is no statement of a header"),
        ("1.25", "1,25", "a.ply:27:5: `1,25` is not a number"),
        ("0 1 2 3 1", "0 1.5 2 6 1", "a.ply:32:7: `1.5` is not a whole number from 0 on"),
        ("0 1 2 3 1", "0 1 2 6 1", "a.ply: face 0: vertex index 6 is out of range; valid are 0 to 5"),
        ("1.5 1.25", "1.5 inf", "a.ply: vertex 2: a coordinate is not a finite number"),
        ("2 4 1 1 0.5", "2 4 1 9 0.5", "a.ply:34:10: the file ends in face 2 of 3"),
    ];
    for (from, to, want) in cases {
        assert!(good.contains(from), "{from}");
        let message = read_mesh(good.replacen(from, to, 1).as_bytes()).unwrap_err();
        assert!(message.starts_with(want), "{want}:\n{message}");
    }
    let several = good.replace("1.25", "1,25").replace("9 9 9", "9 x 9");
    assert_eq!(read_mesh(several.as_bytes()).unwrap_err().lines().count(), 2, "all faults come at once");
    let mut negative = binary(false);
    let signed = String::from_utf8_lossy(&negative).find("uint vertex_indices").unwrap();
    negative.splice(signed..signed + 4, *b"int ");
    let at = negative.len() - 2 * 4 - 2 * 4;
    negative[at..at + 4].copy_from_slice(&(-1_i32).to_le_bytes());
    let message = read_mesh(&negative).unwrap_err();
    assert_eq!(message, "a.ply: face 2: vertex index -1 is out of range; valid are 0 to 5");
    let empty = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n\
                 element face 0\nproperty list uchar int vertex_index\nend_header\n";
    assert_eq!(
        read_mesh(empty.as_bytes()).unwrap_err(),
        "a.ply: has no faces (0 vertices); at least one is needed"
    );
}
