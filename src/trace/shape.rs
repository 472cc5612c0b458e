//! The surface of a rectangle of a patch in leaf coordinates, and proven bounds on it.

use glam::{DMat3, DVec2, DVec3};

use crate::math::bernstein::binomial;
use crate::patch::BezierPatch;

use super::leaf::{DOMAIN, nearest};
use super::local::LocalSpace;

/// Bounds are multiplied by this, for the roundings of their own making.
const ROUNDING: f64 = 1.0 + 1e-9;

/// A surface (u + f, v + g, h) over |u|, |v| <= [`DOMAIN`], after an affine map.
///
/// With q the quadratic forms of f, g and h, F = (f, g), and φ(x, y) the inverse of (u, v) ↦ (u, v) + F(u, v), the surface is
/// the graph of the height H = h ∘ φ. Everything here bounds what H, its slopes and φ differ from the forms: |φ(p) - p|
/// is at most the greatest |F|, and Dφ = (1 + DF)⁻¹ differs from 1 by at most |DF| / (1 - |DF|).
pub(crate) struct Shape {
    /// The local point that becomes the origin: the surface's middle, rounded to single precision.
    pub(crate) centre: DVec3,
    /// From local to leaf coordinates, rounded to single precision: partials in the middle become the first two axes.
    pub(crate) to_leaf: DMat3,
    /// Coefficients of u², u v, v² of the forms.
    pub(crate) forms: [[f32; 3]; 3],
    /// Bounds of f, g and h less their forms.
    pub(crate) rest: DVec3,
    /// Bound of |H - form of h|.
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

/// Absolute bounds of f, g and h: of values, and of partials by u and v.
struct Bounds {
    value: DVec3,
    by_u: DVec3,
    by_v: DVec3,
}

/// Control points over the domain.
struct Net {
    degree: [usize; 2],
    points: Vec<DVec3>,
}

impl Shape {
    /// The part of a patch over a rectangle. A rational one, or one without a normal in its middle, gets infinite
    /// bounds.
    pub(crate) fn of(patch: &BezierPatch, [low, high]: [DVec2; 2], space: &LocalSpace) -> Self {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let point = patch.eval(middle);
        let centre = space.point(point.position).as_vec3().as_dvec3();
        let (by_u, by_v) = (space.vector(point.dp_ds * half.x), space.vector(point.dp_dt * half.y));
        let normal = by_u.cross(by_v);
        let height = normal.normalize_or_zero() * by_u.length().max(by_v.length());
        let to_leaf = DMat3::from_cols(by_u, by_v, height).inverse();
        let to_leaf = DMat3::from_cols_array(&to_leaf.to_cols_array().map(|x| f64::from(nearest(x))));
        let usable = normal.length() > 1e-6 * by_u.length() * by_v.length() && to_leaf.is_finite();
        if !usable || patch.is_rational() {
            return Self::unproven(patch, [low, high], space);
        }
        let sub = patch.subpatch(middle - DOMAIN * half, middle + DOMAIN * half);
        let points = sub.positions();
        let points = points.map(|point| to_leaf * (space.point(point) - centre)).collect();
        let mut net = Net { degree: patch.degree(), points };
        net.raise_to_quadratic();
        net.subtract(|[u, v], _| DVec3::new(u, v, 0.0));
        let whole = net.bounds();
        let forms = net.forms();
        net.subtract(|[u, v], [uu, vv]| {
            DVec3::from_array(forms.map(|[a, b, c]| {
                f64::from(a) * uu + f64::from(b) * (u * v) + f64::from(c) * vv
            }))
        });
        Self::bounded(centre, to_leaf, forms, &whole, &net.bounds())
    }

