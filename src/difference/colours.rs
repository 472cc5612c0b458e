//! The colours of two pictures, for measures of the whole.

use super::colour_picture::PicturePair;
use super::flip::srgb_from_linear;
use super::pairing::{ChannelPair, PartPair};
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
    /// Both as previews show them: clamped, on the sRGB curve, over black.
    #[must_use]
    pub fn previews(&self) -> [Raster; 2] {
        let size = [self.area.width, self.area.height];
        [0, 1].map(|which| {
            let shown = |colour: &[f32; 3]| on_screen(*colour, self.srgb_encoded[which]);
            Raster::from_screen(size, &self.pixels[which].iter().map(shown).collect::<Vec<_>>())
        })
    }
}

/// The colours of both pictures where their channels are.
#[derive(Clone, Copy, Debug)]
pub(super) struct ColourChannels<'a> {
    part: &'a PartPair<'a>,
    channels: [ChannelPair<'a>; 3],
    srgb_encoded: [bool; 2],
}

impl<'a> ColourChannels<'a> {
    /// R, G and B of a part, or Y for all three; none without either.
    pub(super) fn of_part(part: &'a PartPair<'a>, srgb_encoded: [bool; 2]) -> Option<Self> {
        let layer = part.layers.iter().find(|layer| layer.name.is_empty())?;
        let find = |name: &str| layer.channels.iter().find(|pair| pair.reference.name == name).copied();
        let channels = match ["R", "G", "B"].map(find) {
            [Some(red), Some(green), Some(blue)] => [red, green, blue],
            _ => [find("Y")?; 3],
        };
        Some(Self { part, channels, srgb_encoded })
    }

    /// The numbers themselves.
    pub(super) fn copied(&self) -> Colours {
        let count = self.part.area.pixels();
        let pixels = [0, 1].map(|which| (0..count).map(|place| self.colour(which, place)).collect());
        Colours { area: self.part.area, pixels, srgb_encoded: self.srgb_encoded }
    }

    /// As on a screen: linear colours clamped to `[0, 1]` and put on the sRGB curve. NaN and Inf stay.
    pub(super) const fn on_screen(self) -> OnScreen<'a> {
        OnScreen(self)
    }

    /// As light: what is on the sRGB curve taken off it.
    pub(super) const fn as_light(self) -> AsLight<'a> {
        AsLight(self)
    }
}

impl PicturePair for ColourChannels<'_> {
    fn size(&self) -> [usize; 2] {
        [self.part.area.width as usize, self.part.area.height as usize]
    }

    fn colour(&self, which: usize, place: usize) -> [f32; 3] {
        let index = self.part.index(which, place);
        self.channels.map(|pair| {
            let channel = if which == 0 { pair.reference } else { pair.test };
            #[expect(clippy::cast_possible_truncation, reason = "colours are in single precision")]
            let single = index.map_or(f64::NAN, |index| channel.value(index)) as f32;
            single
        })
    }
}

/// Colours as on a screen.
#[derive(Clone, Copy, Debug)]
pub(super) struct OnScreen<'a>(ColourChannels<'a>);

impl PicturePair for OnScreen<'_> {
    fn size(&self) -> [usize; 2] {
        self.0.size()
    }

    fn colour(&self, which: usize, place: usize) -> [f32; 3] {
        on_screen(self.0.colour(which, place), self.0.srgb_encoded[which])
    }
}

/// Colours as light.
#[derive(Clone, Copy, Debug)]
pub(super) struct AsLight<'a>(ColourChannels<'a>);

impl PicturePair for AsLight<'_> {
    fn size(&self) -> [usize; 2] {
        self.0.size()
    }

    fn colour(&self, which: usize, place: usize) -> [f32; 3] {
        let colour = self.0.colour(which, place);
        if self.0.srgb_encoded[which] { colour.map(linear_from_srgb) } else { colour }
    }
}

/// A colour on the sRGB curve; a linear one is clamped to `[0, 1]` and put on it, but NaN and Inf stay.
fn on_screen(colour: [f32; 3], srgb_encoded: bool) -> [f32; 3] {
    let shown = |value: f32| if value.is_finite() { srgb_from_linear(value.clamp(0.0, 1.0)) } else { value };
    if srgb_encoded { colour } else { colour.map(shown) }
}

/// The linear value of a number on the sRGB curve.
#[expect(clippy::cast_possible_truncation, reason = "colours are in single precision")]
fn linear_from_srgb(share: f32) -> f32 {
    from_srgb(f64::from(share)) as f32
}
