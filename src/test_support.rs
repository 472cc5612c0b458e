//! What several unit tests need: noise, volumes and solids.

use glam::{DVec3, DVec4};

use crate::patch::{Deformation, PlanarPolygon, Shell, deform_polygons};
use crate::spline::SplineVolume;
use crate::subdivide::FrameChoice;
use crate::trace::{NoAttributes, TracedObject, TracedScene};

/// Deterministic noise.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    /// In [-0.5, 0.5).
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mut x = self.0;
        x = (x ^ (x >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
        x ^= x >> 32;
        (x >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }

    pub(crate) fn vector(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }

    pub(crate) fn unit_vector(&mut self) -> DVec3 {
        loop {
            let v = self.vector();
            if v.length_squared() < 0.25 && v.length_squared() > 1e-4 {
                return v.normalize();
            }
        }
    }
}

/// A volume over the unit cube with a shaken lattice, `amount` in parts of the cube.
pub(crate) fn random_volume(
    noise: &mut Noise,
    degree: [usize; 3],
    points: [usize; 3],
    amount: f64,
    rational: bool,
) -> SplineVolume {
    let identity = SplineVolume::identity(degree, points, [DVec3::ZERO, DVec3::ONE]).unwrap();
    let control_points: Vec<DVec4> = identity
        .control_points()
        .into_iter()
        .map(|p| {
            let weight = if rational { libm::exp(2.0 * noise.next()) } else { 1.0 };
            (p.truncate() + amount * noise.vector()).extend(weight)
        })
        .collect();
    SplineVolume::try_new(identity.axes().clone(), &control_points).unwrap()
}

/// The unit cube as 12 triangles, outward.
pub(crate) fn cube_triangles() -> Vec<[DVec3; 3]> {
    let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).map(|t| t.map(corner)).collect()
}

/// A faceted ball inside the unit cube with no face along an axis.
pub(crate) fn ball_triangles() -> Vec<[DVec3; 3]> {
    let (rings, sectors) = (5_u32, 7_u32);
    let point = |i: u32, j: u32| {
        let theta = std::f64::consts::PI * f64::from(i) / f64::from(rings);
        let phi = std::f64::consts::TAU * (f64::from(j % sectors) + 0.3) / f64::from(sectors);
        let ball = DVec3::new(
            libm::sin(theta) * libm::cos(phi),
            libm::sin(theta) * libm::sin(phi),
            libm::cos(theta),
        );
        // the poles are one point each, to the bit
        let ball = if i == 0 {
            DVec3::Z
        } else if i == rings {
            DVec3::NEG_Z
        } else {
            ball
        };
        DVec3::splat(0.5) + 0.45 * glam::DQuat::from_rotation_x(0.4).mul_vec3(ball)
    };
    let mut triangles = Vec::new();
    for i in 0..rings {
        for j in 0..sectors {
            let [a, b, c, d] = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
            if i + 1 < rings {
                triangles.push([a, b, c]);
            }
            if i > 0 {
                triangles.push([a, c, d]);
            }
        }
    }
    triangles
}

pub(crate) fn deform(triangles: &[[DVec3; 3]], volume: Option<&SplineVolume>, frame: FrameChoice) -> Shell {
    let polygons: Vec<_> = (0..).zip(triangles).map(|(face, c)| PlanarPolygon { face, corners: c }).collect();
    deform_polygons(&polygons, Deformation { volume, frame }).unwrap().shell
}

pub(crate) fn scene_of(shell: impl Into<Shell>) -> TracedScene {
    TracedScene::new(vec![TracedObject {
        name: "test".into(),
        shell: shell.into(),
        attributes: Box::new(NoAttributes),
    }])
}
