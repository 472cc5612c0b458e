//! Rays against a leaf: where they can hit it, by the leaf's bounds alone, and Newton's method on the patch from there.
//!
//! Written for one ray or for several side by side ([`Real`]); every lane does what one ray alone would do.

use crate::math::lanes::{Real, Truth, Vector};
use crate::patch::PointLanes;

use super::leaf::{Cover, Cut, Leaf, by_loop};
use super::net::DOMAIN;

/// Most Newton steps from a seed. It is close enough for 2 to 4; a search that takes more is given to clipping.
const MAX_STEPS: usize = 10;

/// A step this small, in parts of the leaf, is the last: the next would be about its square.
const LAST_STEP: f64 = 1e-8;

/// Bounds hold beyond the part of a ray that is of interest by this part of it and of the leaf's size, so that a root just
/// outside is known to be the one that was isolated.
const BEYOND: f64 = 0.1;

/// Rays in local coordinates, with the part of them that is of interest.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalRays<R> {
    pub(super) origin: Vector<R>,
    pub(super) direction: Vector<R>,
    /// Bound on the rounding of the origin.
    pub(super) rounding: R,
    pub(super) t_min: R,
    /// The least of the ray's end and its hits so far.
    pub(super) t_max: R,
    /// The ray's end.
    pub(super) t_limit: R,
}

/// Rays in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct WorldRays<R> {
    pub(super) origin: Vector<R>,
    pub(super) direction: Vector<R>,
}

/// What a leaf's bounds say.
#[derive(Clone, Copy, Debug)]
pub(super) struct Approach<R: Real> {
    /// Nothing is proved: clipping must decide.
    pub(super) undecided: R::Truth,
    /// Where hits can be, one at most each; the nearer first. No others are in the leaf.
    pub(super) seeds: [Seed<R>; 2],
}

/// A place on a ray about which there is one root of the leaf's surface at most.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seed<R: Real> {
    /// Whether it is of interest: its root can be in the leaf and on the ray.
    pub(super) wanted: R::Truth,
    t: R,
    /// The root's distance from `t` is no more than this.
    window: R,
    /// The bounds isolate roots that are no farther than this from `t`.
    isolation: R,
    u: R,
    v: R,
    /// The root's distance from (u, v) along each is no more than this.
    radius: R,
    /// How far outside the leaf a root still counts, if the trim holds it.
    border: R,
}

/// Roots that Newton's method found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Roots<R: Real> {
    /// Where the isolated root was found, in the leaf or beside it.
    pub(super) found: R::Truth,
    /// Where it is in the leaf's rectangle or not far outside.
    pub(super) inside: R::Truth,
    pub(super) s: R,
    pub(super) t: R,
    pub(super) ray_t: R,
}

/// What rays can hit of a leaf; `None` if no ray can hit anything.
///
/// Along a ray with leaf coordinates (p(t), z(t)), the surface's height above it is a quadratic and a cubic form of p less z, up
/// to the height error, and its slope up to the slope error. Of that cubic in t, the quadratic q(t) = c + b t + a t² with
/// t³ ≈ ¾ L² t for |t| <= L is off by e0 and its slope by e1, errors included. D = b² - 4 a c is its discriminant. If
/// D > e1² + 4 |a| e0, then |q| > e0 wherever |q'| <= e1, so that about each root of q, between 2 e0 / √D on
/// either side, there is at most one hit, and none elsewhere. If -D > 4 |a| e0, then |q| > e0 everywhere: no hit. Between
/// these the ray is all but tangent.
#[inline(always)]
pub(super) fn approach<R: Real>(leaf: &Leaf, rays: &LocalRays<R>) -> Option<Approach<R>> {
    let offset = rays.origin.minus(constants(rays.t_min, &leaf.centre));
    let [row_x, row_y, row_z] = &leaf.to_leaf;
    let (row_x, row_y) = (constants(offset.x, row_x), constants(offset.x, row_y));
    let row_z = constants(offset.x, row_z);
    let origin = Vector::new(row_x.dot(offset), row_y.dot(offset), row_z.dot(offset));
    let way = Vector::new(row_x.dot(rays.direction), row_y.dot(rays.direction), row_z.dot(rays.direction));
    // rounding: of the offset, and of the products with it
    let length = offset.x.abs() + offset.y.abs() + offset.z.abs();
    let slack = (rays.rounding + length * (8.0 * f64::EPSILON)) * f64::from(leaf.steepness);

    let one = slack.all(1.0);
    let inverse = Vector::new(one / way.x, one / way.y, one / way.z);
    let span = [constant(slack, f32::NEG_INFINITY), constant(slack, f32::INFINITY)];
    let span = slab(span, (leaf.low[0], leaf.high[0]), slack, (origin.x, inverse.x));
    let span = slab(span, (leaf.low[1], leaf.high[1]), slack, (origin.y, inverse.y));
    let [enter, leave] = slab(span, (leaf.low[2], leaf.high[2]), slack, (origin.z, inverse.z));
    // hits must not depend on those found before, so that only the ray's own end shortens what is looked at
    let (from, to) = (enter.greater(rays.t_min), leave.lesser(rays.t_limit));
    let end = to.lesser(rays.t_max);
    let entered = from.le(end + end.abs() * (4.0 * f64::EPSILON));
    if !entered.any() {
        return None;
    }
    if !leaf.is_proven() {
        let nothing = Seed::nothing(slack);
        return Some(Approach { undecided: entered, seeds: [nothing; 2] });
    }
    let middle = (from + to) * 0.5;
    let half = (to - from).abs() * 0.5;
    let size = inverse.x.abs().lesser(inverse.y.abs()).lesser(inverse.z.abs());
    let span = half + (half + size) * BEYOND;
    let seen = CentredRays { t: middle, half, span, place: origin.plus(way.times(middle)), way };
    let Approach { undecided, seeds: [mut near, mut far] } = isolate(leaf, &seen, slack);
    near.wanted = near.wanted & entered & (near.t - near.window).le(rays.t_max);
    far.wanted = far.wanted & entered & (far.t - far.window).le(rays.t_max);
    let undecided = undecided & entered;
    (undecided | near.wanted | far.wanted).any().then_some(Approach { undecided, seeds: [near, far] })
}

