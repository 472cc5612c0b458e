//! Models for the gallery: few, large, flat polygons.

use glam::{DVec2, dvec2};

use super::solid::Solid;

/// Teeth of a facade of the tower, between its corners.
const MULLIONS: u32 = 5;

/// A skyscraper: one tall prism whose outline is a square with mullions, so each strip of its facade is one polygon from
/// the ground to the roof; two narrower storeys
/// start a little inside of it.
pub(crate) fn tower() -> Solid {
    let mut solid = Solid::default();
    solid.prism(&facade(1.0, 0.06), [0.0, 6.0]);
    solid.prism(&facade(0.74, 0.05), [5.9, 6.9]);
    solid.prism(&facade(0.46, 0.0), [6.8, 7.5]);
    solid
}

/// A square of half width `half` with mullions that stand out by `depth`, counter-clockwise.
fn facade(half: f64, depth: f64) -> Vec<DVec2> {
    let strips = 2 * MULLIONS + 1;
    let mut side = vec![dvec2(half, -half)];
    if depth > 0.0 {
        for i in 1..strips {
            let y = half * (2.0 * f64::from(i) / f64::from(strips) - 1.0);
            let inner = [half - depth, half];
            let (first, second) = if i % 2 == 1 { (inner[1], inner[0]) } else { (inner[0], inner[1]) };
            side.extend([dvec2(first, y), dvec2(second, y)]);
        }
    }
    (0..4u32)
        .flat_map(|quarter| {
            let turn =
                [dvec2(1.0, 0.0), dvec2(0.0, 1.0), dvec2(-1.0, 0.0), dvec2(0.0, -1.0)][quarter as usize];
            side.clone().into_iter().map(move |p| turn.rotate(p))
        })
        .collect()
}

/// Plain houses around the tower's place, as boxes.
pub(crate) fn town() -> Solid {
    /// Centre, half widths and height of each house.
    const HOUSES: [[f64; 5]; 14] = [
        [-3.4, 1.0, 0.7, 0.8, 1.7],
        [-3.2, 3.2, 0.9, 0.7, 2.6],
        [-1.0, 3.6, 0.7, 0.9, 1.4],
        [1.2, 3.5, 0.8, 0.8, 2.2],
        [3.4, 3.0, 0.9, 0.9, 1.2],
        [3.5, 0.8, 0.7, 0.8, 1.9],
        [3.3, -1.6, 0.8, 0.9, 0.9],
        [-3.5, -1.4, 0.8, 0.9, 1.0],
        [-5.8, 1.8, 0.9, 1.1, 1.3],
        [-5.6, 4.6, 1.0, 0.9, 2.0],
        [-2.4, 6.0, 1.0, 0.8, 3.0],
        [0.6, 6.2, 0.9, 1.0, 1.7],
        [3.4, 5.8, 1.1, 0.9, 2.7],
        [5.9, 2.4, 0.9, 1.1, 1.6],
    ];
    let mut solid = Solid::default();
    for [x, y, half_x, half_y, height] in HOUSES {
        let corner = |a: f64, b: f64| dvec2(x + a * half_x, y + b * half_y);
        let outline = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        solid.prism(&outline, [0.0, height]);
    }
    solid
}

/// Space between the letters of the word.
const GAP: f64 = 0.28;

/// The word "trimray" in blocky letters, each a prism of few polygons; only the counter of the "a" is cut.
pub(crate) fn word() -> Solid {
    const DEPTH: [f64; 2] = [0.0, 0.5];
    let mut solid = Solid::default();
    let mut x = 0.0;
    for letter in [T, R, I, M, R, A, Y] {
        let moved =
            |points: &[[f64; 2]]| -> Vec<_> { points.iter().map(|&[u, v]| dvec2(x + u, v)).collect() };
        let outline = moved(letter.outline);
        if letter.hole.is_empty() {
            solid.prism(&outline, DEPTH);
        } else {
            solid.extrude(&outline, &moved(letter.hole), DEPTH);
        }
        if !letter.dot.is_empty() {
            solid.prism(&moved(letter.dot), DEPTH);
        }
        x = outline.iter().map(|p| p.x).fold(x, f64::max) + GAP;
    }
    solid
}

/// Outlines of a letter, counter-clockwise.
struct Letter {
    outline: &'static [[f64; 2]],
    hole: &'static [[f64; 2]],
    dot: &'static [[f64; 2]],
}

const PLAIN: Letter = Letter { outline: &[], hole: &[], dot: &[] };

#[rustfmt::skip]
const T: Letter = Letter {
    outline: &[
        [0.25, 0.0], [0.8, 0.0], [0.8, 0.28], [0.53, 0.28], [0.53, 0.85], [0.8, 0.85], [0.8, 1.13], [0.53, 1.13],
        [0.53, 1.5], [0.25, 1.5], [0.25, 1.13], [0.0, 1.13], [0.0, 0.85], [0.25, 0.85],
    ],
    ..PLAIN
};

#[rustfmt::skip]
const R: Letter = Letter {
    outline: &[
        [0.0, 0.0], [0.28, 0.0], [0.28, 0.7], [0.43, 0.85], [0.75, 0.85], [0.75, 1.13], [0.4, 1.13], [0.28, 1.02],
        [0.28, 1.13], [0.0, 1.13],
    ],
    ..PLAIN
};

const I: Letter = Letter {
    outline: &[[0.0, 0.0], [0.28, 0.0], [0.28, 1.13], [0.0, 1.13]],
    dot: &[[0.0, 1.25], [0.28, 1.25], [0.28, 1.5], [0.0, 1.5]],
    ..PLAIN
};

#[rustfmt::skip]
const M: Letter = Letter {
    outline: &[
        [0.0, 0.0], [0.28, 0.0], [0.28, 0.85], [0.54, 0.85], [0.54, 0.0], [0.82, 0.0], [0.82, 0.85], [1.08, 0.85],
        [1.08, 0.0], [1.36, 0.0], [1.36, 0.98], [1.21, 1.13], [0.0, 1.13],
    ],
    ..PLAIN
};

#[rustfmt::skip]
const A: Letter = Letter {
    outline: &[
        [0.15, 0.0], [0.95, 0.0], [0.95, 0.98], [0.8, 1.13], [0.12, 1.13], [0.12, 0.87], [0.67, 0.87], [0.67, 0.72],
        [0.15, 0.72], [0.0, 0.57], [0.0, 0.15],
    ],
    hole: &[[0.28, 0.25], [0.67, 0.25], [0.67, 0.48], [0.28, 0.48]],
    ..PLAIN
};

#[rustfmt::skip]
const Y: Letter = Letter {
    outline: &[
        [0.1, -0.42], [0.75, -0.42], [0.9, -0.27], [0.9, 1.13], [0.62, 1.13], [0.62, 0.28], [0.28, 0.28], [0.28, 1.13],
        [0.0, 1.13], [0.0, 0.15], [0.15, 0.0], [0.62, 0.0], [0.62, -0.16], [0.1, -0.16],
    ],
    ..PLAIN
};
