//! NumPy's arrays as the library's vectors.

use glam::{DVec2, DVec3, DVec4};
use numpy::ndarray::{ArrayView2, ArrayView4};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::errors::value_error;

/// An array of shape (N, M).
pub(crate) type Rows<'py, T> = Bound<'py, PyArray2<T>>;

/// The rows of an array of shape (N, 3), whatever its strides.
#[derive(Clone, Copy)]
pub(crate) struct Vectors<'a>(ArrayView2<'a, f64>);

impl<'a> Vectors<'a> {
    pub(crate) fn new(name: &str, array: &'a PyReadonlyArray2<'_, f64>) -> PyResult<Self> {
        let view = array.as_array();
        if view.ncols() != 3 {
            return Err(value_error(format!("{name}: has the shape {:?}, (N, 3) is needed", view.shape())));
        }
        Ok(Self(view))
    }

    pub(crate) fn len(&self) -> usize {
        self.0.nrows()
    }

    pub(crate) fn get(&self, row: usize) -> DVec3 {
        DVec3::new(self.0[[row, 0]], self.0[[row, 1]], self.0[[row, 2]])
    }

    pub(crate) fn iter(self) -> impl Iterator<Item = DVec3> {
        (0..self.len()).map(move |row| self.get(row))
    }
}

/// The pairs of an array of shape (N, 2).
pub(crate) fn pairs(name: &str, array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<DVec2>> {
    let view = array.as_array();
    if view.ncols() != 2 {
        return Err(value_error(format!("{name}: has the shape {:?}, (N, 2) is needed", view.shape())));
    }
    Ok(view.rows().into_iter().map(|row| DVec2::new(row[0], row[1])).collect())
}

/// Control points with their weights, the third index fastest, of an array of shape (nx, ny, nz, 4).
pub(crate) fn control_points(view: ArrayView4<'_, f64>) -> Vec<DVec4> {
    let (nx, ny, nz, _) = view.dim();
    let mut points = Vec::with_capacity(nx * ny * nz);
    for (i, j) in (0..nx).flat_map(|i| (0..ny).map(move |j| (i, j))) {
        points.extend((0..nz).map(|k| DVec4::from_array(std::array::from_fn(|c| view[[i, j, k, c]]))));
    }
    points
}

/// Vectors as an array of shape (N, 3).
pub(crate) fn rows<'py>(py: Python<'py>, vectors: &[DVec3]) -> PyResult<Rows<'py, f64>> {
    let numbers: Vec<f64> = vectors.iter().flat_map(|vector| vector.to_array()).collect();
    in_columns(py, numbers, 3)
}

/// Numbers as an array of shape (N, columns).
pub(crate) fn in_columns<T: numpy::Element>(
    py: Python<'_>,
    numbers: Vec<T>,
    columns: usize,
) -> PyResult<Rows<'_, T>> {
    let count = numbers.len() / columns;
    let array: Bound<'_, PyArray1<T>> = numbers.into_pyarray(py);
    array.reshape([count, columns])
}
