//! The exact surface as sheets whose curvature is bounded.

use std::collections::BinaryHeap;

use glam::{DVec2, DVec3, DVec4};

use super::order::ByValue;
use super::triangle;
use crate::math::{bounds, polygon};
use crate::patch::{BezierPatch, Face, Overlap, Sheets};
use crate::trace::BoxTree;

/// How far a point may be from a sheet's plane before the deformation, in parts of the object's size then: sheets are moved
/// into shared planes by less than this.
const SAME_PLANE: f64 = 1e-9;

/// Strips of a sheet along a curved border that are no wider than this, in parameters, count as the sheet beyond: above the
/// width within which a lattice takes places beside its box for inside, in the parameters of a small cell.
const STRIP: f64 = 1e-9;

/// Steps of Newton's method toward the nearest point of a sheet.
const STEPS: usize = 3;

/// How closely the nearest point of the surface is found, in parts of its distance.
const NEAREST: f64 = 1e-3;

/// Most parts of the surface that are looked at for one nearest point.
const MOST_PARTS: usize = 200_000;

/// The sheets over one loop of a trim: patches with curved borders between them share it. Their indices are in
/// arithmetic progression.
#[derive(Clone, Copy, Debug)]
struct Siblings {
    first: usize,
    stride: usize,
    count: usize,
}

/// A convex sheet of the surface: what a patch has over one of its trim's loops, inside its curved borders.
#[derive(Debug)]
pub(super) struct Sheet<'a> {
    siblings: Siblings,
    patch: &'a Face,
    pub(super) corners: &'a [DVec2],
    face: u32,
    /// The parameters of a point of the frame's plane are its products with these, from the origin.
    dual: [DVec3; 2],
    normal: DVec3,
    /// Bounds of the second partials by s twice, by both, and by t twice, over the loop's bounding rectangle.
    second: [f64; 3],
}

/// Parameters in a sheet and the point there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) st: DVec2,
    pub(super) position: DVec3,
}

/// A surface made of sheets.
#[derive(Debug)]
pub(super) struct Surface<'a> {
    pub(super) sheets: Vec<Sheet<'a>>,
    by_rest: BoxTree,
    by_position: BoxTree,
    same_plane: f64,
    /// Bound on how far the patches are from the true surface, and on what curved borders are off.
    pub(super) error: f64,
}

impl<'a> Surface<'a> {
    pub(super) fn new(patches: &'a [Face]) -> Self {
        let mut sheets = Vec::with_capacity(patches.len());
        // a patch that leads, and those that share its rectangle
        for together in Sheets::of_faces(patches).map(|together| together.faces()) {
            let (start, stride) = (sheets.len(), together[0].region.len());
            for patch in together {
                for (number, trim_loop) in patch.region.loops().enumerate() {
                    let siblings = Siblings { first: start + number, stride, count: together.len() };
                    sheets.push(Sheet::new(
                        patch,
                        (patch.region.corners(&trim_loop), trim_loop.face),
                        siblings,
                    ));
                }
            }
        }
        let rest_boxes: Vec<_> = sheets.iter().map(Sheet::rest_bounds).collect();
        let boxes: Vec<_> = sheets.iter().map(Sheet::bounds).collect();
        let [low, high] = bounds::around(rest_boxes.iter().flatten().copied());
        Self {
            by_rest: BoxTree::build(&rest_boxes),
            by_position: BoxTree::build(&boxes),
            same_plane: SAME_PLANE * (high - low).length(),
            error: patches.iter().map(Face::error).fold(0.0, f64::max)
                + sheets.iter().map(Sheet::strip_width).fold(0.0, f64::max),
            sheets,
        }
    }

