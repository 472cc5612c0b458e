//! SSIM: how alike the structures of two pictures are.
//!
//! Wang, Bovik, Sheikh and Simoncelli (2004), *Image Quality Assessment: From Error Visibility to Structural
//! Similarity*, with their Gaussian window and constants for values from 0 to 1; each channel by itself, then their
//! mean. Borders are as in scikit-image: mirrored there, and not part of the mean.

use rayon::prelude::*;

use crate::difference::colour_picture::{ColourPicture, Pair, PicturePair};

/// How far the window reaches to each side.
const RADIUS: usize = 5;
/// Standard deviation of the window's weights, in pixels.
const DEVIATION: f64 = 1.5;
/// (K1 L)² and (K2 L)².
const STABLE: [f64; 2] = [0.01 * 0.01, 0.03 * 0.03];
/// Means over the window: of a, b, a², b² and a b.
const MEANS: usize = 5;

/// Structural similarity of two pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Ssim {
    /// The mean of the map without the outermost 5 pixels on each side; of a picture smaller than the window of
    /// 11x11, of all of it.
    pub mean: f64,
    /// The mean over the channels of each pixel, from -1 to 1; where the pictures are the same, 1.
    pub map: Vec<f64>,
}

/// Structural similarity of two pictures with values from 0 to 1, such as ones on the sRGB curve.
///
/// Beyond its border a picture goes on mirrored, the border's pixels twice. A pixel that is not finite in one
/// picture, and not the same in the other, counts as black against white; one that is the same in both as black in
/// both.
///
/// # Panics
/// If the pictures' sizes differ or do not fit their pixels.
#[must_use]
pub fn ssim(reference: ColourPicture, test: ColourPicture) -> Ssim {
    let pictures = [reference, test];
    similarities(&Pair::checked(&pictures))
}

/// As [`ssim`], of pictures that are looked up.
pub(super) fn ssim_of_pair(pictures: &impl PicturePair) -> Ssim {
    similarities(&Pair::new(pictures))
}

fn similarities(pair: &Pair<'_, impl PicturePair>) -> Ssim {
    let [width, height] = pair.size;
    let (reference, mut test) = (pair.colours(0), pair.colours(1));
    for &place in &pair.damaged {
        test[place] = [1.0; 3];
    }
    let mut map = vec![0.0; width * height];
    for channel in 0..3 {
        let value = |pixels: &[[f32; 3]], place: usize| f64::from(pixels[place][channel]);
        let across = across(width, height, |place| [value(&reference, place), value(&test, place)]);
        map.par_chunks_mut(width).enumerate().for_each(|(y, map)| {
            let mut means = vec![0.0; width * MEANS];
            for (step, weight) in weights().into_iter().enumerate() {
                let from = mirrored(y + step, height);
                let row = &across[from * width * MEANS..][..width * MEANS];
                add(&mut means, row, weight);
            }
            let (means, _) = means.as_chunks();
            map.iter_mut().zip(means).for_each(|(sum, means)| *sum += similarity(*means) / 3.0);
        });
    }
    Ssim { mean: mean(&map, [width, height]), map }
}

/// Means over the window's rows, of each pixel.
fn across(width: usize, height: usize, values: impl Fn(usize) -> [f64; 2] + Sync) -> Vec<f64> {
    let mut rows = vec![0.0; width * height * MEANS];
    rows.par_chunks_mut(width * MEANS).enumerate().for_each(|(y, sums)| {
        let bordered: Vec<f64> = (0..width + 2 * RADIUS)
            .flat_map(|x| {
                let [a, b] = values(y * width + mirrored(x, width));
                [a, b, a * a, b * b, a * b]
            })
            .collect();
        for (step, weight) in weights().into_iter().enumerate() {
            add(sums, &bordered[step * MEANS..], weight);
        }
    });
    rows
}

/// The paper's product of the comparisons of luminance, contrast and structure, with its third constant half of the
/// second.
fn similarity([a, b, aa, bb, ab]: [f64; MEANS]) -> f64 {
    let (variances, covariance) = (aa - a * a + (bb - b * b), ab - a * b);
    let above = (2.0 * a * b + STABLE[0]) * (2.0 * covariance + STABLE[1]);
    above / ((a * a + b * b + STABLE[0]) * (variances + STABLE[1]))
}

