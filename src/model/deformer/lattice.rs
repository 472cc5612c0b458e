//! The edits of a lattice, one after another.

use glam::{DVec2, DVec3};

use crate::manipulate::{DirectManipulation, Drag, PointSolution, solve_weights};
use crate::scene::read_lattice;
use crate::scene::{Diagnostic, Located, Location};
use crate::scene::{DragDescription, DragSources, DragUsing, Edit, FfdDescription, MoveTo, SceneDescription};
use crate::spline::{ControlLattice, HeldPoint, SplineVolume};

/// A flat axis of an object's box is widened by this part of the box's longest side to both sides, so that the lattice
/// has room to bend.
const FLAT_AXIS_PADDING: f64 = 0.25;

/// A lattice after all edits.
pub(crate) struct EditedLattice {
    pub(crate) volume: SplineVolume,
    pub(crate) lattice: ControlLattice,
    pub(crate) drags: Vec<DragReport>,
}

/// What one edit's drags did to the lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct DragReport {
    /// Number of the edit, from 1.
    pub edit: usize,
    /// What changed.
    pub using: DragUsing,
    /// Number of equations: the drags, or three for each if weights change.
    pub equations: usize,
    /// Number of independent ones.
    pub rank: usize,
    /// Greatest over least singular value of the independent ones.
    pub condition: f64,
    /// Sum of the squared changes, which is the least.
    pub objective: f64,
    /// Each drag.
    pub drags: Vec<DragOutcome>,
    /// Control points that move: index, and by what.
    pub moves: Vec<([usize; 3], DVec3)>,
    /// Weights that change: index of the control point, and the new weight.
    pub weights: Vec<([usize; 3], f64)>,
}

/// What became of one drag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DragOutcome {
    /// The point on the undeformed object.
    pub source: DVec3,
    /// Where it must go.
    pub target: DVec3,
    /// Where the edits before took it.
    pub before: DVec3,
    /// Where it is after all drags of the edit.
    pub reached: DVec3,
    /// Distance from the target.
    pub residual: f64,
    /// The displacement by which this point alone is moved in the decomposition; none for weights.
    pub decomposed: Option<DVec3>,
}

/// Finds the point of the undeformed object that is seen through a place of the picture.
type Pick<'a> = &'a dyn Fn(&ControlLattice, DVec2) -> Result<DVec3, String>;

/// The lattice over a box after all edits of a deformation.
pub(crate) fn edited_lattice(
    scene: &SceneDescription,
    ffd: &Located<&FfdDescription>,
    object_bounds: [DVec3; 2],
    pick: Pick<'_>,
) -> Result<EditedLattice, Vec<Diagnostic>> {
    let fault = |location: Location, message: String| {
        vec![Diagnostic { file: scene.path.clone(), location: Some(location), message }]
    };
    let description = ffd.value;
    let bounds = description.bounds.unwrap_or_else(|| padded(object_bounds));
    let mut lattice =
        ControlLattice::identity(description.degree, description.points, bounds, description.hold)
            .map_err(|error| fault(ffd.location, error.to_string()))?;
    let mut drags = Vec::new();
    for (number, edit) in (1..).zip(&description.edits) {
        let report = apply(&mut lattice, &edit.value, scene.least_squares, pick);
        let report = report.map_err(|message| fault(edit.location, message))?;
        drags.extend(report.map(|report| DragReport { edit: number, ..report }));
    }
    let volume = lattice.volume().map_err(|error| fault(ffd.location, error.to_string()))?;
    Ok(EditedLattice { volume, lattice, drags })
}

/// The box with flat axes widened.
fn padded([low, high]: [DVec3; 2]) -> [DVec3; 2] {
    let size = high - low;
    let padding = DVec3::splat(FLAT_AXIS_PADDING * size.max_element());
    let padding = DVec3::select(size.cmple(DVec3::ZERO), padding, DVec3::ZERO);
    [low - padding, high + padding]
}

