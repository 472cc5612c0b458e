//! Points that are surely inside a solid, and points of its borders.

#[path = "../common/random.rs"]
mod random;

use glam::{DVec2, DVec3};
use trimray::patch::Face;

use super::solids::Solid;
pub(crate) use random::Random;

/// Balls of the undeformed solid to draw points from.
const BALLS: usize = 2000;

/// Balls to choose from for each piece of the surface: the nearest.
const NEAREST: usize = 4;

/// A ball in the undeformed solid.
#[derive(Clone, Copy, Debug)]
struct Ball {
    centre: DVec3,
    radius: f64,
}

/// A loop of a patch's trim with the balls next to it.
#[derive(Clone, Copy, Debug)]
struct Piece {
    patch: usize,
    trim_loop: usize,
    balls: [usize; NEAREST],
}

/// A point of the deformed surface, and a point inside the deformed solid next to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target {
    /// The point of the surface.
    pub(crate) border: DVec3,
    /// The point inside.
    pub(crate) inside: DVec3,
}

/// Where rays start from and what they are aimed at.
pub(crate) struct Aims<'a> {
    solid: &'a Solid,
    balls: Vec<Ball>,
    pieces: Vec<Piece>,
}

impl<'a> Aims<'a> {
    /// Finds balls in the solid below all of its surface, at all depths.
    pub(crate) fn new(solid: &'a Solid, random: &mut Random) -> Self {
        let patches = solid.scene.objects()[0].faces();
        let loops = |(patch, trimmed): (usize, &Face)| {
            (0..trimmed.region.len()).map(move |trim_loop| (patch, trim_loop)).collect::<Vec<_>>()
        };
        let loops: Vec<_> = patches.iter().enumerate().flat_map(loops).collect();
        let middle = |(patch, trim_loop): (usize, usize)| {
            let trimmed: &Face = &patches[patch];
            let corners = trimmed.region.corners(&trimmed.region.trim_loop(trim_loop));
            trimmed.chart.place(corners.iter().sum::<DVec2>() / corners.len() as f64).coordinates()
        };
        let mut balls = Vec::new();
        while balls.len() < BALLS {
            let chosen = loops[random.below(loops.len())];
            let [_, s, t] = patches[chosen.0].chart.coordinates();
            let inward = -s.cross(t).normalize();
            let depth = solid.radius * libm::pow(10.0, -5.0 * random.unit());
            let centre = middle(chosen) + depth * (inward + 0.5 * random.unit() * random.direction());
            balls.extend(ball(&solid.polygons, centre));
        }
        let pieces = loops.iter().map(|&(patch, trim_loop)| {
            let place = middle((patch, trim_loop));
            let mut order: Vec<usize> = (0..balls.len()).collect();
            let distance = |&index: &usize| balls[index].centre.distance_squared(place);
            order.select_nth_unstable_by(NEAREST, |a, b| distance(a).total_cmp(&distance(b)));
            Piece { patch, trim_loop, balls: std::array::from_fn(|i| order[i]) }
        });
        let pieces = pieces.collect();
        Self { solid, balls, pieces }
    }

    /// A random point inside the deformed solid.
    pub(crate) fn inside(&self, random: &mut Random) -> DVec3 {
        let index = random.below(self.balls.len());
        self.in_ball(index, random)
    }

    fn in_ball(&self, index: usize, random: &mut Random) -> DVec3 {
        let Ball { centre, radius } = self.balls[index];
        let rest = centre + 0.9 * radius * random.unit() * random.direction();
        let [low, high] = self.solid.volume.bounds();
        // rounding may lead out of the box, not out of the ball
        let point =
            self.solid.volume.eval(rest.clamp(low, high)).expect("a point of the box is in the volume");
        point.position
    }

    /// A point of a border with a point inside: a corner of a trim, a point of its edge, or of a line on which patches
    /// are halved for the acceleration structure.
    pub(crate) fn target(&self, random: &mut Random) -> Target {
        let piece = self.pieces[random.below(self.pieces.len())];
        let trimmed = &self.solid.scene.objects()[0].faces()[piece.patch];
        let corners = trimmed.region.corners(&trimmed.region.trim_loop(piece.trim_loop));
        let index = random.below(corners.len());
        let (a, b) = (corners[index], corners[(index + 1) % corners.len()]);
        let st = match random.below(8) {
            0 | 1 => a,
            2 => a.midpoint(b),
            3 => a.lerp(b, libm::pow(10.0, -14.0 * random.unit())),
            4 => Some(halving_point(corners, random))
                .filter(|&st| trimmed.region.find(st, DVec2::ZERO).is_some())
                .unwrap_or(b),
            _ => a.lerp(b, random.unit()),
        };
        // mostly one next to it, so that the ray crosses the surface nowhere else
        let near = random.below(8) > 0;
        let index = if near { piece.balls[random.below(NEAREST)] } else { random.below(self.balls.len()) };
        Target { border: trimmed.patch.eval(st).position, inside: self.in_ball(index, random) }
    }
}

/// A point in or near a convex loop on a line that halves its bounding rectangle, or a half of it and so on.
fn halving_point(corners: &[DVec2], random: &mut Random) -> DVec2 {
    let low = corners.iter().copied().fold(DVec2::INFINITY, DVec2::min);
    let high = corners.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
    let middle = corners.iter().sum::<DVec2>() / corners.len() as f64;
    let parts = f64::from(2_u32 << random.below(4));
    let axis = random.below(2);
    let mut point = corners[random.below(corners.len())].lerp(middle, random.unit());
    let size = high[axis] - low[axis];
    if size > 0.0 {
        point[axis] = low[axis] + size * ((point[axis] - low[axis]) / size * parts).round() / parts;
    }
    point
}

/// The largest ball about a point in a closed solid; `None` if it is not inside or too near to tell.
fn ball(polygons: &[Vec<DVec3>], centre: DVec3) -> Option<Ball> {
    let (mut solid_angle, mut radius) = (0.0, f64::INFINITY);
    for corners in polygons {
        for pair in corners[1..].windows(2) {
            let triangle = [corners[0], pair[0], pair[1]];
            solid_angle += half_solid_angle(triangle.map(|p| p - centre));
            radius = radius.min(distance(centre, triangle));
        }
    }
    let winding = solid_angle / std::f64::consts::TAU;
    ((winding - 1.0).abs() < 1e-3 && radius > 1e-8).then_some(Ball { centre, radius })
}

/// Half the solid angle of a triangle seen from the origin.
///
/// Source: Van Oosterom, Strackee (1983), *The solid angle of a plane triangle*.
fn half_solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let denominator = la * lb * lc + a.dot(b) * lc + a.dot(c) * lb + b.dot(c) * la;
    libm::atan2(a.dot(b.cross(c)), denominator)
}

/// Distance of a point from a triangle.
///
/// Source: Ericson (2005), *Real-Time Collision Detection*, section 5.1.5.
pub(crate) fn distance(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let on_edge = |a: DVec3, b: DVec3| {
        let edge = b - a;
        let part = ((p - a).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
        (a + part * edge).distance(p)
    };
    let normal = (b - a).cross(c - a);
    let beside = |a: DVec3, b: DVec3| (b - a).cross(p - a).dot(normal) < 0.0;
    if normal == DVec3::ZERO || beside(a, b) || beside(b, c) || beside(c, a) {
        on_edge(a, b).min(on_edge(b, c)).min(on_edge(c, a))
    } else {
        (p - a).dot(normal.normalize()).abs()
    }
}
