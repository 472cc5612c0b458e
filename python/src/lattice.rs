//! Control lattices.

use std::path::Path;

use glam::DMat3;
use numpy::{PyArray1, PyArray4, PyArrayMethods, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;
use trimray::model::{self, DragEdit, DragSources, Edit};
use trimray::scene::{DeformDescription, DragPlaces, EditDescription, parse_scene_str};
use trimray::spline::{ControlLattice, SplineVolume};

use crate::arrays::{Rows, Vectors, control_points, in_columns};
use crate::errors::{input_error, scene_error, value_error};

/// Points that a thread maps at once.
const CHUNK: usize = 1024;

/// A lattice over a box of its own, whose control points NumPy holds.
#[pyclass(frozen, module = "trimray._trimray")]
pub(crate) struct Lattice {
    settings: model::Lattice,
    identity: ControlLattice,
    /// (nx, ny, nz, 4): x, y, z, weight
    #[pyo3(get)]
    numbers: Py<PyArray4<f64>>,
}

/// Rank, condition, sum of the squared changes, and where the sources are now.
type DragReport<'py> = (usize, f64, f64, Rows<'py, f64>);

/// The lattice of a scene's only object, and its edits.
fn parsed(text: &str) -> PyResult<(model::Lattice, Vec<EditDescription>)> {
    let mut scene =
        parse_scene_str(text, Path::new("lattice")).map_err(|error| scene_error(&error, false))?;
    let object = scene.objects.pop().and_then(|mut object| object.deform.pop());
    match object.map(|deform| deform.value) {
        Some(DeformDescription::Lattice { lattice, edits }) => {
            Ok((lattice, edits.into_iter().map(|edit| edit.value).collect()))
        }
        _ => Err(value_error("the scene has no lattice")),
    }
}

#[pymethods]
impl Lattice {
    /// The lattice of a scene with one object that has it.
    #[new]
    fn new(py: Python<'_>, text: &str) -> PyResult<Self> {
        let (settings, _) = parsed(text)?;
        let bounds = settings.bounds.ok_or_else(|| value_error("bounds: are needed"))?;
        let identity = ControlLattice::identity(settings.degree, settings.points, bounds, settings.hold)
            .map_err(input_error)?;
        let [nx, ny, nz] = identity.counts();
        let numbers: Vec<f64> = identity.points().iter().flat_map(|point| point.to_array()).collect();
        let numbers = numbers.to_pyarray(py).reshape([nx, ny, nz, 4])?.unbind();
        Ok(Self { settings, identity, numbers })
    }

