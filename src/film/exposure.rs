//! The samples of a tile of the picture.

use glam::{DVec2, DVec3};

use super::film::Film;
use super::filter::Filter;
use super::image::Window;
use super::sample::{FirstHit, Sample};
use super::settings::Aov;

/// Sums of the samples of one tile, for all pixels that they count for.
///
/// With the box filter a sample counts for its own pixel, and mean and variance are updated as Welford (1962) does, which
/// keeps their digits. With others, a pixel is the sum of its samples' weighted values over that of their weights.
#[derive(Clone, Debug, PartialEq)]
pub struct Exposure {
    tile: Window,
    /// The pixels of the picture that the tile's samples count for.
    reach: Window,
    filter: Filter,
    aovs: Vec<Aov>,
    /// For each pixel of `reach`, row by row, the numbers of a [`BoxSums`] or a [`FilterSums`].
    sums: Vec<f64>,
    /// For each pixel of the tile the layers' values; they are never filtered.
    layers: Vec<f32>,
    /// For each pixel of the tile, whether a sample has hit anything.
    hit: Vec<bool>,
}

/// A pixel under the box filter: count, mean, sum of squared deviations from it, and sum of alpha.
struct BoxSums;

impl BoxSums {
    const NUMBERS: usize = 8;

    fn add(sums: &mut [f64], radiance: DVec3, alpha: f64) {
        sums[0] += 1.0;
        for (channel, value) in radiance.to_array().into_iter().enumerate() {
            let before = value - sums[1 + channel];
            sums[1 + channel] += before / sums[0];
            sums[4 + channel] += before * (value - sums[1 + channel]);
        }
        sums[7] += alpha;
    }

    /// Mean, alpha and the mean's variance: the samples' variance s² = Σ(x - mean)² / (n - 1), over n. 0 for one sample,
    /// which says nothing of it.
    fn develop(sums: &[f64]) -> (DVec3, f64, DVec3) {
        let count = sums[0];
        let of_mean = if count < 2.0 { 0.0 } else { 1.0 / (count * (count - 1.0)) };
        (DVec3::from_slice(&sums[1..]), sums[7] / count.max(1.0), DVec3::from_slice(&sums[4..]) * of_mean)
    }
}

/// A pixel under other filters: sums over the samples of the pixels around it, of the weights w, of w x and w alpha; and what
/// its variance needs, of [`Deviation`]'s.
struct FilterSums;

/// How far samples of one pixel are spread, as they count for one pixel: Σ w², and n / (n - 1) times the sums of squares and
/// products of w x and w about their means. Samples are spread over each pixel alike, so that only their spread within it
/// is chance.
#[derive(Clone, Copy, Default)]
struct Deviation {
    count: f64,
    weight: f64,
    value: DVec3,
    weight_sq: f64,
    product: DVec3,
    value_sq: DVec3,
}

impl Deviation {
    fn add(&mut self, weight: f64, radiance: DVec3) {
        let value = weight * radiance;
        self.count += 1.0;
        self.weight += weight;
        self.value += value;
        self.weight_sq += weight * weight;
        self.product += weight * value;
        self.value_sq += value * value;
    }
}

impl FilterSums {
    const NUMBERS: usize = 14;

    fn add(sums: &mut [f64], alpha: f64, of_pixel: &Deviation) {
        let Deviation { count, weight, value, weight_sq, product, value_sq } = *of_pixel;
        sums[0] += weight;
        sums[4] += alpha;
        sums[5] += weight_sq;
        let factor = if count > 1.0 { count / (count - 1.0) } else { 0.0 };
        if factor > 0.0 {
            sums[6] += weight_sq;
        }
        sums[7] += factor * (weight_sq - weight * weight / count);
        for channel in 0..3 {
            let (value, product, square) = (value[channel], product[channel], value_sq[channel]);
            sums[1 + channel] += value;
            sums[8 + channel] += factor * (product - weight * value / count);
            sums[11 + channel] += factor * (square - value * value / count);
        }
    }

