//! Polygons cut at the knot planes into triangles, as before sub-polygons with more corners were kept.
//!
//! Source: Feng, Heng, Wong (1998), *Accurate B-spline free-form deformation of polygonal objects*, as Feng, Nishita,
//! Jin, Peng (2002), sections 3.2 and 3.3.1, describe it; with the sign tests and the snapping of
//! [`cut_at_knot_planes`](super::cut_at_knot_planes), so that it is as robust.

use glam::DVec3;

use crate::spline::SplineVolume;

use super::cut::{Corner, Cutter, Pieces, middle, range};
use super::vertices::Numbering;

/// Cuts convex polygons at the knot planes of a volume into triangles.
///
/// The triangles of a polygon's fan are cut by the planes of x, then y, then z, one after the other, and what is no
/// triangle then is triangulated at once. Knot boxes, parts outside the lattice and corners on edges that polygons
/// share are as with [`cut_at_knot_planes`](super::cut_at_knot_planes); triangles without area are left out.
pub(crate) fn cut_into_triangles<'a>(
    polygons: impl Iterator<Item = (u32, &'a [DVec3])>,
    volume: Option<&SplineVolume>,
) -> Pieces {
    let mut pieces = Pieces::default();
    let Some(volume) = volume else {
        let mut numbering = Numbering::default();
        for (polygon, corners) in polygons {
            let corners: Vec<_> = corners.iter().map(|&corner| Corner::new(corner, &mut numbering)).collect();
            for triangle in fan(&corners).filter(has_area) {
                pieces.push(polygon, None, triangle);
            }
        }
        pieces.set_numbers(numbering.numbers);
        return pieces;
    };
    let mut cutter = Cutter::new(volume);
    let mut waiting = Vec::new();
    let mut snapped = Vec::new();
    for (polygon, corners) in polygons {
        snapped.clear();
        snapped.extend(corners.iter().map(|&corner| cutter.corner(corner)));
        for corners in fan(&snapped) {
            waiting.push(Uncut { corners, axis: 0, plane: 0 });
            while let Some(triangle) = waiting.pop() {
                if has_area(&triangle.corners) {
                    cut(&mut cutter, polygon, triangle, &mut waiting, &mut pieces);
                }
            }
        }
    }
    pieces.set_numbers(cutter.numbering.numbers);
    pieces
}

/// A triangle and the first plane that may cut it: of `axis`, number `plane`.
struct Uncut {
    corners: [Corner; 3],
    axis: usize,
    plane: usize,
}

/// Cuts a triangle at the next plane through it, or adds it to the pieces if there is none.
fn cut(
    cutter: &mut Cutter<'_>,
    polygon: u32,
    Uncut { corners, axis: first_axis, plane: mut first }: Uncut,
    waiting: &mut Vec<Uncut>,
    pieces: &mut Pieces,
) {
    let volume = cutter.volume;
    let places = corners.map(|corner| corner.place);
    for axis in first_axis..3 {
        let planes = volume.axes()[axis].breakpoints();
        let (min, max) = range(places, axis);
        let next = first + planes[first..].partition_point(|&plane| plane <= min);
        if planes.get(next).is_some_and(|&plane| plane < max) {
            split(cutter, corners, axis, next, |corners| {
                waiting.push(Uncut { corners, axis, plane: next + 1 });
            });
            return;
        }
        let middle = min + 0.5 * (max - min);
        if middle < planes[0] || middle > planes[planes.len() - 1] {
            pieces.push(polygon, None, corners);
            return;
        }
        first = 0;
    }
    pieces.push(polygon, volume.knot_box(middle(places)), corners);
}

/// Splits a triangle with corners on both sides of a plane, into two or three.
///
/// The quadrilateral falls into the fan about the crossing that is met first, from the first corner on. That gives the
/// published count for the unit cube, 60, where the shorter diagonals would give 48 and the longer ones 72.
fn split(
    cutter: &mut Cutter<'_>,
    corners: [Corner; 3],
    axis: usize,
    plane: usize,
    mut add: impl FnMut([Corner; 3]),
) {
    let value = cutter.volume.axes()[axis].breakpoints()[plane];
    let side = |i: usize| corners[i % 3].place[axis].total_cmp(&value);
    let in_plane = (0..3).find(|&i| side(i).is_eq());
    let alone = || (0..3).find(|&i| side(i + 1) == side(i + 2));
    let apex = in_plane.or_else(alone).unwrap_or(0);
    let [a, b, c] = [0, 1, 2].map(|i| corners[(apex + i) % 3]);
    if in_plane.is_some() {
        let crossing = cutter.crossing([b, c], axis, plane);
        add([a, b, crossing]);
        add([a, crossing, c]);
        return;
    }
    let [after, before] = [b, c].map(|other| cutter.crossing([a, other], axis, plane));
    add([a, after, before]);
    if apex == 0 {
        add([after, b, c]);
        add([after, c, before]);
    } else {
        add([before, after, b]);
        add([before, b, c]);
    }
}

/// The triangles of a convex polygon's fan about its first corner.
fn fan(corners: &[Corner]) -> impl Iterator<Item = [Corner; 3]> {
    corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]])
}