    /// Applies the edits of a scene with one object that has this lattice. Of each drag it makes a report.
    #[pyo3(signature = (text, least_squares = false))]
    fn edit<'py>(&self, py: Python<'py>, text: &str, least_squares: bool) -> PyResult<Vec<DragReport<'py>>> {
        let (_, edits) = parsed(text)?;
        let mut lattice = self.read(py)?;
        let mut reports = Vec::new();
        for edit in edits {
            let edit = match edit {
                EditDescription::Complete(edit) => edit,
                EditDescription::Drag { sources: DragPlaces::Points(points), targets, using } => {
                    let sources = DragSources::Points(points);
                    Edit::Drag(DragEdit { sources, targets, using, least_squares })
                }
                _ => return Err(value_error("this edit needs a scene")),
            };
            if let Some(report) = edit.apply_to(&mut lattice).map_err(input_error)? {
                let reached = report.drags.iter().flat_map(|drag| drag.reached.to_array()).collect();
                reports.push((report.rank, report.condition, report.objective, in_columns(py, reached, 3)?));
            }
        }
        let mut numbers = self.numbers.bind(py).try_readwrite().map_err(value_error)?;
        let changed = lattice.points().iter().flat_map(|point| point.to_array());
        numbers.as_array_mut().iter_mut().zip(changed).for_each(|(number, changed)| *number = changed);
        Ok(reports)
    }

    /// Where points of shape (N, 3) go; those outside the box stay.
    fn evaluate<'py>(&self, py: Python<'py>, points: PyReadonlyArray2<'py, f64>) -> PyResult<Rows<'py, f64>> {
        let points = Vectors::new("points", &points)?;
        let volume = self.volume(py)?;
        let moved = py.detach(|| {
            let mut moved = vec![0.0; 3 * points.len()];
            moved.par_chunks_mut(3 * CHUNK).enumerate().for_each(|(chunk, moved)| {
                let of_chunk = (chunk * CHUNK..points.len()).take(moved.len() / 3).map(|row| points.get(row));
                let mut rows = moved.chunks_exact_mut(3);
                volume.positions(of_chunk, |point, position| {
                    if let Some(row) = rows.next() {
                        row.copy_from_slice(&position.unwrap_or(point).to_array());
                    }
                });
            });
            moved
        });
        in_columns(py, moved, 3)
    }

    /// The partials of the map at points of shape (N, 3), nine numbers a row: row by row of the matrix.
    fn jacobian<'py>(&self, py: Python<'py>, points: PyReadonlyArray2<'py, f64>) -> PyResult<Rows<'py, f64>> {
        let points = Vectors::new("points", &points)?;
        let volume = self.volume(py)?;
        let matrices = py.detach(|| {
            let mut matrices = vec![0.0; 9 * points.len()];
            matrices.par_chunks_mut(9 * CHUNK).enumerate().for_each(|(chunk, matrices)| {
                for (row, matrix) in matrices.chunks_exact_mut(9).enumerate() {
                    let point = volume.eval(points.get(chunk * CHUNK + row));
                    let jacobian = point.map_or(DMat3::IDENTITY, |point| point.jacobian);
                    matrix.copy_from_slice(&jacobian.transpose().to_cols_array());
                }
            });
            matrices
        });
        in_columns(py, matrices, 9)
    }

    /// Which points of shape (N, 3) the box holds.
    fn contains<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let points = Vectors::new("points", &points)?;
        let volume = self.volume(py)?;
        let inside: Vec<bool> = points.iter().map(|point| volume.knot_box(point).is_some()).collect();
        Ok(inside.to_pyarray(py))
    }

    /// How the places of points of shape (N, 3) depend on the control points: places of control points and factors, both of shape
    /// (N, M); of points outside the box the factors are 0.
    fn derivatives<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<(Rows<'py, i64>, Rows<'py, f64>)> {
        let points = Vectors::new("points", &points)?;
        let lattice = self.read(py)?;
        let width: usize = self.settings.degree.iter().map(|degree| degree + 1).product();
        let mut indices = vec![0_i64; width * points.len()];
        let mut factors = vec![0.0; width * points.len()];
        py.detach(|| {
            let rows = indices.par_chunks_mut(width).zip(factors.par_chunks_mut(width)).with_min_len(CHUNK);
            rows.enumerate().for_each(|(row, (indices, factors))| {
                let found = lattice.derivatives(points.get(row)).unwrap_or_default();
                for ((index, factor), (flat, value)) in indices.iter_mut().zip(factors).zip(found) {
                    // lattices are far smaller
                    *index = i64::try_from(flat).unwrap_or(i64::MAX);
                    *factor = value;
                }
            });
        });
        Ok((in_columns(py, indices, width)?, in_columns(py, factors, width)?))
    }
}

impl Lattice {
    /// The lattice with the numbers that the array holds now.
    fn read(&self, py: Python<'_>) -> PyResult<ControlLattice> {
        let points = control_points(self.numbers.bind(py).readonly().as_array());
        let mut lattice = self.identity.clone();
        lattice.set_all(points).map_err(input_error)?;
        Ok(lattice)
    }

    fn volume(&self, py: Python<'_>) -> PyResult<SplineVolume> {
        self.read(py)?.volume().map_err(input_error)
    }
}
