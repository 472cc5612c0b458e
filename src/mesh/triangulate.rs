//! Polygons in the plane: convexity, self-intersection, ear clipping.
//!
//! Every decision is the sign of an exact predicate (Shewchuk 1997, crate `robust`) or a comparison of coordinates, so
//! the results are right for the coordinates given, without tolerances. Coordinates must be of moderate size (about 1),
//! since the predicates do not guard against overflow.

use glam::DVec2;
use robust::{Coord, orient2d};

/// Twice the signed area of `a b c`, with the right sign: positive where they turn left.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

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
///
/// Sweeps over x; n log n for the usual outline, n² at worst.
pub(super) fn crosses_itself(points: &[DVec2]) -> bool {
    let n = points.len();
    let mut edges: Vec<[DVec2; 2]> = (0..n).map(|i| [points[i], points[(i + 1) % n]]).collect();
    let left = |edge: &[DVec2; 2]| edge[0].x.min(edge[1].x);
    edges.sort_by(|a, b| left(a).total_cmp(&left(b)));
    edges.iter().enumerate().any(|(i, &[a, b])| {
        let right = a.x.max(b.x);
        let candidates = edges[i + 1..].iter().take_while(|other| left(other) < right);
        candidates.into_iter().any(|&[c, d]| {
            a.y.min(b.y) < c.y.max(d.y).next_up()
                && c.y.min(d.y) < a.y.max(b.y).next_up()
                && opposite(turn(a, b, c), turn(a, b, d))
                && opposite(turn(c, d, a), turn(c, d, b))
        })
    })
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
/// such outlines there may be fewer triangles. Quadratic time for usual outlines, cubic at worst.
///
/// Triangles that all wind counter-clockwise and whose boundaries add up to the outline cover each point as often as the
/// outline winds around it. So whatever order the ears are cut in, a result is right, and a wrong outline has none.
///
/// Source: Meisters, *Polygons have ears*, 1975.
pub(super) fn clip_ears(points: &[DVec2]) -> Result<Vec<[usize; 3]>, NoEar> {
    let mut ring = Ring::new(points);
    let mut triangles = Vec::with_capacity(points.len().saturating_sub(2));
    let mut tip = 0;
    let mut misses = 0;
    let mut touching_allowed = false;
    while ring.len > 3 {
        if misses == ring.len {
            if touching_allowed {
                return Err(NoEar);
            }
            touching_allowed = true;
            misses = 0;
        }
        if ring.is_ear(tip, touching_allowed) {
            let triangle = ring.corner(tip);
            if ring.turn_at(tip) > 0.0 {
                triangles.push(triangle);
            }
            ring.remove(tip);
            // not the neighbour: that would make a fan of slivers
            tip = ring.next[triangle[2]];
            misses = 0;
            touching_allowed = false;
        } else {
            tip = ring.next[tip];
            misses += 1;
        }
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

/// What is left of the polygon: a doubly linked ring of vertices.
struct Ring<'a> {
    points: &'a [DVec2],
    next: Vec<usize>,
    previous: Vec<usize>,
    /// Whether the vertex turns right or goes straight on: only such vertices can lie in an ear.
    reflex: Vec<bool>,
    len: usize,
}

impl<'a> Ring<'a> {
    fn new(points: &'a [DVec2]) -> Self {
        let len = points.len();
        let mut ring = Self {
            points,
            next: (0..len).map(|i| (i + 1) % len).collect(),
            previous: (0..len).map(|i| (i + len - 1) % len).collect(),
            reflex: vec![false; len],
            len,
        };
        for i in 0..len {
            ring.reflex[i] = ring.turn_at(i) <= 0.0;
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

    /// Whether the triangle at `tip` can be cut off: no vertex in it or on its rim, or with `touching_allowed` none inside.
    fn is_ear(&self, tip: usize, touching_allowed: bool) -> bool {
        let side = self.turn_at(tip);
        if side < 0.0 || (side == 0.0 && !touching_allowed) {
            return false;
        }
        let [before, _, after] = self.corner(tip);
        let [a, b, c] = self.corner(tip).map(|i| self.points[i]);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let mut i = self.next[after];
        while i != before {
            let p = self.points[i];
            let near =
                self.reflex[i] && p.cmpge(low).all() && p.cmple(high).all() && p != a && p != b && p != c;
            if near {
                let sides = [turn(a, b, p), turn(b, c, p), turn(c, a, p)];
                let inside = match touching_allowed {
                    true => sides.iter().all(|&side| side > 0.0),
                    false => sides.iter().all(|&side| side >= 0.0),
                };
                if inside {
                    return false;
                }
            }
            i = self.next[i];
        }
        true
    }

    fn remove(&mut self, i: usize) {
        let [before, _, after] = self.corner(i);
        self.next[before] = after;
        self.previous[after] = before;
        self.len -= 1;
        for i in [before, after] {
            self.reflex[i] = self.turn_at(i) <= 0.0;
        }
    }
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
