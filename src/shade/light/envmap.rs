//! A picture that surrounds the scene.

use std::f64::consts::{FRAC_1_PI, PI, TAU};
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec2, DVec3};
use thiserror::Error;

use super::{Light, LightKind, LightSample, LightSettings};
use crate::film::{Picture, PictureError, PictureLimits, read_picture_within};
use crate::math::linear::similarity_scale;
use crate::shade::distribution::Bilinear;
use crate::shade::parameters::{Parameter, ParameterSource, Parameters, PictureSource};

/// Mitsuba's `envmap`.
pub(super) const KIND: LightKind = LightKind {
    name: "envmap",
    shape: None,
    keys: &["file", "scale", "to_world"],
    surrounds: true,
    read: |source| EnvironmentLight::read(source).map(Light::Envmap),
};

/// A picture around the scene: longitude along its rows, +y of `to_world` above the first one.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentLight {
    /// Radiance before it is scaled.
    pub picture: PictureSource,
    /// Factor of the radiance.
    pub scale: f64,
    /// Turns the picture, and may mirror it; nothing else.
    pub to_world: DAffine3,
}

/// Why the picture of an environment map cannot be used.
#[derive(Debug, Error)]
pub enum EnvironmentError {
    /// It cannot be read.
    #[error("file {0}")]
    Picture(#[from] PictureError),
    /// One of its numbers is not finite.
    #[error("file {}: the pixel in column {column} of row {row} is not finite", path.display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// The pixel's column, from 0.
        column: usize,
        /// The pixel's row, from 0.
        row: usize,
    },
}

impl EnvironmentLight {
    fn read(source: &dyn ParameterSource) -> Option<Self> {
        let file = source.file("file", "the path of a picture (.exr, .hdr), from the scene file's folder");
        let scale = source.number("scale", "a number, at least 0", &|scale| scale >= 0.0);
        let to_world = source.placement("to_world");
        if to_world.is_some_and(|place| !turns(&place.matrix3)) {
            let message = "to_world of an envmap turns it: steps that scale have no meaning";
            source.report_value("to_world", message.to_owned());
        }
        let picture = PictureSource::File(file?);
        Some(Self { picture, scale: scale.unwrap_or(1.0), to_world: to_world? })
    }

    /// The same light, its picture read if it is a file.
    ///
    /// # Errors
    /// If the file cannot be read or its picture is larger than allowed, or a pixel is not finite.
    pub fn with_picture(&self, limits: PictureLimits) -> Result<Self, EnvironmentError> {
        let PictureSource::File(path) = &self.picture else { return Ok(self.clone()) };
        let picture = read_picture_within(path, false, limits)?;
        match picture.pixels.iter().position(|pixel| !pixel.iter().all(|value| value.is_finite())) {
            None => Ok(Self { picture: PictureSource::Read(Arc::new(picture)), ..self.clone() }),
            Some(index) => {
                let width = picture.size[0] as usize;
                let (column, row) = (index % width, index / width);
                Err(EnvironmentError::NotFinite { path: path.clone(), column, row })
            }
        }
    }
}

impl LightSettings for EnvironmentLight {
    fn kind(&self) -> &'static str {
        KIND.name
    }

    fn parameters(&self) -> Parameters<'_> {
        vec![
            ("file", Parameter::Picture(&self.picture)),
            ("scale", Parameter::Number(self.scale)),
            ("to_world", Parameter::Placement(self.to_world)),
        ]
    }

    /// Mitsuba calls the file otherwise, and must not have a translation.
    fn mitsuba_parameters(&self) -> Parameters<'_> {
        vec![
            ("filename", Parameter::Picture(&self.picture)),
            ("scale", Parameter::Number(self.scale)),
            ("to_world", Parameter::Placement(DAffine3::from_mat3(self.to_world.matrix3))),
        ]
    }
}

/// Whether a map only turns and mirrors.
fn turns(map: &DMat3) -> bool {
    similarity_scale(map).is_some_and(|scale| (scale - 1.0).abs() < 1e-9)
}

/// Mitsuba's `envmap`: longitude along the rows, latitude down the columns.
///
/// In the light's own axes +y is up, the picture's middle is towards +z and the columns go on towards
/// -x. The first row is the pole +y, the last one -y; columns are seen from their middles, and the
/// last one is followed by the first. The radiance is bilinear between.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct EnvironmentMap {
    picture: Arc<Picture>,
    scale: f64,
    /// An orthogonal matrix: its transpose is its inverse.
    to_world: DMat3,
    /// Density over (longitude, latitude) in `[0, 1)²`, longitude from the middle of the first column:
    /// luminance times the sine of the polar angle, between rows and columns bilinear.
    density: Bilinear,
}

impl EnvironmentMap {
    /// None if `to_world` does more than turn and mirror, or a pixel is not finite.
    pub(super) fn try_new(picture: &Arc<Picture>, scale: f64, to_world: &DAffine3) -> Option<Self> {
        let to_world = to_world.matrix3;
        let finite = picture.pixels.iter().flatten().all(|value| value.is_finite());
        if !(turns(&to_world) && finite && scale.is_finite()) {
            return None;
        }
        let picture = padded(picture);
        let density = Bilinear::new(luminance_times_sine(&picture), grid(&picture));
        Some(Self { picture, scale, to_world, density })
    }

