//! Tessellations of the deformed object: what Embree traces.
//!
//! The error of a tessellation is the greatest distance of its flat triangles from the exact surface, taken at the
//! centroids and at the middles of the edges, across the surface: the distance along the exact surface's normal, so that
//! points that are on the surface but not where their parameters would be count as exact.

use std::collections::{HashMap, HashSet};
use std::sync::atomic::AtomicBool;

use glam::{DVec3, Vec3};
use rayon::iter::{IntoParallelIterator, IntoParallelRefIterator, ParallelIterator};
use trimray::spline::SplineVolume;
use trimray::tessellate::{Fineness, tessellate};
use trimray::trace::TracedScene;

use crate::common::objects::Object;

/// Most rounds of halving edges: 2^-40 of an edge is below single precision.
const MAX_ROUNDS: usize = 40;

/// Starting subdivisions tried for an adaptive tessellation. Halving multiplies by powers of two, so odd ones give all that
/// differ; the one that ends with the fewest triangles is kept.
const STARTS: [u32; 4] = [1, 3, 5, 7];

/// Most rounds of marking longest edges, in one round of halving.
const MAX_SPREAD: usize = 1000;

/// Triangles with shared vertices, in single precision as Embree takes them.
#[derive(Debug, Default)]
pub(crate) struct Mesh {
    /// Deformed vertices.
    pub(crate) vertices: Vec<Vec3>,
    /// Indices into the vertices.
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// Evaluates the exact surface over the undeformed triangles.
struct Surface<'a> {
    volume: &'a SplineVolume,
    bounds: [DVec3; 2],
}

impl<'a> Surface<'a> {
    fn new(object: &'a Object) -> Self {
        Self { volume: &object.volume, bounds: object.volume.bounds() }
    }

    /// A point within rounding of the lattice's box is taken to be inside.
    fn position(&self, rest: DVec3) -> DVec3 {
        let inside = rest.clamp(self.bounds[0], self.bounds[1]);
        self.volume.eval(inside).expect("the point was clamped to the box").position
    }

    /// Distance of `point` from the surface at `rest`, along the normal of the image of the plane that holds `along`.
    fn distance(&self, rest: DVec3, along: [DVec3; 2], point: DVec3) -> f64 {
        let inside = rest.clamp(self.bounds[0], self.bounds[1]);
        let exact = self.volume.eval(inside).expect("the point was clamped to the box");
        let normal = (exact.jacobian * along[0]).cross(exact.jacobian * along[1]).normalize();
        (point - exact.position).dot(normal).abs()
    }
}

