//! The search for the greatest distance.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::{DVec2, DVec3};
use rayon::iter::{IntoParallelIterator, IntoParallelRefIterator, ParallelExtend, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use super::flat::{Facet, FlatMesh, Neighbour};
use super::surface::{Place, Surface};
use super::triangle;
use super::{CERTAINTY, Deviation, DeviationError};
use crate::math::bounds;
use crate::math::polygon::clip_to_convex;
use crate::patch::Overlap;

/// Distances below this part of the size of all are rounding: of the surface's evaluation, and of parameters that are off by
/// [`super::surface`]'s tolerance in a knot plane.
const ROUNDING: f64 = 1e-13;

/// How far the areas of the surface and of what triangles stand for may differ, in parts of it: by what rounding leaves out.
const WHOLE: f64 = 1e-6;

/// Triangles that the first search for a great distance looks at closely.
const PROMISING: usize = 48;

/// Triangles whose distances it asks for at a time.
const BATCH: usize = 1024;

/// The same for the distances of triangles' points from the surface, which take longer, and how many at most.
const FLAT_BATCH: usize = 64;
const MOST_FLAT: usize = 4096;

/// Points along the sides of the sections that it looks at.
const CLOSELY: u32 = 24;

/// Cells of one triangle that are halved before the search gives up.
const MAX_SECTIONS: usize = 400_000;

/// After so many cells it is asked whether to stop.
const OFTEN: usize = 1024;

/// How large sections of flat triangles may be, in parts of the distance looked for, to be asked what of the whole surface is
/// nearest: for larger ones the answer says little.
const NEAR: f64 = 4.0;

/// A part of the surface and what of a flat triangle stands for it.
#[derive(Clone, Copy, Debug)]
struct Section {
    sheet: usize,
    corners: [Corner; 3],
}

#[derive(Clone, Copy, Debug)]
struct Corner {
    exact: Place,
    flat: DVec3,
}

/// A point and its distance from what is probably nearest.
#[derive(Clone, Copy, Debug, Default)]
struct Far {
    distance: f64,
    point: DVec3,
}

impl Far {
    fn add(&mut self, distance: f64, point: DVec3) {
        if distance > self.distance {
            *self = Self { distance, point };
        }
    }
}

/// What is known of one flat triangle.
#[derive(Clone, Copy, Debug, Default)]
struct Measured {
    /// The farthest of a few points of the surface from the triangle itself: another one may be nearer.
    surface: Far,
    /// The farthest of a few points of the triangle from the sheets it stands for.
    flat: Far,
    /// The integral of the distance, and of the angle in degrees, over the flat triangle; its area.
    distance: f64,
    angle: f64,
    area: f64,
    greatest_angle: f64,
    /// Area of the undeformed surface that the triangle stands for.
    rest_area: f64,
}

/// The greatest distance found, and what follows from it.
#[derive(Clone, Copy, Debug)]
struct Level {
    found: f64,
    rounding: f64,
}

impl Level {
    /// Cells without a greater distance than this need no closer look. What is added for rounding is no part of the certainty.
    fn enough(self) -> f64 {
        (self.found * (1.0 + 0.98 * CERTAINTY)).max(2.0 * self.rounding)
    }

    /// A distance becomes the greatest if it is above this: enough below the other that either is certain of any place.
    fn greater(self) -> f64 {
        (self.found * (1.0 + 0.4 * CERTAINTY)).max(self.rounding)
    }
}

/// The outcome of a search in one triangle.
#[derive(Clone, Copy, Debug)]
struct Outcome {
    /// The greatest distance known.
    level: Level,
    /// If the search was given up: no distance is greater than this.
    bound: f64,
}

pub(super) struct Search<'a> {
    surface: &'a Surface<'a>,
    mesh: &'a FlatMesh,
    cancel: &'a AtomicBool,
    /// Distances below this are rounding.
    rounding: f64,
}

