//! All zeros of a projected net over the unit square: clipping until Newton's method is safe.

use glam::{DMat2, DVec2};

use crate::math::bernstein;
use crate::math::rounding::gamma;

use super::clipping::{Parameter, clip};
use super::newton::{NewtonOutcome, newton};
use super::projection::{ProjectedNet, ProjectedPoint, eval_net, excludes_zero, range};
use super::statistics::TraceStatistics;

/// Boxes examined before a search is given up and counted as not converged.
///
/// A simple root takes 1 to 10, a tangent one some hundreds; only nets that collapse to a curve along the ray come
/// near this.
const MAX_BOXES: usize = 4096;

/// Boxes examined for one ray in all leaves before its searches become short. Two that are given up take as many; only rays
/// through thousands of leaves of which nothing is proven come near this.
const MAX_BOXES_OF_RAY: usize = 2 * MAX_BOXES;

/// Most rays of a packet.
pub(super) const MOST_RAYS: usize = 16;

/// Splits of a box and its parts, one in the other: those of all digits of both parameters. A box that is as small and still not
/// decided is one of rounding.
const MAX_SPLITS: usize = 2 * f64::MANTISSA_DIGITS as usize;

/// Boxes examined in a leaf by a ray that has used up its own.
const FEW_BOXES: usize = 16;

/// The Jacobian's greatest relative variation over a box for which Newton's method is trusted.
///
/// Below 1 the map is one to one on the box. With variation v a Newton step leaves at most 2 v / (1 - v) of the
/// distance to the zero: 2/3 at 1/4, and soon far less.
const UNIQUE: f64 = 0.25;

/// A clipped side longer than this, in parts of the box, is split in the middle instead (Nishita et al., section 4).
const MIN_CLIP: f64 = 0.8;

/// A part of the patch within rounding of the ray that is longer than this along it, in parts of the patch, is not a point
/// of contact: the ray runs in the surface. A tangent contact is about the root of the rounding long, 1e-7, one at an
/// inflection its cubic root, 1e-4.
const IN_SURFACE: f64 = 1e-3;

/// Most that rounding may grow by where a net is evaluated outside its unit square: a root there is noise beyond.
///
/// The bound on a net's rounding has room for this; a patch much smaller than its tolerances is searched far outside.
const MAX_GROWTH: f64 = 64.0;

/// Middle and corners of a box.
const WHOLE_BOX: [DVec2; 5] = [DVec2::splat(0.5), DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE];

/// A zero of a projected net.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PatchRoot {
    pub(crate) st: DVec2,
    /// Whether the ray is tangent there, within rounding.
    pub(crate) degenerate: bool,
}

/// Buffers of the search, kept from ray to ray.
#[derive(Debug, Default)]
pub(crate) struct SearchScratch {
    nets: Vec<DVec2>,
    right: Vec<DVec2>,
    /// Boxes examined for each ray of a packet; for a ray alone the first.
    spent: [usize; MOST_RAYS],
    /// The ray of the packet that is searched for.
    ray: usize,
    pub(crate) roots: Vec<PatchRoot>,
}

impl SearchScratch {
    /// Begins with new rays.
    #[inline(always)]
    pub(super) fn start_packet(&mut self) {
        self.spent = [0; MOST_RAYS];
    }

    /// Begins with a new ray, alone.
    #[inline(always)]
    pub(super) fn start_ray(&mut self) {
        (self.spent[0], self.ray) = (0, 0);
    }

    /// Goes on with a ray of a packet.
    pub(super) fn take_ray(&mut self, lane: usize) {
        self.ray = lane;
    }
}

