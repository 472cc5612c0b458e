//! Halving edges until the triangles are close enough to the surface.

use std::collections::{HashMap, HashSet};
use std::sync::atomic::{AtomicBool, Ordering};

use glam::{DVec2, DVec3};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use super::corners::{Mesh, Triangle};
use super::deviation::{Distances, distances};
use super::{MAX_TRIANGLES, TessellateError, index};
use crate::memory::MemoryLimit;

/// Most rounds of halving: 2^-48 of an edge is at the rounding of its points.
const MAX_ROUNDS: usize = 48;

/// Below this square of four times the area, in parts of the longest edge's fourth power, a triangle is a needle: 3 is that of
/// an equilateral one.
const THIN: f64 = 0.1;

/// Share of a distance that the points it is measured at find of it. Where a triangle is so small that the surface's height above
/// it is a quadratic, its greatest value is in the middle of an edge, at one of the points, or at the ellipse's centre, with one
/// of them within a quarter of the way to the corners: 15/16 is found. The rest is for what is not quadratic yet.
const FOUND: f64 = 0.9;

/// Rounding of a distance between points, in parts of the greatest coordinate.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Memory that a triangle takes in a round of halving: what is measured of it, up to four in its place and three edges with
/// their middles.
const HALVING_BYTES: u64 = 800;

/// From so many triangles on, their distances tell how many will be needed: unless that has fallen below this part of what it was.
const ENOUGH_TO_TELL: usize = 50_000;
const FALLING: f64 = 0.75;

/// Memory that a triangle takes with its share of vertices.
const TRIANGLE_BYTES: u64 = 160;

/// A tessellation on its way.
#[derive(Debug)]
pub(super) struct Refinement<'a> {
    pub(super) mesh: Mesh<'a>,
    cancel: &'a AtomicBool,
    memory: MemoryLimit,
    /// Whether vertices carry what depends on their parameters.
    parameters_matter: bool,
}

/// A vertex in the middle of an edge. There are two if the surface is torn there.
#[derive(Clone, Copy, Debug, Default)]
struct Middles {
    first: Option<u32>,
    second: Option<u32>,
}

/// The middle of a triangle's edge: its vertex and parameters.
type Middle = Option<(u32, DVec2)>;

impl<'a> Refinement<'a> {
    pub(super) const fn new(
        mesh: Mesh<'a>,
        parameters_matter: bool,
        (cancel, memory): (&'a AtomicBool, MemoryLimit),
    ) -> Self {
        Self { mesh, cancel, memory, parameters_matter }
    }

    /// Halves edges until all triangles are within `tolerance` of the surface; returns how far they are.
    ///
    /// A triangle that is too far has those edges halved that are too far themselves, or, where only its inside is, the longest.
    pub(super) fn refine_to(&mut self, tolerance: f64) -> Result<f64, TessellateError> {
        let farthest = self.mesh.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        if tolerance < ROUNDING * farthest {
            return Err(TessellateError::Unreachable { reached: ROUNDING * farthest });
        }
        let tolerance = FOUND * tolerance;
        let mut needed = f64::INFINITY;
        for _ in 0..MAX_ROUNDS {
            let measured: Vec<_> = self
                .mesh
                .triangles
                .par_iter()
                .map(|triangle| (!triangle.settled).then(|| self.distances(triangle)))
                .collect();
            needed = self.check_feasible(&measured, tolerance, needed)?;
            let mut marked = HashSet::new();
            for (triangle, distances) in self.mesh.triangles.iter_mut().zip(measured) {
                let Some(distances) = distances else { continue };
                triangle.settled = distances.greatest() <= tolerance;
                if !triangle.settled {
                    let marks = marks(&distances, tolerance, lengths_sq(&self.mesh.positions, triangle));
                    let edges = edges_of(triangle.vertices).into_iter().zip(marks);
                    marked.extend(edges.filter_map(|(edge, mark)| mark.then_some(ordered(edge))));
                }
            }
            if marked.is_empty() {
                return Ok(self.deviation());
            }
            self.halve(|edge| marked.contains(&edge))?;
        }
        Err(TessellateError::Unreachable { reached: self.deviation() })
    }

    /// Refuses a tolerance for which far too many triangles would be needed; returns how many they are, about. `before` is what it
    /// was in the round before.
    ///
    /// Where a surface is curved along both sides, a triangle's distance from it falls with its area, and what is needed is the sum of
    /// distances in parts of the tolerance. Where it is curved along one, that sum falls from round to round, and says nothing.
    fn check_feasible(
        &self,
        measured: &[Option<Distances>],
        tolerance: f64,
        before: f64,
    ) -> Result<f64, TessellateError> {
        let needed = |distances: &Option<Distances>| {
            distances.map_or(1.0, |distances| (distances.greatest() / tolerance).clamp(1.0, f64::MAX))
        };
        let needed: f64 = measured.iter().map(needed).sum();
        if measured.len() < ENOUGH_TO_TELL || needed < FALLING * before {
            return Ok(needed);
        }
        if needed > 2.0 * MAX_TRIANGLES as f64 {
            return Err(TessellateError::TooMany);
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "below twice MAX_TRIANGLES"
        )]
        let count = needed as u64;
        self.memory.ask(format_args!("about {count} triangles"), count / 2 * TRIANGLE_BYTES).map(drop)?;
        Ok(needed)
    }

