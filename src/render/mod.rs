//! The renderer: a scene to a picture, tile by tile, in passes over all tiles.

mod checkpoint;
mod job;
mod preview;

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use rayon::ThreadPoolBuilder;
use thiserror::Error;

use crate::film::{Film, FilmError, FilmSettings, Image, Window};
use crate::memory::{MemoryLimit, OutOfMemory};
use crate::output::OutputError;
use crate::scene::BuiltScene;
use crate::shade::{Camera, RenderSettings, RenderStatistics, ShadingScene};
use crate::trace::Geometry;

pub use checkpoint::{Checkpoint, CheckpointError, CheckpointFile};
pub use preview::TevPreview;

use job::Job;

/// How the work is done; nothing here changes a pixel, but for the number of samples if there is a deadline.
#[derive(Clone, Copy)]
pub struct RenderControl<'a> {
    /// Number of threads; 0 is one for each processor.
    pub threads: usize,
    /// Set by another thread to stop.
    pub cancel: &'a AtomicBool,
    /// When to stop with the samples that there are.
    pub deadline: Option<Instant>,
    /// Called after each tile of each pass with the number of samples done and of all samples. Several threads call it, so
    /// that a call with fewer samples done may come later.
    pub progress: &'a (dyn Fn(u64, u64) + Sync),
    /// Where to save the state, on an interval and at the end, whatever ends it.
    pub checkpoint: Option<&'a CheckpointFile>,
    /// The state to go on from.
    pub resume: Option<&'a Checkpoint>,
    /// Where to show the picture as it grows.
    pub preview: Option<&'a TevPreview>,
    /// The most memory that the process may have.
    pub memory: MemoryLimit,
}

impl std::fmt::Debug for RenderControl<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("RenderControl")
            .field("threads", &self.threads)
            .field("cancel", &self.cancel)
            .field("deadline", &self.deadline)
            .field("checkpoint", &self.checkpoint)
            .finish_non_exhaustive()
    }
}

impl<'a> RenderControl<'a> {
    /// All processors, and nothing beside the work, until `cancel` is set.
    pub const fn new(cancel: &'a AtomicBool) -> Self {
        Self {
            threads: 0,
            cancel,
            deadline: None,
            progress: &|_, _| (),
            checkpoint: None,
            resume: None,
            preview: None,
            memory: MemoryLimit::NONE,
        }
    }
}

/// A picture and what is known of its making.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The picture.
    pub image: Image,
    /// What was counted, since a resumed render was resumed.
    pub statistics: RenderStatistics,
    /// The least and the greatest number of samples of a pixel: the same, unless the deadline has passed.
    pub samples: [u32; 2],
}

/// Why there is no picture.
#[derive(Debug, Error)]
pub enum RenderError {
    /// It was asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// The film has no such pixels.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// The state to go on from is not one of this picture.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The state cannot be saved.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// There is too little memory for the picture.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
    /// The threads could not be started.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Renders the film's crop.
///
/// A pixel depends on its place, the seed and the scene alone: any number of threads, any crop, and any number of
/// interruptions give the same bits.
///
/// # Errors
/// If the film's settings make no picture, if threads cannot be started, if the state cannot be saved or resumed, or on
/// `cancel`.
///
/// # Panics
/// If an object of the scene has no material.
pub fn render<G: Geometry>(
    scene: &ShadingScene<'_, G>,
    camera: &Camera,
    film: &FilmSettings,
    settings: &RenderSettings,
    control: &RenderControl<'_>,
) -> Result<Rendered, RenderError> {
    let film = Film::try_new(film, &settings.aovs)?;
    let Window { width, height, .. } = film.window();
    let what = format_args!("the picture of {width}x{height} pixels");
    let _promise = control.memory.ask(what, film.bytes(settings.spp))?;
    let threads = ThreadPoolBuilder::new().num_threads(control.threads).build()?;
    let job = Job::new(scene, camera, (&film, settings), control)?;
    let done = threads.install(|| job.run());
    // whatever ended the work, what there is can be gone on from
    if let Some(file) = control.checkpoint {
        file.save(job.tiles())?;
    }
    let statistics = done?;
    let (image, samples) = job.finish();
    Ok(Rendered { image, statistics, samples })
}

impl BuiltScene {
    /// Renders it, as [`render()`] does.
    ///
    /// # Errors
    /// As [`render()`].
    pub fn render(
        &self,
        camera: &Camera,
        film: &FilmSettings,
        settings: &RenderSettings,
        control: &RenderControl<'_>,
    ) -> Result<Rendered, RenderError> {
        // not generic, so that the renderer is compiled once, with the library
        render(&self.shading(), camera, film, settings, control)
    }
}

#[cfg(test)]
mod tests;