impl<'a> Search<'a> {
    pub(super) fn new(surface: &'a Surface<'a>, mesh: &'a FlatMesh, cancel: &'a AtomicBool) -> Self {
        let [low, high] = bounds::around(mesh.facets.iter().flat_map(|facet| facet.corners));
        // without triangles there is nothing to round
        let size = if low.cmple(high).all() {
            (high - low).length() + low.abs().max(high.abs()).length()
        } else {
            0.0
        };
        Self { surface, mesh, cancel, rounding: ROUNDING * size + 2.0 * surface.error }
    }

    pub(super) fn deviation(&self) -> Result<Deviation, DeviationError> {
        let count = self.mesh.facets.len();
        let measured: Vec<Measured> = (0..count).into_par_iter().map(|index| self.measure(index)).collect();
        self.check_cancel()?;
        let covered: f64 = measured.iter().map(|measured| measured.rest_area).sum();
        let whole = self.surface.rest_area();
        let off = (covered - whole).abs();
        if off.is_nan() || off > WHOLE * whole {
            return Err(DeviationError::NotWhole { share: covered / whole });
        }
        let mut level = Level { found: self.first_distance(&measured), rounding: self.rounding };
        let outcomes: Vec<Outcome> =
            (0..count).into_par_iter().map(|index| self.search(index, level)).collect();
        self.check_cancel()?;
        level.found = outcomes.iter().map(|outcome| outcome.level.found).fold(level.found, f64::max);
        let bound = outcomes.iter().map(|outcome| outcome.bound).fold(level.enough(), f64::max);
        if bound > level.enough() {
            return Err(DeviationError::Uncertain { found: level.found, bound });
        }
        Ok(finished(&measured, level.found, bound + self.rounding))
    }

    fn check_cancel(&self) -> Result<(), DeviationError> {
        if self.cancel.load(Ordering::Relaxed) { Err(DeviationError::Interrupted) } else { Ok(()) }
    }

    /// The sections of a flat triangle, its part over each leading sheet as triangles, and their share of it.
    fn sections(&self, index: usize) -> (Vec<Section>, f64) {
        let facet = &self.mesh.facets[index];
        let mut sections = Vec::with_capacity(4);
        let mut covered = 0.0;
        for (sheet, [a, b, c]) in self.surface.sheets_under(facet.face, facet.rest) {
            let whole = (b - a).perp_dot(c - a);
            let weights = |st: DVec2| {
                let [of_b, of_c] = [(st - a).perp_dot(c - a) / whole, (b - a).perp_dot(st - a) / whole];
                (1.0 - of_b - of_c, of_b, of_c)
            };
            let part = clip_to_convex(&[a, b, c], self.surface.sheets[sheet].corners);
            let corner = |st: DVec2| {
                let (u, v, w) = weights(st);
                let [p, q, r] = facet.corners;
                Corner { exact: self.surface.sheets[sheet].place(st), flat: u * p + v * q + w * r }
            };
            let corners: Vec<_> = part.into_iter().map(corner).collect();
            for i in 1..corners.len().max(2) - 1 {
                let corners = [corners[0], corners[i], corners[i + 1]];
                let [p, q, r] = corners.map(|corner| corner.exact.st);
                let share = ((q - p).perp_dot(r - p) / whole).abs();
                // of what rounding leaves on a border
                if share > 1e-12 {
                    covered += share;
                    sections.push(Section { sheet, corners });
                }
            }
        }
        (sections, covered)
    }

