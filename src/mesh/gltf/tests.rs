use std::fs;

use tempfile::TempDir;

use super::*;
use crate::mesh::{MeshNotes, PolygonMesh, load_mesh};

/// Two nodes of one mesh, the second mirrored and below a parent; then a strip and points.
const TEXT: &str = r#"{
"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
"nodes": [{"name": "plain", "mesh": 0},
  {"children": [2], "translation": [10, 0, 0], "rotation": [0, 0, 0.7071067811865476, 0.7071067811865476]},
  {"matrix": [-2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 1, 1], "mesh": 0}],
"meshes": [{"primitives": [
  {"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0},
  {"attributes": {"POSITION": 0}, "mode": 5, "material": 1},
  {"attributes": {"POSITION": 0}, "mode": 0}]}],
"accessors": [
  {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
  {"bufferView": 0, "byteOffset": 12, "componentType": 5126, "count": 4, "type": "VEC3"},
  {"bufferView": 1, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC2"},
  {"bufferView": 1, "byteOffset": 8, "componentType": 5123, "count": 6, "type": "SCALAR"}],
"bufferViews": [{"buffer": 0, "byteLength": 96, "byteStride": 24}, {"buffer": 0, "byteOffset": 96, "byteLength": 20}],
"buffers": [{"uri": "a%20b.bin", "byteLength": 116}],
"materials": [
  {"name": "paint", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, 1], "metallicFactor": 0, "roughnessFactor": 0.75}},
  {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "emissiveFactor": [1, 0, 0]}],
"textures": [{"source": 0}], "images": [{"uri": "wood.png"}]
}"#;

