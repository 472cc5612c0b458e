//! Whether a deformed surface may run through itself.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::patch::TrimmedPatch;
use crate::trace::{Ray, TracedScene};

/// Chords along each parameter of the whole surface, about.
const CHORDS: f64 = 64.0;

/// Chords leave the surface by less than their length; their ends are on it.
const END: f64 = 1e-6;

/// A hit this many chords away is not on the part of the surface that the chord spans.
const APART: f64 = 3.0;

/// Two places (u, v) of a surface where it may run through itself: a chord of the surface about the first meets it at the
/// second. None is no proof that there are none (Wang et al., Remark 5.1, knows no test at all).
pub(super) fn self_intersection(
    scene: &TracedScene,
    object: usize,
    domain: [[f64; 2]; 2],
) -> Option<[DVec2; 2]> {
    let span = DVec2::from_array(domain.map(|[low, high]| high - low));
    let patches = &scene.objects()[object].patches;
    patches.par_iter().find_map_first(|patch| {
        if !patch.leads() {
            return None;
        }
        let vector = |v: DVec3| v.truncate().abs() / span;
        let count = [vector(patch.frame.s), vector(patch.frame.t)]
            .map(|size| (CHORDS * size.max_element()).ceil().clamp(1.0, CHORDS));
        let step = DVec2::from_array(count.map(|count| 1.0 / count));
        let [rows, columns] = count;
        let mut place = DVec2::ZERO;
        while place.x < rows {
            place.y = 0.0;
            while place.y < columns {
                for along in [DVec2::X, DVec2::Y] {
                    let ends = [place * step, (place + along) * step];
                    if let Some(found) = crossing(scene, object, patch, ends, span) {
                        return Some(found);
                    }
                }
                place.y += 1.0;
            }
            place.x += 1.0;
        }
        None
    })
}

/// Where a chord between two places of a patch meets the surface far from them.
fn crossing(
    scene: &TracedScene,
    object: usize,
    patch: &TrimmedPatch,
    ends: [DVec2; 2],
    span: DVec2,
) -> Option<[DVec2; 2]> {
    let [from, to] = ends.map(|st| patch.eval_whole(st).position);
    let mut ray = Ray::new(from, to - from);
    if ray.direction == DVec3::ZERO {
        return None;
    }
    (ray.t_min, ray.t_max) = (END, 1.0 - END);
    let own = patch.frame.point(0.5 * (ends[0] + ends[1])).truncate();
    let hits = scene.all(&ray).into_iter().filter(|hit| hit.object as usize == object);
    let mut places =
        hits.map(|hit| scene.objects()[object].patches[hit.patch as usize].frame.point(hit.st).truncate());
    let far = |other: &DVec2| ((*other - own) / span).abs().max_element() > APART / CHORDS;
    places.find(far).map(|other| [own, other])
}