    fn measure(&self, index: usize) -> Measured {
        let facet = &self.mesh.facets[index];
        let (sections, covered) = self.sections(index);
        let [a, b, c] = facet.rest;
        let rest_area = covered * 0.5 * (b - a).cross(c - a).length();
        let mut measured = Measured { rest_area, ..Measured::default() };
        for Section { sheet, corners } in sections {
            let [p, q, r] = corners.map(|corner| corner.flat);
            let area = 0.5 * (q - p).cross(r - p).length();
            let middles = [0, 1, 2].map(|i| 0.5 * (corners[i].exact.st + corners[(i + 1) % 3].exact.st));
            let centre = (corners[0].exact.st + corners[1].exact.st + corners[2].exact.st) / 3.0;
            let index = self.surface.holder(sheet, centre).unwrap_or(sheet);
            let sheet = &self.surface.sheets[index];
            let flat = (p + q + r) / 3.0;
            measured.flat.add(sheet.foot(flat, centre).position.distance(flat), flat);
            let mut placed = |st: DVec2| {
                let holder = self.surface.holder(index, st);
                let place = self.surface.sheets[holder.unwrap_or(index)].place(st).position;
                if holder.is_some() {
                    measured.surface.add(facet.distance(place), place);
                }
                place
            };
            placed(centre);
            let heights = middles.map(|st| facet.height(placed(st)).abs());
            measured.distance += area * heights.iter().sum::<f64>() / 3.0;
            measured.area += area;
            let angle = |st: DVec2| {
                let normal = sheet.normal(st);
                libm::atan2(normal.cross(facet.normal).length(), normal.dot(facet.normal)).to_degrees()
            };
            let at_centre = angle(centre);
            measured.angle += area * at_centre;
            let at_corners = corners.map(|corner| angle(corner.exact.st));
            measured.greatest_angle =
                at_corners.into_iter().chain([at_centre]).fold(measured.greatest_angle, f64::max);
        }
        measured
    }

    /// A great distance, found by looking closely where it is likely.
    fn first_distance(&self, measured: &[Measured]) -> f64 {
        let mut known: Vec<(f64, usize)> = Vec::new();
        let mut found = 0.0;
        for part in farthest_first(measured, |measured| measured.surface).chunks(BATCH) {
            if part[0].1.distance <= found {
                break;
            }
            let distance =
                |&(index, far): &(usize, Far)| (self.mesh.nearest(far.point, far.distance).0, index);
            let first = known.len();
            known.par_extend(part.par_iter().map(distance));
            found = known[first..].iter().map(|(distance, _)| *distance).fold(found, f64::max);
        }
        known.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        known.truncate(PROMISING);
        found = known.par_iter().map(|&(_, index)| self.look_closely(index)).reduce(|| found, f64::max);
        // the same of points of the triangles
        let mut order = farthest_first(measured, |measured| measured.flat);
        order.truncate(MOST_FLAT);
        for part in order.chunks(FLAT_BATCH) {
            if part[0].1.distance <= found {
                break;
            }
            let distance = |(_, far): &(usize, Far)| {
                let ([least, _], _) = self.surface.distance(far.point, far.distance, found);
                least - self.rounding
            };
            found = part.par_iter().map(distance).reduce(|| found, f64::max);
        }
        found
    }

    /// The greatest distance of many points of a triangle's part of the surface.
    fn look_closely(&self, index: usize) -> f64 {
        let facet = &self.mesh.facets[index];
        let mut farthest = 0.0;
        for Section { sheet, corners } in self.sections(index).0 {
            let [a, b, c] = corners.map(|corner| corner.exact.st);
            for i in 0..=CLOSELY {
                for j in 0..=CLOSELY - i {
                    let [v, w] = [i, j].map(|k| f64::from(k) / f64::from(CLOSELY));
                    let st = (1.0 - v - w) * a + v * b + w * c;
                    let Some(holder) = self.surface.holder(sheet, st) else { continue };
                    let position = self.surface.sheets[holder].place(st).position;
                    let distance = facet.distance(position);
                    if distance > farthest {
                        farthest = self.mesh.nearest(position, distance).0.max(farthest);
                    }
                }
            }
        }
        farthest
    }

    /// The greatest distance of a triangle's part of the surface, and of the triangle itself, if it is above the one known.
    fn search(&self, index: usize, level: Level) -> Outcome {
        let (sections, _) = self.sections(index);
        let outcome = self.search_surface(index, &sections, level);
        self.search_triangle(sections, outcome)
    }

