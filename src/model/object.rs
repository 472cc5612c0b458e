//! Objects, and how they are built.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{DAffine3, DVec2, DVec3};

use super::attributes::{CarriedNormals, PolygonAttributes, SurfaceAttributes, placed_shell};
use super::deformation::{Base, PlacedShape};
use super::deformer::{BuiltLattice, Deformer};
use super::error::ModelError;
use super::representation::{Construction, Elements, Representation, TriangularCounts, facet_object};
use super::self_intersection::self_intersection;
use super::settings::BuildSettings;
use crate::analytic::{MAX_FIELDS, Step};
use crate::math::bounds;
use crate::math::magnitude::{self, MagnitudeError};
use crate::memory::MemoryLimit;
use crate::mesh::{MeshNotes, MeshTolerances, PolygonMesh, prepare_polygons};
use crate::patch::BuildTimes;
use crate::surface::SplineSurface;
use crate::trace::{TracedObject, TracedScene, VertexAttributes};

/// Memory that a polygon's corner takes: where it is placed, its number, texture coordinates and part of the polygon's normal.
const CORNER_BYTES: u64 = 96;

/// An object: a shape, placed in the world, then deformed, then represented for tracing.
///
/// # Example
/// A twisted cylinder, which keeps its radius where the lattice turns it:
///
/// ```
/// use glam::DVec3;
/// use trimray::model::{Edit, Lattice, Object, Shape};
/// use trimray::spline::Axis;
/// use trimray::surface;
/// use trimray::trace::{Ray, TracedScene};
///
/// let cylinder = surface::Shape::Cylinder { origin: DVec3::ZERO, axis: 3.0 * DVec3::Z, radius: 1.0 }.surface()?;
/// let mut object = Object::new("cylinder", Shape::Surface(cylinder));
/// let mut lattice = Lattice::new([2; 3], [3, 3, 5]);
/// lattice.edits.push(Edit::Twist { axis: Axis::Z, angle: 90.0 });
/// object.deformers.push(lattice.into());
///
/// let scene = TracedScene::new(vec![object.build()?.traced]);
/// let hit = scene.closest_hit(&Ray::new(DVec3::new(5.0, 0.0, 0.1), DVec3::NEG_X)).expect("it is hit");
/// assert!((hit.position.x - 1.0).abs() < 0.02);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Its name, which says nothing to this module.
    pub name: String,
    /// What it is before it is placed and deformed.
    pub shape: Shape,
    /// Places the shape in the world; invertible.
    pub placement: DAffine3,
    /// The deformations, in the order they apply.
    pub deformers: Vec<Deformer>,
    /// How the deformed shape is represented.
    pub representation: Representation,
    /// What is to be looked up at its points.
    pub attributes: Attributes,
}

/// An object before it is placed and deformed.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Plane polygons; what is not plane or not convex is cut into triangles.
    Polygons(Arc<PolygonMesh>),
    /// A parametric surface.
    Surface(SplineSurface),
}

/// What is to be looked up at an object's points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Attributes {
    /// Whether shading uses the polygons' normals, carried along by the deformation, instead of the surface's own.
    pub vertex_normals: bool,
    /// Whether all polygons must have texture coordinates. Without this they are looked up where there are any.
    pub texture_coordinates: bool,
}

/// An object ready to trace.
#[derive(Debug)]
pub struct BuiltObject {
    /// The geometry.
    pub traced: TracedObject,
    /// What is known of it besides.
    pub report: ObjectReport,
}

/// An object's lattices, statistics and warnings.
#[derive(Clone, Debug)]
pub struct ObjectReport {
    /// What was odd about the polygons.
    pub notes: MeshNotes,
    /// The lattices that deformed it.
    pub lattices: Vec<BuiltLattice>,
    /// The groups of its faces.
    pub groups: FaceGroups,
    /// Sub-polygons it was cut into.
    pub subpolygons: usize,
    /// Its triangular patches, if it is made of such.
    pub triangular: Option<TriangularCounts>,
    /// What may not be as its author meant it.
    pub warnings: Vec<String>,
    /// Time spent.
    pub times: ObjectTimes,
}

/// The names that a mesh's file gives groups of faces.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FaceGroups {
    names: Vec<String>,
    /// The group of each face; empty if there is one for all.
    of_face: Vec<u32>,
}