/// Whether a triangle's corners are not in line.
fn has_area(corners: &[Corner; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| corner.place);
    (b - a).cross(c - a).length() > 0.0
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use crate::test_support::{Noise, ball_triangles, cube_triangles};

    fn cube_volume(points: usize) -> SplineVolume {
        SplineVolume::identity([2; 3], [points; 3], [DVec3::ZERO, DVec3::ONE]).unwrap()
    }

    fn cut_all(polygons: &[impl AsRef<[DVec3]>], volume: Option<&SplineVolume>) -> Pieces {
        cut_into_triangles((0..).zip(polygons).map(|(number, corners)| (number, corners.as_ref())), volume)
    }

    fn area(corners: &[DVec3]) -> f64 {
        0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length()
    }

    fn total_area(pieces: &Pieces) -> f64 {
        (0..pieces.len()).map(|index| area(pieces.corners(index))).sum()
    }

    #[test]
    fn the_unit_cube_gives_60_triangles() {
        let halves = |quad: [usize; 4]| [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]];
        let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
        // the faces as in scenes/meshes/feng_fig07_cube.obj, whose diagonals are others
        let model = [[4, 6, 2, 0], [1, 3, 7, 5], [1, 5, 4, 0], [2, 6, 7, 3], [2, 3, 1, 0], [4, 5, 7, 6]];
        let model = model.into_iter().flat_map(halves).map(|triangle| triangle.map(corner)).collect();
        for triangles in [cube_triangles(), model] {
            let pieces = cut_all(&triangles, Some(&cube_volume(4)));
            assert_eq!(pieces.len(), 60, "as published");
            assert!((total_area(&pieces) - 6.0).abs() < 1e-14);
        }
    }

    #[test]
    fn closed_solids_stay_closed_to_the_bit() {
        let mut noise = Noise(3);
        let tilted = glam::DMat3::from_quat(glam::DQuat::from_scaled_axis(noise.unit_vector()));
        let turned = cube_triangles().iter().map(|t| t.map(|p| tilted * (0.55 * (p - 0.5)) + 0.5)).collect();
        for triangles in [cube_triangles(), ball_triangles(), turned] {
            for points in [3, 4, 6, 9] {
                let volume = cube_volume(points);
                let pieces = cut_all(&triangles, Some(&volume));
                let mut edges: HashMap<[[u64; 3]; 2], i32> = HashMap::new();
                for index in 0..pieces.len() {
                    let corners = pieces.corners(index);
                    assert_eq!(corners.len(), 3);
                    assert!(area(corners) > 1e-12);
                    if let Some(knot_box) = pieces.piece(index).knot_box {
                        for (axis, knots) in volume.axes().iter().enumerate() {
                            let ends = &knots.breakpoints()[knot_box[axis]..knot_box[axis] + 2];
                            assert!(corners.iter().all(|c| (ends[0]..=ends[1]).contains(&c[axis])));
                        }
                    }
                    let bits = |i: usize| corners[i % 3].to_array().map(|x| (x + 0.0).to_bits());
                    for i in 0..3 {
                        *edges.entry([bits(i), bits(i + 1)]).or_default() += 1;
                        *edges.entry([bits(i + 1), bits(i)]).or_default() -= 1;
                    }
                }
                assert!(edges.values().all(|&surplus| surplus == 0), "{points} points");
                let want: f64 = triangles.iter().map(|t| area(t)).sum();
                assert!((total_area(&pieces) - want).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn parts_outside_are_split_at_the_box_and_not_cut_further() {
        let corners = [DVec3::new(-1.0, 0.1, 0.1), DVec3::new(2.0, 0.1, 0.1), DVec3::new(2.0, 0.4, 0.1)];
        let pieces = cut_all(&[corners], Some(&cube_volume(4)));
        let outside = (0..pieces.len()).filter(|&index| pieces.piece(index).knot_box.is_none());
        assert!(outside.clone().all(|i| pieces.corners(i).iter().all(|p| p.x <= 0.0 || p.x >= 1.0)));
        let inside = pieces.len() - outside.clone().count();
        assert_eq!((inside, outside.count()), (8, 5), "cut at x = 0, 1/2 and 1, outside no further");
    }

    #[test]
    fn polygons_fall_into_fans_and_triangles_without_area_are_left_out() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y].to_vec();
        assert_eq!(cut_all(&[&square], None).len(), 2);
        let with_middle = [square[0], 0.5 * DVec3::X, square[1], square[2], square[3]];
        let pieces = cut_all(&[with_middle], None);
        assert_eq!(pieces.len(), 2, "the triangle of three corners in line is none");
        assert!((total_area(&pieces) - 1.0).abs() < 1e-15);
        let needle =
            [DVec3::new(0.1, 0.1, 0.1), DVec3::new(0.9, 0.1, 0.1), DVec3::new(0.9, 0.1 + 1e-13, 0.1)];
        let pieces = cut_all(&[needle], Some(&cube_volume(4)));
        assert!((total_area(&pieces) - area(&needle)).abs() < 1e-17, "a needle is none of these");
        let in_line = [needle[0], needle[1], needle[0].midpoint(needle[1])];
        assert_eq!(cut_all(&[in_line], Some(&cube_volume(4))).len(), 0);
    }
}
