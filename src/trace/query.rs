//! The three questions rays ask, each compiled for several kinds of processor.

use super::Ray;
use super::dispatch::Work;
use super::scene::{PatchHit, Scratch, TracedScene};

/// The nearest hit.
pub(super) struct Closest<'a> {
    pub(super) scene: &'a TracedScene,
    pub(super) ray: &'a Ray,
    pub(super) scratch: &'a mut Scratch,
}

impl Work for Closest<'_> {
    type Output = Option<PatchHit>;

    #[inline(always)]
    fn run<const WIDE: bool>(self) -> Option<PatchHit> {
        let mut best: Option<PatchHit> = None;
        self.scene.visit::<WIDE>(self.ray, self.scratch, |hit, t_max| {
            // equal distances: the first in the scene's order, whatever the traversal's
            let key = |hit: &PatchHit| (hit.t, hit.object, hit.patch);
            if best.as_ref().is_none_or(|best| key(&hit) < key(best)) {
                best = Some(hit);
            }
            t_max.min(hit.t)
        });
        best.map(|hit| self.scene.polished(hit, self.ray))
    }
}

/// Every hit, sorted along the ray.
pub(super) struct All<'a> {
    pub(super) scene: &'a TracedScene,
    pub(super) ray: &'a Ray,
    pub(super) scratch: &'a mut Scratch,
}

impl Work for All<'_> {
    type Output = Vec<PatchHit>;

    #[inline(always)]
    fn run<const WIDE: bool>(self) -> Vec<PatchHit> {
        let mut hits: Vec<PatchHit> = Vec::new();
        self.scene.visit::<WIDE>(self.ray, self.scratch, |hit, t_max| {
            // leaves of a patch overlap by rounding
            let same = |other: &PatchHit| {
                let error = 2.0 * (hit.st_error + other.st_error);
                (other.object, other.patch) == (hit.object, hit.patch)
                    && (other.st - hit.st).abs().cmple(error).all()
            };
            if !hits.iter().any(same) {
                hits.push(hit);
            }
            t_max
        });
        for hit in &mut hits {
            *hit = self.scene.polished(*hit, self.ray);
        }
        hits.sort_by(|a, b| a.t.total_cmp(&b.t).then((a.object, a.patch).cmp(&(b.object, b.patch))));
        hits
    }
}

/// Whether there is a hit.
pub(super) struct Any<'a> {
    pub(super) scene: &'a TracedScene,
    pub(super) ray: &'a Ray,
    pub(super) scratch: &'a mut Scratch,
}

impl Work for Any<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<const WIDE: bool>(self) -> bool {
        let mut found = false;
        self.scene.visit::<WIDE>(self.ray, self.scratch, |_, _| {
            found = true;
            f64::NEG_INFINITY
        });
        found
    }
}