/// The triangles that `trimray export --tolerance` makes of a scene's objects, and how far they are from them at most, both in
/// parts of the diagonal.
pub(crate) fn of_scene(scene: &TracedScene, target: f64, diagonal: f64) -> Result<(Mesh, f64), String> {
    let (mut mesh, mut error) = (Mesh::default(), 0.0_f64);
    for object in scene.objects() {
        let fineness = Fineness::Tolerance(target * diagonal);
        let made =
            tessellate(object, fineness, &AtomicBool::new(false)).map_err(|error| error.to_string())?;
        let first = index(mesh.vertices.len());
        mesh.vertices.extend(made.positions.iter().map(|position| position.as_vec3()));
        mesh.triangles.extend(made.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
        error = error.max(made.deviation);
    }
    Ok((mesh, error / diagonal))
}

/// Every triangle of the object cut into n × n.
pub(crate) fn uniform(object: &Object, n: u32) -> Mesh {
    let surface = Surface::new(object);
    let mut vertices: Vec<_> = object.vertices.iter().map(|&rest| surface.position(rest).as_vec3()).collect();
    let mut triangles = Vec::with_capacity(object.triangles.len() * (n * n) as usize);
    // first vertex inside each edge, counted from the edge's lower corner
    let mut edges = HashMap::new();
    let mut rows: [Vec<u32>; 2] = Default::default();
    for &corners in &object.triangles {
        let [a, b, c] = corners.map(|corner| object.vertices[corner as usize]);
        for [from, to] in edges_of(corners).map(ordered) {
            edges.entry([from, to]).or_insert_with(|| {
                let first = index(vertices.len());
                let [from, to] = [from, to].map(|corner| object.vertices[corner as usize]);
                let inside = (1..n).map(|i| surface.position(from.lerp(to, part(i, n))).as_vec3());
                vertices.extend(inside);
                first
            });
        }
        let on_edge = |from: u32, to: u32, step: u32| match step {
            0 => from,
            step if step == n => to,
            step => edges[&ordered([from, to])] + if from < to { step } else { n - step } - 1,
        };
        // row j runs parallel to the edge a b, from the edge a c to the edge b c
        for j in 0..=n {
            let [row, below] = &mut rows;
            std::mem::swap(row, below);
            row.clear();
            for i in 0..=n - j {
                row.push(if j == 0 {
                    on_edge(corners[0], corners[1], i)
                } else if i == 0 {
                    on_edge(corners[0], corners[2], j)
                } else if i == n - j {
                    on_edge(corners[1], corners[2], j)
                } else {
                    let rest = a + (b - a) * part(i, n) + (c - a) * part(j, n);
                    vertices.push(surface.position(rest).as_vec3());
                    index(vertices.len() - 1)
                });
            }
            for i in 0..row.len().min(below.len()) {
                triangles.push([below[i], below[i + 1], row[i]]);
                if i + 1 < row.len() {
                    triangles.push([below[i + 1], row[i + 1], row[i]]);
                }
            }
        }
        // the next triangle's first row has none below
        rows[0].clear();
    }
    Mesh { vertices, triangles }
}

/// The error of [`uniform`], which need not be made for it.
pub(crate) fn uniform_error(object: &Object, n: u32) -> f64 {
    let surface = Surface::new(object);
    let row = |(triangle, j): (usize, u32)| {
        let [a, b, c] = object.corners(triangle);
        let along = [b - a, c - a];
        let rest = |i: u32, j: u32| a + (b - a) * part(i, n) + (c - a) * part(j, n);
        let vertices = |j: u32| -> Vec<_> {
            (0..=n - j).map(|i| surface.position(rest(i, j)).as_vec3().as_dvec3()).collect()
        };
        let (low, high) = (vertices(j), vertices(j + 1));
        let mut error: f64 = 0.0;
        for i in 0..n - j {
            let up = [(rest(i, j), low[i as usize]), (rest(i + 1, j), low[i as usize + 1])];
            let top = (rest(i, j + 1), high[i as usize]);
            // each edge inside belongs to one such triangle; those that point down have only their centroids to add
            for [p, q] in [up, [up[1], top], [top, up[0]]] {
                error = error.max(surface.distance(0.5 * (p.0 + q.0), along, 0.5 * (p.1 + q.1)));
            }
            error = error.max(surface.distance(
                (up[0].0 + up[1].0 + top.0) / 3.0,
                along,
                (up[0].1 + up[1].1 + top.1) / 3.0,
            ));
            if i + 1 < n - j {
                let right = (rest(i + 1, j + 1), high[i as usize + 1]);
                error = error.max(surface.distance(
                    (up[1].0 + top.0 + right.0) / 3.0,
                    along,
                    (up[1].1 + top.1 + right.1) / 3.0,
                ));
            }
        }
        error
    };
    let rows: Vec<_> =
        (0..object.triangles.len()).flat_map(|triangle| (0..n).map(move |j| (triangle, j))).collect();
    rows.into_par_iter().map(row).reduce(|| 0.0, f64::max) / object.subject.diagonal
}

/// The least n whose [`uniform`] tessellation has an error of no more than `target`, and that error; `guess` is where the
/// search begins.
pub(crate) fn least_uniform(object: &Object, target: f64, guess: u32) -> (u32, f64) {
    let mut known = HashMap::new();
    let mut error = |n: u32| *known.entry(n).or_insert_with(|| uniform_error(object, n));
    // the error falls with 1 / n²
    let mut n = guess.max(1);
    for _ in 0..4 {
        let next = f64::from(n) * (error(n) / target).sqrt();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small positive number"
        )]
        let next = next.ceil().clamp(1.0, 1e4) as u32;
        if next == n {
            break;
        }
        n = next;
    }
    while error(n) > target {
        n += 1;
    }
    while n > 1 && error(n - 1) <= target {
        n -= 1;
    }
    (n, error(n))
}

/// Which edges of a triangle that is too far from the surface are halved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Halving {
    /// Those whose middle or quarters are too far; where only the centroid is, the edge that is farthest. Fewest triangles,
    /// but slivers among them, whose boxes overlap.
    FarEdges,
    /// The longest, and that of every triangle that gets a vertex on another edge: more triangles, with angles bounded below.
    ///
    /// Source: Rivara (1984), *Algorithms for refining triangular grids suitable for adaptive and multigrid techniques*.
    LongestEdge,
}

/// A tessellation with triangles no smaller than the error asks for, and its error. Edges are halved in all triangles that have
/// them, so that there are no cracks.
pub(crate) fn adaptive(object: &Object, target: f64, halving: Halving) -> (Mesh, f64) {
    let tried = STARTS.iter().map(|&start| {
        let mut refinement = Refinement::new(object, start);
        for _ in 0..MAX_ROUNDS {
            if !refinement.halve_edges(target, halving) {
                break;
            }
        }
        refinement
    });
    let best = tried.min_by_key(|refinement| refinement.triangles.len()).expect("there are starts");
    let error = best.error();
    let triangles = best.triangles.iter().map(|triangle| triangle.vertices).collect();
    (Mesh { vertices: best.vertices.iter().map(|v| v.deformed.as_vec3()).collect(), triangles }, error)
}

