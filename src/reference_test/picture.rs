//! A scene's picture, as if read from its file.

use std::fs;
use std::io;
use std::path::Path;

use thiserror::Error;

use crate::film::{Area, ExrHeader, Image, LayeredChannel, LayeredPicture, Numbers, Part, SampleKind};
use crate::identity::PictureIdentity;
use crate::render::{RenderControl, RenderError, Rendered};
use crate::scene::{SceneDescription, SceneError};
use crate::shade::{Camera, CameraError};

/// Why there is no picture of a scene.
#[derive(Debug, Error)]
pub enum MakeError {
    /// The scene or a file it names is wrong.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Its camera makes no picture.
    #[error("[camera]: {0}")]
    Camera(#[from] CameraError),
    /// A file of the scene cannot be read again.
    #[error(transparent)]
    Files(#[from] io::Error),
    /// Rendering failed or was interrupted.
    #[error(transparent)]
    Render(#[from] RenderError),
}

/// A picture and what its file would hold.
#[derive(Clone, Debug)]
pub struct MadePicture {
    /// The picture.
    pub image: Image,
    /// Its header.
    pub header: ExrHeader,
    /// Samples that were not finite and count as black.
    pub non_finite_samples: u64,
}

impl MadePicture {
    /// The same as its file would be read.
    #[must_use]
    pub fn layers(&self) -> LayeredPicture {
        let window = self.image.data_window();
        let area = |[x, y]: [u32; 2], [width, height]: [u32; 2]| Area {
            x: x.cast_signed(),
            y: y.cast_signed(),
            width,
            height,
        };
        let channels = self.image.channels().iter().map(|channel| LayeredChannel {
            name: channel.name.clone(),
            kind: SampleKind::Float,
            numbers: Numbers::Real(channel.values.clone()),
        });
        let data = area([window.x, window.y], [window.width, window.height]);
        LayeredPicture {
            format: "OpenEXR",
            display: area([0, 0], self.image.display_size()),
            parts: vec![Part { name: None, data, channels: channels.collect() }],
            srgb_encoded: false,
            recorded: self.header.recorded(),
            notes: Vec::new(),
        }
    }
}

/// Renders a scene.
///
/// # Errors
/// If the scene cannot be built or rendered, or on the control's `cancel`.
pub fn make_picture(scene: &SceneDescription, control: &RenderControl<'_>) -> Result<MadePicture, MakeError> {
    let built = scene.build()?;
    let camera = Camera::try_new(&built.camera, scene.film.size)?;
    let Rendered { image, statistics, .. } = built.render(&camera, &scene.film, &scene.render, control)?;
    let header = PictureIdentity::new(scene, &built).header(scene, &camera);
    Ok(MadePicture { image, header, non_finite_samples: statistics.non_finite_samples })
}

/// FNV-1a (64 bits) of a scene file and of the meshes that it names, in the order of the objects: `reference/scene` of a
/// reference.
///
/// # Errors
/// If a file cannot be read.
pub fn files_hash(scene: &SceneDescription) -> io::Result<String> {
    let meshes = scene.objects.iter().filter_map(|object| object.shape.mesh());
    let mut state: u64 = 0xcbf2_9ce4_8422_2325;
    for path in std::iter::once(scene.path.as_path()).chain(meshes) {
        for byte in read(path)? {
            state = (state ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
    }
    Ok(format!("{state:016x}"))
}

fn read(path: &Path) -> io::Result<Vec<u8>> {
    fs::read(path).map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))
}
