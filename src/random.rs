//! Random numbers: Steele, Lea and Flood (2014), *Fast splittable pseudorandom number generators* (`SplitMix64`), with the
//! constants of Stafford's mix 13.

/// 2^64 divided by the golden ratio, rounded to odd: how far apart the states of a sequence are.
pub(crate) const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// 2^-53, the distance of the doubles that [`to_unit`] gives.
const TO_UNIT: f64 = 1.0 / 9_007_199_254_740_992.0;

/// A sequence of random numbers, the same for the same seed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SplitMix64 {
    state: u64,
}

impl SplitMix64 {
    /// The sequence of a seed.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The next 64 random bits.
    pub const fn next_bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(STEP);
        mix(self.state)
    }

    /// The next number, uniform in `[0, 1)`.
    pub const fn next_unit(&mut self) -> f64 {
        to_unit(self.next_bits())
    }
}

/// The number in `[0, 1)` that the upper 53 bits are.
pub(crate) const fn to_unit(bits: u64) -> f64 {
    (bits >> 11) as f64 * TO_UNIT
}

/// The finaliser of `SplitMix64`: a bijection in which each input bit flips each output bit with a probability near one half.
pub(crate) const fn mix(mut bits: u64) -> u64 {
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sequence_is_that_of_the_paper() {
        // the first outputs of the reference implementation for the seed 1234567
        let mut random = SplitMix64::new(1_234_567);
        let bits: Vec<u64> = (0..3).map(|_| random.next_bits()).collect();
        assert_eq!(bits, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
        let unit = SplitMix64::new(1_234_567).next_unit();
        assert!((unit - 6_457_827_717_110_365_317.0 / 2.0_f64.powi(64)).abs() < 1e-15);
    }
}
