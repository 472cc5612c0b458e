//! Control points of a part of a patch in leaf coordinates, and what they say of the functions f, g and h of a `HeightGraph`.

use std::sync::LazyLock;

use glam::{DMat3, DVec3, DVec4};

use crate::math::bernstein::{MAX_ORDER, binomial};
use crate::patch::BezierPatch;

use super::local::LocalSpace;
use super::single_precision::nearest;

/// Bounds hold for |u|, |v| up to this: see [`HeightGraph`](super::height_graph::HeightGraph).
pub(crate) const DOMAIN: f64 = 1.25;

/// From the world to leaf coordinates.
pub(super) struct LeafMap<'a> {
    pub(super) space: &'a LocalSpace,
    /// The local point that becomes the origin.
    pub(super) centre: DVec3,
    pub(super) to_leaf: DMat3,
}

/// The first terms of f, g and h, and bounds on what they leave.
pub(super) struct Series {
    /// Coefficients of u², u v, v² of f, g and h.
    pub(super) forms: [[f32; 3]; 3],
    /// Coefficients of u³, u² v, u v², v³ of h.
    pub(super) h_cubic: [f64; 4],
    /// Bounds of f, g and h; of what is left of them without their quadratic forms; and of h without its cubic form as well.
    pub(super) bounds: [Bounds; 3],
}

/// Absolute bounds of f, g and h: of values, and of partials by u and v.
pub(super) struct Bounds {
    pub(super) value: DVec3,
    pub(super) by_u: DVec3,
    pub(super) by_v: DVec3,
}

/// Control points over the domain of a patch without weights.
pub(super) struct Net {
    degree: [usize; 2],
    points: Vec<DVec3>,
}

/// For each degree and control point the Bernstein coefficients of u, u² and u³; 0 for powers above the degree.
static POWERS: LazyLock<[[[f64; 3]; MAX_ORDER]; MAX_ORDER]> =
    LazyLock::new(|| std::array::from_fn(|degree| std::array::from_fn(|i| powers(degree, i))));

/// For each degree what [`middle_weights`] gives.
pub(super) static MIDDLE_WEIGHTS: LazyLock<[[[f64; MAX_ORDER]; 4]; MAX_ORDER]> =
    LazyLock::new(|| std::array::from_fn(middle_weights));

fn powers(degree: usize, i: usize) -> [f64; 3] {
    if i > degree {
        return [0.0; 3];
    }
    // the polar forms at n - i arguments -D and i arguments D: products of their signs, averaged over all ordered pairs
    // and triples
    let n = degree as f64;
    let sum = 2.0 * i as f64 - n;
    let triples =
        if degree > 2 { sum * (sum * sum - 3.0 * n + 2.0) / (n * (n - 1.0) * (n - 2.0)) } else { 0.0 };
    let pairs = if degree > 1 { (sum * sum - n) / (n * (n - 1.0)) } else { 0.0 };
    let single = if degree > 0 { sum / n } else { 0.0 };
    [DOMAIN * single, DOMAIN * DOMAIN * pairs, DOMAIN * DOMAIN * DOMAIN * triples]
}

impl LeafMap<'_> {
    /// A point of the world.
    fn point(&self, world: DVec3) -> DVec3 {
        self.to_leaf * (self.space.point(world) - self.centre)
    }

    /// A homogeneous point (w x, w y, w z, w) of the world, of either sign.
    pub(super) fn homogeneous(&self, world: DVec4) -> DVec4 {
        (self.to_leaf * (self.space.homogeneous(world) - world.w * self.centre)).extend(world.w)
    }
}

impl Net {
    pub(super) fn new(sub: &BezierPatch, map: &LeafMap) -> Self {
        let points = sub.positions().map(|point| map.point(point)).collect();
        Self { degree: sub.degree(), points }
    }

    pub(super) fn series(mut self) -> Series {
        self.raise_to_quadratic();
        self.subtract(|[u, _, _], [v, _, _]| DVec3::new(u, v, 0.0));
        let whole = self.bounds();
        let (forms, h_cubic) = self.forms();
        self.subtract(|[u, uu, _], [v, vv, _]| {
            let form = |[a, b, c]: [f32; 3]| f64::from(a) * uu + f64::from(b) * (u * v) + f64::from(c) * vv;
            DVec3::new(form(forms[0]), form(forms[1]), form(forms[2]))
        });
        let rest = self.bounds();
        self.subtract(|[u, uu, uuu], [v, vv, vvv]| {
            let [a, b, c, d] = h_cubic;
            DVec3::new(0.0, 0.0, a * uuu + b * (uu * v) + c * (u * vv) + d * vvv)
        });
        Series { forms, h_cubic, bounds: [whole, rest, self.bounds()] }
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

    /// Subtracts a polynomial given by its coefficients for [u, u², u³] and [v, v², v³].
    fn subtract(&mut self, coefficient: impl Fn([f64; 3], [f64; 3]) -> DVec3) {
        let [m, n] = self.degree;
        let (along_u, along_v) = (&POWERS[m], &POWERS[n]);
        for (row, &u) in self.points.chunks_exact_mut(n + 1).zip(along_u) {
            for (point, &v) in row.iter_mut().zip(along_v) {
                *point -= coefficient(u, v);
            }
        }
    }

    /// The quadratic forms of the three components and the cubic one of the third, from the derivatives in the middle.
    fn forms(&self) -> ([[f32; 3]; 3], [f64; 4]) {
        let [m, n] = self.degree;
        let (u, v) = (&MIDDLE_WEIGHTS[m], &MIDDLE_WEIGHTS[n]);
        let mut sums = [DVec3::ZERO; 3];
        let mut cubic = [0.0; 4];
        for (i, row) in self.points.chunks_exact(n + 1).enumerate() {
            // values and derivatives along v
            let mut along = [DVec3::ZERO; 4];
            for (j, &point) in row.iter().enumerate() {
                for (sum, weights) in along.iter_mut().zip(v) {
                    *sum += weights[j] * point;
                }
            }
            for k in 0..3 {
                sums[k] += u[2 - k][i] * along[k];
            }
            for k in 0..4 {
                cubic[k] += u[3 - k][i] * along[k].z;
            }
        }
        let [uu, uv, vv] = [0.5 * sums[0], sums[1], 0.5 * sums[2]];
        let [uuu, uuv, uvv, vvv] = cubic;
        (
            [0, 1, 2].map(|axis| [uu[axis], uv[axis], vv[axis]].map(nearest)),
            [uuu / 6.0, uuv / 2.0, uvv / 2.0, vvv / 6.0],
        )
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

/// Weights of control points in the value and the first three derivatives by u at 0.
fn middle_weights(degree: usize) -> [[f64; MAX_ORDER]; 4] {
    let mut weights = [[0.0; MAX_ORDER]; 4];
    for (order, weights) in weights.iter_mut().enumerate().take(degree + 1) {
        // n (n - 1) … times the differences of this order of the control points, by the basis of the degree left
        let left = degree - order;
        let factor: f64 = (left + 1..=degree).map(|k| k as f64 / (2.0 * DOMAIN)).product();
        for i in 0..=left {
            let value = factor * binomial(left, i) / (1_u64 << left) as f64;
            for k in 0..=order {
                let sign = if (order - k) % 2 == 0 { 1.0 } else { -1.0 };
                weights[i + k] += sign * binomial(order, k) * value;
            }
        }
    }
    weights
}
