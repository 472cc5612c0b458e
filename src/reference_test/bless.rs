//! References made by this program.

use std::path::PathBuf;

use thiserror::Error;

use super::folder::SceneTest;
use super::picture::{MakeError, files_hash, make_picture};
use crate::film::{Aov, PictureLimits, read_layers_within, write_exr};
use crate::output::{OutputError, check_writable};
use crate::render::{RenderControl, RenderError};
use crate::scene::parse_scene;

/// How a reference is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BlessSettings {
    /// Samples for each pixel; by default the scene's.
    pub spp: Option<u32>,
    /// Whether to replace a reference of another program too.
    pub force: bool,
    /// Bounds on the pictures that are read.
    pub pictures: PictureLimits,
}

/// Why a reference was not made.
#[derive(Debug, Error)]
pub enum BlessError {
    /// What is there was made by another program, or is no picture.
    #[error("{}: is {what}; --force replaces it all the same", path.display())]
    Foreign {
        /// The reference.
        path: PathBuf,
        /// What it is.
        what: String,
    },
    /// One sample tells nothing of its variance.
    #[error("{name}: the variance that a reference needs takes at least 2 samples per pixel: give --spp")]
    Samples {
        /// The scene.
        name: String,
    },
    /// The picture would be no reference.
    #[error("{name}: {count} samples were not finite; nothing is written")]
    NonFinite {
        /// The scene.
        name: String,
        /// How many.
        count: u64,
    },
    /// The scene cannot be rendered.
    #[error(transparent)]
    Picture(#[from] MakeError),
    /// The reference cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl BlessError {
    /// Whether it was asked to stop.
    #[must_use]
    pub const fn is_interrupted(&self) -> bool {
        matches!(self, Self::Picture(MakeError::Render(RenderError::Interrupted)))
    }
}

/// Renders a scene with its own seed and layers, and with its variance, as its reference; returns the samples per pixel.
///
/// # Errors
/// If there is a reference of another program, if the scene cannot be rendered, or if the file cannot be written; what was there
/// stays then.
pub fn bless(
    test: &SceneTest,
    settings: &BlessSettings,
    control: &RenderControl<'_>,
) -> Result<u32, BlessError> {
    let path = &test.reference;
    if path.exists() && !settings.force {
        let what = match read_layers_within(path, settings.pictures) {
            Ok(picture) => match picture.recorded.software {
                Some(software) if software.starts_with("trimray") => None,
                Some(software) => Some(format!("a picture by {software}")),
                None => Some("a picture by another program".to_owned()),
            },
            Err(_) => Some("no picture that this program wrote".to_owned()),
        };
        if let Some(what) = what {
            return Err(BlessError::Foreign { path: path.clone(), what });
        }
    }
    check_writable(path)?;
    let mut scene = parse_scene(&test.scene).map_err(MakeError::from)?;
    scene.pictures = settings.pictures;
    scene.memory = settings.pictures.memory;
    scene.render.spp = settings.spp.unwrap_or(scene.render.spp);
    if scene.render.spp < 2 {
        return Err(BlessError::Samples { name: test.name.clone() });
    }
    if !scene.render.aovs.contains(&Aov::Variance) {
        scene.render.aovs.push(Aov::Variance);
    }
    let hash = files_hash(&scene).map_err(MakeError::from)?;
    let mut made = make_picture(&scene, control)?;
    if made.non_finite_samples > 0 {
        return Err(BlessError::NonFinite { name: test.name.clone(), count: made.non_finite_samples });
    }
    made.header.reference_scene = Some(hash);
    write_exr(path, &made.image, &made.header)?;
    Ok(scene.render.spp)
}
