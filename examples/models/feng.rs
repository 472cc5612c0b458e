//! Models for the figures 7 to 13 of Feng et al. (2002), with the figures' counts of triangles.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec2, DVec3, dvec2, dvec3};

use super::solid::Solid;

/// The unit cube.
pub(crate) fn cube() -> Solid {
    blocks(&Blocks { lines: [&[0.0, 1.0], &[0.0, 1.0], &[0.0, 1.0]], filled: |_| true, apex: |_| None })
}

/// A flat star with five blunt arms: 15 corners, so 2·13 triangles on the ends and 30 on the sides.
pub(crate) fn star() -> Solid {
    let mut outline = Vec::new();
    for arm in 0..5 {
        let angle = FRAC_PI_2 + f64::from(arm) * TAU / 5.0;
        for (turn, radius) in [(-0.16, 1.0), (0.16, 1.0), (TAU / 10.0, 0.42)] {
            outline.push(DVec2::from_angle(angle + turn) * radius);
        }
    }
    let mut solid = Solid::default();
    solid.extrude(&outline, &[], [0.0, 0.16]);
    solid
}

/// The letters FFD: 36 triangles for each F, 128 for the D of 17 outer and 15 inner corners.
pub(crate) fn letters() -> Solid {
    let f = [
        [0.0, 0.0],
        [0.24, 0.0],
        [0.24, 0.41],
        [0.62, 0.41],
        [0.62, 0.62],
        [0.24, 0.62],
        [0.24, 0.79],
        [0.7, 0.79],
        [0.7, 1.0],
        [0.0, 1.0],
    ];
    let arc = |x: f64, width: f64, height: f64, count: u32| {
        (0..count).map(move |i| {
            let angle = PI * f64::from(i) / f64::from(count - 1) - FRAC_PI_2;
            dvec2(x + width * angle.cos(), 0.5 + height * angle.sin())
        })
    };
    let d = 1.72;
    let outer: Vec<_> =
        [dvec2(d, 1.0), dvec2(d, 0.0)].into_iter().chain(arc(d + 0.32, 0.48, 0.5, 15)).collect();
    let inner: Vec<_> = [dvec2(d + 0.24, 0.79), dvec2(d + 0.24, 0.21)]
        .into_iter()
        .chain(arc(d + 0.34, 0.23, 0.29, 13))
        .collect();
    let mut solid = Solid::default();
    for x in [0.0, 0.86] {
        solid.extrude(&f.map(|p| DVec2::from(p) + dvec2(x, 0.0)), &[], [0.0, 0.22]);
    }
    solid.extrude(&outer, &inner, [0.0, 0.22]);
    solid
}

/// A castle: a plinth, roofed walls around two courts, six towers, a keep and a gate.
pub(crate) fn castle() -> Solid {
    blocks(&Blocks {
        lines: [&[0.0, 0.5, 1.5, 2.0], &[0.0, 0.5, 1.25, 1.75, 2.5, 3.0], &[0.0, 0.15, 0.9, 1.3, 1.7, 2.2]],
        filled: castle_filled,
        apex: |[i, j, k]| match k {
            1 if !is_tower([i, j]) && [i, j] != KEEP => Some(0.18),
            2 if is_tower([i, j]) && j == 2 => Some(0.5),
            3 if is_tower([i, j]) => Some(0.7),
            4 => Some(0.8),
            _ => None,
        },
    })
}

/// Where the keep stands in the castle's plan.
const KEEP: [usize; 2] = [1, 2];

fn castle_filled([i, j, k]: [usize; 3]) -> bool {
    let court = i == 1 && (j == 1 || j == 3);
    let gate = [i, j] == [1, 0];
    let keep = [i, j] == KEEP;
    match k {
        0 => true,
        1 => !court && !gate,
        2 => is_tower([i, j]) || keep,
        3 => (is_tower([i, j]) && j != 2) || keep,
        _ => keep,
    }
}

fn is_tower([i, j]: [usize; 2]) -> bool {
    i != 1 && j.is_multiple_of(2)
}

/// A long bridge on three piers, with parapets that end in pointed posts.
pub(crate) fn bridge() -> Solid {
    blocks(&Blocks {
        lines: [&[0.0, 0.15, 0.85, 1.0], &[0.0, 0.4, 1.9, 2.3, 3.8, 4.2], &[0.0, 0.6, 0.8, 1.0]],
        filled: |[i, j, k]| match k {
            0 => i == 1 && j.is_multiple_of(2),
            1 => true,
            _ => i != 1,
        },
        apex: |[i, j, k]| match k {
            1 if i == 1 && j.is_multiple_of(2) => Some(0.0),
            2 if j == 0 || j == 4 => Some(0.25),
            _ => None,
        },
    })
}

