//! The deformations of an object, one after the other.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{DAffine3, DVec2, DVec3};

use super::attributes::plane_corners;
use super::bounds::tight_bounds;
use super::deformer::{DragReport, EditedLattice, edited_lattice};
use crate::analytic::{Chain, CoverSettings, Covered, Step, cover};
use crate::mesh::PolygonSet;
use crate::patch::{BuildTimes, Deformation, PlanarPolygon, TrimmedPatch, deform_polygons};
use crate::scene::{
    DeformDescription, Diagnostic, FfdDescription, Located, Location, ObjectDescription, Outside,
    SceneDescription,
};
use crate::shade::Camera;
use crate::spline::{ControlLattice, KnotBox, SplineVolume};
use crate::subdivide::{Frame, FrameChoice};
use crate::surface::SplineSurface;
use crate::trace::{NoAttributes, TracedObject, TracedScene};

/// What is deformed: placed in the world.
#[derive(Clone, Copy)]
pub(crate) enum Undeformed<'a> {
    /// Of a mesh.
    Polygons(&'a PolygonSet),
    /// Of a surface, whose patches' frames take to its parameters.
    Surface { surface: &'a SplineSurface, transform: DAffine3, patches: &'a [TrimmedPatch] },
}

/// A lattice of an object after all edits.
#[derive(Clone, Debug)]
pub struct BuiltLattice {
    /// Number of the deformation among the object's, from 1.
    pub deform: usize,
    /// The volume.
    pub volume: SplineVolume,
    /// Its lattice.
    pub lattice: ControlLattice,
    /// What drags did to it.
    pub drags: Vec<DragReport>,
    /// The knot boxes that hold a part of the object.
    pub knot_boxes: BTreeSet<KnotBox>,
}

/// An object after its deformations.
pub(crate) struct Deformed {
    pub(crate) patches: Vec<TrimmedPatch>,
    pub(crate) subpolygons: usize,
    pub(crate) lattices: Vec<BuiltLattice>,
    pub(crate) steps: Vec<Step>,
    pub(crate) times: BuildTimes,
}

impl Deformed {
    /// What all steps made.
    pub(crate) fn new(shaped: Shaped, steps: Vec<Step>, mut lattices: Vec<BuiltLattice>) -> Self {
        let Shaped { patches, subpolygons, times, knot_boxes } = shaped;
        for lattice in &mut lattices {
            let here = knot_boxes.iter().filter(|(step, _)| step + 1 == lattice.deform);
            lattice.knot_boxes = here.filter_map(|(_, knot_box)| *knot_box).collect();
        }
        Self { patches, subpolygons, lattices, steps, times }
    }
}

/// Patches after some steps.
pub(crate) struct Shaped {
    pub(crate) patches: Vec<TrimmedPatch>,
    pub(crate) subpolygons: usize,
    pub(crate) times: BuildTimes,
    /// By step.
    pub(crate) knot_boxes: BTreeSet<(usize, Option<KnotBox>)>,
}

/// A message about a step.
pub(crate) struct StepFault {
    pub(crate) step: Option<usize>,
    pub(crate) message: String,
}

/// An object's deformations at work.
pub(crate) struct Deforming<'a> {
    pub(crate) scene: &'a SceneDescription,
    pub(crate) object: &'a ObjectDescription,
    pub(crate) undeformed: Undeformed<'a>,
}

