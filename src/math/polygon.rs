//! Convex polygons in a parameter plane.

use glam::DVec2;

/// Twice the signed area of a polygon; positive if it winds counter-clockwise.
pub(crate) fn doubled_area(corners: &[DVec2]) -> f64 {
    doubled_area_with(corners, |corner| *corner)
}

/// [`doubled_area`] of corners that carry more than their place.
pub(crate) fn doubled_area_with<C>(corners: &[C], place: impl Fn(&C) -> DVec2) -> f64 {
    let Some(anchor) = corners.first().map(&place) else { return 0.0 };
    corners.windows(2).map(|edge| (place(&edge[0]) - anchor).perp_dot(place(&edge[1]) - anchor)).sum()
}

/// Whether no corner of a polygon that winds counter-clockwise turns the other way, but for rounding.
pub(crate) fn is_convex(corners: &[DVec2]) -> bool {
    let count = corners.len();
    (0..count).all(|i| {
        let [before, here, after] = [i, i + 1, i + 2].map(|i| corners[i % count]);
        (here - before).perp_dot(after - here) >= 0.0
    })
}

/// Which side of a line `coordinate = value` to keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Below,
    Above,
}

/// The part of a convex polygon on one side of the line where coordinate `axis` is `value`, into `kept`.
///
/// Corners on the line are kept by both sides, and new corners lie on it exactly. Fewer than three corners are left
/// if no area is.
pub(crate) fn clip(corners: &[DVec2], axis: usize, value: f64, side: Side, kept: &mut Vec<DVec2>) {
    clip_with(corners, (axis, value, side), kept, |corner| *corner, |_, crossing, _| crossing);
}

/// [`clip`] of corners that carry more than their place. `cross` makes a new one, of the edge it is on, its place, and how far
/// that is along the edge.
pub(crate) fn clip_with<C: Copy>(
    corners: &[C],
    (axis, value, side): (usize, f64, Side),
    kept: &mut Vec<C>,
    place: impl Fn(&C) -> DVec2,
    mut cross: impl FnMut([&C; 2], DVec2, f64) -> C,
) {
    kept.clear();
    let depth = |corner: &C| match side {
        Side::Below => value - place(corner)[axis],
        Side::Above => place(corner)[axis] - value,
    };
    for (i, here) in corners.iter().enumerate() {
        let next = &corners[(i + 1) % corners.len()];
        let (depth_here, depth_next) = (depth(here), depth(next));
        if depth_here >= 0.0 {
            kept.push(*here);
        }
        if (depth_here > 0.0 && depth_next < 0.0) || (depth_here < 0.0 && depth_next > 0.0) {
            let edge = if place(here)[axis] < place(next)[axis] { [here, next] } else { [next, here] };
            let [a, b] = edge.map(&place);
            let fraction = (value - a[axis]) / (b[axis] - a[axis]);
            let mut crossing = a + fraction * (b - a);
            crossing[axis] = value;
            kept.push(cross(edge, crossing, fraction));
        }
    }
}

/// The part of a convex polygon in the closed rectangle `[low, high]`.
pub(crate) fn clip_to_rectangle(corners: &[DVec2], [low, high]: [DVec2; 2]) -> Vec<DVec2> {
    let (mut corners, mut kept) = (corners.to_vec(), Vec::new());
    for axis in 0..2 {
        for (value, side) in [(low[axis], Side::Above), (high[axis], Side::Below)] {
            clip(&corners, axis, value, side, &mut kept);
            std::mem::swap(&mut corners, &mut kept);
        }
    }
    corners
}

/// The part of a convex polygon in another one, whose corners wind counter-clockwise.
pub(crate) fn clip_to_convex(corners: &[DVec2], outline: &[DVec2]) -> Vec<DVec2> {
    let (mut corners, mut kept) = (corners.to_vec(), Vec::new());
    for (i, &from) in outline.iter().enumerate() {
        let along = outline[(i + 1) % outline.len()] - from;
        let depth = |corner: DVec2| along.perp_dot(corner - from);
        kept.clear();
        for (j, &here) in corners.iter().enumerate() {
            let next = corners[(j + 1) % corners.len()];
            let (depth_here, depth_next) = (depth(here), depth(next));
            if depth_here >= 0.0 {
                kept.push(here);
            }
            if (depth_here > 0.0 && depth_next < 0.0) || (depth_here < 0.0 && depth_next > 0.0) {
                kept.push(here.lerp(next, depth_here / (depth_here - depth_next)));
            }
        }
        std::mem::swap(&mut corners, &mut kept);
    }
    corners
}

/// The point of a closed convex polygon, whose corners wind counter-clockwise, that is nearest to `point`.
pub(crate) fn nearest(corners: &[DVec2], point: DVec2) -> DVec2 {
    let mut nearest = None;
    for (i, &from) in corners.iter().enumerate() {
        let along = corners[(i + 1) % corners.len()] - from;
        if along.perp_dot(point - from) >= 0.0 {
            continue;
        }
        let fraction = ((point - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        let candidate = from + fraction * along;
        let distance_sq = candidate.distance_squared(point);
        if nearest.is_none_or(|(least, _)| distance_sq < least) {
            nearest = Some((distance_sq, candidate));
        }
    }
    nearest.map_or(point, |(_, candidate)| candidate)
}

/// Lowest and highest corner of the bounding rectangle; `None` without corners.
pub(crate) fn bounds(corners: impl IntoIterator<Item = DVec2>) -> Option<[DVec2; 2]> {
    corners.into_iter().map(|corner| [corner; 2]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_is_inside_or_on_the_border() {
        let square = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
        for (point, want) in [
            (DVec2::new(0.3, 0.4), DVec2::new(0.3, 0.4)),
            (DVec2::new(-1.0, 0.4), DVec2::new(0.0, 0.4)),
            (DVec2::new(2.0, 3.0), DVec2::ONE),
            (DVec2::new(0.5, -0.1), DVec2::new(0.5, 0.0)),
        ] {
            assert_eq!(nearest(&square, point), want);
        }
    }

    #[test]
    fn convex_polygons_intersect() {
        let square = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
        let triangle = [DVec2::new(0.5, 0.5), DVec2::new(2.0, 0.5), DVec2::new(0.5, 2.0)];
        assert!((doubled_area(&clip_to_convex(&triangle, &square)) - 0.5).abs() < 1e-15);
        assert!((doubled_area(&clip_to_convex(&square, &triangle)) - 0.5).abs() < 1e-15);
        let beside = triangle.map(|corner| corner + DVec2::X);
        assert_eq!(doubled_area(&clip_to_convex(&beside, &square)), 0.0);
    }

    #[test]
    fn the_two_sides_of_a_cut_make_the_whole() {
        let polygon =
            [DVec2::new(0.0, 0.2), DVec2::new(0.7, 0.0), DVec2::new(1.0, 0.6), DVec2::new(0.3, 1.0)];
        let (mut below, mut above) = (Vec::new(), Vec::new());
        for axis in 0..2 {
            for value in [0.0, 0.2, 0.3, 0.5, 0.7, 1.0] {
                clip(&polygon, axis, value, Side::Below, &mut below);
                clip(&polygon, axis, value, Side::Above, &mut above);
                let sum = doubled_area(&below) + doubled_area(&above);
                assert!((sum - doubled_area(&polygon)).abs() < 1e-15, "axis {axis} value {value}");
                assert!(below.iter().all(|p| p[axis] <= value) && above.iter().all(|p| p[axis] >= value));
            }
        }
    }
}
