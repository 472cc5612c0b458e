//! How surfaces under chains are covered by cells, and what comes of it.

use std::collections::BTreeSet;

use crate::memory::MemoryLimit;
use crate::patch::Shell;
use crate::spline::KnotBox;

/// What is made of rectangles in which several pieces of a formula meet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Borders {
    /// A cell for each piece, which ends in the curve where they meet.
    #[default]
    Curves,
    /// One cell, where the pieces differ by at most this length over all of it; curves where they never do.
    Within(f64),
    /// The same, by parts of the object's size.
    WithinPart(f64),
}

impl Borders {
    /// How far the pieces of one cell may differ.
    pub(super) fn within(self, size: f64) -> Option<f64> {
        match self {
            Self::Curves => None,
            Self::Within(length) => Some(length),
            Self::WithinPart(part) => Some(part * size),
        }
    }
}

/// How a chain is covered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoverSettings {
    /// Whether a patch that lies in one knot box is composed with a volume of low degree, instead of being covered.
    pub composes: bool,
    /// What is made where pieces meet.
    pub borders: Borders,
    /// The most memory that the process may have.
    pub memory: MemoryLimit,
}

impl Default for CoverSettings {
    fn default() -> Self {
        Self { composes: true, borders: Borders::Curves, memory: MemoryLimit::NONE }
    }
}

/// Faces of a deformed surface.
#[derive(Clone, Debug, Default)]
pub struct Covered {
    /// In the order of the base faces.
    pub shell: Shell,
    /// Where parts of the surface are: steps with the knot boxes of their volumes; `None` outside a volume.
    pub knot_boxes: BTreeSet<(usize, Option<KnotBox>)>,
}