    /// Area before the deformation.
    pub(super) fn rest_area(&self) -> f64 {
        let area = |sheet: &Sheet<'_>| {
            let [_, s, t] = sheet.patch.chart.coordinates();
            0.5 * polygon::doubled_area(sheet.corners) * s.cross(t).length()
        };
        self.sheets.iter().filter(|sheet| sheet.patch.leads()).map(area).sum()
    }

    /// All sheets over the same loop as one, itself included.
    pub(super) fn siblings(&self, index: usize) -> impl Iterator<Item = usize> + use<> {
        let Siblings { first, stride, count } = self.sheets[index].siblings;
        (0..count).map(move |number| first + number * stride)
    }

    /// The sheet that holds a place, of those over the same loop as one; `None` where rounding has it outside all.
    pub(super) fn holder(&self, index: usize, st: DVec2) -> Option<usize> {
        self.siblings(index).find(|&sheet| self.sheets[sheet].holds(st))
    }

    /// Pieces of an input face whose plane holds three points before the deformation, and the points' parameters there.
    pub(super) fn sheets_under(&self, face: u32, rest: [DVec3; 3]) -> Vec<(usize, [DVec2; 3])> {
        let [low, high] = bounds::around(rest);
        let mut found = Vec::new();
        self.by_rest.overlapping([low - self.same_plane, high + self.same_plane], |index| {
            let sheet = &self.sheets[index];
            if sheet.patch.leads()
                && sheet.face == face
                && rest.iter().all(|&p| sheet.height(p).abs() <= self.same_plane)
            {
                found.push((index, rest.map(|p| sheet.parameters(p))));
            }
        });
        found.sort_unstable_by_key(|(index, _)| *index);
        found
    }

    /// The sheet that holds a point of the undeformed object, if there is one besides `but`.
    pub(super) fn sheet_at(&self, rest: DVec3, but: usize) -> Option<usize> {
        let mut found = None;
        self.by_rest.overlapping([rest - self.same_plane, rest + self.same_plane], |index| {
            let sheet = &self.sheets[index];
            let holds = || {
                let st = sheet.parameters(rest);
                sheet.height(rest).abs() <= self.same_plane
                    && sheet.clamped(st).distance(st) <= 1e-9
                    && sheet.holds(st)
            };
            if index != but && found.is_none_or(|known| index < known) && holds() {
                found = Some(index);
            }
        });
        found
    }

    /// Bounds of the distance between a point and the surface, less its `error`: no less than the first, no more than the second,
    /// which is `within` at most. The first is 0 if the second is found to be `enough` or less. Also the sheet that is as near as the
    /// second, unless that is `within`.
    ///
    /// Parts are halved, those that can be nearest first; a part is near the triangle of its corners by its second partials.
    pub(super) fn distance(&self, point: DVec3, within: f64, enough: f64) -> ([f64; 2], Option<usize>) {
        let mut nearest = (within, None);
        let mut parts: BinaryHeap<ByValue<(usize, [Place; 3])>> = BinaryHeap::new();
        let consider = |parts: &mut BinaryHeap<_>,
                        nearest: &mut (f64, Option<usize>),
                        index: usize,
                        corners: [Place; 3]| {
            let sheet: &Sheet<'_> = &self.sheets[index];
            let overlap = sheet.overlap(corners.map(|corner| corner.st));
            if overlap == Overlap::None {
                return;
            }
            for corner in &corners {
                if overlap == Overlap::Whole || sheet.holds(corner.st) {
                    keep_nearer(nearest, corner.position.distance(point), index);
                }
            }
            let flat = triangle::distance(corners.map(|corner| corner.position), point);
            let least = flat - sheet.bend(corners.map(|corner| corner.st));
            if least < nearest.0 {
                parts.push(ByValue(-least, (index, corners)));
            }
        };
        self.by_position.nearest(point, within, |index| {
            let sheet = &self.sheets[index];
            let places: Vec<_> = sheet.corners.iter().map(|&st| sheet.place(st)).collect();
            for i in 1..places.len() - 1 {
                consider(&mut parts, &mut nearest, index, [places[0], places[i], places[i + 1]]);
            }
            let middle = sheet.corners.iter().sum::<DVec2>() / places.len() as f64;
            let foot = sheet.foot(point, middle);
            if sheet.holds(foot.st) {
                keep_nearer(&mut nearest, foot.position.distance(point), index);
            }
            // no box is nearer than that
            if nearest.0 <= enough { -1.0 } else { nearest.0 }
        });
        let mut looked_at = 0;
        while let Some(ByValue(least, (index, corners))) = parts.pop() {
            let least = -least;
            looked_at += 1;
            if nearest.0 <= enough {
                return ([0.0, nearest.0], nearest.1);
            }
            if least >= nearest.0 * (1.0 - NEAREST) || looked_at > MOST_PARTS {
                return ([least.clamp(0.0, nearest.0), nearest.0], nearest.1);
            }
            let sheet = &self.sheets[index];
            if looked_at % 16 == 1 {
                let foot = sheet.foot(point, (corners[0].st + corners[1].st + corners[2].st) / 3.0);
                if sheet.holds(foot.st) {
                    keep_nearer(&mut nearest, foot.position.distance(point), index);
                }
            }
            for corners in triangle::quarters(corners, |p, q| sheet.place(0.5 * (p.st + q.st))) {
                consider(&mut parts, &mut nearest, index, corners);
            }
        }
        ([nearest.0; 2], nearest.1)
    }
}

