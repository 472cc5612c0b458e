//! Whether a deformed surface may run through itself.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::patch::Face;
use crate::trace::{Ray, TraceStatistics, TracedScene, Tracer};

/// Chords along each parameter of the whole surface, about.
const CHORDS: u32 = 64;

/// Chords leave the surface by less than their length; their ends are on it.
const END: f64 = 1e-6;

/// Boxes that clipping may examine in all patches together; then the search ends, for it proves nothing anyway. A chord of a
/// surface whose leaves are proven takes none, and some tests of leaves, which cost less.
const MAX_BOXES: u64 = 1 << 17;

/// Patches that are searched side by side at first; more once they turn out to take little.
const FIRST_PATCHES: usize = 16;

/// Tests of leaves that cost as much as a box.
const LEAF_TESTS_OF_A_BOX: u64 = 16;

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
    let patches = scene.objects()[object].faces();
    let (mut rest, mut count, mut left) = (patches, FIRST_PATCHES, MAX_BOXES);
    while !rest.is_empty() && left > 0 {
        // in shares of which each is searched whole, so that neither the number of threads nor their luck tells what is found
        let (some, others) = rest.split_at(count.min(rest.len()));
        let most = left / some.len() as u64;
        let searched: Vec<_> =
            some.par_iter().map(|patch| of_patch(&mut scene.tracer(), object, patch, (span, most))).collect();
        let before = left;
        for (found, spent) in searched {
            if found.is_some() {
                return found;
            }
            left = left.saturating_sub(spent);
        }
        if before - left < before / 64 {
            count *= 2;
        }
        rest = others;
    }
    None
}

/// Two places where a chord of a patch meets the surface, if any, and what the search has cost; it ends when that is above `most`.
fn of_patch(
    tracer: &mut Tracer<'_>,
    object: usize,
    patch: &Face,
    (span, most): (DVec2, u64),
) -> (Option<[DVec2; 2]>, u64) {
    if !patch.leads() {
        return (None, 0);
    }
    let part = |side: DVec3| (side.truncate().abs() / span).max_element();
    let [_, s, t] = patch.chart.coordinates();
    let count = DVec2::new(part(s), part(t)) * f64::from(CHORDS);
    let count = count.ceil().clamp(DVec2::ONE, DVec2::splat(CHORDS.into()));
    let places = (0..CHORDS).flat_map(|i| (0..CHORDS).map(move |j| DVec2::new(i.into(), j.into())));
    let chords = places
        .filter(|place| place.cmplt(count).all())
        .flat_map(|place| [DVec2::X, DVec2::Y].map(|along| [place / count, (place + along) / count]));
    let mut spent = 0;
    for ends in chords {
        if let found @ Some(_) = crossing(tracer, object, patch, ends, span) {
            return (found, spent);
        }
        let TraceStatistics { boxes, leaf_tests, .. } = tracer.statistics();
        spent = boxes + leaf_tests / LEAF_TESTS_OF_A_BOX;
        if spent > most {
            break;
        }
    }
    (None, spent)
}

/// Where a chord between two places of a patch meets the surface far from them.
fn crossing(
    tracer: &mut Tracer<'_>,
    object: usize,
    patch: &Face,
    ends: [DVec2; 2],
    span: DVec2,
) -> Option<[DVec2; 2]> {
    let [from, to] = ends.map(|st| patch.eval_whole(st).position);
    let mut ray = Ray::new(from, to - from);
    if ray.direction == DVec3::ZERO {
        return None;
    }
    (ray.t_min, ray.t_max) = (END, 1.0 - END);
    let own = patch.chart.place(0.5 * (ends[0] + ends[1])).coordinates().truncate();
    let hits = tracer.all(&ray).into_iter().filter(|hit| hit.object as usize == object);
    let mut places = hits.map(|hit| {
        tracer.scene().objects()[object].faces()[hit.patch as usize]
            .chart
            .place(hit.st)
            .coordinates()
            .truncate()
    });
    let far = |other: &DVec2| ((*other - own) / span).abs().max_element() > APART / f64::from(CHORDS);
    places.find(far).map(|other| [own, other])
}
