//! Rays against a leaf: where they can hit it, by the leaf's bounds alone, and Newton's method on the patch from there.
//!
//! Written for one ray or for several side by side ([`Real`]); every lane does what one ray alone would do.

use glam::DVec2;

use crate::math::lanes::{Real, Truth, Vector};
use crate::patch::PointLanes;

use super::leaf::{Cut, DOMAIN, Leaf};

/// Most Newton steps from a seed. It is close enough for 2 to 4; a search that takes more is given to clipping.
const MAX_STEPS: usize = 10;

/// A step this small, in parts of the leaf, is the last: the next would be about its square.
const LAST_STEP: f64 = 1e-8;

/// Rays in local coordinates, with the part of them that is of interest.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalRays<R> {
    pub(super) origin: Vector<R>,
    pub(super) direction: Vector<R>,
    /// Bound on the rounding of the origin.
    pub(super) rounding: R,
    pub(super) t_min: R,
    pub(super) t_max: R,
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
    u: R,
    v: R,
    /// The root's distance from (u, v) along each is no more than this.
    radius: R,
}

/// Roots that Newton's method found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Roots<R: Real> {
    /// Where the isolated root was found, in the leaf or beside it.
    pub(super) found: R::Truth,
    /// Where it is in the leaf's rectangle.
    pub(super) inside: R::Truth,
    pub(super) s: R,
    pub(super) t: R,
    pub(super) ray_t: R,
}

/// What rays can hit of a leaf; `None` if no ray can hit anything.
///
/// Along a ray with leaf coordinates p(t) + z(t), its height above the surface is q(t) = z - h's form, up to the height error
/// e0, and its slope that of q up to the slope error e1. q is c + b t + a t², with the discriminant D = b² - 4 a c. If
/// D > e1² + 4 |a| e0, then |q| > e0 wherever |q'| <= e1, so that about each root of q, between 2 e0 / √D on
/// either side, there is at most one hit, and none elsewhere. If -D > 4 |a| e0, then |q| > e0 everywhere: no hit. Between
/// these the ray is all but tangent.
#[inline(always)]
pub(super) fn approach<R: Real>(leaf: &Leaf, rays: &LocalRays<R>) -> Option<Approach<R>> {
    let all = |value: f32| rays.t_min.all(f64::from(value));
    let [cx, cy, cz] = leaf.centre.map(all);
    let offset = rays.origin.minus(Vector::new(cx, cy, cz));
    let row = |index: usize| {
        let [x, y, z] = leaf.to_leaf[index].map(all);
        Vector::new(x, y, z)
    };
    let rows = [row(0), row(1), row(2)];
    let origin = rows.map(|row| row.dot(offset));
    let way = rows.map(|row| row.dot(rays.direction));
    // rounding: of the offset, and of the products with it
    let length = offset.x.abs() + offset.y.abs() + offset.z.abs();
    let slack = (rays.rounding + length * (8.0 * f64::EPSILON)) * all(leaf.steepness);

    let zero = all(0.0);
    let (mut enter, mut leave) = (all(f32::NEG_INFINITY), all(f32::INFINITY));
    for axis in 0..3 {
        let inverse = all(1.0) / way[axis];
        let (low, high) = (all(leaf.low[axis]) - slack, all(leaf.high[axis]) + slack);
        let backward = way[axis].lt(zero);
        let (near, far) = (R::select(backward, high, low), R::select(backward, low, high));
        // a direction in a side's plane from an origin in that plane gives NaN, which is dropped
        enter = enter.greater((near - origin[axis]) * inverse);
        leave = leave.lesser((far - origin[axis]) * inverse);
    }
    let (from, to) = (enter.greater(rays.t_min), leave.lesser(rays.t_max));
    let entered = from.le(to + to.abs() * (4.0 * f64::EPSILON));
    if !entered.any() {
        return None;
    }
    let approach = if leaf.is_proven() {
        isolate(leaf, &rows_at(origin, way, (enter + leave) * 0.5), [from, to], slack)
    } else {
        let nothing = Seed { wanted: zero.lt(zero), t: zero, window: zero, u: zero, v: zero, radius: zero };
        Approach { undecided: zero.le(zero), seeds: [nothing; 2] }
    };
    let Approach { undecided, seeds: [mut near, mut far] } = approach;
    near.wanted = near.wanted & entered;
    far.wanted = far.wanted & entered;
    let undecided = undecided & entered;
    (undecided | near.wanted | far.wanted).any().then_some(Approach { undecided, seeds: [near, far] })
}

