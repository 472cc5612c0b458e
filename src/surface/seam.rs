//! Which corners of a surface's faces are one: those on knot lines, on the seam of a surface that closes upon itself, and at
//! poles.

use glam::DVec3;

use crate::math::bounds;
use crate::patch::{BezierPatch, Face, Shell};
use crate::subdivide::VertexNumbers;

/// Control points this close, in parts of the surface's size, are the same: above the rounding of the polar forms, below
/// what a picture shows.
const SAME: f64 = 1e-13;

/// A seam is one only between faces that are at least so many around: fewer have two edges between the same two vertices.
const LEAST_AROUND: usize = 3;

/// A side of a patch.
#[derive(Clone, Copy)]
enum Side {
    Low,
    High,
}

/// The shell of a grid of untrimmed faces, those along v fastest.
pub(super) fn grid_shell(faces: Vec<Face>, count: [usize; 2]) -> Shell {
    let [low, high] = bounds::around(faces.iter().flat_map(|face| face.patch.hull_bounds()));
    let same = SAME * (high - low).length();
    let face = |i: usize, j: usize| &faces[i * count[1] + j].patch;
    let closes = |axis: usize| {
        let is_same = |(low, high): (&BezierPatch, &BezierPatch)| {
            let [low, high] = [side(low, axis, Side::Low), side(high, axis, Side::High)];
            low.iter().zip(&high).all(|(a, b)| a.distance(*b) <= same)
        };
        count[axis] >= LEAST_AROUND
            && (0..count[1 - axis]).all(|k| {
                is_same(if axis == 0 {
                    (face(0, k), face(count[0] - 1, k))
                } else {
                    (face(k, 0), face(k, count[1] - 1))
                })
            })
    };
    let closed = [closes(0), closes(1)];
    // whether the side at the start or end of an axis is one point
    let is_point = |axis: usize, at: Side| {
        let row = match at {
            Side::Low => 0,
            Side::High => count[axis] - 1,
        };
        let points: Vec<DVec3> = (0..count[1 - axis])
            .flat_map(|k| side(if axis == 0 { face(row, k) } else { face(k, row) }, axis, at))
            .collect();
        points.iter().all(|point| point.distance(points[0]) <= same)
    };
    let poles = [0, 1].map(|axis| [is_point(axis, Side::Low), is_point(axis, Side::High)]);
    let columns = count[1] + 1;
    let number = |mut at: [usize; 2]| {
        for axis in 0..2 {
            if closed[axis] && at[axis] == count[axis] {
                at[axis] = 0;
            }
        }
        for axis in 0..2 {
            let is_pole = (at[axis] == 0 && poles[axis][0]) || (at[axis] == count[axis] && poles[axis][1]);
            if is_pole {
                at[1 - axis] = 0;
            }
        }
        u32::try_from(at[0] * columns + at[1]).expect("fewer than 2^32 faces fit in memory")
    };
    let total = u32::try_from((count[0] + 1) * columns).expect("fewer than 2^32 faces fit in memory");
    let mut shell = Shell::new(VertexNumbers::new(total));
    for (index, face) in faces.into_iter().enumerate() {
        let (i, j) = (index / count[1], index % count[1]);
        shell.push(face, &[[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(number));
    }
    shell
}

/// The control points along a side of a patch, divided by their weights.
fn side(patch: &BezierPatch, axis: usize, at: Side) -> Vec<DVec3> {
    let [m, n] = patch.degree();
    let points: Vec<_> = patch.control_points().map(|point| point.truncate() / point.w).collect();
    let last = match at {
        Side::Low => 0,
        Side::High => patch.degree()[axis],
    };
    if axis == 0 {
        (0..=n).map(|j| points[last * (n + 1) + j]).collect()
    } else {
        (0..=m).map(|i| points[i * (n + 1) + last]).collect()
    }
}
