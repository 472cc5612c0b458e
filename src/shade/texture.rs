//! Colours and numbers that vary over a surface.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine2, DVec2, DVec3};

use crate::choice::Choice;
use crate::film::{Picture, PictureError, PictureLimits, read_channel_within, read_picture_within};

/// A colour or number as the scene file gives it; linear RGB, or three times the same number.
#[derive(Clone, Debug, PartialEq)]
pub enum TextureSource {
    /// The same everywhere.
    Uniform(DVec3),
    /// A picture, as Mitsuba's `bitmap`.
    Bitmap(BitmapSource),
    /// A board of two colours, as Mitsuba's `checkerboard`.
    Checkerboard(Checkerboard),
}

impl From<DVec3> for TextureSource {
    fn from(colour: DVec3) -> Self {
        Self::Uniform(colour)
    }
}

impl From<f64> for TextureSource {
    fn from(number: f64) -> Self {
        Self::Uniform(DVec3::splat(number))
    }
}

impl TextureSource {
    /// Whether it is not the same everywhere.
    #[must_use]
    pub const fn varies(&self) -> bool {
        !matches!(self, Self::Uniform(_))
    }

    /// Whether it is 0 everywhere.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        *self == Self::Uniform(DVec3::ZERO)
    }
}

/// A picture over texture coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct BitmapSource {
    /// The file.
    pub path: PathBuf,
    /// The one channel that is taken as a number, by its full name; without, the colours.
    pub channel: Option<String>,
    /// Between pixels.
    pub filter: TextureFilter,
    /// Outside of the unit square.
    pub wrap: TextureWrap,
    /// Whether the numbers are taken as they are, without conversion from sRGB.
    pub raw: bool,
    /// Applied to texture coordinates first, with v downwards.
    pub to_uv: DAffine2,
}

impl BitmapSource {
    /// The colours of a picture, repeated, as they are where nothing else is asked for.
    #[must_use]
    pub fn new(path: PathBuf) -> Self {
        Self {
            path,
            channel: None,
            filter: TextureFilter::default(),
            wrap: TextureWrap::default(),
            raw: false,
            to_uv: DAffine2::IDENTITY,
        }
    }
}

/// What a texture is between the centres of its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum TextureFilter {
    /// Linear in both directions.
    #[default]
    Bilinear,
    /// As at the nearest centre.
    Nearest,
}

impl Choice for TextureFilter {
    const WHAT: &'static str = "texture filter";
    const ALL: &'static [Self] = &[Self::Bilinear, Self::Nearest];

    fn name(self) -> &'static str {
        match self {
            Self::Bilinear => "bilinear",
            Self::Nearest => "nearest",
        }
    }
}

/// What a texture is outside its square.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum TextureWrap {
    /// The same again.
    #[default]
    Repeat,
    /// Again, every other time mirrored.
    Mirror,
    /// As at the nearest border.
    Clamp,
}

impl Choice for TextureWrap {
    const WHAT: &'static str = "wrap";
    const ALL: &'static [Self] = &[Self::Repeat, Self::Mirror, Self::Clamp];

    fn name(self) -> &'static str {
        match self {
            Self::Repeat => "repeat",
            Self::Mirror => "mirror",
            Self::Clamp => "clamp",
        }
    }
}

impl TextureWrap {
    /// The pixel that stands at `index` in a row or column of `count`.
    fn wrap(self, index: f64, count: u32) -> usize {
        let n = f64::from(count);
        let wrapped = match self {
            Self::Repeat => index.rem_euclid(n),
            Self::Mirror => {
                let place = index.rem_euclid(2.0 * n);
                if place < n { place } else { 2.0 * n - 1.0 - place }
            }
            Self::Clamp => index,
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the pixels")]
        let index = wrapped.clamp(0.0, n - 1.0) as usize;
        index
    }
}

/// A board of two colours, each square half a unit of the texture coordinates wide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checkerboard {
    /// The colours; the first one is at the square's corners (0, 1) and (0.5, 0.5).
    pub colours: [DVec3; 2],
    /// Applied to texture coordinates first, with v downwards.
    pub to_uv: DAffine2,
}

impl Default for Checkerboard {
    fn default() -> Self {
        Self { colours: [DVec3::splat(0.4), DVec3::splat(0.2)], to_uv: DAffine2::IDENTITY }
    }
}

impl Checkerboard {
    /// Index of the colour at a place.
    fn index(&self, place: DVec2) -> usize {
        let place = self.to_uv.transform_point2(place);
        let far = (place - place.floor()).cmpgt(DVec2::splat(0.5));
        usize::from(far.x != far.y)
    }
}

