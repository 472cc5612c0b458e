//! The surface of a rectangle of a patch in leaf coordinates, and proven bounds on it.

use glam::{DMat3, DVec2, DVec3};

use crate::patch::BezierPatch;

use super::local::LocalSpace;
use super::net::{Bounds, DOMAIN, LeafMap, Net, Series};
use super::rational_net::RationalNet;
use super::single_precision::nearest;

/// Bounds are multiplied by this, for the roundings of their own making.
const ROUNDING: f64 = 1.0 + 1e-9;

/// A surface (u + f, v + g, h) over |u|, |v| <= [`DOMAIN`], after an affine map.
///
/// With F = (f, g) and φ(x, y) the inverse of (u, v) ↦ (u, v) + F(u, v), the surface is the graph of the height H = h ∘ φ.
/// Everything here bounds what H, its slopes and φ differ from the first terms of their expansions: φ(p) from p - F₂(p),
/// and H(p) from h₂(p) + c(p) with the cubic form c = h₃ - ∇h₂ · F₂, an index being the degree of a part of f, g or h.
/// |φ(p) - p| is at most the greatest |F|, and Dφ = (1 + DF)⁻¹ differs from 1 by at most |DF| / (1 - |DF|).
pub(crate) struct HeightGraph {
    /// The local point that becomes the origin: the surface's middle, rounded to single precision.
    pub(crate) centre: DVec3,
    /// From local to leaf coordinates, rounded to single precision: partials in the middle become the first two axes.
    pub(crate) to_leaf: DMat3,
    /// Coefficients of u², u v, v² of the forms.
    pub(crate) forms: [[f32; 3]; 3],
    /// Coefficients of u³, u² v, u v², v³ of c.
    pub(crate) cubic: [f32; 4],
    /// Bounds of f, g and h less their forms.
    pub(crate) rest: DVec3,
    /// Bound of |H - h₂ - c|.
    pub(crate) height_error: f64,
    /// Bounds of the difference of their slopes along x and y.
    pub(crate) slope_error: DVec2,
    /// Bound of |φ(x, y) - ((x, y) - forms of f and g)|.
    pub(crate) place_error: f64,
    /// Two points of the surface with |u|, |v| up to this have all between them on the graph of H.
    pub(crate) domain: f64,
    /// Bound of how far φ stretches.
    pub(crate) stretch: f64,
    steepest: f64,
}

impl HeightGraph {
    /// The part of a patch over a rectangle. One without a normal in its middle gets infinite bounds, and so does a
    /// rational one whose weights differ too much over the domain.
    pub(crate) fn new(patch: &BezierPatch, [low, high]: [DVec2; 2], space: &LocalSpace) -> Self {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let point = patch.eval(middle);
        let centre = space.point(point.position).as_vec3().as_dvec3();
        let (by_u, by_v) = (space.vector(point.dp_ds * half.x), space.vector(point.dp_dt * half.y));
        let normal = by_u.cross(by_v);
        let height = normal.normalize_or_zero() * by_u.length().max(by_v.length());
        let to_leaf = DMat3::from_cols(by_u, by_v, height).inverse();
        let to_leaf = DMat3::from_cols_array(&to_leaf.to_cols_array().map(|x| f64::from(nearest(x))));
        let usable = normal.length() > 1e-6 * by_u.length() * by_v.length() && to_leaf.is_finite();
        if !usable {
            return Self::unproven(patch, [low, high], space, f64::INFINITY);
        }
        let sub = patch.subpatch(middle - DOMAIN * half, middle + DOMAIN * half);
        let map = LeafMap { space, centre, to_leaf };
        let series = if patch.is_rational() {
            match RationalNet::try_new(&sub, &map) {
                Ok(net) => net.series(),
                Err(spread) => return Self::unproven(patch, [low, high], space, spread),
            }
        } else {
            Net::new(&sub, &map).series()
        };
        Self::bounded((centre, to_leaf), &series)
    }

