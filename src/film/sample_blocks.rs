//! Sums over blocks of samples, which come out the same whatever the order they were taken and put together in.

use super::filter::Filter;
use super::pixel_sums::{combine, numbers};

/// Samples of each pixel in a block. Within a block samples are added one after another, so that a block is the least
/// share of a pixel's samples that can be taken by itself.
pub(super) const BLOCK: u32 = 64;

/// Sums over the samples of consecutive blocks, for a number of pixels.
#[derive(Clone, Debug, PartialEq)]
struct Run {
    /// Index of the first block: a multiple of `blocks`.
    first: u32,
    /// How many blocks: a power of two.
    blocks: u32,
    /// Samples of each pixel; a run of more than one block is full.
    samples: u32,
    /// The numbers of each pixel in turn.
    sums: Vec<f64>,
}

impl Run {
    const fn is_full(&self) -> bool {
        self.samples as u64 == self.blocks as u64 * BLOCK as u64
    }

    /// Whether `next` is the second half of the run of twice the length.
    fn pairs_with(&self, next: &Self) -> bool {
        self.is_full()
            && next.is_full()
            && self.blocks == next.blocks
            && self.first.is_multiple_of(2 * self.blocks)
            && next.first == self.first + self.blocks
    }
}

/// Sums over any of the blocks of some pixels' samples.
///
/// # Order
/// Block b has the samples from 64 b on, added in the order of their indices. Sums of blocks are combined along a fixed
/// binary tree: blocks 2 k and 2 k + 1 to a pair, pairs 2 k and 2 k + 1 to four, and so on, the lower half first, as soon
/// as both halves are there and full. What is left in the end, at most one run of each length if no block is missing, is
/// combined from the lowest block on. So the result depends on the set of samples alone, not on who took which blocks, nor
/// on the order in which they are merged; and n blocks in sequence need no more than 1 + log2 n runs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SampleBlocks {
    filter: Filter,
    /// How many numbers a run has.
    length: usize,
    /// By their first blocks.
    runs: Vec<Run>,
}

impl SampleBlocks {
    /// No samples of a number of pixels.
    pub(super) fn new(filter: Filter, pixels: usize) -> Self {
        Self { filter, length: pixels * numbers(filter), runs: Vec::new() }
    }

    /// Samples of each pixel.
    pub(super) fn samples(&self) -> u32 {
        self.runs.iter().map(|run| run.samples).sum()
    }

    /// Whether the samples are those from index 0 on.
    pub(super) fn start_at_zero(&self) -> bool {
        let mut next = 0;
        self.runs.iter().all(|run| {
            let follows = run.first == next;
            next = if run.is_full() { run.first + run.blocks } else { u32::MAX };
            follows
        })
    }

    /// The sums that the samples of a block, which is not full yet, are to be added to.
    ///
    /// # Panics
    /// If the block has been combined with others.
    pub(super) fn block_sums(&mut self, block: u32) -> &mut [f64] {
        let index = self.runs.partition_point(|run| run.first + (run.blocks - 1) < block);
        if self.runs.get(index).is_none_or(|run| run.first > block) {
            self.runs
                .insert(index, Run { first: block, blocks: 1, samples: 0, sums: vec![0.0; self.length] });
        }
        let run = &mut self.runs[index];
        assert!(run.blocks == 1 && !run.is_full(), "block {block} is full");
        &mut run.sums
    }

    /// Notes that all pixels have had `samples` more of a block.
    ///
    /// # Panics
    /// If they do not fit into the block.
    pub(super) fn count(&mut self, block: u32, samples: u32) {
        self.block_sums(block);
        let run = self.runs.iter_mut().find(|run| run.first == block).expect("it is there now");
        run.samples += samples;
        assert!(run.samples <= BLOCK, "block {block} has {} samples", run.samples);
        self.combine_pairs();
    }

    /// Takes the blocks of `other` in; `None`, and nothing is changed, if both have samples of one block.
    pub(super) fn merge(&mut self, other: Self) -> Option<()> {
        let mut runs: Vec<&Run> = self.runs.iter().chain(&other.runs).collect();
        runs.sort_by_key(|run| run.first);
        if runs.windows(2).any(|pair| pair[0].first + (pair[0].blocks - 1) >= pair[1].first) {
            return None;
        }
        self.runs.extend(other.runs);
        self.runs.sort_by_key(|run| run.first);
        self.combine_pairs();
        Some(())
    }

    fn combine_pairs(&mut self) {
        let numbers = numbers(self.filter);
        let pair = |runs: &[Run]| runs.windows(2).position(|pair| pair[0].pairs_with(&pair[1]));
        while let Some(index) = pair(&self.runs) {
            let second = self.runs.remove(index + 1);
            let first = &mut self.runs[index];
            for (sums, others) in first.sums.chunks_exact_mut(numbers).zip(second.sums.chunks_exact(numbers))
            {
                combine(self.filter, sums, others);
            }
            first.blocks *= 2;
            first.samples += second.samples;
        }
    }

    /// Writes the sums over all samples of a pixel into `sums`, which has as many numbers as a pixel.
    pub(super) fn combined(&self, pixel: usize, sums: &mut [f64]) {
        let numbers = sums.len();
        let mut runs = self.runs.iter().map(|run| &run.sums[pixel * numbers..][..numbers]);
        match runs.next() {
            Some(first) => sums.copy_from_slice(first),
            None => sums.fill(0.0),
        }
        runs.for_each(|others| combine(self.filter, sums, others));
    }

    /// Appends all numbers, as little-endian bytes.
    pub(super) fn save(&self, bytes: &mut Vec<u8>) {
        let count = u32::try_from(self.runs.len()).expect("fewer runs than samples");
        bytes.extend(count.to_le_bytes());
        for run in &self.runs {
            bytes.extend([run.first, run.blocks, run.samples].iter().flat_map(|number| number.to_le_bytes()));
            bytes.extend(run.sums.iter().flat_map(|sum| sum.to_le_bytes()));
        }
    }

    /// Takes what [`Self::save`] has written for the same pixels from the front of `bytes`; `None` if it is not that.
    pub(super) fn load(&mut self, bytes: &mut &[u8]) -> Option<()> {
        let mut runs: Vec<Run> = Vec::new();
        for _ in 0..read_u32(bytes)? {
            let [first, blocks, samples] = [read_u32(bytes)?, read_u32(bytes)?, read_u32(bytes)?];
            let last = runs.last().map_or(0, |run| run.first + run.blocks);
            let aligned = blocks.is_power_of_two() && first.is_multiple_of(blocks) && first >= last;
            let most = blocks.checked_mul(BLOCK)?;
            if !aligned || samples > most || (blocks > 1 && samples < most) {
                return None;
            }
            first.checked_add(blocks)?.checked_mul(BLOCK)?;
            let mut numbers = bytes.split_off(..self.length.checked_mul(8)?)?;
            let mut sums = Vec::with_capacity(self.length);
            while let Some(number) = numbers.split_off(..8) {
                sums.push(f64::from_le_bytes(*number.as_array()?));
            }
            runs.push(Run { first, blocks, samples, sums });
        }
        self.runs = runs;
        Some(())
    }
}

/// The next four bytes as a number.
pub(super) fn read_u32(bytes: &mut &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.split_off(..4)?.as_array()?))
}
