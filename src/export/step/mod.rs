//! Deformed solids as STEP files: trimmed B-spline surfaces and planes that share their edges and vertices.
//!
//! Written here rather than by a library: a writer is a few hundred lines, the edges of the model are the edges of the file, and
//! curves in the surfaces' parameters, which the builders of libraries leave out, let every reader trim without projecting.
//!
//! Source: Feng, Nishita, Jin, Peng (2002), section 1 (trimmed Bézier surfaces as STEP describes them); ISO 10303-21, -42, -203,
//! -214, -242.

mod entity;
mod integral;
mod product;
mod shell;

use std::fmt::Write;

use glam::DVec3;
use thiserror::Error;

use crate::math::bounds;
use crate::patch::{Component, FaceBounds, Joint, Shell, Topology, components};

use entity::{Entities, Id, List, Quoted};
use product::Contexts;
pub use product::{LengthUnit, Schema};
use shell::ShellWriter;

/// Readers drop surfaces and curves of higher degree, some without a word.
pub const MAX_STEP_DEGREE: usize = 24;

/// Lengths within this, in units of the file, are one for readers.
const UNCERTAINTY: f64 = 1e-7;

/// An object to be written.
#[derive(Clone, Copy)]
pub struct StepObject<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its faces.
    pub shell: &'a Shell,
    /// Its colour, linear RGB, if it has one.
    pub colour: Option<DVec3>,
    /// The name of an input face's group, if it has one. Loops of one face in groups of different names are faces of their own.
    pub group: &'a dyn Fn(u32) -> Option<&'a str>,
}

impl std::fmt::Debug for StepObject<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("StepObject")
            .field("name", &self.name)
            .field("colour", &self.colour)
            .finish_non_exhaustive()
    }
}

/// How objects are written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StepSettings {
    /// What one unit of the scene is.
    pub unit: LengthUnit,
    /// For whom.
    pub schema: Schema,
    /// The file's name, for its header.
    pub file_name: String,
    /// When it is written, as ISO 8601 has it.
    pub time_stamp: String,
}

/// What was written of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct StepReport {
    /// Its name.
    pub name: String,
    /// Closed solids.
    pub solids: usize,
    /// Cavities in them.
    pub voids: usize,
    /// Shells that are not closed.
    pub open_shells: usize,
    /// Faces.
    pub faces: usize,
    /// Edges.
    pub edges: usize,
    /// The greatest degree of a surface or curve.
    pub degree: usize,
    /// Solids that the deformation has turned inside out, and that were turned back.
    pub turned: usize,
    /// Bound on the distance from the deformed object; 0 if only numbers are rounded.
    pub error: f64,
}

/// Why an object has no STEP form.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StepError {
    /// Borders that are curves in the parameters.
    #[error(
        "object {name:?}: faces end in curves, where the deformation tears or has a kink, or bends by more than the tolerance in \
         however small a part; STEP files of such are not written in this version (a greater --tolerance may help; .obj and \
         .ply hold triangles of any object)"
    )]
    CurvedBorders {
        /// The object.
        name: String,
    },
    /// A degree above [`MAX_STEP_DEGREE`].
    #[error(
        "object {name:?}: degree {degree}, which readers drop without a word above {MAX_STEP_DEGREE}; lattices of lower degree help"
    )]
    Degree {
        /// The object.
        name: String,
        /// The degree.
        degree: usize,
    },
    /// Weights that are not positive.
    #[error("object {name:?}: weights that are not positive, which STEP has no surfaces for")]
    Weights {
        /// The object.
        name: String,
    },
}

