//! The rays: camera, random and bounce rays, the same on every run.
//!
//! Origins and directions are single precision numbers, so that Embree and trimray trace the same rays.

use glam::{DVec3, Vec3};
use trimray::random::SplitMix64;
use trimray::trace::{Ray, RayTracer, TracedScene};

use super::objects::Subject;

/// Side of the tiles in which camera rays are ordered: one packet of 16.
const TILE: u32 = 4;

/// Share of camera rays that hit.
const PRIMARY_SHARE: f64 = 0.38;

/// Share of random rays that hit, where the object is not too thin for it.
const RANDOM_SHARE: f64 = 0.25;

/// Field of view of the camera, in degrees.
const FIELD_OF_VIEW: f64 = 40.0;

/// Where the camera looks from.
const VIEW: DVec3 = DVec3::new(0.55, -0.75, 0.37);

/// How far above the surface bounce rays start, in parts of the diagonal: above a tessellation of error 1e-5 as well. On
/// coarser ones some start below the flat triangles and hit those at once; the comparison of hits shows how many.
const BOUNCE_OFFSET: f64 = 2e-5;

/// Bounce rays from each hit of a camera ray, among which those that hit are looked for.
const BOUNCES: u32 = 4;

/// Random rays among which those that hit are looked for: this many times as many as are wanted.
const RANDOM_CANDIDATES: usize = 4;

/// A ray in single precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SinglePrecisionRay {
    /// Where it starts.
    pub(crate) origin: Vec3,
    /// Its direction, a unit vector but for rounding.
    pub(crate) direction: Vec3,
}

impl SinglePrecisionRay {
    fn rounded(origin: DVec3, direction: DVec3) -> Self {
        Self { origin: origin.as_vec3(), direction: direction.normalize().as_vec3() }
    }

    /// The same ray as trimray takes it.
    pub(crate) fn ray(&self) -> Ray {
        Ray::new(self.origin.as_dvec3(), self.direction.as_dvec3())
    }
}

/// Rays that are measured together.
#[derive(Debug)]
pub(crate) struct RaySet {
    /// "primary", "random" or "bounce".
    pub(crate) kind: &'static str,
    /// Whether the rays that miss were left out.
    pub(crate) hits_only: bool,
    /// Whether consecutive rays are close to one another.
    pub(crate) coherent: bool,
    /// The rays.
    pub(crate) rays: Vec<SinglePrecisionRay>,
}

impl RaySet {
    /// As the tables have it: "hit random".
    pub(crate) fn name(&self) -> String {
        format!("{} {}", if self.hits_only { "hit" } else { "all" }, self.kind)
    }

    fn of(kind: &'static str, hits_only: bool, rays: Vec<SinglePrecisionRay>) -> Self {
        Self { kind, hits_only, coherent: kind == "primary", rays }
    }
}

/// `count` random rays, and as many that hit, or as many as were found.
pub(crate) fn random_sets(subject: &Subject, scene: &TracedScene, count: usize) -> [RaySet; 2] {
    let mut all = random_rays(subject, scene, count * RANDOM_CANDIDATES);
    let mut hits = hits(scene, all.iter());
    hits.truncate(count);
    all.truncate(count);
    [RaySet::of("random", false, all), RaySet::of("random", true, hits)]
}

fn hits<'a>(
    scene: &TracedScene,
    rays: impl Iterator<Item = &'a SinglePrecisionRay>,
) -> Vec<SinglePrecisionRay> {
    let mut tracer = scene.tracer();
    rays.filter(|ray| tracer.closest(&ray.ray()).is_some()).copied().collect()
}

/// All sets of one object: `width`² camera rays, `random` random rays, and a bounce from each hit of a camera ray; each with
/// misses and without.
pub(crate) fn ray_sets(subject: &Subject, scene: &TracedScene, width: u32, random: usize) -> Vec<RaySet> {
    let primary = Camera::framing(subject, scene).rays(width);
    let bounces: Vec<_> = (0..BOUNCES).map(|number| bounces(subject, scene, &primary, number)).collect();
    let [all_random, random_hits] = random_sets(subject, scene, random);
    let primary_hits = hits(scene, primary.iter());
    // those of one camera ray side by side
    let side_by_side = (0..bounces[0].len()).flat_map(|i| bounces.iter().map(move |set| &set[i]));
    let bounce_hits = hits(scene, side_by_side);
    let [first_bounces, ..] = <[_; BOUNCES as usize]>::try_from(bounces).expect("as many as were made");
    vec![
        RaySet::of("primary", false, primary),
        all_random,
        RaySet::of("bounce", false, first_bounces),
        RaySet::of("primary", true, primary_hits),
        random_hits,
        RaySet::of("bounce", true, bounce_hits),
    ]
}

