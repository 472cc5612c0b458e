//! Coplanar pieces of one knot box gathered into groups that share a surface.
//!
//! Source: Feng, Nishita, Jin, Peng (2002), section 3.3.2, with the distance of vertices from the plane in place of
//! thresholds on the plane's equation, so that the test means the same for polygons of every size.

use std::collections::HashMap;

use glam::DVec3;

use crate::spline::KnotBox;

use super::cut::Pieces;

/// Greatest distance of a vertex from the plane it is put into, in parts of the object's diagonal.
///
/// Above the rounding of planes computed from small polygons, below the accuracy asked of hits (1e-11). The
/// distance that remains is measured and widens the trim, so that neighbours still meet.
const COPLANAR: f64 = 1e-12;

/// Side of the hash cells of (normal, distance / diagonal): neighbours in a class differ by far less.
const HASH_CELL: f64 = 1e-7;

/// How far a plane may be from the class it joins before the distance of the vertices is tested.
const CANDIDATE: f64 = 1e-9;

/// A normal's component below this is tried as 0, which lowers degrees; kept if the vertices agree.
const AXIS_PARALLEL: f64 = 1e-9;

/// A polygon is a needle if its doubled area is less than this part of its longest edge's square.
///
/// The area vector of such a polygon points anywhere by rounding, also along the needle: there by more than what is asked of
/// vertices in their plane.
const NEEDLE: f64 = 1e-3;

/// A plane through `anchor` with a unit normal; components of the normal that count as 0 are exactly 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    pub(crate) normal: DVec3,
    pub(crate) anchor: DVec3,
}

impl Plane {
    /// The plane of a polygon by Newell's vector area; `None` if the area is 0 or not finite.
    ///
    /// Source: Sutherland, Sproull, Schumacker (1974), after Newell.
    fn of_polygon(corners: &[DVec3]) -> Option<(Self, f64)> {
        let anchor = corners[0];
        let doubled: DVec3 = corners.windows(2).map(|edge| (edge[0] - anchor).cross(edge[1] - anchor)).sum();
        let length = doubled.length();
        let mut normal = doubled / length;
        let ends = corners.iter().zip(corners.iter().cycle().skip(1));
        let longest = ends
            .map(|(from, to)| *to - *from)
            .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        if let Some(along) =
            longest.filter(|edge| length < NEEDLE * edge.length_squared()).and_then(DVec3::try_normalize)
        {
            for _ in 0..2 {
                normal = normal.reject_from_normalized(along).normalize();
            }
        }
        let plane = Self { normal, anchor };
        (length > 0.0 && plane.normal.is_finite()).then_some((plane, 0.5 * length))
    }

    fn distance(&self, point: DVec3) -> f64 {
        self.normal.dot(point - self.anchor)
    }

    fn holds(&self, corners: &[DVec3], tolerance: f64) -> bool {
        corners.iter().all(|&corner| self.distance(corner).abs() <= tolerance)
    }

    /// The plane with components of the normal that are nearly 0 made 0, if the polygon lies in it still.
    fn axis_parallel(self, corners: &[DVec3], tolerance: f64) -> Self {
        let small = self.normal.abs().cmplt(DVec3::splat(AXIS_PARALLEL));
        let normal = DVec3::select(small, DVec3::ZERO, self.normal).normalize();
        let snapped = Self { normal, anchor: self.anchor };
        if snapped.holds(corners, tolerance) { snapped } else { self }
    }
}

/// Pieces of one knot box in one plane.
#[derive(Clone, Debug)]
pub(crate) struct Group {
    pub(crate) knot_box: Option<KnotBox>,
    pub(crate) plane: Plane,
    /// Indices into the pieces, rising.
    pub(crate) pieces: Vec<u32>,
}

/// Groups pieces by knot box and plane; opposite normals stay apart.
///
/// `polygons` gives the corners of the polygons the pieces are cut from, `diagonal` is the object's. The groups are
/// ordered by box, then by the first polygon of their plane.
pub(crate) fn group_coplanar<'a>(
    pieces: &Pieces,
    polygons: impl Fn(u32) -> &'a [DVec3],
    diagonal: f64,
) -> Vec<Group> {
    let classes = classify(pieces, polygons, diagonal);
    let mut order: Vec<_> = (0..pieces.len())
        .filter_map(|index| {
            let piece = pieces.piece(index);
            let class = classes.of_polygon.get(piece.polygon as usize).copied().flatten()?;
            Some((piece.knot_box, class, u32::try_from(index).expect("fewer than 2^32 pieces fit in memory")))
        })
        .collect();
    order.sort_unstable();
    order
        .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
        .map(|run| Group {
            knot_box: run[0].0,
            plane: classes.planes[run[0].1 as usize],
            pieces: run.iter().map(|entry| entry.2).collect(),
        })
        .collect()
}

#[derive(Default)]
struct Classes {
    planes: Vec<Plane>,
    /// The class of each polygon that has pieces.
    of_polygon: Vec<Option<u32>>,
}

