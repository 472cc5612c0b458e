//! Closed solids, deformed by volumes that are locally one to one.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::path::Path;

use glam::{DAffine3, DVec3};
use trimray::mesh::{MeshTolerances, load_obj, prepare_polygons};
use trimray::patch::{Deformation, PlanarPolygon, deform_polygons};
use trimray::spline::{Axis, ControlLattice, Orientation, SplineVolume, orientation};
use trimray::subdivide::FrameChoice;
use trimray::trace::{NoAttributes, TracedObject, TracedScene};

/// A closed solid, undeformed and deformed.
pub(crate) struct Solid {
    /// Convex planar faces of the undeformed solid, outward.
    pub(crate) polygons: Vec<Vec<DVec3>>,
    /// Its deformation, with a positive Jacobian determinant everywhere.
    pub(crate) volume: SplineVolume,
    /// The deformed surface, as one object.
    pub(crate) scene: TracedScene,
    /// Middle of the deformed solid's box.
    pub(crate) centre: DVec3,
    /// Half the diagonal of that box: the solid is in this sphere.
    pub(crate) radius: f64,
}

impl Solid {
    /// `cube`, `slivers`, or an OBJ file.
    pub(crate) fn named(name: &str, rational: bool) -> Result<Self, String> {
        match name {
            "cube" => Self::new(cube(), [2; 3], [4; 3], 90.0, rational),
            "slivers" => Self::new(sliver_torus(), [3, 2, 3], [5, 4, 5], 50.0, rational),
            path => Self::new(from_obj(Path::new(path))?, [3; 3], [5; 3], 40.0, rational),
        }
    }

    fn new(
        polygons: Vec<Vec<DVec3>>,
        degree: [usize; 3],
        points: [usize; 3],
        twist: f64,
        rational: bool,
    ) -> Result<Self, String> {
        check_closed(&polygons)?;
        let volume = twisted(bounds(&polygons), degree, points, twist, rational)?;
        let planar: Vec<_> =
            (0..).zip(&polygons).map(|(face, corners)| PlanarPolygon { face, corners }).collect();
        let deformation = Deformation { volume: Some(&volume), frame: FrameChoice::default() };
        let shell = deform_polygons(&planar, deformation).map_err(|error| error.to_string())?.shell;
        let object = TracedObject { name: "solid".into(), shell, attributes: Box::new(NoAttributes) };
        let scene = TracedScene::new(vec![object]);
        let [low, high] = scene.bounds();
        Ok(Self { polygons, volume, scene, centre: 0.5 * (low + high), radius: 0.5 * (high - low).length() })
    }

    /// Diagonal of the deformed solid's box.
    pub(crate) fn diagonal(&self) -> f64 {
        2.0 * self.radius
    }
}

/// A lattice around a box, twisted about z, with a little of every other edit.
fn twisted(
    bounds: [DVec3; 2],
    degree: [usize; 3],
    points: [usize; 3],
    twist: f64,
    rational: bool,
) -> Result<SplineVolume, String> {
    let mut lattice =
        ControlLattice::identity(degree, points, bounds, 0).map_err(|error| error.to_string())?;
    lattice.twist(Axis::Z, twist);
    lattice.taper(Axis::X, [0.9, 1.1]);
    lattice.bulge(Axis::Y, 0.1);
    if rational {
        for (number, index) in [[0, 0, 0], [1, 2, 1], [2, 1, 3], [3, 3, 2]].into_iter().enumerate() {
            let weight = [2.0, 0.6, 1.5, 0.7][number];
            lattice.set_weight(index, weight).map_err(|error| error.to_string())?;
        }
    }
    let volume = lattice.volume().map_err(|error| error.to_string())?;
    let [nu, nv, nw] = [0, 1, 2].map(|axis| volume.axes()[axis].intervals());
    let cells = (0..nu).flat_map(|i| (0..nv).flat_map(move |j| (0..nw).map(move |k| [i, j, k])));
    for cell in cells {
        if orientation(&volume, cell) != Orientation::Positive {
            return Err(format!("the volume is not proved one to one in knot box {cell:?}"));
        }
    }
    Ok(volume)
}

/// The unit cube as 12 triangles.
fn cube() -> Vec<Vec<DVec3>> {
    let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let halves = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
    halves.map(|triangle| triangle.map(corner).to_vec()).collect()
}

/// A torus of triangles with strips of them as thin as a millionth of their length, both ways around.
fn sliver_torus() -> Vec<Vec<DVec3>> {
    let angles = |sectors: u32, start: f64| -> Vec<f64> {
        let thin = [1e-6, 1e-4, 1e-5, 1e-2, 1e-3];
        let both = |i: u32| {
            let angle = start + TAU * f64::from(i) / f64::from(sectors);
            [angle, angle + thin[i as usize % thin.len()]]
        };
        (0..sectors).flat_map(both).collect()
    };
    let (around, across) = (angles(11, 0.2), angles(7, 0.0));
    let point = |i: usize, j: usize| {
        let (phi, theta) = (around[i % around.len()], across[j % across.len()]);
        let ring = 1.0 + 0.4 * libm::cos(theta);
        DVec3::new(ring * libm::cos(phi), ring * libm::sin(phi), 0.4 * libm::sin(theta))
    };
    let mut triangles = Vec::new();
    for i in 0..around.len() {
        for j in 0..across.len() {
            let [a, b, c, d] = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
            triangles.extend([vec![a, b, c], vec![a, c, d]]);
        }
    }
    triangles
}

fn from_obj(path: &Path) -> Result<Vec<Vec<DVec3>>, String> {
    let (mesh, _) = load_obj(path).map_err(|error| error.to_string())?;
    let (polygons, _) = prepare_polygons(&mesh, DAffine3::IDENTITY, MeshTolerances::default());
    Ok(polygons.iter().map(|polygon| polygon.positions.to_vec()).collect())
}

fn bounds(polygons: &[Vec<DVec3>]) -> [DVec3; 2] {
    let corners = polygons.iter().flatten();
    corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], &p| [low.min(p), high.max(p)])
}

/// Fails unless every edge is matched by its reverse.
fn check_closed(polygons: &[Vec<DVec3>]) -> Result<(), String> {
    let bits = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut edges: HashMap<_, i64> = HashMap::new();
    for corners in polygons {
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            *edges.entry((bits(a), bits(b))).or_default() += 1;
            *edges.entry((bits(b), bits(a))).or_default() -= 1;
        }
    }
    match edges.values().filter(|&&count| count > 0).count() {
        0 => Ok(()),
        open => Err(format!("the mesh is not closed: {open} edges without a neighbour")),
    }
}