/// A texture ready to be looked up.
///
/// Texture coordinates are those of OBJ files, with v upwards. Pictures and boards count v downwards from 1, as Mitsuba
/// does for OBJ files, so that a picture's first row is at v = 1. Where there are no coordinates, (0, 0) stands for them.
#[derive(Clone, Debug)]
pub(super) enum Texture {
    Uniform(DVec3),
    Bitmap(Bitmap),
    Checkerboard(Checkerboard),
}

impl Texture {
    pub(super) fn try_new(source: &TextureSource, limits: PictureLimits) -> Result<Self, PictureError> {
        Ok(match source {
            TextureSource::Uniform(colour) => Self::Uniform(*colour),
            TextureSource::Bitmap(source) => {
                let path = &source.path;
                let picture = match &source.channel {
                    Some(channel) => read_channel_within(path, channel, source.raw, limits)?,
                    None => read_picture_within(path, source.raw, limits)?,
                };
                Self::Bitmap(Bitmap::new(picture, source))
            }
            TextureSource::Checkerboard(board) => Self::Checkerboard(*board),
        })
    }

    /// The colour at texture coordinates.
    pub(super) fn colour(&self, uv: DVec2) -> DVec3 {
        match self {
            Self::Uniform(colour) => *colour,
            Self::Bitmap(bitmap) => bitmap.colour(downwards(uv)),
            Self::Checkerboard(board) => board.colours[board.index(downwards(uv))],
        }
    }

    /// The number at texture coordinates: a picture's luminance, and of other colours the mean.
    ///
    /// A board's colours are swapped here, as in Mitsuba 3.9.1.
    pub(super) fn number(&self, uv: DVec2) -> f64 {
        match self {
            Self::Uniform(colour) => mean(*colour),
            Self::Bitmap(bitmap) => luminance(bitmap.colour(downwards(uv))),
            Self::Checkerboard(board) => mean(board.colours[1 - board.index(downwards(uv))]),
        }
    }

    /// Mean over the surface, of a picture's luminance and of other colours' mean, as in Mitsuba.
    pub(super) fn mean(&self) -> f64 {
        match self {
            Self::Uniform(colour) => mean(*colour),
            Self::Bitmap(bitmap) => bitmap.mean,
            Self::Checkerboard(board) => 0.5 * (mean(board.colours[0]) + mean(board.colours[1])),
        }
    }

    /// The picture, if it is one.
    pub(super) fn picture(&self) -> Option<Arc<Picture>> {
        match self {
            Self::Bitmap(bitmap) => Some(Arc::clone(&bitmap.picture)),
            _ => None,
        }
    }
}

/// Brightness of a colour in linear sRGB, with Mitsuba's coefficients.
pub(super) fn luminance(colour: DVec3) -> f64 {
    colour.dot(DVec3::new(0.212_671, 0.715_160, 0.072_169))
}

fn mean(colour: DVec3) -> f64 {
    colour.element_sum() / 3.0
}

fn downwards(uv: DVec2) -> DVec2 {
    if uv.is_finite() { DVec2::new(uv.x, 1.0 - uv.y) } else { DVec2::Y }
}

/// A picture over the unit square.
#[derive(Clone, Debug)]
pub(super) struct Bitmap {
    picture: Arc<Picture>,
    mean: f64,
    filter: TextureFilter,
    wrap: TextureWrap,
    to_uv: DAffine2,
}

impl Bitmap {
    fn new(picture: Picture, source: &BitmapSource) -> Self {
        let BitmapSource { filter, wrap, to_uv, .. } = *source;
        let sum: f64 = picture.pixels.iter().map(|pixel| luminance(colour(pixel))).sum();
        let mean = sum / picture.pixels.len() as f64;
        Self { picture: Arc::new(picture), mean, filter, wrap, to_uv }
    }

    fn colour(&self, place: DVec2) -> DVec3 {
        let [width, height] = self.picture.size;
        let place = self.to_uv.transform_point2(place) * DVec2::new(width.into(), height.into());
        match self.filter {
            TextureFilter::Nearest => self.pixel(place.floor()),
            TextureFilter::Bilinear => {
                let place = place - 0.5;
                let corner = place.floor();
                let weight = place - corner;
                let row = |y: f64| {
                    let left = self.pixel(corner + DVec2::new(0.0, y));
                    left.lerp(self.pixel(corner + DVec2::new(1.0, y)), weight.x)
                };
                row(0.0).lerp(row(1.0), weight.y)
            }
        }
    }

    /// The pixel of a column and row, inside or not.
    fn pixel(&self, place: DVec2) -> DVec3 {
        let [width, height] = self.picture.size;
        let column = self.wrap.wrap(place.x, width);
        let row = self.wrap.wrap(place.y, height);
        colour(&self.picture.pixels[row * width as usize + column])
    }
}

fn colour(pixel: &[f32; 3]) -> DVec3 {
    DVec3::from_array(pixel.map(f64::from))
}

#[cfg(test)]
mod tests;