#[inline(always)]
fn constant<R: Real>(like: R, value: f32) -> R {
    like.all(f64::from(value))
}

#[inline(always)]
fn constants<R: Real>(like: R, [x, y, z]: &[f32; 3]) -> Vector<R> {
    Vector::new(constant(like, *x), constant(like, *y), constant(like, *z))
}

/// What of `[enter, leave]` is between two planes across an axis.
#[inline(always)]
fn slab<R: Real>(
    [enter, leave]: [R; 2],
    (low, high): (f32, f32),
    slack: R,
    (origin, inverse): (R, R),
) -> [R; 2] {
    let (low, high) = (constant(slack, low) - slack, constant(slack, high) + slack);
    let backward = inverse.lt(slack.all(0.0));
    let (near, far) = (R::select(backward, high, low), R::select(backward, low, high));
    // a direction in a side's plane from an origin in that plane gives NaN, which is dropped
    [enter.greater((near - origin) * inverse), leave.lesser((far - origin) * inverse)]
}

/// Rays in leaf coordinates, with their parameters counted from `t`.
struct CentredRays<R> {
    t: R,
    /// How far the part of interest reaches before and after.
    half: R,
    /// How far bounds hold.
    span: R,
    place: Vector<R>,
    way: Vector<R>,
}

/// A quadratic form at (x, y).
#[inline(always)]
fn form<R: Real>([uu, uv, vv]: &[f32; 3], x: R, y: R) -> R {
    constant(x, *uu) * x * x + constant(x, *uv) * x * y + constant(x, *vv) * y * y
}

impl<R: Real> Seed<R> {
    #[inline(always)]
    fn nothing(like: R) -> Self {
        let zero = like.all(0.0);
        Self {
            wanted: zero.lt(zero),
            t: zero,
            window: zero,
            isolation: zero,
            u: zero,
            v: zero,
            radius: zero,
            border: zero,
        }
    }

    /// The seed about the root `t` of the quadratic; the ray's rounding is `slack` and moves the root by `shift` along it.
    #[inline(always)]
    fn at_root(leaf: &Leaf, rays: &CentredRays<R>, [t, window]: [R; 2], [slack, shift]: [R; 2]) -> Self {
        let (x, y) = (rays.place.x + rays.way.x * t, rays.place.y + rays.way.y * t);
        let (u, v) = (x - form(&leaf.forms[0], x, y), y - form(&leaf.forms[1], x, y));
        let speed = rays.way.x.abs().greater(rays.way.y.abs());
        let stretched = speed * f64::from(leaf.stretch);
        let radius = stretched * window + constant(t, leaf.place_error) + slack;
        let border = constant(t, leaf.border) + slack * 2.0 + stretched * shift;
        let reach = radius + border + 1.0;
        let wanted = t.abs().le(rays.half + window) & u.abs().le(reach) & v.abs().le(reach);
        Self { wanted, t: t + rays.t, window, isolation: rays.span - t.abs(), u, v, radius, border }
    }
}

