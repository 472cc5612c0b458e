//! An object of the scene that shines.

use glam::{DVec2, DVec3};

use super::{Light, LightEnd, LightKind, LightSample, LightSettings};
use crate::math::polygon::{self, Side};
use crate::patch::Face;
use crate::shade::distribution::Discrete;
use crate::shade::parameters::{Parameter, Parameters};
use crate::trace::{SurfaceInteraction, TracedObject, surface_error};

/// Mitsuba's `area`, of a shape that is an object of the scene.
pub(super) const KIND: LightKind = LightKind {
    name: "area",
    shape: Some("object"),
    keys: &["shape", "object", "radiance"],
    surrounds: false,
    read: |source| {
        let radiance = source.emission("radiance");
        Some(Light::Object(ObjectLight { object: source.object("object")?, radiance }))
    },
};

/// An object of the scene, shining to the side from which its faces wind counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectLight {
    /// Index of the object.
    pub object: usize,
    /// Radiance emitted.
    pub radiance: DVec3,
}

impl LightSettings for ObjectLight {
    fn kind(&self) -> &'static str {
        KIND.name
    }

    fn shape(&self) -> Option<&'static str> {
        KIND.shape
    }

    fn parameters(&self) -> Parameters<'_> {
        vec![("object", Parameter::Object(self.object)), ("radiance", Parameter::Colour(self.radiance))]
    }
}

/// Greatest ratio of the area elements |∂p/∂s × ∂p/∂t| within a cell that is not divided further. The
/// weights of its samples then are at most half above their mean.
const MAX_RATIO: f64 = 1.5;

/// Most cells along a patch's side. Where an edge is collapsed the ratio is infinite in any cell
/// that touches it: with 8, an eighth of them.
const MAX_CELLS: u32 = 8;

/// In place of the index of a patch that does not shine.
const DARK: u32 = u32::MAX;

/// The surface of an object, drawn by area.
///
/// Each patch's trim is divided by a grid, cells and trim loops make convex polygons, and these
/// triangles. A triangle is drawn in proportion to its area in (s, t) times its cell's mean area
/// element, and a point of it uniformly in (s, t). So the density by s and t is the cell's mean
/// element over the sum of all, and that by area is this over the element at the point: exact, though
/// the surface's area is only nearly known. Faces that overlap in one plane are drawn once for each.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ObjectEmitter {
    radiance: Emission,
    patches: Vec<EmittingPatch>,
    /// For each of the object's patches, its index in `patches`: those with curved borders between them are drawn as one;
    /// or [`DARK`].
    of_patch: Vec<u32>,
    triangles: Vec<Triangle>,
    choice: Discrete,
}

/// The radiance of an object that shines.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Emission {
    /// All faces shine alike.
    Uniform(DVec3),
    /// The radiance of each input face; some are dark.
    ByFace(Vec<DVec3>),
}

impl Emission {
    /// The radiance of an input face.
    fn at(&self, face: u32) -> DVec3 {
        match self {
            Self::Uniform(radiance) => *radiance,
            Self::ByFace(radiances) => radiances.get(face as usize).copied().unwrap_or(DVec3::ZERO),
        }
    }

    /// Whether points of an input face are drawn.
    fn shines(&self, face: u32) -> bool {
        matches!(self, Self::Uniform(_)) || self.at(face) != DVec3::ZERO
    }
}

/// A patch with the mean area elements of its grid's cells.
#[derive(Clone, Debug, PartialEq)]
struct EmittingPatch {
    trimmed: Face,
    position_error: f64,
    /// Lowest corner of the trim.
    low: DVec2,
    /// Cells for a unit of s and t.
    scale: DVec2,
    cells: u32,
    /// Row by row along s.
    elements: Box<[f64]>,
}

/// A part of a trim in one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Triangle {
    patch: u32,
    cell: u32,
    /// The input face.
    face: u32,
    corners: [DVec2; 3],
}

