//! Cells against formulas written down once more, plainly and over complex numbers: partial derivatives are then imaginary
//! parts of values a tiny imaginary step away (Squire and Trapp 1998, *Using complex variables to estimate derivatives*).

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3, DVec4};
use num_complex::Complex64 as Complex;

use super::jet::Jet;
use super::{Chain, CoverSettings, Expression, Extension, ExtensionMode, Field, Region, Step, cover};
use crate::analytic::branch::ByValue;
use crate::patch::{BezierPatch, Chart, Face, Shell};
use crate::spline::SplineVolume;
use crate::subdivide::Frame;
use crate::test_support::{Noise, random_volume};

type Point = [Complex; 3];

/// A base patch over the unit square of (u, v) with steps.
struct Case {
    name: &'static str,
    base: BezierPatch,
    steps: Vec<Step>,
    plain: Box<dyn Fn(Complex, Complex) -> Point>,
}

fn expression(text: &str) -> Expression {
    Expression::parse(text).unwrap()
}

fn region(bound: &str, index: u32, h: [[f64; 3]; 3]) -> Region {
    Region {
        bound: expression(bound),
        center: DVec3::ZERO,
        index,
        h,
        epsilon: [[1.0, -1.0, 1.0], [1.0, 1.0, -1.0], [-1.0, 1.0, 1.0]],
        factor: None,
    }
}

fn diagonal(h: f64) -> [[f64; 3]; 3] {
    [[h, 0.0, 0.0], [0.0, h, 0.0], [0.0, 0.0, h]]
}

fn sheet(rational: bool) -> BezierPatch {
    let mut noise = Noise(3);
    let points = (0..9).map(|k| {
        let (i, j) = (f64::from(k / 3), f64::from(k % 3));
        let point = DVec3::new(0.1 + 0.4 * i, 0.1 + 0.4 * j, 0.5) + 0.12 * noise.vector();
        let weight = if rational { 1.0 + 0.4 * noise.next() } else { 1.0 };
        (point * weight).extend(weight)
    });
    BezierPatch::new([2, 2], points.collect())
}

fn plain_patch(patch: &BezierPatch, u: Complex, v: Complex) -> Point {
    let [m, n] = patch.degree();
    let bernstein = |n: usize, i: usize, x: Complex| {
        let binomial: f64 = (1..=i).map(|k| (n + 1 - k) as f64 / k as f64).product();
        binomial * x.powu(u32::try_from(i).unwrap()) * (1.0 - x).powu(u32::try_from(n - i).unwrap())
    };
    let mut sum = [Complex::ZERO; 4];
    for (k, point) in patch.control_points().enumerate() {
        let factor = bernstein(m, k / (n + 1), u) * bernstein(n, k % (n + 1), v);
        for (sum, part) in sum.iter_mut().zip(point.to_array()) {
            *sum += factor * part;
        }
    }
    [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]]
}

/// By the recursion of Cox and de Boor, with the knot interval of the real part.
fn plain_volume(volume: &SplineVolume, [x, y, z]: Point) -> Point {
    fn basis(knots: &[f64], i: usize, k: usize, x: Complex, interval: usize) -> Complex {
        if k == 0 {
            return Complex::from(if i == interval { 1.0 } else { 0.0 });
        }
        let part = |low: usize, numerator: Complex, high: usize, next: usize| {
            let width = knots[high] - knots[low];
            if width == 0.0 {
                Complex::ZERO
            } else {
                numerator / width * basis(knots, next, k - 1, x, interval)
            }
        };
        part(i, x - knots[i], i + k, i) + part(i + 1, knots[i + k + 1] - x, i + k + 1, i + 1)
    }
    let [nx, ny, nz] = volume.points();
    let along = |axis: usize, x: Complex, count: usize| {
        let knots = &volume.axes()[axis];
        let interval = knots.degree() + knots.interval(x.re).expect("in the volume");
        (0..count).map(|i| basis(knots.knots(), i, knots.degree(), x, interval)).collect::<Vec<_>>()
    };
    let (bx, by, bz) = (along(0, x, nx), along(1, y, ny), along(2, z, nz));
    let mut sum = [Complex::ZERO; 4];
    for (k, point) in volume.control_points().iter().enumerate() {
        let factor = bx[k / (ny * nz)] * by[k / nz % ny] * bz[k % nz] * point.w;
        for (sum, part) in sum.iter_mut().zip([point.x, point.y, point.z, 1.0]) {
            *sum += factor * part;
        }
    }
    [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]]
}

