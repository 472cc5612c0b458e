//! Leaves: parts of patches small enough that a ray's hits with them are isolated without looking at the patch.
//!
//! A leaf is a sub-rectangle of a patch with an affine map of space after which its surface is (u + f, v + g, h) over
//! -1 <= u, v <= 1, with small f, g and h, each a quadratic form of (u, v) and a bounded rest. The bounds hold on a
//! rectangle [`DOMAIN`](super::net::DOMAIN) times as large, so that a root just outside the leaf is known to be the one that was isolated.

use glam::{DMat3, DVec2, DVec3};

use crate::math::polygon::{self, Side};
use crate::patch::{Face, Overlap, Region};

use super::height_graph::{HeightGraph, hull, quadratic_range};
use super::local::LocalSpace;
use super::single_precision::{down, nearest, up};

/// Slope bound of f, g and h below which a rectangle is not split further.
///
/// The bounds on how far the ray's height above the surface is from a quadratic, and on how far its slope is, fall with
/// the square of the slopes. On a twisted cube of degree 2 × 2 × 2, 0.12 makes 2,992 leaves and 0.2 makes 384.
const SLOPE: f64 = 0.17;

/// Most halvings of a rectangle: a patch with a cusp or a collapsed edge would be split for ever.
const MAX_HALVINGS: u32 = 10;

/// Corners of the trim's loops above which a rectangle is halved whatever its slopes, for every ray in it asks all of them: plane
/// meshes of a million faces are one patch. So often at most.
const MANY_CORNERS: usize = 1024;
const MAX_TRIM_HALVINGS: u32 = 24;

/// Leaves that any patch may have, and the halvings that make so many.
const FEW: usize = 1 << FEW_HALVINGS;
const FEW_HALVINGS: u32 = 2;

/// Leaves that the patches of a scene together may have beyond [`FEW`] for each. Those that come after stay coarse: rays are given
/// to clipping more often, which is slower and finds the same. No shipped scene has all of it; a surface of thousands of
/// cells that all were divided as often as they may be would have millions.
const MAX_MORE: usize = 1 << 15;

/// Most that the tolerance of the trim's borders grows to, for rays that are all but tangent: a tangent root is off by the
/// square root of the error across the ray. In local units, in which scenes have a size near 1.
pub(crate) const TANGENT_TOLERANCE: f64 = 1.5e-8;

/// Half the least extent of a leaf, in local units, where its patch goes on: one around a sliver of a patch is wider than the
/// sliver, so that its surface is known well in single precision.
const LEAST_HALF: f64 = 1.0 / 262_144.0;

/// How far outside the unit square clipping looks at most: where patches are smaller than tolerances, roots there are noise.
const OUTSIDE: f64 = 0.25;

/// The line of an edge from which the loop's own corners are farther on the wrong side, in the leaf's (u, v), cuts nothing: it is
/// one of a few roundings' length between edges that are all but parallel to it.
const MOST_BENT: f64 = 0.01;

/// Local coordinates of all surfaces are within 0.5 of 0; so far from it there is nothing to hit.
const SCENE: f64 = 2.0;

/// Leaves overlap by this part of their size, so that a hit on their common border is in at least one.
const OVERLAP: f64 = 1e-12;

/// Rounding of a [`Cut`]'s value in the leaf's domain: three products and sums of terms below 2, in single precision.
const CUT_ROUNDING: f64 = 8.0 * f32::EPSILON as f64;

/// The loops of the trim that matter in a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cover {
    /// The leaf is inside this loop.
    Inside(u32),
    /// Borders cross the leaf; they are a range of the list of all leaves' cuts.
    Crossed { start: u32, end: u32 },
}

/// The line of a trim's edge in a leaf; those of one loop follow one another. One with a normal of 0 says that only the exact
/// surface can tell what is inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cut {
    /// The loop's side is where normal · (u, v) + offset >= 0; the absolute values of the normal sum to 1.
    pub(crate) normal: [f32; 2],
    pub(crate) offset: f32,
    /// Index of the loop in its patch.
    pub(crate) trim_loop: u32,
}

