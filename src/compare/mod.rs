//! Beside the pipeline: a scene by several methods, and how far each is from the exact one.

mod figures;
mod measure;
mod silhouette;

use serde::Serialize;

use crate::deviation::{Deviation, DeviationError};
use crate::film::Image;
use crate::model::Representation;
use crate::scene::BuiltScene;

pub use figures::{ImageFigures, METRICS, MethodFigures, Needed, SceneFigures, needed};
pub use measure::{CompareError, CompareSettings, Made, measure};
pub use silhouette::{Silhouette, SilhouetteError};

/// What a method made of a scene, beside the exact one. Lengths are in parts of each object's diagonal.
#[derive(Clone, Debug)]
pub struct MethodResult {
    /// The method of the deformed objects; the others are as they are.
    pub method: Representation,
    /// Whether it is the exact one again, with other random numbers.
    pub noise: bool,
    /// The picture, with the layers `normal` and `object`.
    pub image: Image,
    /// Flat triangles that the deformed objects are made of; of exact patches the input's.
    pub triangles: usize,
    /// Patches of the deformed objects.
    pub patches: usize,
    /// How far they are from the exact shape; why that is not known, if it is not.
    pub deviation: Result<Deviation, DeviationError>,
    /// Silhouettes against the exact picture's; none if only one picture has any.
    pub silhouette: Option<SilhouetteError>,
    /// Time.
    pub seconds: Seconds,
    /// Memory.
    pub bytes: Bytes,
}

/// Seconds of work on all threads asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// Reading, deforming, and the acceleration structure.
    pub build: f64,
    /// The picture.
    pub render: f64,
    /// Measuring the deviation, which no picture needs.
    pub deviation: f64,
}

/// Memory in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Bytes {
    /// Bytes of all objects as they are traced here.
    pub geometry: usize,
    /// Bytes of the acceleration structure.
    pub acceleration: usize,
    /// Bytes of the deformed objects as an indexed mesh would be: 12 for each triangle, 12 for each vertex; of exact patches 24 for
    /// each coordinate triple of a control point and the trims.
    pub plain: usize,
}

impl Bytes {
    fn used_by(built: &BuiltScene, deformed: &[usize], is_exact: bool) -> Self {
        let objects = built.traced.objects();
        let geometry = objects.iter().map(|object| object.shell.bytes()).sum();
        let patches = deformed.iter().flat_map(|&index| objects[index].faces());
        let plain = patches.map(|patch| match is_exact {
            true => patch.patch.control_points().len() * 24 + patch.region.all_corners().len() * 16,
            // a mesh has half as many vertices as triangles
            false => 12 + 6,
        });
        Self { geometry, acceleration: built.traced.acceleration().bytes, plain: plain.sum() }
    }
}