fn buffer() -> Vec<u8> {
    let mut bytes = Vec::new();
    for [x, y] in [[0.0_f32, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
        [x, y, 0.0, 0.0, 0.0, 1.0].iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    }
    bytes.extend([0, 0, 255, 0, 0, 255, 255, 255]);
    [0_u16, 1, 2, 2, 1, 3].iter().for_each(|index| bytes.extend(index.to_le_bytes()));
    bytes
}

/// The binary file of a text, in which the buffer has no address.
fn binary(text: &str) -> Vec<u8> {
    let mut text = text.replace(r#""uri": "a%20b.bin", "#, "").into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = |bytes: usize| u32::try_from(bytes).unwrap().to_le_bytes();
    let buffer = buffer();
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend(length(12 + 8 + text.len() + 8 + buffer.len()));
    file.extend(length(text.len()));
    file.extend(b"JSON");
    file.extend(text);
    file.extend(length(buffer.len()));
    file.extend(b"BIN\0");
    file.extend(buffer);
    file
}

fn load(name: &str, file: &[u8]) -> Result<(PolygonMesh, MeshNotes), String> {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("a b.bin"), buffer()).unwrap();
    fs::write(folder.path().join(name), file).unwrap();
    load_mesh(folder.path().join(name))
        .map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

#[test]
fn nodes_place_meshes_and_carry_normals() {
    let (mesh, notes) = load("a.gltf", TEXT.as_bytes()).unwrap();
    // two triangles and a strip of two, twice
    assert_eq!((mesh.face_count(), mesh.positions().len()), (8, 16));
    assert_eq!(mesh.object_names(), ["plain", "mesh0"]);
    assert_eq!(notes.file.ignored_statements, [("points".to_owned(), 2)]);
    let place = |face: u32| {
        let corners = mesh.face(face).corners();
        corners.map(|corner| mesh.positions()[corner.position as usize].to_array()).collect::<Vec<_>>()
    };
    assert_eq!(place(0), [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
    assert_eq!(
        place(3),
        [[1., 0., 0.], [1., 1., 0.], [0., 1., 0.]],
        "every other triangle of a strip is turned"
    );
    // (x, y, z) to (-2x, 2y, 2z + 1), then a quarter turn and 10 along x; mirrored, so wound the other way
    let want = [[10., 0., 1.], [8., 0., 1.], [10., -2., 1.]];
    for (got, want) in place(4).into_iter().zip(want) {
        assert!(DVec3::from(got).distance(DVec3::from(want)) < 1e-14, "{got:?}, not {want:?}");
    }
    for face in [0, 4] {
        let corner = mesh.face(face).corners().next().unwrap();
        let normal = mesh.normals()[corner.normal.unwrap() as usize].normalize();
        assert!(normal.distance(DVec3::Z) < 1e-14, "{normal}");
        let [a, b, c] = place(face).try_into().unwrap();
        let [a, b, c]: [DVec3; 3] = [a, b, c].map(DVec3::from);
        assert!((b - a).cross(c - a).z > 0.0, "the winding is that of the normals");
    }
    let uv = |corner: usize| mesh.uvs()[mesh.corner(corner).uv.unwrap() as usize];
    assert_eq!([uv(0), uv(1), uv(2)], [DVec2::Y, DVec2::ONE, DVec2::ZERO], "v is turned upwards");
    assert_eq!(mesh.corner(6).uv, None);
}

#[test]
fn binary_files_and_data_inside_are_the_same() {
    let (mesh, _) = load("a.gltf", TEXT.as_bytes()).unwrap();
    for name in ["a.glb", "b.obj"] {
        let (other, _) = load(name, &binary(TEXT)).unwrap();
        assert_eq!((other.positions(), other.uvs()), (mesh.positions(), mesh.uvs()), "{name}");
        assert!((0..mesh.corner_count()).all(|corner| other.corner(corner) == mesh.corner(corner)), "{name}");
    }
    let digits = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut data = String::new();
    for group in buffer().chunks(3) {
        let bits =
            group.iter().fold(0_u32, |bits, &byte| bits << 8 | u32::from(byte)) << (8 * (3 - group.len()));
        for place in 0..=group.len() {
            data.push(char::from(digits[(bits >> (18 - 6 * place)) as usize & 63]));
        }
    }
    let inside = TEXT.replace("a%20b.bin", &format!("data:application/octet-stream;base64,{data}="));
    assert_eq!(load("a.gltf", inside.as_bytes()).unwrap().0.positions(), mesh.positions());
}

#[test]
fn materials_are_kept() {
    let (mesh, _) = load("a.gltf", TEXT.as_bytes()).unwrap();
    assert_eq!(mesh.material_names(), ["paint", "material1"]);
    let [paint, wood] = mesh.materials() else { panic!("two") };
    assert_eq!((paint.base_color, paint.metallic, paint.roughness), (DVec3::new(0.5, 0.25, 1.0), 0.0, 0.75));
    assert!(wood.picture.as_ref().is_some_and(|picture| picture.ends_with("wood.png")), "{wood:?}");
    assert_eq!((wood.metallic, wood.emission, paint.emission), (1.0, DVec3::X, DVec3::ZERO));
    assert!(wood.left_out.is_empty(), "{wood:?}");
    assert_eq!((mesh.face(0).material(), mesh.face(2).material()), (Some(0), Some(1)));
}

#[test]
fn faults_name_their_element() {
    let draco = r#""extensionsRequired": ["KHR_draco_mesh_compression"], "scene": 0"#;
    let sparse = r#""type": "SCALAR", "sparse": {"count": 1}}"#;
    let cases = [
        (r#""version": "2.0""#, r#""version": "1.0""#, "asset: version `1.0` of glTF; 2.0 is read"),
        (
            r#""scene": 0"#,
            draco,
            "extensionsRequired: needs the extension `KHR_draco_mesh_compression`, which is not read: meshes compressed by Draco",
        ),
        (r#""scene": 0"#, r#""scene": 2"#, "scene: refers to scene 2, but there are 1"),
        (
            r#""children": [2]"#,
            r#""children": [1]"#,
            "nodes[1]: is reached twice; a node has one parent at most",
        ),
        (r#""children": [2]"#, r#""children": [3]"#, "scenes: refers to node 3, but there are 3"),
        (r#"[10, 0, 0]"#, r#"[1e999, 0, 0]"#, "number out of range"),
        (
            r#""indices": 3"#,
            r#""indices": 0"#,
            "accessors[0]: VEC3 of componentType 5126; indices are SCALAR",
        ),
        (
            r#""NORMAL": 1"#,
            r#""NORMAL": 9"#,
            "meshes[0].primitives[0]: refers to accessor 9, but there are 4",
        ),
        (r#""type": "SCALAR"}"#, sparse, "accessors[3]: sparse accessors are not read"),
        (r#""bufferView": 1, "byteOffset": 8"#, r#""byteOffset": 8"#, "accessors[3]: has no bufferView"),
        (r#""count": 6"#, r#""count": 7"#, "accessors[3]: needs 22 bytes, but bufferViews[1] has 20"),
        (
            r#""byteLength": 20"#,
            r#""byteLength": 21"#,
            "bufferViews[1]: needs 117 bytes, but buffers[0] has 116",
        ),
        (r#""byteLength": 116"#, r#""byteLength": 117"#, "buffers[0]: needs 117 bytes, but its data has 116"),
        ("a%20b.bin", "none.bin", "buffers[0]: the file none.bin cannot be read: No such file"),
        ("a%20b.bin", "data:text,", "buffers[0]: `data:text,` is neither a file's path nor base64 data"),
        (r#""uri": "a%20b.bin", "#, "", "buffers[0]: has no uri"),
        (r#""mode": 5"#, r#""mode": 7"#, "meshes[0].primitives[1]: mode 7; valid are 0 to 6"),
        (
            r#""material": 1"#,
            r#""material": 2"#,
            "meshes[0].primitives[1]: refers to material 2, but there are 2",
        ),
        (r#""nodes": [0, 1]"#, r#""nodes": []"#, "has no faces"),
        (r#""meshes": ["#, r#""meshes": [,"#, "expected value"),
    ];
    for (from, to, want) in cases {
        assert!(TEXT.contains(from), "{from}");
        let message = load("a.gltf", TEXT.replacen(from, to, 1).as_bytes()).unwrap_err();
        assert!(message.starts_with("a.gltf:") && message.contains(want), "{want}:\n{message}");
    }
    let file = binary(TEXT);
    for length in 4..file.len() {
        assert!(load("a.glb", &file[..length]).is_err(), "{length} of {}", file.len());
    }
}

#[test]
fn indices_beyond_the_positions_are_named() {
    let mut file = binary(TEXT);
    let last = file.len() - 2;
    file[last] = 4;
    let message = load("a.glb", &file).unwrap_err();
    assert_eq!(message, "a.glb: meshes[0].primitives[0]: refers to vertex 4, but there are 4");
}