/// A part of a patch, ready for rays.
///
/// In single precision, for caches' sake: the affine map and the quadratic forms are what they are after rounding, and
/// the bounds are made for them so and rounded up.
#[derive(Clone, Debug)]
pub(crate) struct Leaf {
    /// Rows of the linear map from local to leaf coordinates, and the local point that it makes the origin.
    pub(crate) to_leaf: [[f32; 3]; 3],
    pub(crate) centre: [f32; 3],
    /// Bounds of the trimmed surface in leaf coordinates.
    pub(crate) low: [f32; 3],
    pub(crate) high: [f32; 3],
    /// Coefficients of u², u v and v² in f, g and h.
    pub(crate) forms: [[f32; 3]; 3],
    /// Coefficients of x³, x² y, x y², y³ in the height of the surface above (x, y).
    pub(crate) cubic: [f32; 4],
    /// Bound on the difference between that height and the sum of h's quadratic form and the cubic one.
    pub(crate) height_error: f32,
    /// The same of their slopes along x and y.
    pub(crate) slope_error: [f32; 2],
    /// Bound on the difference between (u, v) and (x, y) less the forms of f and g at (x, y).
    pub(crate) place_error: f32,
    /// Roots with |u| and |v| up to this are isolated by the bounds.
    pub(crate) domain: f32,
    /// 1 and the greatest slope of f and g: how far (u, v) moves with (x, y).
    pub(crate) stretch: f32,
    /// Rounding of leaf coordinates for each unit of rounding in local ones.
    pub(crate) steepness: f32,
    /// Within this of a cut or a side of the rectangle, (u, v) in single precision decides nothing; farther than this
    /// outside there is no hit, rounding included but for that of the ray.
    pub(crate) border: f32,
    /// The middle of the rectangle in the patch's unit square and half its sides.
    pub(crate) middle: [f64; 2],
    pub(crate) half: [f64; 2],
    /// Index of the patch in its object.
    pub(crate) patch: u32,
    /// Index of its object in the scene.
    pub(crate) object: u32,
    pub(crate) cover: Cover,
}

/// The cuts of each loop.
#[inline(always)]
pub(crate) fn by_loop(cuts: &[Cut]) -> impl Iterator<Item = &[Cut]> + Clone {
    cuts.chunk_by(|a, b| a.trim_loop == b.trim_loop)
}

impl Leaf {
    /// Whether the bounds prove anything; without them every ray is given to clipping.
    pub(crate) fn is_proven(&self) -> bool {
        self.height_error.is_finite()
    }

    /// Lowest and highest corner in the patch's unit square.
    pub(crate) fn rectangle(&self) -> [DVec2; 2] {
        let (middle, half) = (DVec2::from_array(self.middle), DVec2::from_array(self.half));
        let reach = half * (1.0 + f64::from(self.border));
        let least = DVec2::splat(-OUTSIDE);
        [(middle - reach).max(least), (middle + reach).min(1.0 - least)]
    }
}

/// What leaves of all patches are collected into.
#[derive(Debug, Default)]
pub(crate) struct Leaves {
    pub(crate) leaves: Vec<Leaf>,
    pub(crate) cuts: Vec<Cut>,
    /// Boxes of the leaves in local coordinates.
    pub(crate) boxes: Vec<[DVec3; 2]>,
    /// Leaves above [`FEW`] of a patch so far.
    more: usize,
}

/// A patch being split into leaves.
struct Splitter<'a> {
    indices: [u32; 2],
    trimmed: &'a Face,
    space: &'a LocalSpace,
    /// Bound on the error of the surface and its border, in local units.
    error: f64,
    into: &'a mut Leaves,
}

/// A rectangle with its surface in leaf coordinates.
struct Candidate {
    low: DVec2,
    high: DVec2,
    /// The part of the unit square that no other rectangle has a part of.
    cell: [DVec2; 2],
    /// What of each loop is in the rectangle.
    inside: Vec<(u32, Vec<DVec2>)>,
    /// With what is inside borders that are curves.
    overlap: Overlap,
    graph: HeightGraph,
}