    /// Weighted mean m and alpha, and the mean's variance: that of Σ w (x - m) over (Σ w)², as for a ratio of two sums to
    /// first order (Cochran 1977, section 2.11). Samples that were alone in their pixel and pass are taken to be spread
    /// as the others are.
    fn develop(sums: &[f64]) -> (DVec3, f64, DVec3) {
        let weight = sums[0];
        if weight == 0.0 {
            return (DVec3::ZERO, 0.0, DVec3::ZERO);
        }
        let mean = DVec3::from_slice(&sums[1..]) / weight;
        let spread = DVec3::from_slice(&sums[11..]) - 2.0 * mean * DVec3::from_slice(&sums[8..])
            + mean * mean * sums[7];
        let known = if sums[6] > 0.0 { sums[5] / sums[6] } else { 0.0 };
        (mean, sums[4] / weight, spread.max(DVec3::ZERO) * (known / (weight * weight)))
    }
}

impl Exposure {
    pub(super) fn new(film: &Film, tile: Window) -> Self {
        let filter = film.filter();
        // what a tile of the border reaches of the crop can be nothing
        let around = tile.grown(filter.border(), Window { x: 0, y: 0, width: u32::MAX, height: u32::MAX });
        let nothing = Window { x: tile.x, y: tile.y, width: 0, height: 0 };
        let reach = around.intersection(film.window()).unwrap_or(nothing);
        let aovs = film.aovs().to_vec();
        let mut layers = Vec::new();
        for _ in 0..tile.pixels() {
            push_layers(&aovs, None, &mut layers);
        }
        let sums = vec![0.0; reach.pixels() * numbers(filter)];
        Self { tile, reach, filter, aovs, sums, layers, hit: vec![false; tile.pixels()] }
    }

    /// The pixels whose samples these are.
    pub const fn tile(&self) -> Window {
        self.tile
    }

    /// Adds samples of a pixel of the tile, each taken at `offset` from the pixel's corner, in `[0, 1)²`.
    ///
    /// A sample whose radiance is no finite 32-bit float counts as black. Returns how many were not finite.
    pub fn add(&mut self, pixel: [u32; 2], offsets: &[DVec2], samples: &[Sample]) -> u64 {
        let black = samples.iter().filter(|sample| !is_finite(sample)).count() as u64;
        if self.filter == Filter::Box {
            if let Some(sums) = self.sums_of(pixel.map(i64::from)) {
                samples.iter().for_each(|sample| BoxSums::add(sums, radiance(sample), sample.alpha));
            }
        } else {
            self.splat(pixel, offsets, samples);
        }
        let index = self.tile.index(pixel);
        if !self.hit[index]
            && let Some(first_hit) = samples.iter().find_map(|sample| sample.first_hit.as_ref())
        {
            // never a blend, so that ids and depths stay true
            self.hit[index] = true;
            let mut layers = Vec::with_capacity(layer_count(&self.aovs));
            push_layers(&self.aovs, Some(first_hit), &mut layers);
            let start = index * layers.len();
            self.layers[start..start + layers.len()].copy_from_slice(&layers);
        }
        black
    }

    fn splat(&mut self, pixel: [u32; 2], offsets: &[DVec2], samples: &[Sample]) {
        let (filter, border) = (self.filter, i64::from(self.filter.border()));
        let weights = |d: i64, of: fn(&DVec2) -> f64| {
            let weight = move |offset: &DVec2| filter.eval(d as f64 + 0.5 - of(offset));
            offsets.iter().map(weight).collect::<Vec<_>>()
        };
        let across: Vec<_> = (-border..=border).map(|dx| weights(dx, |offset| offset.x)).collect();
        for dy in -border..=border {
            let down = weights(dy, |offset| offset.y);
            for (dx, across) in (-border..=border).zip(&across) {
                let Some(sums) = self.sums_of([i64::from(pixel[0]) + dx, i64::from(pixel[1]) + dy]) else {
                    continue;
                };
                let (mut of_pixel, mut alpha) = (Deviation::default(), 0.0);
                for (sample, (across, down)) in samples.iter().zip(across.iter().zip(&down)) {
                    let weight = across * down;
                    of_pixel.add(weight, radiance(sample));
                    alpha += weight * sample.alpha;
                }
                if of_pixel.weight_sq > 0.0 {
                    FilterSums::add(sums, alpha, &of_pixel);
                }
            }
        }
    }

