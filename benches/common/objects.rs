//! The deformed objects that are traced.

use std::collections::HashMap;
use std::path::Path;
use std::time::{Duration, Instant};

use glam::{DAffine3, DQuat, DVec3, EulerRot};
use trimray::mesh::{MeshTolerances, load_obj, prepare_polygons};
use trimray::patch::{Deformation, PlanarPolygon, deform_polygons};
use trimray::spline::{Axis, ControlLattice, SplineVolume};
use trimray::subdivide::FrameChoice;
use trimray::trace::{NoAttributes, TracedObject, TracedScene};

/// Points of the surface from which its box is taken, about; it only scales errors and frames the view.
const BOUNDS_POINTS: usize = 200_000;

/// Vertices, and triangles as indices into them, counter-clockwise seen from outside.
pub(crate) type TriangleMesh = (Vec<DVec3>, Vec<[u32; 3]>);

/// What is traced, by its size.
#[derive(Debug)]
pub(crate) struct Subject {
    /// "a", "b", "c", "ball", "patch" or the name of a scene file.
    pub(crate) name: String,
    /// What it is, for the heading of its tables.
    pub(crate) description: String,
    /// Lowest and highest corner of the box around the deformed surface, from points on it.
    pub(crate) bounds: [DVec3; 2],
    /// Length of the diagonal of that box: errors are in parts of it.
    pub(crate) diagonal: f64,
}

impl Subject {
    /// Of points of the deformed surface.
    pub(crate) fn new(name: String, description: String, points: impl Iterator<Item = DVec3>) -> Self {
        let bounds = bounds_of(points);
        Self { name, description, bounds, diagonal: (bounds[1] - bounds[0]).length() }
    }
}

/// A triangle mesh and the volume that deforms it.
#[derive(Debug)]
pub(crate) struct Object {
    pub(crate) subject: Subject,
    /// Undeformed vertices.
    pub(crate) vertices: Vec<DVec3>,
    /// Indices into the vertices, counter-clockwise seen from outside.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The deformation.
    pub(crate) volume: SplineVolume,
    /// The frame of the patches.
    pub(crate) frame: FrameChoice,
}

/// An object ready for rays, and what it cost.
#[derive(Debug)]
pub(crate) struct Built {
    /// The object alone.
    pub(crate) scene: TracedScene,
    /// From polygons to the first ray.
    pub(crate) times: BuiltTimes,
    /// Patches and acceleration structure.
    pub(crate) bytes: usize,
}

/// Seconds of the stages of a build.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BuiltTimes {
    /// Cutting, grouping and framing.
    pub(crate) subdivide: f64,
    /// Composing patches.
    pub(crate) compose: f64,
    /// The acceleration structure.
    pub(crate) structure: f64,
}

impl BuiltTimes {
    pub(crate) fn total(&self) -> f64 {
        self.subdivide + self.compose + self.structure
    }
}

impl Object {
    /// The unit cube of 12 triangles, degree 2 × 2 × 2, 4 × 4 × 4 control points.
    pub(crate) fn a() -> Result<Self, String> {
        Self::cube("a", 2, 4)
    }

    /// The same, degree 3 × 3 × 3, 6 × 6 × 6 control points.
    pub(crate) fn b() -> Result<Self, String> {
        Self::cube("b", 3, 6)
    }

    fn cube(name: &'static str, degree: usize, points: usize) -> Result<Self, String> {
        let bit = |corner: u32, axis: u32| f64::from(corner >> axis & 1);
        let vertices = (0..8).map(|c| DVec3::new(bit(c, 0), bit(c, 1), bit(c, 2))).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Self::twisted(name, "unit cube", (vertices, triangles), [degree, points], (Axis::Z, 0.35))
    }

    /// A mesh from an OBJ file, degree 3 × 3 × 3, 6 × 6 × 6 control points.
    pub(crate) fn c(path: &Path) -> Result<Self, String> {
        let (mesh, _) = load_obj(path).map_err(|error| error.to_string())?;
        let (polygons, _) = prepare_polygons(&mesh, DAffine3::IDENTITY, MeshTolerances::default());
        let mut triangles = Vec::new();
        for polygon in polygons.iter() {
            let vertex = |corner: usize| mesh.corner(polygon.corners[corner] as usize).position;
            triangles.extend((2..polygon.corners.len()).map(|i| [vertex(0), vertex(i - 1), vertex(i)]));
        }
        let file = path.file_name().map_or_else(Default::default, |name| name.to_string_lossy());
        let mesh = (mesh.positions().to_vec(), triangles);
        Self::twisted("c", &file, mesh, [3, 6], (Axis::Y, 0.25))
    }

    /// A ball of 8 · `fineness`² triangles, no two of them in a plane.
    pub(crate) fn ball(fineness: u32, degree: usize, points: usize) -> Result<Self, String> {
        Self::twisted("ball", "ball", ball(fineness), [degree, points], (Axis::Z, 0.35))
    }

    /// Deforms a mesh over its box by a twist of 90° and a bulge.
    fn twisted(
        name: &'static str,
        what: &str,
        mesh: TriangleMesh,
        [degree, points]: [usize; 2],
        (axis, bulge): (Axis, f64),
    ) -> Result<Self, String> {
        let bounds = bounds_of(mesh.0.iter().copied());
        let mut lattice = ControlLattice::identity([degree; 3], [points; 3], bounds, 0)
            .map_err(|error| error.to_string())?;
        lattice.twist(axis, 90.0);
        lattice.bulge(axis, bulge);
        let volume = lattice.volume().map_err(|error| error.to_string())?;
        let description = format!(
            "{what}, {} triangles, degree {degree} × {degree} × {degree}, {points} × {points} × {points} control points",
            mesh.1.len()
        );
        Ok(Self::new(name, description, mesh, volume))
    }

