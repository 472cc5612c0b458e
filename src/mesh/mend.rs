//! Outlines that cross themselves by no more than rounding: a hole's slit whose two sides are written with few digits.

use glam::DVec2;

use super::triangulate::{MOST_SEARCHED, clip_ears, crossings};
use super::turn::turn;

/// Rounds of letting edges pass through vertices next to them: each may bring another vertex next to an edge.
const ROUNDS: usize = 4;

/// Cuts an outline into triangles as if vertices next to each other were at one place, and vertices next to an edge on it: so
/// near as it takes, from 1e-12 of the outline's size to 1e-3. The triangles refer to the vertices as they are, and those
/// that do not wind counter-clockwise then, which are as thin, are left out.
///
/// None if that does not help: the outline crosses itself by more.
pub(super) fn triangulate_mended(points: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let low = points.iter().copied().reduce(DVec2::min)?;
    let high = points.iter().copied().reduce(DVec2::max)?;
    let size = (high - low).length();
    (-12..=-3).find_map(|exponent| {
        let outline = Outline::merged(points, size * 10.0_f64.powi(exponent)).passed_through()?;
        let triangles = clip_ears(&outline.points).ok()?.into_iter();
        let triangles = triangles.map(|triangle| triangle.map(|i| outline.vertices[i]));
        let triangles: Vec<_> = triangles
            .filter(|triangle| {
                let [a, b, c] = triangle.map(|i| points[i]);
                turn(a, b, c) > 0.0
            })
            .collect();
        (!triangles.is_empty()).then_some(triangles)
    })
}

/// An outline with some of its vertices moved a little.
struct Outline {
    points: Vec<DVec2>,
    /// Which vertex of the given outline each is.
    vertices: Vec<usize>,
    /// How near is next to each other.
    tolerance: f64,
}

impl Outline {
    /// The outline with vertices next to each other at the place of the first of them, once where they follow each other.
    fn merged(points: &[DVec2], tolerance: f64) -> Self {
        let mut along: Vec<usize> = (0..points.len()).collect();
        along.sort_by(|&i, &j| points[i].x.total_cmp(&points[j].x));
        let mut places = points.to_vec();
        let mut is_placed = vec![false; points.len()];
        for (rank, &i) in along.iter().enumerate() {
            if is_placed[i] {
                continue;
            }
            let near = along[rank + 1..].iter().take_while(|&&j| points[j].x - points[i].x <= tolerance);
            for &j in near.filter(|&&j| points[j].distance(points[i]) <= tolerance) {
                places[j] = places[i];
                is_placed[j] = true;
            }
        }
        let mut outline = Self { points: Vec::new(), vertices: Vec::new(), tolerance };
        for (vertex, place) in places.into_iter().enumerate() {
            if outline.points.last() != Some(&place) {
                outline.points.push(place);
                outline.vertices.push(vertex);
            }
        }
        while outline.points.len() > 1 && outline.points.first() == outline.points.last() {
            outline.points.pop();
            outline.vertices.pop();
        }
        outline
    }

    /// The outline with edges that cross led through a vertex of the other that is next to them; none if they cross still.
    fn passed_through(mut self) -> Option<Self> {
        for _ in 0..ROUNDS {
            if self.points.len() < 3 || self.points.len() > MOST_SEARCHED {
                break;
            }
            let most = 4 * self.points.len();
            let crossings = crossings(&self.points, most);
            if crossings.is_empty() {
                break;
            }
            if crossings.len() == most {
                return None;
            }
            // vertices to pass through by the edge that does, and by where on it
            let mut passed = Vec::new();
            for [first, second] in crossings {
                for [edge, other] in [[first, second], [second, first]] {
                    passed.extend(self.ends(other).into_iter().filter_map(|end| self.next_to(edge, end)));
                }
            }
            if passed.is_empty() {
                return None;
            }
            self.insert(passed);
        }
        let crosses = self.points.len() <= MOST_SEARCHED && !crossings(&self.points, 1).is_empty();
        (self.points.len() >= 3 && !crosses).then_some(self)
    }

    fn ends(&self, edge: usize) -> [usize; 2] {
        [edge, (edge + 1) % self.points.len()]
    }

