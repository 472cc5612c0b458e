//! Whether two noisy pictures differ by more than their noise.

use std::fmt;

use serde::Serialize;

/// Greatest relative difference of mean radiance, unless the noise explains a greater one.
const MEAN: f64 = 0.003;

/// Standard deviations of mean radiance that noise explains.
const SIGMAS: f64 = 3.0;

/// Chance for any value of a picture to fail its test if both pictures are of the same thing (Šidák).
const SIGNIFICANCE: f64 = 0.01;

/// Share of the values that must pass: some room for variances that are estimates themselves.
const SHARE: f64 = 0.9975;

/// Relative variance below which a value has no noise, and the relative difference by rounding that it may have then.
const NOISELESS: f64 = 1e-12;
const ROUNDING: f64 = 1e-5;

/// Radiance with the variance of its mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// One colour's pixels after the other's, each as many.
    pub radiance: Vec<f64>,
    /// The variance of each radiance.
    pub variance: Vec<f64>,
    /// How many colours there are.
    pub colours: usize,
}

/// The difference of one colour's mean radiance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MeanDifference {
    /// Mean of the test over that of the reference, less 1.
    pub relative: f64,
    /// The same in standard deviations of its noise.
    pub sigmas: f64,
}

/// What the test found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ZTest {
    /// Whether noise explains all differences.
    pub passes: bool,
    /// The difference of each colour's mean.
    pub means: Vec<MeanDifference>,
    /// How many values have noise; each was tested.
    pub values: usize,
    /// The share of them that passed.
    pub share: f64,
    /// The p-value below which a value fails: 1 - (1 - 0.01)^(1/values).
    pub significance: f64,
    /// The largest |z|: the difference in standard deviations of its noise.
    pub largest_z: f64,
    /// The p-value of the largest |z|: the chance that noise alone gives a |z| as large.
    pub smallest_p: f64,
    /// Root of the mean of z²: 1 if the variances are true and the pictures are of the same thing.
    pub rms_z: f64,
    /// Values without noise that differ by more than rounding.
    pub noiseless_off: usize,
    /// Values that are not finite, and not the same in both.
    pub non_finite: usize,
}

/// Tests each value of two pictures of independent noise, and their mean radiance (Mitsuba's test of its pictures, with the
/// variance of both).
///
/// z = (test - reference) / √(sum of the variances) of a value is normally distributed if both have the same expectation and
/// enough samples; its two-sided p-value is erfc(|z| / √2). The pictures pass if
///
/// - at least 99.75 % of the values have a p-value above 1 - (1 - 0.01)^(1/values) (Šidák),
/// - values without variance agree to rounding (1e-5),
/// - the mean radiance of each colour agrees to 0.3 % or to 3 standard deviations, and
/// - all is finite; what is not finite in both alike is left out.
///
/// # Panics
/// If the pictures are of different sizes.
pub fn z_test(reference: &Estimate, test: &Estimate) -> ZTest {
    let lengths = [&reference.radiance, &reference.variance, &test.radiance, &test.variance].map(Vec::len);
    assert!(lengths.iter().all(|&length| length == lengths[0]), "as many values in both: {lengths:?}");
    let pixels = lengths[0] / reference.colours.max(1);
    let (mut noisy, mut noiseless_off, mut non_finite) = (Vec::new(), 0, 0);
    let mut sums = vec![[0.0; 3]; reference.colours];
    for index in 0..lengths[0] {
        let (a, b) = (test.radiance[index], reference.radiance[index]);
        let variance = test.variance[index] + reference.variance[index];
        if !(a.is_finite() && b.is_finite() && variance.is_finite()) {
            non_finite += usize::from(!(a == b || (a.is_nan() && b.is_nan())) || a.is_finite());
            continue;
        }
        for (sum, value) in sums[index / pixels].iter_mut().zip([a, b, variance]) {
            *sum += value;
        }
        if variance > NOISELESS * b * b {
            noisy.push((a - b) * (a - b) / variance);
        } else if (a - b).abs() > ROUNDING * b.abs() {
            noiseless_off += 1;
        }
    }
    let mut passes = noiseless_off == 0 && non_finite == 0;
    let means = sums.iter().map(|&[ours, theirs, variance]| {
        if ours == theirs {
            return MeanDifference { relative: 0.0, sigmas: 0.0 };
        }
        let relative = ours / theirs - 1.0;
        let sigma = variance.sqrt() / theirs.abs();
        MeanDifference { relative, sigmas: relative / sigma }
    });
    let means: Vec<_> = means.collect();
    // written so that NaN fails
    passes &= means.iter().all(|mean| mean.relative.abs() <= MEAN || mean.sigmas.abs() <= SIGMAS);
    let count = noisy.len().max(1) as f64;
    let significance = 1.0 - libm::pow(1.0 - SIGNIFICANCE, 1.0 / count);
    let p_value = |z_sq: f64| libm::erfc((0.5 * z_sq).sqrt());
    let passed = noisy.iter().filter(|&&z_sq| p_value(z_sq) > significance).count();
    let share = if noisy.is_empty() { 1.0 } else { passed as f64 / count };
    let largest = noisy.iter().fold(0.0, |most: f64, &z_sq| most.max(z_sq));
    passes &= share >= SHARE;
    ZTest {
        passes,
        means,
        values: noisy.len(),
        share,
        significance,
        largest_z: largest.sqrt(),
        smallest_p: p_value(largest),
        rms_z: (noisy.iter().sum::<f64>() / count).sqrt(),
        noiseless_off,
        non_finite,
    }
}

