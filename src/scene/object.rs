//! An object of a scene file as one of the model, and the model's errors as places in the file.

use std::sync::Arc;
use std::time::Instant;

use glam::DVec2;

use super::description::{
    DeformDescription, DragPlaces, EditDescription, ObjectDescription, ObjectShape, SceneDescription,
};
use super::diagnostic::{Diagnostic, Located, Location};
use super::face_materials::{MeshMaterials, face_materials};
use super::lattice_file::read_lattice;
use crate::mesh::{LoadError, MeshNotes, load_mesh_within};
use crate::model::{
    Attributes, BuildSettings, BuiltObject, Deformer, DragEdit, DragSources, Edit, EditError, Lattice,
    ModelError, Object, Representation, Shape,
};
use crate::shade::Camera;
use crate::trace::Ray;

/// What an object's description becomes.
#[derive(Debug)]
pub(super) struct ObjectParts {
    /// A surface, for what can only be asked of the whole scene.
    pub(super) surface: Option<Object>,
    pub(super) built: BuiltObject,
    /// The materials that its mesh names.
    pub(super) materials: MeshMaterials,
}

impl ObjectDescription {
    /// Reads the files that the object names and builds it.
    ///
    /// # Errors
    /// All faults of the mesh's file, or the first of anything else.
    pub(super) fn build(&self, scene: &SceneDescription) -> Result<ObjectParts, Vec<Diagnostic>> {
        let started = Instant::now();
        let (shape, file_notes) = self.read_shape(scene)?;
        let mut materials = match (&shape, self.shape.mesh()) {
            (Shape::Polygons(mesh), Some(path)) => face_materials(scene, self, (mesh, path))?,
            _ => MeshMaterials::default(),
        };
        let load = started.elapsed();
        let deformers = self.deform.iter().map(|deform| deform.value.read(scene));
        let object = Object {
            name: self.name.value.clone(),
            placement: self.transform,
            deformers: deformers.collect::<Result<_, _>>().map_err(|fault| vec![fault])?,
            // a flag may name a representation that not all objects have
            representation: match self.method {
                method if shape.has_parameters() && method.needs_polygons() => Representation::Exact,
                method => method,
            },
            attributes: Attributes {
                vertex_normals: self.vertex_normals,
                texture_coordinates: !shape.has_parameters() && scene.material_of(self).is_textured(),
            },
            shape,
        };
        let mut built = object
            .build_with(BuildSettings { memory: scene.memory, borders: scene.borders })
            .map_err(|error| vec![self.diagnostic(scene, &error)])?;
        built.report.times.load += load;
        built.report.notes = file_notes.merged(built.report.notes);
        built.report.warnings.append(&mut materials.notes);
        Ok(ObjectParts { surface: object.shape.has_parameters().then_some(object), built, materials })
    }

    fn read_shape(&self, scene: &SceneDescription) -> Result<(Shape, MeshNotes), Vec<Diagnostic>> {
        match &self.shape {
            ObjectShape::Surface(surface) => {
                Ok((Shape::Surface(surface.value.clone()), MeshNotes::default()))
            }
            ObjectShape::Polygons(mesh) => {
                Ok((Shape::Polygons(Arc::clone(&mesh.value)), MeshNotes::default()))
            }
            ObjectShape::Mesh(file) => {
                let (mesh, notes) = load_mesh_within(&file.value, scene.memory)
                    .map_err(|error| self.mesh_faults(&error, scene, file.location))?;
                Ok((Shape::Polygons(Arc::new(mesh)), notes))
            }
        }
    }

    /// The faults of a mesh's file at their own places; other errors where the scene names the file.
    fn mesh_faults(
        &self,
        error: &LoadError,
        scene: &SceneDescription,
        location: Location,
    ) -> Vec<Diagnostic> {
        let Some(faults) = error.faults() else {
            let lacks_memory = matches!(error, LoadError::Memory(_));
            let message = match error {
                LoadError::Memory(error) => format!("object {:?}: {error}", self.name.value),
                LoadError::Obj(_) | LoadError::File(_) => format!("mesh {error}"),
            };
            let file = scene.path.clone();
            return vec![Diagnostic { file, location: Some(location), message, lacks_memory }];
        };
        let diagnostic = |place: Option<[usize; 2]>, message| Diagnostic {
            file: faults.path.to_owned(),
            location: place.map(|[line, column]| Location { line, column }),
            message,
            lacks_memory: false,
        };
        faults.listed.into_iter().map(|(place, message)| diagnostic(place, message)).collect()
    }

