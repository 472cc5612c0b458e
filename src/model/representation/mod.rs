//! Representations of a deformed object, each in a file of its own.

mod facets;
mod feng_peng;
mod pointwise;

pub(crate) use facets::facet_object;
pub use feng_peng::TriangularCounts;
pub(crate) use pointwise::{MAX_LEVEL, deform_pointwise};
