//! Polygons in the plane: convexity, self-intersection, ear clipping.
//!
//! Every decision is the sign of an exact predicate (Shewchuk 1997, crate `robust`) or a comparison of coordinates, so
//! the results are right for the coordinates given, without tolerances. Coordinates must be of moderate size (about 1),
//! since the predicates do not guard against overflow.

use std::collections::BTreeSet;

use glam::DVec2;

use super::point_tree::PointTree;
use super::turn::turn;

/// Most corners of an outline that is searched for crossings edge by edge. A larger one is cut into triangles as it stands: they
/// cover each point as often as it winds around it.
pub(super) const MOST_SEARCHED: usize = 1 << 12;

/// Twice the signed area of a polygon, positive where it winds counter-clockwise.
#[cfg(test)]
pub(super) fn twice_area(points: &[DVec2]) -> f64 {
    let Some(&origin) = points.first() else {
        return 0.0;
    };
    points.windows(2).map(|edge| (edge[0] - origin).perp_dot(edge[1] - origin)).sum()
}

/// Whether the polygon is convex and winds counter-clockwise exactly once; vertices on a straight edge are allowed.
///
/// Consecutive vertices must be distinct. Linear time.
pub(super) fn is_convex(points: &[DVec2]) -> bool {
    let n = points.len();
    let mut rises = 0;
    let mut turns = 0;
    for i in 0..n {
        let (a, b, c) = (points[i], points[(i + 1) % n], points[(i + 2) % n]);
        let side = turn(a, b, c);
        if side < 0.0 || (side == 0.0 && points_up(a, b) != points_up(b, c)) {
            return false;
        }
        turns += usize::from(side > 0.0);
        // with left turns alone, each time round has one change from downward to upward edges
        rises += usize::from(!points_up(a, b) && points_up(b, c));
    }
    turns >= 3 && rises == 1
}

/// Whether the edge from `a` to `b` has a direction in `[0, π)`.
fn points_up(a: DVec2, b: DVec2) -> bool {
    b.y > a.y || (b.y == a.y && b.x > a.x)
}

/// Whether two edges cross at a point inside both; touching and overlapping do not count.
pub(super) fn crosses_itself(points: &[DVec2]) -> bool {
    !crossings(points, 1).is_empty()
}

/// Pairs of edges that cross at a point inside both, at most so many; an edge has the number of the point that it starts from.
/// Touching and overlapping do not count.
///
/// Sweeps over x; n log n for the usual outline, n² at worst.
pub(super) fn crossings(points: &[DVec2], most: usize) -> Vec<[usize; 2]> {
    let n = points.len();
    let mut edges: Vec<(usize, [DVec2; 2])> = (0..n).map(|i| (i, [points[i], points[(i + 1) % n]])).collect();
    let left = |edge: &[DVec2; 2]| edge[0].x.min(edge[1].x);
    edges.sort_by(|(_, a), (_, b)| left(a).total_cmp(&left(b)));
    let pairs = edges.iter().enumerate().flat_map(|(rank, &(i, [a, b]))| {
        let right = a.x.max(b.x);
        let candidates = edges[rank + 1..].iter().take_while(move |(_, other)| left(other) < right);
        let crossing = candidates.filter(move |&&(_, [c, d])| {
            a.y.min(b.y) < c.y.max(d.y).next_up()
                && c.y.min(d.y) < a.y.max(b.y).next_up()
                && opposite(turn(a, b, c), turn(a, b, d))
                && opposite(turn(c, d, a), turn(c, d, b))
        });
        crossing.map(move |&(j, _)| [i, j])
    });
    pairs.take(most).collect()
}

fn opposite(a: f64, b: f64) -> bool {
    (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0)
}

/// No ear was left to cut: the outline crosses itself, or winds clockwise somewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NoEar;

/// Cuts a simple polygon that winds counter-clockwise into n - 2 triangles that do as well.
///
/// Vertices may lie on edges (none is lost) and coincide, as in outlines that a doubled edge joins to their hole; for
/// such outlines there may be fewer triangles. n log n for usual outlines: a vertex that is no ear is looked at again only
/// after its neighbours have changed, or the vertex in its way.
///
/// Triangles that all wind counter-clockwise and whose boundaries add up to the outline cover each point as often as the
/// outline winds around it. So whatever order the ears are cut in, a result is right, and a wrong outline has none.
///
/// Source: Meisters, *Polygons have ears*, 1975.
pub(super) fn clip_ears(points: &[DVec2]) -> Result<Vec<[usize; 3]>, NoEar> {
    let mut ring = Ring::new(points);
    let mut triangles = Vec::with_capacity(points.len().saturating_sub(2));
    let mut tip = 0;
    while ring.len > 3 {
        tip = ring
            .next_ear(tip, Touching::Refused)
            .or_else(|| ring.next_ear(tip, Touching::Allowed))
            .ok_or(NoEar)?;
        let triangle = ring.corner(tip);
        if ring.turn_at(tip) > 0.0 {
            triangles.push(triangle);
        }
        ring.remove(tip);
        // not the neighbour: that would make a fan of slivers
        tip = ring.next[triangle[2]];
    }
    let last = ring.turn_at(tip);
    if last > 0.0 {
        triangles.push(ring.corner(tip));
    }
    if last < 0.0 || triangles.is_empty() {
        return Err(NoEar);
    }
    Ok(triangles)
}

