//! The materials that a mesh's file names, for objects that name none themselves.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::description::{ObjectDescription, SceneDescription};
use super::diagnostic::Diagnostic;
use crate::mesh::{MeshMaterial, MtlMaterial, PolygonMesh, load_mtl};
use crate::shade::{
    BitmapSource, DiffuseSource, Material, PrincipledInterface, PrincipledSource, TextureSource,
};
use crate::suggestion::{did_you_mean, quoted};

/// The exponent of Phong's lobe where a library gives none.
const EXPONENT: f64 = 10.0;

/// The index of refraction of what is not opaque, where a library gives none.
const GLASS: f64 = 1.5;

/// Materials by face.
#[derive(Debug)]
pub(super) struct FaceMaterials {
    /// The default material, for faces without one, then those of the mesh's names.
    pub(super) materials: Vec<Material>,
    /// The radiance that each material emits.
    pub(super) emission: Vec<DVec3>,
    /// Index of each face's material.
    pub(super) of_face: Vec<u32>,
}

/// What comes of the material names of a mesh.
#[derive(Debug, Default)]
pub(super) struct MeshMaterials {
    /// If there is not one material for all faces.
    pub(super) by_face: Option<FaceMaterials>,
    /// What the scene's author may want to know.
    pub(super) notes: Vec<String>,
    /// The material libraries and their pictures.
    pub(super) files: Vec<PathBuf>,
}

/// The materials of an object's faces.
///
/// A name is looked up in `[object.materials]` first, then in the material libraries of the mesh's file.
///
/// # Errors
/// If `[object.materials]` has a name that the mesh does not, or a material with a texture for a face without texture
/// coordinates.
pub(super) fn face_materials(
    scene: &SceneDescription,
    object: &ObjectDescription,
    (mesh, path): (&PolygonMesh, &Path),
) -> Result<MeshMaterials, Vec<Diagnostic>> {
    let names = mesh.material_names();
    check_names(scene, object, names, path)?;
    if object.material.is_some() || names.is_empty() {
        return Ok(MeshMaterials::default());
    }
    let mut notes = Vec::new();
    let (library, files) = read_libraries(mesh, path, &mut notes);
    let mut materials = vec![Material::default()];
    let mut emission = vec![DVec3::ZERO];
    let mut is_known = false;
    for (index, name) in names.iter().enumerate() {
        let without_uv = || face_without_uv(mesh, index);
        let mapped = object.materials.iter().find(|(known, _)| known.value == *name);
        if let Some((known, material)) = mapped {
            let material = &scene.materials[*material];
            if material.material.is_textured()
                && let Some(face) = without_uv()
            {
                let message = format!(
                    "object {:?}: its material {:?} has a texture, but face {face} of mesh {} has no texture coordinates",
                    object.name.value,
                    material.name.value,
                    path.display()
                );
                let (file, location) = (scene.path.clone(), Some(known.location));
                return Err(vec![Diagnostic { file, location, message, lacks_memory: false }]);
            }
            materials.push(material.material.clone());
            emission.push(DVec3::ZERO);
            is_known = true;
        } else if let Some(of_library) = library.get(name.as_str()) {
            let mut of_library = of_library.clone();
            if of_library.diffuse_picture.is_some()
                && let Some(face) = without_uv()
            {
                notes.push(format!(
                    "material {}: face {face} has no texture coordinates, so its picture is left out",
                    quoted(name)
                ));
                of_library.diffuse_picture = None;
            }
            materials.push(material_of(&of_library));
            emission.push(of_library.emission.unwrap_or(DVec3::ZERO));
            is_known = true;
        } else if let Some(own) = mesh.materials().iter().find(|own| own.name == *name) {
            materials.push(material_of_mesh(own, without_uv(), &mut notes));
            emission.push(own.emission);
            is_known = true;
        } else {
            notes.push(format!(
                "material {} is in no library of {}; its faces have the default material",
                quoted(name),
                path.display()
            ));
            materials.push(Material::default());
            emission.push(DVec3::ZERO);
        }
    }
    let of_face = mesh.faces().map(|face| face.material().map_or(0, |index| index + 1)).collect();
    let by_face = is_known.then_some(FaceMaterials { materials, emission, of_face });
    Ok(MeshMaterials { by_face, notes, files })
}