/// Finds every zero of the net in the box `[low, high]` of its unit square, a margin of rounding around it included, into
/// `scratch.roots`.
pub(crate) fn find_roots(
    net: &ProjectedNet,
    [low, high]: [DVec2; 2],
    scratch: &mut SearchScratch,
    statistics: &mut TraceStatistics,
) {
    scratch.roots.clear();
    scratch.nets.clear();
    scratch.nets.extend_from_slice(&net.points);
    let greatest = net.points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let [m, n] = net.degree;
    let operations = u32::try_from(4 * (m + n)).expect("degrees are at most 12");
    // the restricted nets shrink with their boxes, so their roundings sum to twice the first at most
    let margin = net.rounding + 2.0 * gamma(operations) * greatest;
    let most = match scratch.spent[scratch.ray] {
        ..MAX_BOXES_OF_RAY => MAX_BOXES,
        _ => FEW_BOXES,
    };
    let mut search = Search { net, margin, scratch, statistics, boxes: 0, most };
    search.restrict(0, [low.x, high.x], [low.y, high.y]);
    search.search(0, [low, high], 0);
    let boxes = search.boxes;
    if boxes > most {
        statistics.not_converged += 1;
    }
    scratch.spent[scratch.ray] += boxes;
    statistics.roots += scratch.roots.len() as u64;
}

struct Search<'a> {
    net: &'a ProjectedNet,
    margin: f64,
    scratch: &'a mut SearchScratch,
    statistics: &'a mut TraceStatistics,
    boxes: usize,
    most: usize,
}

/// Bounds on the only zero of a box on which the map is one to one, in the box's own unit square.
///
/// With G the net times the inverse of its mean Jacobian, every zero lies within variation / 2 of
/// centre - G(centre) along each parameter (Krawczyk 1969).
struct Krawczyk {
    /// Centre - G(centre).
    zero: DVec2,
    /// How far the Jacobian of G is from 1.
    variation: f64,
    /// The net's margin across the ray as a distance along each parameter.
    slack: DVec2,
}

impl Krawczyk {
    fn misses_box(&self) -> bool {
        let radius = DVec2::splat(0.5 * self.variation) + 2.0 * self.slack;
        (self.zero - radius).cmpgt(DVec2::ONE).any() || (self.zero + radius).cmplt(DVec2::ZERO).any()
    }
}

/// Sum of the absolute values of all products of Bernstein polynomials: 1 in the unit square.
fn growth(st: DVec2, [m, n]: [usize; 2]) -> f64 {
    let along = |x: f64, degree: usize| (0..degree).fold(1.0, |power, _| power * (x.abs() + (1.0 - x).abs()));
    along(st.x, m) * along(st.y, n)
}

/// Ends of the part of a line that is in the unit square widened by `slack`.
fn chord(point: DVec2, direction: DVec2, slack: f64) -> Option<[DVec2; 2]> {
    let (a, b) = ((-slack - point) / direction, (1.0 + slack - point) / direction);
    let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
    (enter <= leave).then(|| [point + enter * direction, point + leave * direction])
}

/// How far outside the unit square a place is.
fn outside(st: DVec2) -> f64 {
    st.distance(st.clamp(DVec2::ZERO, DVec2::ONE))
}

/// The place of a box next to `start`, in its own unit square, where the component of its net along a line is 0.
fn on_line(points: &[DVec2], degree: [usize; 2], line: DVec2, start: DVec2) -> DVec2 {
    let mut place = start;
    // each step leaves a part of the distance that is below the slope's variation: 1/4, and soon far less
    for _ in 0..6 {
        let point = eval_net(points, degree, place);
        let slope = DVec2::new(line.dot(point.by_s), line.dot(point.by_t));
        let step = line.dot(point.value) / slope.length_squared() * slope;
        place -= step;
    }
    place
}

/// Sums of the absolute values of a matrix' rows.
fn row_sums(matrix: DMat2) -> DVec2 {
    DVec2::new(matrix.row(0).abs().element_sum(), matrix.row(1).abs().element_sum())
}

/// What a box whose image is a line within rounding says of the ray.
enum Contact {
    /// The line does not reach it.
    Missed,
    /// The surface is within rounding of it along a curve through these places, the middle first, in the box's own unit
    /// square.
    Along([DVec2; 3]),
}

/// What is to be done with a box.
enum Step {
    /// It holds no zero, or its zero is found.
    Done,
    /// Only this part of it, in its own unit square, can hold one.
    Clip([f64; 2], [f64; 2]),
    /// It may hold several.
    Split(Parameter),
}