fn mean(map: &[f64], size: [usize; 2]) -> f64 {
    let cut = if size.iter().all(|&side| side > 2 * RADIUS) { RADIUS } else { 0 };
    let [width, height] = size;
    let rows = map.chunks(width).skip(cut).take(height - 2 * cut);
    let sum: f64 = rows.flat_map(|row| &row[cut..width - cut]).sum();
    sum / ((width - 2 * cut) * (height - 2 * cut)) as f64
}

fn weights() -> [f64; 2 * RADIUS + 1] {
    let gaussian: [f64; 2 * RADIUS + 1] = std::array::from_fn(|step| {
        let x = (step as f64 - RADIUS as f64) / DEVIATION;
        libm::exp(-0.5 * x * x)
    });
    let sum: f64 = gaussian.iter().sum();
    gaussian.map(|weight| weight / sum)
}

/// The pixel at `place - RADIUS`, of `count` that go on mirrored without end.
const fn mirrored(place: usize, count: usize) -> usize {
    let period = 2 * count;
    // RADIUS periods more keep it positive
    let place = (place + RADIUS * period - RADIUS) % period;
    if place < count { place } else { period - 1 - place }
}

fn add(sums: &mut [f64], values: &[f64], weight: f64) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += weight * value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [24, 16];

    fn wave(x: usize, y: usize, channel: usize) -> f32 {
        ((x * 7 + y * 13 + channel * 5 + x * y) % 32) as f32 / 32.0
    }

    fn checks(x: usize, y: usize, channel: usize) -> f32 {
        ((x / 4 + y / 3 + channel) % 2) as f32 * 0.5 + 0.25
    }

    fn picture([width, height]: [usize; 2], value: impl Fn(usize, usize, usize) -> f32) -> Vec<[f32; 3]> {
        (0..width * height)
            .map(|place| std::array::from_fn(|channel| value(place % width, place / width, channel)))
            .collect()
    }

    fn compare(size: [usize; 2], a: &[[f32; 3]], b: &[[f32; 3]]) -> Ssim {
        ssim(ColourPicture { size, pixels: a }, ColourPicture { size, pixels: b })
    }

    #[test]
    fn likeness_is_that_of_scikit_image() {
        // scikit-image 0.26.0: structural_similarity(a, b, data_range=1.0, channel_axis=2, gaussian_weights=True,
        // sigma=1.5, use_sample_covariance=False, full=True): mean, and the map's mean at (0, 0), (9, 6), (23, 15)
        let a = picture(SIZE, wave);
        let cases = [
            (
                picture(SIZE, checks),
                [0.01819068797444817, 0.0495201121984751, -0.008754123633178615, -0.22041990704259437],
            ),
            (
                picture(SIZE, |x, y, c| 0.75 * wave(x, y, c) + 0.25 * checks(x, y, c)),
                [0.932645044372625, 0.9491256558896718, 0.9313026118571962, 0.9160284260817996],
            ),
        ];
        for (b, want) in cases {
            let Ssim { mean, map } = compare(SIZE, &a, &b);
            for (got, want) in [mean, map[0], map[6 * 24 + 9], map[15 * 24 + 23]].into_iter().zip(want) {
                assert!((got - want).abs() < 1e-12, "got {got}, want {want}");
            }
        }
    }

    #[test]
    fn likeness_is_from_minus_1_to_1() {
        for size in [[1, 1], [2, 1], [3, 40], [10, 11], [11, 11], [30, 12]] {
            let a = picture(size, wave);
            let b = picture(size, |x, y, c| 1.0 - wave(x, y, c));
            let same = compare(size, &a, &a);
            assert!(
                (same.mean - 1.0).abs() < 1e-12 && same.map.iter().all(|value| (value - 1.0).abs() < 1e-12)
            );
            let opposite = compare(size, &a, &b);
            let bounds = -1.0..=1.0;
            assert!(bounds.contains(&opposite.mean) && opposite.map.iter().all(|v| bounds.contains(v)));
            assert_eq!(opposite, compare(size, &b, &a));
        }
    }

    #[test]
    fn what_is_not_finite_in_one_picture_is_unlike() {
        let a = picture(SIZE, |_, _, _| 0.5);
        // also in the border, which is not part of the mean
        for place in [0, 9 * SIZE[0] + 9] {
            let mut b = a.clone();
            b[place][2] = f32::NAN;
            for Ssim { mean, map } in [compare(SIZE, &a, &b), compare(SIZE, &b, &a)] {
                assert!(mean < 1.0 && map[place] < 0.5 && map.iter().all(|value| value.is_finite()));
            }
            let same = compare(SIZE, &b, &b);
            assert!((same.mean - 1.0).abs() < 1e-12);
        }
    }
}
