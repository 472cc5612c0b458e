//! Builds, renders and measures.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use glam::DVec3;
use thiserror::Error;

use super::silhouette::Silhouette;
use super::{Bytes, MethodResult, Seconds};
use crate::deviation::{Deviation, DeviationError, deviation};
use crate::film::{Aov, Image};
use crate::render::{RenderControl, RenderError, Rendered, render};
use crate::scene::{BuiltScene, Method, ObjectShape, SceneDescription, SceneError};
use crate::shade::{Camera, CameraError, ShadingScene};

/// Tolerances of adaptive subdivision where none are asked for, in parts of the greatest deformed object's diagonal.
const TOLERANCES: [f64; 3] = [1e-3, 1e-4, 1e-5];

/// Points on each side of the grids at which exact patches are checked against their volumes.
const CHECKS: usize = 6;

/// What is compared.
#[derive(Clone, Debug, Default)]
pub struct CompareSettings {
    /// The methods beside the exact one.
    pub methods: Vec<Method>,
    /// Threads; 0 is one for each processor.
    pub threads: usize,
}

/// Why a scene cannot be compared.
#[derive(Debug, Error)]
pub enum CompareError {
    /// The scene or a file it names is wrong.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Its camera makes no picture.
    #[error("[camera]: {0}")]
    Camera(#[from] CameraError),
    /// Nothing is deformed.
    #[error("{0}: no object is deformed, so all methods are the same")]
    NotDeformed(String),
    /// Rendering failed or was interrupted.
    #[error(transparent)]
    Render(#[from] RenderError),
}

/// Pointwise from level 0 to `levels`, and adaptive with three tolerances that suit the size of the deformed objects.
///
/// # Errors
/// If the scene cannot be built.
pub fn default_methods(scene: &SceneDescription, levels: u32) -> Result<Vec<Method>, CompareError> {
    let built = by_method(scene, Method::Exact).build()?;
    let diagonals = deformed(scene).into_iter().map(|index| diagonal(&built, index));
    let size = diagonals.fold(0.0, f64::max);
    // to one digit
    let unit = libm::exp10(libm::floor(libm::log10(size.max(f64::MIN_POSITIVE))));
    let rounded = (size / unit).round() * unit;
    // surfaces have no triangles to split
    let has_mesh = deformed(scene).iter().any(|&index| scene.objects[index].shape.mesh().is_some());
    let pointwise = (0..=levels).filter(|_| has_mesh).map(|level| Method::Pointwise { level });
    let digits = |tolerance: f64| format!("{tolerance:.0e}").parse().unwrap_or(tolerance);
    let adaptive = TOLERANCES.map(|tolerance| Method::Adaptive { tolerance: digits(tolerance * rounded) });
    Ok(pointwise.chain(adaptive).collect())
}

/// Indices of the objects that are deformed.
fn deformed(scene: &SceneDescription) -> Vec<usize> {
    (0..scene.objects.len()).filter(|&index| !scene.objects[index].deform.is_empty()).collect()
}

fn diagonal(built: &BuiltScene, object: usize) -> f64 {
    let [low, high] = built.traced.object_bounds(object);
    (high - low).length()
}

/// The scene with its deformed objects by one method; surfaces, which have no triangles to split, stay exact under
/// [`Method::Pointwise`].
fn by_method(scene: &SceneDescription, method: Method) -> SceneDescription {
    let mut scene = scene.clone();
    for object in &mut scene.objects {
        let is_mesh = matches!(object.shape, ObjectShape::Mesh(_));
        let splits = is_mesh || matches!(method, Method::Adaptive { .. });
        object.method = if object.deform.is_empty() || !splits { Method::Exact } else { method };
    }
    scene
}

/// A result and what it was made of.
#[derive(Clone, Copy, Debug)]
pub struct Made<'a> {
    /// The scene by the method.
    pub scene: &'a SceneDescription,
    /// The same, built.
    pub built: &'a BuiltScene,
    /// Its camera.
    pub camera: &'a Camera,
    /// What was measured.
    pub result: &'a MethodResult,
}

/// Builds, renders and measures a scene exactly, again with other random numbers, and by each method. `next` is told what is done
/// next, `each` is given the results, in this order.
///
/// # Errors
/// If the scene cannot be built or rendered by any of them, if `each` fails, or on `cancel`.
pub fn measure<E: From<CompareError>>(
    scene: &SceneDescription,
    settings: &CompareSettings,
    cancel: &AtomicBool,
    mut next: impl FnMut(&Method),
    mut each: impl FnMut(Made<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let objects = deformed(scene);
    if objects.is_empty() {
        return Err(CompareError::NotDeformed(scene.path.display().to_string()).into());
    }
    let mut scene = scene.clone();
    scene.render.aovs = vec![Aov::Depth, Aov::Normal, Aov::Object];
    next(&Method::Exact);
    let started = Instant::now();
    let exact_scene = by_method(&scene, Method::Exact);
    let exact = exact_scene.build().map_err(CompareError::from)?;
    let build = started.elapsed().as_secs_f64();
    // all pictures from one place, which may depend on the object's size
    scene.camera = Some(exact.camera);
    let camera = Camera::try_new(&exact.camera, scene.film.size).map_err(CompareError::from)?;
    let mut comparing = Comparing { settings, cancel, camera: &camera, objects, exact: None };
    let result = comparing.result((&exact_scene, Method::Exact), &exact, build)?;
    each(Made { scene: &exact_scene, built: &exact, camera: &camera, result: &result })?;
    comparing.exact = Some((&exact, comparing.silhouette(&exact, &scene)));
    let mut again = exact_scene.clone();
    again.render.seed = again.render.seed.wrapping_add(1);
    let result = comparing.result((&again, Method::Exact), &exact, build)?;
    each(Made {
        scene: &again,
        built: &exact,
        camera: &camera,
        result: &MethodResult { noise: true, ..result },
    })?;
    for &method in &settings.methods {
        next(&method);
        let started = Instant::now();
        let by_method = by_method(&scene, method);
        let built = by_method.build().map_err(CompareError::from)?;
        let build = started.elapsed().as_secs_f64();
        let result = comparing.result((&by_method, method), &built, build)?;
        each(Made { scene: &by_method, built: &built, camera: &camera, result: &result })?;
    }
    Ok(())
}

struct Comparing<'a> {
    settings: &'a CompareSettings,
    cancel: &'a AtomicBool,
    camera: &'a Camera,
    /// The deformed objects.
    objects: Vec<usize>,
    /// The exact scene and its silhouette, once there is one.
    exact: Option<(&'a BuiltScene, Silhouette)>,
}

impl Comparing<'_> {
    fn result(
        &self,
        (scene, method): (&SceneDescription, Method),
        built: &BuiltScene,
        build: f64,
    ) -> Result<MethodResult, CompareError> {
        let started = Instant::now();
        let image = self.render(scene, built)?;
        let render = started.elapsed().as_secs_f64();
        let started = Instant::now();
        let deviation = self.deviation(scene, built)?;
        let seconds = Seconds { build, render, deviation: started.elapsed().as_secs_f64() };
        let patches = self.objects.iter().map(|&index| built.traced.objects()[index].patches.len()).sum();
        let silhouette = match &self.exact {
            None => Some(super::SilhouetteError::default()),
            Some((_, exact)) => exact.error(&self.silhouette(built, scene)),
        };
        let triangles = match method {
            Method::Exact | Method::Triangular => {
                self.objects.iter().map(|&index| built.objects[index].notes.triangles).sum()
            }
            _ => patches,
        };
        let is_exact = matches!(method, Method::Exact | Method::Triangular);
        let bytes = Bytes::of(built, &self.objects, is_exact);
        Ok(MethodResult {
            method,
            noise: false,
            image,
            triangles,
            patches,
            deviation,
            silhouette,
            seconds,
            bytes,
        })
    }

    fn silhouette(&self, built: &BuiltScene, scene: &SceneDescription) -> Silhouette {
        Silhouette::of(&built.traced, self.camera, scene.film.size)
    }

    fn render(&self, scene: &SceneDescription, built: &BuiltScene) -> Result<Image, CompareError> {
        let shading = ShadingScene {
            geometry: &built.traced,
            object_materials: &built.materials,
            lights: &built.lights,
        };
        let control = RenderControl { threads: self.settings.threads, ..RenderControl::new(self.cancel) };
        let Rendered { image, .. } = render(&shading, self.camera, &scene.film, &scene.render, &control)?;
        Ok(image)
    }

    /// The greatest of each figure among the deformed objects, lengths in parts of their own diagonals.
    fn deviation(
        &self,
        scene: &SceneDescription,
        built: &BuiltScene,
    ) -> Result<Result<Deviation, String>, CompareError> {
        let mut worst = Deviation::default();
        for &index in &self.objects {
            let found = match &self.exact {
                _ if matches!(scene.objects[index].method, Method::Exact | Method::Triangular) => {
                    Ok(rounding(built, index))
                }
                None => Ok(rounding(built, index)),
                Some((exact, _)) => deviation(
                    &exact.traced.objects()[index].patches,
                    &built.traced.objects()[index].patches,
                    self.cancel,
                ),
            };
            let found = match found {
                Ok(found) => found,
                Err(DeviationError::Interrupted) => return Err(RenderError::Interrupted.into()),
                Err(error) => return Ok(Err(error.to_string())),
            };
            let exact = self.exact.as_ref().map_or(built, |(exact, _)| exact);
            let diagonal = diagonal(exact, index);
            worst = Deviation {
                max: worst.max.max(found.max / diagonal),
                bound: worst.bound.max(found.bound / diagonal),
                mean: worst.mean.max(found.mean / diagonal),
                normal_max: worst.normal_max.max(found.normal_max),
                normal_mean: worst.normal_mean.max(found.normal_mean),
            };
        }
        Ok(Ok(worst))
    }
}

/// How far exact patches are from where their volumes take their places, by rounding: at points all over the pieces.
fn rounding(built: &BuiltScene, index: usize) -> Deviation {
    let volumes = &built.objects[index].lattices;
    let mut found = Deviation::default();
    let (mut sum, mut count) = (0.0, 0.0);
    for patch in &built.traced.objects()[index].patches {
        // of what is no Bézier patch the proven bound
        if patch.exact.is_some() || volumes.is_empty() {
            found.max = found.max.max(patch.error());
            continue;
        }
        for trim_loop in patch.trim.loops() {
            let corners = patch.trim.corners(trim_loop);
            for k in 1..corners.len() - 1 {
                for (i, j) in (0..=CHECKS).flat_map(|i| (0..=CHECKS - i).map(move |j| (i, j))) {
                    let [v, w] = [i, j].map(|n| n as f64 / CHECKS as f64);
                    let st = corners[0] * (1.0 - v - w) + corners[k] * v + corners[k + 1] * w;
                    let place = |rest: DVec3| {
                        let mut volumes = volumes.iter().map(|lattice| &lattice.volume);
                        let Some(first) = volumes.next() else { return rest };
                        let moved = match patch.cell() {
                            Some(cell) => first.eval_in_cell(cell, rest).position,
                            None => rest,
                        };
                        volumes.fold(moved, |p, volume| volume.eval(p).map_or(p, |point| point.position))
                    };
                    let off = patch.eval(st).position.distance(place(patch.frame.point(st)));
                    found.max = found.max.max(off);
                    sum += off;
                    count += 1.0;
                }
            }
        }
    }
    found.bound = found.max;
    if count > 0.0 {
        found.mean = sum / count;
    }
    found
}