/// Applies one edit; of drags it gives a report, with the edit's number still to be set.
fn apply(
    lattice: &mut ControlLattice,
    edit: &Edit,
    least_squares: bool,
    pick: Pick<'_>,
) -> Result<Option<DragReport>, String> {
    let held = |error: HeldPoint| error.to_string();
    match edit {
        Edit::Move { index, to: MoveTo::By(offset) } => lattice.move_by(*index, *offset).map_err(held)?,
        Edit::Move { index, to: MoveTo::To(place) } => lattice.move_to(*index, *place).map_err(held)?,
        Edit::Twist { axis, angle } => lattice.twist(*axis, *angle),
        Edit::Taper { axis, scale } => lattice.taper(*axis, *scale),
        Edit::Bend { axis, angle, toward } => lattice.bend(*axis, *angle, *toward),
        Edit::Bulge { axis, amount } => lattice.bulge(*axis, *amount),
        Edit::Weight { index, value } => lattice.set_weight(*index, *value).map_err(held)?,
        Edit::ControlPoints { path } => {
            let points = read_lattice(path, lattice.counts())?;
            lattice.set_all(points).map_err(held)?;
        }
        Edit::Drag(drag) => return apply_drag(lattice, drag, least_squares, pick).map(Some),
    }
    Ok(None)
}

fn apply_drag(
    lattice: &mut ControlLattice,
    description: &DragDescription,
    least_squares: bool,
    pick: Pick<'_>,
) -> Result<DragReport, String> {
    let sources = match &description.sources {
        DragSources::Points(points) => points.clone(),
        DragSources::Pixels(pixels) => {
            pixels.iter().map(|pixel| pick(lattice, *pixel)).collect::<Result<_, _>>()?
        }
    };
    let targets = &description.targets;
    let text = |error: crate::manipulate::DragError| error.to_string();
    let before = positions(lattice, &sources);
    let mut report = DragReport {
        edit: 0,
        using: description.using,
        equations: sources.len(),
        rank: 0,
        condition: 0.0,
        objective: 0.0,
        drags: Vec::new(),
        moves: Vec::new(),
        weights: Vec::new(),
    };
    let mut decomposed = None;
    match description.using {
        DragUsing::Points => {
            let manipulation = DirectManipulation::try_new(lattice, &sources).map_err(text)?;
            let displacements: Vec<DVec3> = targets.iter().zip(&before).map(|(to, from)| to - from).collect();
            let solution: PointSolution = if least_squares {
                manipulation.solve_least_squares(&displacements)
            } else {
                manipulation.solve(&displacements).map_err(text)?
            };
            decomposed = Some(manipulation.decompose(&displacements));
            report.rank = manipulation.rank();
            report.condition = manipulation.condition();
            report.objective = solution.objective;
            report.moves =
                solution.moves.iter().map(|&(flat, offset)| (lattice.index_of(flat), offset)).collect();
            solution.apply(lattice);
        }
        DragUsing::Weights { min_weight } => {
            let drags: Vec<Drag> =
                sources.iter().zip(targets).map(|(&source, &target)| Drag { source, target }).collect();
            let solution = solve_weights(lattice, &drags, min_weight).map_err(text)?;
            [report.equations, report.rank] = solution.rank;
            report.condition = solution.condition;
            report.objective = solution.objective;
            report.weights =
                solution.weights.iter().map(|&(flat, weight)| (lattice.index_of(flat), weight)).collect();
            solution.apply(lattice);
        }
    }
    let after = positions(lattice, &sources);
    report.drags = (0..sources.len())
        .map(|i| DragOutcome {
            source: sources[i],
            target: targets[i],
            before: before[i],
            reached: after[i],
            residual: after[i].distance(targets[i]),
            decomposed: decomposed.as_ref().map(|decomposed: &Vec<DVec3>| decomposed[i]),
        })
        .collect();
    Ok(report)
}

/// Where the lattice takes points; NaN outside its box, which drags refuse.
fn positions(lattice: &ControlLattice, sources: &[DVec3]) -> Vec<DVec3> {
    sources.iter().map(|source| lattice.position(*source).unwrap_or(DVec3::NAN)).collect()
}
