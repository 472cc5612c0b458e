//! The work on one picture: which samples of which tiles, in which order.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use glam::DVec2;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use super::checkpoint::{CheckpointError, PASS};
use super::{RenderControl, RenderError};
use crate::film::{Exposure, Film, Image, Sample, Window};
use crate::shade::{
    Camera, PathBuffers, PathIntegrator, PathStart, RenderSettings, RenderStatistics, Sampler, ShadingScene,
};
use crate::trace::{Geometry, RayTracer};

/// Pixels along the side of the square whose paths are followed together: enough that few rays of a packet are missing
/// where paths end, and few enough that all fits the caches.
const GROUP_SIDE: u32 = 4;

/// A picture being rendered.
pub(super) struct Job<'a, G> {
    scene: &'a ShadingScene<'a, G>,
    camera: &'a Camera,
    film: &'a Film,
    settings: &'a RenderSettings,
    integrator: PathIntegrator,
    control: &'a RenderControl<'a>,
    /// What has been done of each tile.
    tiles: Vec<Mutex<Exposure>>,
}

/// Why a thread stops before the last sample.
enum Stop {
    /// With the picture as it is.
    Deadline,
    Error(RenderError),
}

impl From<RenderError> for Stop {
    fn from(error: RenderError) -> Self {
        Self::Error(error)
    }
}

/// What a thread keeps from one group of pixels to the next.
struct Buffers<T> {
    starts: Vec<PathStart>,
    offsets: Vec<DVec2>,
    samples: Vec<Sample>,
    paths: PathBuffers<T>,
    statistics: RenderStatistics,
}

impl<T: RayTracer> Buffers<T> {
    fn new(tracer: T) -> Self {
        Self {
            starts: Vec::new(),
            offsets: Vec::new(),
            samples: Vec::new(),
            paths: PathBuffers::new(tracer),
            statistics: RenderStatistics::default(),
        }
    }

    /// What was counted since this was last called.
    fn take_statistics(&mut self) -> RenderStatistics {
        let mut statistics = std::mem::take(&mut self.statistics);
        statistics.trace += self.paths.take_statistics();
        statistics
    }
}

impl<'a, G: Geometry> Job<'a, G> {
    pub(super) fn new(
        scene: &'a ShadingScene<'a, G>,
        camera: &'a Camera,
        (film, settings): (&'a Film, &'a RenderSettings),
        control: &'a RenderControl<'a>,
    ) -> Result<Self, CheckpointError> {
        let mut tiles: Vec<Exposure> = film.tiles().into_iter().map(|tile| film.exposure(tile)).collect();
        if let Some(checkpoint) = control.resume {
            checkpoint.restore(&mut tiles, settings.spp)?;
        }
        let tiles = tiles.into_iter().map(Mutex::new).collect();
        let integrator = PathIntegrator::new(settings);
        Ok(Self { scene, camera, film, settings, integrator, control, tiles })
    }

    /// Renders what is missing; what is done stays in the tiles whether it ends well or not.
    pub(super) fn run(&self) -> Result<RenderStatistics, RenderError> {
        let spp = self.settings.spp;
        let pixels = |tile: &Mutex<Exposure>| lock(tile).tile().pixels() as u64;
        let done = |tile: &Mutex<Exposure>| pixels(tile) * u64::from(lock(tile).samples());
        let total = self.tiles.iter().map(pixels).sum::<u64>() * u64::from(spp);
        let samples = AtomicU64::new(self.tiles.iter().map(done).sum());
        let mut statistics = RenderStatistics::default();
        for start in (0..spp).step_by(PASS as usize) {
            let end = spp.min(start.saturating_add(PASS));
            let buffers = || Buffers::new(self.scene.geometry.tracer());
            let of_tile =
                |buffers: &mut Buffers<_>, tile: &Mutex<Exposure>| -> Result<RenderStatistics, Stop> {
                    let statistics = self.advance(tile, end, buffers)?;
                    let done = samples.fetch_add(statistics.samples, Ordering::Relaxed) + statistics.samples;
                    (self.control.progress)(done, total);
                    if let Some(file) = self.control.checkpoint {
                        file.save_if_due(&self.tiles).map_err(RenderError::from)?;
                    }
                    Ok(statistics)
                };
            let sum = |mut a: RenderStatistics, b: RenderStatistics| {
                a += b;
                Ok(a)
            };
            match self.tiles.par_iter().map_init(buffers, of_tile).try_reduce(RenderStatistics::default, sum)
            {
                Ok(counted) => statistics += counted,
                Err(Stop::Deadline) => break,
                Err(Stop::Error(error)) => return Err(error),
            }
        }
        Ok(statistics)
    }

