//! From samples to pixels.

use thiserror::Error;

use super::aov::Aov;
use super::exposure::Exposure;
use super::filter::Filter;
use super::image::{Image, Window};
use super::pixel_sums::numbers;
use super::settings::FilmSettings;

/// Pixels along a tile's side: enough work to be worth handing out, and tiles enough for all threads of a small picture.
/// Sums of several tiles are added in the tiles' order, so that another side would change the last bits of pixels.
const TILE_SIDE: u32 = 16;

const _: () = assert!(Filter::MAX_BORDER <= TILE_SIDE, "filters reach no farther than the next tile");

/// Why a film cannot be exposed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum FilmError {
    /// The frame has no pixels.
    #[error("film: size is {0}x{1} pixels, but must be at least 1x1")]
    EmptyFrame(u32, u32),
    /// The crop is empty or reaches out of the frame.
    #[error(
        "film: crop {},{},{},{} (x, y, width, height) must have at least one pixel and lie within \
         the {}x{} frame", .crop[0], .crop[1], .crop[2], .crop[3], .size[0], .size[1]
    )]
    Crop {
        /// The crop: x, y, width, height.
        crop: [u32; 4],
        /// The frame's size.
        size: [u32; 2],
    },
}

/// Which pixels there are, which channels they have, and how samples become pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Film {
    size: [u32; 2],
    window: Window,
    filter: Filter,
    aovs: Vec<Aov>,
}

impl Film {
    /// The film of the settings, with layers for `aovs` (each once).
    ///
    /// # Errors
    /// Where the frame or the crop has no pixels, or the crop reaches out of the frame.
    pub fn try_new(settings: &FilmSettings, aovs: &[Aov]) -> Result<Self, FilmError> {
        let size = settings.size;
        if size.contains(&0) {
            return Err(FilmError::EmptyFrame(size[0], size[1]));
        }
        let crop = settings.crop.unwrap_or([0, 0, size[0], size[1]]);
        let [x, y, width, height] = crop;
        let fits = |start: u32, length: u32, size: u32| {
            length > 0 && start.checked_add(length).is_some_and(|end| end <= size)
        };
        if !(fits(x, width, size[0]) && fits(y, height, size[1])) {
            return Err(FilmError::Crop { crop, size });
        }
        let mut once = Vec::new();
        for aov in aovs {
            if !once.contains(aov) {
                once.push(*aov);
            }
        }
        Ok(Self { size, window: Window { x, y, width, height }, filter: settings.filter, aovs: once })
    }

    /// The pixels of the picture: the crop.
    #[must_use]
    pub const fn window(&self) -> Window {
        self.window
    }

    /// The reconstruction filter.
    #[must_use]
    pub const fn filter(&self) -> Filter {
        self.filter
    }

    /// The layers.
    #[must_use]
    pub fn aovs(&self) -> &[Aov] {
        &self.aovs
    }

    /// The tiles to sample, row by row: all pixels whose samples count for one of the crop. They are on one grid for all
    /// crops, so that a pixel's sums are added up alike in all of them.
    #[must_use]
    pub fn tiles(&self) -> Vec<Window> {
        let sampled = self.window.grown(self.filter.border(), self.frame());
        self.frame().tiles(TILE_SIDE).filter_map(|tile| tile.intersection(sampled)).collect()
    }

    /// Memory that a picture of so many samples a pixel takes while it is exposed, developed and encoded, about.
    #[must_use]
    pub fn bytes(&self, samples: u32) -> u64 {
        let side = f64::from(TILE_SIDE);
        let reach = (side + 2.0 * f64::from(self.filter.border())) / side;
        let runs = f64::from((samples / Exposure::BLOCK).max(1).ilog2() + 1);
        let sums = 8.0 * numbers(self.filter) as f64 * runs * reach * reach;
        let channels: usize = 4 + self.aovs.iter().map(|aov| aov.components().len()).sum::<usize>();
        // in the tiles, in the picture, as the file's channels and as its bytes
        let layers = 4.0 * (4 * channels) as f64;
        let Window { width, height, .. } = self.window;
        // of a tile itself
        let own = 1024.0 / (side * side);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
        let bytes = (f64::from(width) * f64::from(height) * (sums + layers + own)) as u64;
        bytes
    }