impl FaceGroups {
    fn new(mesh: &PolygonMesh) -> Self {
        let names = mesh.object_names().to_vec();
        let of_face =
            if names.len() > 1 { mesh.faces().map(|face| face.object()).collect() } else { Vec::new() };
        Self { names, of_face }
    }

    /// The name of the group of the face with index `face` in the mesh; none if it has none.
    #[must_use]
    pub fn name(&self, face: u32) -> Option<&str> {
        let group = self.of_face.get(face as usize).copied().unwrap_or(0);
        self.names.get(group as usize).map(String::as_str).filter(|name| !name.is_empty())
    }
}

/// Time spent on building an object.
#[derive(Clone, Copy, Debug, Default)]
pub struct ObjectTimes {
    /// Placing the shape and preparing its polygons.
    pub load: Duration,
    /// Cutting, grouping and composing.
    pub patches: BuildTimes,
}

impl Shape {
    /// Whether it has parameters (u, v), which some deformers are functions of.
    #[must_use]
    pub const fn has_parameters(&self) -> bool {
        matches!(self, Self::Surface(_))
    }
}

impl Object {
    /// A shape where it is, as it is, exactly.
    pub fn new(name: impl Into<String>, shape: Shape) -> Self {
        Self {
            name: name.into(),
            shape,
            placement: DAffine3::IDENTITY,
            deformers: Vec::new(),
            representation: Representation::Exact,
            attributes: Attributes::default(),
        }
    }

    /// Places, deforms and represents the shape.
    ///
    /// # Errors
    /// The first thing that is wrong; [`ModelError::deformer`] and [`ModelError::edit`] say where.
    pub fn build(&self) -> Result<BuiltObject, ModelError> {
        self.build_with(BuildSettings::default())
    }

    /// As [`Self::build`], if there is memory enough.
    ///
    /// # Errors
    /// As [`Self::build`]; also if the process would have more memory than it may.
    pub fn build_within(&self, memory: MemoryLimit) -> Result<BuiltObject, ModelError> {
        self.build_with(BuildSettings { memory, ..BuildSettings::default() })
    }

    /// As [`Self::build`], with settings of one's own.
    ///
    /// # Errors
    /// As [`Self::build`]; also if the process would have more memory than it may.
    pub fn build_with(&self, settings: BuildSettings) -> Result<BuiltObject, ModelError> {
        self.check_deformers()?;
        match &self.shape {
            Shape::Polygons(mesh) => self.build_polygons(mesh, settings),
            Shape::Surface(surface) => self.build_surface(surface, settings),
        }
    }

    /// Whether all deformers can follow one another on this shape.
    fn check_deformers(&self) -> Result<(), ModelError> {
        let maps = self.deformers.iter().enumerate().filter_map(|(i, deformer)| Some((i, deformer.map()?)));
        let mut fields = 0;
        for (deformer, map) in maps {
            if let Some(name) = map.needs_parameters().filter(|_| !self.shape.has_parameters()) {
                return Err(ModelError::NeedsSurface { deformer, name });
            }
            fields += usize::from(map.takes_derivatives());
            if fields > MAX_FIELDS {
                return Err(ModelError::TooManyFields { deformer });
            }
        }
        Ok(())
    }

    fn build_polygons(&self, mesh: &PolygonMesh, settings: BuildSettings) -> Result<BuiltObject, ModelError> {
        let started = Instant::now();
        let corners: u64 = mesh.faces().map(|face| face.arity() as u64).sum();
        let promise = settings
            .memory
            .ask(format_args!("the mesh's {} polygons", mesh.face_count()), corners * CORNER_BYTES)?;
        let (polygons, notes) = prepare_polygons(mesh, self.placement, MeshTolerances::default());
        drop(promise);
        // faces with corners that double precision cannot hold are not among the polygons
        let placed = mesh.positions().iter().map(|position| self.placement.transform_point3(*position));
        let most = magnitude::greatest(placed);
        if most == f64::INFINITY {
            let source = MagnitudeError::TooLarge(most);
            return Err(ModelError::Magnitude { deformer: None, source });
        }
        check_magnitude(polygons.bounds().ok_or(ModelError::NoArea)?)?;
        if let Some(bare) = polygons.iter().find(|polygon| polygon.uvs.is_empty())
            && self.attributes.texture_coordinates
        {
            return Err(ModelError::NoTextureCoordinates { face: bare.face });
        }
        if self.attributes.vertex_normals && !mesh.has_normals() {
            return Err(ModelError::NoNormals);
        }
        let load = started.elapsed();
        let shape = PlacedShape { base: Base::Polygons(&polygons), deformers: &self.deformers, settings };
        let made = self.representation.construct(&shape)?;
        let volumes = made.lattices.iter().map(|lattice| lattice.volume.clone()).collect();
        let normals = self.attributes.vertex_normals;
        let normals = normals.then(|| CarriedNormals::new(mesh, self.placement.matrix3, volumes));
        let attributes = Box::new(PolygonAttributes { polygons, normals });
        Ok(self.finished(made, attributes, (notes, load)))
    }

