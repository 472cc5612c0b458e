//! The figures of a comparison, as report.json has them.

use serde::Serialize;

use super::{Bytes, MethodResult, Seconds, SilhouetteError};
use crate::deviation::Deviation;
use crate::difference::{Angles, Comparison, Metric};
use crate::model::Representation;

/// Greatest deviations, in parts of the diagonal, for which the level of subdivision is told that it takes.
const DEVIATIONS: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

/// The same of silhouettes, in pixels.
const PIXELS: [f64; 3] = [1.0, 0.1, 0.01];

/// One scene by several methods.
#[derive(Clone, Debug, Serialize)]
pub struct SceneFigures {
    /// The scene file's name without its folder.
    pub scene: String,
    /// Width and height of the pictures.
    pub size: [u32; 2],
    /// Samples of each pixel.
    pub spp: u32,
    /// The exact one first.
    pub methods: Vec<MethodFigures>,
    /// What it takes pointwise.
    pub needed: Vec<Needed>,
}

/// What a method gave.
#[derive(Clone, Debug, Serialize)]
pub struct MethodFigures {
    /// The method as scene files name it.
    pub method: String,
    /// Whether it is the exact one again, with other random numbers: what differs then is noise.
    pub noise: bool,
    /// Flat triangles that the deformed objects are made of; of exact patches the input's.
    pub triangles: usize,
    /// Patches of the deformed objects.
    pub patches: usize,
    /// Distances from the exact shape in parts of its diagonal; null if they are not certain.
    pub deviation: Option<Deviation>,
    /// Why there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deviation_error: Option<String>,
    /// Silhouettes, in pixels; null if only one of the pictures has any.
    pub silhouette: Option<SilhouetteError>,
    /// The picture against the exact one's; null of the exact one.
    pub image: Option<ImageFigures>,
    /// Seconds to build and render.
    pub seconds: f64,
    /// The parts of these, and what measuring took.
    pub seconds_of: Seconds,
    /// Bytes of geometry and acceleration structure, as traced here.
    pub bytes: usize,
    /// The parts of these, and what a plain file of it would take.
    pub bytes_of: Bytes,
    /// The method's parameter, for plots.
    #[serde(skip)]
    pub kind: Representation,
}

/// Two pictures.
#[derive(Clone, Debug, Serialize)]
pub struct ImageFigures {
    /// The mean absolute error of the colours.
    pub mean_error: f64,
    /// The root of the mean squared error.
    pub rms_error: f64,
    /// The greatest error.
    pub max_error: f64,
    /// Peak signal-to-noise ratio with peak 1, in decibels; null of equal pictures.
    pub psnr: f64,
    /// Mean squared error in parts of the squared reference.
    pub relmse: f64,
    /// Structural similarity.
    pub ssim: f64,
    /// LDR-FLIP.
    pub flip: f64,
    /// HDR-FLIP.
    pub hdrflip: f64,
    /// Between the shading normals of the pixels, in degrees.
    pub normal_degrees: Option<Angles>,
    /// The share of pixels that show the same object.
    pub same_object: f64,
}

/// How fine pointwise deformation must be.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Needed {
    /// `deviation`, in parts of the diagonal, or `silhouette`, in pixels.
    pub quantity: &'static str,
    /// What the greatest error must be below.
    pub below: f64,
    /// The level.
    pub level: u32,
    /// Triangles at that level.
    pub triangles: f64,
    /// Whether that is concluded from the finest level measured, an error falling by four with each.
    pub extrapolated: bool,
}

/// The metrics that figures need.
pub const METRICS: [Metric; 4] = [Metric::Flip, Metric::HdrFlip, Metric::Ssim, Metric::RelMse];

impl MethodFigures {
    /// The figures of a result and of its picture's comparison with the exact one by [`METRICS`].
    #[must_use]
    pub fn new(result: &MethodResult, comparison: Option<&Comparison>) -> Self {
        Self {
            method: result.method.to_string(),
            noise: result.noise,
            triangles: result.triangles,
            patches: result.patches,
            deviation: result.deviation.as_ref().ok().copied(),
            deviation_error: result.deviation.as_ref().err().map(ToString::to_string),
            silhouette: result.silhouette,
            image: comparison.map(ImageFigures::from_comparison),
            seconds: result.seconds.build + result.seconds.render,
            seconds_of: result.seconds,
            bytes: result.bytes.geometry + result.bytes.acceleration,
            bytes_of: result.bytes,
            kind: result.method,
        }
    }
}

impl ImageFigures {
    fn from_comparison(comparison: &Comparison) -> Self {
        let layer = |name: &str| comparison.layers.iter().find(|layer| layer.name == name);
        let figures = layer("color").map_or(&comparison.figures, |colours| &colours.figures);
        let metric = |metric: Metric| {
            let found = comparison.metrics.iter().find(|measured| measured.name == metric.name());
            found.map_or(f64::NAN, |measured| measured.mean)
        };
        Self {
            mean_error: figures.mean_error(),
            rms_error: figures.rms_error(),
            max_error: figures.max_error,
            psnr: figures.psnr(),
            relmse: metric(Metric::RelMse),
            ssim: metric(Metric::Ssim),
            flip: metric(Metric::Flip),
            hdrflip: metric(Metric::HdrFlip),
            normal_degrees: layer("normal").and_then(|normals| normals.angles),
            same_object: layer("object").map_or(1.0, |objects| objects.figures.equal_share()),
        }
    }
}

/// The levels of pointwise deformation that errors below some bounds take.
#[must_use]
pub fn needed(methods: &[MethodFigures]) -> Vec<Needed> {
    let levels: Vec<(u32, &MethodFigures)> =
        methods.iter().filter_map(|method| Some((method.kind.level()?, method))).collect();
    let deviation = |method: &MethodFigures| method.deviation.map(|deviation| deviation.bound);
    let silhouette = |method: &MethodFigures| method.silhouette.map(|silhouette| silhouette.max);
    let of_deviation = DEVIATIONS.iter().map(|&below| needed_level(&levels, ("deviation", below), deviation));
    let of_silhouette = PIXELS.iter().map(|&below| needed_level(&levels, ("silhouette", below), silhouette));
    of_deviation.chain(of_silhouette).flatten().collect()
}

fn needed_level(
    levels: &[(u32, &MethodFigures)],
    (quantity, below): (&'static str, f64),
    error: impl Fn(&MethodFigures) -> Option<f64>,
) -> Option<Needed> {
    let needed =
        |level: u32, triangles: f64, extrapolated| Needed { quantity, below, level, triangles, extrapolated };
    if let Some((level, method)) = levels.iter().find(|(_, method)| error(method).is_some_and(|e| e < below))
    {
        return Some(needed(*level, method.triangles as f64, false));
    }
    let (finest, method) = levels.last()?;
    let left = error(method)?;
    let mut more = 1;
    while left * 0.25_f64.powi(more) >= below {
        more += 1;
    }
    Some(needed(finest + more.unsigned_abs(), method.triangles as f64 * 4_f64.powi(more), true))
}