impl Deforming<'_> {
    /// The volumes and extensions, without patches.
    pub(crate) fn steps(&self) -> Result<(Vec<Step>, Vec<BuiltLattice>), Vec<Diagnostic>> {
        let mut steps: Vec<Step> = Vec::new();
        let mut lattices = Vec::new();
        for (number, deform) in (1..).zip(&self.object.deform) {
            let ffd = match &deform.value {
                DeformDescription::Extension(extension) => {
                    steps.push(Step::Extension(extension.clone()));
                    continue;
                }
                DeformDescription::Ffd(ffd) => ffd,
            };
            let received = match (ffd.bounds, self.undeformed) {
                (Some(bounds), _) => bounds,
                (None, Undeformed::Polygons(polygons)) if steps.is_empty() => {
                    polygons.bounds().unwrap_or_default()
                }
                (None, _) => {
                    let shaped = self.shape(&steps, CoverSettings::default());
                    tight_bounds(&shaped.map_err(|fault| self.diagnostics(fault))?.patches)
                }
            };
            let pick = |lattice: &ControlLattice, pixel| self.pick(&steps, lattice, pixel);
            let located = Located { value: ffd, location: deform.location };
            let EditedLattice { volume, lattice, drags } =
                edited_lattice(self.scene, &located, received, &pick)?;
            steps.push(Step::Volume(volume.clone()));
            lattices.push(BuiltLattice {
                deform: number,
                volume,
                lattice,
                drags,
                knot_boxes: BTreeSet::new(),
            });
        }
        Ok((steps, lattices))
    }

    /// All deformations, exactly.
    pub(crate) fn deformed(&self) -> Result<Deformed, Vec<Diagnostic>> {
        let (steps, lattices) = self.steps()?;
        let shaped = self.shape(&steps, CoverSettings::default());
        let shaped = shaped.map_err(|fault| self.diagnostics(fault))?;
        Ok(Deformed::new(shaped, steps, lattices))
    }

    fn ffd(&self, step: usize) -> Option<&FfdDescription> {
        match &self.object.deform.get(step)?.value {
            DeformDescription::Ffd(ffd) => Some(ffd),
            DeformDescription::Extension(_) => None,
        }
    }

    pub(crate) fn diagnostics(&self, StepFault { step, message }: StepFault) -> Vec<Diagnostic> {
        let deform = step.and_then(|step| self.object.deform.get(step));
        let location: Location = deform.map_or(self.object.name.location, |deform| deform.location);
        let message = format!("object {:?}: {message}", self.object.name.value);
        vec![Diagnostic { file: self.scene.path.clone(), location: Some(location), message }]
    }

    /// The object after some steps.
    fn shape(&self, steps: &[Step], settings: CoverSettings) -> Result<Shaped, StepFault> {
        let started = Instant::now();
        let mut shaped = self.first_step(steps)?;
        let done = usize::from(matches!((self.is_flat(), steps.first()), (true, Some(Step::Volume(_)))));
        for patch in shaped.patches.iter().filter(|_| done == 1) {
            shaped.knot_boxes.insert((0, patch.knot_box()));
        }
        if done == 1 {
            self.check_outside(0, &shaped)?;
        }
        if done < steps.len() {
            let chain = Arc::new(Chain::new(steps[done..].to_vec()));
            let Covered { patches, knot_boxes } =
                cover(&shaped.patches, &chain, settings).map_err(|error| StepFault {
                    step: error.step().map(|step| step + done),
                    message: error.to_string(),
                })?;
            shaped.patches = patches;
            shaped.knot_boxes.extend(knot_boxes.into_iter().map(|(step, knot_box)| (step + done, knot_box)));
            for step in done..steps.len() {
                self.check_outside(step, &shaped)?;
            }
        }
        let before: Duration = shaped.times.subdivide + shaped.times.compose;
        shaped.times.compose += started.elapsed().saturating_sub(before);
        Ok(shaped)
    }

    /// Whether it is made of plane pieces, whose images under a volume are patches.
    fn is_flat(&self) -> bool {
        match self.undeformed {
            Undeformed::Polygons(_) => true,
            Undeformed::Surface { patches, .. } => patches.iter().all(|patch| plane_corners(patch).is_some()),
        }
    }

    /// After the first step, if that is a volume and the object flat; else before.
    fn first_step(&self, steps: &[Step]) -> Result<Shaped, StepFault> {
        let volume = match steps.first() {
            Some(Step::Volume(volume)) => Some(volume),
            _ => None,
        };
        let frame = self.ffd(0).map_or_else(FrameChoice::default, |ffd| ffd.frame);
        let deformation = Deformation { volume, frame };
        let fault = |error: crate::patch::BuildError| StepFault { step: Some(0), message: error.to_string() };
        let none = BTreeSet::new();
        match self.undeformed {
            Undeformed::Polygons(polygons) => {
                let made = deform_polygons(&planar(polygons), deformation).map_err(fault)?;
                let (patches, subpolygons, times) = (made.patches, made.subpolygons, made.times);
                Ok(Shaped { patches, subpolygons, times, knot_boxes: none })
            }
            Undeformed::Surface { patches, .. } => {
                let mut shaped = Shaped {
                    patches: Vec::new(),
                    subpolygons: 0,
                    times: BuildTimes::default(),
                    knot_boxes: none,
                };
                if volume.is_none() || !self.is_flat() {
                    shaped.patches = patches.to_vec();
                    return Ok(shaped);
                }
                for patch in patches {
                    let Some(corners) = plane_corners(patch) else { continue };
                    let polygon = [PlanarPolygon { face: 0, corners: &corners }];
                    let made = deform_polygons(&polygon, deformation).map_err(fault)?;
                    shaped.subpolygons += made.subpolygons;
                    shaped.times.subdivide += made.times.subdivide;
                    shaped.times.compose += made.times.compose;
                    shaped.patches.extend(made.patches.into_iter().map(|mut made| {
                        made.frame = parameter_frame(&made.frame, &corners, &patch.frame);
                        made
                    }));
                }
                Ok(shaped)
            }
        }
    }

    /// Refuses parts outside a lattice's box if the scene says so.
    pub(crate) fn check_outside(&self, step: usize, shaped: &Shaped) -> Result<(), StepFault> {
        if !matches!(self.ffd(step), Some(FfdDescription { outside: Outside::Error, .. }))
            || !shaped.knot_boxes.contains(&(step, None))
        {
            return Ok(());
        }
        let advice = "larger bounds or outside = \"keep\" would do";
        if step > 0 || matches!(self.undeformed, Undeformed::Surface { .. }) {
            let message = format!("parts of it are not in the lattice's box; {advice}");
            return Err(StepFault { step: Some(step), message });
        }
        let outside = shaped.patches.iter().filter(|patch| patch.knot_box().is_none());
        let faces: BTreeSet<u32> =
            outside.flat_map(|patch| patch.trim.loops().iter().map(|trim_loop| trim_loop.face)).collect();
        let named: Vec<_> = faces.iter().take(8).map(u32::to_string).collect();
        let dots = if faces.len() > 8 { ", …" } else { "" };
        let message = format!(
            "{} faces are not wholly in the lattice's box (face {}{dots}); {advice}",
            faces.len(),
            named.join(", ")
        );
        Err(StepFault { step: Some(step), message })
    }

    /// The point that the camera sees through a place of the picture, as a lattice that follows some steps receives it.
    fn pick(&self, steps: &[Step], lattice: &ControlLattice, pixel: DVec2) -> Result<DVec3, String> {
        let scene = self.scene;
        let settings = scene.camera.ok_or("pick needs a [camera], through which the point is seen")?;
        let camera = Camera::try_new(&settings, scene.film.size).map_err(|error| error.to_string())?;
        let volume = lattice.volume().map_err(|error| error.to_string())?;
        let steps = [steps, &[Step::Volume(volume)]].concat();
        // only cells know their points before the last step
        let shaped = self.shape(&steps, CoverSettings { composes: false });
        let patches = shaped.map_err(|fault| fault.message)?.patches;
        let object = TracedObject { name: String::new(), patches, attributes: Box::new(NoAttributes) };
        let ray = camera.ray(pixel, DVec2::splat(0.5));
        let traced = TracedScene::new(vec![object]);
        let [width, height] = scene.film.size;
        let hit = traced.closest_hit(&ray).ok_or_else(|| {
            format!(
                "pick {}, {}: the camera sees nothing of the object there, in {width}x{height} pixels",
                pixel.x, pixel.y
            )
        })?;
        let patch = &traced.objects()[0].patches[hit.patch as usize];
        Ok(match (&patch.exact, self.undeformed) {
            (Some(exact), _) => exact.received(hit.st),
            (None, Undeformed::Polygons(_)) => hit.rest,
            (None, Undeformed::Surface { surface, transform, .. }) => {
                transform.transform_point3(surface.eval(hit.rest.truncate()))
            }
        })
    }
}

/// The polygons of a mesh as they are cut.
pub(crate) fn planar(polygons: &PolygonSet) -> Vec<PlanarPolygon<'_>> {
    polygons.iter().map(|polygon| PlanarPolygon { face: polygon.face, corners: polygon.positions }).collect()
}

/// The frame of parameters that belongs to a frame on the plane of a parallelogram, whose own frame of parameters is given.
fn parameter_frame(placed: &Frame, [corner, along_s, _, along_t]: &[DVec3; 4], whole: &Frame) -> Frame {
    let (s, t) = (along_s - corner, along_t - corner);
    let normal = s.cross(t);
    let parts = |vector: DVec3| {
        DVec2::new(vector.cross(t).dot(normal), s.cross(vector).dot(normal)) / normal.length_squared()
    };
    let vector = |vector: DVec3| {
        let parts = parts(vector);
        parts.x * whole.s + parts.y * whole.t
    };
    Frame { origin: whole.origin + vector(placed.origin - corner), s: vector(placed.s), t: vector(placed.t) }
}