/// A triangle of an adaptive tessellation.
#[derive(Clone, Copy)]
struct Piece {
    /// The undeformed triangle it is part of.
    triangle: u32,
    vertices: [u32; 3],
    /// Whether it was found to be close enough to the surface.
    settled: bool,
}

#[derive(Clone, Copy)]
struct Vertex {
    rest: DVec3,
    /// Rounded to single precision.
    deformed: DVec3,
}

/// An adaptive tessellation on its way.
struct Refinement<'a> {
    object: &'a Object,
    surface: Surface<'a>,
    vertices: Vec<Vertex>,
    triangles: Vec<Piece>,
}

impl<'a> Refinement<'a> {
    fn new(object: &'a Object, start: u32) -> Self {
        let surface = Surface::new(object);
        let mut this = Self { object, surface, vertices: Vec::new(), triangles: Vec::new() };
        let mut shared = HashMap::new();
        for (number, &corners) in (0..).zip(&object.triangles) {
            let mut vertex = |steps: [u32; 3]| {
                // a place on an edge or corner is named by the corners it is between, so that neighbours share it
                let mut name = [(u32::MAX, 0); 3];
                for ((name, corner), step) in name.iter_mut().zip(corners).zip(steps) {
                    if step > 0 {
                        *name = (corner, step);
                    }
                }
                name.sort_unstable();
                *shared.entry(name).or_insert_with(|| {
                    let of = |(corner, step): (u32, u32)| match step {
                        0 => DVec3::ZERO,
                        step => object.vertices[corner as usize] * part(step, start),
                    };
                    this.add(name.into_iter().map(of).sum())
                })
            };
            let mut cut = Vec::new();
            for j in 0..start {
                for i in 0..start - j {
                    let k = start - i - j;
                    cut.push([[k, i, j], [k - 1, i + 1, j], [k - 1, i, j + 1]].map(&mut vertex));
                    if k > 1 {
                        cut.push(
                            [[k - 1, i + 1, j], [k - 2, i + 1, j + 1], [k - 1, i, j + 1]].map(&mut vertex),
                        );
                    }
                }
            }
            let piece = |vertices| Piece { triangle: number, vertices, settled: false };
            this.triangles.extend(cut.into_iter().map(piece));
        }
        this
    }

    fn add(&mut self, rest: DVec3) -> u32 {
        self.vertices.push(Vertex { rest, deformed: self.surface.position(rest).as_vec3().as_dvec3() });
        index(self.vertices.len() - 1)
    }

    /// The distance from the surface of each edge of a triangle, and of its centroid.
    fn errors(&self, piece: &Piece) -> ([f64; 3], f64) {
        let [a, b, c] = self.object.corners(piece.triangle as usize);
        let along = [b - a, c - a];
        let corners = piece.vertices.map(|vertex| self.vertices[vertex as usize]);
        let edges = [0, 1, 2].map(|edge| {
            let [p, q] = [corners[edge], corners[(edge + 1) % 3]];
            let at =
                |t: f64| self.surface.distance(p.rest.lerp(q.rest, t), along, p.deformed.lerp(q.deformed, t));
            at(0.5).max(at(0.25)).max(at(0.75))
        });
        let mean = |of: fn(&Vertex) -> DVec3| corners.iter().map(of).sum::<DVec3>() / 3.0;
        (edges, self.surface.distance(mean(|v| v.rest), along, mean(|v| v.deformed)))
    }

    /// The edges of a triangle to halve for its own sake.
    fn marks(&self, piece: &Piece, target: f64, halving: Halving) -> [bool; 3] {
        if piece.settled {
            return [false; 3];
        }
        let (edges, centroid) = self.errors(piece);
        let farthest = edges.iter().fold(0.0, |most: f64, &edge| most.max(edge));
        if farthest.max(centroid) <= target {
            return [false; 3];
        }
        match halving {
            Halving::FarEdges => edges.map(|edge| edge > target || (farthest <= target && edge == farthest)),
            Halving::LongestEdge => [0, 1, 2].map(|edge| edge == self.longest_edge(piece.vertices)),
        }
    }

    fn length_sq(&self, [p, q]: [u32; 2]) -> f64 {
        self.vertices[p as usize].deformed.distance_squared(self.vertices[q as usize].deformed)
    }