impl Leaves {
    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.leaves.len()
    }

    /// Memory in bytes.
    pub(crate) fn bytes(&self) -> u64 {
        let Self { leaves, cuts, boxes, .. } = self;
        (size_of_val(&**leaves) + size_of_val(&**cuts) + size_of_val(&**boxes)) as u64
    }

    /// Splits a patch into leaves; `indices` are those of its object and of itself. `error` bounds the rounding of the surface and of its border in the world.
    pub(crate) fn add(&mut self, indices: [u32; 2], trimmed: &Face, error: f64, space: &LocalSpace) {
        let mut splitter = Splitter { indices, trimmed, space, error: space.length(error), into: self };
        let all = (0..)
            .zip(trimmed.region.loops())
            .map(|(i, l)| (i, trimmed.region.corners(&l).to_vec()))
            .collect();
        let before = splitter.into.leaves.len();
        if let Some(candidate) = splitter.candidate(all, [DVec2::ZERO, DVec2::ONE]) {
            splitter.split(candidate, 0);
        }
        self.more += (self.leaves.len() - before).saturating_sub(FEW);
    }
}

impl Splitter<'_> {
    /// The rectangle around the parts of loops in a cell; `None` if there are none, or none inside borders that are curves.
    fn candidate(&self, inside: Vec<(u32, Vec<DVec2>)>, cell: [DVec2; 2]) -> Option<Candidate> {
        let tight = polygon::bounds(inside.iter().flat_map(|(_, corners)| corners.iter().copied()))?;
        let [low, high] = self.widened(tight, cell);
        let overlap = self.trimmed.overlap(low, high);
        if overlap == Overlap::None {
            return None;
        }
        let graph = HeightGraph::new(&self.trimmed.patch, [low, high], self.space);
        Some(Candidate { low, high, cell, inside, overlap, graph })
    }

    /// A rectangle with sides of [`LEAST_HALF`] at least, as far as the cell goes.
    fn widened(&self, [low, high]: [DVec2; 2], cell: [DVec2; 2]) -> [DVec2; 2] {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        if half.cmpge(0.5 * (cell[1] - cell[0])).all() {
            return [low, high];
        }
        let point = self.trimmed.patch.eval(middle);
        let per_half = DVec2::new(point.dp_ds.length(), point.dp_dt.length()) * self.space.length(1.0);
        // a partial of 0 or NaN widens nothing
        let short = (half * per_half).cmplt(DVec2::splat(LEAST_HALF)) & per_half.cmpgt(DVec2::ZERO);
        let wide = DVec2::splat(LEAST_HALF) / per_half;
        let low = DVec2::select(short, cell[0].max(middle - wide), low);
        [low, DVec2::select(short, cell[1].min(middle + wide), high)]
    }

    fn split(&mut self, candidate: Candidate, halvings: u32) {
        let size = candidate.high - candidate.low;
        let most = if self.into.more < MAX_MORE { MAX_HALVINGS } else { FEW_HALVINGS };
        let splittable = halvings < most && size.min_element() > 0.0;
        let corners: usize = candidate.inside.iter().map(|(_, corners)| corners.len()).sum();
        if corners > MANY_CORNERS && halvings < MAX_TRIM_HALVINGS && size.min_element() > 0.0 {
            for half in self.halves(&candidate, usize::from(size.y > size.x)) {
                self.split(half, halvings + 1);
            }
            return;
        }
        if candidate.graph.steepest() > SLOPE && splittable {
            if most == FEW_HALVINGS {
                // the longer side, without a look at what the other would give
                for half in self.halves(&candidate, usize::from(size.y > size.x)) {
                    self.split(half, halvings + 1);
                }
                return;
            }
            let [by_s, by_t] = [0, 1].map(|axis| self.halves(&candidate, axis));
            // the sum, not the greatest: often one half keeps the slopes of the whole
            let cost = |halves: &[Candidate]| halves.iter().map(|c| c.graph.steepest()).sum::<f64>();
            let halves = if cost(&by_s) <= cost(&by_t) { by_s } else { by_t };
            for half in halves {
                self.split(half, halvings + 1);
            }
            return;
        }
        self.push(&candidate);
    }

    fn halves(&self, candidate: &Candidate, axis: usize) -> Vec<Candidate> {
        let middle = 0.5 * (candidate.low[axis] + candidate.high[axis]);
        let mut kept = Vec::new();
        let half = |side| {
            let mut inside = Vec::new();
            for (index, corners) in &candidate.inside {
                polygon::clip(corners, axis, middle, side, &mut kept);
                if kept.len() >= 3 {
                    inside.push((*index, kept.clone()));
                }
            }
            let mut cell = candidate.cell;
            match side {
                Side::Below => cell[1][axis] = middle,
                Side::Above => cell[0][axis] = middle,
            }
            self.candidate(inside, cell)
        };
        [Side::Below, Side::Above].into_iter().filter_map(half).collect()
    }

    fn push(&mut self, candidate: &Candidate) {
        let Candidate { low, high, graph, inside, .. } = candidate;
        let (middle, half) = (0.5 * (*low + *high), 0.5 * (*high - *low));
        let steepness = (0..3).map(|row| graph.to_leaf.row(row).length()).fold(0.0, f64::max);
        // across a ray that a proof is made for, an error moves the hit by twice its length in leaf coordinates at most
        let slack = OVERLAP + 8.0 * self.error * steepness;
        let smallest = half.min_element().max(f64::MIN_POSITIVE);
        let (cover, bent) = self.cover(candidate);
        let border =
            CUT_ROUNDING + 2.0 * TANGENT_TOLERANCE * steepness + 8.0 * f64::EPSILON / smallest + bent;
        let corners = inside.iter().flat_map(|(_, corners)| corners).map(|&st| (st - middle) / half);
        let (reach, world) = self.reach(candidate, corners, slack + border);
        self.into.leaves.push(Leaf {
            to_leaf: [0, 1, 2].map(|row| single(graph.to_leaf.row(row))),
            centre: single(graph.centre),
            low: [0, 1, 2].map(|axis| down(reach[0][axis])),
            high: [0, 1, 2].map(|axis| up(reach[1][axis])),
            forms: graph.forms,
            cubic: graph.cubic,
            height_error: up(graph.height_error + 4.0 * slack),
            slope_error: graph.slope_error.to_array().map(|error| up(error + 4.0 * slack)),
            place_error: up(graph.place_error + 4.0 * slack),
            domain: down(graph.domain),
            stretch: up(graph.stretch),
            steepness: up(steepness),
            border: up(border),
            middle: middle.to_array(),
            half: half.to_array(),
            object: self.indices[0],
            patch: self.indices[1],
            cover,
        });
        let world = if is_inside(world, 1.0) { world } else { self.hull_box(candidate) };
        self.into.boxes.push(inside_scene(world, self.into.leaves.len()));
    }

    /// The box of the control points, in local coordinates.
    fn hull_box(&self, candidate: &Candidate) -> [DVec3; 2] {
        let [low, high] = hull(&self.trimmed.patch, [candidate.low, candidate.high], self.space);
        let pad = self.pad() * (1.0 + (high - low).length());
        [low - pad, high + pad]
    }

    /// How far boxes reach beyond the surface.
    fn pad(&self) -> f64 {
        8.0 * self.error + 4.0 * OVERLAP + 2.0 * TANGENT_TOLERANCE
    }

    /// Bounds of the surface over the trim's parts, whose corners are given in (u, v): in leaf coordinates and in local
    /// ones.
    fn reach(
        &self,
        candidate: &Candidate,
        corners: impl Iterator<Item = DVec2>,
        slack: f64,
    ) -> ([DVec3; 2], [DVec3; 2]) {
        let graph = &candidate.graph;
        let pad = self.pad();
        if !graph.is_proven() {
            let hull = self.hull_box(candidate);
            return (graph.reach_of_box(hull), hull);
        }
        let ranges = [0, 1, 2].map(|part| quadratic_range(graph.forms[part]).map(f64::from));
        let least = DVec3::from_array(ranges.map(|range| range[0])) - graph.rest - 4.0 * slack;
        let greatest = DVec3::from_array(ranges.map(|range| range[1])) + graph.rest + 4.0 * slack;
        let from_leaf = graph.to_leaf.inverse();
        let empty = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let (mut leaf, mut local) = (empty, empty);
        for corner in corners {
            let flat = corner.extend(0.0);
            leaf = [leaf[0].min(flat), leaf[1].max(flat)];
            let flat = from_leaf * flat;
            local = [local[0].min(flat), local[1].max(flat)];
        }
        let leaf = [leaf[0] + least, leaf[1] + greatest];
        // the box of the image of a box
        let (middle, half) = (0.5 * (least + greatest), 0.5 * (greatest - least));
        let spread = DMat3::from_cols(from_leaf.x_axis.abs(), from_leaf.y_axis.abs(), from_leaf.z_axis.abs());
        let (middle, half) = (graph.centre + from_leaf * middle, spread * half + pad);
        (leaf, [local[0] + middle - half, local[1] + middle + half])
    }

    /// Which loops matter, and how far corners of them are on the wrong side of the lines of their edges.
    fn cover(&mut self, candidate: &Candidate) -> (Cover, f64) {
        let Candidate { low, high, inside, overlap, .. } = candidate;
        let trim: &Region = &self.trimmed.region;
        let all = &mut self.into.cuts;
        let count = |cuts: &Vec<Cut>| u32::try_from(cuts.len()).expect("fewer than 2^32 cuts fit in memory");
        let start = count(all);
        let mut bent: f64 = 0.0;
        for (index, part) in inside {
            let before = all.len();
            let corners = trim.corners(&trim.trim_loop(*index as usize));
            for (cut, wrong) in cuts((corners, part), [*low, *high], *index) {
                if wrong <= MOST_BENT {
                    bent = bent.max(wrong);
                    all.push(cut);
                }
            }
            if *overlap == Overlap::Partial {
                all.push(Cut { normal: [0.0; 2], offset: 0.0, trim_loop: *index });
            } else if all.len() == before {
                all.truncate(start as usize);
                return (Cover::Inside(*index), 0.0);
            }
        }
        (Cover::Crossed { start, end: count(all) }, bent)
    }
}

