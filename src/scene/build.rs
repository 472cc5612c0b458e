//! A scene's description to a scene ready to trace, on one page.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use crate::analytic::{Step, warnings};
use crate::film::{Picture, read_picture};
use crate::mesh::{
    FaultKind, MeshNotes, MeshTolerances, ObjError, PolygonMesh, PolygonSet, load_obj, prepare_polygons,
};
use crate::model::{
    BuiltLattice, CarriedNormals, Deformed, Deforming, PolygonAttributes, SurfaceObject, TriangularCounts,
    Undeformed, deform_pointwise, facet_object, self_intersection, surface_object,
};
use crate::patch::{BuildTimes, Facet, TrimmedPatch};
use crate::shade::{
    CameraSettings, Light, LightSet, Material, MaterialError, PreparedMaterial, ShadingScene,
};
use crate::surface::SplineSurface;
use crate::tessellate::facets;
use crate::trace::{TracedObject, TracedScene, VertexAttributes};

use super::description::{
    DeformDescription, LightDescription, Method, ObjectDescription, ObjectShape, SceneDescription,
};
use super::diagnostic::{Diagnostic, Location, SceneError};
use super::first_view::{framing_camera, key_and_sky};

/// A scene ready to trace and render.
#[derive(Debug)]
pub struct BuiltScene {
    /// The geometry.
    pub traced: TracedScene,
    /// What is known of each object besides its patches.
    pub objects: Vec<BuiltObject>,
    /// The material of each object.
    pub materials: Vec<PreparedMaterial>,
    /// The lights.
    pub lights: LightSet,
    /// What the lights are made of, in the scene file's order.
    pub light_settings: Vec<Light>,
    /// The camera; framed around the objects if the scene names none.
    pub camera: CameraSettings,
    /// Time spent.
    pub times: SceneTimes,
}

/// An object's deformation and statistics.
#[derive(Clone, Debug)]
pub struct BuiltObject {
    /// What was odd about the mesh.
    pub notes: MeshNotes,
    /// The lattices that deformed it.
    pub lattices: Vec<BuiltLattice>,
    /// Sub-polygons it was cut into.
    pub subpolygons: usize,
    /// Its triangular patches, if it is made of such.
    pub triangular: Option<TriangularCounts>,
    /// What may not be as its author meant it.
    pub warnings: Vec<String>,
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

impl BuiltScene {
    /// What a renderer needs of it.
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
        let made: Vec<_> = self.objects.par_iter().map(|object| build_object(self, object)).collect();
        let mut diagnostics = Vec::new();
        let mut objects = Vec::new();
        let mut traced = Vec::new();
        let mut times = SceneTimes::default();
        for object in made {
            match object {
                Ok(made) => {
                    times.load += made.load;
                    times.patches.subdivide += made.times.subdivide;
                    times.patches.compose += made.times.compose;
                    objects.push(made.built);
                    traced.push(made.traced);
                }
                Err(mut faults) => diagnostics.append(&mut faults),
            }
        }
        let materials = self.prepare_materials(&mut diagnostics);
        let named_lights = read_lights(self, &mut diagnostics);
        if !diagnostics.is_empty() {
            return Err(SceneError { diagnostics });
        }
        let camera = self.camera.unwrap_or_else(|| framing_camera(&traced));
        let light_settings = named_lights.unwrap_or_else(|| key_and_sky(&traced, &camera));
        let lights = LightSet::try_new(&light_settings, &traced).map_err(|error| {
            let file = self.path.clone();
            SceneError { diagnostics: vec![Diagnostic { file, location: None, message: error.to_string() }] }
        })?;
        let started = Instant::now();
        let traced = TracedScene::new(traced);
        times.build = started.elapsed();
        self.warn_of_self_intersections(&traced, &mut objects);
        Ok(BuiltScene { traced, objects, materials, lights, light_settings, camera, times })
    }

    /// Adds a warning for each surface that extension functions may have driven through itself.
    fn warn_of_self_intersections(&self, traced: &TracedScene, built: &mut [BuiltObject]) {
        for (index, (object, built)) in self.objects.iter().zip(built).enumerate() {
            let is_extended =
                object.deform.iter().any(|deform| matches!(deform.value, DeformDescription::Extension(_)));
            let ObjectShape::Surface(surface) = &object.shape else { continue };
            if !is_extended {
                continue;
            }
            let found = self_intersection(traced, index, surface.value.domain());
            built.warnings.extend(found.map(|[first, second]| {
                format!(
                    "the surface may intersect itself: about u = {:.4}, v = {:.4} it meets its part about u = {:.4}, v = {:.4}",
                    first.x, first.y, second.x, second.y
                )
            }));
        }
    }