impl fmt::Display for ZTest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for mean in &self.means {
            write!(f, "{:+.3} % ({:+.2} sigma) ", 100.0 * mean.relative, mean.sigmas)?;
        }
        write!(
            f,
            "| {:.3} % of {} values pass, largest |z| {:.2}, root mean square {:.3}",
            100.0 * self.share,
            self.values,
            self.largest_z,
            self.rms_z
        )?;
        if self.noiseless_off > 0 {
            write!(f, ", {} WITHOUT NOISE ARE OFF", self.noiseless_off)?;
        }
        if self.non_finite > 0 {
            write!(f, ", {} ARE NOT FINITE", self.non_finite)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Normally distributed noise of variance 1e-4 on a radiance of 0.5: sums of 12 uniform numbers.
    fn noisy(seed: u64) -> Estimate {
        let mut state = seed;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let radiance = (0..30_000).map(|_| 0.5 + 0.01 * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0));
        Estimate { radiance: radiance.collect(), variance: vec![1e-4; 30_000], colours: 3 }
    }

    #[test]
    fn noise_passes_and_differences_do_not() {
        let (a, b) = (noisy(1), noisy(2));
        let found = z_test(&a, &b);
        assert!(found.passes, "{found}");
        assert!((found.rms_z - 1.0).abs() < 0.02 && found.largest_z < 5.5, "{found}");
        assert_eq!((found.values, found.means.len()), (30_000, 3));
        let with = |change: &dyn Fn(&mut Estimate)| {
            let mut changed = b.clone();
            change(&mut changed);
            z_test(&a, &changed)
        };
        assert!(
            !with(&|p| p.radiance[..10_000].iter_mut().for_each(|x| *x *= 1.01)).passes,
            "red too bright"
        );
        assert!(!with(&|p| p.radiance[500..600].iter_mut().for_each(|x| *x *= 1.3)).passes, "a speck");
        assert_eq!(with(&|p| p.radiance[7] = f64::NAN).non_finite, 1);
        assert!(!with(&|p| p.variance[7] = f64::NAN).passes);
    }

    #[test]
    fn values_without_noise_agree_to_rounding() {
        let exact = |value: f64| Estimate { radiance: vec![value; 3], variance: vec![0.0; 3], colours: 3 };
        assert!(z_test(&exact(1.0), &exact(1.0 + 1e-6)).passes);
        assert!(z_test(&exact(0.0), &exact(0.0)).passes, "black");
        let off = z_test(&exact(1.0), &exact(1.0 + 1e-4));
        assert_eq!((off.passes, off.noiseless_off), (false, 3));
        let nan = z_test(&exact(f64::NAN), &exact(f64::NAN));
        assert!(nan.passes, "the same in both");
    }
}