    /// The same for parts of the surface alone, which are likely near to a flat triangle.
    fn search_surface(&self, index: usize, sections: &[Section], level: Level) -> Outcome {
        let facet = &self.mesh.facets[index];
        let mut open: Vec<_> = sections.iter().flat_map(|section| self.on_siblings(section)).collect();
        let mut outcome = Outcome { level, bound: 0.0 };
        if self.cancel.load(Ordering::Relaxed) {
            return outcome;
        }
        let mut neighbours = None;
        let mut looked_at = 0;
        while let Some(section) = open.pop() {
            looked_at += 1;
            if looked_at % OFTEN == 0 && self.cancel.load(Ordering::Relaxed) {
                return outcome;
            }
            let enough = outcome.level.enough();
            let points = section.corners.map(|corner| corner.exact.position);
            let bend = self.surface.sheets[section.sheet].bend(section.corners.map(|corner| corner.exact.st));
            let apart = greatest(points.map(|point| facet.distance(point)));
            if apart + bend <= enough {
                continue;
            }
            let sheet = &self.surface.sheets[section.sheet];
            if sheet.overlap(section.corners.map(|corner| corner.exact.st)) == Overlap::None {
                continue;
            }
            let beside = neighbours.get_or_insert_with(|| self.mesh.neighbours(index));
            if beside_bound(beside, facet, points, bend) <= enough {
                continue;
            }
            let middle = self.middle(&section);
            let from_own = facet.distance(middle.exact.position);
            if from_own > outcome.level.greater() {
                let (distance, nearest) = self.mesh.nearest(middle.exact.position, from_own);
                if distance > outcome.level.greater() && sheet.holds(middle.exact.st) {
                    outcome.level.found = distance;
                }
                let enough = outcome.level.enough();
                let extent = greatest(points.map(|p| p.distance(middle.exact.position)));
                if distance + extent + bend <= enough {
                    continue;
                }
                // another triangle, or it and one beside it, may be nearer to the whole section
                if let Some(nearest) = nearest {
                    let other = &self.mesh.facets[nearest];
                    let apart = greatest(points.map(|point| other.distance(point)));
                    let beside = || beside_bound(&self.mesh.neighbours(nearest), other, points, bend);
                    if apart + bend <= enough || beside() <= enough {
                        continue;
                    }
                }
            }
            if looked_at > MAX_SECTIONS {
                outcome.bound = outcome.bound.max(apart + bend);
                continue;
            }
            open.extend(self.quarters(&section));
        }
        outcome
    }

    /// A section on all sheets over its loop.
    fn on_siblings(&self, section: &Section) -> impl Iterator<Item = Section> {
        let corners = section.corners;
        self.surface.siblings(section.sheet).map(move |sheet| {
            let place = |corner: Corner| Corner {
                exact: self.surface.sheets[sheet].place(corner.exact.st),
                ..corner
            };
            Section { sheet, corners: corners.map(place) }
        })
    }

    /// The same for the flat triangle alone, given its sections.
    fn search_triangle(&self, mut open: Vec<Section>, mut outcome: Outcome) -> Outcome {
        let mut looked_at = 0;
        while let Some(section) = open.pop() {
            looked_at += 1;
            if looked_at % OFTEN == 0 && self.cancel.load(Ordering::Relaxed) {
                return outcome;
            }
            let enough = outcome.level.enough();
            let middle = self.middle(&section);
            let own = self.surface.holder(section.sheet, middle.exact.st).unwrap_or(section.sheet);
            if self.feet_bound(&section, own) <= enough {
                continue;
            }
            let sheet = &self.surface.sheets[own];
            let foot = sheet.free_foot(middle.flat, middle.exact.st);
            let elsewhere =
                (sheet.clamped(foot) != foot).then(|| self.surface.sheet_at(sheet.rest(foot), own)).flatten();
            if elsewhere.is_some_and(|other| self.feet_bound(&section, other) <= enough) {
                continue;
            }
            let extent = greatest(section.corners.map(|corner| corner.flat.distance(middle.flat)));
            if extent <= NEAR * enough {
                let own = self.own_distance(&section, &middle);
                let ([least, most], nearest) = self.surface.distance(middle.flat, own, enough - extent);
                if nearest.is_some_and(|other| self.feet_bound(&section, other) <= enough) {
                    continue;
                }
                if least - self.rounding > outcome.level.greater() {
                    outcome.level.found = least - self.rounding;
                }
                if most + extent <= outcome.level.enough() {
                    continue;
                }
                if looked_at > MAX_SECTIONS {
                    outcome.bound = outcome.bound.max(most + extent);
                    continue;
                }
            }
            open.extend(self.quarters(&section));
        }
        outcome
    }