/// Puts every polygon that has pieces into a class of coplanar ones.
///
/// The largest polygon of a class gives its plane, for its normal is known best.
fn classify<'a>(pieces: &Pieces, polygons: impl Fn(u32) -> &'a [DVec3], diagonal: f64) -> Classes {
    let mut ids: Vec<u32> = (0..pieces.len()).map(|index| pieces.piece(index).polygon).collect();
    ids.dedup();
    let mut planes: Vec<_> = ids
        .into_iter()
        .filter_map(|id| Plane::of_polygon(polygons(id)).map(|(plane, area)| (id, plane, area)))
        .collect();
    let mut classes = Classes::default();
    let highest = planes.iter().map(|entry| entry.0 as usize + 1).max().unwrap_or(0);
    classes.of_polygon.resize(highest, None);
    planes.sort_by(|a, b| b.2.total_cmp(&a.2).then(a.0.cmp(&b.0)));
    let tolerance = COPLANAR * diagonal;
    let mut table: HashMap<[i64; 4], Vec<u32>> = HashMap::new();
    for (id, plane, _) in planes {
        let corners = polygons(id);
        let plane = plane.axis_parallel(corners, tolerance);
        let key = key(&plane, diagonal);
        let found = near_cells(key).find_map(|cell| {
            table.get(&cell)?.iter().copied().find(|&class| {
                let other: &Plane = &classes.planes[class as usize];
                other.normal.dot(plane.normal) > 0.0 && other.holds(corners, tolerance)
            })
        });
        let class = found.unwrap_or_else(|| {
            let class = u32::try_from(classes.planes.len()).expect("fewer than 2^32 planes fit in memory");
            classes.planes.push(plane);
            table.entry(key.map(quantise)).or_default().push(class);
            class
        });
        classes.of_polygon[id as usize] = Some(class);
    }
    in_polygon_order(classes)
}

/// Renumbers the classes by their first polygon, so that patches follow the order of the input.
fn in_polygon_order(classes: Classes) -> Classes {
    let mut renumbered = Classes { planes: Vec::with_capacity(classes.planes.len()), ..Classes::default() };
    let mut new_number = vec![None; classes.planes.len()];
    renumbered.of_polygon = classes
        .of_polygon
        .iter()
        .map(|class| {
            class.map(|old| {
                *new_number[old as usize].get_or_insert_with(|| {
                    renumbered.planes.push(classes.planes[old as usize]);
                    u32::try_from(renumbered.planes.len() - 1).expect("fewer than 2^32 planes fit in memory")
                })
            })
        })
        .collect();
    renumbered
}

fn key(plane: &Plane, diagonal: f64) -> [f64; 4] {
    let n = plane.normal;
    [n.x, n.y, n.z, n.dot(plane.anchor) / diagonal].map(|x| x / HASH_CELL)
}

#[expect(clippy::cast_possible_truncation, reason = "saturates; far cells may share a bucket")]
fn quantise(x: f64) -> i64 {
    x.floor() as i64
}

/// The hash cells a plane within [`CANDIDATE`] of the key can be in: one, or two per value near a border.
fn near_cells(key: [f64; 4]) -> impl Iterator<Item = [i64; 4]> {
    let reach = CANDIDATE / HASH_CELL;
    let low = key.map(|x| quantise(x - reach));
    let high = key.map(|x| quantise(x + reach));
    (0..16_usize).filter_map(move |mask| {
        let mut cell = low;
        for (axis, value) in cell.iter_mut().enumerate() {
            if mask >> axis & 1 == 1 {
                if high[axis] == low[axis] {
                    return None;
                }
                *value = high[axis];
            }
        }
        Some(cell)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subdivide::cut_at_knot_planes;

    fn groups_of(polygons: &[Vec<DVec3>]) -> Vec<Group> {
        let list = polygons.iter().enumerate().map(|(i, p)| (u32::try_from(i).unwrap(), p.as_slice()));
        let pieces = cut_at_knot_planes(list, None, false);
        group_coplanar(&pieces, |id| polygons[id as usize].as_slice(), 2.0)
    }

    #[test]
    fn halves_of_a_quad_share_a_group_and_its_reverse_does_not() {
        let (a, b, c, d) =
            (DVec3::new(0.1, 0.2, 0.3), DVec3::new(1.1, 0.3, 0.2), DVec3::new(1.3, 1.4, 0.5), DVec3::ZERO);
        let d = a + (c - b) + d;
        let groups = groups_of(&[vec![a, b, c], vec![a, c, d], vec![a, c, b]]);
        assert_eq!(groups.len(), 2);
        assert_eq!(groups[0].pieces, [0, 1]);
        assert_eq!(groups[1].pieces, [2]);
    }

    #[test]
    fn parallel_planes_stay_apart_and_nearly_axis_parallel_ones_become_so() {
        let quad = |z: f64, tilt: f64| {
            vec![
                DVec3::new(0.0, 0.0, z),
                DVec3::new(1.0, 0.0, z + tilt),
                DVec3::new(1.0, 1.0, z + tilt),
                DVec3::new(0.0, 1.0, z),
            ]
        };
        let groups = groups_of(&[quad(0.5, 1e-14), quad(0.5 + 1e-9, 0.0), quad(0.5, 1e-9)]);
        assert_eq!(groups.len(), 3);
        assert_eq!(groups[0].plane.normal, DVec3::Z, "a tilt below rounding is none");
        assert!(groups[2].plane.normal.x != 0.0, "a real tilt stays");
    }
}
