use std::fs;

use tempfile::TempDir;

use super::*;

fn load(name: &str, content: impl AsRef<[u8]>) -> Result<PolygonMesh, String> {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join(name), content).unwrap();
    let mesh = load_mesh(folder.path().join(name)).map(|(mesh, _)| mesh);
    mesh.map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

#[test]
fn the_content_tells_the_format_then_the_ending() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let stl = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n\
               endsolid a\n";
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for name in ["a.ply", "a.obj", "a.stl", "a", "a.glb"] {
        for content in [ply, stl] {
            assert_eq!(load(name, content).unwrap().face_count(), 1, "{name}");
        }
    }
    for name in ["a.obj", "a", "a.mesh"] {
        assert_eq!(load(name, obj).unwrap().face_count(), 1, "{name}");
    }
    assert_eq!(load("a.ply", obj).unwrap_err(), "a.ply:1:1: a PLY file begins with a line `ply`");
    assert_eq!(load("a.glb", obj).unwrap_err(), "a.glb:1:1: expected value");
    assert!(load("a.stl", obj).unwrap_err().starts_with("a.stl: 32 bytes are no STL file"));
    assert!(load("a.stl", "OFF\n").unwrap_err().contains("is an OFF file, not an OBJ file"));
}

#[test]
fn what_takes_too_much_memory_is_refused_before() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.ply");
    fs::write(&path, "ply\n").unwrap();
    let error = load_mesh_within(&path, MemoryLimit::new(1)).unwrap_err();
    assert!(matches!(error, LoadError::Memory(_)) && error.faults().is_none(), "{error}");
}