impl Search<'_> {
    /// Searches the box `[low, high]`, whose net is on top of the stack from `start`, and which so many splits have made; leaves
    /// the stack as it was, but for that net.
    fn search(&mut self, start: usize, [mut low, mut high]: [DVec2; 2], mut splits: usize) {
        loop {
            self.boxes += 1;
            self.statistics.boxes += 1;
            if self.boxes > self.most {
                return;
            }
            match self.examine(start, low, high) {
                Step::Done => return,
                Step::Clip(s, t) => {
                    self.restrict(start, s, t);
                    let size = high - low;
                    (low, high) = (low + size * DVec2::new(s[0], t[0]), low + size * DVec2::new(s[1], t[1]));
                }
                Step::Split(parameter) => {
                    splits += 1;
                    if splits > MAX_SPLITS {
                        self.statistics.not_converged += 1;
                        return;
                    }
                    let second = self.split(start, parameter);
                    let middle = 0.5 * (low + high);
                    let (mut low_second, mut high_first) = (low, high);
                    match parameter {
                        Parameter::S => (low_second.x, high_first.x) = (middle.x, middle.x),
                        Parameter::T => (low_second.y, high_first.y) = (middle.y, middle.y),
                    }
                    self.search(second, [low_second, high], splits);
                    self.scratch.nets.truncate(second);
                    high = high_first;
                }
            }
        }
    }

    fn examine(&mut self, start: usize, low: DVec2, high: DVec2) -> Step {
        let degree = self.net.degree;
        let points = &self.scratch.nets[start..];
        let [least, greatest] = range(points);
        if excludes_zero(least, greatest, self.margin) {
            return Step::Done;
        }
        if (greatest - least).max_element() <= 2.0 * self.margin {
            self.add_degenerate(low, high, &WHOLE_BOX);
            return Step::Done;
        }
        let slopes = Slopes::new(points, degree);
        if let Some(inverse) = slopes.inverse()
            && let Some(variation) = slopes.variation(points, degree, inverse)
        {
            let centre = eval_net(points, degree, DVec2::splat(0.5));
            let zero = DVec2::splat(0.5) - inverse * centre.value;
            let slack = self.margin * row_sums(inverse);
            // the Jacobian of a surface that the ray lies in is rounding alone, and so is its inverse
            if (slack * (high - low)).max_element() <= IN_SURFACE {
                return self.unique(low, high, Krawczyk { zero, variation, slack });
            }
        }
        match self.contact(points, &slopes) {
            Some(Contact::Missed) => return Step::Done,
            Some(Contact::Along(places)) => {
                self.add_degenerate(low, high, &places);
                return Step::Done;
            }
            None => {}
        }
        let [across_s, across_t] = slopes.clip_lines();
        let Some(s) = clip(points, degree, Parameter::S, across_s, self.margin) else { return Step::Done };
        let Some(t) = clip(points, degree, Parameter::T, across_t, self.margin) else { return Step::Done };
        if s[1] - s[0] <= MIN_CLIP || t[1] - t[0] <= MIN_CLIP {
            return Step::Clip(s, t);
        }
        Step::Split(slopes.longer_side())
    }

    /// Whether the box's image is a line within rounding, as where the ray is tangent to the patch; `None` if it is not, or
    /// if a place on the line is not one line of places in the box.
    ///
    /// No part of such a box is told from any other by how near it comes to the ray, so it is not split further: along
    /// a line that is oblique in the parameters it would fall into some million parts.
    fn contact(&self, points: &[DVec2], slopes: &Slopes) -> Option<Contact> {
        let degree = self.net.degree;
        let [by_s, by_t] = slopes.mean;
        let longer = if by_s.length_squared() >= by_t.length_squared() { by_s } else { by_t };
        let line = longer.try_normalize()?;
        let turned = points.iter().map(|&point| DVec2::new(line.dot(point), line.perp_dot(point)));
        let [least, greatest] = turned.fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], point| {
            [low.min(point), high.max(point)]
        });
        if greatest.y - least.y > 2.0 * self.margin {
            return None;
        }
        if excludes_zero(least, greatest, std::f64::consts::SQRT_2 * self.margin) {
            return Some(Contact::Missed);
        }
        let mean = DVec2::new(line.dot(by_s), line.dot(by_t));
        let mut variation = DVec2::ZERO;
        for_each_derivative(points, degree, |side, vector| {
            variation[side] = variation[side].max((line.dot(vector) - mean[side]).abs());
        });
        if variation.element_sum() >= UNIQUE * mean.abs().max_element() {
            return None;
        }
        let middle = on_line(points, degree, line, DVec2::splat(0.5));
        let slack = 2.0 * self.margin / mean.abs().max_element();
        // the curve is all but straight, so it leaves the box near where its tangent does
        let [from, to] = chord(middle, mean.perp(), slack)?;
        Some(Contact::Along(
            [from.midpoint(to), from, to]
                .map(|place| on_line(points, degree, line, place).clamp(DVec2::ZERO, DVec2::ONE)),
        ))
    }

    /// A box on which the map is one to one: none, or one zero, which Newton's method finds.
    ///
    /// Outside the Krawczyk box there is none; around the rest Newton's method finds it.
    fn unique(&mut self, low: DVec2, high: DVec2, krawczyk: Krawczyk) -> Step {
        if krawczyk.misses_box() {
            return Step::Done;
        }
        let size = high - low;
        let zero = krawczyk.zero;
        let start = low + size * zero.clamp(DVec2::ZERO, DVec2::ONE);
        let slack = size * krawczyk.slack;
        match newton(self.net, start, [low, high], slack, &mut self.statistics.newton_steps) {
            NewtonOutcome::Root { st, inverse } => {
                self.add_root(st, inverse, low, high);
                Step::Done
            }
            NewtonOutcome::NotConverged => {
                if size.max_element() <= f64::EPSILON {
                    self.add_degenerate(low, high, &WHOLE_BOX);
                    return Step::Done;
                }
                Step::Split(if size.x >= size.y { Parameter::S } else { Parameter::T })
            }
        }
    }

    /// Adds a root of the box or within rounding of it, unless it is known.
    fn add_root(&mut self, st: DVec2, inverse: DMat2, low: DVec2, high: DVec2) {
        let sensitivity = row_sums(inverse);
        let off = (2.0 * self.margin * sensitivity).max(DVec2::splat(4.0 * f64::EPSILON));
        let outside = st.cmplt(low - off).any() || st.cmpgt(high + off).any();
        let noise = growth(st, self.net.degree) > MAX_GROWTH;
        let known = self.scratch.roots.iter().any(|root| (root.st - st).abs().cmple(2.0 * off).all());
        if !outside && !noise && !known {
            self.scratch.roots.push(PatchRoot { st, degenerate: false });
        }
    }

    /// Adds the first of some places of a box, in its own unit square, at all of which the surface is within rounding of
    /// the ray.
    fn add_degenerate(&mut self, low: DVec2, high: DVec2, places: &[DVec2]) {
        let depths = places.iter().map(|&place| self.net.depth(low + place * (high - low)));
        let (least, greatest) =
            depths.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        if greatest - least > IN_SURFACE * self.net.extent() {
            self.statistics.in_surface += 1;
            return;
        }
        let st = low + places[0] * (high - low);
        // of a box that is within rounding of the ray, what is in the unit square is as good, and the rest is trimmed
        let inside = st.clamp(DVec2::ZERO, DVec2::ONE);
        let is_box = places.len() == WHOLE_BOX.len();
        let st = if is_box && inside.cmpge(low).all() && inside.cmple(high).all() { inside } else { st };
        let near = (4.0 * (high - low) + 4.0 * f64::EPSILON).max(DVec2::splat(1e-7));
        let root = PatchRoot { st, degenerate: true };
        match self.scratch.roots.iter_mut().find(|known| (known.st - st).abs().cmple(near).all()) {
            Some(known) => {
                if known.degenerate && outside(st) < outside(known.st) {
                    *known = root;
                }
            }
            None => {
                self.statistics.degenerate += 1;
                self.scratch.roots.push(root);
            }
        }
    }

    fn restrict(&mut self, start: usize, s: [f64; 2], t: [f64; 2]) {
        let [m, n] = self.net.degree;
        let points = &mut self.scratch.nets[start..];
        for i in 0..=m {
            bernstein::restrict(&mut points[i * (n + 1)..], 1, n, t[0], t[1]);
        }
        for j in 0..=n {
            bernstein::restrict(&mut points[j..], n + 1, m, s[0], s[1]);
        }
    }

    /// Halves the net: the first half stays at `start`, the second goes on top; returns its start.
    fn split(&mut self, start: usize, parameter: Parameter) -> usize {
        let [m, n] = self.net.degree;
        let size = (m + 1) * (n + 1);
        let SearchScratch { nets, right, .. } = &mut *self.scratch;
        right.clear();
        right.resize(size, DVec2::ZERO);
        let points = &mut nets[start..start + size];
        match parameter {
            Parameter::S => {
                for j in 0..=n {
                    bernstein::split(&mut points[j..], &mut right[j..], n + 1, m, 0.5);
                }
            }
            Parameter::T => {
                for i in 0..=m {
                    bernstein::split(&mut points[i * (n + 1)..], &mut right[i * (n + 1)..], 1, n, 0.5);
                }
            }
        }
        let second = nets.len();
        nets.extend_from_slice(right);
        second
    }
}

