//! Statistics as `--stats` prints them, and the sample of rays of `info`.

use std::fmt::Write;

use glam::{DVec2, DVec3};
use serde::Serialize;

use trimray::scene::{BuiltScene, SceneDescription};
use trimray::shade::{RenderStatistics, Sampler, uniform_sphere};
use trimray::trace::{AccelerationStatistics, Ray, TraceStatistics};

use super::{CliError, checked_camera};

/// The sample's rays are one for each cell of a square grid of this many cells a side.
const SAMPLE_SIDE: u32 = 64;

/// Boxes that clipping may examine for the sample; then it ends, for a smaller one shows as well what rays cost.
const MAX_BOXES: u64 = 1 << 17;

/// The acceleration structure and what it cost.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Acceleration {
    #[serde(flatten)]
    structure: AccelerationStatistics,
    seconds: f64,
}

impl Acceleration {
    pub(super) fn new(built: &BuiltScene) -> Self {
        Self { structure: built.traced.acceleration(), seconds: built.times.build.as_secs_f64() }
    }

    pub(super) fn bytes(&self) -> usize {
        self.structure.bytes
    }
}

impl std::fmt::Display for Acceleration {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let AccelerationStatistics { leaves, leaves_inside, leaves_crossed, nodes, bytes } = self.structure;
        let seconds = self.seconds;
        write!(
            formatter,
            "{leaves} leaves ({leaves_inside} inside the trim, {leaves_crossed} across its border), {nodes} nodes, \
             {bytes} bytes, built in {seconds:.4} s"
        )
    }
}

/// Prints what tracing counted to stderr.
pub(super) fn print_trace(statistics: &TraceStatistics, acceleration: &Acceleration) {
    eprint!("{}", table(&[], statistics, acceleration));
}

/// Prints what rendering counted to stderr.
pub(super) fn print_render(statistics: &RenderStatistics, acceleration: &Acceleration) {
    let RenderStatistics { rays, shadow_rays, samples, non_finite_samples, trace } = statistics;
    let rendering = [
        ("samples", *samples),
        ("non_finite_samples", *non_finite_samples),
        ("nearest_hit_rays", *rays),
        ("shadow_rays", *shadow_rays),
    ];
    eprint!("{}", table(&rendering, trace, acceleration));
}

fn table(rendering: &[(&str, u64)], trace: &TraceStatistics, acceleration: &Acceleration) -> String {
    let mut text = format!("{:<20}{:>16}{:>14}\n", "statistics", "total", "per ray");
    // writing to a string cannot fail
    for &(name, count) in rendering {
        let _ = writeln!(text, "  {:<18}{count:>16}", readable(name));
    }
    let _ = writeln!(text, "  {:<18}{:>16}", "rays", trace.rays);
    for ((name, count), (_, per_ray)) in
        trace.counts().filter(|(name, _)| *name != "rays").zip(trace.per_ray())
    {
        let _ = writeln!(text, "  {:<18}{count:>16}{per_ray:>14.6}", readable(name));
    }
    let _ = writeln!(text, "acceleration        {acceleration}");
    text
}

/// A counter's name as words.
pub(super) fn readable(name: &str) -> String {
    name.replace('_', " ")
}

/// What a fixed sample of rays met, the same on every run.
#[derive(Debug, Serialize)]
pub(super) struct Sample {
    /// Where the rays come from: "camera" or "lines".
    pub(super) from: &'static str,
    pub(super) rays: u64,
    pub(super) hits: usize,
    #[serde(serialize_with = "as_map")]
    pub(super) per_ray: Vec<(&'static str, f64)>,
}

/// As a JSON object, in the order of the counters.
fn as_map<S: serde::Serializer>(pairs: &[(&'static str, f64)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pairs.iter().copied())
}

impl Sample {
    /// Traces rays of the scene's camera or, if it names none, random lines that meet the sphere around its objects.
    pub(super) fn trace(scene: &SceneDescription, built: &BuiltScene) -> Result<Self, CliError> {
        let (from, mut rays) = match &scene.camera {
            Some(camera) => {
                let camera = checked_camera(camera, &scene.film)?;
                let size = DVec2::new(scene.film.size[0].into(), scene.film.size[1].into());
                let middle = |[x, y]: [u32; 2]| {
                    let cell = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    camera.ray(cell / f64::from(SAMPLE_SIDE) * size, DVec2::splat(0.5))
                };
                ("camera", sample_cells().map(middle).collect::<Vec<_>>())
            }
            None => ("lines", lines_through(built.traced.bounds())),
        };
        // a scene as large as the numbers go has no sphere around it
        rays.retain(Ray::is_traceable);
        let mut tracer = built.traced.tracer();
        let mut hits = 0;
        for ray in &rays {
            hits += usize::from(tracer.closest(ray).is_some());
            if tracer.statistics().boxes > MAX_BOXES {
                break;
            }
        }
        let counted = tracer.statistics();
        Ok(Self { from, rays: counted.rays, hits, per_ray: counted.per_ray().collect() })
    }
}

fn sample_cells() -> impl Iterator<Item = [u32; 2]> {
    (0..SAMPLE_SIDE * SAMPLE_SIDE).map(|cell| [cell % SAMPLE_SIDE, cell / SAMPLE_SIDE])
}

/// Rays through two random points of the sphere around a box: uniform among the lines that meet it.
fn lines_through([low, high]: [DVec3; 2]) -> Vec<Ray> {
    let (centre, radius) = (0.5 * (low + high), (0.5 * (high - low).length()).max(f64::MIN_POSITIVE));
    let line = |cell| {
        let mut sampler = Sampler::new(0, cell, 0);
        let [from, to] = [(); 2].map(|()| uniform_sphere(sampler.next_2d()));
        Ray::new(centre + radius * from, (to - from).normalize_or(DVec3::Z))
    };
    sample_cells().map(line).collect()
}
