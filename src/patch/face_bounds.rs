//! Faces as boundary representations have them: an outer bound and holes, instead of convex loops side by side.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::math::polygon;

use super::region::{LoopPosition, index, position};
use super::topology::{EdgeUse, Topology};

/// Ends of an edge this close, in parts of the unit square, are one place: then what two loops of one face have on both sides of
/// the edge is one; else the edge is a seam.
const SAME_PLACE: f64 = 1e-9;

/// An edge in a bound, in its direction or against it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedEdge {
    /// Index of the edge.
    pub edge: u32,
    /// Whether the bound runs from the edge's second vertex to its first.
    pub is_reversed: bool,
    /// Its ends in the face's parameters, in the bound's direction.
    pub st: [DVec2; 2],
}

/// A connected part of a face's region, by its bounds: loops of edges that others have, too, or that are borders.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceBounds {
    /// Index of the first of its outlines.
    pub outline: u32,
    /// The outer bound, counter-clockwise in the face's parameters.
    pub outer: Vec<OrientedEdge>,
    /// The holes, clockwise.
    pub holes: Vec<Vec<OrientedEdge>>,
}

impl FaceBounds {
    /// The edges of all bounds.
    pub fn edges(&self) -> impl Iterator<Item = &OrientedEdge> {
        self.outer.iter().chain(self.holes.iter().flatten())
    }
}

/// An edge where two faces meet, or where one has its border.
///
/// An edge that more than two faces have, where solids touch, is as many joints as there are solids.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Joint {
    /// Index of the edge.
    pub edge: u32,
    /// Who has it: one or two.
    pub uses: Vec<BoundUse>,
}

/// An edge of a face's bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoundUse {
    /// Index of the face.
    pub face: u32,
    /// Its place in [`FaceBounds::edges`].
    pub position: u32,
}

/// Faces that joints join.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Component {
    /// Indices of the faces.
    pub faces: Vec<u32>,
    /// Whether two faces meet at each joint.
    pub is_closed: bool,
}