    fn bounded((centre, to_leaf): (DVec3, DMat3), series: &Series) -> Self {
        let &Series { forms, h_cubic, ref bounds } = series;
        let [whole, rest, _] = bounds;
        // greatest row sum of DF
        let slope = (whole.by_u + whole.by_v).truncate().max_element();
        let shift = whole.value.truncate();
        // the image of |u|, |v| <= d is in the square of d + |F|, and that in the image of the square of d + 2 |F|
        let domain = DOMAIN - 2.0 * shift.max_element();
        let enclosed = slope < 0.5 && domain >= 1.0;
        let expansion = Expansion {
            forms: forms.map(|form| form.map(|x| f64::from(x).abs())),
            h_cubic: h_cubic.map(f64::abs),
            bounds,
            shift,
            reach: DOMAIN + shift.max_element(),
            more: slope / (1.0 - slope),
        };
        let proven = |bound: f64| if enclosed { bound * ROUNDING } else { f64::INFINITY };
        let (cubic, rounding) = cubic_of_height(forms, h_cubic);
        let rounding = rounding * (expansion.reach * expansion.reach * expansion.reach);
        Self {
            centre,
            to_leaf,
            forms,
            cubic,
            rest: rest.value * ROUNDING,
            height_error: proven(expansion.height_error() + rounding),
            slope_error: DVec2::new(
                proven(expansion.slope_error(0) + 3.0 * rounding),
                proven(expansion.slope_error(1) + 3.0 * rounding),
            ),
            place_error: proven(expansion.place_error()),
            domain,
            stretch: (1.0 + expansion.more) * ROUNDING,
            steepest: (whole.by_u + whole.by_v).max_element(),
        }
    }

    /// Leaf coordinates along the world's axes, of the control points' size.
    fn unproven(patch: &BezierPatch, rectangle: [DVec2; 2], space: &LocalSpace, steepest: f64) -> Self {
        let [low, high] = hull(patch, rectangle, space);
        let size = (0.5 * (high - low).max_element()).max(f64::from(f32::MIN_POSITIVE));
        let scale = f64::from(nearest(1.0 / size));
        Self {
            centre: (0.5 * (low + high)).as_vec3().as_dvec3(),
            to_leaf: DMat3::from_diagonal(DVec3::splat(scale)),
            forms: [[0.0; 3]; 3],
            cubic: [0.0; 4],
            rest: DVec3::INFINITY,
            height_error: f64::INFINITY,
            slope_error: DVec2::INFINITY,
            place_error: f64::INFINITY,
            domain: 0.0,
            stretch: f64::INFINITY,
            steepest,
        }
    }

    /// Whether the bounds are finite.
    pub(crate) fn is_proven(&self) -> bool {
        self.height_error.is_finite()
    }

    /// Greatest slope of f, g and h; if they have no bounds, a number above 1 that falls as they come closer to having some,
    /// or infinity.
    pub(crate) fn steepest(&self) -> f64 {
        self.steepest
    }

    /// Box in leaf coordinates around a local box.
    pub(crate) fn reach_of_box(&self, [low, high]: [DVec3; 2]) -> [DVec3; 2] {
        let (middle, half) = (0.5 * (low + high) - self.centre, 0.5 * (high - low));
        let rows = [0, 1, 2].map(|row| self.to_leaf.row(row));
        let middle = DVec3::from_array(rows.map(|row| row.dot(middle)));
        let half = DVec3::from_array(rows.map(|row| row.abs().dot(half))) * ROUNDING;
        [middle - half, middle + half]
    }
}

/// What the bounds of a [`HeightGraph`] are made of; all numbers are absolute values.
struct Expansion<'a> {
    forms: [[f64; 3]; 3],
    h_cubic: [f64; 4],
    /// Bounds of f, g, h; of what is left without quadratic forms; without h's cubic form as well.
    bounds: &'a [Bounds; 3],
    /// Greatest |f| and |g|.
    shift: DVec2,
    /// Greatest |x| and |y|.
    reach: f64,
    /// Bound of |Dφ| - 1.
    more: f64,
}