    /// Brings a tile to `end` samples of each pixel, or leaves it as it is.
    fn advance(
        &self,
        tile: &Mutex<Exposure>,
        end: u32,
        buffers: &mut Buffers<G::Tracer<'_>>,
    ) -> Result<RenderStatistics, Stop> {
        let mut exposure = lock(tile).clone();
        let start = exposure.samples();
        if start >= end {
            return Ok(RenderStatistics::default());
        }
        // a tile that was left as it was does not count
        buffers.take_statistics();
        for group in exposure.tile().tiles(GROUP_SIDE) {
            self.check_stop()?;
            self.expose(group, [start, end], buffers, &mut exposure);
        }
        let statistics = buffers.take_statistics();
        exposure.end_pass(start..end);
        if let Some(preview) = self.control.preview
            && let Some((window, channels)) = self.film.develop_tile(&exposure, &[&exposure])
        {
            preview.show(window, &channels);
        }
        *lock(tile) = exposure;
        Ok(statistics)
    }

    fn check_stop(&self) -> Result<(), Stop> {
        if self.control.cancel.load(Ordering::Relaxed) {
            return Err(Stop::Error(RenderError::Interrupted));
        }
        match self.control.deadline {
            Some(deadline) if Instant::now() >= deadline => Err(Stop::Deadline),
            _ => Ok(()),
        }
    }

    /// Adds samples of a group of pixels.
    fn expose(
        &self,
        group: Window,
        [start, end]: [u32; 2],
        buffers: &mut Buffers<G::Tracer<'_>>,
        exposure: &mut Exposure,
    ) {
        let Buffers { starts, offsets, samples, paths, statistics } = buffers;
        offsets.clear();
        for pixel in group.places() {
            for index in start..end {
                let RenderSettings { seed, sampler, .. } = *self.settings;
                let mut sampler: Sampler = sampler.sampler(seed, pixel, index);
                let offset = sampler.next_2d();
                let on_lens = if self.camera.has_lens() { sampler.next_2d() } else { DVec2::splat(0.5) };
                let corner = DVec2::new(pixel[0].into(), pixel[1].into());
                offsets.push(offset);
                starts.push(PathStart { ray: self.camera.ray(corner + offset, on_lens), sampler });
            }
        }
        samples.clear();
        self.integrator.sample(self.scene, starts.drain(..), (paths, statistics), samples);
        statistics.samples += samples.len() as u64;
        let of_pixel = (end - start) as usize;
        let taken = offsets.chunks(of_pixel).zip(samples.chunks(of_pixel));
        for (pixel, (offsets, samples)) in group.places().zip(taken) {
            statistics.non_finite_samples += exposure.add(pixel, start, offsets, samples);
        }
    }
}

impl<G> Job<'_, G> {
    /// What has been done of each tile.
    pub(super) fn tiles(&self) -> &[Mutex<Exposure>] {
        &self.tiles
    }

    /// The picture, and the least and greatest number of samples of a pixel.
    pub(super) fn finish(self) -> (Image, [u32; 2]) {
        let tiles: Vec<Exposure> = self
            .tiles
            .into_iter()
            .map(|tile| tile.into_inner().expect("a panic has ended the render"))
            .collect();
        let samples = || tiles.iter().map(Exposure::samples);
        let range = [samples().min().unwrap_or(0), samples().max().unwrap_or(0)];
        (self.film.develop(&tiles), range)
    }
}

fn lock(tile: &Mutex<Exposure>) -> std::sync::MutexGuard<'_, Exposure> {
    tile.lock().expect("another thread's panic ends the render")
}
