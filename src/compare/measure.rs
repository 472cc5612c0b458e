//! Builds, renders and measures.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use glam::DVec3;
use thiserror::Error;

use super::silhouette::{Silhouette, SilhouetteError};
use super::{Bytes, MethodResult, Seconds};
use crate::deviation::{Deviation, DeviationError, deviation};
use crate::film::{Aov, Image};
use crate::model::Representation;
use crate::render::{RenderControl, RenderError, Rendered};
use crate::scene::{BuiltScene, SceneDescription, SceneError};
use crate::shade::{Camera, CameraError};

/// Tolerances of adaptive subdivision where none are asked for, in parts of the greatest deformed object's diagonal.
const TOLERANCES: [f64; 3] = [1e-3, 1e-4, 1e-5];

/// Points on each side of the grids at which exact patches are checked against their volumes.
const CHECKS: usize = 6;

/// What is compared.
#[derive(Clone, Debug, Default)]
pub struct CompareSettings {
    /// Pointwise from level 0 to this one, where there is a mesh: surfaces have no triangles to split.
    pub levels: u32,
    /// Tolerances of adaptive subdivision in world units; if none, three that suit the size of the deformed objects.
    pub tolerances: Option<Vec<f64>>,
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

/// Indices of the objects that are deformed.
fn deformed(scene: &SceneDescription) -> Vec<usize> {
    (0..scene.objects.len()).filter(|&index| !scene.objects[index].deform.is_empty()).collect()
}

/// The methods to compare with the exact one.
fn methods(scene: &SceneDescription, exact: &BuiltScene, settings: &CompareSettings) -> Vec<Representation> {
    let objects = deformed(scene);
    let has_mesh = objects.iter().any(|&index| scene.objects[index].shape.mesh().is_some());
    let pointwise =
        (0..=settings.levels).filter(|_| has_mesh).map(|level| Representation::Pointwise { level });
    let tolerances = settings.tolerances.clone().unwrap_or_else(|| {
        let size = objects.into_iter().map(|index| diagonal(exact, index)).fold(0.0, f64::max);
        // to one digit
        let unit = libm::exp10(libm::floor(libm::log10(size.max(f64::MIN_POSITIVE))));
        let rounded = (size / unit).round() * unit;
        let digits = |tolerance: f64| format!("{tolerance:.0e}").parse().unwrap_or(tolerance);
        TOLERANCES.map(|tolerance| digits(tolerance * rounded)).to_vec()
    });
    pointwise.chain(tolerances.into_iter().map(|tolerance| Representation::Adaptive { tolerance })).collect()
}

fn diagonal(built: &BuiltScene, object: usize) -> f64 {
    let [low, high] = built.traced.object_bounds(object);
    (high - low).length()
}

/// The scene with its deformed objects by one method; surfaces, which have no triangles to split, stay exact under
/// [`Representation::Pointwise`].
fn by_method(scene: &SceneDescription, method: Representation) -> SceneDescription {
    let mut scene = scene.clone();
    for object in &mut scene.objects {
        let has_it = object.shape.mesh().is_some() || !method.needs_polygons();
        object.method = if object.deform.is_empty() || !has_it { Representation::Exact } else { method };
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
    mut next: impl FnMut(&Representation),
    mut each: impl FnMut(Made<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let objects = deformed(scene);
    if objects.is_empty() {
        return Err(CompareError::NotDeformed(scene.path.display().to_string()).into());
    }
    let mut scene = scene.clone();
    scene.render.aovs = vec![Aov::Depth, Aov::Normal, Aov::Object];
    next(&Representation::Exact);
    let started = Instant::now();
    let exact_scene = by_method(&scene, Representation::Exact);
    let exact = exact_scene.build().map_err(CompareError::from)?;
    let build = started.elapsed().as_secs_f64();
    // all pictures from one place, which may depend on the object's size
    scene.camera = Some(exact.camera);
    let camera = Camera::try_new(&exact.camera, scene.film.size).map_err(CompareError::from)?;
    let silhouette = Silhouette::seen_by(&exact.traced, &camera, scene.film.size);
    let comparing = Comparing { settings, cancel, camera: &camera, objects, exact: &exact, silhouette };
    let result = comparing.result((&exact_scene, Representation::Exact), &exact, build)?;
    each(Made { scene: &exact_scene, built: &exact, camera: &camera, result: &result })?;
    let mut again = exact_scene.clone();
    again.render.seed = again.render.seed.wrapping_add(1);
    let result = comparing.result((&again, Representation::Exact), &exact, build)?;
    each(Made {
        scene: &again,
        built: &exact,
        camera: &camera,
        result: &MethodResult { noise: true, ..result },
    })?;
    for method in methods(&scene, &exact, settings) {
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
    exact: &'a BuiltScene,
    /// The exact one's.
    silhouette: Silhouette,
}

impl Comparing<'_> {
    fn result(
        &self,
        (scene, method): (&SceneDescription, Representation),
        built: &BuiltScene,
        build: f64,
    ) -> Result<MethodResult, CompareError> {
        let started = Instant::now();
        let image = self.render(scene, built)?;
        let render = started.elapsed().as_secs_f64();
        let started = Instant::now();
        let deviation = self.deviation(scene, built)?;
        let seconds = Seconds { build, render, deviation: started.elapsed().as_secs_f64() };
        let patches = self.objects.iter().map(|&index| built.traced.objects()[index].faces().len()).sum();
        let is_exact = method.is_exact();
        let silhouette = if method == Representation::Exact {
            Some(SilhouetteError::default())
        } else {
            self.silhouette.error(&Silhouette::seen_by(&built.traced, self.camera, scene.film.size))
        };
        let triangles = if is_exact {
            self.objects.iter().map(|&index| built.objects[index].notes.triangles).sum()
        } else {
            patches
        };
        let bytes = Bytes::used_by(built, &self.objects, is_exact);
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

    fn render(&self, scene: &SceneDescription, built: &BuiltScene) -> Result<Image, CompareError> {
        let (threads, memory) = (self.settings.threads, scene.memory);
        let control = RenderControl { threads, memory, ..RenderControl::new(self.cancel) };
        let Rendered { image, .. } = built.render(self.camera, &scene.film, &scene.render, &control)?;
        Ok(image)
    }

    /// The greatest of each figure among the deformed objects, lengths in parts of their own diagonals.
    fn deviation(
        &self,
        scene: &SceneDescription,
        built: &BuiltScene,
    ) -> Result<Result<Deviation, DeviationError>, CompareError> {
        let mut worst = Deviation::default();
        for &index in &self.objects {
            let found = if scene.objects[index].method.is_exact() {
                Ok(rounding(built, index))
            } else {
                let patches = [self.exact, built].map(|built| built.traced.objects()[index].faces());
                deviation(patches[0], patches[1], self.cancel)
            };
            let found = match found {
                Ok(found) => found,
                Err(DeviationError::Interrupted) => return Err(RenderError::Interrupted.into()),
                Err(error) => return Ok(Err(error)),
            };
            let diagonal = diagonal(self.exact, index);
            worst = Deviation {
                max: worst.max.max(found.max / diagonal),
                bound: worst.bound.max(found.bound / diagonal),
                mean: worst.mean.max(found.mean / diagonal),
                normal_max_degrees: worst.normal_max_degrees.max(found.normal_max_degrees),
                normal_mean_degrees: worst.normal_mean_degrees.max(found.normal_mean_degrees),
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
    for patch in built.traced.objects()[index].faces() {
        // of what is no Bézier patch the proven bound
        if patch.exact.is_some() || volumes.is_empty() {
            found.max = found.max.max(patch.error());
            continue;
        }
        for trim_loop in patch.region.loops() {
            let corners = patch.region.corners(&trim_loop);
            for k in 1..corners.len() - 1 {
                for (i, j) in (0..=CHECKS).flat_map(|i| (0..=CHECKS - i).map(move |j| (i, j))) {
                    let [v, w] = [i, j].map(|n| n as f64 / CHECKS as f64);
                    let st = corners[0] * (1.0 - v - w) + corners[k] * v + corners[k + 1] * w;
                    let place = |rest: DVec3| {
                        let mut volumes = volumes.iter().map(|lattice| &lattice.volume);
                        let Some(first) = volumes.next() else { return rest };
                        let moved = match patch.knot_box() {
                            Some(knot_box) => first.eval_in_knot_box(knot_box, rest).position,
                            None => rest,
                        };
                        volumes.fold(moved, |p, volume| volume.eval(p).map_or(p, |point| point.position))
                    };
                    let off = patch.eval(st).position.distance(place(patch.chart.place(st).coordinates()));
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
