//! The deformations of an object, one after the other.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{DAffine3, DVec2, DVec3};

use super::attributes::plane_corners;
use super::bounds::tight_bounds;
use super::deformer::{BuiltLattice, Deformer, EditError};
use super::error::{ModelError, PartsOutside};
use super::settings::BuildSettings;
use crate::analytic::{Chain, CoverSettings, Covered, Step, cover};
use crate::math::bernstein::MAX_DEGREE;
use crate::mesh::PolygonSet;
use crate::patch::{
    BuildError, BuildTimes, Chart, Deformation, DeformedPolygons, Face, ParameterFrame, PlanarPolygon, Shell,
    deform_polygons_within,
};
use crate::spline::{ControlLattice, KnotBox, SplineVolume};
use crate::subdivide::FrameChoice;
use crate::surface::SplineSurface;
use crate::trace::{NoAttributes, Ray, TracedObject, TracedScene};

/// Memory that a control point takes: in the lattice, in the volume that is kept with it and in the chain's, and while it is edited.
const CONTROL_POINT_BYTES: u64 = 5 * 32;

/// A shape placed in the world, with what deforms it.
#[derive(Clone, Copy)]
pub(super) struct PlacedShape<'a> {
    pub(super) base: Base<'a>,
    pub(super) deformers: &'a [Deformer],
    /// How it is built.
    pub(super) settings: BuildSettings,
}

/// A shape in the world before its deformations.
#[derive(Clone, Copy)]
pub(super) enum Base<'a> {
    /// The polygons of a mesh.
    Polygons(&'a PolygonSet),
    /// The faces of a surface, whose charts take to its parameters.
    Surface { surface: &'a SplineSurface, placement: DAffine3, shell: &'a Shell },
}

/// The exact faces of an object after some of its steps.
pub(super) struct Faces {
    pub(super) shell: Shell,
    pub(super) subpolygons: usize,
    pub(super) times: BuildTimes,
    /// The knot boxes that hold a part of the object, by step.
    pub(super) knot_boxes: BTreeSet<(usize, Option<KnotBox>)>,
}

impl Faces {
    /// Notes in each lattice which of its knot boxes hold a part of the object.
    pub(super) fn record_knot_boxes(&self, lattices: &mut [BuiltLattice]) {
        for lattice in lattices {
            let here = self.knot_boxes.iter().filter(|(step, _)| step + 1 == lattice.deformer);
            lattice.knot_boxes = here.filter_map(|(_, knot_box)| *knot_box).collect();
        }
    }
}

