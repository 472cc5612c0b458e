//! Control points of a part of a rational patch: its functions f, g and h are quotients.
//!
//! The surface is X / W with polynomials X, in leaf coordinates, and W. What a polynomial q leaves of it is R / W with
//! R = X - q W, whose Bernstein coefficients bound it.

use glam::{DVec3, DVec4};

use crate::math::bernstein::{MAX_DEGREE, binomial};
use crate::patch::BezierPatch;

use super::net::{Bounds, DOMAIN, LeafMap, MIDDLE_WEIGHTS, Series};
use super::single_precision::nearest;

/// Greatest degree of q.
const RAISED: usize = 3;

/// Control points in one direction, at most.
const MOST: usize = MAX_DEGREE + RAISED + 1;

/// Weights over the domain that differ by more than this factor give no bounds: rounding of R may grow by as much.
const MAX_SPREAD: f64 = 64.0;

/// Coefficients of u^a by those of degree 3, times their binomials: of (x - y)^a (x + y)^(3 - a) with u = D (x - y) and
/// x + y = 1.
const POWERS: [[f64; RAISED + 1]; RAISED + 1] = [
    [1.0, 3.0, 3.0, 1.0],
    [-DOMAIN, -DOMAIN, DOMAIN, DOMAIN],
    [DOMAIN * DOMAIN, -DOMAIN * DOMAIN, -DOMAIN * DOMAIN, DOMAIN * DOMAIN],
    [
        -DOMAIN * DOMAIN * DOMAIN,
        3.0 * DOMAIN * DOMAIN * DOMAIN,
        -3.0 * DOMAIN * DOMAIN * DOMAIN,
        DOMAIN * DOMAIN * DOMAIN,
    ],
];

/// Coefficients of 1 by those of degree 2, times their binomials.
const LOWERED: [f64; RAISED + 1] = [1.0, 2.0, 1.0, 0.0];

/// Bernstein coefficients over the domain, raised by 3 degrees.
pub(super) struct RationalNet {
    degree: [usize; 2],
    coefficients: Vec<Coefficient>,
    /// Derivatives of (X, W) in the middle, by u as often as the first index says and by v as the second.
    middle: [[DVec4; RAISED + 1]; RAISED + 1],
}

/// Coefficients of one index.
#[derive(Clone, Copy)]
struct Coefficient {
    /// That of R.
    left: DVec3,
    /// Those of u^a v^b W.
    moments: Moments<f64>,
    /// Those of W with one degree less along u, as R's partial by u has, and along v; none in the last row or column.
    lowered: [f64; 2],
}

/// One value for each of u^a v^b with a + b <= 3, by the place a, b.
type Moments<T> = [[T; RAISED + 1]; RAISED + 1];

/// A coefficient along v, before those along u are taken together.
#[derive(Clone, Copy)]
struct RowCoefficient {
    /// That of (X, W).
    point: DVec4,
    /// Those of v W, v² W, v³ W.
    moments: [f64; RAISED],
    /// That of W with one degree less.
    lowered: f64,
}

impl RationalNet {
    /// `Err` if the weights allow no bounds, with how much they differ.
    pub(super) fn try_new(sub: &BezierPatch, map: &LeafMap) -> Result<Self, f64> {
        let [m, n] = sub.degree();
        let points: Vec<_> = sub.control_points().map(|point| map.homogeneous(point)).collect();
        let degree = [m + RAISED, n + RAISED];
        let middle = derivatives([m, n], &points);
        let coefficients = products([m, n], points);
        let net = Self { degree, coefficients, middle };
        let [least, greatest] = net.weights();
        // so written, NaN gives no bounds
        if least > 0.0 && greatest <= MAX_SPREAD * least {
            return Ok(net);
        }
        let spread = (greatest - least) / net.middle[0][0].w;
        Err(if spread > 0.0 { 1.0 + spread } else { f64::INFINITY })
    }

    /// Least and greatest coefficient of W in all its degrees.
    fn weights(&self) -> [f64; 2] {
        let [m, n] = self.degree;
        let (mut least, mut greatest) = (f64::INFINITY, f64::NEG_INFINITY);
        for (flat, Coefficient { moments, lowered, .. }) in self.coefficients.iter().enumerate() {
            least = least.min(moments[0][0]);
            greatest = greatest.max(moments[0][0]);
            if flat / (n + 1) < m {
                least = least.min(lowered[0]);
            }
            if flat % (n + 1) < n {
                least = least.min(lowered[1]);
            }
        }
        [least, greatest]
    }