impl ObjectEmitter {
    pub(super) fn new(object: &TracedObject, radiance: Emission) -> Self {
        let mut light = Self {
            radiance,
            patches: Vec::new(),
            of_patch: Vec::new(),
            triangles: Vec::new(),
            choice: Discrete::new([]),
        };
        let mut index = DARK;
        for trimmed in object.faces() {
            if trimmed.leads() {
                index = DARK;
                if trimmed.region.loops().any(|trim_loop| light.radiance.shines(trim_loop.face)) {
                    index =
                        u32::try_from(light.patches.len()).expect("an object has fewer than 2^32 patches");
                    let patch = EmittingPatch::new(trimmed);
                    patch.add_triangles(trimmed, index, &light.radiance, &mut light.triangles);
                    light.patches.push(patch);
                }
            } else if let Some(shared) = light.patches.get_mut(index as usize) {
                shared.position_error = shared.position_error.max(surface_error(trimmed));
            }
            light.of_patch.push(index);
        }
        let weight = |triangle: &Triangle| {
            let [a, b, c] = triangle.corners;
            let element = light.patches[triangle.patch as usize].elements[triangle.cell as usize];
            0.5 * (b - a).perp_dot(c - a).abs() * element
        };
        light.choice = Discrete::new(light.triangles.iter().map(weight));
        light
    }

    /// A point that shines on `from`, drawn by area; none if it faces away. `light` is this light's index.
    pub(super) fn sample(&self, from: DVec3, u: DVec2, light: usize) -> Option<LightSample> {
        let (index, rest) = self.choice.sample(u.x)?;
        let triangle = &self.triangles[index];
        let patch = &self.patches[triangle.patch as usize];
        let point = patch.trimmed.eval_whole(triangle.point(DVec2::new(rest, u.y)));
        let way = point.position - from;
        let distance = way.length();
        let direction = way / distance;
        let cross = point.dp_ds.cross(point.dp_dt);
        let facing = -cross.dot(direction);
        if facing.is_nan() || facing <= 0.0 {
            return None;
        }
        let pdf = self.pdf(patch.elements[triangle.cell as usize], distance, facing);
        (pdf > 0.0 && pdf.is_finite()).then(|| LightSample {
            direction,
            end: Some(LightEnd {
                position: point.position,
                position_error: patch.position_error,
                cos_light: facing / cross.length(),
                light: Some(light),
            }),
            weight: self.radiance.at(triangle.face) / pdf,
            pdf,
            is_delta: false,
        })
    }

    /// What the surface sends back along a ray that hit it; its back is black.
    pub(super) fn radiance(&self, hit: &SurfaceInteraction, direction: DVec3) -> DVec3 {
        if hit.normal.dot(direction) < 0.0 { self.radiance.at(hit.face) } else { DVec3::ZERO }
    }

    /// Whether an input face is part of the light.
    pub(super) fn shines(&self, face: u32) -> bool {
        self.radiance.shines(face)
    }

    /// Density of [`Self::sample`] by solid angle, for the direction of a ray that hit the object.
    pub(super) fn hit_pdf(&self, hit: &SurfaceInteraction, direction: DVec3, distance: f64) -> f64 {
        let facing = -hit.dp_ds.cross(hit.dp_dt).dot(direction) / direction.length();
        if facing.is_nan() || facing <= 0.0 || !self.shines(hit.face) {
            return 0.0;
        }
        let patch = self.patches.get(self.of_patch[hit.patch as usize] as usize);
        patch.map_or(0.0, |patch| self.pdf(patch.element(hit.st), distance, facing))
    }

    /// Density by solid angle: distance² / cos · element of the cell / (sum · element), where `facing`
    /// is the element times the cosine at the light.
    fn pdf(&self, element: f64, distance: f64, facing: f64) -> f64 {
        element * distance * distance / (self.choice.total() * facing)
    }
}