impl PlacedShape<'_> {
    /// The maps of all deformers and the lattices that some of them come from.
    pub(super) fn steps(&self) -> Result<(Vec<Step>, Vec<BuiltLattice>), ModelError> {
        let mut steps: Vec<Step> = Vec::new();
        let mut lattices = Vec::new();
        for (number, deformer) in self.deformers.iter().enumerate() {
            let lattice = match deformer {
                Deformer::Map(map) => {
                    steps.push(map.clone());
                    continue;
                }
                Deformer::Lattice(lattice) => lattice,
            };
            let received = match (lattice.bounds, self.base) {
                (Some(bounds), _) => bounds,
                (None, Base::Polygons(polygons)) if steps.is_empty() => polygons.bounds().unwrap_or_default(),
                (None, _) => tight_bounds(self.after(&steps, true)?.shell.faces()),
            };
            let count =
                lattice.points.iter().fold(1, |count: u64, points| count.saturating_mul(*points as u64));
            let promise = self.settings.memory.ask(
                format_args!("a lattice of {count} control points"),
                count.saturating_mul(CONTROL_POINT_BYTES),
            )?;
            let seen = |lattice: &ControlLattice, ray: &Ray| self.seen(&steps, lattice, ray);
            let built = lattice.built(number, received, &seen)?;
            drop(promise);
            let reached = match self.base {
                Base::Polygons(polygons) if steps.is_empty() => polygons.bounds().unwrap_or(received),
                Base::Surface { shell, .. } if steps.is_empty() => tight_bounds(shell.faces()),
                _ => received,
            };
            if let Some(place) = built.collapsed(reached) {
                return Err(ModelError::Collapsed { deformer: number, place });
            }
            steps.push(Step::Volume(built.volume.clone()));
            lattices.push(built);
        }
        Ok((steps, lattices))
    }

    /// The object after some steps, exactly. Whether it `composes`: see [`CoverSettings::composes`].
    pub(super) fn after(&self, steps: &[Step], composes: bool) -> Result<Faces, ModelError> {
        let BuildSettings { memory, borders } = self.settings;
        let settings = CoverSettings { composes, borders, memory };
        let started = Instant::now();
        let mut made = self.first_step(steps)?;
        let done = usize::from(self.composes_first(steps));
        for patch in made.shell.faces().iter().filter(|_| done == 1) {
            made.knot_boxes.insert((0, patch.knot_box()));
        }
        if done == 1 {
            self.check_outside(0, &made)?;
        }
        if done < steps.len() {
            let too_many = |_| ModelError::TooManyFields { deformer: steps.len() - 1 };
            let chain = Arc::new(Chain::try_new(steps[done..].to_vec()).map_err(too_many)?);
            let Covered { shell, knot_boxes } = cover(&made.shell, &chain, settings).map_err(|source| {
                ModelError::Cover { deformer: source.step().map(|step| step + done), source }
            })?;
            made.shell = shell;
            made.knot_boxes.extend(knot_boxes.into_iter().map(|(step, knot_box)| (step + done, knot_box)));
            for step in done..steps.len() {
                self.check_outside(step, &made)?;
            }
        }
        let before: Duration = made.times.subdivide + made.times.compose;
        made.times.compose += started.elapsed().saturating_sub(before);
        Ok(made)
    }

    /// Whether it is made of plane pieces, whose images under a volume are patches.
    fn is_flat(&self) -> bool {
        match self.base {
            Base::Polygons(_) => true,
            Base::Surface { shell, .. } => shell.faces().iter().all(|face| plane_corners(face).is_some()),
        }
    }

    /// Whether the first step makes patches: a volume, of a flat object, whose degrees add up to no more than a patch may have.
    /// Otherwise it makes cells.
    fn composes_first(&self, steps: &[Step]) -> bool {
        composable(steps).is_some() && self.is_flat()
    }

    /// After the first step, if that makes patches; else before.
    fn first_step(&self, steps: &[Step]) -> Result<Faces, ModelError> {
        let volume = composable(steps);
        let lattice = self.deformers.first().and_then(Deformer::lattice);
        let frame = lattice.map_or_else(FrameChoice::default, |lattice| lattice.frame);
        let deformation = Deformation { volume, frame };
        let fault = |source: BuildError| ModelError::Patches { deformer: 0, source };
        let knot_boxes = BTreeSet::new();
        match self.base {
            Base::Polygons(polygons) => {
                let DeformedPolygons { shell, subpolygons, times } =
                    deform_polygons_within(&planar(polygons), deformation, false, self.settings.memory)
                        .map_err(fault)?;
                Ok(Faces { shell, subpolygons, times, knot_boxes })
            }
            Base::Surface { shell, .. } => {
                let times = BuildTimes::default();
                if volume.is_none() || !self.is_flat() {
                    return Ok(Faces { shell: shell.clone(), subpolygons: 0, times, knot_boxes });
                }
                let mut all =
                    Faces { shell: Shell::new(shell.numbers().clone()), subpolygons: 0, times, knot_boxes };
                for (face, vertices) in shell.iter() {
                    let Some(corners) = plane_corners(face) else { continue };
                    let polygon = [PlanarPolygon { face: 0, corners: &corners }];
                    let made = deform_polygons_within(&polygon, deformation, true, self.settings.memory)
                        .map_err(fault)?;
                    all.subpolygons += made.subpolygons;
                    all.times.subdivide += made.times.subdivide;
                    all.times.compose += made.times.compose;
                    let placed = |mut made: Face| {
                        made.chart = parameter_chart(&made.chart, &corners, &face.chart);
                        made
                    };
                    // the polygon's own corners are numbered first
                    all.shell.append(made.shell.map(placed), 4, |corner| vertices[corner as usize]);
                }
                all.shell.shrink();
                Ok(all)
            }
        }
    }

    /// Refuses parts outside the box of a step's lattice, if that is what the lattice asks for.
    pub(super) fn check_outside(&self, step: usize, made: &Faces) -> Result<(), ModelError> {
        let Some(lattice) = self.deformers.get(step).and_then(Deformer::lattice) else { return Ok(()) };
        lattice.check_outside(step, || {
            if !made.knot_boxes.contains(&(step, None)) {
                return None;
            }
            let has_cells = made.shell.faces().iter().any(|face| face.exact.is_some());
            if step > 0 || has_cells || matches!(self.base, Base::Surface { .. }) {
                return Some(PartsOutside::Some);
            }
            let outside = made.shell.faces().iter().filter(|patch| patch.knot_box().is_none());
            let faces: BTreeSet<u32> =
                outside.flat_map(|face| face.region.loops().map(|trim_loop| trim_loop.face)).collect();
            Some(PartsOutside::Faces(faces.into_iter().collect()))
        })
    }

    /// The point of the object, as a lattice that follows some steps receives it, where a ray hits it under that lattice.
    fn seen(&self, steps: &[Step], lattice: &ControlLattice, ray: &Ray) -> Result<Option<DVec3>, EditError> {
        let steps = [steps, &[Step::Volume(lattice.volume()?)]].concat();
        // only cells know their points before the last step
        let shell = self.after(&steps, false).map_err(Box::new)?.shell;
        let object = TracedObject { name: String::new(), shell, attributes: Box::new(NoAttributes) };
        let traced = TracedScene::try_new_within(vec![object], self.settings.memory)
            .map_err(|error| Box::new(ModelError::from(error)))?;
        Ok(traced.closest_hit(ray).map(|hit| {
            let patch = &traced.objects()[0].faces()[hit.patch as usize];
            match (&patch.exact, self.base) {
                (Some(exact), _) => exact.received(hit.st),
                (None, Base::Polygons(_)) => hit.rest,
                (None, Base::Surface { surface, placement, .. }) => {
                    placement.transform_point3(surface.eval(hit.rest.truncate()))
                }
            }
        }))
    }
}

