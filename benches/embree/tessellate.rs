//! Tessellations of the deformed object: what Embree traces.
//!
//! The error of a tessellation is the greatest distance of its flat triangles from the exact surface, taken at the
//! centroids and at the middles of the edges, across the surface: the distance along the exact surface's normal, so that
//! points that are on the surface but not where their parameters would be count as exact.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use rayon::iter::{IntoParallelIterator, IntoParallelRefIterator, ParallelIterator};
use trimray::spline::SplineVolume;

use crate::objects::Object;

/// Most rounds of halving edges: 2^-40 of an edge is below single precision.
const MAX_ROUNDS: usize = 40;

/// Starting subdivisions tried for an adaptive tessellation. Halving multiplies by powers of two, so odd ones give all that
/// differ; the one that ends with the fewest triangles is kept.
const STARTS: [u32; 5] = [1, 3, 5, 7, 9];

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
    rows.into_par_iter().map(row).reduce(|| 0.0, f64::max) / object.diagonal
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

/// A tessellation with triangles no smaller than the error asks for, and its error: edges whose middle or quarters are
/// farther than `target` from the surface are halved, in all triangles that have them, so that there are no cracks; where only
/// the centroid is too far, the edge that is farthest.
pub(crate) fn adaptive(object: &Object, target: f64) -> (Mesh, f64) {
    let tried = STARTS.iter().map(|&start| {
        let mut refinement = Refinement::new(object, start);
        for _ in 0..MAX_ROUNDS {
            if !refinement.halve_edges(target) {
                break;
            }
        }
        refinement
    });
    let best = tried.min_by_key(|refinement| refinement.triangles.len()).expect("there are starts");
    let error = best.error();
    let triangles = best.triangles.iter().map(|&(_, triangle)| triangle).collect();
    (Mesh { vertices: best.vertices.iter().map(|v| v.deformed.as_vec3()).collect(), triangles }, error)
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
    /// Each with the undeformed triangle it is part of.
    triangles: Vec<(u32, [u32; 3])>,
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
            this.triangles.extend(cut.into_iter().map(|triangle| (number, triangle)));
        }
        this
    }

    fn add(&mut self, rest: DVec3) -> u32 {
        self.vertices.push(Vertex { rest, deformed: self.surface.position(rest).as_vec3().as_dvec3() });
        index(self.vertices.len() - 1)
    }

    /// The distance from the surface of each edge of a triangle, and of its centroid.
    fn errors(&self, &(number, triangle): &(u32, [u32; 3])) -> ([f64; 3], f64) {
        let [a, b, c] = self.object.corners(number as usize);
        let along = [b - a, c - a];
        let corners = triangle.map(|vertex| self.vertices[vertex as usize]);
        let edges = [0, 1, 2].map(|edge| {
            let [p, q] = [corners[edge], corners[(edge + 1) % 3]];
            let at =
                |t: f64| self.surface.distance(p.rest.lerp(q.rest, t), along, p.deformed.lerp(q.deformed, t));
            at(0.5).max(at(0.25)).max(at(0.75))
        });
        let mean = |of: fn(&Vertex) -> DVec3| corners.iter().map(of).sum::<DVec3>() / 3.0;
        (edges, self.surface.distance(mean(|v| v.rest), along, mean(|v| v.deformed)))
    }

    /// Halves the edges that are too far from the surface; whether there were any.
    fn halve_edges(&mut self, target: f64) -> bool {
        let target = target * self.object.diagonal;
        let too_far = |triangle: &(u32, [u32; 3])| {
            let (edges, centroid) = self.errors(triangle);
            let farthest = edges.iter().fold(0.0, |most: f64, &edge| most.max(edge));
            let only_centroid = farthest <= target && centroid > target;
            let ends = edges_of(triangle.1).map(ordered);
            let halved = |edge: usize| edges[edge] > target || (only_centroid && edges[edge] == farthest);
            [0, 1, 2].map(|edge| halved(edge).then_some(ends[edge]))
        };
        let marked: Vec<_> = self.triangles.par_iter().map(too_far).collect();
        let mut middles = HashMap::new();
        for ends in marked.into_iter().flatten().flatten() {
            middles.entry(ends).or_insert_with(|| {
                self.add(0.5 * (self.vertices[ends[0] as usize].rest + self.vertices[ends[1] as usize].rest))
            });
        }
        if middles.is_empty() {
            return false;
        }
        let mut triangles = Vec::with_capacity(2 * self.triangles.len());
        for &(number, triangle) in &self.triangles {
            let middle = edges_of(triangle).map(|edge| middles.get(&ordered(edge)).copied());
            triangles.extend(self.split(triangle, middle).into_iter().flatten().map(|t| (number, t)));
        }
        self.triangles = triangles;
        true
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
                let length = |p: u32, q: u32| {
                    self.vertices[p as usize].deformed.distance_squared(self.vertices[q as usize].deformed)
                };
                let corner = Some([ab, b, bc]);
                // the rest is a quad, cut along its shorter diagonal
                if length(a, bc) < length(ab, c) {
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
        self.triangles.par_iter().map(greatest).reduce(|| 0.0, f64::max) / self.object.diagonal
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
