//! Buffers and counts of one tracer.

use super::bvh::Stack;
use super::projection::ProjectedNet;
use super::search::SearchScratch;
use super::statistics::TraceStatistics;

/// Buffers and counts of one tracer.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    pub(super) stack: Stack,
    pub(super) solver: Solver,
}

/// Buffers and counts of the search for roots.
#[derive(Debug, Default)]
pub(super) struct Solver {
    pub(super) net: ProjectedNet,
    pub(super) search: SearchScratch,
    pub(super) statistics: TraceStatistics,
}