    /// From the bounds of f, g and h, and of the rests besides their forms.
    fn bounded(
        centre: DVec3,
        to_leaf: DMat3,
        forms: [[f32; 3]; 3],
        whole: &Bounds,
        rest: &Bounds,
    ) -> Self {
        // greatest row sum of DF
        let slope = (whole.by_u + whole.by_v).truncate().max_element();
        let shift = whole.value.truncate();
        // the image of |u|, |v| <= d is in the square of d + |F|, and that in the image of the square of d + 2 |F|
        let domain = DOMAIN - 2.0 * shift.max_element();
        let enclosed = slope < 0.5 && domain >= 1.0;
        let [[f_uu, f_uv, f_vv], [g_uu, g_uv, g_vv], [h_uu, h_uv, h_vv]] =
            forms.map(|form| form.map(|x| f64::from(x).abs()));
        let reach = DOMAIN + shift.max_element();
        // by how much a form's value changes on the way from φ(p) to p
        let change = |[uu, uv, vv]: [f64; 3]| {
            ((2.0 * uu + uv) * shift.x + (uv + 2.0 * vv) * shift.y) * reach
        };
        let height_error = rest.value.z + change([h_uu, h_uv, h_vv]);
        let place_error = rest.value.truncate().max_element()
            + change([f_uu, f_uv, f_vv]).max(change([g_uu, g_uv, g_vv]));
        let more = slope / (1.0 - slope);
        // ∇h · (Dφ - 1) w for w along x or y
        let turned = |column: DVec3| {
            whole.by_u.z * column.x
                + whole.by_v.z * column.y
                + (whole.by_u.z + whole.by_v.z) * more * column.truncate().max_element()
        };
        let slope_error = DVec2::new(
            turned(whole.by_u) + rest.by_u.z + 2.0 * h_uu * shift.x + h_uv * shift.y,
            turned(whole.by_v) + rest.by_v.z + h_uv * shift.x + 2.0 * h_vv * shift.y,
        );
        let proven = |bound: f64| if enclosed { bound * ROUNDING } else { f64::INFINITY };
        Self {
            centre,
            to_leaf,
            forms,
            rest: rest.value * ROUNDING,
            height_error: proven(height_error),
            slope_error: slope_error * ROUNDING,
            place_error: place_error * ROUNDING,
            domain,
            stretch: (1.0 + more) * ROUNDING,
            steepest: (whole.by_u + whole.by_v).max_element(),
        }
    }

    /// Leaf coordinates along the world's axes, of the control points' size.
    fn unproven(patch: &BezierPatch, rectangle: [DVec2; 2], space: &LocalSpace) -> Self {
        let [low, high] = hull(patch, rectangle, space);
        let size = (0.5 * (high - low).max_element()).max(f64::from(f32::MIN_POSITIVE));
        let scale = f64::from(nearest(1.0 / size));
        Self {
            centre: (0.5 * (low + high)).as_vec3().as_dvec3(),
            to_leaf: DMat3::from_diagonal(DVec3::splat(scale)),
            forms: [[0.0; 3]; 3],
            rest: DVec3::INFINITY,
            height_error: f64::INFINITY,
            slope_error: DVec2::INFINITY,
            place_error: f64::INFINITY,
            domain: 0.0,
            stretch: f64::INFINITY,
            steepest: f64::INFINITY,
        }
    }

    /// Whether the bounds are finite.
    pub(crate) fn is_proven(&self) -> bool {
        self.height_error.is_finite()
    }

    /// Greatest slope of f, g and h.
    pub(crate) fn steepest(&self) -> f64 {
        self.steepest
    }

