//! Closed solids of random triangles with vertices and edges a hair off knot planes, faces of the lattice's box, and each other.

#[path = "../common/random.rs"]
mod random;

use glam::DVec3;
use trimray::patch::{BuildError, Deformation, PlanarPolygon, Shell, deform_polygons, deform_triangles};
use trimray::spline::{Axis, ControlLattice, Orientation, SplineVolume, orientation};
use trimray::subdivide::FrameChoice;
use trimray::trace::{NoAttributes, TracedObject, TracedScene};

pub(crate) use random::Random;

/// How a solid is deformed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Method {
    /// Tensor-product patches in affine frames of lowest degree.
    Parallelogram,
    /// The same in orthogonal frames.
    Rectangle,
    /// Triangular patches.
    Triangular,
}

impl Method {
    /// All of them.
    pub(crate) const ALL: [Self; 3] = [Self::Parallelogram, Self::Rectangle, Self::Triangular];
}

/// Number of lattices to choose from.
pub(crate) const LATTICES: usize = 4;

/// Part of the solid's vertices near a plane that are moved next to it.
const MOVED: f64 = 0.7;

/// Part of the vertices that are moved next to a neighbour.
const CLUSTERED: f64 = 0.05;

impl Random {
    /// Ten to a power between -`least` and -`most`.
    pub(crate) fn power(&mut self, least: f64, most: f64) -> f64 {
        libm::pow(10.0, -(least + (most - least) * self.unit()))
    }
}

/// A closed solid around the origin, undeformed and deformed.
pub(crate) struct Solid {
    /// The undeformed solid's vertices.
    pub(crate) vertices: Vec<DVec3>,
    /// Its edges of which an end is next to a plane or to another vertex.
    pub(crate) edges: Vec<[usize; 2]>,
    /// Its deformation, with a positive Jacobian determinant everywhere.
    pub(crate) volume: SplineVolume,
    /// The deformed surface, as one object.
    pub(crate) scene: TracedScene,
}

impl Solid {
    /// About as many triangles as asked for, in one of [`LATTICES`].
    ///
    /// # Errors
    /// If the lattice is not proved one to one, or patches cannot be made.
    pub(crate) fn new(
        triangles: usize,
        lattice: usize,
        method: Method,
        random: &mut Random,
    ) -> Result<Self, String> {
        let volume = volume(lattice)?;
        let steps = (1..).find(|steps| 8 * steps * steps >= triangles).unwrap_or(1);
        let (mut vertices, triangles) = ball(steps, random);
        let spacing = 1.5 / steps as f64;
        let mut is_next = vec![false; vertices.len()];
        for (vertex, is_next) in vertices.iter_mut().zip(&mut is_next) {
            for axis in 0..3 {
                let planes = volume.axes()[axis].breakpoints();
                let near = planes.iter().copied().find(|plane| (vertex[axis] - plane).abs() < 0.3 * spacing);
                if let Some(plane) = near.filter(|_| random.unit() < MOVED) {
                    let off = match random.below(8) {
                        0 => 0.0,
                        1 => random.power(13.0, 17.0),
                        _ => random.power(6.0, 13.0),
                    };
                    vertex[axis] = if random.below(2) == 0 { plane - off } else { plane + off };
                    *is_next = true;
                }
            }
        }
        for &[a, b, _] in &triangles {
            if random.unit() < CLUSTERED {
                vertices[a] = vertices[b] + random.power(6.0, 17.0) * random.direction();
                (is_next[a], is_next[b]) = (true, true);
            }
        }
        let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let edges = sides.filter(|[a, b]| a < b && (is_next[*a] || is_next[*b])).collect();
        let corners: Vec<_> = triangles.iter().map(|triangle| triangle.map(|i| vertices[i])).collect();
        let shell = deformed(&corners, &volume, method).map_err(|error| error.to_string())?;
        let object = TracedObject { name: "solid".into(), shell, attributes: Box::new(NoAttributes) };
        let scene = TracedScene::new(vec![object]);
        Ok(Self { vertices, edges, volume, scene })
    }

