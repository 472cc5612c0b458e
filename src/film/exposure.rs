//! The samples of a tile of the picture.

use std::ops::Range;

use glam::{DVec2, DVec3};
use thiserror::Error;

use super::aov::Aov;
use super::filter::Filter;
use super::image::Window;
use super::pixel_sums::{BoxSums, Deviation, FilterSums, develop, numbers};
use super::sample::{FirstHit, Sample};
use super::sample_blocks::{BLOCK, SampleBlocks, read_u32};

/// No sample of a pixel has hit anything.
const NO_HIT: u32 = u32::MAX;

/// Two shares of a picture cannot be put together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum MergeError {
    /// They are of other tiles, filters or layers.
    #[error("the samples are of another tile, filter or list of layers")]
    OtherTile,
    /// A block would be counted twice.
    #[error("both have samples of one block")]
    Overlap,
}

/// Sums of the samples of one tile, for all pixels that they count for.
///
/// The sums are kept by blocks of [`Self::BLOCK`] samples. Block b has each pixel's samples from `BLOCK` b on. Within a
/// block, samples are added in the order of their indices, under filters that reach beyond a pixel in passes over the tile
/// row by row. Blocks are combined along a binary tree: 2 k and 2 k + 1 to a pair, pairs 2 k and 2 k + 1 to four, and so on,
/// the lower half first, as soon as both halves are full; what is left in the end is combined from the lowest block on;
/// then the tiles that count for a pixel, row by row. So a picture whose tiles, and whose blocks of each tile, are exposed
/// apart and merged in any order has the bits of one that is exposed at once.
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
    sums: SampleBlocks,
    /// For each pixel of the tile the layers' values; they are never filtered.
    layers: Vec<f32>,
    /// For each pixel of the tile, the block whose sample the layers are of.
    hits: Vec<u32>,
}

impl Exposure {
    /// Samples of each pixel in a block.
    pub const BLOCK: u32 = BLOCK;

    /// No samples of a tile of the picture, which is `window`.
    pub(super) fn new(tile: Window, window: Window, filter: Filter, aovs: &[Aov]) -> Self {
        // what a tile of the border reaches of the crop can be nothing
        let around = tile.grown(filter.border(), Window { x: 0, y: 0, width: u32::MAX, height: u32::MAX });
        let nothing = Window { x: tile.x, y: tile.y, width: 0, height: 0 };
        let reach = around.intersection(window).unwrap_or(nothing);
        let mut layers = Vec::new();
        for _ in 0..tile.pixels() {
            push_layers(aovs, None, &mut layers);
        }
        let aovs = aovs.to_vec();
        let sums = SampleBlocks::new(filter, reach.pixels());
        Self { tile, reach, filter, aovs, sums, layers, hits: vec![NO_HIT; tile.pixels()] }
    }

    /// The pixels whose samples these are.
    #[must_use]
    pub const fn tile(&self) -> Window {
        self.tile
    }

