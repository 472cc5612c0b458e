//! Surfaces under chains of deformations as cells, each with a patch that comes as near to it as rounding, and proven to.
//!
//! A formula is evaluated over discs of complex parameters around a rectangle. If its piece is analytic there, the values
//! bound how far the interpolant at Chebyshev points is from it over the rectangle; the least degrees for which that is below
//! rounding are taken, and a rectangle that needs degrees too high is halved. Where several pieces meet in a rectangle, each
//! has a cell over all of it, whose border is the curve where the pieces meet.

use std::collections::BTreeSet;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DVec2, DVec3, DVec4};
use rayon::prelude::*;

use crate::math::magnitude::{self, LARGEST, MagnitudeError, SMALLEST};
use crate::memory::MemoryLimit;
use crate::patch::{BezierPatch, Face, LineCuts, Overlap, Region, Shell, TrimLoop};
use crate::spline::KnotBox;
use crate::subdivide::VertexNumbers;

use super::branch::{ByValue, MOST_PIECES, MOST_PIECES_AT_POINT, Piece, pieces};
use super::cell::{Cell, overlap, rectangle};
use super::chain::{Chain, Formula};
use super::compose::composed;
use super::cover_error::{CoverError, MAX_CELLS};
use super::cover_settings::{CoverSettings, Covered};
use super::disc::Disc;
use super::interpolate::{Interpolant, interpolate, interpolation_error, lebesgue};
use super::loop_part::{LoopPart, local_region};
use super::merge::{Merge, merge};
use super::number::{Number, SIZES};
use super::step::Step;

/// Highest degree of a cell's patch.
const MAX_CELL_DEGREE: usize = 12;

/// The same where pieces may differ: those are for CAD systems, some of which read no more.
const MAX_WITHIN_DEGREE: usize = 9;

/// Bound of the interpolation error of a cell, in parts of the object's size. Hits are moved from patches to the formula's
/// surface, so that this is only how far from tangent a ray must be for its roots on both to correspond, and the width of
/// borders between cells. A tenth of it needs a third more cells.
const ACCURACY: f64 = 1e-11;

/// Radii of discs around a rectangle, in parts of its half sides: large ones for small rectangles, the largest for polynomials,
/// so that they keep their own degrees.
const REACHES: [f64; 8] = [2.6, 4.2, 6.5, 10.0, 18.0, 50.0, 200.0, 1e13];

/// A rectangle in which several pieces meet is no larger than this, in parts of the object's size.
const LARGEST_SHARED: f64 = 0.05;

/// Halvings of each side, at most: a point where the formula is not smooth would be approached for ever.
const MAX_HALVINGS: u32 = 30;

/// After so many rectangles smaller than this part of the object's size, pieces that still differ are taken to be torn apart,
/// or to meet in a kink.
const KINK: f64 = 1e-4;
const MOST_KINKS: usize = 4000;

/// Accuracy of patches of pieces that may differ, in parts of how far.
const FIT: f64 = 0.02;

/// A rectangle that cannot be halved further is a cell if its points are no farther apart than this, in parts of the
/// object's size.
const POINT: f64 = 1e-8;

/// Rectangles of a surface that are looked at, at most: those of cells, those that are halved, and those in which parts of pieces
/// are searched for.
const MAX_RECTANGLES: usize = 8 * MAX_CELLS;

/// Cells that are made between two looks at the memory that is left, and the memory that each takes, about.
const CELLS_BETWEEN_CHECKS: usize = 256;
const CELL_BYTES: u64 = 4096;

/// How finely a rectangle is searched for parts of a piece.
const SEARCH_HALVINGS: u32 = 3;

/// Makes cells, or patches where degrees allow, of base faces that go through a chain of deformations.
///
/// # Errors
/// Where the formula has no values or no bounds.
pub fn cover(base: &Shell, chain: &Arc<Chain>, settings: CoverSettings) -> Result<Covered, CoverError> {
    let size = size(base.faces(), chain)?;
    let numbered: Vec<_> = base.iter().collect();
    let common = base.numbers().count();
    let work = Work::default();
    let covered: Result<Vec<_>, _> = numbered
        .par_iter()
        .map(|face| cover_face(*face, chain, Shell::new(VertexNumbers::new(common)), (size, settings, &work)))
        .collect();
    let mut all = Covered { shell: Shell::new(base.numbers().clone()), knot_boxes: BTreeSet::new() };
    for Covered { shell, knot_boxes } in covered? {
        all.shell.append(shell, common, |vertex| vertex);
        all.knot_boxes.extend(knot_boxes);
    }
    all.shell.shrink();
    Ok(all)
}

