//! Scenes, ready to trace and render.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use numpy::{IntoPyArray, PyReadonlyArray2, PyReadonlyArray4, PyUntypedArrayMethods};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use trimray::cli::embedded;
use trimray::deviation::{Deviation, deviation};
use trimray::export::exact_patches;
use trimray::memory::MemoryLimit;
use trimray::model::{Edit, Representation, bounds_of};
use trimray::scene::{
    BuiltScene, DeformDescription, EditDescription, Located, ObjectShape, SceneDescription, SceneError,
    parse_scene, parse_scene_str,
};
use trimray::tessellate::{Fineness, Tessellation, tessellate_within};
use trimray::trace::{HitArrays, Ray, TracedObject};

use crate::arrays::{Vectors, control_points, in_columns, rows};
use crate::errors::{cli_error, input_error, interrupted, scene_error, value_error};
use crate::mesh::Mesh;
use crate::wait::interruptible;

/// Fewer rays than this are traced before anybody could press Ctrl-C.
const FEW_RAYS: usize = 1 << 14;

/// How much too large a box around an object may be, in parts of its size.
const TIGHTNESS: f64 = 1e-4;

/// A scene that is built.
#[pyclass(frozen, module = "trimray._trimray")]
pub(crate) struct Scene {
    pub(crate) description: SceneDescription,
    pub(crate) built: BuiltScene,
}

/// Rays of two arrays of as many rows.
#[derive(Clone, Copy)]
struct Rays<'a> {
    origins: Vectors<'a>,
    directions: Vectors<'a>,
}

impl<'a> Rays<'a> {
    fn new(
        py: Python<'_>,
        origins: &'a PyReadonlyArray2<'_, f64>,
        directions: &'a PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Self> {
        let rays = Self {
            origins: Vectors::new("origins", origins)?,
            directions: Vectors::new("directions", directions)?,
        };
        if rays.origins.len() != rays.directions.len() {
            return Err(value_error("origins: not as many as directions"));
        }
        let all =
            py.detach(|| (0..rays.len()).into_par_iter().find_first(|row| !rays.get(*row).is_traceable()));
        match all {
            None => Ok(rays),
            Some(row) if !rays.get(row).origin.is_finite() => {
                Err(value_error(format!("origins: row {row}: not finite")))
            }
            Some(row) if !rays.get(row).direction.is_finite() => {
                Err(value_error(format!("directions: row {row}: not finite")))
            }
            Some(row) => {
                let direction = rays.get(row).direction;
                Err(value_error(format!(
                    "directions: row {row}: the direction {direction} has no usable length"
                )))
            }
        }
    }

    fn len(self) -> usize {
        self.origins.len()
    }

    fn get(self, row: usize) -> Ray {
        Ray::new(self.origins.get(row), self.directions.get(row))
    }

    /// Traces them, so that Ctrl-C ends it if there are many.
    fn traced<T: Send, E: Send>(
        self,
        py: Python<'_>,
        trace: impl FnOnce(&AtomicBool) -> Result<T, E> + Send,
    ) -> PyResult<T> {
        let traced = if self.len() < FEW_RAYS {
            py.detach(|| trace(&AtomicBool::new(false)))
        } else {
            interruptible(py, trace, |_| Ok(()))?
        };
        traced.map_err(|_| interrupted())
    }
}

/// Hits as arrays by their names.
fn named<'py>(py: Python<'py>, hits: HitArrays) -> PyResult<Bound<'py, PyDict>> {
    let arrays = PyDict::new(py);
    arrays.set_item("t", hits.t.into_pyarray(py))?;
    for (name, ids) in HitArrays::ID_NAMES.iter().zip(hits.ids) {
        arrays.set_item(name, ids.into_pyarray(py))?;
    }
    for (name, numbers) in HitArrays::PAIR_NAMES.iter().zip(hits.pairs) {
        arrays.set_item(name, in_columns(py, numbers, 2)?)?;
    }
    for (name, numbers) in HitArrays::VECTOR_NAMES.iter().zip(hits.vectors) {
        arrays.set_item(name, in_columns(py, numbers, 3)?)?;
    }
    Ok(arrays)
}