/// Rays in leaf coordinates, as seen from the parameter `t`.
struct RowsAt<R> {
    t: R,
    place: [R; 3],
    way: [R; 3],
}

#[inline(always)]
fn rows_at<R: Real>(origin: [R; 3], way: [R; 3], t: R) -> RowsAt<R> {
    RowsAt { t, place: [0, 1, 2].map(|axis| origin[axis] + way[axis] * t), way }
}

/// The isolation of roots that [`approach`] describes, between the parameters `from` and `to`.
#[inline(always)]
fn isolate<R: Real>(leaf: &Leaf, rays: &RowsAt<R>, [from, to]: [R; 2], slack: R) -> Approach<R> {
    let all = |value: f32| from.all(f64::from(value));
    let (from, to) = (from - rays.t, to - rays.t);
    let [x, y, z] = rays.place;
    let [dx, dy, dz] = rays.way;
    let [uu, uv, vv] = leaf.forms[2].map(all);
    let constant = uu * x * x + uv * x * y + vv * y * y - z;
    let linear = uu * x * dx * 2.0 + uv * (x * dy + y * dx) + vv * y * dy * 2.0 - dz;
    let square = uu * dx * dx + uv * dx * dy + vv * dy * dy;
    let height_error = all(leaf.height_error) + slack * 2.0;
    let slope_error = all(leaf.slope_error[0]) * dx.abs() + all(leaf.slope_error[1]) * dy.abs();
    let discriminant = linear * linear - square * constant * 4.0;
    let blur = square.abs() * height_error * 4.0;
    let unclear = slope_error * slope_error + blur;
    let isolated = unclear.lt(discriminant);
    let missed = discriminant.lt(-blur);
    // all but tangent: |q| <= e0 only this near the extremum of q
    let reach = (unclear + unclear).sqrt();
    let (twice, middle) = ((square + square).abs(), R::select(square.lt(all(0.0)), linear, -linear));
    let elsewhere = (to * twice + reach).lt(middle) | middle.lt(from * twice - reach);
    let undecided = !(isolated | missed | elsewhere);

    let root = discriminant.sqrt();
    let sum = (linear + R::select(linear.lt(all(0.0)), -root, root)) * -0.5;
    let (a, b) = (sum / square, constant / sum);
    let window = (height_error + height_error) / root;
    let seed = |t: R| {
        let (x, y) = (x + dx * t, y + dy * t);
        let form = |part: usize| {
            let [uu, uv, vv] = leaf.forms[part].map(all);
            uu * x * x + uv * x * y + vv * y * y
        };
        let (u, v) = (x - form(0), y - form(1));
        let radius = dx.abs().greater(dy.abs()) * window * all(leaf.stretch) + all(leaf.place_error) + slack;
        let reach = radius + (1.0 + f64::from(leaf.margin));
        let wanted = isolated
            & from.le(t + window)
            & (t - window).le(to)
            & u.abs().le(reach)
            & v.abs().le(reach);
        Seed { wanted, t: t + rays.t, window, u, v, radius }
    };
    let swapped = b.lt(a);
    let (near, far) = (R::select(swapped, b, a), R::select(swapped, a, b));
    Approach { undecided, seeds: [seed(near), seed(far)] }
}