    /// The edge, how far along it a vertex is, and the vertex, if that is next to the edge and not at its ends.
    fn next_to(&self, edge: usize, vertex: usize) -> Option<(usize, f64, usize)> {
        let [from, to] = self.ends(edge).map(|end| self.points[end]);
        let place = self.points[vertex];
        let along = to - from;
        let share = (place - from).dot(along) / along.length_squared();
        let near = (place - from).perp_dot(along).abs() <= self.tolerance * along.length();
        (near && share > 0.0 && share < 1.0 && place != from && place != to).then_some((edge, share, vertex))
    }

    fn insert(&mut self, mut passed: Vec<(usize, f64, usize)>) {
        passed.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut passed = passed.into_iter().peekable();
        let (mut points, mut vertices) = (Vec::new(), Vec::new());
        for edge in 0..self.points.len() {
            points.push(self.points[edge]);
            vertices.push(self.vertices[edge]);
            while let Some((_, _, vertex)) = passed.next_if(|&(of, ..)| of == edge) {
                if points.last() != Some(&self.points[vertex]) {
                    points.push(self.points[vertex]);
                    vertices.push(self.vertices[vertex]);
                }
            }
        }
        (self.points, self.vertices) = (points, vertices);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn area(outline: &[DVec2]) -> f64 {
        let count = outline.len();
        (0..count).map(|i| outline[i].perp_dot(outline[(i + 1) % count])).sum::<f64>() / 2.0
    }

    fn mended_area(outline: &[DVec2]) -> Option<f64> {
        let triangles = triangulate_mended(outline)?;
        Some(triangles.iter().map(|triangle| area(&triangle.map(|i| outline[i]))).sum())
    }

    #[test]
    fn what_crosses_by_more_is_not_mended() {
        for outline in [[[0., 0.], [1., 1.], [1., 0.], [0., 1.]], [[0., 0.], [3., 3.], [3., 0.], [0., 1.]]] {
            assert_eq!(triangulate_mended(&outline.map(DVec2::from_array)), None);
        }
    }

    proptest! {
        /// A square with a square hole, joined by a slit in any direction, every vertex off by noise.
        #[test]
        fn slits_stay_within_their_noise(
            noise in proptest::collection::vec((-1.0..1.0, -1.0..1.0), 12),
            exponent in -10.0..-3.3,
            turned in 0.0..6.3,
            middle in any::<bool>(),
        ) {
            // once more the corner, then the hole the other way round, then its first vertex once more
            let mut outline: Vec<DVec2> =
                [[0., 0.], [5., 0.], [5., 4.], [0., 4.], [0., 0.], [1., 1.], [1., 3.], [4., 3.], [4., 1.], [1., 1.]]
                    .map(DVec2::from_array)
                    .to_vec();
            if middle {
                outline.insert(5, DVec2::splat(0.3));
                outline.push(DVec2::splat(0.7));
            }
            let size = 10.0_f64.powf(exponent);
            let rotation = DVec2::from_angle(turned);
            let outline: Vec<_> = outline
                .iter()
                .zip(&noise)
                .map(|(p, &(x, y))| rotation.rotate(*p) + size * DVec2::new(x, y))
                .collect();
            let found = mended_area(&outline);
            prop_assert!(found.is_some_and(|area| (area - 14.0).abs() <= 40.0 * size), "{found:?} of {outline:?}");
        }

        /// A slit that ends within a polygon.
        #[test]
        fn slits_that_end_inside_are_closed(
            noise in proptest::collection::vec((-1.0..1.0, -1.0..1.0), 7),
            exponent in -10.0..-3.3,
            turned in 0.0..6.3,
        ) {
            let outline = [[0., 0.], [2., 0.], [2., 1.], [1., 1.], [2., 1.], [2., 2.], [0., 2.]].map(DVec2::from_array);
            let size = 10.0_f64.powf(exponent);
            let rotation = DVec2::from_angle(turned);
            let outline: Vec<_> = outline
                .iter()
                .zip(&noise)
                .map(|(p, &(x, y))| rotation.rotate(*p) + size * DVec2::new(x, y))
                .collect();
            let found = mended_area(&outline);
            prop_assert!(found.is_some_and(|area| (area - 4.0).abs() <= 20.0 * size), "{found:?} of {outline:?}");
        }
    }
}
