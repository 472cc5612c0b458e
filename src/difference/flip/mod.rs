//! FLIP: how different two pictures look when one takes the other's place on a screen.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild (2020), *FLIP: A Difference Evaluator for
//! Alternating Images*; for pictures of any brightness Andersson, Nilsson, Shirley and Akenine-Möller (2021),
//! *Visualizing Errors in Rendered High Dynamic Range Images*. Where the papers leave something open, it is as in
//! version 1.7 of NVIDIA's `flip-evaluator`, with its separable filters and single precision.
//!
//! A pixel that is not finite in one picture, and not the same in the other, has an error of 1; for its neighbours it
//! is black in both pictures. Pixels that are the same in both have none of their own, even if they are not finite.

mod colour;
mod filter;
mod magma;

use std::f32::consts::FRAC_1_SQRT_2;

use rayon::prelude::*;

use self::colour::{
    Colour, exp2, hyab, linear_from_opponent, linear_from_srgb, log2, luminance, perceived, power, to_f32,
};
use self::filter::{Filters, Seen, Strip};
use crate::difference::colour_picture::{ColourPicture, Pair, PicturePair, is_finite};

pub use self::colour::srgb_from_linear;
pub use self::magma::magma;

/// A screen 0.7 m wide with 3840 pixels, seen from 0.7 m; in single precision, which rounds it.
pub const PIXELS_PER_DEGREE: f64 = 67.020_645_141_601_562_5;

/// Errors of pictures of any brightness.
#[derive(Clone, Debug, PartialEq)]
pub struct HdrFlip {
    /// The error of each pixel, from 0 to 1: the greatest over the exposures.
    pub map: Vec<f32>,
    /// At which the pictures were compared.
    pub exposures: Exposures,
}

/// Exposures in stops, evenly spaced, both ends among them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposures {
    /// The darkest.
    pub start: f32,
    /// The brightest.
    pub stop: f32,
    /// How many there are, at least 2.
    pub count: usize,
}

/// The error of each pixel, from 0 to 1, of colours on the sRGB curve; what is outside of `[0, 1]` is clamped.
///
/// # Panics
/// If the pictures' sizes differ or do not fit their pixels, or if `pixels_per_degree` is not finite and positive.
#[must_use]
pub fn ldr_flip(reference: ColourPicture, test: ColourPicture, pixels_per_degree: f64) -> Vec<f32> {
    let pictures = [reference, test];
    ldr_errors(&Pair::checked(&pictures), pixels_per_degree)
}

/// As [`ldr_flip`], of pictures that are looked up.
pub(super) fn ldr_flip_of_pair(pictures: &impl PicturePair, pixels_per_degree: f64) -> Vec<f32> {
    ldr_errors(&Pair::new(pictures), pixels_per_degree)
}

fn ldr_errors(pair: &Pair<'_, impl PicturePair>, pixels_per_degree: f64) -> Vec<f32> {
    let linear = |colour: Colour| colour.map(|share| clamped(linear_from_srgb(share)));
    errors(pair, &filters(pixels_per_degree), linear)
}

/// As [`ldr_flip`], of linear colours.
///
/// # Panics
/// As [`ldr_flip`].
#[must_use]
pub fn ldr_flip_of_linear(reference: ColourPicture, test: ColourPicture, pixels_per_degree: f64) -> Vec<f32> {
    let pictures = [reference, test];
    errors(&Pair::checked(&pictures), &filters(pixels_per_degree), |colour| colour.map(clamped))
}

/// Errors of linear colours (Rec. 709) of any brightness, tone-mapped at [`Exposures`] that the reference needs.
///
/// Negative values are tone-mapped as they are, which makes small ones black and great ones bright.
///
/// # Panics
/// As [`ldr_flip`].
#[must_use]
pub fn hdr_flip(reference: ColourPicture, test: ColourPicture, pixels_per_degree: f64) -> HdrFlip {
    let pictures = [reference, test];
    hdr_errors(&Pair::checked(&pictures), &pictures, pixels_per_degree)
}

/// As [`hdr_flip`], of pictures that are looked up.
pub(super) fn hdr_flip_of_pair(pictures: &impl PicturePair, pixels_per_degree: f64) -> HdrFlip {
    hdr_errors(&Pair::new(pictures), pictures, pixels_per_degree)
}

