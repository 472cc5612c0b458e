//! Time by least values: what else the machine does only ever adds.

use std::time::Instant;

use glam::DVec3;
use rayon::prelude::*;
use trimray::trace::{Ray, TracedScene};

use super::rays::SinglePrecisionRay;

/// Rays in a chunk: whole packets, and long enough that neither the clock nor refilling the caches counts.
pub(crate) const CHUNK: usize = 1 << 16;

/// Rays that a thread takes at once: several rows of tiles.
const PART: usize = 1 << 12;

/// The least time of any round for each chunk.
pub(crate) struct LeastTimes(Vec<f64>);

impl LeastTimes {
    pub(crate) fn new(chunks: usize) -> Self {
        Self(vec![f64::INFINITY; chunks])
    }

    pub(crate) fn add(&mut self, chunk: usize, seconds: f64) {
        self.0[chunk] = self.0[chunk].min(seconds);
    }

    /// Rays a second.
    pub(crate) fn rate(&self, rays: usize) -> f64 {
        rays as f64 / self.0.iter().sum::<f64>()
    }
}

/// The least seconds of some runs.
pub(crate) fn least_seconds(runs: usize, mut work: impl FnMut()) -> f64 {
    let timed = |_| {
        let started = Instant::now();
        work();
        started.elapsed().as_secs_f64()
    };
    (0..runs.max(1)).map(timed).fold(f64::INFINITY, f64::min)
}

/// Traces rays and writes their ray parameters, infinity for a miss.
pub(crate) fn trace_single(scene: &TracedScene, rays: &[SinglePrecisionRay], distances: &mut [f64]) {
    let mut tracer = scene.tracer();
    for (ray, distance) in rays.iter().zip(distances) {
        *distance = tracer.closest(&ray.ray()).map_or(f64::INFINITY, |hit| hit.t);
    }
}

/// The same by the call that takes many rays.
pub(crate) fn trace_packets(scene: &TracedScene, rays: &[SinglePrecisionRay], distances: &mut [f64]) {
    const AT_ONCE: usize = 64;
    let mut exact = [Ray::new(DVec3::ZERO, DVec3::X); AT_ONCE];
    let mut hits = [None; AT_ONCE];
    let mut tracer = scene.tracer();
    for (rays, distances) in rays.chunks(AT_ONCE).zip(distances.chunks_mut(AT_ONCE)) {
        let (exact, hits) = (&mut exact[..rays.len()], &mut hits[..rays.len()]);
        for (exact, ray) in exact.iter_mut().zip(rays) {
            *exact = ray.ray();
        }
        tracer.closest_of_each(exact, hits);
        for (distance, hit) in distances.iter_mut().zip(hits) {
            *distance = hit.map_or(f64::INFINITY, |hit| hit.t);
        }
    }
}

/// A way of tracing many rays.
pub(crate) type TraceWay = fn(&TracedScene, &[SinglePrecisionRay], &mut [f64]);

/// Rays a second, one thread, for the nearest hits; from the ray in memory to its parameter in memory.
pub(crate) fn closest_rate(
    scene: &TracedScene,
    rays: &[SinglePrecisionRay],
    rounds: usize,
    way: TraceWay,
) -> f64 {
    let mut distances = vec![0.0; rays.len().min(CHUNK)];
    let mut times = LeastTimes::new(rays.len().div_ceil(CHUNK));
    for _ in 0..rounds.max(1) {
        for (chunk, rays) in rays.chunks(CHUNK).enumerate() {
            let started = Instant::now();
            way(scene, rays, &mut distances[..rays.len()]);
            times.add(chunk, started.elapsed().as_secs_f64());
            std::hint::black_box(&distances);
        }
    }
    times.rate(rays.len())
}

/// The least seconds that some threads take for all rays.
pub(crate) fn seconds_of_threads(
    scene: &TracedScene,
    rays: &[SinglePrecisionRay],
    (rounds, threads): (usize, usize),
    way: TraceWay,
) -> f64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
    let mut distances = vec![0.0; rays.len()];
    pool.install(|| {
        least_seconds(rounds, || {
            let parts = rays.par_chunks(PART).zip(distances.par_chunks_mut(PART));
            parts.for_each(|(rays, distances)| way(scene, rays, distances));
        })
    })
}
