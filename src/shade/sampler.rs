//! Random numbers.

use glam::DVec2;

/// 2^64 divided by the golden ratio, rounded to odd: the step of `SplitMix64`.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// 2^-53, the distance of the doubles that [`Sampler::next_1d`] gives.
const TO_UNIT: f64 = 1.0 / 9_007_199_254_740_992.0;

/// Independent samples, as Mitsuba's `independent`, but counted instead of drawn in sequence.
///
/// Each number is a hash of (seed, pixel, sample index, dimension) alone. So crops, threads and
/// the order of work do not change a single bit.
///
/// The hash is the finaliser of `SplitMix64` (Steele, Lea and Flood 2014; constants by Stafford,
/// "mix13"), applied once for each part of the key and once for each number. The numbers of one
/// (pixel, sample) are a stretch of a `SplitMix64` sequence, which passes `BigCrush`; a path draws
/// some hundred of them out of 2^64. The starts are well mixed, and since the finaliser is a
/// bijection, two pixels never share one at the same sample index.
#[derive(Clone, Debug)]
pub struct Sampler {
    /// Where the sequence is; each number moves on by [`STEP`].
    state: u64,
}

impl Sampler {
    /// The numbers of sample `sample` of `pixel`, from dimension 0 on.
    pub const fn new(seed: u64, pixel: [u32; 2], sample: u32) -> Self {
        let pixel = (pixel[0] as u64) | ((pixel[1] as u64) << 32);
        let of_pixel = mix(mix(seed.wrapping_add(STEP)) ^ pixel);
        let of_sample = mix(of_pixel ^ (sample as u64).wrapping_mul(STEP));
        Self { state: of_sample }
    }

    /// The next dimension: uniform in `[0, 1)`, a multiple of 2^-53.
    pub const fn next_1d(&mut self) -> f64 {
        self.state = self.state.wrapping_add(STEP);
        (mix(self.state) >> 11) as f64 * TO_UNIT
    }

    /// The next two dimensions.
    pub const fn next_2d(&mut self) -> DVec2 {
        let x = self.next_1d();
        DVec2::new(x, self.next_1d())
    }
}

/// The finaliser of `SplitMix64`: a bijection in which each input bit flips each output bit with a
/// probability near one half.
const fn mix(mut bits: u64) -> u64 {
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Which of `count` equal parts of `[0, 1)` a value is in.
    fn part(value: f64, count: u32) -> usize {
        (1..count).take_while(|&i| value >= f64::from(i) / f64::from(count)).count()
    }

    /// Chi-square of counts against equal shares, as a number of standard deviations.
    fn deviation(counts: &[u32]) -> f64 {
        let total: u32 = counts.iter().sum();
        let share = f64::from(total) / counts.len() as f64;
        let chi_sq: f64 = counts.iter().map(|&n| (f64::from(n) - share).powi(2) / share).sum();
        let freedom = counts.len() as f64 - 1.0;
        (chi_sq - freedom) / (2.0 * freedom).sqrt()
    }

    #[test]
    fn each_dimension_is_uniform() {
        for dimension in 0..12 {
            let mut counts = [0; 64];
            for y in 0..64 {
                for x in 0..64 {
                    for sample in 0..8 {
                        let mut sampler = Sampler::new(0, [x, y], sample);
                        let value = (0..=dimension).map(|_| sampler.next_1d()).last().unwrap();
                        assert!((0.0..1.0).contains(&value));
                        counts[part(value, 64)] += 1;
                    }
                }
            }
            let off = deviation(&counts);
            assert!(off.abs() < 4.5, "dimension {dimension}: chi-square off by {off} sigma");
        }
    }

    #[test]
    fn neighbours_are_independent() {
        // pairs that differ in one part of the key each fill an 8x8 grid evenly
        let first = |seed, x, y, sample| Sampler::new(seed, [x, y], sample).next_1d();
        let second = |x, y, sample| {
            let mut sampler = Sampler::new(0, [x, y], sample);
            sampler.next_1d();
            sampler.next_1d()
        };
        let mut counts = [[0; 64]; 6];
        for y in 0..128 {
            for x in 0..128 {
                for sample in 0..4 {
                    let here = first(0, x, y, sample);
                    let beside = [
                        first(0, x + 1, y, sample),
                        first(0, x, y + 1, sample),
                        first(0, y, x + 1000, sample),
                        first(0, x, y, sample + 1),
                        first(1, x, y, sample),
                        second(x, y, sample),
                    ];
                    for (counts, there) in counts.iter_mut().zip(beside) {
                        counts[part(here, 8) * 8 + part(there, 8)] += 1;
                    }
                }
            }
        }
        for (pair, counts) in counts.iter().enumerate() {
            let off = deviation(counts);
            assert!(off.abs() < 4.5, "pair {pair}: chi-square off by {off} sigma");
        }
    }

    #[test]
    fn numbers_are_fixed() {
        // worked out apart from this code; a change here changes every picture
        let mut sampler = Sampler::new(7, [3, 5], 11);
        let got = [sampler.next_1d(), sampler.next_1d()];
        assert_eq!(got.map(f64::to_bits), NUMBERS);
        assert_eq!(Sampler::new(7, [3, 5], 11).next_1d().to_bits(), NUMBERS[0]);
    }

    const NUMBERS: [u64; 2] = [4582865175078260768, 4588333695895178608];
}