fn keep_nearer(nearest: &mut (f64, Option<usize>), distance: f64, sheet: usize) {
    if distance < nearest.0 {
        *nearest = (distance, Some(sheet));
    }
}

impl<'a> Sheet<'a> {
    fn new(patch: &'a Face, (corners, face): (&'a [DVec2], u32), siblings: Siblings) -> Self {
        let [_, s, t] = patch.chart.coordinates();
        let normal = s.cross(t);
        let area_sq = normal.length_squared();
        let dual = [t.cross(normal) / area_sq, normal.cross(s) / area_sq];
        let [low, high] = polygon::bounds(corners.iter().copied()).unwrap_or_default();
        let second = second_partials(&patch.patch, [low, high]);
        Self { siblings, patch, corners, face, dual, normal: normal / area_sq.sqrt(), second }
    }

    fn height(&self, rest: DVec3) -> f64 {
        self.normal.dot(rest - self.patch.chart.coordinates()[0])
    }

    pub(super) fn parameters(&self, rest: DVec3) -> DVec2 {
        let offset = rest - self.patch.chart.coordinates()[0];
        DVec2::new(self.dual[0].dot(offset), self.dual[1].dot(offset))
    }

    pub(super) fn rest(&self, st: DVec2) -> DVec3 {
        self.patch.chart.place(st).coordinates()
    }

    fn rest_bounds(&self) -> [DVec3; 2] {
        bounds::around(self.corners.iter().map(|&st| self.rest(st)))
    }

    fn bounds(&self) -> [DVec3; 2] {
        let [low, high] = polygon::bounds(self.corners.iter().copied()).unwrap_or_default();
        self.patch.patch.subpatch(low, high).hull_bounds()
    }

    /// Whether a place is inside the curved borders.
    pub(super) fn holds(&self, st: DVec2) -> bool {
        self.patch.holds(st, DVec2::ZERO)
    }

    /// What of the rectangle around a triangle, less a strip along its sides, is inside the curved borders. Points of the strip
    /// are near to some that are under another triangle.
    pub(super) fn overlap(&self, [a, b, c]: [DVec2; 3]) -> Overlap {
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let middle = 0.5 * (low + high);
        self.patch.overlap((low + STRIP).min(middle), (high - STRIP).max(middle))
    }

    /// Bound on how far the points of a strip along a curved border are from its other side.
    fn strip_width(&self) -> f64 {
        if self.siblings.count == 1 {
            return 0.0;
        }
        let [low, high] = self.patch.patch.hull_bounds();
        let [m, n] = self.patch.patch.degree();
        // no control points are farther apart, and partials are no longer than degree times their distances
        STRIP * (m + n) as f64 * (high - low).length()
    }

    pub(super) fn place(&self, st: DVec2) -> Place {
        Place { st, position: self.patch.patch.homogeneous(st).0 }
    }

    /// Unit normal; zero where there is none.
    pub(super) fn normal(&self, st: DVec2) -> DVec3 {
        self.patch.patch.eval(st).normal().normalize_or_zero()
    }

    /// Bound on the distance between the surface over a triangle of parameters and the flat triangle of its corners, at equal
    /// barycentric coordinates.
    ///
    /// By Taylor's theorem the difference is half the mean of the second derivatives along the ways to the corners, weighted by
    /// the coordinates; the weighted squares of the ways along s are at most a quarter of the triangle's extent squared.
    pub(super) fn bend(&self, [a, b, c]: [DVec2; 3]) -> f64 {
        let extent = a.max(b).max(c) - a.min(b).min(c);
        let [ss, st, tt] = self.second;
        0.125 * (ss * extent.x * extent.x + 2.0 * st * extent.x * extent.y + tt * extent.y * extent.y)
    }

    /// The parameters in the sheet that are nearest to others.
    pub(super) fn clamped(&self, st: DVec2) -> DVec2 {
        polygon::nearest(self.corners, st)
    }

    /// Parameters, not bound to the sheet, where the patch's tangent plane is nearest to a point: Gauss-Newton from a start.
    pub(super) fn free_foot(&self, point: DVec3, start: DVec2) -> DVec2 {
        let mut st = start;
        for _ in 0..STEPS {
            let at = self.patch.patch.eval(st);
            let step = at.step_along(point - at.position);
            st = (st + step).clamp(DVec2::splat(-0.5), DVec2::splat(1.5));
        }
        st
    }

    /// A point of the sheet near the nearest to `point`: where the tangent plane is nearest or, if that is outside, on the edges
    /// that it is beyond.
    pub(super) fn foot(&self, point: DVec3, start: DVec2) -> Place {
        let free = self.free_foot(point, start);
        let mut nearest: Option<(f64, Place)> = None;
        for (i, &from) in self.corners.iter().enumerate() {
            let along = self.corners[(i + 1) % self.corners.len()] - from;
            if along.perp_dot(free - from) >= 0.0 {
                continue;
            }
            let place = self.foot_on_edge(point, [from, along], free);
            let distance_sq = place.position.distance_squared(point);
            if nearest.is_none_or(|(least, _)| distance_sq < least) {
                nearest = Some((distance_sq, place));
            }
        }
        nearest.map_or_else(|| self.place(free), |(_, place)| place)
    }

    /// The same on one edge: Newton's method along it.
    fn foot_on_edge(&self, point: DVec3, [from, along]: [DVec2; 2], start: DVec2) -> Place {
        let mut fraction = ((start - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        for _ in 0..STEPS {
            let at = self.patch.patch.eval(from + fraction * along);
            let tangent = along.x * at.dp_ds + along.y * at.dp_dt;
            let step = (point - at.position).dot(tangent) / tangent.length_squared();
            if !step.is_finite() {
                break;
            }
            fraction = (fraction + step).clamp(0.0, 1.0);
        }
        self.place(from + fraction * along)
    }
}

/// Bounds of the second partials of a patch over a rectangle: differences of control points (Farin 2002, section 5.3); for a
/// rational patch N / w by the quotient rule, with N about the rectangle's middle.
fn second_partials(patch: &BezierPatch, [low, high]: [DVec2; 2]) -> [f64; 3] {
    let size = (high - low).max(DVec2::splat(f64::MIN_POSITIVE));
    let part = patch.subpatch(low, high);
    let [m, n] = part.degree();
    let points: Vec<DVec4> = part.control_points().collect();
    let [least, most] = part.hull_bounds();
    let middle = 0.5 * (least + most);
    let net = |i: usize, j: usize| {
        let point = points[i * (n + 1) + j];
        (point.truncate() - point.w * middle, point.w)
    };
    let differences = Differences { net: &net, degree: [m, n] };
    let least_weight = points.iter().map(|point| point.w).fold(f64::INFINITY, f64::min);
    let radius = 0.5 * (most - least).length();
    // of the parts N and w
    let [first_s, first_t] = [differences.greatest([1, 0]), differences.greatest([0, 1])];
    let slope = |[of_n, of_w]: [f64; 2]| (of_n + radius * of_w) / least_weight;
    let (by_s, by_t) = (slope(first_s), slope(first_t));
    let quotient = |[of_n, of_w]: [f64; 2], crossed: f64| (of_n + crossed + radius * of_w) / least_weight;
    let ss = quotient(differences.greatest([2, 0]), 2.0 * by_s * first_s[1]);
    let tt = quotient(differences.greatest([0, 2]), 2.0 * by_t * first_t[1]);
    let st = quotient(differences.greatest([1, 1]), by_s * first_t[1] + by_t * first_s[1]);
    [ss / (size.x * size.x), st / (size.x * size.y), tt / (size.y * size.y)]
}

/// Differences of a control net.
struct Differences<'n> {
    net: &'n dyn Fn(usize, usize) -> (DVec3, f64),
    degree: [usize; 2],
}