/// The derivative's control vectors of a net, summed up.
struct Slopes {
    mean: [DVec2; 2],
    /// Greatest length of a derivative's control vector along s and along t.
    longest_sq: [f64; 2],
}

impl Slopes {
    fn new(points: &[DVec2], [m, n]: [usize; 2]) -> Self {
        let mut slopes = Self { mean: [DVec2::ZERO; 2], longest_sq: [0.0; 2] };
        for_each_derivative(points, [m, n], |side, vector| {
            slopes.mean[side] += vector;
            slopes.longest_sq[side] = slopes.longest_sq[side].max(vector.length_squared());
        });
        slopes.mean[0] /= (m * (n + 1)) as f64;
        slopes.mean[1] /= (n * (m + 1)) as f64;
        slopes
    }

    fn inverse(&self) -> Option<DMat2> {
        let [by_s, by_t] = self.mean;
        super::newton::inverse(&ProjectedPoint { value: DVec2::ZERO, by_s, by_t })
    }

    /// Greatest row sum of |inverse · J - 1| over all derivative control vectors, if below [`UNIQUE`].
    fn variation(&self, points: &[DVec2], degree: [usize; 2], inverse: DMat2) -> Option<f64> {
        let mut worst = [DVec2::ZERO; 2];
        for_each_derivative(points, degree, |side, vector| {
            let off = (inverse * vector - DVec2::AXES[side]).abs();
            worst[side] = worst[side].max(off);
        });
        let rows = worst[0] + worst[1];
        (rows.max_element() < UNIQUE).then(|| rows.max_element())
    }

    /// For each parameter the line along which the other one moves the image.
    fn clip_lines(&self) -> [DVec2; 2] {
        let line = |along: DVec2, fallback: DVec2| along.normalize_or(fallback.perp().normalize_or(DVec2::X));
        [line(self.mean[1], self.mean[0]), line(self.mean[0], self.mean[1])]
    }

    fn longer_side(&self) -> Parameter {
        if self.longest_sq[0] >= self.longest_sq[1] { Parameter::S } else { Parameter::T }
    }
}

/// Calls with (0, ∂/∂s control vector) and (1, ∂/∂t control vector), all of them.
fn for_each_derivative(points: &[DVec2], [m, n]: [usize; 2], mut call: impl FnMut(usize, DVec2)) {
    let row = n + 1;
    for i in 0..=m {
        for j in 0..=n {
            let here = points[i * row + j];
            if i < m {
                call(0, m as f64 * (points[(i + 1) * row + j] - here));
            }
            if j < n {
                call(1, n as f64 * (points[i * row + j + 1] - here));
            }
        }
    }
}
