//! How objects are built.

use crate::analytic::Borders;
use crate::memory::MemoryLimit;

/// How an object is built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BuildSettings {
    /// The most memory that it may be made in.
    pub memory: MemoryLimit,
    /// What is made where pieces of a chain of deformations meet.
    pub borders: Borders,
}

impl Default for BuildSettings {
    /// No limit, and curves as borders.
    fn default() -> Self {
        Self { memory: MemoryLimit::NONE, borders: Borders::Curves }
    }
}