/// The objects as one STEP file, and what it holds.
///
/// Each connected closed component is a `MANIFOLD_SOLID_BREP`, with its cavities a `BREP_WITH_VOIDS`; what is not closed is an open shell.
/// Pieces of a plane and patches are faces, their edges Bézier curves of the lowest degree with their lines in the parameters of
/// both faces.
///
/// # Errors
/// If an object has no STEP form.
pub fn step(
    objects: &[StepObject<'_>],
    settings: &StepSettings,
) -> Result<(String, Vec<StepReport>), StepError> {
    for object in objects {
        check(object)?;
    }
    let error = objects.iter().map(|object| certified_error(object.shell)).fold(0.0, f64::max);
    let mut entities = Entities::default();
    // two neighbours may be off in opposite directions
    let uncertainty = UNCERTAINTY.max(2.0 * error);
    let contexts = Contexts::write(&mut entities, settings.schema, settings.unit, uncertainty);
    let mut reports = Vec::new();
    let mut styles = Vec::new();
    for object in objects {
        let report = write_object(&mut entities, &contexts, object, &mut styles)?;
        reports.push(report);
    }
    contexts.presentation(&mut entities, &styles);
    let mut text = String::new();
    let (name, time) = (Quoted(&settings.file_name), Quoted(&settings.time_stamp));
    let version = Quoted(concat!("trimray ", env!("CARGO_PKG_VERSION")));
    write!(
        text,
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME({name},{time},(''),(''),{version},{version},'');\n\
         FILE_SCHEMA(({}));\nENDSEC;\nDATA;\n",
        Quoted(settings.schema.name())
    )
    .expect("strings take all that is written");
    text += &entities.into_text();
    text += "ENDSEC;\nEND-ISO-10303-21;\n";
    Ok((text, reports))
}

/// The greatest distance of patches from the surfaces that they stand for.
fn certified_error(shell: &Shell) -> f64 {
    shell.faces().iter().filter_map(|face| face.exact.as_ref()).map(|exact| exact.error()).fold(0.0, f64::max)
}

fn check(object: &StepObject<'_>) -> Result<(), StepError> {
    let name = || object.name.to_owned();
    for face in object.shell.faces() {
        if face.exact.as_ref().is_some_and(|exact| exact.has_borders()) {
            return Err(StepError::CurvedBorders { name: name() });
        }
        if !face.patch.has_positive_weights() {
            return Err(StepError::Weights { name: name() });
        }
        let degree = face.patch.degree().into_iter().max().unwrap_or(0);
        if degree > MAX_STEP_DEGREE {
            return Err(StepError::Degree { name: name(), degree });
        }
    }
    Ok(())
}

/// A component, what of the topology it has, and what it is.
struct Part<'a> {
    component: Component,
    joints: Vec<&'a Joint>,
    bounds: Vec<&'a FaceBounds>,
    volume: f64,
    /// The part it is a cavity of.
    around: Option<usize>,
}

impl Part<'_> {
    /// Whether it bounds the outside of a solid, but with normals to the inside.
    fn is_turned(&self) -> bool {
        self.component.is_closed && self.volume < 0.0 && self.around.is_none()
    }
}

fn write_object(
    entities: &mut Entities,
    contexts: &Contexts,
    object: &StepObject<'_>,
    styles: &mut Vec<Id>,
) -> Result<StepReport, StepError> {
    let topology = object.shell.topology();
    let bounds = topology.face_bounds(object.group);
    let joints = topology.joints(&bounds);
    let parts = parts(&topology, &bounds, &joints);
    let degrees = object.shell.faces().iter().flat_map(|face| face.patch.degree());
    let mut report = StepReport {
        name: object.name.to_owned(),
        solids: 0,
        voids: 0,
        open_shells: 0,
        faces: bounds.len(),
        edges: joints.len(),
        degree: degrees.max().unwrap_or(0),
        turned: 0,
        error: certified_error(object.shell),
    };
    let group = |face: u32| {
        let outline = &topology.outlines()[bounds[face as usize].outline as usize];
        (object.group)(outline.trim_loop.face)
    };
    let mut writer = ShellWriter::new(entities, &topology, &bounds, contexts.parameters);
    let mut shells = Vec::with_capacity(parts.len());
    for part in &parts {
        let faces = writer.faces(&part.component.faces, &part.joints, part.is_turned(), group);
        let kind = if part.component.is_closed { "CLOSED_SHELL" } else { "OPEN_SHELL" };
        shells.push(writer.entities.add(format_args!("{kind}('',{})", List(&faces))));
    }
    let curve_degree = writer.curve_degree;
    if curve_degree > MAX_STEP_DEGREE {
        return Err(StepError::Degree { name: object.name.to_owned(), degree: curve_degree });
    }
    report.degree = report.degree.max(curve_degree);

    let items = shape_items(entities, object.name, (&parts, &shells), &mut report);
    let kind = match (report.solids, report.open_shells) {
        (_, 0) => "ADVANCED_BREP_SHAPE_REPRESENTATION",
        (0, _) => "MANIFOLD_SURFACE_SHAPE_REPRESENTATION",
        _ => "SHAPE_REPRESENTATION",
    };
    contexts.product(entities, object.name, kind, &items);
    if let Some(colour) = object.colour {
        contexts.colour(entities, colour, &items, styles);
    }
    Ok(report)
}