    /// Distance of the middle of a section's flat triangle from a point of the sheets over its loop; infinity if none of
    /// their nearest points is inside its curved borders.
    fn own_distance(&self, section: &Section, middle: &Corner) -> f64 {
        let distance = |index: usize| {
            let sheet = &self.surface.sheets[index];
            let foot = sheet.foot(middle.flat, middle.exact.st);
            sheet.holds(foot.st).then(|| foot.position.distance(middle.flat))
        };
        self.surface.siblings(section.sheet).filter_map(distance).fold(f64::INFINITY, f64::min)
    }

    /// Bound of the distance of a section's flat points from the sheets over one loop: of its corners from their feet on one
    /// sheet, and how that bends between these. Where curved borders cross the triangle of the feet, every place of it
    /// is in one of the sheets there, so the greatest of their bounds holds.
    fn feet_bound(&self, section: &Section, index: usize) -> f64 {
        let sheet = &self.surface.sheets[index];
        let own = &self.surface.sheets[section.sheet];
        let start = |corner: &Corner| {
            if index == section.sheet { corner.exact.st } else { sheet.parameters(own.rest(corner.exact.st)) }
        };
        let feet = section.corners.map(|corner| sheet.foot(corner.flat, start(&corner)).st);
        let bound = |index: usize| {
            let sheet = &self.surface.sheets[index];
            if sheet.overlap(feet) == Overlap::None {
                return 0.0;
            }
            let distance = |i: usize| sheet.place(feet[i]).position.distance(section.corners[i].flat);
            greatest([0, 1, 2].map(distance)) + sheet.bend(feet)
        };
        self.surface.siblings(index).map(bound).fold(0.0, f64::max)
    }

    fn middle(&self, section: &Section) -> Corner {
        let [a, b, c] = section.corners;
        let st = (a.exact.st + b.exact.st + c.exact.st) / 3.0;
        Corner { exact: self.surface.sheets[section.sheet].place(st), flat: (a.flat + b.flat + c.flat) / 3.0 }
    }

    fn quarters(&self, section: &Section) -> [Section; 4] {
        let sheet = &self.surface.sheets[section.sheet];
        let half = |p: Corner, q: Corner| Corner {
            exact: sheet.place(0.5 * (p.exact.st + q.exact.st)),
            flat: 0.5 * (p.flat + q.flat),
        };
        triangle::quarters(section.corners, half).map(|corners| Section { sheet: section.sheet, corners })
    }
}

/// All triangles' farthest points with the triangles' indices, the farthest first.
fn farthest_first(measured: &[Measured], of: fn(&Measured) -> Far) -> Vec<(usize, Far)> {
    let mut order: Vec<_> = measured.iter().map(of).enumerate().collect();
    order.par_sort_unstable_by(|(i, a), (j, b)| b.distance.total_cmp(&a.distance).then(i.cmp(j)));
    order
}

fn greatest(distances: [f64; 3]) -> f64 {
    distances.into_iter().fold(0.0, f64::max)
}

/// The least bound by one of the neighbours.
fn beside_bound(neighbours: &[Option<Neighbour>; 3], facet: &Facet, points: [DVec3; 3], bend: f64) -> f64 {
    let bounds = (0..).zip(neighbours).filter_map(|(edge, neighbour)| {
        neighbour.as_ref().map(|neighbour| neighbour.bound(facet, edge, points, bend))
    });
    bounds.fold(f64::INFINITY, f64::min)
}

fn finished(measured: &[Measured], max: f64, bound: f64) -> Deviation {
    let sum = |of: fn(&Measured) -> f64| measured.iter().map(of).sum::<f64>();
    let area = sum(|measured| measured.area).max(f64::MIN_POSITIVE);
    Deviation {
        max,
        bound,
        mean: sum(|measured| measured.distance) / area,
        normal_max_degrees: measured.iter().map(|measured| measured.greatest_angle).fold(0.0, f64::max),
        normal_mean_degrees: sum(|measured| measured.angle) / area,
    }
}
