//! Random numbers for programs that draw rays.

use glam::DVec3;
use trimray::random::SplitMix64;

/// Deterministic random numbers: `SplitMix64`.
pub(crate) struct Random(SplitMix64);

impl Random {
    /// A stream of its own for each pair of numbers.
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        let seed = seed.wrapping_mul(0xd134_2543_de82_ef95) ^ stream.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut random = SplitMix64::new(seed);
        random.next_bits();
        Self(random)
    }

    /// In [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        self.0.next_unit()
    }

    /// Below `count`.
    #[expect(clippy::cast_possible_truncation, reason = "below a usize")]
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.0.next_bits() % count as u64) as usize
    }

    /// On the unit sphere.
    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let p = 2.0 * DVec3::new(self.unit(), self.unit(), self.unit()) - 1.0;
            if p.length_squared() <= 1.0 && p.length_squared() > 1e-6 {
                return p.normalize();
            }
        }
    }
}
