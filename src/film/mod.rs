//! Stage 6: pictures and the files they go to.

mod settings;

pub use settings::{Aov, FilmSettings, Filter};