impl Topology<'_> {
    /// The parts of the faces' regions with their bounds. Loops of a face are one part where they share edges and have the same
    /// `key`, which is given the index of their input face.
    #[must_use]
    pub fn face_bounds<K: PartialEq>(&self, key: impl Fn(u32) -> K) -> Vec<FaceBounds> {
        let mut of_outline: Vec<Vec<(u32, EdgeUse)>> = vec![Vec::new(); self.outlines().len()];
        for (number, edge) in self.edges().iter().enumerate() {
            for edge_use in &edge.uses {
                of_outline[edge_use.outline as usize].push((index(number), *edge_use));
            }
        }
        of_outline.iter_mut().for_each(|uses| uses.sort_by_key(|(_, edge_use)| edge_use.corner));
        let key_of = |outline: usize| key(self.outlines()[outline].trim_loop.face);
        let mut found = Vec::new();
        let mut is_done = vec![false; of_outline.len()];
        for first in 0..of_outline.len() {
            if is_done[first] {
                continue;
            }
            let face = self.outlines()[first].face();
            let own = key_of(first);
            let of_face = |outline: &usize| std::ptr::eq(self.outlines()[*outline].face(), face);
            let run = (first..is_done.len()).take_while(of_face);
            let loops: Vec<usize> =
                run.filter(|&outline| !is_done[outline] && key_of(outline) == own).collect();
            loops.iter().for_each(|&outline| is_done[outline] = true);
            let uses = loops.iter().flat_map(|&outline| of_outline[outline].iter().copied());
            let bounds = self.bounds(&borders(uses.collect()));
            found.extend(faces(bounds).into_iter().map(|(outer, holes)| FaceBounds {
                outline: index(first),
                outer,
                holes,
            }));
        }
        found
    }

    /// Chains edges to simple loops: at a vertex with several ways on, the one most to the left, along the same part of the region;
    /// a loop is closed as soon as it comes to a vertex again.
    fn bounds(&self, borders: &[OrientedEdge]) -> Vec<Vec<OrientedEdge>> {
        let mut leaving: HashMap<u32, Vec<usize>> = HashMap::new();
        for (number, edge) in borders.iter().enumerate() {
            leaving.entry(self.vertices(edge)[0]).or_default().push(number);
        }
        let mut is_used = vec![false; borders.len()];
        let mut loops = Vec::new();
        for first in 0..borders.len() {
            let mut path: Vec<OrientedEdge> = Vec::new();
            let mut next = (!is_used[first]).then_some(first);
            while let Some(number) = next {
                is_used[number] = true;
                let edge = borders[number];
                path.push(edge);
                let end = self.vertices(&edge)[1];
                let leaves = |other: &OrientedEdge| self.vertices(other)[0] == end;
                // across a side that is a pole the vertex goes on at another place
                let goes_on = |other: &OrientedEdge| leaves(other) && is_near(other.st[0], edge.st[1]);
                let ways = || leaving.get(&end).into_iter().flatten().copied().filter(|&way| !is_used[way]);
                let to_left =
                    |a: &usize, b: &usize| turn(&edge, &borders[*a]).total_cmp(&turn(&edge, &borders[*b]));
                let start = path.iter().position(goes_on);
                next = ways().filter(|&way| goes_on(&borders[way])).max_by(to_left);
                let start =
                    if next.is_none() { start.or_else(|| path.iter().position(leaves)) } else { start };
                if let Some(start) = start {
                    loops.push(path.split_off(start));
                }
                next = if path.is_empty() { None } else { next.or_else(|| ways().max_by(to_left)) };
            }
        }
        loops
    }

    /// The vertices of an edge in a bound, in the bound's direction.
    #[must_use]
    pub fn vertices(&self, edge: &OrientedEdge) -> [u32; 2] {
        let [a, b] = self.edges()[edge.edge as usize].vertices;
        if edge.is_reversed { [b, a] } else { [a, b] }
    }

    /// Where the faces meet.
    #[must_use]
    pub fn joints(&self, faces: &[FaceBounds]) -> Vec<Joint> {
        let mut of_edge: Vec<Vec<(BoundUse, &OrientedEdge)>> = vec![Vec::new(); self.edges().len()];
        for (face, bounds) in faces.iter().enumerate() {
            for (position, edge) in bounds.edges().enumerate() {
                let bound_use = BoundUse { face: index(face), position: index(position) };
                of_edge[edge.edge as usize].push((bound_use, edge));
            }
        }
        let mut joints = Vec::new();
        for (edge, uses) in of_edge.into_iter().enumerate() {
            let mut push = |uses: Vec<BoundUse>| joints.push(Joint { edge: index(edge), uses });
            match *uses {
                [] => {}
                [(first, a), (second, b)] if a.is_reversed != b.is_reversed => push(vec![first, second]),
                _ => self.around(faces, uses).into_iter().for_each(push),
            }
        }
        joints
    }

    /// Joins those of an edge's faces that have the same material between them: seen along the edge, counter-clockwise from one
    /// that runs against the edge to the next that runs along it.
    fn around(&self, faces: &[FaceBounds], uses: Vec<(BoundUse, &OrientedEdge)>) -> Vec<Vec<BoundUse>> {
        let side = |(bound_use, edge): &(BoundUse, &OrientedEdge)| {
            let face = self.outlines()[faces[bound_use.face as usize].outline as usize].face();
            let [from, to] = edge.st;
            let point = face.eval(0.5 * (from + to));
            let step = to - from;
            let along = step.x * point.dp_ds + step.y * point.dp_dt;
            (point.normal().cross(along).normalize_or_zero(), if edge.is_reversed { -along } else { along })
        };
        let sides: Vec<_> = uses.iter().map(side).collect();
        let (first, axis) = (sides[0].0, sides[0].1.normalize_or_zero());
        let angle = |inward: DVec3| first.cross(inward).dot(axis).atan2(first.dot(inward));
        let mut sorted: Vec<_> = uses
            .iter()
            .zip(&sides)
            .map(|((bound_use, edge), (inward, _))| (angle(*inward), edge.is_reversed, *bound_use))
            .collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let count = sorted.len();
        let mut joints = Vec::new();
        let mut is_joined = vec![false; count];
        for i in 0..count {
            let next = (i + 1) % count;
            let ([from, to], free) = ([sorted[i], sorted[next]], !is_joined[i] && !is_joined[next]);
            if free && i != next && from.1 && !to.1 {
                joints.push(vec![from.2, to.2]);
                is_joined[i] = true;
                is_joined[next] = true;
            }
        }
        let alone = sorted.iter().zip(&is_joined).filter(|(_, is_joined)| !**is_joined);
        joints.extend(alone.map(|((_, _, bound_use), _)| vec![*bound_use]));
        joints
    }
}

