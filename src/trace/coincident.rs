//! Hits of one ray in one place: where faces of a plane overlap, and at edges and vertices that faces share.

use crate::patch::LoopPosition;

use super::object::PatchHit;
use super::ray::Ray;
use super::scene::TracedScene;

/// The hits, each followed by one for every other loop that holds its place and not only at its border.
pub(super) fn with_others(scene: &TracedScene, ray: &Ray, hits: Vec<PatchHit>) -> Vec<PatchHit> {
    let overlaps = scene.overlaps();
    if overlaps.is_empty() {
        return hits;
    }
    let mut all = Vec::with_capacity(hits.len());
    for hit in hits {
        all.push(hit);
        let others = overlaps.others(&hit);
        if others.is_empty() {
            continue;
        }
        let region = &scene.trimmed(&hit).region;
        let tolerance = scene.st_error(&hit, ray);
        let others = others.iter().map(|&other| region.trim_loop(other as usize));
        let others = others
            .filter(|other| region.position(other, hit.st, tolerance) == LoopPosition::Inside)
            .map(|other| PatchHit { face: other.face, polygon: other.polygon, on_border: false, ..hit });
        all.extend(others);
    }
    all
}

/// Sorted hits without those at an edge or a vertex of a face where another face of the object has one already.
pub(super) fn once(scene: &TracedScene, ray: &Ray, hits: &[PatchHit]) -> Vec<PatchHit> {
    let mut kept: Vec<(PatchHit, f64)> = Vec::with_capacity(hits.len());
    for hit in hits {
        let blur = blur(scene, ray, hit);
        let near = |(other, reach): &&(PatchHit, f64)| {
            other.object == hit.object
                && (hit.t - other.t).abs() * ray.direction.length() <= blur + reach
                && is_at_border(scene, ray, hit)
                && is_at_border(scene, ray, other)
        };
        if !kept.iter().rev().any(|other| near(&other)) {
            kept.push((*hit, blur));
        }
    }
    kept.into_iter().map(|(hit, _)| hit).collect()
}

/// How far rounding may have moved a hit along the surface.
fn blur(scene: &TracedScene, ray: &Ray, hit: &PatchHit) -> f64 {
    let error = scene.st_error(hit, ray);
    let point = scene.trimmed(hit).patch.eval(hit.st);
    2.0 * (error.x * point.dp_ds.length() + error.y * point.dp_dt.length())
}

fn is_at_border(scene: &TracedScene, ray: &Ray, hit: &PatchHit) -> bool {
    let face = scene.trimmed(hit);
    let tolerance = 2.0 * scene.st_error(hit, ray);
    let own = |trim_loop: &_| face.region.position(trim_loop, hit.st, tolerance) == LoopPosition::Border;
    let [_, strictly] = face.sides(hit.st, tolerance);
    !strictly || face.region.loops().filter(|trim_loop| trim_loop.polygon == hit.polygon).any(|l| own(&l))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use crate::subdivide::FrameChoice;
    use crate::test_support::{Noise, ball_triangles, cube_triangles, deform, random_volume, scene_of};
    use crate::trace::Ray;

    #[test]
    fn faces_of_a_plane_that_overlap_are_hit_one_by_one() {
        let quad = |from: f64| {
            let corner = |x: f64, y: f64| DVec3::new(0.4 * x, 0.4 * y, 0.3);
            let [a, b, c, d] =
                [corner(from, 0.0), corner(from + 2.0, 0.0), corner(from + 2.0, 1.0), corner(from, 1.0)];
            [[a, b, c], [a, c, d]]
        };
        let triangles: Vec<_> = [0.0, 1.0].into_iter().flat_map(quad).collect();
        let volume = random_volume(&mut Noise(3), [2; 3], [4; 3], 0.1, false);
        for volume in [None, Some(&volume)] {
            let scene = scene_of(deform(&triangles, volume, FrameChoice::Parallelogram));
            let image = |x: f64, y: f64| {
                let rest = DVec3::new(0.4 * x, 0.4 * y, 0.3);
                volume.map_or(rest, |volume| volume.eval(rest).unwrap().position)
            };
            for (x, y, want) in [(0.5, 0.3, 1), (1.3, 0.4, 2), (1.8, 0.1, 2), (2.5, 0.8, 1)] {
                let ray = Ray::new(image(x, y) + DVec3::Z, DVec3::NEG_Z);
                let hits = scene.all(&ray);
                assert_eq!(hits.len(), want, "at {x}, {y}: {hits:?}");
                assert!(hits.windows(2).all(|pair| pair[0].t == pair[1].t && pair[0].face != pair[1].face));
                assert_eq!(scene.tracer().all_once(&ray).len(), want, "at {x}, {y}");
            }
            // on the diagonal that two of them share, inside of another
            let ray = Ray::new(image(1.2, 0.6) + DVec3::Z, DVec3::NEG_Z);
            assert_eq!(scene.tracer().all_once(&ray).len(), 2);
        }
    }

    #[test]
    fn an_edge_or_a_vertex_counts_once() {
        let mut noise = Noise(4);
        let volume = random_volume(&mut noise, [2; 3], [5; 3], 0.05, false);
        for triangles in [cube_triangles(), ball_triangles()] {
            let scene = scene_of(deform(&triangles, Some(&volume), FrameChoice::Parallelogram));
            let inside = volume.eval(DVec3::splat(0.5)).unwrap().position;
            let mut tracer = scene.tracer();
            let mut shared = 0;
            for corners in &triangles {
                for (i, &a) in corners.iter().enumerate() {
                    let b = corners[(i + 1) % 3];
                    for part in [0.0, 0.5, 0.3, noise.next() + 0.5] {
                        let target = volume.eval(a.lerp(b, part)).unwrap().position;
                        let ray = Ray::new(inside, target - inside);
                        let (all, once) = (tracer.all(&ray), tracer.all_once(&ray));
                        assert_eq!(once.len(), 1, "at {target}: {once:?} of {all:?}");
                        shared += usize::from(all.len() > 1);
                    }
                }
            }
            assert!(shared > triangles.len(), "{shared} rays meet several patches");
        }
    }
}
