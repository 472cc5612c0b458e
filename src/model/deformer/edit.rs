//! Edits of a lattice's control points.

use glam::{DVec3, DVec4};
use thiserror::Error;

use crate::manipulate::{DirectManipulation, Drag, DragError, PointSolution, solve_weights};
use crate::math::magnitude::{self, HEAVIEST, LARGEST, MagnitudeError};
use crate::model::error::ModelError;
use crate::spline::{Axis, ControlLattice, HeldPoint, SignedAxis, VolumeError};
use crate::trace::Ray;

/// Farthest that a control point may be from the middle of the lattice's box, in parts of its diagonal: rays are traced in a scene of
/// size 1 with a tolerance of some 1e-8, and what the lattice does not move would be smaller than that.
const FARTHEST: f64 = 1e8;

/// An edit of a lattice's control points.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// Moves one control point.
    Move {
        /// Its index along each axis, inside the lattice and not held.
        index: [usize; 3],
        /// Where it goes.
        to: MoveTo,
    },
    /// Turns about the box's centre line by the right-hand rule.
    Twist {
        /// Direction of the centre line.
        axis: Axis,
        /// Degrees at the far end, 0 at the near end.
        angle: f64,
    },
    /// Scales across the box's centre line.
    Taper {
        /// Direction of the centre line.
        axis: Axis,
        /// Factors at the far end along [`Axis::cross_axes`], 1 at the near end.
        scale: [f64; 2],
    },
    /// Bends the box's centre line to a circle's arc (Barr 1984).
    Bend {
        /// Direction of the centre line.
        axis: Axis,
        /// Degrees at the far end, 0 at the near end.
        angle: f64,
        /// The side that the far end bends to; across `axis`.
        toward: SignedAxis,
    },
    /// Distance from the centre line times `1 + amount·sin(π z)`, z in `[0, 1]` along the axis.
    Bulge {
        /// Direction of the centre line.
        axis: Axis,
        /// Growth in the middle.
        amount: f64,
    },
    /// Sets the weight of one control point.
    Weight {
        /// Its index along each axis, inside the lattice and not held.
        index: [usize; 3],
        /// The weight, above 0.
        value: f64,
    },
    /// Moves points of the object to targets, by the least change of the lattice.
    Drag(DragEdit),
    /// Sets all control points: Cartesian with the weight as fourth component, third index fastest.
    ControlPoints(Vec<DVec4>),
}

/// Points of the object that are dragged together.
#[derive(Clone, Debug, PartialEq)]
pub struct DragEdit {
    /// The points.
    pub sources: DragSources,
    /// Where each must go; as many as sources.
    pub targets: Vec<DVec3>,
    /// What of the lattice changes.
    pub using: DragUsing,
    /// Whether drags by [`DragUsing::Points`] that contradict each other are met as nearly as possible instead of being an
    /// error.
    pub least_squares: bool,
}

/// How dragged points are given.
#[derive(Clone, Debug, PartialEq)]
pub enum DragSources {
    /// On the undeformed object, as the lattice receives it.
    Points(Vec<DVec3>),
    /// Where these rays first hit the object as it is after the edits before.
    Rays(Vec<Ray>),
}

/// What drags change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DragUsing {
    /// Places of control points.
    Points,
    /// Weights, each at least this times the least one before.
    Weights {
        /// The factor, above 0.
        min_weight: f64,
    },
}

/// Where a control point is moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MoveTo {
    /// By this much from where it is.
    By(DVec3),
    /// To this place.
    To(DVec3),
}