/// Diagonal of a box around points of the deformed surface.
fn size(base: &[Face], chain: &Arc<Chain>) -> Result<f64, CoverError> {
    let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for patch in base {
        let formula =
            Formula { base: patch.patch.clone(), chart: patch.chart, chain: chain.clone(), done: 0 };
        for trim_loop in patch.region.loops() {
            let corners = patch.region.corners(&trim_loop);
            let middle = corners.iter().sum::<DVec2>() / corners.len() as f64;
            for part in [0.0, 0.25, 0.5, 0.75, 1.0] {
                for corner in corners {
                    let st = middle.lerp(*corner, part);
                    let position = formula.position(st, &mut ByValue);
                    if magnitude::greatest([position]) > LARGEST {
                        return Err(fault(&formula, st));
                    }
                    bounds = [bounds[0].min(position), bounds[1].max(position)];
                }
            }
        }
    }
    let extent = (bounds[1] - bounds[0]).max_element();
    if extent < SMALLEST {
        return Err(CoverError::TooSmall { source: MagnitudeError::TooSmall(extent) });
    }
    Ok((bounds[1] - bounds[0]).length())
}

/// What is wrong at a place of a formula's base patch.
fn fault(formula: &Formula, st: DVec2) -> CoverError {
    let place = formula.place(st);
    for step in 0..formula.steps() {
        let made = formula.position_after(st, step + 1);
        if formula.chain.steps()[step].takes_derivatives() {
            let [by_s, by_t] = formula.partials(st, step);
            let longer = by_s.length().max(by_t.length());
            let sine = by_s.cross(by_t).length() / (longer * longer);
            if sine.is_nan() || sine <= 1e-6 {
                return CoverError::NoNormal { step, place };
            }
        }
        if !made.is_finite() {
            return CoverError::NotFinite { step, place };
        }
        let most = magnitude::greatest([made]);
        if most > LARGEST {
            return CoverError::TooLarge { step, place, source: MagnitudeError::TooLarge(most) };
        }
    }
    CoverError::Unbounded { place }
}

/// Covers a face, with the vertices of its corners, by the faces of a shell that is empty yet.
fn cover_face(
    (base, vertices): (&Face, &[u32]),
    chain: &Arc<Chain>,
    mut cells: Shell,
    (size, settings, work): (f64, CoverSettings, &Work),
) -> Result<Covered, CoverError> {
    let mut base = base.clone();
    let mut knot_boxes = BTreeSet::new();
    let mut done = 0;
    while let Some(Step::Volume(volume)) = chain.steps().get(done) {
        let composed = if settings.composes { composed(&base.patch, volume) } else { None };
        let Some((patch, knot_box)) = composed else { break };
        knot_boxes.insert((done, Some(knot_box)));
        let boundary_error = base.boundary_error * volume.lipschitz_bound();
        base = base.replaced(base.chart, patch, base.region.clone(), (boundary_error, None));
        done += 1;
    }
    if done == chain.steps().len() {
        cells.push(base, vertices);
        return Ok(Covered { shell: cells, knot_boxes });
    }
    let stretch: f64 = chain.steps()[done..].iter().map(Step::lipschitz_bound).product();
    let formula = Formula { base: base.patch.clone(), chart: base.chart, chain: chain.clone(), done };
    let mut cover = Cover {
        work,
        boundary_error: if base.boundary_error > 0.0 { base.boundary_error * stretch } else { 0.0 },
        base,
        formula: Arc::new(formula),
        size,
        within: settings.borders.within(size),
        memory: settings.memory,
        cells: Vec::new(),
        knot_boxes,
    };
    let part = |trim_loop: TrimLoop| {
        let corners = cover.base.region.numbered_corners(&trim_loop, vertices).collect();
        LoopPart { polygon: trim_loop.polygon, face: trim_loop.face, corners }
    };
    let parts: Vec<_> = cover.base.region.loops().map(part).collect();
    let whole = Part { rectangle: [DVec2::ZERO, DVec2::ONE], halvings: [0, 0], loops: Rc::new(parts) };
    cover.cover(whole, &mut LineCuts::new(cells.numbers_mut()))?;
    for (cell, vertices) in cover.cells {
        cells.push(cell, &vertices);
    }
    Ok(Covered { shell: cells, knot_boxes: cover.knot_boxes })
}

