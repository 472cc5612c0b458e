//! The renderer: a scene to a picture, tile by tile.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use glam::DVec2;
use rayon::ThreadPoolBuilder;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use thiserror::Error;

use crate::film::{Film, FilmError, FilmSettings, Image, Pixel, Window};
use crate::shade::{
    PathIntegrator, PerspectiveCamera, RenderSettings, RenderStatistics, Sampler, ShadingScene,
};
use crate::trace::{Geometry, TracedScene};

/// Pixels along a tile's side: enough work to be worth handing out, and tiles enough for all
/// threads of a small picture. Has no influence on the pixels.
const TILE_SIDE: u32 = 16;

/// How the work is done; nothing here changes a pixel.
#[derive(Clone, Copy)]
pub struct RenderControl<'a> {
    /// Number of threads; 0 is one for each processor.
    pub threads: usize,
    /// Set by another thread to stop.
    pub cancel: &'a AtomicBool,
    /// Called after each tile with the number of pixels done and of all pixels. Several threads
    /// call it, so that a call with fewer pixels done may come later.
    pub progress: &'a (dyn Fn(u64, u64) + Sync),
}

impl std::fmt::Debug for RenderControl<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("RenderControl")
            .field("threads", &self.threads)
            .field("cancel", &self.cancel)
            .finish_non_exhaustive()
    }
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
    /// The threads could not be started.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Renders the film's crop.
///
/// A pixel depends on its place, the seed and the scene alone: any number of threads and any crop
/// give the same bits.
///
/// # Errors
/// If the film's settings make no picture, if threads cannot be started, or on `cancel`.
///
/// # Panics
/// If an object of the scene has no material.
pub fn render<G: Geometry>(
    scene: &ShadingScene<'_, G>,
    camera: &PerspectiveCamera,
    film: &FilmSettings,
    settings: &RenderSettings,
    control: &RenderControl<'_>,
) -> Result<(Image, RenderStatistics), RenderError> {
    let film = Film::try_new(film, &settings.aovs)?;
    let renderer = Renderer {
        scene,
        camera,
        film: &film,
        integrator: PathIntegrator::new(settings),
        seed: settings.seed,
        spp: settings.spp,
        cancel: control.cancel,
    };
    let threads = ThreadPoolBuilder::new().num_threads(control.threads).build()?;
    let tiles: Vec<Window> = film.window().tiles(TILE_SIDE).collect();
    let image = Mutex::new(film.image());
    let (done, total) = (AtomicU64::new(0), film.window().pixels() as u64);

    let render_tile = |tile: Window| -> Result<RenderStatistics, RenderError> {
        // a tile is one thread's work from start to end
        let (made, counted) = TracedScene::counting(|| renderer.tile(tile));
        let (pixels, mut statistics) = made?;
        statistics.trace += counted;
        image.lock().expect("another tile's panic ends the render").put_tile(tile, &pixels);
        let tile = tile.pixels() as u64;
        (control.progress)(done.fetch_add(tile, Ordering::Relaxed) + tile, total);
        Ok(statistics)
    };
    let sum = |mut a: RenderStatistics, b: RenderStatistics| {
        a += b;
        Ok(a)
    };
    let statistics =
        threads.install(|| tiles.into_par_iter().map(render_tile).try_reduce(RenderStatistics::default, sum));
    let image = image.into_inner().expect("a panic has ended the render");
    Ok((image, statistics?))
}

/// What all tiles share.
struct Renderer<'a, G> {
    scene: &'a ShadingScene<'a, G>,
    camera: &'a PerspectiveCamera,
    film: &'a Film,
    integrator: PathIntegrator,
    seed: u64,
    spp: u32,
    cancel: &'a AtomicBool,
}

impl<G: Geometry> Renderer<'_, G> {
    /// The tile's pixels, all channels of one after the other's.
    fn tile(&self, tile: Window) -> Result<(Vec<f32>, RenderStatistics), RenderError> {
        let mut channels = Vec::new();
        let mut statistics = RenderStatistics::default();
        for y in tile.y..tile.y + tile.height {
            for x in tile.x..tile.x + tile.width {
                let pixel = self.pixel([x, y], &mut statistics)?;
                self.film.develop(&pixel, &mut channels);
            }
        }
        Ok((channels, statistics))
    }

    /// All samples of a pixel.
    fn pixel(&self, place: [u32; 2], statistics: &mut RenderStatistics) -> Result<Pixel, RenderError> {
        let corner = DVec2::new(place[0].into(), place[1].into());
        let mut pixel = Pixel::default();
        for index in 0..self.spp {
            if self.cancel.load(Ordering::Relaxed) {
                return Err(RenderError::Interrupted);
            }
            let mut sampler = Sampler::new(self.seed, place, index);
            let ray = self.camera.ray(corner + sampler.next_2d());
            let sample = self.integrator.sample(self.scene, ray, &mut sampler, statistics);
            statistics.samples += 1;
            if !pixel.add(&sample) {
                statistics.non_finite_samples += 1;
            }
        }
        Ok(pixel)
    }
}

#[cfg(test)]
#[path = "render_tests.rs"]
mod tests;