/// Why an edit cannot be made.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum EditError {
    /// There is no such control point.
    #[error("control point {index:?} is outside the lattice: the last is {last:?}")]
    NoPoint {
        /// Index of the control point.
        index: [usize; 3],
        /// The last control point's.
        last: [usize; 3],
    },
    /// The control point is held.
    #[error(transparent)]
    Held(#[from] HeldPoint),
    /// The edit takes a control point too far.
    #[error("control point {index:?}: {source}")]
    TooLarge {
        /// Index of the control point.
        index: [usize; 3],
        /// How far.
        source: MagnitudeError,
    },
    /// The edit takes a control point so far that nothing else of the object could be told apart.
    #[error(
        "control point {index:?} is {distance:e} from the lattice's box, which is {size:e} in size; \
         {FARTHEST:e} times its size is the most: a smaller edit or a larger box would do"
    )]
    TooFar {
        /// Index of the control point.
        index: [usize; 3],
        /// How far it is from the middle of the box.
        distance: f64,
        /// The box's diagonal.
        size: f64,
    },
    /// The edit gives a control point a weight that is too large or too small.
    #[error("control point {index:?} gets the weight {weight:e}, but weights must lie between {:e} and {HEAVIEST:e}", 1.0 / HEAVIEST)]
    Weight {
        /// Index of the control point.
        index: [usize; 3],
        /// Its weight.
        weight: f64,
    },
    /// Not as many control points as the lattice has.
    #[error("{got} control points given, {want} needed")]
    Count {
        /// Number given.
        got: usize,
        /// Number needed.
        want: usize,
    },
    /// Not as many targets as sources.
    #[error("{sources} points are dragged to {targets} targets: one target for each")]
    Targets {
        /// Number of sources.
        sources: usize,
        /// Number of targets.
        targets: usize,
    },
    /// The drags cannot be met.
    #[error(transparent)]
    Drag(#[from] DragError),
    /// A ray of [`DragSources::Rays`] hits nothing.
    #[error("ray {ray} hits nothing of the object")]
    Unseen {
        /// Its index.
        ray: usize,
    },
    /// The lattice as rays are to hit its object is no volume.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// The object that rays are to hit cannot be made.
    #[error(transparent)]
    Object(#[from] Box<ModelError>),
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
    /// The displacement by which this point alone is moved in the decomposition of Hu et al. (2001), section 5; none for
    /// weights.
    pub decomposed: Option<DVec3>,
}

/// The point, as the lattice receives it, where a ray hits the object under the lattice as it stands.
pub(super) type Seen<'a> = &'a dyn Fn(&ControlLattice, &Ray) -> Result<Option<DVec3>, EditError>;

/// Refuses control points that are too far, or whose weights are too large or too small, to compute with.
pub(super) fn check_points(lattice: &ControlLattice) -> Result<(), EditError> {
    let [low, high] = lattice.bounds();
    let (middle, size) = (0.5 * low + 0.5 * high, (high - low).length());
    for (flat, point) in lattice.points().iter().enumerate() {
        let (index, most) = (lattice.index_of(flat), magnitude::greatest([point.truncate()]));
        if most > LARGEST {
            return Err(EditError::TooLarge { index, source: MagnitudeError::TooLarge(most) });
        }
        let distance = point.truncate().distance(middle);
        if distance > FARTHEST * size {
            return Err(EditError::TooFar { index, distance, size });
        }
        if !(point.w <= HEAVIEST && point.w >= 1.0 / HEAVIEST) {
            return Err(EditError::Weight { index, weight: point.w });
        }
    }
    Ok(())
}

impl Edit {
    /// Applies the edit to a lattice by itself, around no object, so that drags by rays meet nothing; of drags it gives a report,
    /// with the edit's number still to be set.
    ///
    /// # Errors
    /// What is wrong with the edit, or with the lattice after it; the lattice is then of no use.
    ///
    /// # Example
    /// ```
    /// use glam::DVec3;
    /// use trimray::model::{Edit, MoveTo};
    /// use trimray::spline::ControlLattice;
    ///
    /// let mut lattice = ControlLattice::identity([2; 3], [3; 3], [DVec3::ZERO, DVec3::ONE], 0)?;
    /// Edit::Move { index: [1, 1, 1], to: MoveTo::By(DVec3::Z) }.apply_to(&mut lattice)?;
    /// assert_eq!(lattice.points()[13].truncate(), DVec3::new(0.5, 0.5, 1.5));
    ///
    /// let far = Edit::Move { index: [1, 1, 1], to: MoveTo::By(1e12 * DVec3::Z) };
    /// assert!(far.apply_to(&mut lattice).is_err());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn apply_to(&self, lattice: &mut ControlLattice) -> Result<Option<DragReport>, EditError> {
        let report = self.apply(lattice, &|_, _| Ok(None))?;
        check_points(lattice)?;
        Ok(report)
    }

    /// Applies the edit; of drags it gives a report, with the edit's number still to be set.
    pub(super) fn apply(
        &self,
        lattice: &mut ControlLattice,
        seen: Seen<'_>,
    ) -> Result<Option<DragReport>, EditError> {
        if let Self::Move { index, .. } | Self::Weight { index, .. } = self {
            let last = lattice.counts().map(|count| count - 1);
            if (0..3).any(|axis| index[axis] > last[axis]) {
                return Err(EditError::NoPoint { index: *index, last });
            }
        }
        match self {
            Self::Move { index, to: MoveTo::By(offset) } => lattice.move_by(*index, *offset)?,
            Self::Move { index, to: MoveTo::To(place) } => lattice.move_to(*index, *place)?,
            Self::Twist { axis, angle } => lattice.twist(*axis, *angle),
            Self::Taper { axis, scale } => lattice.taper(*axis, *scale),
            Self::Bend { axis, angle, toward } => lattice.bend(*axis, *angle, *toward),
            Self::Bulge { axis, amount } => lattice.bulge(*axis, *amount),
            Self::Weight { index, value } => lattice.set_weight(*index, *value)?,
            Self::ControlPoints(points) => {
                let [got, want] = [points.len(), lattice.points().len()];
                if got != want {
                    return Err(EditError::Count { got, want });
                }
                lattice.set_all(points.clone())?;
            }
            Self::Drag(drag) => return drag.apply(lattice, seen).map(Some),
        }
        Ok(None)
    }
}