/// What has been done for a surface; its base patches are covered side by side.
#[derive(Default)]
struct Work {
    cells: AtomicUsize,
    rectangles: AtomicUsize,
    /// Rectangles smaller than [`KINK`] in which pieces differ by more than those of one cell may.
    kinks: AtomicUsize,
}

/// A base patch being covered.
struct Cover<'a> {
    work: &'a Work,
    base: Face,
    formula: Arc<Formula>,
    boundary_error: f64,
    size: f64,
    /// How far pieces of one cell may differ; none if each has a cell of its own.
    within: Option<f64>,
    memory: MemoryLimit,
    /// With the vertices of their corners.
    cells: Vec<(Face, Vec<u32>)>,
    knot_boxes: BTreeSet<(usize, Option<KnotBox>)>,
}

/// Degrees of a cell's patch, and the bound of its distance from the piece; or which side needs halving.
enum Fit {
    Degrees([usize; 2], f64),
    Halve(usize),
}

/// A part of a base patch that is still to be covered.
struct Part {
    rectangle: [DVec2; 2],
    /// How often each side has been halved.
    halvings: [u32; 2],
    /// What of the trim's loops is in it, and perhaps more of them.
    loops: Rc<Vec<LoopPart>>,
}

impl Cover<'_> {
    /// Covers a part. The parts that wait are on a list and not on the thread's stack, which bounds over 17 discs fill soon.
    fn cover(&mut self, whole: Part, cuts: &mut LineCuts<'_>) -> Result<(), CoverError> {
        let mut waiting = vec![whole];
        while let Some(part) = waiting.pop() {
            if let Some([first, second]) = self.split(&part, cuts)? {
                waiting.extend([second, first]);
            }
        }
        Ok(())
    }

    /// Makes cells of a part, or halves of it.
    fn split(&mut self, part: &Part, cuts: &mut LineCuts<'_>) -> Result<Option<[Part; 2]>, CoverError> {
        let &Part { rectangle, mut halvings, ref loops } = part;
        let parts: Vec<_> = loops.iter().filter_map(|part| part.clipped(rectangle, cuts)).collect();
        if parts.is_empty() {
            return Ok(None);
        }
        if self.cells.len() % CELLS_BETWEEN_CHECKS == CELLS_BETWEEN_CHECKS - 1 {
            self.memory.check("covering the surface by cells", self.cells.len() as u64 * CELL_BYTES)?;
        }
        let region = &local_region(&parts, rectangle);
        let discs = discs(rectangle);
        self.work.rectangles.fetch_add(1, Ordering::Relaxed);
        let mut axis = usize::from(halvings[1] < halvings[0]);
        let found = pieces(MOST_PIECES, |possible| self.formula.range(discs, possible));
        // far from its own border a piece may be steep, and rays would look there for nothing
        let small = |range: &[Disc; 3]| radius(range, 0) <= LARGEST_SHARED * self.size;
        let found = found.filter(|found| found.len() == 1 || found.iter().all(|(_, range)| small(range)));
        if let Some(found) = found {
            let mut fits = Vec::new();
            for (piece, range) in &found {
                match self.fit(range, axis) {
                    Fit::Degrees(degree, error) => fits.push((piece, degree, error)),
                    Fit::Halve(worse) => {
                        axis = worse;
                        break;
                    }
                }
            }
            let within = self.within.filter(|_| found.len() > 1 && !self.has_kinks());
            if let Some(within) = within.filter(|_| fits.len() == found.len()) {
                let most = found.iter().map(|(_, range)| radius(range, 0)).fold(0.0, f64::max);
                fits.retain(|(piece, ..)| self.occurs(piece, rectangle, SEARCH_HALVINGS));
                match merge(&self.formula, &fits, rectangle, (most, within)) {
                    Merge::Cell(cell, degree) => return self.push(cell, degree, region).map(|()| None),
                    Merge::Halve(longer) => axis = longer,
                }
                self.count_kinks(most);
            } else if fits.len() == found.len() {
                let mut leads = true;
                for (piece, degree, error) in fits {
                    if found.len() == 1 || self.occurs(piece, rectangle, SEARCH_HALVINGS) {
                        let [low, high] = rectangle;
                        let (formula, piece) = (self.formula.clone(), piece.clone());
                        self.push(
                            Cell { formula, low, size: high - low, piece, error, leads },
                            degree,
                            region,
                        )?;
                        leads = false;
                    }
                }
                return Ok(None);
            }
        }
        let [low, high] = rectangle;
        let middle = 0.5 * (low + high);
        let cells = self.work.cells.load(Ordering::Relaxed);
        if cells >= MAX_CELLS || self.work.rectangles.load(Ordering::Relaxed) >= MAX_RECTANGLES {
            let place = self.formula.place(middle);
            return Err(CoverError::TooMany { place });
        }
        if halvings[axis] == MAX_HALVINGS {
            axis = 1 - axis;
        }
        if halvings[axis] == MAX_HALVINGS {
            return self.push_point(rectangle, region).map(|()| None);
        }
        halvings[axis] += 1;
        let (mut first, mut second) = (high, low);
        (first[axis], second[axis]) = (middle[axis], middle[axis]);
        let loops = Rc::new(parts);
        let half = |rectangle| Part { rectangle, halvings, loops: loops.clone() };
        Ok(Some([[low, first], [second, high]].map(half)))
    }

    /// The least degrees that are accurate, by the discs from the second on of a piece's range.
    fn fit(&self, range: &[Disc; 3], alternate: usize) -> Fit {
        let radius = |disc: usize| radius(range, disc);
        let error = |axis: usize, degree: usize| {
            let along = REACHES.iter().enumerate();
            along
                .map(|(number, &reach)| {
                    radius(1 + axis * REACHES.len() + number) * interpolation_error(degree, reach)
                })
                .fold(f64::INFINITY, f64::min)
        };
        // pieces that may differ need not be fitted better than by a part of that
        let accuracy = (0.25 * ACCURACY * self.size).max(FIT * self.within.unwrap_or(0.0));
        let highest = if self.within.is_some() { MAX_WITHIN_DEGREE } else { MAX_CELL_DEGREE };
        let along_s = (1..=highest).find(|&degree| error(0, degree) <= accuracy);
        let along_t = (1..=highest).find(|&degree| error(1, degree) <= accuracy);
        match (along_s, along_t) {
            (Some(m), Some(n)) => {
                // all but the same degrees are evaluated faster if they are the same
                let [m, n] = if m.abs_diff(n) == 1 { [m.max(n); 2] } else { [m, n] };
                // in each of three coordinates
                let error = error(0, m) + lebesgue(m) * error(1, n);
                Fit::Degrees([m, n], 3_f64.sqrt() * error)
            }
            _ => {
                // the side along which it varies more, as far as it is analytic along either
                let along = |axis: usize, number: usize| radius(1 + axis * REACHES.len() + number);
                let known = (0..REACHES.len()).rev().map(|number| [along(0, number), along(1, number)]);
                let [s, t] = known.into_iter().find(|[s, t]| s.min(*t) < f64::INFINITY).unwrap_or([0.0; 2]);
                if s == t { Fit::Halve(alternate) } else { Fit::Halve(usize::from(t > s)) }
            }
        }
    }

    /// Whether the surface is taken to tear or to have kinks.
    fn has_kinks(&self) -> bool {
        self.work.kinks.load(Ordering::Relaxed) >= MOST_KINKS
    }

    /// Counts a rectangle of some radius in which pieces differ by too much.
    fn count_kinks(&self, radius: f64) {
        if radius < KINK * self.size {
            self.work.kinks.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Whether a piece may have a part in a rectangle.
    fn occurs(&self, piece: &Piece, [low, high]: [DVec2; 2], halvings: u32) -> bool {
        self.work.rectangles.fetch_add(1, Ordering::Relaxed);
        match overlap(&self.formula, piece, discs([low, high])) {
            Overlap::None => false,
            Overlap::Whole => true,
            Overlap::Partial if halvings == 0 => true,
            Overlap::Partial => {
                let middle = 0.5 * (low + high);
                let quarters = [
                    [low, middle],
                    [DVec2::new(middle.x, low.y), DVec2::new(high.x, middle.y)],
                    [DVec2::new(low.x, middle.y), DVec2::new(middle.x, high.y)],
                    [middle, high],
                ];
                quarters.into_iter().any(|quarter| self.occurs(piece, quarter, halvings - 1))
            }
        }
    }

    fn push(
        &mut self,
        cell: Cell,
        degree: [usize; 2],
        region: &(Region, Vec<u32>),
    ) -> Result<(), CoverError> {
        let point = |st: DVec2| {
            self.formula.position(cell.low + st * cell.size, &mut cell.piece.branch_list()).extend(1.0)
        };
        let Interpolant { control_points, residual } = interpolate(degree, point);
        let rounding = 3_f64.sqrt() * lebesgue(degree[0]) * lebesgue(degree[1]) * residual;
        self.add(cell, degree, (control_points, rounding), region)
    }

    /// Whether a point of a cell is outside the volume of a step.
    fn is_outside(&self, cell: &Cell, step: usize) -> bool {
        const STEPS: u32 = 8;
        let mut places = (0..=STEPS).flat_map(|i| (0..=STEPS).map(move |j| DVec2::new(i.into(), j.into())));
        places.any(|place| {
            let st = cell.low + cell.size * place / f64::from(STEPS);
            cell.formula.knot_boxes(&mut ByValue, st).contains(&(step, None))
        })
    }

    /// A rectangle that is as small as a point.
    fn push_point(&mut self, [low, high]: [DVec2; 2], region: &(Region, Vec<u32>)) -> Result<(), CoverError> {
        let middle = 0.5 * (low + high);
        let formula = self.formula.clone();
        let found = pieces(MOST_PIECES_AT_POINT, |possible| formula.range(discs([low, high]), possible));
        let found = found.ok_or_else(|| fault(&formula, middle))?;
        let holds = |(piece, _): &&(Piece, _)| formula.is_in(middle, piece);
        let piece = found.iter().find(holds).unwrap_or(&found[0]).0.without_borders();
        let radius = found.iter().map(|(_, range)| radius(range, 0)).fold(0.0, f64::max);
        if radius > POINT * self.size || !radius.is_finite() {
            return Err(fault(&formula, middle));
        }
        let cell =
            Cell { formula: formula.clone(), low, size: high - low, piece, error: 4.0 * radius, leads: true };
        let point = |st: DVec2| formula.position(cell.low + st * cell.size, &mut ByValue).extend(1.0);
        let corners = [DVec2::ZERO, DVec2::Y, DVec2::X, DVec2::ONE].map(point);
        if corners.iter().any(|corner| !corner.is_finite()) {
            return Err(fault(&formula, middle));
        }
        self.add(cell, [1, 1], (corners.to_vec(), 0.0), region)
    }

    fn add(
        &mut self,
        mut cell: Cell,
        degree: [usize; 2],
        (control_points, rounding): (Vec<DVec4>, f64),
        region: &(Region, Vec<u32>),
    ) -> Result<(), CoverError> {
        let most = magnitude::greatest(control_points.iter().map(|point| point.truncate()));
        if most > LARGEST {
            return Err(fault(&self.formula, cell.low + 0.5 * cell.size));
        }
        cell.error += rounding + self.formula.rounding(most);
        let middle = cell.low + 0.5 * cell.size;
        for (step, knot_box) in cell.formula.knot_boxes(&mut cell.piece.branch_list(), middle) {
            if knot_box.is_some() || !cell.piece.has_borders() || self.is_outside(&cell, step) {
                self.knot_boxes.insert((step, knot_box));
            }
        }
        let control_points = control_points.iter().map(|point| point.with_w(1.0)).collect();
        let patch = BezierPatch::new(degree, control_points);
        let chart = self.base.chart.restricted(cell.low, cell.low + cell.size);
        let exact = (self.boundary_error, Some(Arc::new(cell) as Arc<_>));
        let (region, vertices) = region.clone();
        self.work.cells.fetch_add(1, Ordering::Relaxed);
        self.cells.push((self.base.replaced(chart, patch, region, exact), vertices));
        Ok(())
    }
}

/// The greatest radius of three coordinates' discs of one number.
fn radius(range: &[Disc; 3], disc: usize) -> f64 {
    // so written, NaN is infinite
    let larger =
        |most: f64, radius: f64| if radius < f64::INFINITY { most.max(radius) } else { f64::INFINITY };
    range.iter().map(|x| x.reach()[disc]).fold(0.0, larger)
}

/// Discs about a rectangle: itself, then [`REACHES`] along s, then along t.
fn discs(of: [DVec2; 2]) -> [Disc; 2] {
    let mut scale = [[1.0; SIZES]; 2];
    for (number, reach) in REACHES.into_iter().enumerate() {
        scale[0][1 + number] = reach;
        scale[1][1 + REACHES.len() + number] = reach;
    }
    rectangle(of, scale)
}

const _: () = assert!(2 * REACHES.len() < SIZES);