    /// Samples of each pixel.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.sums.samples()
    }

    /// Whether the samples are those from index 0 on.
    #[must_use]
    pub fn starts_at_zero(&self) -> bool {
        self.sums.start_at_zero()
    }

    /// Adds samples of a pixel of the tile, from index `first` on, all of one block that has no later ones yet; each is taken
    /// at `offset` from the pixel's corner, in `[0, 1)²`. When all pixels have theirs, [`Self::end_pass`] counts them.
    ///
    /// A sample whose radiance is no finite 32-bit float counts as black. Returns how many were not finite.
    ///
    /// # Panics
    /// If the pixel is not of the tile, or the block is full.
    pub fn add(&mut self, pixel: [u32; 2], first: u32, offsets: &[DVec2], samples: &[Sample]) -> u64 {
        let black = samples.iter().filter(|sample| !is_finite(sample)).count() as u64;
        let block = first / BLOCK;
        if self.filter == Filter::Box {
            if let Some(place) = self.place_of(pixel.map(i64::from)) {
                let sums = &mut self.sums.block_sums(block)[place * BoxSums::NUMBERS..][..BoxSums::NUMBERS];
                samples.iter().for_each(|sample| BoxSums::add(sums, radiance(sample), sample.alpha));
            }
        } else {
            self.splat(pixel, block, offsets, samples);
        }
        let index = self.tile.index(pixel);
        if block < self.hits[index]
            && let Some(first_hit) = samples.iter().find_map(|sample| sample.first_hit.as_ref())
        {
            // never a blend, so that ids and depths stay true
            self.hits[index] = block;
            let mut layers = Vec::with_capacity(layer_count(&self.aovs));
            push_layers(&self.aovs, Some(first_hit), &mut layers);
            let start = index * layers.len();
            self.layers[start..start + layers.len()].copy_from_slice(&layers);
        }
        black
    }

    fn splat(&mut self, pixel: [u32; 2], block: u32, offsets: &[DVec2], samples: &[Sample]) {
        let (filter, border) = (self.filter, i64::from(self.filter.border()));
        let weights = |d: i64, of: fn(&DVec2) -> f64| {
            let weight = move |offset: &DVec2| filter.eval(d as f64 + 0.5 - of(offset));
            offsets.iter().map(weight).collect::<Vec<_>>()
        };
        let across: Vec<_> = (-border..=border).map(|dx| weights(dx, |offset| offset.x)).collect();
        for dy in -border..=border {
            let down = weights(dy, |offset| offset.y);
            for (dx, across) in (-border..=border).zip(&across) {
                let Some(place) = self.place_of([i64::from(pixel[0]) + dx, i64::from(pixel[1]) + dy]) else {
                    continue;
                };
                let (mut of_pixel, mut alpha) = (Deviation::default(), 0.0);
                for (sample, (across, down)) in samples.iter().zip(across.iter().zip(&down)) {
                    let weight = across * down;
                    of_pixel.add(weight, radiance(sample));
                    alpha += weight * sample.alpha;
                }
                if of_pixel.weight_sq > 0.0 {
                    let sums = &mut self.sums.block_sums(block)[place * FilterSums::NUMBERS..];
                    FilterSums::add(sums, alpha, &of_pixel);
                }
            }
        }
    }

    /// Where a pixel's sums are, if there are any.
    fn place_of(&self, pixel: [i64; 2]) -> Option<usize> {
        let place = [u32::try_from(pixel[0]).ok()?, u32::try_from(pixel[1]).ok()?];
        place_in(self.reach, place)
    }

    /// Counts the samples of a pass over all pixels of the tile: those of `indices`, within one block.
    ///
    /// # Panics
    /// If the block would have more than [`Self::BLOCK`].
    pub fn end_pass(&mut self, indices: Range<u32>) {
        self.sums.count(indices.start / BLOCK, indices.end - indices.start);
    }

    /// Takes in the samples of other blocks of the same tile.
    ///
    /// # Errors
    /// If `other` is not of the same tile and film, or has samples of a block that this has samples of. Nothing is changed
    /// then.
    pub fn merge(&mut self, other: Self) -> Result<(), MergeError> {
        let place = |exposure: &Self| (exposure.tile, exposure.reach, exposure.filter);
        if place(self) != place(&other) || self.aovs != other.aovs {
            return Err(MergeError::OtherTile);
        }
        self.sums.merge(other.sums).ok_or(MergeError::Overlap)?;
        let count = layer_count(&self.aovs);
        for (pixel, (block, hit)) in self.hits.iter_mut().zip(other.hits).enumerate() {
            if hit < *block {
                *block = hit;
                let layers = pixel * count..(pixel + 1) * count;
                self.layers[layers.clone()].copy_from_slice(&other.layers[layers]);
            }
        }
        Ok(())
    }

    /// Appends a finished pixel's channels: R, G, B, A, then the layers, of the samples of all tiles that are `near`.
    pub(super) fn develop(&self, near: &[&Self], pixel: [u32; 2], channels: &mut Vec<f32>) {
        let mut sums = [0.0; FilterSums::NUMBERS];
        let numbers = numbers(self.filter);
        let sums = &mut sums[..numbers];
        for exposure in near {
            if let Some(place) = place_in(exposure.reach, pixel) {
                let mut of_tile = [0.0; FilterSums::NUMBERS];
                exposure.sums.combined(place, &mut of_tile[..numbers]);
                sums.iter_mut().zip(of_tile).for_each(|(sum, value)| *sum += value);
            }
        }
        let (mean, alpha, variance) = develop(self.filter, sums);
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
        self.sums.save(bytes);
        bytes.extend(self.layers.iter().flat_map(|value| value.to_le_bytes()));
        bytes.extend(self.hits.iter().flat_map(|block| block.to_le_bytes()));
    }

    /// Takes what [`Self::save`] has written for a tile of the same film, from the front of `bytes`; `None` if it is not that.
    pub fn load(&mut self, bytes: &mut &[u8]) -> Option<()> {
        self.sums.load(bytes)?;
        for value in &mut self.layers {
            *value = f32::from_le_bytes(*bytes.split_off(..4)?.as_array()?);
        }
        for block in &mut self.hits {
            *block = read_u32(bytes)?;
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

#[cfg(test)]
mod tests;