    /// Halves every edge.
    pub(super) fn halve_all(&mut self) -> Result<(), TessellateError> {
        if 4 * self.mesh.triangles.len() > MAX_TRIANGLES {
            return Err(TessellateError::TooMany);
        }
        self.halve(|_| true)
    }

    /// How far the triangles are from the surface.
    pub(super) fn deviation(&self) -> f64 {
        let greatest = |triangle| self.distances(triangle).greatest();
        self.mesh.triangles.par_iter().map(greatest).reduce(|| 0.0, f64::max)
    }

    fn distances(&self, triangle: &Triangle) -> Distances {
        let part = &self.mesh.parts[triangle.part as usize];
        let corners = triangle.vertices.map(|vertex| self.mesh.positions[vertex as usize]);
        distances(part, triangle.st, corners, triangle.on_border, (triangle.is_first, self.parameters_matter))
    }

    /// Halves the edges that are marked, in all triangles that have them.
    pub(super) fn halve(&mut self, is_marked: impl Fn([u32; 2]) -> bool) -> Result<(), TessellateError> {
        self.cut(|edge| is_marked(edge).then_some(0.5), false)
    }

    /// Cuts edges, in all triangles that have them, at a fraction of the way from the end with the lower index to the other.
    /// Halved edges along curved borders are cut on the border. If it `joins`, the triangles of an edge share its point even
    /// where the surface is torn.
    pub(super) fn cut(
        &mut self,
        fraction: impl Fn([u32; 2]) -> Option<f64>,
        joins: bool,
    ) -> Result<(), TessellateError> {
        if self.cancel.load(Ordering::Relaxed) {
            return Err(TessellateError::Interrupted);
        }
        let count = self.mesh.triangles.len();
        let _promise =
            self.memory.ask(format_args!("halving {count} triangles"), count as u64 * HALVING_BYTES)?;
        let mut middles: HashMap<[u32; 2], Middles> = HashMap::new();
        let before = std::mem::take(&mut self.mesh.triangles);
        let mut after = Vec::with_capacity(2 * before.len());
        for triangle in before {
            let mut middle: [Middle; 3] = [None; 3];
            for (edge, middle) in middle.iter_mut().enumerate() {
                let ends = ordered([triangle.vertices[edge], triangle.vertices[(edge + 1) % 3]]);
                if let Some(fraction) = fraction(ends) {
                    let st = self.cut_place(&triangle, edge, fraction);
                    *middle = Some((self.middle(&mut middles, (ends, joins), triangle.part, st), st));
                }
            }
            if middle == [None; 3] {
                after.push(triangle);
            } else {
                after.extend(split(&triangle, middle, &self.mesh.positions));
            }
            if after.len() > MAX_TRIANGLES {
                return Err(TessellateError::TooMany);
            }
        }
        self.mesh.triangles = after;
        Ok(())
    }

    /// Parameters where an edge is cut.
    fn cut_place(&self, triangle: &Triangle, edge: usize, fraction: f64) -> DVec2 {
        let [from, to] = [triangle.st[edge], triangle.st[(edge + 1) % 3]];
        if fraction == 0.5 {
            let middle = 0.5 * (from + to);
            let moved =
                triangle.on_border[edge].then(|| self.mesh.sheets(triangle).on_border([from, to], middle));
            return moved.flatten().unwrap_or(middle);
        }
        let [first, second] = [triangle.vertices[edge], triangle.vertices[(edge + 1) % 3]];
        if first < second { from.lerp(to, fraction) } else { to.lerp(from, fraction) }
    }