    pub(super) fn series(mut self) -> Series {
        self.subtract(|w| DVec3::new(w[1][0], w[0][1], 0.0));
        let whole = self.bounds();
        let (forms, h_cubic) = self.forms();
        self.subtract(|w| {
            let form = |[a, b, c]: [f32; 3]| {
                f64::from(a) * w[2][0] + f64::from(b) * w[1][1] + f64::from(c) * w[0][2]
            };
            DVec3::new(form(forms[0]), form(forms[1]), form(forms[2]))
        });
        let rest = self.bounds();
        self.subtract(|w| {
            let [a, b, c, d] = h_cubic;
            DVec3::new(0.0, 0.0, a * w[3][0] + b * w[2][1] + c * w[1][2] + d * w[0][3])
        });
        Series { forms, h_cubic, bounds: [whole, rest, self.bounds()] }
    }

    /// Subtracts q W, given by the coefficients of u^a v^b W.
    fn subtract(&mut self, coefficient: impl Fn(&Moments<f64>) -> DVec3) {
        for Coefficient { left, moments, .. } in &mut self.coefficients {
            *left -= coefficient(moments);
        }
    }

    /// The quadratic forms of the three components and the cubic one of the third, in the middle.
    fn forms(&self) -> ([[f32; 3]; 3], [f64; 4]) {
        // the coefficients of the power series of X and W, and of their quotient: what lower terms leave of X over W
        let factorial = [1.0, 1.0, 2.0, 6.0];
        let mut weight: Moments<f64> = [[0.0; 4]; 4];
        let mut series: Moments<DVec3> = [[DVec3::ZERO; 4]; 4];
        for order in 0..=RAISED {
            for a in 0..=order {
                let b = order - a;
                let term = self.middle[a][b] / (factorial[a] * factorial[b]);
                weight[a][b] = term.w;
                let mut left = term.truncate();
                for i in 0..=a {
                    for j in (0..=b).take_while(|j| i + j < order) {
                        left -= series[i][j] * weight[a - i][b - j];
                    }
                }
                series[a][b] = left / weight[0][0];
            }
        }
        let quadratic = [series[2][0], series[1][1], series[0][2]];
        (
            [0, 1, 2].map(|axis| quadratic.map(|term| nearest(term[axis]))),
            [series[3][0].z, series[2][1].z, series[1][2].z, series[0][3].z],
        )
    }

    /// Bounds of R / W. With W's coefficients positive it is a mean of the quotients of coefficients; so is its derivative
    /// (R' - (R / W) W') / W, if R / W is taken for a number.
    fn bounds(&self) -> Bounds {
        let [m, n] = self.degree;
        let mut bounds = Bounds { value: DVec3::ZERO, by_u: DVec3::ZERO, by_v: DVec3::ZERO };
        for here in &self.coefficients {
            bounds.value = bounds.value.max(here.left.abs() / here.moments[0][0]);
        }
        let value = bounds.value;
        let slope = |here: &Coefficient, next: &Coefficient, lowered: f64| {
            let change = value * (next.moments[0][0] - here.moments[0][0]).abs();
            ((next.left - here.left).abs() + change) / lowered
        };
        for (flat, here) in self.coefficients.iter().enumerate() {
            if flat / (n + 1) < m {
                let next = &self.coefficients[flat + n + 1];
                bounds.by_u = bounds.by_u.max(slope(here, next, here.lowered[0]));
            }
            if flat % (n + 1) < n {
                let next = &self.coefficients[flat + 1];
                bounds.by_v = bounds.by_v.max(slope(here, next, here.lowered[1]));
            }
        }
        bounds.by_u *= m as f64 / (2.0 * DOMAIN);
        bounds.by_v *= n as f64 / (2.0 * DOMAIN);
        bounds
    }
}