fn hdr_errors<P: PicturePair>(pair: &Pair<'_, P>, pictures: &P, pixels_per_degree: f64) -> HdrFlip {
    let filters = filters(pixels_per_degree);
    let [width, height] = pair.size;
    let exposures = Exposures::for_reference((0..width * height).map(|place| pictures.colour(0, place)));
    let mut map = vec![0.0_f32; width * height];
    for exposure in exposures.iter() {
        // beyond, a factor would be infinite
        let factor = exp2(exposure.min(127.0));
        let linear = |colour: Colour| colour.map(|value| clamped(tone(value * factor)));
        let errors = errors(pair, &filters, linear);
        map.iter_mut().zip(errors).for_each(|(greatest, error)| *greatest = greatest.max(error));
    }
    HdrFlip { map, exposures }
}

/// The mean of a map of errors, in double precision.
pub fn mean_error(map: &[f32]) -> f64 {
    map.iter().copied().map(f64::from).sum::<f64>() / map.len() as f64
}

/// Numerator and denominator of the tone mapper ACES (Narkowicz 2015), highest power first, without its exposure of
/// 0.6, as the 2021 paper has it.
const ACES: [Colour; 2] =
    [[0.6_f32 * 0.6 * 2.51, 0.6_f32 * 0.03, 0.0], [0.6_f32 * 0.6 * 2.43, 0.6_f32 * 0.59, 0.14]];

fn tone(value: f32) -> f32 {
    let [above, below] = ACES.map(|[a, b, c]| value * value * a + value * b + c);
    // the squares of finite values overflow to a quotient of infinities
    if below == f32::INFINITY { 1.0 } else { above / below }
}

/// To `[0, 1]`; NaN to 0.
const fn clamped(value: f32) -> f32 {
    if value > 0.0 { value.min(1.0) } else { 0.0 }
}

impl Exposures {
    /// From where the reference's greatest luminance is mapped to 0.85, to where its median is (2021 paper).
    fn for_reference(reference: impl Iterator<Item = Colour>) -> Self {
        const BRIGHT: f32 = 0.85;
        let [a, b, c]: Colour = std::array::from_fn(|i| ACES[0][i] - BRIGHT * ACES[1][i]);
        let half = -0.5 * (b / a);
        let bright = half + (half * half - c / a).sqrt();
        let mut luminances: Vec<_> = reference.filter(is_finite).map(luminance).collect();
        let greatest = luminances.iter().copied().fold(0.0, f32::max);
        let middle = luminances.len() / 2;
        let median = if luminances.is_empty() {
            0.0
        } else {
            *luminances.select_nth_unstable_by(middle, f32::total_cmp).1
        };
        // the tool bounds the median so, and refuses pictures that are darker throughout
        let [start, stop] =
            [greatest, median].map(|value| log2(bright / value.clamp(f32::EPSILON, f32::MAX)));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "less than 200")]
        let count = (stop - start).ceil().max(2.0) as usize;
        Self { start, stop, count }
    }

    /// Each of them.
    pub fn iter(self) -> impl Iterator<Item = f32> {
        let step = (self.stop - self.start) / (self.count - 1) as f32;
        (0..self.count).map(move |index| self.start + index as f32 * step)
    }
}

/// LDR-FLIP of two pictures of which `linear` makes linear colours in `[0, 1]`, strip by strip.
fn errors(
    pair: &Pair<'_, impl PicturePair>,
    filters: &Filters,
    linear: impl Fn(Colour) -> Colour + Sync,
) -> Vec<f32> {
    let [width, height] = pair.size;
    let scale = ColourScale::new();
    let mut map = vec![0.0; width * height];
    let mut strips = [(); 2].map(|()| Strip::new(pair.size));
    let of_strip = Strip::height(filters, width);
    for (number, errors) in map.chunks_mut(of_strip * width).enumerate() {
        let first = number * of_strip;
        for (which, strip) in strips.iter_mut().enumerate() {
            let rows = first..first + errors.len() / width;
            strip.advance(filters, rows, |place| linear(pair.colour(which, place)));
        }
        errors.par_chunks_mut(width).enumerate().for_each(|(row, errors)| {
            let [reference, test] = strips.each_ref().map(|strip| filters.down(strip, first + row));
            for (error, (a, b)) in errors.iter_mut().zip(reference.iter().zip(&test)) {
                // The final difference; what rounding leaves beyond 1, or makes of 0 to the power of 0, is 1
                *error = power(scale.difference(a, b), 1.0 - feature_difference(a, b)).min(1.0);
            }
        });
    }
    for &place in &pair.damaged {
        map[place] = 1.0;
    }
    map
}

/// How differences of colours become errors: the redistribution of the 2020 paper's colour pipeline.
#[derive(Clone, Copy)]
struct ColourScale {
    /// The greatest difference there is, between green and blue.
    greatest: f32,
    /// The one that has an error of [`Self::BREAK`].
    large: f32,
}