/// The volume of the first step, if its degrees add up to no more than a patch may have.
pub(super) fn composable(steps: &[Step]) -> Option<&SplineVolume> {
    match steps.first() {
        Some(Step::Volume(volume)) if volume.total_degree() <= MAX_DEGREE => Some(volume),
        _ => None,
    }
}

/// The polygons of a mesh as they are cut.
pub(super) fn planar(polygons: &PolygonSet) -> Vec<PlanarPolygon<'_>> {
    polygons.iter().map(|polygon| PlanarPolygon { face: polygon.face, corners: polygon.positions }).collect()
}

/// The chart to a surface's parameters that belongs to one to the plane of a parallelogram, whose own to the parameters is given.
fn parameter_chart(placed: &Chart, [corner, along_s, _, along_t]: &[DVec3; 4], whole: &Chart) -> Chart {
    let (s, t) = (along_s - corner, along_t - corner);
    let normal = s.cross(t);
    let parts = |vector: DVec3| {
        DVec2::new(vector.cross(t).dot(normal), s.cross(vector).dot(normal)) / normal.length_squared()
    };
    let [origin, by_s, by_t] = whole.coordinates().map(DVec3::truncate);
    let vector = |vector: DVec3| {
        let parts = parts(vector);
        parts.x * by_s + parts.y * by_t
    };
    let [placed, placed_s, placed_t] = placed.coordinates();
    let origin = origin + vector(placed - corner);
    Chart::Parameters(ParameterFrame { origin, s: vector(placed_s), t: vector(placed_t) })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use glam::DVec3;

    use crate::arrays::write_npy;
    use crate::scene::parse_scene;
    use crate::test_support::Noise;
    use crate::trace::Ray;

    const CUBE: &str = include_str!("../../scenes/meshes/feng_fig07_cube.obj");

    /// Rays at a turned cube under a lattice with random control points: how far hits are from where the volume takes their places,
    /// how many hits there are, and how many faces are cells.
    fn errors(lattice: &str) -> (f64, usize, usize) {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.obj"), CUBE).unwrap();
        let object = "[[object]]\nname = \"a\"\nmesh = \"a.obj\"\ntransform = [{ scale = 0.5 }, { rotate = { axis = [1, 2, 3], angle = 25 } }]";
        let deform = format!(
            "[[object.deform]]\ntype = \"ffd\"\nbounds = [[-0.2, -0.1, -0.3], [0.7, 0.6, 0.7]]\n{lattice}\n"
        );
        let path = folder.path().join("a.toml");
        fs::write(&path, format!("{object}\n{deform}")).unwrap();
        let rest = parse_scene(&path).unwrap().build().unwrap();
        let volume = &rest.objects[0].lattices[0].volume;
        let [nx, ny, nz] = volume.points();
        let mut noise = Noise(5);
        let moved = volume.control_points().into_iter().map(|p| p.truncate() + 0.05 * noise.vector());
        let moved: Vec<f64> = moved.flat_map(|p| p.to_array()).collect();
        write_npy(&folder.path().join("a.npy"), &[nx, ny, nz, 3], &moved).unwrap();
        fs::write(&path, format!("{object}\n{deform}edit = [{{ control_points = \"a.npy\" }}]\n")).unwrap();
        let built = parse_scene(&path).unwrap().build().unwrap();
        let volume = &built.objects[0].lattices[0].volume;
        let (mut worst, mut hits) = (0.0_f64, 0);
        for _ in 0..400 {
            let target = DVec3::splat(0.2) + 0.4 * noise.vector();
            let origin = target + 3.0 * noise.unit_vector();
            let Some(hit) = built.traced.closest_hit(&Ray::new(origin, target - origin)) else { continue };
            hits += 1;
            let want = volume.eval(hit.rest).map_or(hit.rest, |point| point.position);
            worst = worst.max(want.distance(hit.position));
        }
        let cells = built.traced.objects()[0].faces().iter().filter(|face| face.exact.is_some()).count();
        (worst, hits, cells)
    }

    #[test]
    fn general_lattices_make_patches_of_their_volumes() {
        for lattice in [
            "degree = [2, 3, 1]\npoints = [4, 5, 3]\nknots = \"uniform\"",
            "basis = \"bezier\"\npoints = [6, 2, 7]",
            "degree = [8, 2, 2]\npoints = [9, 3, 4]",
            "degree = [7, 1, 1]\npoints = [8, 3, 3]",
            "degree = [2, 3, 2]\npoints = [6, 5, 5]\nknots = [[0, 0, 0, 1, 1, 2, 3, 3, 3], [-2, -1, -1, 0, 0.5, 2, 2, 3, 4], [0, 0, 0, 4, 4, 7, 7, 7]]",
        ] {
            let (worst, hits, cells) = errors(lattice);
            assert!(
                worst < 1e-12 && hits > 150 && cells == 0,
                "{lattice}: {worst:e}, {hits} hits, {cells} cells"
            );
        }
    }

    #[test]
    fn lattices_of_high_degrees_make_cells() {
        for lattice in ["degree = [5, 4, 4]\npoints = [7, 5, 5]", "basis = \"bezier\"\npoints = [9, 6, 4]"] {
            let (worst, hits, cells) = errors(lattice);
            assert!(
                worst < 1e-11 && hits > 150 && cells > 0,
                "{lattice}: {worst:e}, {hits} hits, {cells} cells"
            );
        }
    }
}