    /// A mesh in a volume that holds it.
    pub(crate) fn new(
        name: &'static str,
        description: String,
        (vertices, triangles): TriangleMesh,
        volume: SplineVolume,
    ) -> Self {
        let frame = FrameChoice::Parallelogram;
        let subject = Subject::new(name.to_owned(), description, std::iter::empty());
        let mut object = Self { subject, vertices, triangles, volume, frame };
        let points = object.surface_points().collect::<Vec<_>>();
        let Subject { name, description, .. } = object.subject;
        object.subject = Subject::new(name, description, points.into_iter());
        object
    }

    /// The corners of an undeformed triangle.
    pub(crate) fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|vertex| self.vertices[vertex as usize])
    }

    /// Points of the deformed surface, as many on each triangle.
    fn surface_points(&self) -> impl Iterator<Item = DVec3> {
        let parts = (2 * BOUNDS_POINTS / self.triangles.len()).isqrt().clamp(1, 128);
        let [low, high] = self.volume.bounds();
        (0..self.triangles.len()).flat_map(move |triangle| {
            let [a, b, c] = self.corners(triangle);
            let places = (0..=parts).flat_map(move |i| (0..=parts - i).map(move |j| [i, j]));
            places.map(move |place| {
                let [u, v] = place.map(|step| step as f64 / parts as f64);
                // a point within rounding of the lattice's box is taken to be inside
                let rest = (a + u * (b - a) + v * (c - a)).clamp(low, high);
                self.volume.eval(rest).expect("the point was clamped to the box").position
            })
        })
    }

    /// Cuts, composes and builds: all that precedes the first ray.
    pub(crate) fn build(&self) -> Result<Built, String> {
        let corners: Vec<_> = (0..self.triangles.len()).map(|triangle| self.corners(triangle)).collect();
        let polygons: Vec<_> =
            (0..).zip(&corners).map(|(face, corners)| PlanarPolygon { face, corners }).collect();
        let deformation = Deformation { volume: Some(&self.volume), frame: self.frame };
        let made = deform_polygons(&polygons, deformation).map_err(|error| error.to_string())?;
        let started = Instant::now();
        let object = TracedObject {
            name: self.subject.name.clone(),
            shell: made.shell,
            attributes: Box::new(NoAttributes),
        };
        let scene = TracedScene::new(vec![object]);
        let [subdivide, compose, structure] = [made.times.subdivide, made.times.compose, started.elapsed()]
            .map(|time: Duration| time.as_secs_f64());
        let bytes = scene.objects()[0].shell.bytes() + scene.acceleration().bytes;
        Ok(Built { scene, times: BuiltTimes { subdivide, compose, structure }, bytes })
    }

    /// As [`Self::build`], with the times of the fastest of some builds.
    pub(crate) fn build_least(&self, builds: usize) -> Result<Built, String> {
        let mut built = self.build()?;
        for _ in 1..builds {
            let times = self.build()?.times;
            if times.total() < built.times.total() {
                built.times = times;
            }
        }
        Ok(built)
    }
}

/// An octahedron with each face cut into n × n, blown up to the unit sphere, and turned so that no face is along an axis.
fn ball(n: u32) -> TriangleMesh {
    let turn = DQuat::from_euler(EulerRot::XYZ, 0.4, 0.3, 0.2);
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    // faces that share an edge find its vertices by their coordinates on the octahedron
    let mut known = HashMap::new();
    for octant in 0..8 {
        let sign = |axis: i32| if octant >> axis & 1 == 0 { 1 } else { -1 };
        let mut vertex = |x: u32, y: u32| {
            let steps =
                [x, y, n - x - y].map(|steps| i32::try_from(steps).expect("a mesh that fits in memory"));
            let [x, y, z] = [0, 1, 2].map(|axis| sign(axis) * steps[axis as usize]);
            *known.entry([x, y, z]).or_insert_with(|| {
                vertices.push(turn * DVec3::new(x.into(), y.into(), z.into()).normalize());
                u32::try_from(vertices.len() - 1).expect("a mesh that fits in memory")
            })
        };
        let inside_out = sign(0) * sign(1) * sign(2) < 0;
        let mut push = |[a, b, c]: [u32; 3]| triangles.push(if inside_out { [a, c, b] } else { [a, b, c] });
        for x in 0..n {
            for y in 0..n - x {
                push([vertex(x, y), vertex(x + 1, y), vertex(x, y + 1)]);
                if x + y + 2 <= n {
                    push([vertex(x + 1, y), vertex(x + 1, y + 1), vertex(x, y + 1)]);
                }
            }
        }
    }
    (vertices, triangles)
}

/// Does work on each of the objects a, b and c, or on the one that is named; c only with its mesh.
pub(crate) fn each_object(
    only: Option<&str>,
    mesh: Option<&Path>,
    work: impl Fn(&Object) -> Result<(), String>,
) -> Result<(), String> {
    let wanted = |name: &str| only.is_none_or(|only| only == name);
    if wanted("a") {
        work(&Object::a()?)?;
    }
    if wanted("b") {
        work(&Object::b()?)?;
    }
    match mesh {
        Some(path) if wanted("c") => work(&Object::c(path)?)?,
        None if wanted("c") => eprintln!("note: object c is skipped, it needs --mesh MODEL.obj"),
        _ => {}
    }
    Ok(())
}

/// Lowest and highest corner of the box around points.
fn bounds_of(points: impl Iterator<Item = DVec3>) -> [DVec3; 2] {
    points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
}
