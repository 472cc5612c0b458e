//! Many rays on all threads, and what they hit as arrays of plain numbers.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;
use thiserror::Error;

use super::geometry::RayTracer;
use super::interaction::SurfaceInteraction;
use super::ray::Ray;
use super::scene::TracedScene;
use super::statistics::TraceStatistics;

/// Rays handed to a thread at once: enough to hide the handing out, few enough to share the work and to stop soon.
const CHUNK: usize = 1024;

/// Work on a batch of rays was stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("interrupted")]
pub struct Interrupted;

/// Hits, one row each: arrays whose numbers of a row stand side by side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HitArrays {
    /// Ray parameters, in units of the direction; infinite for misses.
    pub t: Vec<f64>,
    /// Whole numbers, of [`Self::ID_NAMES`]; -1 for misses.
    pub ids: [Vec<i32>; 3],
    /// Pairs, of [`Self::PAIR_NAMES`]; NaN for misses.
    pub pairs: [Vec<f64>; 2],
    /// Triples, of [`Self::VECTOR_NAMES`]; NaN for misses.
    pub vectors: [Vec<f64>; 5],
}

impl HitArrays {
    /// Indices: of the object in the scene, of the input face, and of the patch within the object.
    pub const ID_NAMES: [&str; 3] = ["object", "face", "patch"];

    /// Parameters in the patch's unit square, and texture coordinates or a surface's own parameters.
    pub const PAIR_NAMES: [&str; 2] = ["st", "uv"];

    /// The place on the undeformed object, that on the deformed one, the unit geometric normal, and the partials of the position.
    pub const VECTOR_NAMES: [&str; 5] = ["rest", "position", "normal", "dp_ds", "dp_dt"];

    /// Rows of zeros, which take memory only when they are written.
    fn zeros(rows: usize) -> Self {
        Self {
            t: vec![0.0; rows],
            ids: std::array::from_fn(|_| vec![0; rows]),
            pairs: std::array::from_fn(|_| vec![0.0; 2 * rows]),
            vectors: std::array::from_fn(|_| vec![0.0; 3 * rows]),
        }
    }

    /// The rows in runs of these lengths.
    fn runs(&mut self, lengths: impl Iterator<Item = usize>) -> Vec<Rows<'_>> {
        let mut rest = Rows {
            t: &mut self.t,
            ids: self.ids.each_mut().map(Vec::as_mut_slice),
            pairs: self.pairs.each_mut().map(Vec::as_mut_slice),
            vectors: self.vectors.each_mut().map(Vec::as_mut_slice),
        };
        let mut runs = Vec::new();
        for length in lengths {
            let (run, others) = rest.split_at(length);
            runs.push(run);
            rest = others;
        }
        runs
    }
}