    /// The material of each object; pictures are read once for each material that the scene lists.
    fn prepare_materials(&self, diagnostics: &mut Vec<Diagnostic>) -> Vec<PreparedMaterial> {
        let prepared: Vec<Result<PreparedMaterial, MaterialError>> =
            self.materials.par_iter().map(|named| PreparedMaterial::try_new(&named.material)).collect();
        let mut materials = Vec::new();
        for (named, prepared) in self.materials.iter().zip(prepared) {
            match prepared {
                Ok(prepared) => materials.push(prepared),
                Err(error) => diagnostics.push(Diagnostic {
                    file: self.path.clone(),
                    location: Some(named.name.location),
                    message: format!("material {:?}: {error}", named.name.value),
                }),
            }
        }
        if materials.len() < self.materials.len() {
            return Vec::new();
        }
        let default = PreparedMaterial::try_new(&Material::default());
        let of_object = |object: &ObjectDescription| match object.material {
            Some(index) => materials.get(index).cloned(),
            None => default.as_ref().ok().cloned(),
        };
        self.objects.iter().filter_map(of_object).collect()
    }
}

/// The lights that the scene lists, with their pictures; those without fault. None if it lists none.
fn read_lights(scene: &SceneDescription, diagnostics: &mut Vec<Diagnostic>) -> Option<Vec<Light>> {
    let mut lights = Vec::new();
    for light in scene.lights.as_ref()? {
        match light.clone() {
            LightDescription::Complete(light) => lights.push(light),
            LightDescription::Envmap { file, scale, to_world } => match read_envmap(&file.value) {
                Ok(picture) => lights.push(Light::Envmap { picture: Arc::new(picture), scale, to_world }),
                Err(message) => {
                    let location = Some(file.location);
                    diagnostics.push(Diagnostic { file: scene.path.clone(), location, message });
                }
            },
        }
    }
    Some(lights)
}

/// The picture of an environment map.
fn read_envmap(path: &Path) -> Result<Picture, String> {
    let picture = read_picture(path, false).map_err(|error| format!("file {error}"))?;
    let broken = picture.pixels.iter().position(|pixel| !pixel.iter().all(|value| value.is_finite()));
    match broken {
        None => Ok(picture),
        Some(index) => {
            let (width, path) = (picture.size[0] as usize, path.display());
            let [column, row] = [index % width, index / width];
            Err(format!("file {path}: the pixel in column {column} of row {row} is not finite"))
        }
    }
}

struct MadeObject {
    traced: TracedObject,
    built: BuiltObject,
    load: Duration,
    times: BuildTimes,
}

fn build_object(scene: &SceneDescription, object: &ObjectDescription) -> Result<MadeObject, Vec<Diagnostic>> {
    let started = Instant::now();
    let fault = |location: Location, message: String| {
        vec![Diagnostic { file: scene.path.clone(), location: Some(location), message }]
    };
    let file = match &object.shape {
        ObjectShape::Mesh(file) => file,
        ObjectShape::Surface(surface) => return built_surface(scene, object, &surface.value),
    };
    let (mesh, file_notes) =
        load_obj(&file.value).map_err(|error| mesh_faults(error, |message| fault(file.location, message)))?;
    let (polygons, notes) = prepare_polygons(&mesh, object.transform, MeshTolerances::default());
    let notes = file_notes.merged(notes);
    if polygons.bounds().is_none() {
        let message = format!("mesh {}: no face has an area", file.value.display());
        return Err(fault(file.location, message));
    }
    check_uvs(scene, object, &polygons, &file.value)
        .map_err(|message| fault(object.name.location, message))?;
    if object.vertex_normals && !mesh.has_normals() {
        let message = format!(
            "mesh {}: has no normals (vn), which normals = \"vertex\" needs; normals = \"face\" needs none",
            file.value.display()
        );
        return Err(fault(file.location, message));
    }
    let load = started.elapsed();
    let deforming = Deforming { scene, object, undeformed: Undeformed::Polygons(&polygons) };
    let failed =
        |message: String| fault(object.name.location, format!("object {:?}: {message}", object.name.value));
    let started = Instant::now();
    let represented = if let Method::Pointwise { level } = object.method {
        let (_, lattices) = deforming.steps()?;
        let volumes: Vec<_> = lattices.iter().map(|lattice| lattice.volume.clone()).collect();
        let facets = deform_pointwise(&polygons, &volumes, level).map_err(failed)?;
        let attributes = Box::new(attributes_of(object, &mesh, polygons, &lattices));
        let times = BuildTimes { subdivide: started.elapsed(), compose: Duration::ZERO };
        Represented::by_facets(object, facets, attributes, lattices, times)
    } else {
        let (deformed, triangular) = match object.method {
            Method::Triangular => deforming.triangular().map(|(made, counts)| (made, Some(counts)))?,
            _ => (deforming.deformed()?, None),
        };
        let attributes = Box::new(attributes_of(object, &mesh, polygons, &deformed.lattices));
        let represented = Represented::of(object, deformed, attributes).map_err(failed)?;
        Represented { triangular, ..represented }
    };
    Ok(represented.made(object, load, (notes, Vec::new())))
}

/// An object as its method represents it.
struct Represented {
    patches: Vec<TrimmedPatch>,
    attributes: Box<dyn VertexAttributes>,
    subpolygons: usize,
    lattices: Vec<BuiltLattice>,
    triangular: Option<TriangularCounts>,
    times: BuildTimes,
}

