//! Stage 6: pictures and the files they go to.

mod aov;
mod exposure;
mod exr_file;
#[expect(clippy::module_inception, reason = "the film is one concept among several of this stage")]
mod film;
mod filter;
mod image;
mod image_file;
mod overlay;
mod picture_file;
mod sample;
mod settings;

pub use self::image::{Channel, Image, Window};
pub use exposure::Exposure;
pub use exr_file::{ExrHeader, write_exr};
pub use film::{Film, FilmError};
pub use filter::Filter;
pub use image_file::write_png;
pub use overlay::Overlay;
pub use picture_file::{Picture, PictureError, read_picture};
pub use sample::{FirstHit, Sample, SurfaceIds};
pub use settings::{Aov, FilmSettings};