    /// An error of the model at its place in the scene file.
    fn diagnostic(&self, scene: &SceneDescription, error: &ModelError) -> Diagnostic {
        let deform = error.deformer().and_then(|deformer| self.deform.get(deformer));
        let edit = deform.zip(error.edit()).and_then(|(deform, edit)| match &deform.value {
            DeformDescription::Lattice { edits, .. } => edits.get(edit),
            DeformDescription::Complete(_) => None,
        });
        let named = |message: String| format!("object {:?}: {message}", self.name.value);
        let of_mesh = |message: String| match self.shape.mesh() {
            Some(file) => format!("mesh {}: {message}", file.display()),
            None => message,
        };
        let at_deform = deform.map_or(self.name.location, |deform| deform.location);
        let (location, message) = match error {
            ModelError::Magnitude { deformer: None, .. } => {
                (self.shape.location(), named(of_mesh(error.to_string())))
            }
            ModelError::NoArea | ModelError::NoNormals => (self.shape.location(), of_mesh(error.to_string())),
            ModelError::NoTextureCoordinates { .. } => {
                (self.name.location, named(self.texture_fault(scene, error)))
            }
            ModelError::Lattice { .. } => (at_deform, error.to_string()),
            ModelError::Edit { source, .. } => {
                let location = edit.map_or(at_deform, |edit| edit.location);
                let message = edit_fault(scene, edit.map(|edit| &edit.value), source);
                let of_object = matches!(
                    source,
                    EditError::TooLarge { .. } | EditError::TooFar { .. } | EditError::Weight { .. }
                );
                (location, if of_object { named(message) } else { message })
            }
            _ => (at_deform, named(error.to_string())),
        };
        let lacks_memory = error.lacks_memory();
        Diagnostic { file: scene.path.clone(), location: Some(location), message, lacks_memory }
    }

    /// Why the texture of the object's material cannot be looked up.
    fn texture_fault(&self, scene: &SceneDescription, error: &ModelError) -> String {
        let material = self.material.map(|index| &scene.materials[index].name.value);
        let face = match error {
            ModelError::NoTextureCoordinates { face } => format!("face {face}"),
            other => other.to_string(),
        };
        format!(
            "its material {:?} has a texture, but {face} of mesh {} has no texture coordinates",
            material.map_or("", String::as_str),
            self.shape.mesh().map_or_else(String::new, |file| file.display().to_string())
        )
    }
}

/// What is wrong with an edit, in the words of the scene file.
fn edit_fault(scene: &SceneDescription, edit: Option<&EditDescription>, error: &EditError) -> String {
    if let (EditError::Unseen { ray }, Some(EditDescription::Drag { sources, .. })) = (error, edit)
        && let DragPlaces::Pixels(pixels) = sources
    {
        let (DVec2 { x, y }, [width, height]) = (pixels[*ray], scene.film.size);
        return format!(
            "pick {x}, {y}: the camera sees nothing of the object there, in {width}x{height} pixels"
        );
    }
    error.to_string()
}

impl DeformDescription {
    /// The deformer, with what its edits name read.
    fn read(&self, scene: &SceneDescription) -> Result<Deformer, Diagnostic> {
        match self {
            Self::Complete(deformer) => Ok(deformer.clone()),
            Self::Lattice { lattice, edits } => {
                let read = |edit: &Located<EditDescription>| {
                    edit.value.read(scene, lattice).map_err(|message| Diagnostic {
                        file: scene.path.clone(),
                        location: Some(edit.location),
                        message,
                        lacks_memory: false,
                    })
                };
                let edits = edits.iter().map(read).collect::<Result<_, _>>()?;
                Ok(Lattice { edits, ..lattice.clone() }.into())
            }
        }
    }
}

impl EditDescription {
    fn read(&self, scene: &SceneDescription, lattice: &Lattice) -> Result<Edit, String> {
        match self {
            Self::Complete(edit) => Ok(edit.clone()),
            Self::ControlPoints { path, block } => {
                read_lattice(path, block.as_ref(), lattice, scene.memory).map(Edit::ControlPoints)
            }
            Self::Drag { sources, targets, using } => {
                let sources = match sources {
                    DragPlaces::Points(points) => DragSources::Points(points.clone()),
                    DragPlaces::Pixels(pixels) => {
                        let rays = pixels.iter().map(|pixel| pick(scene, *pixel));
                        DragSources::Rays(rays.collect::<Result<_, _>>()?)
                    }
                };
                let (targets, using, least_squares) = (targets.clone(), *using, scene.least_squares);
                Ok(Edit::Drag(DragEdit { sources, targets, using, least_squares }))
            }
        }
    }
}

/// The ray through a place of the picture, in pixels from its top left corner.
fn pick(scene: &SceneDescription, pixel: DVec2) -> Result<Ray, String> {
    let settings = scene.camera.ok_or("pick needs a [camera], through which the point is seen")?;
    let camera = Camera::try_new(&settings, scene.film.size).map_err(|error| error.to_string())?;
    Ok(camera.ray(pixel, DVec2::splat(0.5)))
}