    /// The sums of a pixel, if there are any.
    fn sums_of(&mut self, pixel: [i64; 2]) -> Option<&mut [f64]> {
        let place = [u32::try_from(pixel[0]).ok()?, u32::try_from(pixel[1]).ok()?];
        let numbers = numbers(self.filter);
        let start = place_in(self.reach, place)? * numbers;
        self.sums.get_mut(start..start + numbers)
    }

    /// Appends a finished pixel's channels: R, G, B, A, then the layers, of the samples of all tiles that are `near`.
    pub(super) fn develop(&self, near: &[&Self], pixel: [u32; 2], channels: &mut Vec<f32>) {
        let mut sums = [0.0; FilterSums::NUMBERS];
        let numbers = numbers(self.filter);
        let sums = &mut sums[..numbers];
        for exposure in near {
            if let Some(place) = place_in(exposure.reach, pixel) {
                let of_tile = &exposure.sums[place * numbers..][..numbers];
                sums.iter_mut().zip(of_tile).for_each(|(sum, value)| *sum += value);
            }
        }
        let (mean, alpha, variance) =
            if self.filter == Filter::Box { BoxSums::develop(sums) } else { FilterSums::develop(sums) };
        channels.extend([mean.x, mean.y, mean.z, alpha].map(to_f32));
        let count = layer_count(&self.aovs);
        let mut layers = self.layers[self.tile.index(pixel) * count..][..count].iter();
        for aov in &self.aovs {
            let of_layer = layers.by_ref().take(aov.components().len());
            if *aov == Aov::Variance {
                of_layer.for_each(drop);
                channels.extend(variance.to_array().map(to_f32));
            } else {
                channels.extend(of_layer);
            }
        }
    }

    /// Appends all that samples have changed.
    pub fn save(&self, bytes: &mut Vec<u8>) {
        bytes.extend(self.sums.iter().flat_map(|sum| sum.to_le_bytes()));
        bytes.extend(self.layers.iter().flat_map(|value| value.to_le_bytes()));
        bytes.extend(self.hit.iter().map(|&hit| u8::from(hit)));
    }

    /// Takes what [`Self::save`] has written for a tile of the same film, from the front of `bytes`; `None` if it is not that.
    pub fn load(&mut self, bytes: &mut &[u8]) -> Option<()> {
        for sum in &mut self.sums {
            *sum = f64::from_le_bytes(*bytes.split_off(..8)?.as_array()?);
        }
        for value in &mut self.layers {
            *value = f32::from_le_bytes(*bytes.split_off(..4)?.as_array()?);
        }
        for hit in &mut self.hit {
            *hit = match bytes.split_off_first()? {
                0 => false,
                1 => true,
                _ => return None,
            };
        }
        Some(())
    }
}

/// Whether a sample's radiance is finite as a 32-bit float.
fn is_finite(sample: &Sample) -> bool {
    // NaN fails this too
    sample.radiance.abs().cmple(DVec3::splat(f32::MAX.into())).all()
}

fn radiance(sample: &Sample) -> DVec3 {
    if is_finite(sample) { sample.radiance } else { DVec3::ZERO }
}

/// Index of a pixel of a window, if it is one.
fn place_in(window: Window, [x, y]: [u32; 2]) -> Option<usize> {
    let inside =
        (window.x..window.x + window.width).contains(&x) && (window.y..window.y + window.height).contains(&y);
    inside.then(|| window.index([x, y]))
}

const fn numbers(filter: Filter) -> usize {
    if matches!(filter, Filter::Box) { BoxSums::NUMBERS } else { FilterSums::NUMBERS }
}

fn layer_count(aovs: &[Aov]) -> usize {
    aovs.iter().map(|aov| aov.components().len()).sum()
}

/// Appends a pixel's layers, those that no hit knows as 0.
fn push_layers(aovs: &[Aov], hit: Option<&FirstHit>, layers: &mut Vec<f32>) {
    for aov in aovs {
        let values = aov.values(hit).to_array();
        layers.extend(values[..aov.components().len()].iter().copied().map(to_f32));
    }
}

/// The nearest 32-bit float; beyond the greatest one, that.
#[expect(clippy::cast_possible_truncation, reason = "pictures are 32-bit; the rounding is meant")]
fn to_f32(value: f64) -> f32 {
    value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}
