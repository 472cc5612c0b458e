//! Scenes of other sizes and in other places give the hits of the unit scene.
//!
//! Between the unit scene and one scaled or moved, everything rounds differently: the mesh, the lattice, the composed
//! patches, the ray. All of these are roundings of coordinates not larger than a patch's magnitude, and `st_error` of a hit
//! is what the rounding of some tens of operations on such coordinates moves it by: γ(64) times the magnitude, times the
//! hit's sensitivity. The two scenes' hits are therefore within the sum of both errors, times `LIPSCHITZ` for roundings of
//! the undeformed shape, which the volume stretches.

use super::*;
use crate::spline::{KnotVector, SplineVolume};
use crate::test_support::{ball_triangles, random_volume};

/// More than the volumes here stretch.
const LIPSCHITZ: f64 = 4.0;

/// A place and a size: p becomes `scale` p + `offset`.
#[derive(Clone, Copy, Debug)]
struct Placement {
    scale: f64,
    offset: DVec3,
}

impl Placement {
    fn point(&self, p: DVec3) -> DVec3 {
        self.scale * p + self.offset
    }

    fn volume(&self, volume: &SplineVolume) -> SplineVolume {
        let axes = [0, 1, 2].map(|axis| {
            let knots = &volume.axes()[axis];
            let ends = [DVec3::ZERO, DVec3::ONE].map(|end| self.point(end)[axis]);
            KnotVector::clamped_uniform(knots.degree(), knots.points(), ends[0], ends[1]).unwrap()
        });
        let points: Vec<_> =
            volume.control_points().iter().map(|p| self.point(p.truncate()).extend(p.w)).collect();
        SplineVolume::try_new(axes, &points).unwrap()
    }

    fn scene(&self, triangles: &[[DVec3; 3]], volume: &SplineVolume) -> TracedScene {
        let placed: Vec<_> = triangles.iter().map(|corners| corners.map(|p| self.point(p))).collect();
        scene_of(deform(&placed, Some(&self.volume(volume)), FrameChoice::Parallelogram))
    }

    /// The same t for the same place.
    fn ray(&self, ray: &Ray) -> Ray {
        Ray { origin: self.point(ray.origin), direction: self.scale * ray.direction, ..*ray }
    }
}

fn random_ray(noise: &mut Noise) -> Ray {
    let origin = 0.5 + 2.0 * noise.unit_vector();
    Ray::new(origin, 0.5 + noise.vector() - origin)
}

#[test]
fn a_scale_of_a_power_of_two_gives_the_same_bits() {
    let mut noise = Noise(401);
    for rational in [false, true] {
        let volume = random_volume(&mut noise, [2, 3, 2], [4, 5, 4], 0.2, rational);
        let rays: Vec<_> = (0..3000).map(|_| random_ray(&mut noise)).collect();
        let scene = Placement { scale: 1.0, offset: DVec3::ZERO }.scene(&ball_triangles(), &volume);
        let want: Vec<_> = rays.iter().map(|ray| scene.all(ray)).collect();
        assert!(want.iter().map(Vec::len).sum::<usize>() > 3000);
        for power in [-40, -20, -1, 1, 20, 40] {
            let placement = Placement { scale: libm::ldexp(1.0, power), offset: DVec3::ZERO };
            let scaled = placement.scene(&ball_triangles(), &volume);
            for (ray, want) in rays.iter().zip(&want) {
                assert_eq!(&scaled.all(&placement.ray(ray)), want, "2^{power}: {ray:?}");
            }
        }
    }
}

/// Whether rounding may add a hit or take it away: at a border of the trim, or where the ray is all but tangent.
fn is_delicate(scene: &TracedScene, hit: &PatchHit, st_error: DVec2, factor: f64) -> bool {
    let margin = factor * st_error + 1e-12;
    let trimmed = patch_of(scene, hit);
    let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let inside = corners.iter().all(|&(s, t)| {
        let moved = hit.st + DVec2::new(s, t) * margin;
        trimmed.region.find(moved, DVec2::ZERO).is_some_and(|found| found.polygon == hit.polygon)
    });
    let all_but_tangent = st_error.max_element() > 1e-12;
    hit.tangent || all_but_tangent || !inside
}

/// Compares `all` and `closest` of rays in the unit scene and where it is placed; returns how many hits were compared.
fn assert_same_hits(noise: &mut Noise, placement: Placement) -> usize {
    // the greatest coordinate in parts of the size: what roundings are larger by
    let distance = 1.0 + placement.offset.length() / placement.scale;
    let volume = random_volume(noise, [2, 3, 2], [4, 5, 4], 0.2, false);
    let unit = Placement { scale: 1.0, offset: DVec3::ZERO }.scene(&ball_triangles(), &volume);
    let scene = placement.scene(&ball_triangles(), &volume);
    let mut compared = 0;
    for number in 0..2000 {
        let ray = random_ray(noise);
        let placed = placement.ray(&ray);
        let (want, got) = (unit.all(&ray), scene.all(&placed));
        let delicate =
            |hit: &PatchHit| is_delicate(&unit, hit, unit.st_error(hit, &ray), LIPSCHITZ * distance);
        if want.iter().any(delicate) {
            continue;
        }
        let what = format!("{placement:?}, ray {number} {ray:?}: {got:?}, want {want:?}");
        assert_eq!(got.len(), want.len(), "{what}");
        for (got, want) in got.iter().zip(&want) {
            assert_eq!(got.polygon, want.polygon, "{what}");
            let [got, want] = [(&scene, got, &placed), (&unit, want, &ray)].map(|(scene, hit, ray)| {
                let trimmed = patch_of(scene, hit);
                let [_, s, t] = trimmed.chart.coordinates();
                (trimmed.chart.place(hit.st).coordinates(), scene.st_error(hit, ray), s.abs() + t.abs())
            });
            // patches may be cut and framed otherwise, so places on the undeformed shape are compared
            let off = (got.0 - placement.point(want.0)).abs().max_element() / placement.scale;
            let error = |(_, error, size): (DVec3, DVec2, DVec3), scale: f64| {
                error.max_element() * size.max_element() / scale
            };
            let bound = LIPSCHITZ * (error(got, placement.scale) + error(want, 1.0));
            assert!(off <= bound, "off by {off:e}, bound {bound:e}: {what}");
            compared += 1;
        }
        let first = scene.closest(&placed).map(|hit| hit.t);
        assert_eq!(first, got.first().map(|hit| hit.t), "{what}");
    }
    compared
}

#[test]
fn other_sizes_give_the_same_hits() {
    let mut noise = Noise(402);
    for scale in [1e-6, 1e-3, 0.3, 1e3, 1e6] {
        let compared = assert_same_hits(&mut noise, Placement { scale, offset: DVec3::ZERO });
        assert!(compared > 2000, "scale {scale}: {compared}");
    }
}

#[test]
fn other_places_give_the_same_hits() {
    let mut noise = Noise(403);
    for distance in [1.0, 1e3, 1e4, 1e5, 1e6] {
        for scale in [1.0, 1e-3, 1e3] {
            let offset = scale * distance * noise.unit_vector();
            let compared = assert_same_hits(&mut noise, Placement { scale, offset });
            assert!(compared > 1500, "distance {distance}: {compared}");
        }
    }
}
