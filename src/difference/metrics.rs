//! Measures of how different two pictures are as a whole.

use std::str::FromStr;

use serde::Serialize;

use super::colour_picture::PicturePair;
use super::colours::ColourChannels;
use super::flip::{PIXELS_PER_DEGREE, hdr_flip_of_pair, ldr_flip_of_pair, magma};
use super::pairing::Value;
use super::ssim::ssim_of_pair;
use super::ulp::ulp_distance;
use crate::choice::UnknownName;
use crate::film::{Raster, SampleKind};

/// Pixels whose errors are summed by themselves, so that a small error is not lost in a great sum.
const PIXELS_SUMMED: usize = 4096;

/// Added to the square of the reference, so that black has a relative error too.
const RELATIVE_FLOOR: f64 = 1e-2;

/// A measure of the colours of two pictures. R, G and B count alike; a grey picture has three equal colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// The mean absolute error.
    Mae,
    /// The mean squared error.
    Mse,
    /// The root of the mean squared error.
    Rmse,
    /// The mean of (a - b)² / (b² + 0.01), b being the reference's value.
    RelMse,
    /// The peak signal-to-noise ratio in decibels, with peak 1.
    Psnr,
    /// The mean structural similarity (Wang et al. 2004) of the pictures as on a screen; 1 if they are the same.
    Ssim,
    /// The mean of FLIP (Andersson et al. 2020), from 0 to 1, of the pictures as on a screen.
    Flip,
    /// The mean of HDR-FLIP (Andersson et al. 2021), from 0 to 1, of pictures of any brightness.
    HdrFlip,
    /// The mean distance in units in the last place of single precision.
    Ulp,
}

const NAMES: [(&str, Metric); 10] = [
    ("mae", Metric::Mae),
    ("mse", Metric::Mse),
    ("rmse", Metric::Rmse),
    ("relmse", Metric::RelMse),
    ("mrse", Metric::RelMse),
    ("psnr", Metric::Psnr),
    ("ssim", Metric::Ssim),
    ("flip", Metric::Flip),
    ("hdrflip", Metric::HdrFlip),
    ("ulp", Metric::Ulp),
];

impl Metric {
    /// Its name; `mrse` is another one for `relmse`.
    #[must_use]
    pub fn name(self) -> &'static str {
        NAMES.iter().find(|(_, metric)| *metric == self).map_or("", |(name, _)| name)
    }

    /// Whether more is better.
    #[must_use]
    pub const fn is_similarity(self) -> bool {
        matches!(self, Self::Psnr | Self::Ssim)
    }
}

impl FromStr for Metric {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        let names = NAMES.map(|(name, _)| name);
        let found = NAMES.iter().find(|(known, _)| *known == name);
        found.map(|(_, metric)| *metric).ok_or_else(|| UnknownName::new("metric", &names, name))
    }
}

/// An error for each pixel, from 0 to `scale`.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorMap {
    /// What it shows.
    pub name: &'static str,
    /// Width and height.
    pub size: [usize; 2],
    /// Row by row; not finite where a picture is not.
    pub values: Vec<f32>,
    /// The error that is shown brightest.
    pub scale: f32,
}

impl ErrorMap {
    /// In the colours of magma, from black for no error to pale yellow for the scale and above, and for what is not finite.
    ///
    #[must_use]
    pub fn raster(&self) -> Raster {
        let scale = if self.scale > 0.0 { self.scale } else { 1.0 };
        let pixels = self.values.iter().map(|value| magma(value / scale)).collect();
        let size = self.size.map(|side| u32::try_from(side).unwrap_or(u32::MAX));
        Raster { size, pixels }
    }
}

/// What a metric gave.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// The metric's name.
    pub name: &'static str,
    /// Its value; a PSNR of equal pictures is infinite, which JSON writes as null.
    pub mean: f64,
    /// The greatest error of a pixel, where the metric has a map, or of a value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// Values that are not finite in both pictures and so in no mean.
    pub left_out: usize,
    /// Whether it is beyond `--metricfail`.
    pub fails: bool,
    /// The error of each pixel.
    #[serde(skip)]
    pub map: Option<ErrorMap>,
}

/// Measures two pictures. `limit` is the greatest value that does not fail, for similarities the least.
pub(super) fn measure(metric: Metric, colours: &ColourChannels<'_>, limit: Option<f64>) -> Measured {
    let mut measured = match metric {
        Metric::Ssim => similarity(colours),
        Metric::Flip => mapped("flip", colours, ldr_flip_of_pair(&colours.on_screen(), PIXELS_PER_DEGREE)),
        Metric::HdrFlip => {
            mapped("hdrflip", colours, hdr_flip_of_pair(&colours.as_light(), PIXELS_PER_DEGREE).map)
        }
        _ => mean(metric, colours),
    };
    // written so that NaN fails
    let within = |limit| if metric.is_similarity() { measured.mean >= limit } else { measured.mean <= limit };
    measured.fails = limit.is_some_and(|limit| !within(limit));
    measured
}

