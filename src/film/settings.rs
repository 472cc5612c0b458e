//! What the scene file says of the film.

use super::filter::Filter;

/// The `[film]` table of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmSettings {
    /// Width and height in pixels, each at least 1.
    pub size: [u32; 2],
    /// Reconstruction filter.
    pub filter: Filter,
    /// Part of the picture to render: x, y, width, height in pixels; all of it by default.
    pub crop: Option<[u32; 4]>,
}

impl Default for FilmSettings {
    fn default() -> Self {
        Self { size: [512, 512], filter: Filter::Box, crop: None }
    }
}

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
