//! Stage 6: pictures and the files they go to.

mod animated_png;
mod aov;
mod exposure;
mod exr_file;
#[expect(clippy::module_inception, reason = "the film is one concept among several of this stage")]
mod film;
mod filter;
mod image;
mod image_file;
mod layers;
mod overlay;
mod picture;
mod picture_file;
mod picture_limits;
mod pixel_sums;
mod raster;
mod sample;
mod sample_blocks;
mod settings;

pub use self::image::{Channel, Image, Window};
pub use animated_png::encode_animation;
pub use aov::Aov;
pub use exposure::{Exposure, MergeError};
pub use exr_file::{ExrHeader, encode_layers, write_exr, write_layers};
pub use film::{Film, FilmError};
pub use filter::Filter;
pub(crate) use image_file::from_srgb;
pub use image_file::{encode_png, encode_raster, write_png};
pub use layers::{Area, LayeredChannel, LayeredPicture, Numbers, Part, Recorded, SampleKind};
pub use overlay::Overlay;
pub use picture::{EncodeError, Picture, PictureError};
pub use picture_file::{
    read_channel_within, read_layers, read_layers_within, read_picture, read_picture_within,
};
pub use picture_limits::PictureLimits;
pub use raster::Raster;
pub use sample::{FirstHit, Sample, SurfaceIds};
pub use settings::FilmSettings;
