//! Integrals over faces, to tell the inside of a solid from its outside.

use glam::{DVec2, DVec3};

use crate::patch::{Face, FaceBounds, PatchPoint, Topology};

/// Nodes and weights of Gauss and Legendre for polynomials of degree 15 over \[0, 1\].
const GAUSS: [(f64, f64); 8] = [
    (0.019_855_071_751_231_9, 0.050_614_268_145_188_1),
    (0.101_666_761_293_186_6, 0.111_190_517_226_687_2),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_6),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181),
    (0.591_717_321_247_824_9, 0.181_341_891_689_181),
    (0.762_766_204_958_164_5, 0.156_853_322_938_943_6),
    (0.898_333_238_706_813_4, 0.111_190_517_226_687_2),
    (0.980_144_928_248_768_1, 0.050_614_268_145_188_1),
];

/// The signed volume that faces bound: a third of the flux of the position.
///
/// Exact up to rounding for patches up to degree 2 x 2, else near enough to know its sign.
pub(super) fn volume(topology: &Topology<'_>, faces: &[&FaceBounds], origin: DVec3) -> f64 {
    flux(topology, faces, |place| (place - origin) / 3.0)
}

/// How often faces wind around a place: 1 inside of a solid, 0 outside; near its faces neither.
pub(super) fn winding(topology: &Topology<'_>, faces: &[&FaceBounds], around: DVec3) -> f64 {
    flux(topology, faces, |place| {
        let offset = place - around;
        offset / offset.length().powi(3) / (4.0 * std::f64::consts::PI)
    })
}

fn flux(topology: &Topology<'_>, faces: &[&FaceBounds], field: impl Fn(DVec3) -> DVec3) -> f64 {
    let density = |face: &Face, st: DVec2| {
        let PatchPoint { position, dp_ds, dp_dt } = face.patch.eval(st);
        field(position).dot(dp_ds.cross(dp_dt))
    };
    faces.iter().map(|bounds| over_face(topology, bounds, density)).sum()
}

/// The integral over a face's region: of triangles with one corner in common and an edge of the bounds each, by their signs.
fn over_face(topology: &Topology<'_>, bounds: &FaceBounds, density: impl Fn(&Face, DVec2) -> f64) -> f64 {
    let face = topology.outlines()[bounds.outline as usize].face();
    let mut sum = 0.0;
    for bound in std::iter::once(&bounds.outer).chain(&bounds.holes) {
        let corner = bounds.outer[0].st[0];
        // a side that is a pole is no edge
        for (i, edge) in bound.iter().enumerate() {
            let next = bound[(i + 1) % bound.len()].st[0];
            sum += over_triangle(face, [corner, edge.st[0], edge.st[1]], &density);
            if next != edge.st[1] {
                sum += over_triangle(face, [corner, edge.st[1], next], &density);
            }
        }
    }
    sum
}

fn over_triangle(face: &Face, [a, b, c]: [DVec2; 3], density: &impl Fn(&Face, DVec2) -> f64) -> f64 {
    let doubled_area = (b - a).perp_dot(c - a);
    if doubled_area == 0.0 {
        return 0.0;
    }
    let mut sum = 0.0;
    for (r, weight_r) in GAUSS {
        for (q, weight_q) in GAUSS {
            let st = a + r * ((b - a) + q * (c - b));
            sum += weight_r * weight_q * r * density(face, st);
        }
    }
    sum * doubled_area
}