    /// The vertex in the middle of an edge, shared by all triangles whose surface meets there.
    fn middle(
        &mut self,
        middles: &mut HashMap<[u32; 2], Middles>,
        (edge, joins): ([u32; 2], bool),
        part: u32,
        st: DVec2,
    ) -> u32 {
        let position = self.mesh.eval(part, st);
        let known = middles.entry(edge).or_default();
        for vertex in [known.first, known.second].into_iter().flatten() {
            if joins || self.mesh.positions[vertex as usize].distance(position) <= self.mesh.same_position {
                return vertex;
            }
        }
        self.mesh.positions.push(position);
        let vertex = index(self.mesh.positions.len() - 1);
        if known.first.is_none() {
            known.first = Some(vertex);
        } else {
            known.second = Some(vertex);
        }
        vertex
    }
}

/// The edges to halve of a triangle that is too far from the surface.
fn marks(distances: &Distances, tolerance: f64, lengths_sq: [f64; 3]) -> [bool; 3] {
    let far = distances.edges.map(|edge| edge > tolerance);
    let longest = lengths_sq.iter().fold(0.0, |most: f64, &length| most.max(length));
    // if only the inside is too far; and in needles, whose other edges could be halved for ever beside one that just passes
    let with_longest = far == [false; 3] || quadruple_area_sq(lengths_sq) < THIN * longest * longest;
    std::array::from_fn(|edge| far[edge] || (with_longest && lengths_sq[edge] == longest))
}

/// The square of four times a triangle's area, by Heron's formula.
fn quadruple_area_sq([a, b, c]: [f64; 3]) -> f64 {
    2.0 * (a * b + b * c + c * a) - (a * a + b * b + c * c)
}

/// The triangles that a triangle with vertices in the middle of its edges 0-1, 1-2 and 2-0 falls into.
fn split(
    triangle: &Triangle,
    middle: [Middle; 3],
    positions: &[DVec3],
) -> impl Iterator<Item = Triangle> + use<> {
    // turned so that the edges with a middle come first
    let bits =
        |turn: usize| (0..3).fold(0, |bits, edge| 2 * bits + u8::from(middle[(turn + edge) % 3].is_some()));
    let turn = (0..3).max_by_key(|&turn| bits(turn)).unwrap_or(0);
    // with each point the edges that it is on, by bits
    let corner = |corner: usize| {
        let corner = (corner + turn) % 3;
        (triangle.vertices[corner], triangle.st[corner], 1_u8 << corner | 1 << ((corner + 2) % 3))
    };
    let middle_of = |edge: usize| {
        let edge = (edge + turn) % 3;
        middle[edge].map(|(vertex, st)| (vertex, st, 1_u8 << edge))
    };
    let [a, b, c] = [corner(0), corner(1), corner(2)];
    let length_sq = |p: (u32, DVec2, u8), q: (u32, DVec2, u8)| {
        positions[p.0 as usize].distance_squared(positions[q.0 as usize])
    };
    let cut = match [0, 1, 2].map(middle_of) {
        [Some(ab), Some(bc), Some(ca)] => {
            [Some([a, ab, ca]), Some([ab, b, bc]), Some([ca, bc, c]), Some([ab, bc, ca])]
        }
        // the rest is a quad, cut along its shorter diagonal
        [Some(ab), Some(bc), None] if length_sq(a, bc) < length_sq(ab, c) => {
            [Some([ab, b, bc]), Some([a, ab, bc]), Some([a, bc, c]), None]
        }
        [Some(ab), Some(bc), None] => [Some([ab, b, bc]), Some([a, ab, c]), Some([ab, bc, c]), None],
        [Some(ab), None, None] => [Some([a, ab, c]), Some([ab, b, c]), None, None],
        _ => [Some([a, b, c]), None, None, None],
    };
    let part = triangle.part;
    let borders = (0..3).fold(0_u8, |bits, edge| bits | u8::from(triangle.on_border[edge]) << edge);
    cut.into_iter().flatten().map(move |corners| Triangle {
        part,
        vertices: corners.map(|corner| corner.0),
        st: corners.map(|corner| corner.1),
        settled: false,
        is_first: false,
        on_border: [0, 1, 2].map(|edge| corners[edge].2 & corners[(edge + 1) % 3].2 & borders != 0),
    })
}

fn lengths_sq(positions: &[DVec3], triangle: &Triangle) -> [f64; 3] {
    edges_of(triangle.vertices).map(|[a, b]| positions[a as usize].distance_squared(positions[b as usize]))
}

pub(super) const fn edges_of([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

pub(super) fn ordered([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
