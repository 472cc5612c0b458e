//! Polygon meshes.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use trimray::mesh::{Corner, MeshParts, PolygonMesh, load_mesh};

use crate::arrays::{Vectors, pairs, rows};
use crate::errors::{input_error, value_error};

/// A mesh in memory.
#[pyclass(frozen, module = "trimray._trimray")]
pub(crate) struct Mesh {
    pub(crate) mesh: Arc<PolygonMesh>,
    /// What its file holds that is not used.
    #[pyo3(get)]
    notes: Vec<String>,
}

#[pymethods]
impl Mesh {
    /// A mesh of vertices and faces, of which all corners stand in one run; texture coordinates and normals are the vertices'.
    #[new]
    fn new(
        vertices: PyReadonlyArray2<'_, f64>,
        corners: PyReadonlyArray1<'_, i64>,
        arities: PyReadonlyArray1<'_, i64>,
        uvs: Option<PyReadonlyArray2<'_, f64>>,
        normals: Option<PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<Self> {
        let positions: Vec<_> = Vectors::new("vertices", &vertices)?.iter().collect();
        let uvs = uvs.map(|uvs| pairs("uvs", &uvs)).transpose()?.unwrap_or_default();
        let normals = match &normals {
            Some(normals) => Vectors::new("normals", normals)?.iter().collect(),
            None => Vec::new(),
        };
        for (name, count) in [("uvs", uvs.len()), ("normals", normals.len())] {
            if count != 0 && count != positions.len() {
                return Err(value_error(format!(
                    "{name}: has {count} rows for {} vertices",
                    positions.len()
                )));
            }
        }
        let count = positions.len();
        let vertex = |&index: &i64| match u32::try_from(index) {
            Ok(index) if (index as usize) < count => Ok(Corner {
                position: index,
                uv: (!uvs.is_empty()).then_some(index),
                normal: (!normals.is_empty()).then_some(index),
            }),
            _ => Err(value_error(format!("faces: refers to vertex {index}, but there are {count}"))),
        };
        let corners = corners.as_array().iter().map(vertex).collect::<PyResult<Vec<_>>>()?;
        let arity = |&arity: &i64| u32::try_from(arity).map_err(value_error);
        let arities = arities.as_array().iter().map(arity).collect::<PyResult<Vec<_>>>()?;
        let face_objects = vec![0; arities.len()];
        let object_names = vec![String::new()];
        let parts = MeshParts {
            positions,
            uvs,
            normals,
            corners,
            arities,
            face_objects,
            object_names,
            ..Default::default()
        };
        let mesh = PolygonMesh::try_new(parts).map_err(value_error)?;
        Ok(Self { mesh: Arc::new(mesh), notes: Vec::new() })
    }

    /// Reads a file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let (mesh, notes) = py.detach(|| load_mesh(&path)).map_err(input_error)?;
        let notes = notes.to_string().lines().skip(1).map(str::to_owned).collect();
        Ok(Self { mesh: Arc::new(mesh), notes })
    }

    /// Positions, (N, 3).
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows(py, self.mesh.positions())
    }

    /// The vertex of each corner, face by face, and the number of corners of each face.
    fn faces<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<i64>>) {
        let corners: Vec<i64> = self
            .mesh
            .faces()
            .flat_map(|face| face.corners())
            .map(|corner| i64::from(corner.position))
            .collect();
        let arities: Vec<i64> =
            self.mesh.faces().map(|face| i64::try_from(face.arity()).unwrap_or(i64::MAX)).collect();
        (corners.into_pyarray(py), arities.into_pyarray(py))
    }
}
