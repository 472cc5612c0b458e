//! One patch: its evaluation, and rays that hit it.

use std::hint::black_box;

use glam::{DVec2, DVec3};
use serde_json::json;
use trimray::patch::BezierPatch;
use trimray::spline::{Axis, ControlLattice, SplineVolume};
use trimray::subdivide::FrameChoice::{self, Parallelogram, Rectangle};
use trimray::trace::TracedScene;

use crate::Arguments;
use crate::common::objects::Object;
use crate::common::rays::random_sets;
use crate::common::timing::{closest_rate, least_seconds, trace_single};
use crate::report::{Report, by, per_ray_json, per_ray_text};

/// Evaluations per timed batch; their parameters stay in the first-level cache.
const EVALUATIONS: usize = 1024;

/// Batches per figure.
const BATCHES: usize = 300;

/// Rays that hit a patch, at most.
const RAYS: usize = 1 << 13;

/// Square of a plane in the unit cube.
#[derive(Clone, Copy)]
enum Plane {
    /// Along two axes: patches of degree k × k.
    Aligned,
    /// Along one axis: k × 2k.
    AlongOne,
    /// In general position: 2k × 2k in a parallelogram, 2k × 3k in a rectangle.
    General,
}

impl Plane {
    fn corners(self) -> [DVec3; 4] {
        let (across, along) = match self {
            Self::Aligned => (DVec3::Y, DVec3::Z),
            Self::AlongOne => (DVec3::new(0.8, 0.6, 0.0), DVec3::Z),
            Self::General => {
                let normal = DVec3::new(1.0, 2.0, 3.0).normalize();
                let across = normal.cross(DVec3::X).normalize();
                (across, normal.cross(across))
            }
        };
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, y]| DVec3::splat(0.5) + 0.35 * (x * across + y * along))
    }
}

/// A patch's degree, that of the volume it is made by, and how.
const KINDS: [([usize; 2], usize, Plane, FrameChoice); 11] = [
    ([1, 1], 1, Plane::Aligned, Parallelogram),
    ([2, 2], 2, Plane::Aligned, Parallelogram),
    ([2, 4], 2, Plane::AlongOne, Parallelogram),
    ([3, 3], 3, Plane::Aligned, Parallelogram),
    ([3, 6], 3, Plane::AlongOne, Parallelogram),
    ([4, 4], 2, Plane::General, Parallelogram),
    ([4, 6], 2, Plane::General, Rectangle),
    ([6, 6], 3, Plane::General, Parallelogram),
    ([6, 9], 3, Plane::General, Rectangle),
    ([8, 8], 4, Plane::General, Parallelogram),
    ([8, 12], 4, Plane::General, Rectangle),
];