impl EmittingPatch {
    fn new(trimmed: &Face) -> Self {
        let [low, high] = trimmed.region.bounds().unwrap_or([DVec2::ZERO; 2]);
        let mut cells = 1;
        loop {
            let step = (high - low) / f64::from(cells);
            let (elements, ratio) = elements(trimmed, low, step, cells);
            if ratio <= MAX_RATIO || cells == MAX_CELLS {
                return Self {
                    trimmed: trimmed.clone(),
                    position_error: surface_error(trimmed),
                    low,
                    scale: f64::from(cells) / (high - low),
                    cells,
                    elements,
                };
            }
            cells *= 2;
        }
    }

    /// Mean area element of the cell that a point is in, or of the one next to a point outside.
    fn element(&self, st: DVec2) -> f64 {
        let last = f64::from(self.cells - 1);
        let place = ((st - self.low) * self.scale).floor().clamp(DVec2::ZERO, DVec2::splat(last));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole numbers of cells that there are; NaN is cell 0"
        )]
        let cell = place.y as usize * self.cells as usize + place.x as usize;
        self.elements[cell]
    }

    /// The parts of the trim's loops that shine, in each cell; those without area are never drawn.
    fn add_triangles(&self, trimmed: &Face, patch: u32, radiance: &Emission, triangles: &mut Vec<Triangle>) {
        let (mut part, mut kept) = (Vec::new(), Vec::new());
        for trim_loop in trimmed.region.loops().filter(|trim_loop| radiance.shines(trim_loop.face)) {
            let face = trim_loop.face;
            for cell in 0..self.cells * self.cells {
                part.clear();
                part.extend_from_slice(trimmed.region.corners(&trim_loop));
                let index = [cell % self.cells, cell / self.cells];
                for (axis, index) in index.into_iter().enumerate() {
                    let border = |n: u32| self.low[axis] + f64::from(n) / self.scale[axis];
                    // the trim reaches no farther than the outermost borders
                    if index > 0 {
                        polygon::clip(&part, axis, border(index), Side::Above, &mut kept);
                        std::mem::swap(&mut part, &mut kept);
                    }
                    if index + 1 < self.cells {
                        polygon::clip(&part, axis, border(index + 1), Side::Below, &mut kept);
                        std::mem::swap(&mut part, &mut kept);
                    }
                }
                let Some((&first, others)) = part.split_first() else { continue };
                let fan = others.windows(2).map(|edge| [first, edge[0], edge[1]]);
                triangles.extend(fan.map(|corners| Triangle { patch, cell, face, corners }));
            }
        }
    }
}

impl Triangle {
    /// The point of uniform `u` in `[0, 1)²`; uniform by area.
    fn point(&self, u: DVec2) -> DVec2 {
        let [a, b, c] = self.corners;
        let root = u.x.sqrt();
        a + root * ((b - a) + u.y * (c - b))
    }
}

/// Mean area elements of the cells of a grid, and the greatest ratio within one that the trim reaches.
fn elements(trimmed: &Face, low: DVec2, step: DVec2, cells: u32) -> (Box<[f64]>, f64) {
    let mut worst: f64 = 1.0;
    let cell = |cell: u32| {
        let corner = low + step * DVec2::new((cell % cells).into(), (cell / cells).into());
        let (mut sum, mut least, mut greatest) = (0.0, f64::INFINITY, 0.0_f64);
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let point = trimmed.eval_whole(corner + 0.5 * step * DVec2::new(f64::from(i), f64::from(j)));
            let element = point.dp_ds.cross(point.dp_dt).length();
            (sum, least, greatest) = (sum + element, least.min(element), greatest.max(element));
        }
        if greatest > MAX_RATIO * least && (cells == 1 || trimmed.region.reaches(corner, corner + step)) {
            worst = worst.max(greatest / least);
        }
        sum / 9.0
    };
    ((0..cells * cells).map(cell).collect(), worst)
}