impl Differences<'_> {
    /// Greatest partial derivative of some orders, of the points and of the weights, by control points.
    fn greatest(&self, [of_s, of_t]: [usize; 2]) -> [f64; 2] {
        let [m, n] = self.degree;
        if of_s > m || of_t > n {
            return [0.0; 2];
        }
        let factor = |degree: usize, order: usize| (0..order).map(|k| (degree - k) as f64).product::<f64>();
        let scale = factor(m, of_s) * factor(n, of_t);
        let binomial = |order: usize| -> &[f64] {
            match order {
                0 => &[1.0],
                1 => &[-1.0, 1.0],
                _ => &[1.0, -2.0, 1.0],
            }
        };
        let mut greatest = [0.0_f64; 2];
        for i in 0..=m - of_s {
            for j in 0..=n - of_t {
                let mut sum = (DVec3::ZERO, 0.0);
                for (k, a) in binomial(of_s).iter().enumerate() {
                    for (l, b) in binomial(of_t).iter().enumerate() {
                        let (point, weight) = (self.net)(i + k, j + l);
                        sum = (sum.0 + a * b * point, sum.1 + a * b * weight);
                    }
                }
                greatest = [greatest[0].max(scale * sum.0.length()), greatest[1].max(scale * sum.1.abs())];
            }
        }
        greatest
    }
}