impl ColourScale {
    const EXPONENT: f32 = 0.7;
    const BREAK: f32 = 0.95;

    fn new() -> Self {
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(perceived);
        let greatest = power(hyab(green, blue), Self::EXPONENT);
        Self { greatest, large: 0.4 * greatest }
    }

    /// From 0 to 1, of two pixels' colours.
    fn difference(self, a: &Seen, b: &Seen) -> f32 {
        let linear = [a, b].map(|seen| linear_from_opponent(seen.opponent));
        // saves the roots, which take half of the time
        if linear[0] == linear[1] {
            return 0.0;
        }
        let [a, b] = linear.map(perceived);
        let difference = power(hyab(a, b), Self::EXPONENT);
        if difference < self.large {
            difference * (Self::BREAK / self.large)
        } else {
            let beyond = (difference - self.large) / (self.greatest - self.large);
            Self::BREAK + beyond * (1.0 - Self::BREAK)
        }
    }
}

/// The greater difference of edges and points, from 0 to 1: the 2020 paper's feature pipeline.
fn feature_difference(a: &Seen, b: &Seen) -> f32 {
    let greater = (a.edge - b.edge).abs().max((a.point - b.point).abs());
    (FRAC_1_SQRT_2 * greater).sqrt()
}

/// # Panics
/// If the number is not finite and positive.
fn filters(pixels_per_degree: f64) -> Filters {
    assert!(pixels_per_degree > 0.0 && pixels_per_degree.is_finite(), "pixels per degree are positive");
    Filters::new(to_f32(pixels_per_degree))
}

#[cfg(test)]
mod tests {
    use rayon::ThreadPoolBuilder;

    use super::*;

    const SIZE: [usize; 2] = [24, 16];

    fn picture([width, height]: [usize; 2], value: impl Fn(usize, usize, usize) -> f32) -> Vec<Colour> {
        (0..width * height)
            .map(|place| std::array::from_fn(|channel| value(place % width, place / width, channel)))
            .collect()
    }

    fn wave(x: usize, y: usize, channel: usize) -> f32 {
        ((x * 7 + y * 13 + channel * 5 + x * y) % 32) as f32 / 32.0
    }

    fn checks(x: usize, y: usize, channel: usize) -> f32 {
        ((x / 4 + y / 3 + channel) % 2) as f32 * 0.5 + 0.25
    }

