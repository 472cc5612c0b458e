//! Rays from inside a solid, and to there, at what is next to knot planes.

use glam::{DVec2, DVec3};
use trimray::trace::{Ray, Tracer};

use super::solids::{Random, Solid};

/// Rays from one point inside.
const TOGETHER: usize = 32;

/// Radius of the ball about the origin that is inside every solid.
const INSIDE: f64 = 0.3;

/// What came of some rays.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    /// Rays traced.
    pub(crate) rays: u64,
    /// Those that met nothing, though they must.
    pub(crate) passed: u64,
    /// The first of those.
    pub(crate) failures: Vec<Ray>,
}

impl Tally {
    /// Rays that passed which are kept.
    const KEPT: usize = 3;

    /// The counts of both.
    pub(crate) fn merged(mut self, other: Self) -> Self {
        self.rays += other.rays;
        self.passed += other.passed;
        self.failures.extend(other.failures);
        self.failures.truncate(Self::KEPT);
        self
    }

    fn count(&mut self, rays: &[Ray], found: &[bool]) {
        self.rays += rays.len() as u64;
        for (ray, _) in rays.iter().zip(found).filter(|(_, found)| !**found) {
            self.passed += 1;
            if self.failures.len() < Self::KEPT {
                self.failures.push(*ray);
            }
        }
    }
}

/// Traces rays at places within 1e-13 to 1e-8 of vertices and edges that are next to planes, of the points where such edges
/// cross planes, and of any borders of patches; half of them from inside, the others from outside to points inside.
pub(crate) fn run(solid: &Solid, rays: u64, random: &mut Random) -> Tally {
    let mut tally = Tally::default();
    let mut tracer = solid.scene.tracer();
    while tally.rays < rays {
        let inside = solid.image(INSIDE * libm::cbrt(random.unit()) * random.direction());
        let outward: Vec<_> = (0..TOGETHER)
            .map(|_| {
                let target = target(solid, random) + random.power(8.0, 13.0) * random.direction();
                Ray::new(inside, target - inside)
            })
            .collect();
        let inward = |ray: &Ray| {
            // outside, as what is nearer might not be
            let origin = ray.at(1.0) + random.power(-1.5, -0.5) * ray.direction.normalize();
            Ray { t_max: 1.0, ..Ray::new(origin, inside - origin) }
        };
        let inward: Vec<_> = outward.iter().map(inward).collect();
        trace(&mut tracer, &outward, &mut tally);
        trace(&mut tracer, &inward, &mut tally);
    }
    tally
}

fn trace(tracer: &mut Tracer<'_>, rays: &[Ray], tally: &mut Tally) {
    let mut found = [false; TOGETHER];
    let found = &mut found[..rays.len()];
    tracer.any_of_each(rays, found);
    tally.count(rays, found);
}

fn target(solid: &Solid, random: &mut Random) -> DVec3 {
    let [a, b] = solid.edges[random.below(solid.edges.len())].map(|vertex| solid.vertices[vertex]);
    match random.below(8) {
        0 | 1 => solid.image(a),
        2 => solid.image(b),
        3 => solid.image(a.lerp(b, random.unit())),
        4 => solid.image(a.lerp(b, random.power(0.0, 14.0))),
        5 => {
            let axis = random.below(3);
            let planes = solid.volume.axes()[axis].breakpoints();
            let part = (planes[random.below(planes.len())] - a[axis]) / (b[axis] - a[axis]);
            solid.image(a.lerp(b, if part > 0.0 && part < 1.0 { part } else { 1.0 }))
        }
        _ => border(solid, random),
    }
}

/// A point of the border of any patch.
fn border(solid: &Solid, random: &mut Random) -> DVec3 {
    let faces = solid.scene.objects()[0].faces();
    let face = &faces[random.below(faces.len())];
    let trim_loop = face.region.trim_loop(random.below(face.region.len()));
    let corners = face.region.corners(&trim_loop);
    let index = random.below(corners.len());
    let [a, b]: [DVec2; 2] = [corners[index], corners[(index + 1) % corners.len()]];
    let part = if random.below(2) == 0 { 0.0 } else { random.unit() };
    face.patch.eval(a.lerp(b, part)).position
}