/// A run of rows that one thread writes.
struct Rows<'a> {
    t: &'a mut [f64],
    ids: [&'a mut [i32]; 3],
    pairs: [&'a mut [f64]; 2],
    vectors: [&'a mut [f64]; 5],
}

impl Rows<'_> {
    fn split_at(self, rows: usize) -> (Self, Self) {
        let (t, t_after) = self.t.split_at_mut(rows);
        let (ids, ids_after) = split_each(self.ids, rows);
        let (pairs, pairs_after) = split_each(self.pairs, 2 * rows);
        let (vectors, vectors_after) = split_each(self.vectors, 3 * rows);
        (
            Self { t, ids, pairs, vectors },
            Self { t: t_after, ids: ids_after, pairs: pairs_after, vectors: vectors_after },
        )
    }

    fn write(&mut self, row: usize, hit: Option<&SurfaceInteraction>) {
        // ids of 2^31 and more do not fit in memory
        let id = |id: u32| i32::try_from(id).unwrap_or(i32::MAX);
        self.t[row] = hit.map_or(f64::INFINITY, |hit| hit.t);
        let ids = hit.map_or([-1; 3], |hit| [hit.object, hit.face, hit.patch].map(id));
        for (column, id) in self.ids.iter_mut().zip(ids) {
            column[row] = id;
        }
        let pairs = hit.map_or([[f64::NAN; 2]; 2], |hit| [hit.st, hit.uv].map(|pair| pair.to_array()));
        for (column, pair) in self.pairs.iter_mut().zip(pairs) {
            column[2 * row..][..2].copy_from_slice(&pair);
        }
        let vectors =
            hit.map_or([DVec3::NAN; 5], |hit| [hit.rest, hit.position, hit.normal, hit.dp_ds, hit.dp_dt]);
        for (column, vector) in self.vectors.iter_mut().zip(vectors) {
            column[3 * row..][..3].copy_from_slice(&vector.to_array());
        }
    }
}

fn split_each<T, const N: usize>(columns: [&mut [T]; N], at: usize) -> ([&mut [T]; N], [&mut [T]; N]) {
    let mut after = Vec::with_capacity(N);
    let before = columns.map(|column| {
        let (before, rest) = column.split_at_mut(at);
        after.push(rest);
        before
    });
    let mut after = after.into_iter();
    (before, std::array::from_fn(|_| after.next().expect("one rest for each column")))
}

/// What became of a chunk of rays, by one thread.
type Traced = Result<TraceStatistics, Interrupted>;

/// The lengths of the chunks that rays are handed out in.
fn chunk_lengths(rays: usize) -> impl ExactSizeIterator<Item = usize> {
    (0..rays.div_ceil(CHUNK)).map(move |chunk| CHUNK.min(rays - chunk * CHUNK))
}

fn sum(all: impl IntoIterator<Item = TraceStatistics>) -> TraceStatistics {
    let mut sum = TraceStatistics::default();
    all.into_iter().for_each(|statistics| sum += statistics);
    sum
}

impl TracedScene {
    /// The nearest hits of `count` rays, traced on all threads of the current pool: a row for each ray. `ray` gives a ray by its index;
    /// consecutive rays that go close together are traced side by side.
    ///
    /// # Errors
    /// If `cancel` is set by another thread.
    pub fn closest_batch(
        &self,
        count: usize,
        ray: impl Fn(usize) -> Ray + Sync,
        cancel: &AtomicBool,
    ) -> Result<(HitArrays, TraceStatistics), Interrupted> {
        let mut arrays = HitArrays::zeros(count);
        let runs = arrays.runs(chunk_lengths(count));
        let trace = |(chunk, mut rows): (usize, Rows<'_>)| -> Traced {
            if cancel.load(Ordering::Relaxed) {
                return Err(Interrupted);
            }
            let mut tracer = self.tracer();
            let rays: Vec<Ray> = (0..rows.t.len()).map(|row| ray(chunk * CHUNK + row)).collect();
            let mut hits = Vec::with_capacity(rays.len());
            tracer.closest_hits(&rays, &mut hits);
            hits.iter().enumerate().for_each(|(row, hit)| rows.write(row, hit.as_ref()));
            Ok(tracer.take_statistics())
        };
        let statistics: Vec<_> =
            runs.into_par_iter().enumerate().map(trace).collect::<Result<_, Interrupted>>()?;
        Ok((arrays, sum(statistics)))
    }

    /// Every hit of `count` rays, sorted along each: the hits of all rays in one run, and where each ray's begin, with the number
    /// of all at the end. `ray` gives a ray by its index; with `once`, hits in one place at edges and vertices count once.
    ///
    /// # Errors
    /// If `cancel` is set by another thread.
    pub fn all_batch(
        &self,
        count: usize,
        ray: impl Fn(usize) -> Ray + Sync,
        once: bool,
        cancel: &AtomicBool,
    ) -> Result<(HitArrays, Vec<i64>, TraceStatistics), Interrupted> {
        let trace = |chunk: usize| {
            if cancel.load(Ordering::Relaxed) {
                return Err(Interrupted);
            }
            let mut tracer = self.tracer();
            let (mut found, mut counts) = (Vec::new(), Vec::new());
            for index in chunk * CHUNK..count.min((chunk + 1) * CHUNK) {
                let hits = if once { tracer.all_once(&ray(index)) } else { tracer.all(&ray(index)) };
                counts.push(hits.len());
                found.extend(hits.iter().map(|hit| self.interaction(hit)));
            }
            Ok((found, counts, tracer.take_statistics()))
        };
        let chunks: Vec<_> =
            (0..count.div_ceil(CHUNK)).into_par_iter().map(trace).collect::<Result<_, _>>()?;
        let mut offsets = vec![0_i64];
        let mut total = 0;
        for hits in chunks.iter().flat_map(|(_, counts, _)| counts) {
            total += hits;
            offsets.push(i64::try_from(total).expect("fewer than 2^63 hits fit in memory"));
        }
        let mut arrays = HitArrays::zeros(total);
        let runs = arrays.runs(chunks.iter().map(|(found, ..)| found.len()));
        let statistics = sum(chunks.iter().map(|(_, _, statistics)| *statistics));
        runs.into_par_iter().zip(chunks).for_each(|(mut rows, (found, ..))| {
            found.iter().enumerate().for_each(|(row, hit)| rows.write(row, Some(hit)));
        });
        Ok((arrays, offsets, statistics))
    }

    /// For each of `count` rays whether it hits anything. `ray` gives a ray by its index.
    ///
    /// # Errors
    /// If `cancel` is set by another thread.
    pub fn any_batch(
        &self,
        count: usize,
        ray: impl Fn(usize) -> Ray + Sync,
        cancel: &AtomicBool,
    ) -> Result<(Vec<bool>, TraceStatistics), Interrupted> {
        let mut found = vec![false; count];
        let trace = |(chunk, found): (usize, &mut [bool])| -> Traced {
            if cancel.load(Ordering::Relaxed) {
                return Err(Interrupted);
            }
            let mut tracer = self.tracer();
            let rays: Vec<Ray> = (0..found.len()).map(|row| ray(chunk * CHUNK + row)).collect();
            tracer.any_of_each(&rays, found);
            Ok(tracer.take_statistics())
        };
        let statistics: Vec<_> =
            found.par_chunks_mut(CHUNK).enumerate().map(trace).collect::<Result<_, Interrupted>>()?;
        Ok((found, sum(statistics)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subdivide::FrameChoice;
    use crate::test_support::{Noise, ball_triangles, deform, random_volume, scene_of};

    /// A scene and rays, of which some miss it.
    fn scene_and_rays() -> (TracedScene, Vec<Ray>) {
        let mut noise = Noise(3);
        let volume = random_volume(&mut noise, [2; 3], [4; 3], 0.2, false);
        let scene = scene_of(deform(&ball_triangles(), Some(&volume), FrameChoice::Parallelogram));
        let ray = |_| {
            let origin = DVec3::splat(0.5) + 2.0 * noise.unit_vector();
            Ray::new(origin, DVec3::splat(0.5) + 0.8 * noise.vector() - origin)
        };
        let rays = (0..3 * CHUNK + 7).map(ray).collect();
        (scene, rays)
    }

    #[test]
    fn batches_are_the_rays_one_by_one() {
        let (scene, rays) = scene_and_rays();
        let go = AtomicBool::new(false);
        let (nearest, statistics) = scene.closest_batch(rays.len(), |index| rays[index], &go).unwrap();
        let (any, _) = scene.any_batch(rays.len(), |index| rays[index], &go).unwrap();
        let (all, offsets, _) = scene.all_batch(rays.len(), |index| rays[index], false, &go).unwrap();
        assert_eq!(statistics.rays, rays.len() as u64);
        assert_eq!(offsets.len(), rays.len() + 1);
        let mut hits = 0;
        for (row, ray) in rays.iter().enumerate() {
            let hit = scene.closest_hit(ray);
            assert_eq!(any[row], hit.is_some());
            assert_eq!(nearest.t[row].to_bits(), hit.map_or(f64::INFINITY, |hit| hit.t).to_bits());
            let ts: Vec<f64> = scene.all(ray).iter().map(|hit| hit.t).collect();
            let [start, end] = [row, row + 1].map(|row| usize::try_from(offsets[row]).unwrap());
            assert_eq!(all.t[start..end], ts);
            match hit {
                Some(hit) => {
                    hits += 1;
                    assert_eq!(nearest.ids[2][row], i32::try_from(hit.patch).unwrap());
                    assert_eq!(nearest.pairs[0][2 * row..][..2], hit.st.to_array());
                    assert_eq!(nearest.vectors[1][3 * row..][..3], hit.position.to_array());
                }
                None => assert!(nearest.ids[0][row] == -1 && nearest.vectors[4][3 * row + 2].is_nan()),
            }
        }
        assert!(hits > CHUNK && hits < rays.len(), "{hits}");
    }

    #[test]
    fn batches_stop() {
        let (scene, rays) = scene_and_rays();
        let stop = AtomicBool::new(true);
        assert_eq!(scene.closest_batch(rays.len(), |index| rays[index], &stop), Err(Interrupted));
        assert_eq!(scene.any_batch(rays.len(), |index| rays[index], &stop), Err(Interrupted));
        assert!(scene.all_batch(rays.len(), |index| rays[index], true, &stop).is_err());
    }
}