impl DragEdit {
    fn apply(&self, lattice: &mut ControlLattice, seen: Seen<'_>) -> Result<DragReport, EditError> {
        let sources = match &self.sources {
            DragSources::Points(points) => points.clone(),
            DragSources::Rays(rays) => (0..)
                .zip(rays)
                .map(|(number, ray)| seen(lattice, ray)?.ok_or(EditError::Unseen { ray: number }))
                .collect::<Result<_, _>>()?,
        };
        let targets = &self.targets;
        if sources.len() != targets.len() {
            return Err(EditError::Targets { sources: sources.len(), targets: targets.len() });
        }
        let before = positions(lattice, &sources);
        let mut report = DragReport {
            edit: 0,
            using: self.using,
            equations: sources.len(),
            rank: 0,
            condition: 0.0,
            objective: 0.0,
            drags: Vec::new(),
            moves: Vec::new(),
            weights: Vec::new(),
        };
        let mut decomposed = None;
        match self.using {
            DragUsing::Points => {
                let manipulation = DirectManipulation::try_new(lattice, &sources)?;
                let displacements: Vec<DVec3> =
                    targets.iter().zip(&before).map(|(to, from)| to - from).collect();
                let solution: PointSolution = if self.least_squares {
                    manipulation.solve_least_squares(&displacements)
                } else {
                    manipulation.solve(&displacements)?
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
                let solution = solve_weights(lattice, &drags, min_weight)?;
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
}

/// Where the lattice takes points; NaN outside its box, which drags refuse.
fn positions(lattice: &ControlLattice, sources: &[DVec3]) -> Vec<DVec3> {
    sources.iter().map(|source| lattice.position(*source).unwrap_or(DVec3::NAN)).collect()
}
