//! Triangles as PLY and OBJ files.

use std::fmt::Write;

use crate::tessellate::Tessellation;

/// An object's triangles and its name.
#[derive(Clone, Debug)]
pub struct NamedMesh {
    /// The object's name in the scene file.
    pub name: String,
    /// Its triangles.
    pub mesh: Tessellation,
}

/// The numbers of a PLY file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 32 bits, as renderers have them.
    Single,
    /// 64 bits.
    Double,
}

/// A binary little-endian PLY file of all objects together, with texture coordinates u, v and
/// normals nx, ny, nz if any has them (0 where one has not).
///
/// Source: Turk (1994), *The PLY Polygon File Format*.
#[must_use]
pub fn ply(objects: &[NamedMesh], precision: Precision) -> Vec<u8> {
    let has_uvs = objects.iter().any(|object| !object.mesh.uvs.is_empty());
    let kind = match precision {
        Precision::Single => "float",
        Precision::Double => "double",
    };
    let vertices: usize = objects.iter().map(|object| object.mesh.positions.len()).sum();
    let triangles: usize = objects.iter().map(|object| object.mesh.triangles.len()).sum();
    let mut header = "ply\nformat binary_little_endian 1.0\ncomment exported by trimray\n".to_owned();
    let has_normals = objects.iter().any(|object| !object.mesh.normals.is_empty());
    header += &format!("element vertex {vertices}\n");
    let normals: &[&str] = if has_normals { &["nx", "ny", "nz"] } else { &[] };
    let uvs: &[&str] = if has_uvs { &["u", "v"] } else { &[] };
    for name in ["x", "y", "z"].iter().chain(normals).chain(uvs) {
        header += &format!("property {kind} {name}\n");
    }
    header += &format!("element face {triangles}\nproperty list uchar int vertex_indices\nend_header\n");

    let mut bytes = header.into_bytes();
    let mut push = |value: f64| match precision {
        #[expect(clippy::cast_possible_truncation, reason = "single precision is asked for")]
        Precision::Single => bytes.extend((value as f32).to_le_bytes()),
        Precision::Double => bytes.extend(value.to_le_bytes()),
    };
    for NamedMesh { mesh, .. } in objects {
        for (vertex, position) in mesh.positions.iter().enumerate() {
            position.to_array().into_iter().for_each(&mut push);
            if has_normals {
                let normal = mesh.normals.get(vertex).copied().unwrap_or_default();
                normal.to_array().into_iter().for_each(&mut push);
            }
            if has_uvs {
                let uv = mesh.uvs.get(vertex).copied().unwrap_or_default();
                uv.to_array().into_iter().for_each(&mut push);
            }
        }
    }
    let mut first = 0;
    for NamedMesh { mesh, .. } in objects {
        for triangle in &mesh.triangles {
            bytes.push(3);
            for vertex in triangle {
                bytes.extend((first + vertex).to_le_bytes());
            }
        }
        first += index(mesh.positions.len());
    }
    bytes
}

/// An OBJ file with one object (`o`) for each, numbers in as many digits as read back to the same doubles.
///
/// A point of the surface has one `v`, however many `vt` and `vn`.
#[must_use]
pub fn obj(objects: &[NamedMesh]) -> String {
    let mut text = "# exported by trimray\n".to_owned();
    let (mut first, mut first_uv, mut first_normal) = (1, 1, 1);
    for NamedMesh { name, mesh } in objects {
        // a name ends with its line
        let name: String = name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        // writing to memory does not fail
        let _ = writeln!(text, "o {name}");
        let mut of_vertex: Vec<u32> = Vec::with_capacity(mesh.positions.len());
        let mut points = 0;
        for (vertex, p) in mesh.positions.iter().enumerate() {
            let earlier = mesh.first_at_point.get(vertex).and_then(|&first| of_vertex.get(first as usize));
            if let Some(&point) = earlier {
                of_vertex.push(point);
                continue;
            }
            of_vertex.push(first + points);
            points += 1;
            let _ = writeln!(text, "v {:?} {:?} {:?}", p.x, p.y, p.z);
        }
        for uv in &mesh.uvs {
            let _ = writeln!(text, "vt {:?} {:?}", uv.x, uv.y);
        }
        for n in &mesh.normals {
            let _ = writeln!(text, "vn {:?} {:?} {:?}", n.x, n.y, n.z);
        }
        let (has_uvs, has_normals) = (!mesh.uvs.is_empty(), !mesh.normals.is_empty());
        for triangle in &mesh.triangles {
            text.push('f');
            for vertex in triangle {
                let _ = write!(text, " {}", of_vertex[*vertex as usize]);
                if has_uvs {
                    let _ = write!(text, "/{}", first_uv + vertex);
                }
                if has_normals {
                    let slashes = if has_uvs { "/" } else { "//" };
                    let _ = write!(text, "{slashes}{}", first_normal + vertex);
                }
            }
            text.push('\n');
        }
        first += points;
        first_uv += index(mesh.uvs.len());
        first_normal += index(mesh.normals.len());
    }
    text
}

fn index(n: usize) -> u32 {
    u32::try_from(n).expect("fewer than 2^32 vertices fit in memory")
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::*;

    fn triangle(name: &str, x: f64, has_uvs: bool) -> NamedMesh {
        let positions = vec![DVec3::new(x, 0.0, 0.0), DVec3::new(x + 1.0, 0.0, 0.0), DVec3::new(x, 0.1, 0.0)];
        let uvs = if has_uvs { vec![DVec2::ZERO, DVec2::X, DVec2::Y] } else { Vec::new() };
        NamedMesh {
            name: name.into(),
            mesh: Tessellation {
                positions,
                first_at_point: vec![0, 1, 2],
                uvs,
                normals: Vec::new(),
                triangles: vec![[0, 1, 2]],
                faces: vec![0],
                deviation: 0.0,
            },
        }
    }

    #[test]
    fn obj_counts_on_from_object_to_object() {
        let text = obj(&[triangle("a", 0.0, false), triangle("b\nv 1", 5.0, true), triangle("c", 9.0, true)]);
        let faces: Vec<_> = text.lines().filter(|line| line.starts_with('f')).collect();
        assert_eq!(faces, ["f 1 2 3", "f 4/1 5/2 6/3", "f 7/4 8/5 9/6"]);
        assert_eq!(text.lines().filter(|line| line.starts_with("v ")).count(), 9);
        assert!(
            text.contains("\no b v 1\n") && text.contains("v 0.0 0.1 0.0\n") && text.contains("vt 1.0 0.0\n")
        );
    }

    #[test]
    fn ply_has_the_bytes_its_header_tells_of() {
        for (precision, number) in [(Precision::Single, 4), (Precision::Double, 8)] {
            for (second_has, per_vertex) in [(false, 3), (true, 5)] {
                let bytes = ply(&[triangle("a", 0.0, false), triangle("b", 5.0, second_has)], precision);
                let header = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
                assert_eq!(bytes.len() - header, 6 * per_vertex * number + 2 * 13);
                let last = &bytes[bytes.len() - 13..];
                assert_eq!(last, [3, 3, 0, 0, 0, 4, 0, 0, 0, 5, 0, 0, 0]);
                let text = String::from_utf8_lossy(&bytes[..header]).into_owned();
                assert_eq!(text.contains(" u\n"), second_has);
                if precision == Precision::Double {
                    let x =
                        f64::from_le_bytes(bytes[header + 2 * per_vertex * 8 + 8..][..8].try_into().unwrap());
                    assert_eq!(x, 0.1, "y of the third vertex, to the bit");
                }
            }
        }
    }
}
