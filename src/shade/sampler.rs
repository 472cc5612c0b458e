//! Random numbers.

use crate::choice::Choice;
use crate::random::{STEP, mix, to_unit};
use glam::DVec2;

/// How random numbers are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum SamplerKind {
    /// Each by itself, as Mitsuba's `independent`.
    #[default]
    Independent,
    /// Well spread over each pixel's samples: an Owen-scrambled Sobol sequence.
    Sobol,
}

impl Choice for SamplerKind {
    const WHAT: &'static str = "sampler";
    const ALL: &'static [Self] = &[Self::Independent, Self::Sobol];

    fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Sobol => "sobol",
        }
    }
}

/// The random numbers of one sample of one pixel, counted instead of drawn in sequence.
///
/// Each number is a hash of (seed, pixel, sample index, dimension) alone. So crops, threads and
/// the order of work do not change a single bit.
///
/// # Independent
/// The hash is the finaliser of `SplitMix64` (Steele, Lea and Flood 2014; constants by Stafford,
/// "mix13"), applied once for each part of the key and once for each number. The numbers of one
/// (pixel, sample) are a stretch of a `SplitMix64` sequence, which passes `BigCrush`; a path draws
/// some hundred of them out of 2^64. The starts are well mixed, and since the finaliser is a
/// bijection, two pixels never share one at the same sample index.
///
/// # Sobol
/// Each call draws from the first dimensions of the Sobol sequence, its order shuffled and its values scrambled as Owen
/// (1995) does, by hashes of (seed, pixel, call): Burley (2020), *Practical hash-based Owen scrambling*. So a call's
/// numbers over any 2^k samples from a multiple of 2^k on are a (0, k, 2)-net, and calls are independent of each other.
/// The values are multiples of 2^-32.
#[derive(Clone, Debug)]
pub struct Sampler {
    /// Where the sequence is; each number, or each call for Sobol's, moves on by [`STEP`].
    state: u64,
    /// Index of the sample, for Sobol's.
    index: Option<u32>,
}

impl SamplerKind {
    /// The numbers of sample `sample` of `pixel`, from dimension 0 on.
    #[must_use]
    pub const fn sampler(self, seed: u64, pixel: [u32; 2], sample: u32) -> Sampler {
        match self {
            Self::Independent => Sampler::new(seed, pixel, sample),
            Self::Sobol => Sampler { state: pixel_hash(seed, pixel), index: Some(sample) },
        }
    }
}

impl Sampler {
    /// The independent numbers of sample `sample` of `pixel`, from dimension 0 on.
    #[must_use]
    pub const fn new(seed: u64, pixel: [u32; 2], sample: u32) -> Self {
        let of_sample = mix(pixel_hash(seed, pixel) ^ (sample as u64).wrapping_mul(STEP));
        Self { state: of_sample, index: None }
    }

    /// The next dimension: uniform in `[0, 1)`.
    pub const fn next_1d(&mut self) -> f64 {
        match self.index {
            None => {
                self.state = self.state.wrapping_add(STEP);
                to_unit(mix(self.state))
            }
            Some(index) => self.next_sobol(index).x,
        }
    }

    /// The next two dimensions.
    pub const fn next_2d(&mut self) -> DVec2 {
        match self.index {
            None => {
                let x = self.next_1d();
                DVec2::new(x, self.next_1d())
            }
            Some(index) => self.next_sobol(index),
        }
    }

    const fn next_sobol(&mut self, index: u32) -> DVec2 {
        self.state = self.state.wrapping_add(STEP);
        let (order, values) = (mix(self.state), mix(self.state ^ 0x6a09_e667_f3bc_c909));
        let index = scrambled(index, low(order));
        let x = scrambled(index.reverse_bits(), low(values));
        let y = scrambled(second_sobol(index), low(values >> 32));
        DVec2::new(x as f64 / TWO_TO_32, y as f64 / TWO_TO_32)
    }
}

/// 2^32.
const TWO_TO_32: f64 = 4_294_967_296.0;

/// The hash of a seed and a pixel.
const fn pixel_hash(seed: u64, pixel: [u32; 2]) -> u64 {
    let pixel = (pixel[0] as u64) | ((pixel[1] as u64) << 32);
    mix(mix(seed.wrapping_add(STEP)) ^ pixel)
}

#[expect(clippy::cast_possible_truncation, reason = "the low bits are meant")]
const fn low(bits: u64) -> u32 {
    bits as u32
}

/// The second dimension of the Sobol sequence: the product with the matrix of binomial coefficients modulo 2.
const fn second_sobol(mut index: u32) -> u32 {
    let (mut column, mut value) = (1 << 31, 0);
    while index != 0 {
        if index & 1 == 1 {
            value ^= column;
        }
        index >>= 1;
        column ^= column >> 1;
    }
    value
}

/// Owen's scrambling: each bit is flipped by a hash of the bits above it (Laine and Karras 2011, with the constants of
/// Vegdahl 2021).
const fn scrambled(bits: u32, seed: u32) -> u32 {
    let mut x = bits.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
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

    #[test]
    fn sobol_points_are_nets() {
        // of 2^k samples each of the 2^k boxes of any shape has one
        for (pixel, k) in [([3, 5], 8), ([0, 0], 6), ([1000, 2], 7)] {
            let mut samplers: Vec<_> =
                (0..1_u32 << k).map(|i| SamplerKind::Sobol.sampler(9, pixel, i)).collect();
            for call in 0..20 {
                let points: Vec<_> = samplers.iter_mut().map(Sampler::next_2d).collect();
                for columns in 0..=k {
                    let (columns, rows) = (1_u32 << columns, 1_u32 << (k - columns));
                    let mut seen = vec![false; points.len()];
                    for point in &points {
                        let box_index = part(point.x, columns) * rows as usize + part(point.y, rows);
                        assert!(!seen[box_index], "call {call}: two points in one of {columns} x {rows}");
                        seen[box_index] = true;
                    }
                }
            }
        }
    }

    #[test]
    fn sobol_calls_and_pixels_are_independent() {
        // correlation of two calls, and of two pixels, over many seeds
        let (mut of_calls, mut of_pixels) = (0.0, 0.0);
        const COUNT: u32 = 40_000;
        for i in 0..COUNT {
            let mut here = SamplerKind::Sobol.sampler(u64::from(i / 16), [7, 8], i % 16);
            let mut beside = SamplerKind::Sobol.sampler(u64::from(i / 16), [8, 8], i % 16);
            let (a, b) = (here.next_1d() - 0.5, here.next_1d() - 0.5);
            of_calls += a * b;
            of_pixels += a * (beside.next_1d() - 0.5);
        }
        // each product has variance 1/144
        let sigma = f64::from(COUNT).sqrt() / 12.0;
        assert!(of_calls.abs() < 4.0 * sigma && of_pixels.abs() < 4.0 * sigma, "{of_calls} {of_pixels}");
    }
}
