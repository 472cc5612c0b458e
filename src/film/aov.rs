//! The layers that can be written beside the picture.

use glam::{DVec2, DVec3};

use super::sample::FirstHit;
use crate::choice::Choice;

/// Id of a pixel where no surface is.
const NO_ID: f64 = -1.0;

/// An arbitrary output variable: a layer of the EXR beside the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Aov {
    /// `depth.T`: distance from the camera.
    Depth,
    /// `position.X/Y/Z`.
    Position,
    /// `normal.X/Y/Z`: shading normal.
    Normal,
    /// `geo_normal.X/Y/Z`: geometric normal.
    GeoNormal,
    /// `uv.U/V`: texture coordinates.
    Uv,
    /// `st.S/T`: parameters in the patch.
    St,
    /// `rest.X/Y/Z`: place on the undeformed object.
    Rest,
    /// `object.I`.
    Object,
    /// `face.I`.
    Face,
    /// `patch.I`.
    Patch,
    /// `albedo.R/G/B`.
    Albedo,
    /// `variance.R/G/B`: variance of the pixel's mean.
    Variance,
}

impl Choice for Aov {
    const WHAT: &'static str = "aov";
    const ALL: &'static [Self] = &Self::ALL;

    fn name(self) -> &'static str {
        Self::name(self)
    }
}

impl Aov {
    /// All of them, in the order of the documentation.
    pub const ALL: [Self; 12] = [
        Self::Depth,
        Self::Position,
        Self::Normal,
        Self::GeoNormal,
        Self::Uv,
        Self::St,
        Self::Rest,
        Self::Object,
        Self::Face,
        Self::Patch,
        Self::Albedo,
        Self::Variance,
    ];

    /// Its name in scene files, and the layer's in the EXR.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Position => "position",
            Self::Normal => "normal",
            Self::GeoNormal => "geo_normal",
            Self::Uv => "uv",
            Self::St => "st",
            Self::Rest => "rest",
            Self::Object => "object",
            Self::Face => "face",
            Self::Patch => "patch",
            Self::Albedo => "albedo",
            Self::Variance => "variance",
        }
    }

    /// The last parts of its channels' names.
    #[must_use]
    pub const fn components(self) -> &'static [&'static str] {
        match self {
            Self::Depth => &["T"],
            Self::Position | Self::Normal | Self::GeoNormal | Self::Rest => &["X", "Y", "Z"],
            Self::Uv => &["U", "V"],
            Self::St => &["S", "T"],
            Self::Object | Self::Face | Self::Patch => &["I"],
            Self::Albedo | Self::Variance => &["R", "G", "B"],
        }
    }

    /// Mitsuba's name of the layer and of what it shows, if it has it.
    #[must_use]
    pub const fn mitsuba_name(self) -> Option<&'static str> {
        match self {
            Self::Depth => Some("depth:depth"),
            Self::Position => Some("position:position"),
            Self::Normal => Some("normal:sh_normal"),
            Self::GeoNormal => Some("geo_normal:geo_normal"),
            Self::Uv => Some("uv:uv"),
            Self::Albedo => Some("albedo:albedo"),
            Self::St | Self::Rest | Self::Object | Self::Face | Self::Patch | Self::Variance => None,
        }
    }

    /// Its components' values, in the first places: 0 for a miss, -1 for a miss's ids.
    ///
    /// Texture coordinates that the mesh has not (NaN) are 0, as no reader expects NaN there.
    /// `variance`, which no hit knows, is 0.
    #[must_use]
    pub fn values(self, hit: Option<&FirstHit>) -> DVec3 {
        let pair = |pair: DVec2| if pair.is_nan() { DVec2::ZERO } else { pair }.extend(0.0);
        let ids = hit.and_then(|hit| hit.ids);
        let id = |id: Option<u32>| DVec3::new(id.map_or(NO_ID, f64::from), 0.0, 0.0);
        let of_hit = |value: fn(&FirstHit) -> DVec3| hit.map_or(DVec3::ZERO, value);
        match self {
            Self::Depth => of_hit(|hit| DVec3::new(hit.depth, 0.0, 0.0)),
            Self::Position => of_hit(|hit| hit.position),
            Self::Normal => of_hit(|hit| hit.normal),
            Self::GeoNormal => of_hit(|hit| hit.geo_normal),
            Self::Uv => hit.map_or(DVec3::ZERO, |hit| pair(hit.uv)),
            Self::St => hit.map_or(DVec3::ZERO, |hit| pair(hit.st)),
            Self::Rest => of_hit(|hit| hit.rest),
            Self::Object => id(ids.map(|ids| ids.object)),
            Self::Face => id(ids.map(|ids| ids.face)),
            Self::Patch => id(ids.map(|ids| ids.patch)),
            Self::Albedo => of_hit(|hit| hit.albedo),
            Self::Variance => DVec3::ZERO,
        }
    }
}