    /// The deformed place of a point.
    pub(crate) fn image(&self, point: DVec3) -> DVec3 {
        self.volume.eval(point).map_or(point, |point| point.position)
    }
}

fn deformed(triangles: &[[DVec3; 3]], volume: &SplineVolume, method: Method) -> Result<Shell, BuildError> {
    let polygons: Vec<_> =
        (0..).zip(triangles).map(|(face, corners)| PlanarPolygon { face, corners }).collect();
    let frame = match method {
        Method::Parallelogram => FrameChoice::Parallelogram,
        Method::Rectangle => FrameChoice::Rectangle,
        Method::Triangular => {
            return deform_triangles(&polygons, Some(volume))?.shell(&polygons, Some(volume));
        }
    };
    Ok(deform_polygons(&polygons, Deformation { volume: Some(volume), frame })?.shell)
}

/// One of the lattices: quadratic as in most scenes; of mixed degrees, rational; linear; and one whose box, with its outer
/// points held, has parts of the solid outside.
fn volume(number: usize) -> Result<SplineVolume, String> {
    let (degree, points, size) = [
        ([2, 2, 2], [4, 4, 4], 1.25),
        ([3, 2, 3], [5, 4, 6], 1.3),
        ([1, 1, 1], [4, 5, 3], 1.2),
        ([2, 3, 2], [6, 7, 5], 0.75),
    ][number];
    let bounds = [DVec3::splat(-size), DVec3::splat(size)];
    let held = usize::from(number == 3);
    let mut lattice =
        ControlLattice::identity(degree, points, bounds, held).map_err(|error| error.to_string())?;
    lattice.twist(Axis::Z, [90.0, 50.0, 30.0, 25.0][number]);
    if number != 3 {
        lattice.taper(Axis::X, [0.9, 1.1]);
        lattice.bulge(Axis::Y, 0.1);
    }
    if number == 1 {
        for (index, weight) in [([0, 0, 0], 2.0), ([1, 2, 1], 0.6), ([2, 1, 3], 1.5), ([3, 3, 2], 0.7)] {
            lattice.set_weight(index, weight).map_err(|error| error.to_string())?;
        }
    }
    let volume = lattice.volume().map_err(|error| error.to_string())?;
    let [nu, nv, nw] = [0, 1, 2].map(|axis| volume.axes()[axis].intervals());
    let cells = (0..nu).flat_map(|i| (0..nv).flat_map(move |j| (0..nw).map(move |k| [i, j, k])));
    for cell in cells {
        if orientation(&volume, cell) != Orientation::Positive {
            return Err(format!("lattice {number} is not proved one to one in knot box {cell:?}"));
        }
    }
    Ok(volume)
}

/// Vertices on a rough sphere of radius about 1, and 8 `steps`² triangles, outward: those of an octahedron's faces.
fn ball(steps: usize, random: &mut Random) -> (Vec<DVec3>, Vec<[usize; 3]>) {
    let mut vertices = Vec::new();
    let mut known = std::collections::HashMap::new();
    let mut triangles = Vec::new();
    for face in 0..8_usize {
        let sign = |bit: usize| if face >> bit & 1 == 0 { 1_i64 } else { -1 };
        let mut vertex = |i: usize, j: usize| {
            let whole = |n: usize| i64::try_from(n).expect("a small number");
            let key = [sign(0) * whole(i), sign(1) * whole(j), sign(2) * whole(steps - i - j)];
            *known.entry(key).or_insert_with(|| {
                let place = DVec3::from_array(key.map(|x| x as f64)) / steps as f64;
                let shaken = place.normalize() + 0.25 / steps as f64 * random.direction();
                vertices.push(shaken.normalize() * (0.95 + 0.1 * random.unit()));
                vertices.len() - 1
            })
        };
        let is_mirrored = sign(0) * sign(1) * sign(2) < 0;
        let mut push =
            |[a, b, c]: [usize; 3]| triangles.push(if is_mirrored { [a, c, b] } else { [a, b, c] });
        for i in 0..steps {
            for j in 0..steps - i {
                push([vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)]);
                if i + j + 1 < steps {
                    push([vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)]);
                }
            }
        }
    }
    (vertices, triangles)
}