impl Scene {
    fn build(
        py: Python<'_>,
        mut description: SceneDescription,
        (method, least_squares): (Option<&str>, bool),
        has_file: bool,
    ) -> PyResult<Self> {
        description.least_squares = least_squares;
        description.memory = MemoryLimit::of_machine();
        description.pictures.memory = description.memory;
        if let Some(method) = method {
            let method: Representation = method.parse().map_err(input_error)?;
            description.objects.iter_mut().for_each(|object| object.method = method);
        }
        let built = py.detach(|| description.build()).map_err(|error| scene_error(&error, has_file))?;
        Ok(Self { description, built })
    }

    fn object(&self, index: usize) -> PyResult<&TracedObject> {
        let objects = self.built.traced.objects();
        let none = || PyIndexError::new_err(format!("object {index}: the scene has {}", objects.len()));
        objects.get(index).ok_or_else(none)
    }
}

#[pymethods]
impl Scene {
    /// A scene by the text of a scene file that no file holds. `meshes` take the places of objects' mesh files, by their indices;
    /// `lattices` those of the only edits of deformations, by the indices of objects and deformations.
    #[new]
    fn new(
        py: Python<'_>,
        text: &str,
        meshes: Vec<(usize, Bound<'_, Mesh>)>,
        lattices: Vec<(usize, usize, PyReadonlyArray4<'_, f64>)>,
        method: Option<&str>,
        least_squares: bool,
    ) -> PyResult<Self> {
        let fault = |error: SceneError| scene_error(&error, false);
        let mut scene = parse_scene_str(text, Path::new("<scene>")).map_err(fault)?;
        for (object, mesh) in meshes {
            let Some(object) = scene.objects.get_mut(object) else { continue };
            let (value, location) = (Arc::clone(&mesh.get().mesh), object.shape.location());
            object.shape = ObjectShape::Polygons(Located { value, location });
        }
        for (object, deform, numbers) in lattices {
            let deform = scene.objects.get_mut(object).and_then(|object| object.deform.get_mut(deform));
            if let Some(DeformDescription::Lattice { lattice, edits }) =
                deform.map(|deform| &mut deform.value)
                && let [edit] = edits.as_mut_slice()
            {
                let [nx, ny, nz] = lattice.points;
                if numbers.shape() != [nx, ny, nz, 4] {
                    return Err(value_error("control_points: not as many as the lattice has"));
                }
                edit.value =
                    EditDescription::Complete(Edit::ControlPoints(control_points(numbers.as_array())));
            }
        }
        Self::build(py, scene, (method, least_squares), false)
    }

    /// The scene of a file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, method: Option<&str>, least_squares: bool) -> PyResult<Self> {
        let scene = parse_scene(&path).map_err(|error| scene_error(&error, true))?;
        Self::build(py, scene, (method, least_squares), true)
    }

    /// What is odd about it, as the program says it when it builds a scene.
    fn warnings(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for (object, made) in self.description.objects.iter().zip(&self.built.objects) {
            let notes = made.notes.to_string();
            let all = notes.lines().skip(1).chain(made.warnings.iter().map(String::as_str));
            lines.extend(all.map(|line| format!("{}: {line}", object.name.value)));
        }
        lines
    }

    /// The objects' names.
    fn names(&self) -> Vec<String> {
        self.built.traced.objects().iter().map(|object| object.name.clone()).collect()
    }

    /// The files that it is made of, its own first.
    fn files(&self) -> Vec<PathBuf> {
        self.description.files().into_iter().map(Path::to_owned).collect()
    }

    /// Least and greatest corner of an object.
    fn object_bounds(&self, py: Python<'_>, object: usize) -> PyResult<[[f64; 3]; 2]> {
        let object = self.object(object)?;
        Ok(py.detach(|| bounds_of(object.faces(), TIGHTNESS)).map(|corner| corner.to_array()))
    }

    /// The JSON of `trimray info`.
    fn info(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| embedded::info_json(&self.description, &self.built)).map_err(|error| cli_error(&error))
    }

    /// The JSON of `trimray drags`.
    fn drags(&self) -> PyResult<String> {
        embedded::drags_json(&self.description, &self.built).map_err(|error| cli_error(&error))
    }