/// A disc's φ, and E - 1 of an exponent where it is not above 0.
fn disc(u: Complex, v: Complex, [cu, cv, radius]: [f64; 3]) -> Complex {
    ((u - cu) * (u - cu) + (v - cv) * (v - cv)) / (radius * radius) - 1.0
}

fn growth(phi: Complex, h: f64, n: u32) -> Complex {
    if phi.re <= 0.0 { (h * phi.powu(n)).exp() - 1.0 } else { Complex::ZERO }
}

fn apply(matrix: &DMat3, vector: Point) -> Point {
    [0, 1, 2].map(|row| {
        let row = matrix.row(row);
        vector[0] * row.x + vector[1] * row.y + vector[2] * row.z
    })
}

fn plus(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

const MIDDLE: &str = "((u-0.5)^2 + (v-0.5)^2)/0.09 - 1";
const CORNER: &str = "((u-0.7)^2 + (v-0.6)^2)/0.04 - 1";

const H: [[f64; 3]; 3] = [[0.3, 0.2, 0.0], [0.0, -0.4, 0.25], [0.1, 0.0, 0.5]];

fn operator_frame() -> (DVec3, DMat3) {
    let axes = DMat3::from_cols(
        DVec3::new(1.0, 0.2, 0.0).normalize(),
        DVec3::new(0.0, 1.0, 0.3).normalize(),
        DVec3::new(0.5, 0.0, 1.0).normalize(),
    );
    (DVec3::new(0.3, 0.2, 0.1), axes)
}

fn operator() -> Step {
    let (center, axes) = operator_frame();
    let regions = vec![region(MIDDLE, 2, H), region(CORNER, 3, H)];
    Step::Extension(Extension::try_new(ExtensionMode::Operator { center, axes }, regions).unwrap())
}

fn plain_operator(point: Point, u: Complex, v: Complex) -> Point {
    let (center, axes) = operator_frame();
    let epsilon = region(MIDDLE, 2, H).epsilon;
    let mut local = apply(&axes.inverse(), [point[0] - center.x, point[1] - center.y, point[2] - center.z]);
    // the last region is applied first
    for (disc, n) in [(disc(u, v, [0.7, 0.6, 0.2]), 3), (disc(u, v, [0.5, 0.5, 0.3]), 2)] {
        let change: Point = std::array::from_fn(|i| {
            (0..3)
                .map(|j| {
                    let sign = if i == j { 1.0 } else { epsilon[i][j] };
                    sign * growth(disc, H[i][j], n) * local[j]
                })
                .sum()
        });
        local = plus(local, change);
    }
    plus(apply(&axes, local), [center.x, center.y, center.z].map(Complex::from))
}

fn cases() -> Vec<Case> {
    [extensions(), volumes()].into_iter().flatten().collect()
}

fn extensions() -> Vec<Case> {
    let of_centers = [DVec3::new(0.5, 0.4, 0.0), DVec3::new(0.2, 0.9, 0.3)];
    let radial = [(MIDDLE, of_centers[0], -0.4, 3), (CORNER, of_centers[1], 0.3, 2)];
    let radial_regions =
        radial.map(|(bound, center, h, n)| Region { center, ..region(bound, n, diagonal(h)) });
    let field = ["u - 0.2", "v*u", "1 + sin(3*v)"];
    let field = Box::new(field.map(expression));
    let factor = Some(expression("exp(-(u^2+v^2)/2)"));
    vec![
        Case {
            name: "operator, two regions",
            base: sheet(false),
            steps: vec![operator()],
            plain: Box::new(move |u, v| plain_operator(plain_patch(&sheet(false), u, v), u, v)),
        },
        Case {
            name: "radial, two centers",
            base: sheet(false),
            steps: vec![Step::Extension(
                Extension::try_new(ExtensionMode::Radial, radial_regions.to_vec()).unwrap(),
            )],
            plain: Box::new(move |u, v| {
                let point = plain_patch(&sheet(false), u, v);
                let parts = [(disc(u, v, [0.5, 0.5, 0.3]), 0), (disc(u, v, [0.7, 0.6, 0.2]), 1)];
                parts.into_iter().fold(point, |sum, (disc, k)| {
                    let (_, center, h, n) = radial[k];
                    let growth = growth(disc, h, n);
                    plus(sum, std::array::from_fn(|axis| growth * (point[axis] - center[axis])))
                })
            }),
        },
        Case {
            name: "field of expressions, factor",
            base: sheet(true),
            steps: vec![Step::Extension(
                Extension::try_new(
                    ExtensionMode::Field(Field::Expressions(field)),
                    vec![Region { factor, ..region(MIDDLE, 4, diagonal(0.7)) }],
                )
                .unwrap(),
            )],
            plain: Box::new(move |u, v| {
                let along = [u - 0.2, v * u, 1.0 + (3.0 * v).sin()];
                let length = (along[0] * along[0] + along[1] * along[1] + along[2] * along[2]).sqrt();
                let phi = disc(u, v, [0.5, 0.5, 0.3]);
                let exponent = 0.7 * (-(u * u + v * v) / 2.0).exp() * phi.powu(4);
                let growth = if phi.re <= 0.0 { exponent.exp() - 1.0 } else { Complex::ZERO };
                plus(plain_patch(&sheet(true), u, v), along.map(|part| growth * part / length))
            }),
        },
    ]
}

fn volumes() -> Vec<Case> {
    let mut noise = Noise(11);
    let volume = random_volume(&mut noise, [2, 3, 2], [4, 5, 4], 0.2, false);
    let weighted = random_volume(&mut noise, [3, 2, 2], [5, 4, 4], 0.15, true);
    let (large, large_weighted) = (around(&volume), around(&weighted));
    vec![
        Case {
            name: "two volumes, one rational, on a rational patch",
            base: sheet(true),
            steps: vec![Step::Volume(volume.clone()), Step::Volume(large_weighted.clone())],
            plain: Box::new(move |u, v| {
                plain_volume(&large_weighted, plain_volume(&volume, plain_patch(&sheet(true), u, v)))
            }),
        },
        Case {
            name: "volume after operator",
            base: sheet(false),
            steps: vec![operator(), Step::Volume(large.clone())],
            plain: Box::new(move |u, v| {
                plain_volume(&large, plain_operator(plain_patch(&sheet(false), u, v), u, v))
            }),
        },
    ]
}

/// The same volume over a box that holds what the others make of the unit cube.
fn around(volume: &SplineVolume) -> SplineVolume {
    let bounds = [DVec3::splat(-1.0), DVec3::splat(2.0)];
    let identity = SplineVolume::identity(volume.degree(), volume.points(), bounds).unwrap();
    let control_points: Vec<DVec4> =
        volume.control_points().iter().map(|p| (3.0 * p.truncate() - 1.0).extend(p.w)).collect();
    SplineVolume::try_new(identity.axes().clone(), &control_points).unwrap()
}

fn unit_frame() -> Frame {
    Frame { origin: DVec3::ZERO, s: DVec3::X, t: DVec3::Y }
}

fn covered(base: &BezierPatch, steps: Vec<Step>) -> Vec<Face> {
    let base = Shell::from(vec![Face::untrimmed(Chart::Plane(unit_frame()), base.clone())]);
    cover(&base, &Arc::new(Chain::try_new(steps).unwrap()), CoverSettings::default())
        .unwrap()
        .shell
        .into_faces()
}

fn real(point: Point) -> DVec3 {
    DVec3::from_array(point.map(|part| part.re))
}

#[test]
fn cells_are_their_formulas() {
    const STEP: f64 = 1e-30;
    for Case { name, base, steps, plain } in cases() {
        let patches = covered(&base, steps);
        assert!(patches.iter().any(|patch| patch.exact.as_ref().is_some_and(|exact| exact.error() > 0.0)));
        let mut noise = Noise(7);
        let mut checked = 0;
        for patch in &patches {
            let exact = patch.exact.as_ref().expect("these degrees are not modest");
            for _ in 0..20 {
                let st = DVec2::new(noise.next() + 0.5, noise.next() + 0.5);
                let uv = patch.chart.place(st).coordinates();
                if !exact.holds(st, DVec2::ZERO) {
                    continue;
                }
                checked += 1;
                let [u, v] = [uv.x, uv.y].map(Complex::from);
                let point = exact.eval(st);
                let off = point.position.distance(real(plain(u, v)));
                assert!(off < 1e-14, "{name}: position off by {off:e} at {uv}");
                let small = Complex::new(0.0, STEP);
                let by_u = DVec3::from_array(plain(u + small, v).map(|x| x.im / STEP))
                    * patch.chart.coordinates()[1].x;
                let by_v = DVec3::from_array(plain(u, v + small).map(|x| x.im / STEP))
                    * patch.chart.coordinates()[2].y;
                for (got, want) in [(point.dp_ds, by_u), (point.dp_dt, by_v)] {
                    assert!((got - want).length() < 1e-12 * want.length(), "{name}: {got} {want} at {uv}");
                }
                let off = patch.patch.eval(st).position.distance(point.position);
                assert!(
                    off <= exact.error() + 1e-15,
                    "{name}: the patch is {off:e} off at {st}, proven {:e}",
                    exact.error()
                );
            }
        }
        assert!(checked > 500, "{name}: {checked}");
    }
}

#[test]
fn every_place_is_in_one_piece() {
    for Case { name, base, steps, .. } in cases() {
        let patches = covered(&base, steps);
        let shared = patches.iter().filter(|patch| !patch.leads()).count();
        assert!(shared > 10, "{name}: {shared}");
        let mut noise = Noise(9);
        for _ in 0..3000 {
            let uv = DVec2::new(noise.next() + 0.5, noise.next() + 0.5);
            let mut owners = 0;
            for patch in &patches {
                let (origin, size) = (
                    patch.chart.coordinates()[0].truncate(),
                    DVec2::new(patch.chart.coordinates()[1].x, patch.chart.coordinates()[2].y),
                );
                let st = (uv - origin) / size;
                if st.cmplt(DVec2::ZERO).any() || st.cmpgt(DVec2::ONE).any() {
                    continue;
                }
                let holds = patch.holds(st, DVec2::ZERO);
                owners += usize::from(holds);
                let overlap = patch.overlap(st - 1e-3, st + 1e-3);
                assert!(!holds || overlap != crate::patch::Overlap::None, "{name}: {uv}");
                assert!(holds || overlap != crate::patch::Overlap::Whole, "{name}: {uv}");
                let whole = patch.eval_whole(st).position;
                assert!(!holds || whole.distance(patch.eval(st).position) < 1e-15, "{name}: {uv}");
            }
            assert_eq!(owners, 1, "{name}: {uv}");
        }
    }
}

#[test]
fn fields_of_the_surface_are_its_normal_and_tangents() {
    // on a cylinder z = sqrt(1 - x²), these are known in closed form
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let ring = [(-half, half, 1.0), (0.0, 2.0 * half, half), (half, half, 1.0)];
    let points = ring.iter().flat_map(|&(x, z, w)| [0.0, 1.0].map(|y| DVec4::new(w * x, w * y, w * z, w)));
    let base = BezierPatch::new([2, 1], points.collect());
    for (field, along) in [
        (Field::Normal, (|p: DVec3| DVec3::new(p.x, 0.0, p.z)) as fn(DVec3) -> DVec3),
        (Field::TangentU, |p| DVec3::new(p.z, 0.0, -p.x)),
        (Field::TangentV, |_| DVec3::Y),
    ] {
        // a normal of a stretched cylinder is radial again
        let step = |h: f64| {
            Step::Extension(
                Extension::try_new(ExtensionMode::Field(field.clone()), vec![region("-1", 2, diagonal(h))])
                    .unwrap(),
            )
        };
        let patches = covered(&base, vec![step(0.3), step(-0.2)]);
        let sign =
            if field == Field::Normal { base.eval(DVec2::splat(0.5)).normal().z.signum() } else { 1.0 };
        for patch in &patches {
            for st in [DVec2::ZERO, DVec2::new(0.3, 0.8), DVec2::ONE] {
                let st_of_base = patch.chart.place(st).coordinates().truncate();
                let point = base.eval(st_of_base).position;
                let moved = |point: DVec3, h: f64| point + sign * libm::expm1(h) * along(point).normalize();
                let first = moved(point, 0.3);
                // tangents turn with the points; the normal and the straight one do not
                let want = if matches!(field, Field::TangentU) { None } else { Some(moved(first, -0.2)) };
                let got = patch.eval(st);
                if let Some(want) = want {
                    assert!(got.position.distance(want) < 1e-14, "{field:?}: {} {want}", got.position);
                }
                let step = 1e-3;
                let at = |s: f64| patch.eval(st + DVec2::new(s, 0.0)).position;
                let by_s =
                    (8.0 * (at(step) - at(-step)) - (at(2.0 * step) - at(-2.0 * step))) / (12.0 * step);
                assert!(by_s.distance(got.dp_ds) < 1e-9 * by_s.length(), "{field:?}: {by_s} {}", got.dp_ds);
            }
        }
    }
}

#[test]
fn tangents_follow_u_and_v_in_any_frame() {
    // a patch whose s runs against v and whose t runs along u
    let plane = |st: DVec2| DVec3::new(st.y, 0.0, 1.0 - st.x);
    let corners = [DVec2::ZERO, DVec2::Y, DVec2::X, DVec2::ONE].map(|st| plane(st).extend(1.0));
    let base = Face::untrimmed(
        Chart::Plane(Frame { origin: DVec3::Y, s: DVec3::NEG_Y, t: DVec3::X }),
        BezierPatch::new([1, 1], corners.to_vec()),
    );
    for (field, along) in
        [(Field::TangentU, DVec3::X), (Field::TangentV, DVec3::Z), (Field::Normal, DVec3::NEG_Y)]
    {
        let extension =
            Extension::try_new(ExtensionMode::Field(field.clone()), vec![region("-1", 2, diagonal(0.5))])
                .unwrap();
        let chain = Arc::new(Chain::try_new(vec![Step::Extension(extension)]).unwrap());
        let covered = cover(&Shell::from(vec![base.clone()]), &chain, CoverSettings::default()).unwrap();
        for patch in covered.shell.faces() {
            let st = DVec2::new(0.3, 0.6);
            let uv = patch.chart.place(st).coordinates();
            let want = DVec3::new(uv.x, 0.0, uv.y) + libm::expm1(0.5) * along;
            assert!(patch.eval(st).position.distance(want) < 1e-14, "{field:?}");
        }
    }
}

#[test]
fn contact_is_of_the_order_of_the_index() {
    let base = sheet(false);
    for n in 2..=5 {
        for mode in [
            ExtensionMode::Operator { center: DVec3::ZERO, axes: DMat3::IDENTITY },
            ExtensionMode::Radial,
            ExtensionMode::Field(Field::Normal),
        ] {
            let extension = Extension::try_new(mode.clone(), vec![region(MIDDLE, n, diagonal(0.8))]).unwrap();
            let patches = covered(&base, vec![Step::Extension(extension)]);
            // the displacement at a distance from a place of the bound curve, inwards
            let displacement = |angle: f64, distance: f64| {
                let (sin, cos) = (libm::sin(angle), libm::cos(angle));
                let uv = DVec2::splat(0.5) + (0.3 - distance) * DVec2::new(cos, sin);
                let deformed = patches.iter().filter_map(|patch| {
                    let origin = patch.chart.coordinates()[0].truncate();
                    let st = (uv - origin)
                        / DVec2::new(patch.chart.coordinates()[1].x, patch.chart.coordinates()[2].y);
                    let inside = st.cmpge(DVec2::ZERO).all() && st.cmple(DVec2::ONE).all();
                    (inside && patch.holds(st, DVec2::ZERO)).then(|| patch.eval(st).position)
                });
                let found: Vec<_> = deformed.collect();
                found[0] - base.eval(uv).position
            };
            for angle in [0.3, 1.9, 4.4] {
                assert!(displacement(angle, -1e-3).length() < 1e-15, "outside nothing moves");
                for order in 1..n {
                    // one-sided differences of each order fall with the step; of order n they do not
                    let difference = |step: f64| {
                        let mut values: Vec<_> =
                            (0..=order).map(|k| displacement(angle, f64::from(k) * step)).collect();
                        for _ in 0..order {
                            values = values.windows(2).map(|pair| (pair[1] - pair[0]) / step).collect();
                        }
                        values[0].length()
                    };
                    let rate = libm::log2(difference(2e-3) / difference(1e-3));
                    let want = f64::from(n - order);
                    assert!(
                        (rate - want).abs() < 0.35,
                        "{mode:?}, n = {n}, order {order}: falls with power {rate}"
                    );
                }
            }
        }
    }
}

#[test]
fn numbers_are_the_first_terms_of_higher_orders() {
    // orders up to 1 take another way
    for Case { name, base, steps, .. } in cases() {
        let formula = super::chain::Formula {
            base,
            chart: Chart::Plane(unit_frame()),
            chain: Arc::new(Chain::try_new(steps).unwrap()),
            done: 0,
        };
        let mut noise = Noise(13);
        for _ in 0..50 {
            let st = DVec2::new(noise.next() + 0.5, noise.next() + 0.5);
            let point = formula.eval(st, &mut ByValue);
            let [by_s, by_t] = formula.partials(st, formula.steps());
            let off = (point.dp_ds - by_s).length().max((point.dp_dt - by_t).length());
            assert!(off < 1e-13, "{name}: {off:e} at {st}");
        }
    }
}

#[test]
fn jets_are_taylor_series() {
    // along a line the coefficients of an order sum to the derivative over its factorial
    for text in [
        "exp(u)*sin(v)",
        "cos(u*v) + tan(u)",
        "ln(1+u)/(2+v)",
        "sqrt(u+v)",
        "asin(u/2)*acos(v/3)",
        "atan(u-v)",
        "(1+u)^v",
        "u^3*v^2 - u^-2",
        "(u+0.5)^2.5",
        "abs(u-v)*u",
    ] {
        let expression = expression(text);
        let (u, v) = (0.4, 0.7);
        let uv = [Jet::<f64, 15>::linear(u, [1.0, 0.0]), Jet::linear(v, [0.0, 1.0])];
        let jet = expression.at(&uv, &mut ByValue);
        for [du, dv] in [[1.0, 0.0], [0.0, 1.0], [0.6, -0.8]] {
            let value = |t: f64| {
                let at = [u + t * du, v + t * dv].map(Jet::<f64, 1>::constant);
                expression.at(&at, &mut ByValue).value()
            };
            let sum = |order: usize| -> f64 {
                (0..=order)
                    .map(|j| {
                        let power = |x: f64, n: usize| libm::pow(x, n as f64);
                        jet.coefficients[super::jet::index(order - j, j)]
                            * power(du, order - j)
                            * power(dv, j)
                    })
                    .sum()
            };
            // what the series leaves falls with the fifth power of the step
            let left = |t: f64| {
                let series: f64 = (0..=4).map(|order| sum(order) * libm::pow(t, order as f64)).sum();
                (value(t) - series).abs()
            };
            let (far, near) = (left(0.04), left(0.02));
            assert!(far < 1e-13 || near < far / 25.0, "{text} along {du}, {dv}: {far:e} {near:e}");
        }
    }
}

#[test]
fn knot_planes_of_two_lattices_may_cross_in_one_point() {
    // eight knot boxes of each meet where s = t = 1/3, which no halving separates
    let point = |s: f64, t: f64| {
        DVec4::new(0.5 + 0.6 * (s - 1.0 / 3.0), 0.5 + 0.6 * (t - 1.0 / 3.0), 0.4 + 0.2 * s + 0.1 * t, 1.0)
    };
    let corners = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)];
    let base = BezierPatch::new([1, 1], corners.map(|(s, t)| point(s, t)).to_vec());
    let identity = || SplineVolume::identity([1, 1, 1], [3, 3, 3], [DVec3::ZERO, DVec3::ONE]).unwrap();
    let faces = covered(&base, vec![Step::Volume(identity()), Step::Volume(identity())]);
    let mut area = 0.0;
    for face in &faces {
        for trim_loop in face.region.loops() {
            let corners = face.region.corners(&trim_loop);
            let doubled: f64 =
                (0..corners.len()).map(|i| corners[i].perp_dot(corners[(i + 1) % corners.len()])).sum();
            let [_, s, t] = face.chart.coordinates();
            area += if face.leads() { 0.5 * doubled * s.cross(t).z } else { 0.0 };
            for &corner in corners {
                let place = face.chart.place(corner).coordinates();
                assert!(
                    (face.patch.eval(corner).position - point(place.x, place.y).truncate()).length() < 1e-7
                );
            }
        }
    }
    assert!((area - 1.0).abs() < 1e-12, "the faces are all of the square once: {area}");
}
