//! A scene's description to a scene ready to trace, on one page.

use std::cell::LazyCell;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use crate::math::bounds;
use crate::model::{ObjectReport, ObjectTimes};
use crate::patch::BuildTimes;
use crate::shade::{
    CameraSettings, Light, LightSet, Material, MaterialError, ObjectMaterials, PreparedMaterial, ShadingScene,
};
use crate::trace::{TracedObject, TracedScene};

use super::description::{ObjectDescription, SceneDescription};
use super::diagnostic::{Diagnostic, SceneError};
use super::face_materials::FaceMaterials;
use super::first_view::{framing_camera, key_and_sky};
use super::object::ObjectParts;

/// A scene ready to trace and render.
#[derive(Debug)]
pub struct BuiltScene {
    /// The geometry.
    pub traced: TracedScene,
    /// What is known of each object besides its patches.
    pub objects: Vec<ObjectReport>,
    /// The materials of each object.
    pub materials: Vec<ObjectMaterials>,
    /// The lights.
    pub lights: LightSet,
    /// What the lights are made of, in the scene file's order.
    pub light_settings: Vec<Light>,
    /// The files besides those of the scene's description: the meshes' material libraries, and their pictures.
    pub library_files: Vec<PathBuf>,
    /// The camera; framed around the objects if the scene names none.
    pub camera: CameraSettings,
    /// Time spent.
    pub times: SceneTimes,
}

/// Time spent on building a scene, summed over objects.
#[derive(Clone, Copy, Debug, Default)]
pub struct SceneTimes {
    /// Reading meshes and preparing polygons.
    pub load: Duration,
    /// Cutting, grouping and composing.
    pub patches: BuildTimes,
    /// The acceleration structure.
    pub build: Duration,
}

impl SceneTimes {
    fn add(&mut self, object: &ObjectTimes) {
        self.load += object.load;
        self.patches.subdivide += object.patches.subdivide;
        self.patches.compose += object.patches.compose;
    }
}

impl BuiltScene {
    /// What a renderer needs of it.
    #[must_use]
    pub fn shading(&self) -> ShadingScene<'_, TracedScene> {
        ShadingScene { geometry: &self.traced, object_materials: &self.materials, lights: &self.lights }
    }
}

impl SceneDescription {
    /// Reads the meshes, deforms them and builds the acceleration structure.
    ///
    /// # Errors
    /// All faults of all objects at once.
    pub fn build(&self) -> Result<BuiltScene, SceneError> {
        let made: Vec<_> = self.objects.par_iter().map(|object| object.build(self)).collect();
        let mut diagnostics = Vec::new();
        let mut surfaces = Vec::new();
        let mut by_face = Vec::new();
        let mut library_files = Vec::new();
        let mut objects = Vec::new();
        let mut traced = Vec::new();
        let mut times = SceneTimes::default();
        for object in made {
            match object {
                Ok(ObjectParts { surface, built, materials }) => {
                    by_face.push(materials.by_face);
                    library_files.extend(materials.files);
                    times.add(&built.report.times);
                    surfaces.push(surface);
                    objects.push(built.report);
                    traced.push(built.traced);
                }
                Err(mut faults) => diagnostics.append(&mut faults),
            }
        }
        let materials = self.prepare_materials(by_face, &mut diagnostics);
        let named_lights = read_lights(self, &mut diagnostics);
        if !diagnostics.is_empty() {
            return Err(SceneError { diagnostics });
        }
        let box_around = LazyCell::new(|| bounds::around(traced.iter().flat_map(TracedObject::bounds)));
        let camera = self.camera.unwrap_or_else(|| framing_camera(&traced, *box_around));
        let shines = materials.iter().any(|materials| !materials.emission().is_empty());
        let light_settings = match named_lights {
            Some(named) => named,
            None if shines => Vec::new(),
            None => key_and_sky(*box_around, &camera),
        };
        let of_file = |message: String, lacks_memory: bool| {
            SceneError::from(Diagnostic { file: self.path.clone(), location: None, message, lacks_memory })
        };
        let lights =
            LightSet::try_new(&light_settings, &traced).map_err(|error| of_file(error.to_string(), false))?;
        let lights = lights.with_materials(&materials, &traced);
        let started = Instant::now();
        let traced = TracedScene::try_new_within(traced, self.memory)
            .map_err(|error| of_file(error.to_string(), true))?;
        times.build = started.elapsed();
        for (index, (surface, report)) in surfaces.iter().zip(&mut objects).enumerate() {
            let warning = surface.as_ref().and_then(|surface| surface.self_intersection(&traced, index));
            report.warnings.extend(warning);
        }
        Ok(BuiltScene { traced, objects, materials, lights, light_settings, library_files, camera, times })
    }

    /// The materials of each object; pictures are read once for each material that the scene lists.
    fn prepare_materials(
        &self,
        by_face: Vec<Option<FaceMaterials>>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<ObjectMaterials> {
        let prepared: Vec<Result<PreparedMaterial, MaterialError>> = self
            .materials
            .par_iter()
            .map(|named| PreparedMaterial::try_new_within(&named.material, self.pictures))
            .collect();
        let mut materials = Vec::new();
        for (named, prepared) in self.materials.iter().zip(prepared) {
            match prepared {
                Ok(prepared) => materials.push(prepared),
                Err(error) => diagnostics.push(Diagnostic {
                    file: self.path.clone(),
                    location: Some(named.name.location),
                    message: format!("material {:?}: {error}", named.name.value),
                    lacks_memory: false,
                }),
            }
        }
        if materials.len() < self.materials.len() {
            return Vec::new();
        }
        let default = PreparedMaterial::try_new(&Material::default());
        let mut of_object = |(object, by_face): (&ObjectDescription, Option<FaceMaterials>)| {
            if let Some(by_face) = by_face {
                return self.prepare_by_face(object, by_face, diagnostics);
            }
            let prepared = match object.material {
                Some(index) => materials.get(index).cloned(),
                None => default.as_ref().ok().cloned(),
            };
            Some(ObjectMaterials::uniform(self.material_of(object), prepared?))
        };
        // objects with faults are missing, and then nothing is made of this
        self.objects.iter().zip(by_face).filter_map(&mut of_object).collect()
    }

    fn prepare_by_face(
        &self,
        object: &ObjectDescription,
        FaceMaterials { materials, emission, of_face }: FaceMaterials,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<ObjectMaterials> {
        let mut prepared = Vec::with_capacity(materials.len());
        for material in materials {
            match PreparedMaterial::try_new_within(&material, self.pictures) {
                Ok(made) => prepared.push((material, made)),
                Err(error) => {
                    diagnostics.push(Diagnostic {
                        file: self.path.clone(),
                        location: Some(object.shape.location()),
                        message: format!("object {:?}: materials of its mesh: {error}", object.name.value),
                        lacks_memory: false,
                    });
                    return None;
                }
            }
        }
        Some(ObjectMaterials::by_face(prepared, of_face).with_emission(emission))
    }
}

/// The lights that the scene lists, with their pictures; those without fault. None if it lists none.
fn read_lights(scene: &SceneDescription, diagnostics: &mut Vec<Diagnostic>) -> Option<Vec<Light>> {
    let mut lights = Vec::new();
    for light in scene.lights.as_ref()? {
        match light.value.with_picture(scene.pictures) {
            Ok(light) => lights.push(light),
            Err(error) => diagnostics.push(Diagnostic {
                file: scene.path.clone(),
                location: Some(light.location),
                message: error.to_string(),
                lacks_memory: false,
            }),
        }
    }
    Some(lights)
}