/// Which of `count` faces joints join.
#[must_use]
pub fn components(count: usize, joints: &[Joint]) -> Vec<Component> {
    let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); count];
    let mut has_border = vec![false; count];
    for Joint { uses, .. } in joints {
        match **uses {
            [a, b] => {
                neighbours[a.face as usize].push(b.face);
                neighbours[b.face as usize].push(a.face);
            }
            _ => uses.iter().for_each(|bound_use| has_border[bound_use.face as usize] = true),
        }
    }
    let mut is_found = vec![false; count];
    let mut components = Vec::new();
    for first in 0..count {
        if std::mem::replace(&mut is_found[first], true) {
            continue;
        }
        let mut faces = vec![index(first)];
        let mut number = 0;
        while let Some(&face) = faces.get(number) {
            for &other in &neighbours[face as usize] {
                if !std::mem::replace(&mut is_found[other as usize], true) {
                    faces.push(other);
                }
            }
            number += 1;
        }
        faces.sort_unstable();
        let is_closed = !faces.iter().any(|&face| has_border[face as usize]);
        components.push(Component { faces, is_closed });
    }
    components
}

/// Whether places in a face's parameters are one.
fn is_near(a: DVec2, b: DVec2) -> bool {
    (a - b).abs().max_element() <= SAME_PLACE
}

/// How far an edge turns to the left of the one before it, in (-pi, pi].
fn turn(from: &OrientedEdge, to: &OrientedEdge) -> f64 {
    let [before, after] = [from, to].map(|edge| edge.st[1] - edge.st[0]);
    before.perp_dot(after).atan2(before.dot(after))
}

/// The edges that loops of one face have on one side alone, or in different places.
fn borders(uses: Vec<(u32, EdgeUse)>) -> Vec<OrientedEdge> {
    let mut left: Vec<OrientedEdge> = Vec::with_capacity(uses.len());
    let mut waiting: HashMap<u32, Vec<usize>> = HashMap::new();
    let mut is_inner = vec![false; uses.len()];
    let is_one = |a: &EdgeUse, b: &EdgeUse| {
        a.is_reversed != b.is_reversed && is_near(a.st[0], b.st[1]) && is_near(a.st[1], b.st[0])
    };
    for (number, (edge, edge_use)) in uses.iter().enumerate() {
        let others = waiting.entry(*edge).or_default();
        match others.iter().position(|&other| is_one(&uses[other].1, edge_use)) {
            Some(position) => {
                is_inner[others.swap_remove(position)] = true;
                is_inner[number] = true;
            }
            None => others.push(number),
        }
    }
    for ((edge, EdgeUse { is_reversed, st, .. }), is_inner) in uses.into_iter().zip(is_inner) {
        if !is_inner {
            left.push(OrientedEdge { edge, is_reversed, st });
        }
    }
    left
}