/// A trefoil knot of twelve straight bars with square section, the fewest that a knot along the axes can have; a third
/// of a turn about the diagonal of its cube leaves it as it is.
pub(crate) fn knot() -> Solid {
    const PATH: [[i8; 3]; 12] = [
        [0, 2, 1],
        [3, 2, 1],
        [3, 0, 1],
        [1, 0, 1],
        [1, 0, 2],
        [1, 3, 2],
        [1, 3, 0],
        [1, 1, 0],
        [2, 1, 0],
        [2, 1, 3],
        [0, 1, 3],
        [0, 1, 1],
    ];
    const HALF_WIDTH: f64 = 0.25;
    let path = PATH.map(|p| DVec3::from_array(p.map(f64::from)));
    let direction = |i: usize| (path[(i + 1) % 12] - path[i % 12]).normalize();
    let mut solid = Solid::default();
    for i in 0..12 {
        let along = direction(i);
        let u = along.any_orthonormal_vector();
        let v = along.cross(u);
        // the mitre at each end moves an edge along the bar by as much as it lies towards the bend
        let end = |corner: DVec3, at: usize, bend: DVec3, sign: f64| {
            path[at % 12] + corner + along * sign * corner.dot(bend)
        };
        let before = direction(i + 11);
        let after = direction(i + 1);
        let corners =
            [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(a, b)| (u * a + v * b) * HALF_WIDTH);
        for side in 0..4 {
            let [a, b] = [corners[side], corners[(side + 1) % 4]];
            solid.fan(&[
                end(a, i, before, -1.0),
                end(b, i, before, -1.0),
                end(b, i + 1, after, -1.0),
                end(a, i + 1, after, -1.0),
            ]);
        }
    }
    solid
}

/// What the fish looks like at one place of its length.
struct Section {
    x: f64,
    top: f64,
    bottom: f64,
    /// Half of the thickness.
    half_width: f64,
    /// How far the upper and lower end are swept back.
    sweep: f64,
}

/// A fish: 30 rings of 16 corners from the mouth to the tail, closed by flat ends: 2·16·29 + 2·14 triangles.
pub(crate) fn fish() -> Solid {
    let rings: Vec<[DVec3; FISH_CORNERS]> = FISH.map(|row| fish_ring(&row)).into();
    let mut solid = Solid::default();
    for pair in rings.windows(2) {
        for i in 0..FISH_CORNERS {
            let j = (i + 1) % FISH_CORNERS;
            let [a, b, c, d] = [pair[0][i], pair[0][j], pair[1][j], pair[1][i]];
            // the diagonal alternates with the side, so that both sides of the fish look the same
            if i < FISH_CORNERS / 2 {
                solid.fan(&[a, b, c, d]);
            } else {
                solid.fan(&[b, c, d, a]);
            }
        }
    }
    let last = rings.len() - 1;
    fish_end(&mut solid, &rings[last], false);
    fish_end(&mut solid, &rings[0], true);
    solid
}

const FISH_CORNERS: usize = 16;

fn fish_ring(&[x, top, bottom, half_width, sweep]: &[f64; 5]) -> [DVec3; FISH_CORNERS] {
    let section = Section { x, top, bottom, half_width, sweep };
    std::array::from_fn(|i| {
        // counter-clockwise seen from the tail, from the top
        let angle = TAU * i as f64 / FISH_CORNERS as f64 + FRAC_PI_2;
        let (side, up) = (angle.cos(), angle.sin());
        let middle = section.bottom.mul_add(0.5, section.top * 0.5);
        let reach = if up > 0.0 { section.top - middle } else { middle - section.bottom };
        let back = section.sweep * up.abs().powi(2);
        dvec3(section.x + back, side * section.half_width, middle + up * reach)
    })
}

/// Closes an end by triangles in steps between both sides, so that a swept end is not dented.
fn fish_end(solid: &mut Solid, ring: &[DVec3; FISH_CORNERS], front: bool) {
    let n = FISH_CORNERS;
    let mut triangle = |a: usize, b: usize, c: usize| {
        let [a, b, c] = [a, b, c].map(|i| ring[i % n]);
        solid.face(&if front { [c, b, a] } else { [a, b, c] });
    };
    triangle(0, 1, n - 1);
    for i in 1..n / 2 - 1 {
        triangle(i, i + 1, n - i);
        triangle(i + 1, n - i - 1, n - i);
    }
    triangle(n / 2 - 1, n / 2, n / 2 + 1);
}