/// Whether a root about the seed is outside the loop of each of some cuts.
#[inline(always)]
pub(super) fn trimmed_away<R: Real>(leaf: &Leaf, cuts: &[Cut], seed: &Seed<R>) -> R::Truth {
    let all = |value: f32| seed.t.all(f64::from(value));
    let limit = -(seed.radius + all(leaf.cut_margin));
    // without cuts the whole leaf is inside
    let mut away = if cuts.is_empty() { limit.lt(limit) } else { limit.le(limit) };
    for of_loop in cuts.chunk_by(|a, b| a.trim_loop == b.trim_loop) {
        let mut outside = limit.lt(limit);
        for cut in of_loop {
            let [a, b] = cut.normal.map(all);
            outside = outside | (a * seed.u + b * seed.v + all(cut.offset)).lt(limit);
        }
        away = away & outside;
    }
    away
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
    let all = |value: f64| seed.t.all(value);
    let [middle_s, middle_t] = leaf.middle.map(all);
    let [half_s, half_t] = leaf.half.map(all);
    let (per_s, per_t) = (all(1.0 / leaf.half[0]), all(1.0 / leaf.half[1]));
    let (mut s, mut t) = (middle_s + half_s * seed.u, middle_t + half_t * seed.v);
    let (mut u, mut v) = (seed.u, seed.v);
    let mut ray_t = seed.t;
    let mut active = seed.wanted;
    let mut found = all(0.0).lt(all(0.0));
    let domain = all(DOMAIN);
    for _ in 0..MAX_STEPS {
        *steps += active.count();
        let step = NewtonStep::of(&eval([s, t]), rays);
        s = R::select(active, s + step.s, s);
        t = R::select(active, t + step.t, t);
        u = (s - middle_s) * per_s;
        v = (t - middle_t) * per_t;
        ray_t = R::select(active, step.ray_t, ray_t);
        let moved = (step.s * per_s).abs().greater((step.t * per_t).abs());
        let in_domain = u.abs().le(domain) & v.abs().le(domain);
        found = found | (active & in_domain & moved.le(all(LAST_STEP)));
        active = active & in_domain & !found;
        if !active.any() {
            break;
        }
    }
    // the window is what the bounds say in exact arithmetic
    let window = seed.window * (1.0 + 1e-6) + ray_t.abs() * (8.0 * f64::EPSILON);
    let told_apart = all(f64::from(leaf.domain));
    let found =
        found & (ray_t - seed.t).abs().le(window) & u.abs().le(told_apart) & v.abs().le(told_apart);
    let edge = all(1.0 + f64::from(leaf.margin));
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
    /// By Cramer's rule, with ds × dt · direction as determinant.
    #[inline(always)]
    fn of(point: &PointLanes<R>, rays: &WorldRays<R>) -> Self {
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

/// Where a root is with respect to the cuts of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// Inside this loop.
    Inside(u32),
    /// Outside all loops.
    Outside,
    /// Too near to an edge for single precision.
    Unclear,
}

/// Where a root at (s, t) is with respect to the cuts of a leaf.
#[inline(always)]
pub(super) fn side(leaf: &Leaf, cuts: &[Cut], st: DVec2) -> Side {
    let margin = f64::from(leaf.cut_margin);
    let uv = (st - DVec2::from_array(leaf.middle)) / DVec2::from_array(leaf.half);
    let mut unclear = false;
    for of_loop in cuts.chunk_by(|a, b| a.trim_loop == b.trim_loop) {
        let mut least = f64::INFINITY;
        for cut in of_loop {
            let [a, b] = cut.normal.map(f64::from);
            least = least.min(a * uv.x + b * uv.y + f64::from(cut.offset));
        }
        if least > margin && !unclear {
            return Side::Inside(of_loop[0].trim_loop);
        }
        // so written, NaN is unclear
        unclear |= !(least < -margin);
    }
    if unclear { Side::Unclear } else { Side::Outside }
}
