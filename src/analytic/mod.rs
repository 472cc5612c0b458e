//! Stage 4c: surfaces under extension functions and chains of deformations, exactly.
//!
//! What is no Bézier patch of modest degree is covered by cells: rectangles of a base patch's parameters with the formula of
//! the deformed point. Each has a Bézier patch that stands for it in searches, with a proven bound of its distance, and the
//! formula itself for the last step of Newton's method, positions and derivatives.

mod branch;
mod cell;
mod chain;
mod compose;
mod cover;
mod cover_error;
mod cover_settings;
mod disc;
mod expression;
mod interpolate;
mod jet;
mod loop_part;
mod merge;
mod number;
mod program;
mod step;
mod syntax;
mod taylor;
#[cfg(test)]
mod tests;

pub use chain::{Chain, ChainError, MAX_FIELDS};
pub use cover::cover;
pub use cover_error::CoverError;
pub use cover_settings::{Borders, CoverSettings, Covered};
pub use expression::Expression;
pub use step::*;
pub use syntax::ExpressionError;