impl Expansion<'_> {
    /// Bounds of a quadratic form's partials over the square of a size.
    fn gradient([uu, uv, vv]: [f64; 3], size: DVec2) -> DVec2 {
        DVec2::new(2.0 * uu * size.x + uv * size.y, uv * size.x + 2.0 * vv * size.y)
    }

    /// Bound of |F(φ(p)) - F₂(p)|.
    fn place_error(&self) -> f64 {
        let rest = self.bounds[1].value.truncate();
        let change = |form| Self::gradient(form, DVec2::splat(self.reach)).dot(self.shift);
        (rest.x + change(self.forms[0])).max(rest.y + change(self.forms[1]))
    }

    /// Bound of |H - h₂ - c|: with h₂(p - F) = h₂(p) - ∇h₂(p) · F + h₂(F), what is left is -∇h₂(p) · (F - F₂(p)), h₂(F), the
    /// change of h₃ from p to φ(p), and the rest of h.
    fn height_error(&self) -> f64 {
        let [uu, uv, vv] = self.forms[2];
        let DVec2 { x, y } = self.shift;
        let slope = Self::gradient(self.forms[2], DVec2::splat(self.reach)).element_sum();
        slope * self.place_error()
            + (uu * x * x + uv * x * y + vv * y * y)
            + self.cubic_gradient().dot(self.shift)
            + self.bounds[2].value.z
    }

    /// Bounds of the partials of h₃.
    fn cubic_gradient(&self) -> DVec2 {
        let [a, b, c, d] = self.h_cubic;
        DVec2::new(3.0 * a + 2.0 * b + c, b + 2.0 * c + 3.0 * d) * (self.reach * self.reach)
    }

    /// Bound of the difference of slopes along an axis e: the derivatives of the terms of [`Self::height_error`].
    fn slope_error(&self, axis: usize) -> f64 {
        let [whole, rest, last] = self.bounds;
        let along = |bounds: &Bounds| if axis == 0 { bounds.by_u } else { bounds.by_v };
        // DF e, and (Dφ - 1) e
        let column = along(whole).truncate();
        let turned = column + self.more * column.max_element();
        // of DF on such a vector
        let moved = |v: DVec2| whole.by_u.truncate() * v.x + whole.by_v.truncate() * v.y;
        // DF(φ) Dφ e - DF₂(p) e
        let change = DVec2::new(
            Self::gradient(self.forms[0], self.shift)[axis],
            Self::gradient(self.forms[1], self.shift)[axis],
        );
        let slope_of_place = moved(turned) + along(rest).truncate() + change;
        let form = self.forms[2];
        let bend = Self::gradient(form, DVec2::AXES[axis]).element_sum();
        let [a, b, c, d] = self.h_cubic;
        // by how much the partial of h₃ changes on the way from p to φ(p)
        let DVec2 { x, y } = self.shift;
        let cubic_bend = if axis == 0 {
            (6.0 * a + 2.0 * b) * x + (2.0 * b + 2.0 * c) * y
        } else {
            (2.0 * b + 2.0 * c) * x + (2.0 * c + 6.0 * d) * y
        };
        bend * self.place_error()
            + Self::gradient(form, DVec2::splat(self.reach)).dot(slope_of_place)
            + Self::gradient(form, self.shift).dot(column + moved(turned))
            + cubic_bend * self.reach
            + self.cubic_gradient().dot(turned)
            + along(last).z
            + DVec2::new(last.by_u.z, last.by_v.z).dot(turned)
    }
}

/// The cubic form c = h₃ - ∇h₂ · F₂ in single precision, and a bound of each coefficient's rounding, summed.
fn cubic_of_height(forms: [[f32; 3]; 3], h_cubic: [f64; 4]) -> ([f32; 4], f64) {
    let [[fa, fb, fc], [ga, gb, gc], [ha, hb, hc]] = forms.map(|form| form.map(f64::from));
    let product = [
        2.0 * ha * fa + hb * ga,
        2.0 * ha * fb + hb * fa + hb * gb + 2.0 * hc * ga,
        2.0 * ha * fc + hb * fb + hb * gc + 2.0 * hc * gb,
        hb * fc + 2.0 * hc * gc,
    ];
    let exact = [0, 1, 2, 3].map(|i: usize| h_cubic[i] - product[i]);
    (exact.map(nearest), exact.iter().map(|x| x.abs() * f64::from(f32::EPSILON)).sum())
}

/// Box of the control points over a rectangle, in local coordinates.
pub(crate) fn hull(patch: &BezierPatch, [low, high]: [DVec2; 2], space: &LocalSpace) -> [DVec3; 2] {
    patch.subpatch(low, high).hull_bounds().map(|corner| space.point(corner))
}

/// Range of a quadratic form over |u|, |v| <= 1, by its Bernstein coefficients.
pub(crate) fn quadratic_range([uu, uv, vv]: [f32; 3]) -> [f32; 2] {
    let mut range = [0.0_f32, 0.0_f32];
    for [u, square_u] in [[-1.0, 1.0], [0.0, -1.0], [1.0, 1.0]] {
        for [v, square_v] in [[-1.0, 1.0], [0.0, -1.0], [1.0, 1.0]] {
            let value = uu * square_u + uv * (u * v) + vv * square_v;
            range = [range[0].min(value), range[1].max(value)];
        }
    }
    // three products and sums in single precision
    let slack = 8.0 * f32::EPSILON * (uu.abs() + uv.abs() + vv.abs());
    [range[0] - slack, range[1] + slack]
}

#[cfg(test)]
mod tests {
    use glam::DMat2;

    use super::*;
    use crate::test_support::Noise;