/// Derivatives in the middle, of total order 3 at most.
fn derivatives([m, n]: [usize; 2], points: &[DVec4]) -> [[DVec4; RAISED + 1]; RAISED + 1] {
    let (along_u, along_v) = (&MIDDLE_WEIGHTS[m], &MIDDLE_WEIGHTS[n]);
    let mut sums = [[DVec4::ZERO; RAISED + 1]; RAISED + 1];
    for (i, row) in points.chunks_exact(n + 1).enumerate() {
        let mut along = [DVec4::ZERO; RAISED + 1];
        for (j, &point) in row.iter().enumerate() {
            for (sum, weights) in along.iter_mut().zip(along_v) {
                *sum += weights[j] * point;
            }
        }
        for a in 0..=RAISED {
            for b in 0..=RAISED - a {
                sums[a][b] += along_u[a][i] * along[b];
            }
        }
    }
    sums
}

/// Coefficients of X, and of W times powers of u and v, of degree (m + 3, n + 3).
///
/// Coefficients times binomials multiply as those of powers do.
fn products([m, n]: [usize; 2], mut points: Vec<DVec4>) -> Vec<Coefficient> {
    let columns = n + RAISED + 1;
    let none = RowCoefficient { point: DVec4::ZERO, moments: [0.0; RAISED], lowered: 0.0 };
    let mut rows = vec![none; (m + 1) * columns];
    for (i, (row, raised)) in points.chunks_exact_mut(n + 1).zip(rows.chunks_exact_mut(columns)).enumerate() {
        for (j, point) in row.iter_mut().enumerate() {
            *point *= binomial(m, i) * binomial(n, j);
            for shift in 0..=RAISED {
                let sum = &mut raised[j + shift];
                sum.point += POWERS[0][shift] * *point;
                sum.lowered += LOWERED[shift] * point.w;
                for (moment, power) in sum.moments.iter_mut().zip(&POWERS[1..]) {
                    *moment += power[shift] * point.w;
                }
            }
        }
    }
    let (degree_u, degree_v) = (m + RAISED, n + RAISED);
    let mut by_column = [0.0; MOST];
    for (l, inverse) in by_column[..columns].iter_mut().enumerate() {
        *inverse = 1.0 / binomial(degree_v, l);
    }
    // what the binomial of one degree less is smaller by
    let ratio = |degree: usize, i: usize| degree as f64 / (degree - i).max(1) as f64;
    let mut coefficients = Vec::with_capacity((degree_u + 1) * columns);
    for k in 0..=degree_u {
        let from = k.saturating_sub(RAISED);
        let (by_row, row_ratio) = (1.0 / binomial(degree_u, k), ratio(degree_u, k));
        for (l, by_column) in by_column[..columns].iter().enumerate() {
            let terms = (from..=k.min(m)).map(|i| (k - i, &rows[i * columns + l]));
            let mut sum = raised(terms, by_row * by_column);
            sum.lowered[0] *= row_ratio;
            sum.lowered[1] *= ratio(degree_v, l);
            coefficients.push(sum);
        }
    }
    coefficients
}

/// `scale` times the sum of terms along u, each given with its place in [`POWERS`].
fn raised<'a>(terms: impl Iterator<Item = (usize, &'a RowCoefficient)>, scale: f64) -> Coefficient {
    let (mut sum, mut moments) = (DVec4::ZERO, [[0.0; RAISED + 1]; RAISED + 1]);
    let (mut by_u, mut by_v) = (0.0, 0.0);
    for (shift, &RowCoefficient { point, moments: [v, vv, vvv], lowered }) in terms {
        let [one, u, uu, uuu] = POWERS.map(|power| power[shift]);
        sum += one * point;
        by_u += LOWERED[shift] * point.w;
        by_v += one * lowered;
        moments[1][0] += u * point.w;
        moments[2][0] += uu * point.w;
        moments[3][0] += uuu * point.w;
        moments[0][1] += one * v;
        moments[1][1] += u * v;
        moments[2][1] += uu * v;
        moments[0][2] += one * vv;
        moments[1][2] += u * vv;
        moments[0][3] += one * vvv;
    }
    moments[0][0] = sum.w;
    Coefficient {
        left: sum.truncate() * scale,
        moments: moments.map(|row| row.map(|moment| moment * scale)),
        lowered: [by_u * scale, by_v * scale],
    }
}
