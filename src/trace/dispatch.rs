//! Wider vectors where the processor has them: the only unsafe code.
//!
//! The same Rust code is compiled twice, for every x86-64 and for those with AVX2. Neither fuses multiplications with
//! additions nor reorders operations, so both give the same bits; on other processors the first is all there is.
#![expect(
    unsafe_code,
    reason = "a function compiled for more than the processor is known to have is called after asking it"
)]

/// Work that is compiled for several kinds of processor.
///
/// `run` and what it calls are to be `#[inline(always)]`: a function of its own is compiled once, for every processor.
/// Closures are functions of their own, so `WIDE` is there to tell those of one kind from those of the other.
pub(super) trait Work {
    /// What the work gives.
    type Output;

    /// Does the work; the same bits for both values of `WIDE`.
    fn run<const WIDE: bool>(self) -> Self::Output;
}

/// Runs work as compiled for the widest vectors of this processor.
pub(super) fn run_widest<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has said that it has AVX2.
        return unsafe { run_avx2(work) };
    }
    work.run::<false>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<W: Work>(work: W) -> W::Output {
    work.run::<true>()
}