/// A pinhole camera with a square picture.
struct Camera {
    eye: DVec3,
    /// From the eye to the middle of the picture, and half its sides.
    forward: DVec3,
    right: DVec3,
    up: DVec3,
}

impl Camera {
    fn at(centre: DVec3, distance: f64) -> Self {
        let forward = -VIEW.normalize();
        let half = (0.5 * FIELD_OF_VIEW.to_radians()).tan();
        let right = forward.cross(DVec3::Z).normalize();
        Self {
            eye: centre - distance * forward,
            forward,
            right: half * right,
            up: half * right.cross(forward),
        }
    }

    /// At the distance at which [`PRIMARY_SHARE`] of the rays hit.
    fn framing(subject: &Subject, scene: &TracedScene) -> Self {
        let centre = 0.5 * (subject.bounds[0] + subject.bounds[1]);
        let mut distance = 2.0 * subject.diagonal;
        for _ in 0..4 {
            // the share falls with the square of the distance
            let share = hit_share(scene, &Self::at(centre, distance).rays(96));
            distance *= (share / PRIMARY_SHARE).sqrt().clamp(0.5, 2.0);
        }
        Self::at(centre, distance.max(0.6 * subject.diagonal))
    }

    /// Through the centres of width × width pixels, in tiles of [`TILE`] × [`TILE`].
    fn rays(&self, width: u32) -> Vec<SinglePrecisionRay> {
        let tiles = width / TILE;
        let mut rays = Vec::with_capacity((width * width) as usize);
        for tile in 0..tiles * tiles {
            for pixel in 0..TILE * TILE {
                let x = tile % tiles * TILE + pixel % TILE;
                let y = tile / tiles * TILE + pixel / TILE;
                let [x, y] = [x, y].map(|n| 2.0 * (f64::from(n) + 0.5) / f64::from(width) - 1.0);
                rays.push(SinglePrecisionRay::rounded(self.eye, self.forward + x * self.right - y * self.up));
            }
        }
        rays
    }
}

/// Rays through two random points of a sphere around the object: from one towards the other and on.
///
/// They are uniform in the measure of lines, so that the share that hits falls with the square of the radius; it is chosen
/// for [`RANDOM_SHARE`], but not below that of the sphere around the object's box.
fn random_rays(subject: &Subject, scene: &TracedScene, count: usize) -> Vec<SinglePrecisionRay> {
    let centre = 0.5 * (subject.bounds[0] + subject.bounds[1]);
    let chords = |radius: f64, count: usize| -> Vec<_> {
        let mut random = SplitMix64::new(1);
        let mut chord = || {
            let [from, to] = [on_sphere(&mut random), on_sphere(&mut random)];
            SinglePrecisionRay::rounded(centre + radius * from, to - from)
        };
        (0..count).map(|_| chord()).collect()
    };
    let around = 0.5 * subject.diagonal;
    let share = hit_share(scene, &chords(around, 10_000));
    chords(around * (share / RANDOM_SHARE).sqrt().max(1.0), count)
}

/// A ray from each hit, its direction distributed as the cosine to the normal on the side that was hit.
fn bounces(
    subject: &Subject,
    scene: &TracedScene,
    rays: &[SinglePrecisionRay],
    number: u32,
) -> Vec<SinglePrecisionRay> {
    let mut random = SplitMix64::new(2 + u64::from(number));
    let mut tracer = scene.tracer();
    let bounce = |ray: &SinglePrecisionRay| {
        let ray = ray.ray();
        let hit = tracer.closest_hit(&ray)?;
        let normal = -hit.normal * hit.normal.dot(ray.direction).signum();
        let origin = hit.position + BOUNCE_OFFSET * subject.diagonal * normal;
        // a point of the unit sphere on top of the normal
        Some(SinglePrecisionRay::rounded(origin, normal + (1.0 - 1e-6) * on_sphere(&mut random)))
    };
    rays.iter().filter_map(bounce).collect()
}

fn hit_share(scene: &TracedScene, rays: &[SinglePrecisionRay]) -> f64 {
    let mut tracer = scene.tracer();
    let hits = rays.iter().filter(|ray| tracer.closest(&ray.ray()).is_some()).count();
    hits.max(1) as f64 / rays.len() as f64
}

/// A point of the unit sphere.
fn on_sphere(random: &mut SplitMix64) -> DVec3 {
    let z = 2.0 * random.next_unit() - 1.0;
    let (sin, cos) = (std::f64::consts::TAU * random.next_unit()).sin_cos();
    let ring = (1.0 - z * z).sqrt();
    DVec3::new(ring * cos, ring * sin, z)
}