/// Place, upper and lower end, half thickness and sweep of the fish's sections, from the mouth.
#[rustfmt::skip]
const FISH: [[f64; 5]; 30] = [
    [0.00, 0.04, -0.05, 0.04, -0.01],
    [0.04, 0.09, -0.09, 0.08, 0.00],
    [0.10, 0.16, -0.13, 0.12, 0.00],
    [0.18, 0.24, -0.19, 0.17, 0.00],
    [0.27, 0.32, -0.25, 0.21, 0.00],
    [0.36, 0.39, -0.30, 0.24, 0.00],
    [0.45, 0.44, -0.34, 0.26, 0.00],
    [0.54, 0.49, -0.37, 0.27, 0.00],
    [0.62, 0.60, -0.39, 0.275, 0.04],
    [0.70, 0.73, -0.41, 0.275, 0.08],
    [0.78, 0.81, -0.42, 0.27, 0.10],
    [0.86, 0.84, -0.44, 0.265, 0.11],
    [0.94, 0.83, -0.49, 0.26, 0.12],
    [1.02, 0.80, -0.55, 0.25, 0.12],
    [1.10, 0.76, -0.58, 0.24, 0.12],
    [1.18, 0.71, -0.56, 0.23, 0.12],
    [1.26, 0.65, -0.49, 0.22, 0.11],
    [1.34, 0.56, -0.40, 0.205, 0.09],
    [1.42, 0.44, -0.31, 0.19, 0.06],
    [1.50, 0.33, -0.25, 0.17, 0.03],
    [1.58, 0.25, -0.20, 0.15, 0.01],
    [1.66, 0.20, -0.16, 0.13, 0.00],
    [1.74, 0.17, -0.14, 0.11, 0.00],
    [1.82, 0.16, -0.13, 0.095, 0.00],
    [1.88, 0.19, -0.16, 0.08, 0.03],
    [1.94, 0.27, -0.24, 0.07, 0.08],
    [2.00, 0.38, -0.35, 0.06, 0.14],
    [2.06, 0.49, -0.46, 0.05, 0.21],
    [2.11, 0.58, -0.55, 0.04, 0.28],
    [2.15, 0.64, -0.61, 0.025, 0.36],
];

/// Boxes in a grid of uneven lines.
struct Blocks<'a> {
    lines: [&'a [f64]; 3],
    /// Whether the box of these indices is part of the solid.
    filled: fn([usize; 3]) -> bool,
    /// Height of the pointed roof on a box; 0 is flat.
    apex: fn([usize; 3]) -> Option<f64>,
}

/// Two triangles for each side of a box between full and empty, four for a roof.
fn blocks(blocks: &Blocks<'_>) -> Solid {
    let cells = blocks.lines.map(|lines| lines.len() - 1);
    let mut solid = Solid::default();
    for i in 0..cells[0] {
        for j in 0..cells[1] {
            for k in 0..cells[2] {
                if (blocks.filled)([i, j, k]) {
                    block(&mut solid, blocks, [i, j, k], cells);
                }
            }
        }
    }
    solid
}

fn block(solid: &mut Solid, blocks: &Blocks<'_>, cell: [usize; 3], cells: [usize; 3]) {
    for axis in 0..3 {
        for forward in [false, true] {
            let outside = if forward { cell[axis] + 1 == cells[axis] } else { cell[axis] == 0 };
            let mut neighbour = cell;
            neighbour[axis] = if forward { cell[axis] + 1 } else { cell[axis].wrapping_sub(1) };
            if !outside && (blocks.filled)(neighbour) {
                continue;
            }
            let point = |a: usize, b: usize| {
                let mut at = cell;
                at[axis] += usize::from(forward);
                at[(axis + 1) % 3] += a;
                at[(axis + 2) % 3] += b;
                DVec3::from_array(std::array::from_fn(|axis| blocks.lines[axis][at[axis]]))
            };
            let mut side = [point(0, 0), point(1, 0), point(1, 1), point(0, 1)];
            if !forward {
                side.reverse();
            }
            match (blocks.apex)(cell) {
                Some(height) if axis == 2 && forward => {
                    let centre = side.iter().sum::<DVec3>() / 4.0;
                    solid.pyramid(&side, centre + DVec3::Z * height);
                }
                _ => solid.fan(&side),
            }
        }
    }
}