    /// All pixels, the crop's or not.
    const fn frame(&self) -> Window {
        Window { x: 0, y: 0, width: self.size[0], height: self.size[1] }
    }

    /// A tile without samples.
    #[must_use]
    pub fn exposure(&self, tile: Window) -> Exposure {
        Exposure::new(tile, self.window, self.filter, &self.aovs)
    }

    /// An unexposed picture: R, G, B, A, then the layers.
    pub fn image(&self) -> Image {
        let mut names: Vec<String> = ["R", "G", "B", "A"].map(str::to_owned).into();
        for aov in &self.aovs {
            let full = |component: &&str| format!("{}.{component}", aov.name());
            names.extend(aov.components().iter().map(full));
        }
        Image::new(self.size, self.window, &names)
    }

    /// The picture of all tiles' samples; `tiles` in the order of [`Self::tiles`].
    pub fn develop<'a>(&self, tiles: impl IntoIterator<Item = &'a Exposure>) -> Image {
        let tiles: Vec<&Exposure> = tiles.into_iter().collect();
        let mut image = self.image();
        let Some(first) = tiles.first().map(|exposure| exposure.tile()) else { return image };
        let columns = tiles.iter().take_while(|exposure| exposure.tile().y == first.y).count();
        let rows = tiles.len() / columns;
        // no filter reaches farther than the next tile
        let beside = |index: usize, count: usize| index.saturating_sub(1)..(index + 2).min(count);
        for (index, exposure) in tiles.iter().enumerate() {
            let near: Vec<&Exposure> = beside(index / columns, rows)
                .flat_map(|row| beside(index % columns, columns).map(move |column| row * columns + column))
                .map(|index| tiles[index])
                .collect();
            if let Some((window, channels)) = self.develop_tile(exposure, &near) {
                image.put_tile(window, &channels);
            }
        }
        image
    }

    /// The pixels of the picture that are in a tile, and all channels of each in turn, of the samples of the tiles `near`.
    #[must_use]
    pub fn develop_tile(&self, exposure: &Exposure, near: &[&Exposure]) -> Option<(Window, Vec<f32>)> {
        let window = exposure.tile().intersection(self.window)?;
        let mut channels = Vec::new();
        window.places().for_each(|place| exposure.develop(near, place, &mut channels));
        Some((window, channels))
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::*;
    use crate::film::{FirstHit, Sample, SurfaceIds};

    fn sample(radiance: DVec3, object: Option<u32>) -> Sample {
        let first_hit = object.map(|object| FirstHit {
            depth: f64::from(object) + 0.5,
            position: DVec3::ONE,
            normal: DVec3::Z,
            geo_normal: DVec3::Y,
            uv: DVec2::NAN,
            st: DVec2::new(0.25, 0.75),
            rest: DVec3::NEG_ONE,
            ids: Some(SurfaceIds { object, face: 2, patch: 3 }),
            albedo: DVec3::splat(0.5),
        });
        Sample { radiance, alpha: f64::from(u8::from(object.is_some())), first_hit }
    }

    fn develop(aovs: &[Aov], samples: &[Sample]) -> Vec<f32> {
        let film = Film::try_new(&FilmSettings { size: [1, 1], ..FilmSettings::default() }, aovs).unwrap();
        let mut exposure = film.exposure(film.tiles()[0]);
        exposure.add([0, 0], 0, &vec![DVec2::splat(0.5); samples.len()], samples);
        let image = film.develop([&exposure]);
        image.channels().iter().map(|channel| channel.values[0]).collect()
    }

    #[test]
    fn mean_and_variance_of_the_mean() {
        let values = [1.0, 2.0, 4.0, 5.0];
        let samples = values.map(|v| sample(v * DVec3::new(1.0, 10.0, 0.0), None));
        // mean 3, squared deviations 10, sample variance 10/3, of the mean 10/12
        let want = [3.0, 30.0, 0.0, 0.0, 10.0 / 12.0, 1000.0 / 12.0, 0.0];
        for (got, want) in develop(&[Aov::Variance], &samples).iter().zip(want) {
            assert!((got - want).abs() <= 1e-5 * want, "got {got}, want {want}");
        }
        let one = develop(&[Aov::Variance], &samples[..1]);
        assert_eq!(one, [1.0, 10.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn layers_are_the_first_hits() {
        let samples = [sample(DVec3::ZERO, None), sample(DVec3::ZERO, Some(4)), sample(DVec3::ZERO, Some(5))];
        let got = develop(&Aov::ALL, &samples);
        #[rustfmt::skip]
        let want = [
            0.0, 0.0, 0.0, 2.0 / 3.0, 4.5, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0,
            0.25, 0.75, -1.0, -1.0, -1.0, 4.0, 2.0, 3.0, 0.5, 0.5, 0.5, 0.0, 0.0, 0.0,
        ];
        assert_eq!(got, want);
        let ids = [Aov::Object, Aov::Depth, Aov::Object];
        let miss = develop(&ids, &samples[..1]);
        assert_eq!(miss, [0.0, 0.0, 0.0, 0.0, -1.0, 0.0]);
    }

    #[test]
    fn samples_that_are_not_finite_are_told_of() {
        let film = Film::try_new(&FilmSettings { size: [1, 1], ..FilmSettings::default() }, &[]).unwrap();
        let mut exposure = film.exposure(film.tiles()[0]);
        let mut add = |radiance| exposure.add([0, 0], 0, &[DVec2::splat(0.5)], &[sample(radiance, None)]);
        assert_eq!(add(DVec3::ONE), 0);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e39] {
            assert_eq!(add(DVec3::new(1.0, bad, 1.0)), 1, "{bad}");
        }
        assert_eq!(film.develop([&exposure]).channel("R").unwrap(), [0.2]);
    }

    #[test]
    fn samples_reach_as_far_as_the_filter() {
        for filter in [Filter::Tent, Filter::Gaussian, Filter::Mitchell, Filter::Lanczos] {
            let settings = FilmSettings { size: [40, 40], filter, crop: None };
            let film = Film::try_new(&settings, &[]).unwrap();
            let mut tiles: Vec<_> = film.tiles().into_iter().map(|tile| film.exposure(tile)).collect();
            // a bright sample near a tile's corner, black ones everywhere
            let (pixel, offset) = ([16, 15], DVec2::new(0.2, 0.9));
            for tile in &mut tiles {
                for place in tile.tile().places() {
                    if place == pixel {
                        tile.add(place, 0, &[offset], &[sample(DVec3::ONE, None)]);
                    } else {
                        tile.add(place, 0, &[DVec2::splat(0.5)], &[sample(DVec3::ZERO, None)]);
                    }
                }
            }
            let image = film.develop(&tiles);
            let weight = |x: u32, y: u32, place: [f64; 2]| {
                filter.eval(f64::from(x) + 0.5 - place[0]) * filter.eval(f64::from(y) + 0.5 - place[1])
            };
            for [x, y] in film.window().places() {
                let bright = weight(x, y, [16.2, 15.9]);
                let dark: f64 = film
                    .window()
                    .places()
                    .filter(|&place| place != pixel)
                    .map(|place| weight(x, y, place.map(|p| f64::from(p) + 0.5)))
                    .sum();
                let got = f64::from(image.channel("R").unwrap()[film.window().index([x, y])]);
                assert!((got - bright / (bright + dark)).abs() < 1e-6, "{filter:?} at {x}, {y}: {got}");
            }
        }
    }

    #[test]
    fn crops_must_lie_within() {
        let size = [8, 6];
        let film = |crop| {
            let settings = FilmSettings { size, crop: Some(crop), ..FilmSettings::default() };
            Film::try_new(&settings, &[])
        };
        assert!(film([0, 0, 8, 6]).is_ok() && film([7, 5, 1, 1]).is_ok());
        for crop in [[0, 0, 9, 6], [7, 0, 2, 1], [0, 0, 0, 1], [u32::MAX, 0, 2, 1]] {
            assert_eq!(film(crop), Err(FilmError::Crop { crop, size }));
        }
        let empty = FilmSettings { size: [0, 6], ..FilmSettings::default() };
        assert_eq!(Film::try_new(&empty, &[]), Err(FilmError::EmptyFrame(0, 6)));
    }
}