/// Whether a box is no farther from 0 than `most`.
fn is_inside([low, high]: [DVec3; 2], most: f64) -> bool {
    // so written, NaN is not
    low.cmpge(DVec3::splat(-most)).all() && high.cmple(DVec3::splat(most)).all()
}

/// A box, or all of the scene instead of one that is larger: bounds of a patch of extreme weights may be beyond single precision, in
/// which the tree has its boxes. No two such are the same, for the builder of the tree takes a step for each box that is as
/// good as all others.
#[expect(clippy::cast_precision_loss, reason = "any number will do")]
fn inside_scene(found: [DVec3; 2], number: usize) -> [DVec3; 2] {
    if is_inside(found, SCENE) {
        return found;
    }
    // the fractional parts of multiples of irrational numbers are spread evenly
    let spread = |factor: f64| (number as f64 * factor).fract();
    let more = |a: f64, b: f64, c: f64| SCENE + DVec3::new(spread(a), spread(b), spread(c));
    [-more(0.618_034, 0.414_214, 0.732_051), more(0.236_068, 0.645_751, 0.316_625)]
}

/// Corners of a loop's part, at least, that are tried against the line of each edge.
const TRIED_CORNERS: usize = 64;

/// The edges of a loop that cross a rectangle, in the rectangle's (u, v), each with how far the part of the loop that is in the
/// rectangle reaches beyond its line: not at all, if the loop is convex. Of loops of very many corners some are tried.
fn cuts<'a>(
    (corners, part): (&'a [DVec2], &'a [DVec2]),
    [low, high]: [DVec2; 2],
    trim_loop: u32,
) -> impl Iterator<Item = (Cut, f64)> + 'a {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let is_convex = polygon::is_convex(corners);
    let some = part.iter().step_by(part.len() / TRIED_CORNERS + 1);
    (0..corners.len()).filter_map(move |i| {
        let (start, end) = (corners[i], corners[(i + 1) % corners.len()]);
        let from = (start - middle) / half;
        let normal = ((end - start) / half).perp();
        let size = normal.abs().element_sum();
        // an edge along a side of the rectangle cuts nothing; one without length has a normal of NaN, and is none either
        let normal = normal / size;
        let offset = -normal.dot(from);
        let least = offset - normal.abs().element_sum();
        let beyond = |corner: DVec2| -normal.dot((corner - start) / half);
        let wrong = if is_convex { 0.0 } else { some.clone().copied().map(beyond).fold(0.0, f64::max) };
        let cut = Cut { normal: single2(normal), offset: nearest(offset), trim_loop };
        (least < -16.0 * f64::EPSILON).then_some((cut, wrong))
    })
}

fn single(v: DVec3) -> [f32; 3] {
    v.to_array().map(nearest)
}

fn single2(v: DVec2) -> [f32; 2] {
    v.to_array().map(nearest)
}