/// The isolation of roots that [`approach`] describes.
#[inline(always)]
fn isolate<R: Real>(leaf: &Leaf, rays: &CentredRays<R>, slack: R) -> Approach<R> {
    let Vector { x, y, z } = rays.place;
    let Vector { x: dx, y: dy, z: dz } = rays.way;
    let [a, b, c] = &leaf.forms[2];
    let (a, b, c) = (constant(x, *a), constant(x, *b), constant(x, *c));
    let [xxx, xxy, xyy, yyy] = &leaf.cubic;
    let (xxx, xxy) = (constant(x, *xxx), constant(x, *xxy));
    let (xyy, yyy) = (constant(x, *xyy), constant(x, *yyy));
    // the second partials of both forms, by the place and along the way: each form by Euler's theorem
    let (axx, axy, ayy) = ((xxx * x * 3.0 + xxy * y), (xxy * x + xyy * y) * 2.0, (xyy * x + yyy * y * 3.0));
    let span_squared = rays.span * rays.span;
    let cube = ((xxx * dx + xxy * dy) * dx + xyy * dy * dy) * dx + yyy * dy * dy * dy;
    let constant_term =
        (a + axx * (1.0 / 3.0)) * x * x + (b + axy * (1.0 / 3.0)) * x * y + (c + ayy * (1.0 / 3.0)) * y * y
            - z;
    let linear =
        ((a + a + axx) * x + (b + axy * 0.5) * y) * dx + ((b + axy * 0.5) * x + (c + c + ayy) * y) * dy - dz
            + cube * span_squared * 0.75;
    let square = (a + axx) * dx * dx + (b + axy) * dx * dy + (c + ayy) * dy * dy;
    let cube = cube.abs() * span_squared;
    let height_error = constant(x, leaf.height_error) + slack * 2.0 + cube * rays.span * 0.25;
    let slope_error = constant(x, leaf.slope_error[0]) * dx.abs()
        + constant(x, leaf.slope_error[1]) * dy.abs()
        + cube * 2.25;
    let discriminant = linear * linear - square * constant_term * 4.0;
    let blur = square.abs() * height_error * 4.0;
    let unclear = slope_error * slope_error + blur;
    let isolated = unclear.lt(discriminant);
    let missed = discriminant.lt(-blur);
    // all but tangent: |q| <= e0 only this near the extremum of q
    let reach = (unclear + unclear).sqrt();
    let downward = square.lt(square.all(0.0));
    let (twice, middle) = ((square + square).abs(), R::select(downward, linear, -linear));
    let elsewhere = (rays.half * twice + reach).lt(middle.abs());
    let undecided = !(isolated | missed | elsewhere);
    if !(isolated | undecided).any() {
        return Approach { undecided, seeds: [Seed::nothing(x); 2] };
    }

    let root = discriminant.sqrt();
    let sum = (linear + R::select(linear.lt(linear.all(0.0)), -root, root)) * -0.5;
    let (a, b) = (sum / square, constant_term / sum);
    let flatness = root.all(1.0) / root;
    let window = (height_error + height_error) * flatness;
    let rounding = [slack, slack * 4.0 * flatness];
    let swapped = b.lt(a);
    let (near, far) = (R::select(swapped, b, a), R::select(swapped, a, b));
    let mut near = Seed::at_root(leaf, rays, [near, window], rounding);
    let mut far = Seed::at_root(leaf, rays, [far, window], rounding);
    near.wanted = near.wanted & isolated;
    far.wanted = far.wanted & isolated;
    Approach { undecided, seeds: [near, far] }
}

/// Whether a root about the seed is outside the loop of each of some cuts.
#[inline(always)]
pub(super) fn trimmed_away<R: Real>(cuts: &[Cut], seed: &Seed<R>) -> R::Truth {
    let limit = -(seed.radius + seed.border);
    // without cuts the whole leaf is inside
    let mut away = if cuts.is_empty() { limit.lt(limit) } else { limit.le(limit) };
    for of_loop in by_loop(cuts) {
        let mut outside = limit.lt(limit);
        for cut in of_loop {
            outside = outside | cut_value(cut, seed.u, seed.v).lt(limit);
        }
        away = away & outside;
    }
    away
}

/// How far inside a cut's line (u, v) is.
#[inline(always)]
fn cut_value<R: Real>(cut: &Cut, u: R, v: R) -> R {
    u * f64::from(cut.normal[0]) + v * f64::from(cut.normal[1]) + f64::from(cut.offset)
}