/// Whether vertices may lie on the rim of an ear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Touching {
    Refused,
    Allowed,
}

/// What is left of the polygon: a doubly linked ring of vertices.
struct Ring<'a> {
    points: &'a [DVec2],
    next: Vec<usize>,
    previous: Vec<usize>,
    len: usize,
    /// Those of the vertices left that turn right or go straight on: only such can lie in an ear.
    reflex: PointTree<'a>,
    is_left: Vec<bool>,
    /// Vertices that may be ears, by [`Touching`].
    untested: [BTreeSet<usize>; 2],
    /// Vertices that are no ears as long as this one is reflex, by [`Touching`].
    blocked: Vec<Vec<(usize, Touching)>>,
}

impl<'a> Ring<'a> {
    fn new(points: &'a [DVec2]) -> Self {
        let len = points.len();
        let all: BTreeSet<usize> = (0..len).collect();
        let mut ring = Self {
            points,
            next: (0..len).map(|i| (i + 1) % len).collect(),
            previous: (0..len).map(|i| (i + len - 1) % len).collect(),
            len,
            reflex: PointTree::new(points),
            is_left: vec![true; len],
            untested: [all.clone(), all],
            blocked: vec![Vec::new(); len],
        };
        for i in 0..len {
            ring.reflex.set(i, ring.turn_at(i) <= 0.0);
        }
        ring
    }

    /// The vertices before, at and after `i`.
    fn corner(&self, i: usize) -> [usize; 3] {
        [self.previous[i], i, self.next[i]]
    }

    fn turn_at(&self, i: usize) -> f64 {
        let [a, b, c] = self.corner(i).map(|i| self.points[i]);
        turn(a, b, c)
    }

    /// The first vertex at or behind `from`, once around, whose triangle can be cut off.
    fn next_ear(&mut self, from: usize, touching: Touching) -> Option<usize> {
        loop {
            let untested = &self.untested[touching as usize];
            let tip = *untested.range(from..).next().or_else(|| untested.first())?;
            match self.obstacle(tip, touching) {
                None => return Some(tip),
                Some(obstacle) => {
                    self.untested[touching as usize].remove(&tip);
                    if let Obstacle::Vertex(vertex) = obstacle {
                        self.blocked[vertex].push((tip, touching));
                    }
                }
            }
        }
    }

    /// Why the triangle at `tip` cannot be cut off: a vertex in it or, unless that is allowed, on its rim.
    fn obstacle(&self, tip: usize, touching: Touching) -> Option<Obstacle> {
        let side = self.turn_at(tip);
        if side < 0.0 || (side == 0.0 && touching == Touching::Refused) {
            return Some(Obstacle::Turn);
        }
        if side == 0.0 {
            return None;
        }
        let triangle = self.corner(tip).map(|i| self.points[i]);
        let [a, b, c] = triangle;
        let inside = |i: usize| {
            let p = self.points[i];
            let mut sides = [[a, b], [b, c], [c, a]].into_iter().map(|[from, to]| turn(from, to, p));
            p != a
                && p != b
                && p != c
                && match touching {
                    Touching::Allowed => sides.all(|side| side > 0.0),
                    Touching::Refused => sides.all(|side| side >= 0.0),
                }
        };
        self.reflex.find(triangle, inside).map(Obstacle::Vertex)
    }

    fn remove(&mut self, i: usize) {
        let [before, _, after] = self.corner(i);
        self.next[before] = after;
        self.previous[after] = before;
        self.len -= 1;
        self.is_left[i] = false;
        for vertex in [before, i, after] {
            let is_reflex = self.is_left[vertex] && self.turn_at(vertex) <= 0.0;
            self.reflex.set(vertex, is_reflex);
            if !is_reflex {
                for (tip, touching) in std::mem::take(&mut self.blocked[vertex]) {
                    if self.is_left[tip] {
                        self.untested[touching as usize].insert(tip);
                    }
                }
            }
        }
        for untested in &mut self.untested {
            untested.remove(&i);
            untested.extend([before, after]);
        }
    }
}