/// Means of errors of single values.
fn mean(metric: Metric, colours: &ColourChannels<'_>) -> Measured {
    let (mut sum, mut most, mut count, mut left_out) = (0.0, 0.0_f64, 0_usize, 0);
    let [width, height] = colours.size();
    for start in (0..width * height).step_by(PIXELS_SUMMED) {
        let mut part = 0.0;
        let places = start..(start + PIXELS_SUMMED).min(width * height);
        let pairs = places.flat_map(|place| {
            let [theirs, ours] = [0, 1].map(|which| colours.colour(which, place));
            [0, 1, 2].map(|channel| (theirs[channel], ours[channel]))
        });
        for (b, a) in pairs {
            if !(a.is_finite() && b.is_finite()) {
                left_out += 1;
                continue;
            }
            let difference = f64::from(a) - f64::from(b);
            let error = match metric {
                Metric::Mae => difference.abs(),
                Metric::RelMse => difference * difference / (f64::from(b) * f64::from(b) + RELATIVE_FLOOR),
                Metric::Ulp => ulp_distance(SampleKind::Float, Value::Real(a), Value::Real(b)) as f64,
                _ => difference * difference,
            };
            part += error;
            most = most.max(error);
            count += 1;
        }
        sum += part;
    }
    let mean = sum / count.max(1) as f64;
    let (mean, max) = match metric {
        Metric::Rmse => (mean.sqrt(), Some(most.sqrt())),
        Metric::Psnr => (-10.0 * libm::log10(mean), None),
        _ => (mean, Some(most)),
    };
    Measured { name: metric.name(), mean, max, left_out, fails: false, map: None }
}

fn similarity(colours: &ColourChannels<'_>) -> Measured {
    let found = ssim_of_pair(&colours.on_screen());
    #[expect(clippy::cast_possible_truncation, reason = "maps are in single precision")]
    let values = found.map.iter().map(|similarity| (1.0 - similarity) as f32).collect();
    let map = ErrorMap { name: "1 - ssim", size: colours.size(), values, scale: 1.0 };
    Measured { name: "ssim", mean: found.mean, max: None, left_out: 0, fails: false, map: Some(map) }
}

fn mapped(name: &'static str, colours: &ColourChannels<'_>, values: Vec<f32>) -> Measured {
    let mean = values.iter().copied().map(f64::from).sum::<f64>() / values.len().max(1) as f64;
    let max = values.iter().copied().fold(0.0, f32::max);
    let map = ErrorMap { name, size: colours.size(), values, scale: 1.0 };
    Measured { name, mean, max: Some(f64::from(max)), left_out: 0, fails: false, map: Some(map) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::difference::pairing::pair;
    use crate::difference::testing::picture;

    /// Measures two pictures of one grey each.
    fn measured(metric: Metric, [reference, test]: [f32; 2], encoded: bool, limit: Option<f64>) -> Measured {
        let [reference, test] = [reference, test].map(|value| picture([16, 16], &[("Y", value)]));
        let (parts, _) = pair(&reference, &test, false).unwrap();
        measure(metric, &ColourChannels::of_part(&parts[0], [encoded; 2]).unwrap(), limit)
    }

    #[test]
    fn means_of_constant_differences() {
        let cases = [
            (Metric::Mae, 0.25),
            (Metric::Mse, 0.0625),
            (Metric::Rmse, 0.25),
            (Metric::RelMse, 0.0625 / 0.26),
            (Metric::Psnr, 10.0 * 16.0_f64.log10()),
            (Metric::Ulp, f64::from(1_u32 << 22)),
        ];
        for (metric, want) in cases {
            let got = measured(metric, [0.5, 0.75], false, None);
            assert!((got.mean / want - 1.0).abs() < 1e-12, "{}: {} is not {want}", got.name, got.mean);
        }
    }

    #[test]
    fn equal_pictures_have_no_error() {
        for (name, metric) in NAMES {
            let got = measured(metric, [0.5, 0.5], true, None);
            let want = match metric {
                Metric::Psnr => f64::INFINITY,
                Metric::Ssim => 1.0,
                _ => 0.0,
            };
            assert!(got.mean == want || (got.mean - want).abs() < 1e-7, "{name}: {}", got.mean);
            assert_eq!(name.parse::<Metric>(), Ok(metric));
        }
        let error = "fliip".parse::<Metric>().unwrap_err();
        assert!(error.to_string().contains("did you mean \"flip\"?"), "{error}");
    }

    #[test]
    fn limits_are_above_errors_and_below_similarities() {
        let fails = |metric, limit| measured(metric, [0.5, 0.75], false, Some(limit)).fails;
        assert!(fails(Metric::Mae, 0.2) && !fails(Metric::Mae, 0.3));
        assert!(fails(Metric::Psnr, 13.0) && !fails(Metric::Psnr, 12.0));
        assert!(fails(Metric::Ssim, 0.9999) && !fails(Metric::Ssim, 0.1));
        assert!(fails(Metric::Flip, 0.01) && fails(Metric::HdrFlip, 0.001));
        let broken = measured(Metric::Flip, [0.5, f32::NAN], false, Some(0.5));
        assert!(broken.fails && broken.mean == 1.0, "{}", broken.mean);
    }

    #[test]
    fn screens_clamp() {
        let flip = |reference, test| measured(Metric::Flip, [reference, test], false, None).mean;
        assert_eq!(flip(3.0, 7.0), 0.0, "both are white");
        let hdr = measured(Metric::HdrFlip, [3.0, 7.0], false, None).mean;
        assert!(hdr > 0.01, "{hdr}");
    }
}
