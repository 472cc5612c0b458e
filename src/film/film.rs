//! From samples to pixels.

use glam::DVec3;
use thiserror::Error;

use super::image::{Image, Window};
use super::sample::{FirstHit, Sample};
use super::settings::{Aov, FilmSettings};

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

/// Which pixels there are, and which channels they have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Film {
    size: [u32; 2],
    window: Window,
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
        Ok(Self { size, window: Window { x, y, width, height }, aovs: once })
    }

    /// The pixels to render: the crop.
    pub const fn window(&self) -> Window {
        self.window
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

    /// Appends a finished pixel's channels, in the order of [`Self::image`].
    pub fn develop(&self, pixel: &Pixel, channels: &mut Vec<f32>) {
        let mean = pixel.mean;
        channels.extend([mean.x, mean.y, mean.z, pixel.alpha()].map(to_f32));
        let variance = pixel.variance_of_mean();
        for aov in &self.aovs {
            let values = aov.values(pixel.first_hit.as_ref(), variance).to_array();
            channels.extend(values[..aov.components().len()].iter().copied().map(to_f32));
        }
    }
}

/// The nearest 32-bit float; beyond the greatest one, that.
#[expect(clippy::cast_possible_truncation, reason = "pictures are 32-bit; the rounding is meant")]
fn to_f32(value: f64) -> f32 {
    value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}

/// The samples of one pixel, put together with the box filter: each counts alike.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Pixel {
    count: u32,
    mean: DVec3,
    /// Sum of the squared deviations from the mean.
    deviation_sq: DVec3,
    alpha_sum: f64,
    first_hit: Option<FirstHit>,
}

impl Pixel {
    /// Adds a sample, updating mean and deviation as Welford (1962) does, which keeps their digits.
    ///
    /// A sample whose radiance is no finite 32-bit float counts as black. Returns whether it was
    /// finite.
    pub fn add(&mut self, sample: &Sample) -> bool {
        // NaN fails this too
        let finite = sample.radiance.abs().cmple(DVec3::splat(f32::MAX.into())).all();
        let radiance = if finite { sample.radiance } else { DVec3::ZERO };
        self.count += 1;
        let before = radiance - self.mean;
        self.mean += before / f64::from(self.count);
        self.deviation_sq += before * (radiance - self.mean);
        self.alpha_sum += sample.alpha;
        // never a blend, so that ids and depths stay true
        if self.first_hit.is_none() {
            self.first_hit = sample.first_hit;
        }
        finite
    }

    /// Mean of the samples' alpha.
    fn alpha(&self) -> f64 {
        self.alpha_sum / f64::from(self.count.max(1))
    }

    /// Variance of the mean: the samples' variance s² = Σ(x - mean)² / (n - 1), over n. 0 for one
    /// sample, which says nothing of it.
    fn variance_of_mean(&self) -> DVec3 {
        if self.count < 2 {
            return DVec3::ZERO;
        }
        let n = f64::from(self.count);
        self.deviation_sq / (n * (n - 1.0))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::film::SurfaceIds;

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
        let film = Film::try_new(&FilmSettings::default(), aovs).unwrap();
        let mut pixel = Pixel::default();
        for sample in samples {
            pixel.add(sample);
        }
        let mut channels = Vec::new();
        film.develop(&pixel, &mut channels);
        assert_eq!(channels.len(), film.image().channels().len());
        channels
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
        let mut pixel = Pixel::default();
        assert!(pixel.add(&sample(DVec3::ONE, None)));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e39] {
            assert!(!pixel.add(&sample(DVec3::new(1.0, bad, 1.0), None)), "{bad}");
        }
        assert_eq!(pixel.count, 5);
        assert!((pixel.mean - DVec3::splat(0.2)).abs().max_element() < 1e-15);
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