/// Why a triangle cannot be cut off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Obstacle {
    /// It does not wind counter-clockwise.
    Turn,
    /// This vertex is in it.
    Vertex(usize),
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn points(coordinates: &[[f64; 2]]) -> Vec<DVec2> {
        coordinates.iter().map(|&p| p.into()).collect()
    }

    /// All triangles counter-clockwise, areas adding up, n - 2 of them.
    fn assert_triangulated(outline: &[DVec2]) {
        let triangles = clip_ears(outline).expect("a simple polygon has ears");
        assert_eq!(triangles.len(), outline.len() - 2, "{outline:?}");
        let mut sum = 0.0;
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|i| outline[i]);
            assert!(turn(a, b, c) > 0.0, "{triangle:?} of {outline:?}");
            sum += turn(a, b, c);
        }
        let area = twice_area(outline);
        assert!((sum - area).abs() <= 1e-12 * area, "areas {sum} and {area} of {outline:?}");
    }

    #[test]
    fn convexity_is_exact() {
        let square = [[0., 0.], [1., 0.], [1., 1.], [0., 1.]];
        assert!(is_convex(&points(&square)));
        let with_support = [[0., 0.], [0.25, 0.], [0.5, 0.], [1., 0.], [1., 1.], [0., 1.], [0., 0.7]];
        assert!(is_convex(&points(&with_support)));
        let clockwise = [[0., 0.], [0., 1.], [1., 1.], [1., 0.]];
        assert!(!is_convex(&points(&clockwise)));
        let dart = [[0., 0.], [1., 0.], [0.4, 0.4], [0., 1.]];
        assert!(!is_convex(&points(&dart)));
        let spike = [[0., 0.], [2., 0.], [1., 0.], [1., 1.], [0., 1.]];
        assert!(!is_convex(&points(&spike)));
        // one unit in the last place decides
        let bulge = |y: f64| [[0., 0.], [0.5, y], [1., 0.], [1., 1.], [0., 1.]];
        assert!(is_convex(&points(&bulge(-1e-300))));
        assert!(!is_convex(&points(&bulge(1e-300))));
    }

    #[test]
    fn star_polygons_wind_twice() {
        let star: Vec<_> =
            (0..5).map(|i| DVec2::from_angle(f64::from(2 * i) * std::f64::consts::TAU / 5.0)).collect();
        assert!(!is_convex(&star));
        assert!(crosses_itself(&star));
        let pentagon: Vec<_> =
            (0..5).map(|i| DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / 5.0)).collect();
        assert!(is_convex(&pentagon) && !crosses_itself(&pentagon));
    }

    #[test]
    fn crossings_are_found_and_touching_is_none() {
        assert!(crosses_itself(&points(&[[0., 0.], [1., 1.], [1., 0.], [0., 1.]])));
        // a vertex on another edge, and an edge there and back
        let touching = [[0., 0.], [2., 0.], [2., 1.], [1., 0.], [0., 1.]];
        assert!(!crosses_itself(&points(&touching)));
        let keyhole =
            [[0., 0.], [3., 0.], [3., 3.], [1., 2.], [2., 2.], [2., 1.], [1., 2.], [3., 3.], [0., 3.]];
        assert!(!crosses_itself(&points(&keyhole)));
    }

    #[test]
    fn combs_and_supported_edges() {
        let comb = [
            [0., 0.],
            [5., 0.],
            [5., 3.],
            [4., 3.],
            [4., 1.],
            [3., 1.],
            [3., 3.],
            [2., 3.],
            [2., 1.],
            [1., 1.],
            [1., 3.],
            [0., 3.],
        ];
        assert_triangulated(&points(&comb));
        let supported = [[0., 0.], [1., 0.], [2., 0.], [2., 2.], [1., 1.], [0., 2.], [0., 1.5], [0., 1.]];
        assert_triangulated(&points(&supported));
        let triangle = [[0., 0.], [1., 0.], [2., 0.], [1., 1.], [0., 2.], [0., 1.]];
        assert_triangulated(&points(&triangle));
    }

    #[test]
    fn outline_with_a_hole_joined_by_a_doubled_edge() {
        let keyhole = points(&[
            [0., 0.],
            [3., 0.],
            [3., 3.],
            [2., 2.],
            [2., 1.],
            [1., 1.],
            [1., 2.],
            [2., 2.],
            [3., 3.],
            [0., 3.],
        ]);
        let triangles = clip_ears(&keyhole).expect("joined outlines have ears");
        let sum: f64 = triangles.iter().map(|t| turn(keyhole[t[0]], keyhole[t[1]], keyhole[t[2]])).sum();
        assert_eq!(sum, 16.0);
    }

    #[test]
    fn outlines_of_many_corners_take_no_time() {
        let count = 50_000;
        let angle = |i: u32| f64::from(i) / f64::from(count) * std::f64::consts::TAU;
        let mut state = 1_u32;
        let mut noise = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        let star = (0..count).map(|i| DVec2::from_angle(angle(i)) * (0.3 + 0.7 * noise())).collect();
        let wheel =
            (0..count).map(|i| DVec2::from_angle(angle(i)) * (1.0 + 0.01 * f64::from(i % 2))).collect();
        let half = count / 2;
        let arm = |i: u32, width: f64| {
            let turns = f64::from(i) / f64::from(half) * 200.0;
            DVec2::from_angle(turns) * (0.01 * (turns + width) + 0.1)
        };
        let spiral = (0..half).map(|i| arm(i, 3.0)).chain((0..half).rev().map(|i| arm(i, 0.0))).collect();
        let teeth = (0..count / 4).rev().map(f64::from);
        let teeth = teeth.flat_map(|x| [[x + 1.0, 9.0], [x + 0.5, 9.0], [x + 0.5, 1.0], [x, 1.0]]);
        let comb = [[0.0, 0.0], [f64::from(count / 4), 0.0]]
            .into_iter()
            .chain(teeth)
            .map(DVec2::from_array)
            .collect();
        let outlines: [(&str, Vec<DVec2>); 4] =
            [("star", star), ("wheel", wheel), ("spiral", spiral), ("comb", comb)];
        for (name, outline) in outlines {
            let started = std::time::Instant::now();
            let triangles = clip_ears(&outline).expect(name);
            let seconds = started.elapsed().as_secs_f64();
            assert_eq!(triangles.len(), outline.len() - 2, "{name}");
            let sum: f64 = triangles.iter().map(|t| turn(outline[t[0]], outline[t[1]], outline[t[2]])).sum();
            let area = twice_area(&outline);
            assert!((sum - area).abs() <= 1e-9 * area, "{name}: {sum} and {area}");
            // quadratic time would be minutes without optimisation; this is n log n on a busy machine
            assert!(seconds < 30.0, "{name}: {seconds} s");
        }
    }

    #[test]
    fn wrong_outlines_have_no_ears() {
        assert_eq!(clip_ears(&points(&[[0., 0.], [1., 1.], [1., 0.], [0., 1.]])), Err(NoEar));
        assert_eq!(clip_ears(&points(&[[0., 0.], [0., 1.], [1., 0.]])), Err(NoEar));
        assert_eq!(clip_ears(&points(&[[0., 0.], [1., 0.], [2., 0.], [3., 0.]])), Err(NoEar));
    }

    /// A polygon around the origin with random radii: simple, mostly concave.
    fn star_shaped() -> impl Strategy<Value = Vec<DVec2>> {
        proptest::collection::vec(0.05..1.0f64, 3..40).prop_map(|radii| {
            let step = std::f64::consts::TAU / radii.len() as f64;
            let vertices = radii.iter().zip(0..);
            vertices.map(|(&r, i)| DVec2::from_angle(f64::from(i) * step) * r).collect()
        })
    }

    /// A city's skyline on a grid: many collinear and aligned vertices.
    fn skyline() -> impl Strategy<Value = Vec<DVec2>> {
        proptest::collection::vec(1..4u8, 1..20).prop_map(|heights| {
            let mut outline = vec![DVec2::ZERO];
            outline.extend((1..=heights.len()).map(|x| DVec2::new(x as f64, 0.0)));
            for (x, &height) in heights.iter().enumerate().rev() {
                for x in [x + 1, x] {
                    let p = DVec2::new(x as f64, f64::from(height));
                    if outline.last() != Some(&p) {
                        outline.push(p);
                    }
                }
            }
            outline
        })
    }

    proptest! {
        #[test]
        fn simple_polygons_are_covered_once(outline in prop_oneof![star_shaped(), skyline()]) {
            prop_assume!(twice_area(&outline) > 0.0);
            prop_assert!(!crosses_itself(&outline));
            assert_triangulated(&outline);
        }

        #[test]
        fn any_outline_gives_counter_clockwise_triangles_or_none(
            outline in proptest::collection::vec((0..4u8, 0..4u8), 3..14)
        ) {
            let outline: Vec<_> = outline.iter().map(|&(x, y)| DVec2::new(x.into(), y.into())).collect();
            crosses_itself(&outline);
            is_convex(&outline);
            if let Ok(triangles) = clip_ears(&outline) {
                let sum: f64 = triangles.iter().map(|t| turn(outline[t[0]], outline[t[1]], outline[t[2]])).sum();
                prop_assert!((sum - twice_area(&outline)).abs() < 1e-9);
            }
        }
    }
}
