//! A scene as its file gives it: checked plain data, before any mesh is read.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3};

use super::diagnostic::{Located, Location};
use crate::film::{FilmSettings, PictureLimits};
use crate::memory::MemoryLimit;
use crate::mesh::PolygonMesh;
use crate::model::{Borders, Deformer, DragUsing, Edit, Lattice, Representation};
use crate::shade::light::EnvironmentLight;
use crate::shade::{CameraSettings, Light, Material, PictureSource, RenderSettings, TextureSource};
use crate::surface::SplineSurface;

/// A whole scene file.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneDescription {
    /// The scene file.
    pub path: PathBuf,
    /// The camera; if none, one that frames all objects.
    pub camera: Option<CameraSettings>,
    /// The film.
    pub film: FilmSettings,
    /// What decides the picture besides the scene.
    pub render: RenderSettings,
    /// The materials, in the file's order; their names differ.
    pub materials: Vec<NamedMaterial>,
    /// The lights; if none are listed at all, [`SceneDescription::build`] lights the scene from the camera's side.
    ///
    /// Each is located where its picture is named, or else where it begins.
    pub lights: Option<Vec<Located<Light>>>,
    /// The objects, at least one; their names differ.
    pub objects: Vec<ObjectDescription>,
    /// Whether drags that contradict each other are met as nearly as possible instead of being an error.
    pub least_squares: bool,
    /// Bounds on the pictures of textures and environment maps.
    pub pictures: PictureLimits,
    /// The most memory that building it may take.
    pub memory: MemoryLimit,
    /// What is made where pieces of a chain of deformations meet; no key of scene files.
    pub borders: Borders,
}

impl SceneDescription {
    /// The files that the scene is made of: itself, meshes, lattices, textures and environment maps.
    #[must_use]
    pub fn files(&self) -> Vec<&Path> {
        let meshes = self.objects.iter().filter_map(|object| object.shape.mesh());
        let edits =
            self.objects.iter().flat_map(|object| &object.deform).flat_map(|deform| match &deform.value {
                DeformDescription::Lattice { edits, .. } => edits.as_slice(),
                DeformDescription::Complete(_) => &[],
            });
        let lattices = edits.filter_map(|edit| match &edit.value {
            EditDescription::ControlPoints { path, .. } => Some(path.as_path()),
            _ => None,
        });
        let textures = self.materials.iter().flat_map(|named| named.material.textures());
        let pictures = textures.filter_map(|texture| match texture {
            TextureSource::Bitmap(bitmap) => Some(bitmap.path.as_path()),
            _ => None,
        });
        let skies = self.lights.iter().flatten().filter_map(|light| match &light.value {
            Light::Envmap(EnvironmentLight { picture: PictureSource::File(path), .. }) => {
                Some(path.as_path())
            }
            _ => None,
        });
        let own = std::iter::once(self.path.as_path());
        own.chain(meshes).chain(lattices).chain(pictures).chain(skies).collect()
    }

    /// The material of `object`, or the default one.
    ///
    /// # Panics
    /// If `object` belongs to another scene with more materials.
    #[must_use]
    pub fn material_of(&self, object: &ObjectDescription) -> Material {
        object.material.map(|index| self.materials[index].material.clone()).unwrap_or_default()
    }
}

/// A material and the name that objects call it by.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedMaterial {
    /// Its name.
    pub name: Located<String>,
    /// The material.
    pub material: Material,
}

/// One object: a mesh, placed, then deformed.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectDescription {
    /// Its name.
    pub name: Located<String>,
    /// What it is before it is placed and deformed.
    pub shape: ObjectShape,
    /// Index into the scene's materials; if none, the default material.
    pub material: Option<usize>,
    /// Materials for names that the mesh's file gives, by index, where the object has no material of its own.
    pub materials: Vec<(Located<String>, usize)>,
    /// Places the mesh in the world before it is deformed; invertible.
    pub transform: DAffine3,
    /// Whether shading uses the mesh's normals, carried along by the deformation, instead of the surface's own.
    pub vertex_normals: bool,
    /// How the deformed shape is represented.
    pub method: Representation,
    /// The deformations, in the order they apply.
    pub deform: Vec<Located<DeformDescription>>,
}

/// An object before it is placed and deformed.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjectShape {
    /// A mesh file, on the path of the scene file's folder.
    Mesh(Located<PathBuf>),
    /// A mesh that is in memory, which a program put in the place of a file.
    Polygons(Located<Arc<PolygonMesh>>),
    /// A parametric surface.
    Surface(Located<SplineSurface>),
}

impl ObjectShape {
    /// Where the scene file gives it.
    #[must_use]
    pub const fn location(&self) -> Location {
        match self {
            Self::Mesh(mesh) => mesh.location,
            Self::Polygons(mesh) => mesh.location,
            Self::Surface(surface) => surface.location,
        }
    }

    /// The mesh file, if it is one.
    #[must_use]
    pub fn mesh(&self) -> Option<&Path> {
        match self {
            Self::Mesh(mesh) => Some(&mesh.value),
            Self::Polygons(_) | Self::Surface(_) => None,
        }
    }
}

/// One deformation of an object.
#[derive(Clone, Debug, PartialEq)]
pub enum DeformDescription {
    /// One that names no other file and nothing of the picture.
    Complete(Deformer),
    /// By a lattice.
    Lattice {
        /// The lattice without edits.
        lattice: Lattice,
        /// Its edits, in the order they apply.
        edits: Vec<Located<EditDescription>>,
    },
}

/// An edit of a lattice as the scene file gives it.
#[derive(Clone, Debug, PartialEq)]
pub enum EditDescription {
    /// One that names no other file and nothing of the picture.
    Complete(Edit),
    /// [`Edit::Drag`], whose sources may be places of the picture.
    Drag {
        /// The points.
        sources: DragPlaces,
        /// Where each must go.
        targets: Vec<DVec3>,
        /// What of the lattice changes.
        using: DragUsing,
    },
    /// [`Edit::ControlPoints`], which are not read yet.
    ControlPoints {
        /// A file of any format that is read, on the path of the scene file's folder.
        path: PathBuf,
        /// Which of its lattices, if it has several.
        block: Option<Block>,
    },
}

/// Where dragged points are.
#[derive(Clone, Debug, PartialEq)]
pub enum DragPlaces {
    /// On the undeformed object, as the deformation receives it.
    Points(Vec<DVec3>),
    /// As the camera sees them after the edits before: places in the picture, in pixels from its top left corner.
    Pixels(Vec<DVec2>),
}

/// Which lattice of a file that may hold several.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Block {
    /// By its place, from 1.
    Number(usize),
    /// By its name.
    Name(String),
}