    #[test]
    fn the_bounds_hold() {
        let space = LocalSpace::around([DVec3::splat(-1.0), DVec3::splat(1.0)]);
        // weights of 1; from 0.6 to 1.6; and from 0.3 to 3
        for (spread, least_proven) in [(0.0, 390), (1.0, 350), (2.4, 150)] {
            let mut noise = Noise(5);
            let (mut proven, mut tightest) = (0, 0.0_f64);
            for case in 0..400 {
                let patch = noisy_patch(&mut noise, [1 + case % 6, 1 + case / 6 % 6], spread);
                let low = 0.8 * DVec2::new(noise.next() + 0.5, noise.next() + 0.5);
                let (low, high) = (low, low + 0.1 + 0.05 * noise.next());
                let graph = HeightGraph::new(&patch, [low, high], &space);
                proven += usize::from(graph.is_proven());
                for _ in 0..if graph.is_proven() { 50 } else { 0 } {
                    let uv = 2.0 * graph.domain.min(1.0) * DVec2::new(noise.next(), noise.next());
                    let what = format!("weights {spread}, case {case}");
                    tightest = tightest.max(reached(&graph, (&patch, [low, high], &space), uv, &what));
                }
            }
            assert!(proven > least_proven, "weights {spread}: {proven}");
            assert!(tightest > 0.1, "weights {spread}: {tightest} of the bounds occurs");
        }
    }

    fn noisy_patch(noise: &mut Noise, degree: [usize; 2], spread: f64) -> BezierPatch {
        let points = (0..=degree[0]).flat_map(|i| (0..=degree[1]).map(move |j| (i, j)));
        let points = points.map(|(i, j)| {
            let flat = DVec3::new(i as f64 / degree[0] as f64, j as f64 / degree[1] as f64, 0.0);
            let point = flat + 0.1 * noise.vector();
            let weight = if spread > 0.0 { libm::exp(spread * noise.next()) } else { 1.0 };
            (weight * point).extend(weight)
        });
        BezierPatch::new(degree, points.collect())
    }

    /// Fails unless the bounds hold at a point; gives the greatest part of one that occurs.
    fn reached(
        graph: &HeightGraph,
        (patch, [low, high], space): (&BezierPatch, [DVec2; 2], &LocalSpace),
        uv: DVec2,
        what: &str,
    ) -> f64 {
        let st = 0.5 * (low + high) + 0.5 * (high - low) * uv;
        let point = patch.eval(st);
        let place = graph.to_leaf * (space.point(point.position) - graph.centre);
        let form = |part: usize, at: DVec2| {
            let [a, b, c] = graph.forms[part].map(f64::from);
            a * at.x * at.x + b * at.x * at.y + c * at.y * at.y
        };
        let forms = DVec3::new(form(0, uv), form(1, uv), form(2, uv));
        let off = place - uv.extend(0.0) - forms;
        assert!(off.abs().cmple(graph.rest).all(), "{what}: {off} of {}", graph.rest);
        let p = place.truncate();
        let [a, b, c, d] = graph.cubic.map(f64::from);
        let cubic = ((a * p.x + b * p.y) * p.x + c * p.y * p.y) * p.x + d * p.y * p.y * p.y;
        let error = place.z - form(2, p) - cubic;
        assert!(error.abs() <= graph.height_error, "{what}: height");
        // slopes of the graph across and along a small step
        let partial = |axis: usize| 0.5 * (high - low)[axis] * space.vector([point.dp_ds, point.dp_dt][axis]);
        let slopes = [partial(0), partial(1)].map(|step| graph.to_leaf * step);
        let gradient = DMat2::from_cols(slopes[0].truncate(), slopes[1].truncate()).transpose().inverse()
            * DVec2::new(slopes[0].z, slopes[1].z);
        let [ha, hb, hc] = graph.forms[2].map(f64::from);
        let quadratic = DVec2::new(2.0 * ha * p.x + hb * p.y, hb * p.x + 2.0 * hc * p.y);
        let cubic = DVec2::new(
            (3.0 * a * p.x + 2.0 * b * p.y) * p.x + c * p.y * p.y,
            b * p.x * p.x + (2.0 * c * p.x + 3.0 * d * p.y) * p.y,
        );
        let off = (gradient - quadratic - cubic).abs();
        assert!(off.cmple(graph.slope_error).all(), "{what}: {off} of {}", graph.slope_error);
        let back = p - DVec2::new(form(0, p), form(1, p));
        assert!((back - uv).abs().max_element() <= graph.place_error, "{what}: place");
        (error.abs() / graph.height_error).max((off / graph.slope_error).max_element())
    }
}