    fn of(size: [usize; 2], pixels: &[Colour]) -> ColourPicture<'_> {
        ColourPicture { size, pixels }
    }

    /// Mean, first pixel and the one at (9, 6).
    fn assert_map(map: &[f32], want: [f64; 3], what: &str) {
        let got = [mean_error(map), map[0].into(), map[6 * SIZE[0] + 9].into()];
        for (got, want) in got.into_iter().zip(want) {
            assert!((got - want).abs() < 1e-6, "{what}: got {got}, want {want}");
        }
    }

    // the figures of these two are flip-evaluator 1.7's: evaluate(..., applyMagma=False)

    #[test]
    fn errors_are_the_tools() {
        let (a, b) = (picture(SIZE, wave), picture(SIZE, checks));
        let [a, b] = [&a, &b].map(|pixels| of(SIZE, pixels));
        assert_map(&ldr_flip(a, b, PIXELS_PER_DEGREE), [0.4535132, 0.9671497, 0.1849343], "ldr");
        assert_map(&ldr_flip_of_linear(a, b, PIXELS_PER_DEGREE), [0.4235680, 0.9667680, 0.2076745], "linear");
        let tiny = |width: usize, height: usize, first: usize| {
            let [a, b] = [wave, checks].map(|f| picture([width, height], |x, y, c| f(x + first, y, c)));
            mean_error(&ldr_flip(of([width, height], &a), of([width, height], &b), PIXELS_PER_DEGREE))
        };
        for (got, want) in [(tiny(1, 1, 3), 0.9599783), (tiny(3, 2, 0), 0.9722119)] {
            assert!((got - want).abs() < 1e-6, "tiny: got {got}, want {want}");
        }
    }

    #[test]
    fn errors_of_any_brightness_are_the_tools() {
        let (a, b) = (picture(SIZE, wave), picture(SIZE, checks));
        let product = |i: usize, f: &dyn Fn(f32, f32) -> f32| -> Colour {
            std::array::from_fn(|channel| f(a[i][channel], b[i][channel]))
        };
        let combined = |f: &dyn Fn(f32, f32) -> f32| (0..a.len()).map(|i| product(i, f)).collect::<Vec<_>>();
        let bright = [combined(&|a, _| a * a * 1000.0), combined(&|a, b| a * b * 1000.0)];
        let dark = [combined(&|a, _| a * 1e-4), combined(&|_, b| b * 1e-4)];
        // the median is 0
        let black = [combined(&|a, _| if a > 0.95 { a } else { 0.0 }), b.clone()];
        let cases = [
            ("bright", bright, (-8.583_239, -6.674_301, 2), [0.3280370, 0.8027748, 0.2473443]),
            ("dark", dark, (14.564_294, 15.533_268, 2), [0.3562449, 0.7717243, 0.2079947]),
            ("black", black, (1.612_682_2, 24.083_298, 23), [0.9693263, 0.9714479, 0.9708743]),
        ];
        for (what, [a, b], (start, stop, count), want) in cases {
            let flip = hdr_flip(of(SIZE, &a), of(SIZE, &b), PIXELS_PER_DEGREE);
            assert_map(&flip.map, want, what);
            assert_eq!(flip.exposures, Exposures { start, stop, count }, "{what}");
        }
    }

    #[test]
    fn errors_are_from_none_to_1() {
        let (a, b) = (picture(SIZE, wave), picture(SIZE, checks));
        let extremes = picture(SIZE, |x, y, c| [0.0, 3e38, -3e38, 1e-45, 1e20][(x + 3 * y + c) % 5]);
        for first in [&a, &b, &extremes] {
            for second in [&a, &b, &extremes] {
                for pixels_per_degree in [1e-3, 1.0, 20.0, PIXELS_PER_DEGREE] {
                    let [first, second] = [first, second].map(|pixels| of(SIZE, pixels));
                    let hdr = hdr_flip(first, second, pixels_per_degree).map;
                    for map in [ldr_flip(first, second, pixels_per_degree), hdr] {
                        assert!(map.iter().all(|error| (0.0..=1.0).contains(error)));
                        let same = first.pixels == second.pixels;
                        assert_eq!(map.iter().all(|error| *error == 0.0), same);
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_not_finite_in_one_picture_is_an_error_of_1_there_alone() {
        let a = picture(SIZE, wave);
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut b = a.clone();
            b[100][1] = value;
            for (first, second) in [(&a, &b), (&b, &a)] {
                let [first, second] = [first, second].map(|pixels| of(SIZE, pixels));
                let hdr = hdr_flip(first, second, PIXELS_PER_DEGREE).map;
                for map in [ldr_flip(first, second, PIXELS_PER_DEGREE), hdr] {
                    let want = |place| if place == 100 { 1.0 } else { 0.0 };
                    assert!(map.iter().enumerate().all(|(place, error)| *error == want(place)));
                }
            }
            let same = ldr_flip(of(SIZE, &b), of(SIZE, &b), PIXELS_PER_DEGREE);
            assert!(same.iter().all(|error| *error == 0.0));
        }
        let all = [[f32::NAN; 3]];
        assert_eq!(hdr_flip(of([1, 1], &all), of([1, 1], &[[0.0; 3]]), PIXELS_PER_DEGREE).map, [1.0]);
    }

    #[test]
    fn a_black_reference_is_compared_at_the_greatest_exposure() {
        let (black, white) = (picture(SIZE, |_, _, _| 0.0), picture(SIZE, |_, _, _| 1.0));
        let flip = hdr_flip(of(SIZE, &black), of(SIZE, &white), PIXELS_PER_DEGREE);
        assert_eq!(flip.exposures.start, flip.exposures.stop);
        assert_eq!(flip.exposures.iter().count(), 2);
        assert!(flip.map.iter().all(|error| *error > 0.9));
    }

    #[test]
    fn threads_change_no_bit() {
        let (a, b) = (picture(SIZE, wave), picture(SIZE, checks));
        let [one, four] = [1, 4].map(|threads| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| hdr_flip(of(SIZE, &a), of(SIZE, &b), PIXELS_PER_DEGREE))
        });
        assert_eq!(one, four);
    }

    #[test]
    fn curves_undo_each_other() {
        for n in 0..=1000 {
            let linear = n as f32 / 1000.0;
            assert!((linear_from_srgb(srgb_from_linear(linear)) - linear).abs() < 2e-7);
        }
        // IEC 61966-2-1
        assert!((srgb_from_linear(0.214_041_14) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn the_greatest_difference_of_colours_is_1() {
        let (green, blue) = ([[0.0, 1.0, 0.0]; 30 * 30], [[0.0, 0.0, 1.0]; 30 * 30]);
        let map = ldr_flip(of([30, 30], &green), of([30, 30], &blue), PIXELS_PER_DEGREE);
        assert!(map.iter().all(|error| *error > 0.999_99));
    }
}
