//! The colours of two pictures, for measures of the whole.

use super::colour_picture::ColourPicture;
use super::flip::srgb_from_linear;
use super::pairing::PartPair;
use crate::film::{Area, Raster, from_srgb};

/// The colours of both pictures, the reference's first.
#[derive(Clone, Debug, PartialEq)]
pub struct Colours {
    /// The pixels that are compared.
    pub area: Area,
    /// Row by row, as the files have them.
    pub pixels: [Vec<[f32; 3]>; 2],
    /// Whether they are on the sRGB curve.
    pub srgb_encoded: [bool; 2],
}

impl Colours {
    /// R, G and B of a part, or Y for all three; none without either.
    pub(super) fn from_part(part: &PartPair<'_>, srgb_encoded: [bool; 2]) -> Option<Self> {
        let layer = part.layers.iter().find(|layer| layer.name.is_empty())?;
        let find = |name: &str| layer.channels.iter().find(|pair| pair.reference.name == name).copied();
        let channels = match ["R", "G", "B"].map(find) {
            [Some(red), Some(green), Some(blue)] => [red, green, blue],
            _ => [find("Y")?; 3],
        };
        let mut pixels = [vec![[0.0; 3]; part.area.pixels()], vec![[0.0; 3]; part.area.pixels()]];
        for (colour, channel) in channels.into_iter().enumerate() {
            part.each(channel, |index, a, b| {
                for (pixels, value) in pixels.iter_mut().zip([a, b]) {
                    #[expect(clippy::cast_possible_truncation, reason = "colours are in single precision")]
                    let single = value.number() as f32;
                    pixels[index][colour] = single;
                }
            });
        }
        Some(Self { area: part.area, pixels, srgb_encoded })
    }

    /// Width and height.
    #[must_use]
    pub const fn size(&self) -> [usize; 2] {
        [self.area.width as usize, self.area.height as usize]
    }

    /// As on a screen: linear colours clamped to `[0, 1]` and put on the sRGB curve. NaN and Inf stay.
    pub(super) fn on_screen(&self) -> [Vec<[f32; 3]>; 2] {
        self.converted(
            false,
            |value| {
                if value.is_finite() { srgb_from_linear(value.clamp(0.0, 1.0)) } else { value }
            },
        )
    }

    /// As light: what is on the sRGB curve taken off it.
    pub(super) fn as_light(&self) -> [Vec<[f32; 3]>; 2] {
        self.converted(true, linear_from_srgb)
    }

    /// Those that are on the sRGB curve, or those that are not, converted.
    fn converted(&self, encoded: bool, convert: impl Fn(f32) -> f32) -> [Vec<[f32; 3]>; 2] {
        [0, 1].map(|which| {
            let pixels = &self.pixels[which];
            if self.srgb_encoded[which] == encoded {
                pixels.iter().map(|pixel| pixel.map(&convert)).collect()
            } else {
                pixels.clone()
            }
        })
    }

    /// Both as previews show them: clamped, on the sRGB curve, over black.
    #[must_use]
    pub fn previews(&self) -> [Raster; 2] {
        let size = [self.area.width, self.area.height];
        self.on_screen().map(|colours| Raster::from_screen(size, &colours))
    }

    /// Both as the measures take them.
    pub(super) fn pictures<'a>(&self, pixels: &'a [Vec<[f32; 3]>; 2]) -> [ColourPicture<'a>; 2] {
        let [reference, test] = pixels;
        [reference, test].map(|pixels| ColourPicture { size: self.size(), pixels })
    }
}

/// The linear value of a number on the sRGB curve.
#[expect(clippy::cast_possible_truncation, reason = "colours are in single precision")]
fn linear_from_srgb(share: f32) -> f32 {
    from_srgb(f64::from(share)) as f32
}