/// The patch of every kind, not rational and rational, as an object and as a scene.
fn single_patches() -> Result<Vec<(Object, TracedScene)>, String> {
    let mut made = Vec::new();
    for (degree, volume_degree, plane, frame) in KINDS {
        for rational in [false, true] {
            let mesh = (plane.corners().to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
            let volume = bent_volume(volume_degree, rational)?;
            let mut object = Object::new("patch", String::new(), mesh, volume);
            object.frame = frame;
            let scene = object.build()?.scene;
            let [only] = scene.objects()[0].faces() else {
                return Err(format!("more than one patch for degree {degree:?}"));
            };
            let mut got = only.patch.degree();
            got.sort_unstable();
            if got != degree || only.patch.is_rational() != rational {
                return Err(format!("a patch of degree {got:?} for {degree:?}"));
            }
            made.push((object, scene));
        }
    }
    Ok(made)
}

/// One knot box, bent as much as a part of a finer lattice would be.
fn bent_volume(degree: usize, rational: bool) -> Result<SplineVolume, String> {
    let mut lattice = ControlLattice::identity([degree; 3], [degree + 1; 3], [DVec3::ZERO, DVec3::ONE], 0)
        .map_err(|error| error.to_string())?;
    lattice.twist(Axis::Z, 45.0);
    lattice.bulge(Axis::Z, 0.2);
    for flat in 0..lattice.points().len() {
        if rational {
            let index = lattice.index_of(flat);
            let weight = 1.0 + 0.5 * (flat % 3) as f64;
            lattice.set_weight(index, weight).map_err(|error| error.to_string())?;
        }
    }
    lattice.volume().map_err(|error| error.to_string())
}

fn the_patch(scene: &TracedScene) -> &BezierPatch {
    &scene.objects()[0].faces()[0].patch
}

/// Nanoseconds of a point with both partials.
pub(crate) fn evaluation(arguments: &Arguments, report: Report) -> Result<(), String> {
    report.heading(
        "evaluation: BezierPatch::eval, ns each",
        "degree    rational   independent  one after another",
    );
    let batches = if arguments.quick { BATCHES / 10 } else { BATCHES };
    for (_, scene) in single_patches()? {
        let patch = the_patch(&scene);
        let (independent, dependent) = evaluation_times(patch, batches);
        let [degree, rational] = [by(&patch.degree()), patch.is_rational().to_string()];
        report.row(
            &json!({
                "bench": "evaluation", "degree": patch.degree(), "rational": patch.is_rational(),
                "independent_nanoseconds": independent, "dependent_nanoseconds": dependent,
            }),
            &format!("{degree:<9} {rational:<9} {independent:>12.1} {dependent:>18.1}"),
        );
    }
    Ok(())
}

/// Nanoseconds of an evaluation: independent ones, and each waiting for the one before.
fn evaluation_times(patch: &BezierPatch, batches: usize) -> (f64, f64) {
    // the fractional parts of multiples of two irrational numbers
    let places: Vec<_> =
        (1..=EVALUATIONS).map(|i| (DVec2::new(0.618_034, 0.414_214) * i as f64).fract()).collect();
    let independent = least_seconds(batches, || {
        for &st in &places {
            black_box(black_box(patch).eval(black_box(st)));
        }
    });
    let dependent = least_seconds(batches, || {
        let mut carry = 0.0;
        for &st in &places {
            let point = black_box(patch).eval(st + carry);
            // below rounding, but the next parameters need it
            carry = 1e-300 * (point.position.x + point.dp_ds.y + point.dp_dt.z);
        }
        black_box(carry);
    });
    (independent * 1e9 / EVALUATIONS as f64, dependent * 1e9 / EVALUATIONS as f64)
}

/// Nanoseconds of a ray that hits a scene of one patch.
pub(crate) fn patch(arguments: &Arguments, report: Report) -> Result<(), String> {
    report.heading(
        "patch: random rays that hit a scene of one patch, ns each",
        "degree    rational   leaves   nearest hit  interaction   per ray",
    );
    for (object, scene) in single_patches()? {
        let [_, hitting] =
            random_sets(&object.subject, &scene, if arguments.quick { RAYS / 8 } else { RAYS });
        let rays = &hitting.rays;
        let nanoseconds = 1e9 / closest_rate(&scene, rays, arguments.rounds(), trace_single);
        let mut tracer = scene.tracer();
        let hits: Vec<_> = rays.iter().filter_map(|ray| tracer.closest(&ray.ray())).collect();
        let counted = tracer.statistics();
        let interaction = least_seconds(arguments.rounds(), || {
            for hit in &hits {
                black_box(scene.interaction(hit));
            }
        }) * 1e9
            / hits.len() as f64;
        let patch = the_patch(&scene);
        let leaves = scene.acceleration().leaves;
        let [degree, rational] = [by(&patch.degree()), patch.is_rational().to_string()];
        report.row(
            &json!({
                "bench": "patch", "degree": patch.degree(), "rational": patch.is_rational(), "leaves": leaves,
                "rays": rays.len(), "nanoseconds": nanoseconds, "interaction_nanoseconds": interaction,
                "per_ray": per_ray_json(&counted),
            }),
            &format!(
                "{degree:<9} {rational:<9} {leaves:>7} {nanoseconds:>13.0} {interaction:>12.1}   {}",
                per_ray_text(&counted)
            ),
        );
    }
    Ok(())
}