/// Newton's method on S(s, t) = origin + τ direction from a seed.
///
/// A root is taken for the isolated one if it is within the seed's window and the leaf's domain.
#[inline(always)]
pub(super) fn newton<R: Real>(
    leaf: &Leaf,
    rays: &WorldRays<R>,
    seed: &Seed<R>,
    eval: impl Fn([R; 2]) -> PointLanes<R>,
    steps: &mut u64,
) -> Roots<R> {
    let ([middle_s, middle_t], [half_s, half_t]) = (leaf.middle, leaf.half);
    let (per_s, per_t) = (1.0 / half_s, 1.0 / half_t);
    let (mut s, mut t) = (seed.u * half_s + middle_s, seed.v * half_t + middle_t);
    let (mut u, mut v) = (seed.u, seed.v);
    let mut ray_t = seed.t;
    let mut active = seed.wanted;
    let domain = u.all(DOMAIN);
    let mut found = domain.lt(domain);
    for _ in 0..MAX_STEPS {
        *steps += active.count();
        let step = NewtonStep::new(&eval([s, t]), rays);
        s = R::select(active, s + step.s, s);
        t = R::select(active, t + step.t, t);
        u = (s - middle_s) * per_s;
        v = (t - middle_t) * per_t;
        ray_t = R::select(active, step.ray_t, ray_t);
        let moved = (step.s * per_s).abs().greater((step.t * per_t).abs());
        let in_domain = u.abs().le(domain) & v.abs().le(domain);
        found = found | (active & in_domain & moved.le(u.all(LAST_STEP)));
        active = active & in_domain & !found;
        if !active.any() {
            break;
        }
    }
    // the window is what the bounds say in exact arithmetic
    let window = seed.window * (1.0 + 1e-6) + ray_t.abs() * (8.0 * f64::EPSILON);
    let window = window.lesser(seed.isolation);
    let isolated = constant(u, leaf.domain);
    let found = found & (ray_t - seed.t).abs().le(window) & u.abs().le(isolated) & v.abs().le(isolated);
    let edge = seed.border + 1.0;
    Roots { found, inside: found & u.abs().le(edge) & v.abs().le(edge), s, t, ray_t }
}

/// One step of Newton's method.
struct NewtonStep<R> {
    s: R,
    t: R,
    /// The ray parameter after the step.
    ray_t: R,
}

impl<R: Real> NewtonStep<R> {
    /// The step by Cramer's rule, with ds × dt · direction as determinant.
    #[inline(always)]
    fn new(point: &PointLanes<R>, rays: &WorldRays<R>) -> Self {
        let residual = point.position.minus(rays.origin);
        let across = rays.direction.cross(residual);
        let normal = point.dp_ds.cross(point.dp_dt);
        let inverse = residual.x.all(1.0) / normal.dot(rays.direction);
        Self {
            s: -(point.dp_dt.dot(across) * inverse),
            t: point.dp_ds.dot(across) * inverse,
            ray_t: normal.dot(residual) * inverse,
        }
    }
}

/// Where roots are with respect to the trim of a leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sides<R: Real> {
    /// The loop they are inside of.
    pub(super) trim_loop: R,
    pub(super) inside: R::Truth,
    /// Too near to a border for single precision.
    pub(super) unclear: R::Truth,
}

/// Where roots at (s, t) are with respect to the trim of a leaf.
#[inline(always)]
pub(super) fn sides<R: Real>(leaf: &Leaf, cuts: &[Cut], [s, t]: [R; 2]) -> Sides<R> {
    let u = (s - leaf.middle[0]) / s.all(leaf.half[0]);
    let v = (t - leaf.middle[1]) / t.all(leaf.half[1]);
    let one = s.all(1.0);
    // so written, NaN is unclear
    let beside = !(u.abs().le(one) & v.abs().le(one));
    let none = one.lt(one);
    let margin = constant(s, leaf.border);
    let mut sides = Sides { trim_loop: s.all(0.0), inside: none, unclear: beside };
    if let Cover::Inside(trim_loop) = leaf.cover {
        return Sides { trim_loop: s.all(f64::from(trim_loop)), inside: !beside, unclear: beside };
    }
    for of_loop in by_loop(cuts) {
        let mut least = s.all(f64::INFINITY);
        for cut in of_loop {
            least = least.lesser(cut_value(cut, u, v));
        }
        let inside = margin.lt(least) & !sides.unclear & !sides.inside;
        sides.trim_loop = R::select(inside, s.all(f64::from(of_loop[0].trim_loop)), sides.trim_loop);
        sides.inside = sides.inside | inside;
        sides.unclear = sides.unclear | (!least.lt(-margin) & !sides.inside);
    }
    sides
}