    /// A direction from which the light comes.
    pub(super) fn sample(&self, u: DVec2) -> Option<LightSample> {
        let (place, density) = self.density.sample(u)?;
        let (sin_polar, cos_polar) = libm::sincos(PI * place.y);
        let [width, _] = self.picture.size;
        let (sin_turn, cos_turn) = libm::sincos(TAU * (place.x + 0.5 / f64::from(width)));
        let local = DVec3::new(sin_turn * sin_polar, cos_polar, -cos_turn * sin_polar);
        let pdf = by_solid_angle(density, sin_polar);
        (pdf > 0.0 && pdf.is_finite()).then(|| LightSample {
            direction: (self.to_world * local).normalize(),
            end: None,
            weight: self.lookup(place) / pdf,
            pdf,
            is_delta: false,
        })
    }

    /// What comes from a direction of any length.
    pub(super) fn radiance(&self, direction: DVec3) -> DVec3 {
        self.lookup(self.place(direction).0)
    }

    /// Density of [`Self::sample`] by solid angle.
    pub(super) fn pdf(&self, direction: DVec3) -> f64 {
        let (place, sin_polar) = self.place(direction);
        by_solid_angle(self.density.pdf(place), sin_polar)
    }

    /// Longitude and latitude of a direction as the density has them, and the sine of its polar angle.
    fn place(&self, direction: DVec3) -> (DVec2, f64) {
        let local = self.to_world.transpose() * direction;
        let across = libm::hypot(local.x, local.z);
        let turn = libm::atan2(local.x, -local.z) / TAU - 0.5 / f64::from(self.picture.size[0]);
        let polar = FRAC_1_PI * libm::atan2(across, local.y);
        (DVec2::new(turn - turn.floor(), polar), across / local.length())
    }

    /// The picture at a longitude and latitude.
    fn lookup(&self, place: DVec2) -> DVec3 {
        let [width, height] = self.picture.size;
        let column = place.x * f64::from(width);
        let row = place.y * f64::from(height - 1);
        let (left, upper) = (column.floor(), row.floor().min(f64::from(height - 2)));
        let (x, y) = (column - left, row - upper);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole numbers of pixels that there are, up to the modulus; NaN becomes 0"
        )]
        let (left, upper) = (left as usize % width as usize, upper as usize);
        let right = (left + 1) % width as usize;
        let pixel = |x: usize, y: usize| {
            let [red, green, blue] = self.picture.pixels[y * width as usize + x];
            DVec3::new(red.into(), green.into(), blue.into())
        };
        let along = |y: usize| (1.0 - x) * pixel(left, y) + x * pixel(right, y);
        self.scale * ((1.0 - y) * along(upper) + y * along(upper + 1))
    }
}

/// Density by solid angle of one over the unit square of longitude and latitude: dω = sin θ · 2π · π.
fn by_solid_angle(density: f64, sin_polar: f64) -> f64 {
    density / (2.0 * PI * PI * sin_polar.max(f64::EPSILON))
}

/// The picture with at least 2 columns and 3 rows, the last ones repeated, as Mitsuba does.
fn padded(picture: &Arc<Picture>) -> Arc<Picture> {
    let [width, height] = picture.size;
    let size = [width.max(2), height.max(3)];
    if size == picture.size {
        return Arc::clone(picture);
    }
    let index = |x: u32, y: u32| y.min(height - 1) as usize * width as usize + x.min(width - 1) as usize;
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    let pixels = pixels.map(|(x, y)| picture.pixels[index(x, y)]).collect();
    Arc::new(Picture { size, pixels })
}

/// Points of the density's grid: the first column once more after the last.
fn grid(picture: &Picture) -> [usize; 2] {
    [picture.size[0] as usize + 1, picture.size[1] as usize]
}

fn luminance_times_sine(picture: &Picture) -> Vec<f32> {
    let [columns, rows] = grid(picture);
    let width = columns - 1;
    let mut values = Vec::with_capacity(columns * rows);
    for (y, row) in picture.pixels.chunks_exact(width).enumerate() {
        let pole = y == 0 || y == rows - 1;
        let sine = if pole { 0.0 } else { libm::sin(PI * y as f64 / (rows - 1) as f64) };
        for x in 0..columns {
            let luminance = luminance(row[x % width]).max(0.0) * sine;
            #[expect(clippy::cast_possible_truncation, reason = "the density is kept in single precision")]
            values.push(luminance.min(f64::from(f32::MAX)) as f32);
        }
    }
    values
}

/// Luminance of a linear Rec. 709 colour, with the factors of Mitsuba.
fn luminance([red, green, blue]: [f32; 3]) -> f64 {
    0.212_671 * f64::from(red) + 0.715_160 * f64::from(green) + 0.072_169 * f64::from(blue)
}
