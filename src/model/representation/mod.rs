//! What a deformed object is represented by, each kind in a file of its own.

mod adaptive;
mod exact;
mod facets;
mod feng_peng;
mod pointwise;

use std::str::FromStr;

use thiserror::Error;

use super::deformation::PlacedShape;
use super::deformer::BuiltLattice;
use super::error::ModelError;
use crate::analytic::Step;
use crate::patch::{BuildTimes, Facet, Shell};
use crate::suggestion::{UnknownName, lookup};

pub(super) use facets::facet_object;
pub use feng_peng::TriangularCounts;
use pointwise::MAX_LEVEL;

/// How a deformed shape is represented for tracing.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Representation {
    /// Trimmed Bézier patches, without approximation (Feng, Nishita, Jin, Peng 2002).
    #[default]
    Exact,
    /// Triangular Bézier patches, one for each triangle of the polygons in each knot box: as exact, the method before (Feng,
    /// Peng 2000). Of polygons under one lattice at most.
    FengPeng,
    /// Flat triangles, each of the polygons' split into 4^level, with their corners alone deformed (Sederberg, Parry 1986).
    Pointwise {
        /// How often triangles are split, at most 12.
        level: u32,
    },
    /// Flat triangles with corners on the deformed shape, halved until they are close enough to it.
    Adaptive {
        /// Greatest distance between triangles and shape, in world units; above 0.
        tolerance: f64,
    },
}

/// Why a text names no [`Representation`].
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum RepresentationError {
    /// There is none of this name.
    #[error(transparent)]
    Unknown(#[from] UnknownName),
    /// It takes no parameter.
    #[error("method {0} takes no parameter: write {0} alone")]
    NoParameter(&'static str),
    /// The level is missing or too high.
    #[error("method pointwise needs how often triangles are split, 0 to {MAX_LEVEL}: write pointwise:2")]
    Level,
    /// The tolerance is missing or not above 0.
    #[error(
        "method adaptive needs the greatest distance from the surface, in world units, above 0: write adaptive:1e-3"
    )]
    Tolerance,
}

/// Names that [`Representation`]s are written by.
const NAMES: [&str; 4] = ["exact", "pointwise", "adaptive", "triangular"];

/// An object as a representation gives it.
pub(super) struct Construction {
    pub(super) elements: Elements,
    /// Sub-polygons it was cut into.
    pub(super) subpolygons: usize,
    pub(super) steps: Vec<Step>,
    pub(super) lattices: Vec<BuiltLattice>,
    pub(super) triangular: Option<TriangularCounts>,
    pub(super) times: BuildTimes,
}

/// What a representation is made of.
pub(super) enum Elements {
    /// Faces of the exact surface.
    Faces(Shell),
    /// Flat triangles near it.
    Facets(Vec<Facet>),
}

impl Representation {
    /// Whether it is the deformed shape itself, not an approximation.
    #[must_use]
    pub const fn is_exact(self) -> bool {
        self.level().is_none() && self.tolerance().is_none()
    }

    /// How often each triangle of the polygons is split, if that is how it is made.
    #[must_use]
    pub const fn level(self) -> Option<u32> {
        match self {
            Self::Pointwise { level } => Some(level),
            Self::Exact | Self::FengPeng | Self::Adaptive { .. } => None,
        }
    }

    /// How far it may be from the shape, if that is how it is made.
    #[must_use]
    pub const fn tolerance(self) -> Option<f64> {
        match self {
            Self::Adaptive { tolerance } => Some(tolerance),
            Self::Exact | Self::FengPeng | Self::Pointwise { .. } => None,
        }
    }

    /// Whether only polygons have it, not surfaces.
    #[must_use]
    pub const fn needs_polygons(self) -> bool {
        matches!(self, Self::Pointwise { .. } | Self::FengPeng)
    }

    /// Represents a shape under its deformers.
    pub(super) fn construct(self, shape: &PlacedShape<'_>) -> Result<Construction, ModelError> {
        match self {
            Self::Exact => exact::construct(shape),
            Self::FengPeng => feng_peng::construct(shape),
            Self::Pointwise { level } => pointwise::construct(shape, level),
            Self::Adaptive { tolerance } => adaptive::construct(shape, tolerance),
        }
    }
}

impl std::fmt::Display for Representation {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Exact => write!(formatter, "exact"),
            Self::FengPeng => write!(formatter, "triangular"),
            Self::Pointwise { level } => write!(formatter, "pointwise:{level}"),
            Self::Adaptive { tolerance } => write!(formatter, "adaptive:{tolerance}"),
        }
    }
}

impl FromStr for Representation {
    type Err = RepresentationError;

    fn from_str(text: &str) -> Result<Self, RepresentationError> {
        // the part after the colon is the parameter
        let (name, parameter) = match text.split_once(':') {
            Some((name, parameter)) => (name, Some(parameter)),
            None => (text, None),
        };
        let name = NAMES[lookup("method", &NAMES, name)?];
        match name {
            "pointwise" => {
                let level = parameter.and_then(|level| level.parse().ok());
                let level = level.filter(|&level| level <= MAX_LEVEL).ok_or(RepresentationError::Level)?;
                Ok(Self::Pointwise { level })
            }
            "adaptive" => {
                let tolerance = parameter.and_then(|tolerance| tolerance.parse::<f64>().ok());
                let tolerance = tolerance.filter(|tolerance| tolerance.is_finite() && *tolerance > 0.0);
                Ok(Self::Adaptive { tolerance: tolerance.ok_or(RepresentationError::Tolerance)? })
            }
            _ if parameter.is_some() => Err(RepresentationError::NoParameter(name)),
            "triangular" => Ok(Self::FengPeng),
            _ => Ok(Self::Exact),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_parse() {
        assert_eq!("exact".parse(), Ok(Representation::Exact));
        assert_eq!("triangular".parse(), Ok(Representation::FengPeng));
        assert_eq!(Representation::FengPeng.to_string(), "triangular");
        for (text, message) in [
            (
                "exat",
                r#"unknown method "exat" (known: exact, pointwise, adaptive, triangular); did you mean "exact"?"#,
            ),
            ("exact:2", "method exact takes no parameter: write exact alone"),
            ("triangular:2", "method triangular takes no parameter: write triangular alone"),
            ("pointwise", "method pointwise needs how often triangles are split, 0 to 12: write pointwise:2"),
            (
                "pointwise:13",
                "method pointwise needs how often triangles are split, 0 to 12: write pointwise:2",
            ),
            (
                "adaptive:0",
                "method adaptive needs the greatest distance from the surface, in world units, above 0: write adaptive:1e-3",
            ),
        ] {
            assert_eq!(
                text.parse::<Representation>().map_err(|error| error.to_string()),
                Err(message.to_owned())
            );
        }
    }
}
