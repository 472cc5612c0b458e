//! The numbers that samples add up to in one pixel, and the pixel they make.

use glam::DVec3;

use super::filter::Filter;

/// How many numbers a pixel has.
pub(super) const fn numbers(filter: Filter) -> usize {
    if matches!(filter, Filter::Box) { BoxSums::NUMBERS } else { FilterSums::NUMBERS }
}

/// Adds the sums of other samples to a pixel's; with no samples on one side the others' numbers stay as they are.
pub(super) fn combine(filter: Filter, sums: &mut [f64], others: &[f64]) {
    if filter == Filter::Box {
        BoxSums::combine(sums, others);
    } else {
        sums.iter_mut().zip(others).for_each(|(sum, other)| *sum += other);
    }
}

/// A pixel's colour, alpha, and the variance of its colour.
pub(super) fn develop(filter: Filter, sums: &[f64]) -> (DVec3, f64, DVec3) {
    if filter == Filter::Box { BoxSums::develop(sums) } else { FilterSums::develop(sums) }
}

/// A pixel under the box filter: count, mean, sum of squared deviations from it, and sum of alpha.
pub(super) struct BoxSums;

impl BoxSums {
    pub(super) const NUMBERS: usize = 8;

    pub(super) fn add(sums: &mut [f64], radiance: DVec3, alpha: f64) {
        sums[0] += 1.0;
        for (channel, value) in radiance.to_array().into_iter().enumerate() {
            let before = value - sums[1 + channel];
            sums[1 + channel] += before / sums[0];
            sums[4 + channel] += before * (value - sums[1 + channel]);
        }
        sums[7] += alpha;
    }

    /// Adds the sums of other samples as Chan, Golub and `LeVeque` (1983), *Algorithms for computing the sample variance*,
    /// equation 2.1: means by counts, squares about the common mean.
    fn combine(sums: &mut [f64], others: &[f64]) {
        if others[0] == 0.0 {
            return;
        }
        let (before, count) = (sums[0], sums[0] + others[0]);
        let share = others[0] / count;
        for channel in 0..3 {
            let difference = others[1 + channel] - sums[1 + channel];
            sums[1 + channel] += difference * share;
            sums[4 + channel] += others[4 + channel] + difference * difference * (before * share);
        }
        sums[0] = count;
        sums[7] += others[7];
    }

    /// Mean, alpha and the mean's variance: the samples' variance s² = Σ(x - mean)² / (n - 1), over n. 0 for one sample,
    /// which says nothing of it.
    pub(super) fn develop(sums: &[f64]) -> (DVec3, f64, DVec3) {
        let count = sums[0];
        let of_mean = if count < 2.0 { 0.0 } else { 1.0 / (count * (count - 1.0)) };
        (DVec3::from_slice(&sums[1..]), sums[7] / count.max(1.0), DVec3::from_slice(&sums[4..]) * of_mean)
    }
}

/// A pixel under other filters: sums over the samples of the pixels around it, of the weights w, of w x and w alpha; and
/// what its variance needs of each [`Deviation`].
pub(super) struct FilterSums;

/// How far samples of one pixel are spread, as they count for one pixel: Σ w², and n / (n - 1) times the sums of squares and
/// products of w x and w about their means. Samples are spread over each pixel alike, so that only their spread within it
/// is chance.
#[derive(Clone, Copy, Default)]
pub(super) struct Deviation {
    count: f64,
    weight: f64,
    value: DVec3,
    pub(super) weight_sq: f64,
    product: DVec3,
    value_sq: DVec3,
}

impl Deviation {
    pub(super) fn add(&mut self, weight: f64, radiance: DVec3) {
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
    pub(super) const NUMBERS: usize = 14;

    pub(super) fn add(sums: &mut [f64], alpha: f64, of_pixel: &Deviation) {
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
    pub(super) fn develop(sums: &[f64]) -> (DVec3, f64, DVec3) {
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