    /// The JSON of the exact patches.
    fn patches(&self, py: Python<'_>) -> PyResult<String> {
        let json = py.detach(|| exact_patches(&self.built)).map_err(input_error)?;
        String::from_utf8(json).map_err(input_error)
    }

    /// The nearest hits of rays, by the names of their arrays.
    fn trace<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f64>,
        directions: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (rays, scene) = (Rays::new(py, &origins, &directions)?, &self.built.traced);
        let (hits, _) =
            rays.traced(py, |cancel| scene.closest_batch(rays.len(), |row| rays.get(row), cancel))?;
        named(py, hits)
    }

    /// Whether rays hit anything.
    fn occluded<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f64>,
        directions: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, numpy::PyArray1<bool>>> {
        let (rays, scene) = (Rays::new(py, &origins, &directions)?, &self.built.traced);
        let (found, _) =
            rays.traced(py, |cancel| scene.any_batch(rays.len(), |row| rays.get(row), cancel))?;
        Ok(found.into_pyarray(py))
    }

    /// Every hit of rays in one run, sorted along each, by the names of their arrays, and `offsets`.
    fn trace_all<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'py, f64>,
        directions: PyReadonlyArray2<'py, f64>,
        once: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (rays, scene) = (Rays::new(py, &origins, &directions)?, &self.built.traced);
        let (hits, offsets, _) =
            rays.traced(py, |cancel| scene.all_batch(rays.len(), |row| rays.get(row), once, cancel))?;
        let arrays = named(py, hits)?;
        arrays.set_item("offsets", offsets.into_pyarray(py))?;
        Ok(arrays)
    }

    /// An object as triangles.
    fn tessellate<'py>(
        &self,
        py: Python<'py>,
        object: usize,
        tolerance: Option<f64>,
        level: Option<u32>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let traced = self.object(object)?;
        let [low, high] = self.built.traced.object_bounds(object);
        let fineness = match (tolerance, level) {
            (Some(tolerance), _) => Fineness::Tolerance(tolerance),
            (None, Some(level)) => Fineness::Level(level),
            (None, None) => Fineness::Tolerance(embedded::TOLERANCE * (high - low).length()),
        };
        let memory = self.description.memory;
        let made =
            interruptible(py, |cancel| tessellate_within(traced, fineness, cancel, memory), |_| Ok(()))?;
        let Tessellation { positions, uvs, normals, triangles, faces, deviation, .. } =
            made.map_err(input_error)?;
        let arrays = PyDict::new(py);
        arrays.set_item("vertices", rows(py, &positions)?)?;
        arrays.set_item("triangles", in_columns(py, triangles.concat(), 3)?)?;
        arrays.set_item("faces", faces.into_pyarray(py))?;
        arrays.set_item("uvs", in_columns(py, uvs.iter().flat_map(|uv| uv.to_array()).collect(), 2)?)?;
        arrays.set_item("normals", rows(py, &normals)?)?;
        arrays.set_item("deviation", deviation)?;
        Ok(arrays)
    }

    /// How far the triangles that an object of another scene is made of are from an object, in world units and degrees.
    fn deviation<'py>(
        &self,
        py: Python<'py>,
        object: usize,
        other: Bound<'py, Self>,
        other_object: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (exact, triangles) = (self.object(object)?, other.get().object(other_object)?);
        let found =
            interruptible(py, |cancel| deviation(exact.faces(), triangles.faces(), cancel), |_| Ok(()))?;
        let Deviation { max, bound, mean, normal_max_degrees, normal_mean_degrees } =
            found.map_err(input_error)?;
        let figures = PyDict::new(py);
        figures.set_item("max", max)?;
        figures.set_item("bound", bound)?;
        figures.set_item("mean", mean)?;
        figures.set_item("normal_max_degrees", normal_max_degrees)?;
        figures.set_item("normal_mean_degrees", normal_mean_degrees)?;
        Ok(figures)
    }

    /// `trimray export`: `flags` are all but the scene's name.
    fn export(&self, py: Python<'_>, flags: Vec<OsString>) -> PyResult<()> {
        py.detach(|| embedded::export_scene(&self.description, &self.built, flags))
            .map_err(|error| cli_error(&error))
    }
}