    fn build_surface(
        &self,
        surface: &SplineSurface,
        settings: BuildSettings,
    ) -> Result<BuiltObject, ModelError> {
        if self.representation.needs_polygons() {
            return Err(ModelError::NeedsPolygons);
        }
        let started = Instant::now();
        let shell = placed_shell(surface, self.placement);
        check_magnitude(bounds::around(shell.faces().iter().flat_map(|face| face.patch.hull_bounds())))?;
        let load = started.elapsed();
        let base = Base::Surface { surface, placement: self.placement, shell: &shell };
        let shape = PlacedShape { base, deformers: &self.deformers, settings };
        let made = self.representation.construct(&shape)?;
        let mut warnings = Vec::new();
        for (number, step) in (1..).zip(&made.steps) {
            let found = step.warnings(surface.domain());
            warnings.extend(found.into_iter().map(|warning| format!("deformation {number}: {warning}")));
        }
        let attributes = SurfaceAttributes { surface: surface.clone(), placement: self.placement };
        let mut built = self.finished(made, Box::new(attributes), (MeshNotes::default(), load));
        built.report.warnings = warnings;
        Ok(built)
    }

    fn finished(
        &self,
        made: Construction,
        attributes: Box<dyn VertexAttributes>,
        (notes, load): (MeshNotes, Duration),
    ) -> BuiltObject {
        let Construction { elements, subpolygons, lattices, triangular, mut times, .. } = made;
        let (shell, attributes) = match elements {
            Elements::Faces(shell) => (shell, attributes),
            Elements::Facets(facets) => {
                let started = Instant::now();
                let volume = lattices.first().map(|lattice| &lattice.volume);
                let made = facet_object(facets, attributes, self.attributes.vertex_normals, volume);
                times.compose += started.elapsed();
                made
            }
        };
        let traced = TracedObject { name: self.name.clone(), shell, attributes };
        let times = ObjectTimes { load, patches: times };
        let groups = match &self.shape {
            Shape::Polygons(mesh) => FaceGroups::new(mesh),
            Shape::Surface(_) => FaceGroups::default(),
        };
        let report =
            ObjectReport { notes, lattices, groups, subpolygons, triangular, warnings: Vec::new(), times };
        BuiltObject { traced, report }
    }

    /// A warning if the object may run through itself, of one that is `index` in a scene: two places (u, v) of its surface
    /// that meet. Looked for only where a deformer moves points of the surface by their parameters. None is no proof.
    #[must_use]
    pub fn self_intersection(&self, scene: &TracedScene, index: usize) -> Option<String> {
        let Shape::Surface(surface) = &self.shape else { return None };
        let by_parameters = |deformer: &Deformer| deformer.map().and_then(Step::needs_parameters).is_some();
        if !self.deformers.iter().any(by_parameters) {
            return None;
        }
        self_intersection(scene, index, surface.domain()).map(|[first, second]: [DVec2; 2]| {
            format!(
                "the surface may intersect itself: about u = {:.4}, v = {:.4} it meets its part about u = {:.4}, v = {:.4}",
                first.x, first.y, second.x, second.y
            )
        })
    }
}

/// Refuses an object that is too large or too small where it is placed.
fn check_magnitude(bounds: [DVec3; 2]) -> Result<(), ModelError> {
    magnitude::check(bounds).map_err(|source| ModelError::Magnitude { deformer: None, source })
}
