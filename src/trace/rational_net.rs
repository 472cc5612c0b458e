//! Control points of a part of a rational patch: its functions f, g and h are quotients.
//!
//! The surface is X / W with polynomials X, in leaf coordinates, and W. What a polynomial q leaves of it is R / W with
//! R = X - q W, whose Bernstein coefficients bound it.

use glam::{DVec3, DVec4};

use crate::math::bernstein::{MAX_DEGREE, binomial};
use crate::patch::BezierPatch;

use super::leaf::{DOMAIN, nearest};
use super::net::{Bounds, LeafMap, Series, middle_weights};

/// Greatest degree of q.
const RAISED: usize = 3;

/// Control points in one direction, at most.
const MOST: usize = MAX_DEGREE + RAISED + 1;

/// Weights over the domain that differ by more than this factor give no bounds: it is also how much rounding of R may grow.
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

/// Bernstein coefficients over the domain, raised by 3 degrees.
pub(super) struct RationalNet {
    degree: [usize; 2],
    coefficients: Vec<Coefficient>,
    weights: Weights,
    /// Derivatives of (X, W) in the middle, by u as often as the first index says and by v as the second.
    middle: [[DVec4; RAISED + 1]; RAISED + 1],
}

/// Coefficients of one index.
#[derive(Clone, Copy)]
struct Coefficient {
    /// Of R.
    left: DVec3,
    /// Of u^a v^b W.
    moments: Moments<f64>,
}

/// One value for each of u^a v^b with a + b <= 3, by the place a, b.
type Moments<T> = [[T; RAISED + 1]; RAISED + 1];

/// Bounds of W: the least value, and the greatest absolute partials.
struct Weights {
    least: f64,
    by_u: f64,
    by_v: f64,
}

impl RationalNet {
    /// `Err` if the weights allow no bounds, with how much they differ.
    pub(super) fn of(sub: &BezierPatch, map: &LeafMap) -> Result<Self, f64> {
        let [m, n] = sub.degree();
        let points: Vec<_> = sub.control_points().iter().map(|&point| map.homogeneous(point)).collect();
        let degree = [m + RAISED, n + RAISED];
        let middle = derivatives([m, n], &points);
        let coefficients = products([m, n], points);
        let weights = Weights::of(degree, &coefficients, middle[0][0].w)?;
        Ok(Self { degree, coefficients, weights, middle })
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
        for Coefficient { left, moments } in &mut self.coefficients {
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

    /// Bounds of R / W. It is a mean of the quotients of coefficients, those of W being positive, and its derivative is
    /// (R' - (R / W) W') / W.
    fn bounds(&self) -> Bounds {
        let [m, n] = self.degree;
        let mut bounds = Bounds { value: DVec3::ZERO, by_u: DVec3::ZERO, by_v: DVec3::ZERO };
        for (flat, here) in self.coefficients.iter().enumerate() {
            bounds.value = bounds.value.max(here.left.abs() / here.moments[0][0]);
            if flat / (n + 1) < m {
                bounds.by_u = bounds.by_u.max((self.coefficients[flat + n + 1].left - here.left).abs());
            }
            if flat % (n + 1) < n {
                bounds.by_v = bounds.by_v.max((self.coefficients[flat + 1].left - here.left).abs());
            }
        }
        let Weights { least, by_u, by_v } = self.weights;
        bounds.by_u = (bounds.by_u * (m as f64 / (2.0 * DOMAIN)) + bounds.value * by_u) / least;
        bounds.by_v = (bounds.by_v * (n as f64 / (2.0 * DOMAIN)) + bounds.value * by_v) / least;
        bounds
    }
}

impl Weights {
    fn of([m, n]: [usize; 2], coefficients: &[Coefficient], middle: f64) -> Result<Self, f64> {
        let weight = |flat: usize| coefficients[flat].moments[0][0];
        let (mut least, mut greatest) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut by_u, mut by_v) = (0.0_f64, 0.0_f64);
        for flat in 0..coefficients.len() {
            least = least.min(weight(flat));
            greatest = greatest.max(weight(flat));
            if flat / (n + 1) < m {
                by_u = by_u.max((weight(flat + n + 1) - weight(flat)).abs());
            }
            if flat % (n + 1) < n {
                by_v = by_v.max((weight(flat + 1) - weight(flat)).abs());
            }
        }
        // so written, NaN gives no bounds
        if !(least > 0.0 && greatest <= MAX_SPREAD * least) {
            let spread = (greatest - least) / middle;
            return Err(if spread > 0.0 { 1.0 + spread } else { f64::INFINITY });
        }
        let (per_u, per_v) = (m as f64 / (2.0 * DOMAIN), n as f64 / (2.0 * DOMAIN));
        Ok(Self { least, by_u: by_u * per_u, by_v: by_v * per_v })
    }
}

/// Derivatives in the middle, of total order 3 at most.
fn derivatives([m, n]: [usize; 2], points: &[DVec4]) -> [[DVec4; RAISED + 1]; RAISED + 1] {
    let (along_u, along_v) = (middle_weights(m), middle_weights(n));
    let mut sums = [[DVec4::ZERO; RAISED + 1]; RAISED + 1];
    for (i, row) in points.chunks_exact(n + 1).enumerate() {
        let mut along = [DVec4::ZERO; RAISED + 1];
        for (j, &point) in row.iter().enumerate() {
            for (sum, weights) in along.iter_mut().zip(&along_v) {
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
    // (X, W) times v^b: for b > 0 only W
    let mut rows = vec![(DVec4::ZERO, [0.0; RAISED]); (m + 1) * columns];
    for (i, (row, raised)) in points.chunks_exact_mut(n + 1).zip(rows.chunks_exact_mut(columns)).enumerate() {
        for (j, point) in row.iter_mut().enumerate() {
            *point *= binomial(m, i) * binomial(n, j);
            for shift in 0..=RAISED {
                let (sum, moments) = &mut raised[j + shift];
                *sum += POWERS[0][shift] * *point;
                for (moment, power) in moments.iter_mut().zip(&POWERS[1..]) {
                    *moment += power[shift] * point.w;
                }
            }
        }
    }
    let mut by_column = [0.0; MOST];
    for (l, inverse) in by_column[..columns].iter_mut().enumerate() {
        *inverse = 1.0 / binomial(n + RAISED, l);
    }
    let mut coefficients = Vec::with_capacity((m + RAISED + 1) * columns);
    for k in 0..=m + RAISED {
        let from = k.saturating_sub(RAISED);
        let inverse = 1.0 / binomial(m + RAISED, k);
        let of_row = by_column[..columns].iter().enumerate().map(|(l, by_column)| {
            let terms = (from..=k.min(m)).map(|i| (k - i, &rows[i * columns + l]));
            raised(terms, inverse * by_column)
        });
        coefficients.extend(of_row);
    }
    coefficients
}

/// `scale` times the sum of terms along u, each given with its place in [`POWERS`].
fn raised<'a>(terms: impl Iterator<Item = (usize, &'a (DVec4, [f64; RAISED]))>, scale: f64) -> Coefficient {
    let (mut sum, mut moments) = (DVec4::ZERO, [[0.0; RAISED + 1]; RAISED + 1]);
    for (shift, &(point, [v, vv, vvv])) in terms {
        let [one, u, uu, uuu] = POWERS.map(|power| power[shift]);
        sum += one * point;
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
    Coefficient { left: sum.truncate() * scale, moments: moments.map(|row| row.map(|moment| moment * scale)) }
}
