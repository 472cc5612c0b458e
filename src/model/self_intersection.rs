//! Whether a deformed surface may run through itself.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::patch::Face;
use crate::trace::{Ray, TracedScene, Tracer};

/// Chords along each parameter of the whole surface, about.
const CHORDS: u32 = 64;

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
    let patches = scene.objects()[object].faces();
    patches.par_iter().find_map_first(|patch| {
        if !patch.leads() {
            return None;
        }
        let part = |side: DVec3| (side.truncate().abs() / span).max_element();
        let [_, s, t] = patch.chart.coordinates();
        let count = DVec2::new(part(s), part(t)) * f64::from(CHORDS);
        let count = count.ceil().clamp(DVec2::ONE, DVec2::splat(CHORDS.into()));
        let places = (0..CHORDS).flat_map(|i| (0..CHORDS).map(move |j| DVec2::new(i.into(), j.into())));
        let mut chords = places
            .filter(|place| place.cmplt(count).all())
            .flat_map(|place| [DVec2::X, DVec2::Y].map(|along| [place / count, (place + along) / count]));
        let mut tracer = scene.tracer();
        chords.find_map(|ends| crossing(&mut tracer, object, patch, ends, span))
    })
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