    /// Box of the control points over a rectangle, in local coordinates.
    pub(crate) fn hull(
        &self,
        patch: &BezierPatch,
        rectangle: [DVec2; 2],
        space: &LocalSpace,
    ) -> [DVec3; 2] {
        hull(patch, rectangle, space)
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

fn hull(patch: &BezierPatch, [low, high]: [DVec2; 2], space: &LocalSpace) -> [DVec3; 2] {
    patch.subpatch(low, high).hull_bounds().map(|corner| space.point(corner))
}

impl Net {
    /// Places of the control points along one parameter, and the Bernstein coefficients of its square.
    fn abscissas(degree: usize) -> impl Fn(usize) -> [f64; 2] {
        let n = degree as f64;
        move |i| {
            let i = i as f64;
            let place = DOMAIN * (2.0 * i / n - 1.0);
            // the polar form of u² at n - i arguments -D and i arguments D, averaged over all pairs
            let pairs = (n - i) * (n - i - 1.0) + i * (i - 1.0) - 2.0 * (n - i) * i;
            [place, DOMAIN * DOMAIN * pairs / (n * (n - 1.0))]
        }
    }

    /// Raises degrees of 1 to 2, so that squares are in the space.
    fn raise_to_quadratic(&mut self) {
        let [m, n] = self.degree;
        if n == 1 {
            let rows = self.points.chunks_exact(2);
            self.points = rows.flat_map(|row| [row[0], 0.5 * (row[0] + row[1]), row[1]]).collect();
            self.degree[1] = 2;
        }
        if m == 1 {
            let (first, last) = self.points.split_at(self.degree[1] + 1);
            let between: Vec<_> = first.iter().zip(last).map(|(a, b)| 0.5 * (a + b)).collect();
            self.points = [first, &between, last].concat();
            self.degree[0] = 2;
        }
    }

    /// Subtracts a polynomial given by its coefficients for ([u, v], [u², v²]).
    fn subtract(&mut self, coefficient: impl Fn([f64; 2], [f64; 2]) -> DVec3) {
        let [m, n] = self.degree;
        let (along_u, along_v) = (Self::abscissas(m), Self::abscissas(n));
        for (flat, point) in self.points.iter_mut().enumerate() {
            let ([u, uu], [v, vv]) = (along_u(flat / (n + 1)), along_v(flat % (n + 1)));
            *point -= coefficient([u, v], [uu, vv]);
        }
    }

    /// The quadratic forms of the three components: half the second partials in the middle.
    fn forms(&self) -> [[f32; 3]; 3] {
        let [m, n] = self.degree;
        let (u, v) = (middle_weights(m), middle_weights(n));
        let mut sums = [DVec3::ZERO; 3];
        for (flat, &point) in self.points.iter().enumerate() {
            let (i, j) = (flat / (n + 1), flat % (n + 1));
            sums[0] += u[2][i] * v[0][j] * point;
            sums[1] += u[1][i] * v[1][j] * point;
            sums[2] += u[0][i] * v[2][j] * point;
        }
        let side = 2.0 * DOMAIN;
        let [uu, uv, vv] =
            [sums[0] / (2.0 * side * side), sums[1] / (side * side), sums[2] / (2.0 * side * side)];
        [0, 1, 2].map(|axis| [uu[axis], uv[axis], vv[axis]].map(nearest))
    }

    fn bounds(&self) -> Bounds {
        let [m, n] = self.degree;
        let mut bounds = Bounds { value: DVec3::ZERO, by_u: DVec3::ZERO, by_v: DVec3::ZERO };
        for (flat, &here) in self.points.iter().enumerate() {
            bounds.value = bounds.value.max(here.abs());
            if flat / (n + 1) < m {
                bounds.by_u = bounds.by_u.max((self.points[flat + n + 1] - here).abs());
            }
            if flat % (n + 1) < n {
                bounds.by_v = bounds.by_v.max((self.points[flat + 1] - here).abs());
            }
        }
        bounds.by_u *= m as f64 / (2.0 * DOMAIN);
        bounds.by_v *= n as f64 / (2.0 * DOMAIN);
        bounds
    }
}

/// Weights of control points in the value and the first two derivatives at 1/2.
fn middle_weights(degree: usize) -> [[f64; 13]; 3] {
    let value = |n: usize, i: usize| binomial(n, i) / (1_u64 << n) as f64;
    let mut weights = [[0.0; 13]; 3];
    let n = degree;
    for i in 0..=n {
        weights[0][i] += value(n, i);
    }
    for i in 0..n {
        let slope = n as f64 * value(n - 1, i);
        weights[1][i] -= slope;
        weights[1][i + 1] += slope;
    }
    for i in 0..n - 1 {
        let bend = (n * (n - 1)) as f64 * value(n - 2, i);
        weights[2][i] += bend;
        weights[2][i + 1] -= 2.0 * bend;
        weights[2][i + 2] += bend;
    }
    weights
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
    use super::*;
    use crate::test_support::Noise;

    #[test]
    fn the_bounds_hold() {
        let mut noise = Noise(5);
        let space = LocalSpace::around([DVec3::splat(-1.0), DVec3::splat(1.0)]);
        let mut proven = 0;
        for case in 0..400 {
            let degree = [1 + case % 6, 1 + case / 6 % 6];
            let points = (0..=degree[0]).flat_map(|i| (0..=degree[1]).map(move |j| (i, j)));
            let points = points.map(|(i, j)| {
                let flat = DVec3::new(i as f64 / degree[0] as f64, j as f64 / degree[1] as f64, 0.0);
                (flat + 0.1 * noise.vector()).extend(1.0)
            });
            let patch = BezierPatch::new(degree, points.collect());
            let low = 0.8 * DVec2::new(noise.next() + 0.5, noise.next() + 0.5);
            let (low, high) = (low, low + 0.1 + 0.05 * noise.next());
            let shape = Shape::of(&patch, [low, high], &space);
            proven += usize::from(shape.is_proven());
            if !shape.is_proven() {
                continue;
            }
            for _ in 0..50 {
                let uv = 2.0 * shape.domain.min(1.0) * DVec2::new(noise.next(), noise.next());
                let st = 0.5 * (low + high) + 0.5 * (high - low) * uv;
                let place = shape.to_leaf * (space.point(patch.eval(st).position) - shape.centre);
                let form = |part: usize, at: DVec2| {
                    let [a, b, c] = shape.forms[part].map(f64::from);
                    a * at.x * at.x + b * at.x * at.y + c * at.y * at.y
                };
                let forms = DVec3::new(form(0, uv), form(1, uv), form(2, uv));
                let off = place - uv.extend(0.0) - forms;
                assert!(off.abs().cmple(shape.rest).all(), "case {case}: {off} of {}", shape.rest);
                let p = place.truncate();
                assert!((place.z - form(2, p)).abs() <= shape.height_error, "case {case}: height");
                let back = p - DVec2::new(form(0, p), form(1, p));
                assert!((back - uv).abs().max_element() <= shape.place_error, "case {case}: place");
            }
        }
        assert!(proven > 100, "{proven}");
    }
}