/// Every name of `[object.materials]` is one of the mesh's.
fn check_names(
    scene: &SceneDescription,
    object: &ObjectDescription,
    names: &[String],
    path: &Path,
) -> Result<(), Vec<Diagnostic>> {
    let known: Vec<&str> = names.iter().map(String::as_str).collect();
    let unknown = object.materials.iter().filter(|(name, _)| !names.contains(&name.value));
    let faults: Vec<_> = unknown
        .map(|(name, _)| {
            let list = match &*known {
                [] => "it names none".to_owned(),
                known => format!("it has: {}", known.join(", ")),
            };
            let suggestion = did_you_mean(&name.value, &known);
            let message = format!(
                "mesh {} has no material {} ({list}){suggestion}",
                path.display(),
                quoted(&name.value)
            );
            Diagnostic {
                file: scene.path.clone(),
                location: Some(name.location),
                message,
                lacks_memory: false,
            }
        })
        .collect();
    if faults.is_empty() { Ok(()) } else { Err(faults) }
}

/// The materials of all libraries by name, of several with one name the first; and the files that they come from.
fn read_libraries(
    mesh: &PolygonMesh,
    path: &Path,
    notes: &mut Vec<String>,
) -> (HashMap<String, MtlMaterial>, Vec<PathBuf>) {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut library = HashMap::new();
    let mut files = Vec::new();
    for name in mesh.material_libraries() {
        let file = folder.join(name.replace('\\', "/"));
        match load_mtl(&file) {
            Ok(materials) => {
                files.extend(materials.iter().filter_map(|material| material.diffuse_picture.clone()));
                for material in materials {
                    library.entry(material.name.clone()).or_insert(material);
                }
            }
            Err(error) => notes.push(format!("material library {}: {error}", file.display())),
        }
        files.push(file);
    }
    (library, files)
}

/// A face with the material of this index and a corner without texture coordinates.
fn face_without_uv(mesh: &PolygonMesh, material: usize) -> Option<u32> {
    let has_it =
        |face: &crate::mesh::Face<'_>| face.material().is_some_and(|index| index as usize == material);
    let mut faces = mesh.faces().filter(has_it);
    faces.find(|face| face.corners().any(|corner| corner.uv.is_none())).map(|face| face.index())
}

/// A library's material: diffuse, or with a highlight as rough as Phong's lobe is wide, by Disney's model.
///
/// The exponent n is that of a Beckmann distribution of roughness sqrt(2 / (n + 2)). What is not opaque lets the rest of
/// the light through as glass does, refracted at the surface.
///
/// Source: Walter, Marschner, Li, Torrance (2007), *Microfacet Models for Refraction*, section 5.2.
fn material_of(source: &MtlMaterial) -> Material {
    let transparency = 1.0 - source.opacity.unwrap_or(1.0).clamp(0.0, 1.0);
    let colour = match &source.diffuse_picture {
        Some(path) => TextureSource::Bitmap(BitmapSource::new(path.clone())),
        None => TextureSource::Uniform(source.diffuse.unwrap_or(DVec3::splat(0.5)).min(DVec3::ONE)),
    };
    let specular = source.specular.map_or(0.0, |specular| specular.element_sum() / 3.0).min(1.0);
    if specular == 0.0 && transparency == 0.0 {
        return Material::Diffuse(DiffuseSource { reflectance: colour, ..DiffuseSource::default() });
    }
    let exponent = source.exponent.unwrap_or(EXPONENT).max(0.0);
    // Disney's roughness is the square root of the distribution's
    let roughness = (2.0 / (exponent + 2.0)).sqrt().sqrt();
    Material::Principled(Box::new(PrincipledSource {
        base_color: colour,
        roughness: TextureSource::from(roughness),
        interface: match transparency {
            0.0 => PrincipledInterface::Specular(specular),
            _ => PrincipledInterface::Eta(source.refraction.filter(|&eta| eta > 1.0).unwrap_or(GLASS)),
        },
        spec_trans: TextureSource::from(transparency),
        ..PrincipledSource::default()
    }))
}

/// A material of the mesh's own file, by Disney's model: its reflection at normal incidence is 4 % as in glTF's.
///
/// `face_without_uv` is a face that has the material and no texture coordinates.
fn material_of_mesh(
    source: &MeshMaterial,
    face_without_uv: Option<u32>,
    notes: &mut Vec<String>,
) -> Material {
    for what in &source.left_out {
        notes.push(format!("material {}: its {what} is left out", quoted(&source.name)));
    }
    let picture = source.picture.as_ref().filter(|_| match face_without_uv {
        None => true,
        Some(face) => {
            notes.push(format!(
                "material {}: face {face} has no texture coordinates, so its picture is left out",
                quoted(&source.name)
            ));
            false
        }
    });
    Material::Principled(Box::new(PrincipledSource {
        base_color: match picture {
            Some(path) => TextureSource::Bitmap(BitmapSource::new(path.clone())),
            None => TextureSource::Uniform(source.base_color),
        },
        roughness: TextureSource::from(source.roughness),
        metallic: TextureSource::from(source.metallic),
        ..PrincipledSource::default()
    }))
}