/// The solids and the model of open shells, counted in the report.
fn shape_items(
    entities: &mut Entities,
    name: &str,
    (parts, shells): (&[Part<'_>], &[Id]),
    report: &mut StepReport,
) -> Vec<Id> {
    let name = Quoted(name);
    let mut items = Vec::new();
    let mut open = Vec::new();
    for (number, part) in parts.iter().enumerate() {
        if !part.component.is_closed {
            open.push(shells[number]);
            report.open_shells += 1;
            continue;
        }
        if part.around.is_some() {
            report.voids += 1;
            continue;
        }
        report.solids += 1;
        report.turned += usize::from(part.is_turned());
        let outer = shells[number];
        let mut voids = Vec::new();
        for (inner, cavity) in parts.iter().enumerate() {
            if cavity.around == Some(number) {
                let shell = shells[inner];
                voids.push(entities.add(format_args!("ORIENTED_CLOSED_SHELL('',*,{shell},.T.)")));
            }
        }
        items.push(if voids.is_empty() {
            entities.add(format_args!("MANIFOLD_SOLID_BREP({name},{outer})"))
        } else {
            entities.add(format_args!("BREP_WITH_VOIDS({name},{outer},{})", List(&voids)))
        });
    }
    if !open.is_empty() {
        items.push(entities.add(format_args!("SHELL_BASED_SURFACE_MODEL({name},{})", List(&open))));
    }
    items
}

/// The components, with what is a cavity of what.
fn parts<'a>(topology: &Topology<'_>, bounds: &'a [FaceBounds], joints: &'a [Joint]) -> Vec<Part<'a>> {
    let components = components(bounds.len(), joints);
    let mut of_face = vec![0; bounds.len()];
    for (number, component) in components.iter().enumerate() {
        component.faces.iter().for_each(|&face| of_face[face as usize] = number);
    }
    let mut parts: Vec<_> = components
        .into_iter()
        .map(|component| {
            let own: Vec<_> = component.faces.iter().map(|&face| &bounds[face as usize]).collect();
            Part { component, joints: Vec::new(), bounds: own, volume: 0.0, around: None }
        })
        .collect();
    for joint in joints {
        parts[of_face[joint.uses[0].face as usize]].joints.push(joint);
    }
    for part in &mut parts {
        // from a point of its own, for rounding grows with the distance
        part.volume = integral::volume(topology, &part.bounds, a_vertex(topology, part));
    }
    let around: Vec<_> = (0..parts.len()).map(|inner| solid_around(topology, &parts, inner)).collect();
    for (part, around) in parts.iter_mut().zip(around) {
        part.around = around;
    }
    parts
}

/// The smallest solid that a part with normals to its inside is a cavity of.
fn solid_around(topology: &Topology<'_>, parts: &[Part<'_>], inner: usize) -> Option<usize> {
    let cavity = &parts[inner];
    if !cavity.component.is_closed || cavity.volume > 0.0 {
        return None;
    }
    let place = a_vertex(topology, cavity);
    let [low, high] = box_of(topology, cavity);
    let holds = |number: &usize| {
        let solid = &parts[*number];
        let [least, greatest] = box_of(topology, solid);
        let may_hold = least.cmple(high).all() && greatest.cmpge(low).all();
        solid.component.is_closed
            && solid.volume > cavity.volume.abs()
            && may_hold
            && integral::winding(topology, &solid.bounds, place) > 0.5
    };
    (0..parts.len()).filter(holds).min_by(|&a, &b| parts[a].volume.total_cmp(&parts[b].volume))
}

fn a_vertex(topology: &Topology<'_>, part: &Part<'_>) -> DVec3 {
    let [vertex, _] = topology.vertices(&part.bounds[0].outer[0]);
    topology.positions()[vertex as usize]
}

fn box_of(topology: &Topology<'_>, part: &Part<'_>) -> [DVec3; 2] {
    let edges = part.bounds.iter().flat_map(|bounds| bounds.edges());
    bounds::around(edges.map(|edge| topology.positions()[topology.vertices(edge)[0] as usize]))
}

#[cfg(test)]
mod tests;
