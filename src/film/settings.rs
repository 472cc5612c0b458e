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