    /// Of edges of the same length the one that all triangles name.
    fn longest_edge(&self, triangle: [u32; 3]) -> usize {
        let edges = edges_of(triangle).map(ordered);
        let by_length = |&a: &usize, &b: &usize| {
            self.length_sq(edges[a]).total_cmp(&self.length_sq(edges[b])).then(edges[a].cmp(&edges[b]))
        };
        (0..3).max_by(by_length).unwrap_or(0)
    }

    /// Halves edges of the triangles that are too far from the surface; whether there were any.
    fn halve_edges(&mut self, target: f64, halving: Halving) -> bool {
        let target = target * self.object.subject.diagonal;
        let marks: Vec<_> =
            self.triangles.par_iter().map(|piece| self.marks(piece, target, halving)).collect();
        let mut marked = HashSet::new();
        for (piece, marks) in self.triangles.iter_mut().zip(marks) {
            piece.settled = marks == [false; 3];
            let edges = edges_of(piece.vertices).map(ordered);
            marked.extend(edges.into_iter().zip(marks).filter_map(|(edge, mark)| mark.then_some(edge)));
        }
        if marked.is_empty() {
            return false;
        }
        if halving == Halving::LongestEdge {
            self.spread(&mut marked);
        }
        // in order, so that the tessellation is the same on every run
        let mut marked: Vec<_> = marked.into_iter().collect();
        marked.sort_unstable();
        let mut middles = HashMap::with_capacity(marked.len());
        for edge in marked {
            let [p, q] = edge.map(|vertex| self.vertices[vertex as usize].rest);
            middles.insert(edge, self.add(0.5 * (p + q)));
        }
        let mut triangles = Vec::with_capacity(2 * self.triangles.len());
        for piece in &self.triangles {
            let middle = edges_of(piece.vertices).map(|edge| middles.get(&ordered(edge)).copied());
            if middle == [None; 3] {
                triangles.push(*piece);
                continue;
            }
            let split = self.split(piece.vertices, middle).into_iter().flatten();
            triangles.extend(split.map(|vertices| Piece { vertices, settled: false, ..*piece }));
        }
        self.triangles = triangles;
        true
    }

    /// Marks the longest edge of every triangle with a marked edge.
    fn spread(&self, marked: &mut HashSet<[u32; 2]>) {
        for _ in 0..MAX_SPREAD {
            let missing = |piece: &Piece| {
                let edges = edges_of(piece.vertices).map(ordered);
                if !edges.iter().any(|edge| marked.contains(edge)) {
                    return None;
                }
                let longest = edges[self.longest_edge(piece.vertices)];
                (!marked.contains(&longest)).then_some(longest)
            };
            let missing: Vec<_> = self.triangles.par_iter().filter_map(missing).collect();
            if missing.is_empty() {
                return;
            }
            marked.extend(missing);
        }
    }

    /// The triangles that remain of one whose edges have new middles: of 0-1, 1-2 and 2-0.
    fn split(&self, triangle: [u32; 3], middle: [Option<u32>; 3]) -> [Option<[u32; 3]>; 4] {
        // turn it so that the edges with a middle come first
        let turn = (0..3).max_by_key(|&turn| {
            (0..3).fold(0, |bits, edge| 2 * bits + u8::from(middle[(turn + edge) % 3].is_some()))
        });
        let turn = turn.unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|corner| triangle[(corner + turn) % 3]);
        match [0, 1, 2].map(|edge| middle[(edge + turn) % 3]) {
            [Some(ab), Some(bc), Some(ca)] => {
                [Some([a, ab, ca]), Some([ab, b, bc]), Some([ca, bc, c]), Some([ab, bc, ca])]
            }
            [Some(ab), Some(bc), None] => {
                let corner = Some([ab, b, bc]);
                // the rest is a quad, cut along its shorter diagonal
                if self.length_sq([a, bc]) < self.length_sq([ab, c]) {
                    [corner, Some([a, ab, bc]), Some([a, bc, c]), None]
                } else {
                    [corner, Some([a, ab, c]), Some([ab, bc, c]), None]
                }
            }
            [Some(ab), None, None] => [Some([a, ab, c]), Some([ab, b, c]), None, None],
            _ => [Some([a, b, c]), None, None, None],
        }
    }

    fn error(&self) -> f64 {
        let greatest = |triangle| {
            let (edges, centroid) = self.errors(triangle);
            edges.into_iter().fold(centroid, f64::max)
        };
        self.triangles.par_iter().map(greatest).reduce(|| 0.0, f64::max) / self.object.subject.diagonal
    }
}

fn edges_of([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

fn ordered([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn part(step: u32, n: u32) -> f64 {
    f64::from(step) / f64::from(n)
}

fn index(n: usize) -> u32 {
    u32::try_from(n).expect("fewer than 2^32 vertices")
}