/// Loops as faces: each that runs counter-clockwise, with the clockwise ones inside of it.
fn faces(loops: Vec<Vec<OrientedEdge>>) -> Vec<(Vec<OrientedEdge>, Vec<Vec<OrientedEdge>>)> {
    let corners = |bound: &[OrientedEdge]| -> Vec<DVec2> { bound.iter().map(|edge| edge.st[0]).collect() };
    let area = |bound: &[OrientedEdge]| {
        polygon::doubled_area(&bound.iter().flat_map(|edge| edge.st).collect::<Vec<_>>())
    };
    let (outer, holes): (Vec<_>, Vec<_>) = loops.into_iter().partition(|bound| area(bound) > 0.0);
    let mut faces: Vec<_> = outer.into_iter().map(|outer| (outer, Vec::new())).collect();
    for hole in holes {
        let place = 0.5 * (hole[0].st[0] + hole[0].st[1]);
        let around = (0..faces.len())
            .filter(|&face| position(&corners(&faces[face].0), place, DVec2::ZERO) == LoopPosition::Inside)
            .min_by(|&a, &b| area(&faces[a].0).total_cmp(&area(&faces[b].0)));
        if let Some(face) = around {
            faces[face].1.push(hole);
        }
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch::Shell;
    use crate::subdivide::FrameChoice::Parallelogram;
    use crate::test_support::{Noise, cube_triangles, deform, random_volume};

    /// How many edges the bounds have, of each face the outer one first.
    fn counts(topology: &Topology<'_>, faces: &[FaceBounds]) -> Vec<Vec<usize>> {
        let runs_on = |bound: &[OrientedEdge]| {
            let vertices = |i: usize| topology.vertices(&bound[i % bound.len()]);
            assert!((0..bound.len()).all(|i| vertices(i)[1] == vertices(i + 1)[0]));
            bound.len()
        };
        faces
            .iter()
            .map(|face| std::iter::once(&face.outer).chain(&face.holes).map(|bound| runs_on(bound)).collect())
            .collect()
    }

    fn bounds_of(shell: &Shell) -> (Topology<'_>, Vec<FaceBounds>) {
        let topology = shell.topology();
        let faces = topology.face_bounds(|_| ());
        (topology, faces)
    }

    fn joined(topology: &Topology<'_>, faces: &[FaceBounds]) -> Vec<Component> {
        components(faces.len(), &topology.joints(faces))
    }

    /// A square frame around a square hole, of two triangles a side.
    fn ring(half: f64, hole: f64) -> Vec<[DVec3; 3]> {
        let corner = |r: f64, i: usize| {
            let [x, y] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]][i % 4];
            DVec3::new(0.5 + r * x, 0.5 + r * y, 0.5)
        };
        (0..4)
            .flat_map(|i| {
                let [a, b] = [corner(half, i), corner(half, i + 1)];
                let [c, d] = [corner(hole, i + 1), corner(hole, i)];
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }

    #[test]
    fn loops_of_a_plane_are_one_face_with_a_hole() {
        let shell = deform(&ring(0.4, 0.2), None, Parallelogram);
        let (topology, faces) = bounds_of(&shell);
        assert_eq!(counts(&topology, &faces), [[4, 4]]);
        assert_eq!(joined(&topology, &faces), [Component { faces: vec![0], is_closed: false }]);
        let two = topology.face_bounds(|face| face < 4);
        assert_eq!(counts(&topology, &two), [[6], [6]], "halves of the ring, by key");
        let halves = joined(&topology, &two);
        assert_eq!((halves.len(), halves[0].faces.len()), (1, 2));
    }

    #[test]
    fn parts_that_touch_at_a_corner_are_faces_of_their_own() {
        let square = |x: f64, y: f64| {
            let corner = |dx: f64, dy: f64| DVec3::new(x + 0.25 * dx, y + 0.25 * dy, 0.5);
            let [a, b, c, d] = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
            [[a, b, c], [a, c, d]]
        };
        let shell = deform(&[square(0.25, 0.25), square(0.5, 0.5)].concat(), None, Parallelogram);
        let (topology, faces) = bounds_of(&shell);
        assert_eq!(counts(&topology, &faces), [[4], [4]]);
        assert_eq!(joined(&topology, &faces).len(), 2);
        // a hole that touches the outer bound stays a hole
        let corners =
            [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.7, 0.5], [0.5, 0.6], [0.3, 0.5]]
                .map(|[x, y]| DVec3::new(x, y, 0.5));
        let triangles = [[0, 1, 7], [0, 7, 4], [7, 6, 4], [6, 3, 4], [6, 5, 3], [5, 2, 3], [1, 2, 5]];
        let shell = deform(&triangles.map(|t| t.map(|i| corners[i])), None, Parallelogram);
        let (topology, faces) = bounds_of(&shell);
        assert_eq!(counts(&topology, &faces), [[5, 4]]);
    }

    #[test]
    fn solids_are_components() {
        let cube = cube_triangles();
        let far: Vec<_> = cube.iter().map(|corners| corners.map(|corner| corner + 2.0)).collect();
        let plain = deform(&[cube.clone(), far].concat(), None, Parallelogram);
        let (topology, faces) = bounds_of(&plain);
        assert_eq!(counts(&topology, &faces), vec![vec![4]; 12]);
        let components = joined(&topology, &faces);
        assert_eq!(
            components.iter().map(|c| (c.faces.len(), c.is_closed)).collect::<Vec<_>>(),
            [(6, true); 2]
        );
        // a cube that touches the first along an edge is another solid
        let beside: Vec<_> =
            cube.iter().map(|corners| corners.map(|corner| corner + DVec3::X + DVec3::Y)).collect();
        let touching = deform(&[cube.clone(), beside].concat(), None, Parallelogram);
        let (topology, faces) = bounds_of(&touching);
        assert!(topology.edges().iter().any(|edge| edge.uses.len() == 4));
        let components = joined(&topology, &faces);
        assert_eq!(
            components.iter().map(|c| (c.faces.len(), c.is_closed)).collect::<Vec<_>>(),
            [(6, true); 2]
        );
        let volume = random_volume(&mut Noise(3), [2; 3], [5; 3], 0.1, false);
        let cut = deform(&cube, Some(&volume), Parallelogram);
        let (topology, faces) = bounds_of(&cut);
        assert_eq!(counts(&topology, &faces), vec![vec![4]; cut.faces().len()]);
        assert_eq!(joined(&topology, &faces).len(), 1);
    }
}