impl Represented {
    /// By its exact patches or, if the object asks for that, by triangles near them.
    fn of(
        object: &ObjectDescription,
        exact: Deformed,
        attributes: Box<dyn VertexAttributes>,
    ) -> Result<Self, String> {
        let Deformed { patches, subpolygons, lattices, mut times, .. } = exact;
        let Method::Adaptive { tolerance } = object.method else {
            return Ok(Self { patches, attributes, subpolygons, lattices, triangular: None, times });
        };
        let started = Instant::now();
        let facets = facets(&patches, tolerance, &AtomicBool::new(false))
            .map_err(|error| format!("{}: {error}", object.method))?;
        times.compose += started.elapsed();
        Ok(Self::by_facets(object, facets, attributes, lattices, times))
    }

    fn by_facets(
        object: &ObjectDescription,
        facets: Vec<Facet>,
        exact: Box<dyn VertexAttributes>,
        lattices: Vec<BuiltLattice>,
        mut times: BuildTimes,
    ) -> Self {
        let started = Instant::now();
        let subpolygons = facets.len();
        let volume = lattices.first().map(|lattice| &lattice.volume);
        let (patches, attributes) = facet_object(facets, exact, object.vertex_normals, volume);
        times.compose += started.elapsed();
        Self { patches, attributes, subpolygons, lattices, triangular: None, times }
    }

    fn made(
        self,
        object: &ObjectDescription,
        load: Duration,
        (notes, warnings): (MeshNotes, Vec<String>),
    ) -> MadeObject {
        let Self { patches, attributes, subpolygons, lattices, triangular, times } = self;
        let traced = TracedObject { name: object.name.value.clone(), patches, attributes };
        MadeObject {
            traced,
            built: BuiltObject { notes, lattices, subpolygons, triangular, warnings },
            load,
            times,
        }
    }
}

fn attributes_of(
    object: &ObjectDescription,
    mesh: &PolygonMesh,
    polygons: PolygonSet,
    lattices: &[BuiltLattice],
) -> PolygonAttributes {
    let volumes = lattices.iter().map(|lattice| lattice.volume.clone()).collect();
    let normals = object.vertex_normals.then(|| CarriedNormals::new(mesh, object.transform.matrix3, volumes));
    PolygonAttributes { polygons, normals }
}

/// A surface, deformed.
fn built_surface(
    scene: &SceneDescription,
    object: &ObjectDescription,
    surface: &SplineSurface,
) -> Result<MadeObject, Vec<Diagnostic>> {
    let started = Instant::now();
    let SurfaceObject { patches, attributes } = surface_object(surface, object.transform);
    let load = started.elapsed();
    let undeformed = Undeformed::Surface { surface, transform: object.transform, patches: &patches };
    let deformed = Deforming { scene, object, undeformed }.deformed()?;
    let mut warned = Vec::new();
    for (number, step) in (1..).zip(&deformed.steps) {
        if let Step::Extension(extension) = step {
            let found = warnings(extension, surface.domain());
            warned.extend(found.into_iter().map(|warning| format!("deformation {number}: {warning}")));
        }
    }
    let represented = Represented::of(object, deformed, Box::new(attributes)).map_err(|message| {
        let message = format!("object {:?}: {message}", object.name.value);
        vec![Diagnostic { file: scene.path.clone(), location: Some(object.name.location), message }]
    })?;
    Ok(represented.made(object, load, (MeshNotes::default(), warned)))
}

/// A textured material needs texture coordinates on every face.
fn check_uvs(
    scene: &SceneDescription,
    object: &ObjectDescription,
    polygons: &PolygonSet,
    file: &Path,
) -> Result<(), String> {
    let material = object.material.map(|index| &scene.materials[index]);
    let Some(material) = material.filter(|named| named.material.is_textured()) else {
        return Ok(());
    };
    match polygons.iter().find(|polygon| polygon.uvs.is_empty()) {
        None => Ok(()),
        Some(bare) => Err(format!(
            "object {:?}: its material {:?} has a texture, but face {} of mesh {} has no texture coordinates",
            object.name.value,
            material.name.value,
            bare.face,
            file.display()
        )),
    }
}

/// The faults of an OBJ file at their own places; other errors where the scene names the file.
fn mesh_faults(error: ObjError, fault: impl Fn(String) -> Vec<Diagnostic>) -> Vec<Diagnostic> {
    let ObjError::Faults { path, faults, more } = error else {
        return fault(format!("mesh {error}"));
    };
    let at = |line: usize, column: usize, kind: &FaultKind| Diagnostic {
        file: path.clone(),
        location: Some(Location { line, column }),
        message: kind.to_string(),
    };
    let mut listed: Vec<_> = faults.iter().map(|fault| at(fault.line, fault.column, &fault.kind)).collect();
    if more > 0 {
        listed.push(Diagnostic {
            file: path.clone(),
            location: None,
            message: format!("and {more} more faults"),
        });
    }
    listed
}
