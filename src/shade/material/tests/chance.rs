//! Samples against their densities.

use std::f64::consts::PI;

use super::*;
use crate::shade::material::quadrature::gauss_legendre;
use crate::shade::{Sampler, warp};

/// All models with a smooth part, away from their defaults.
fn models(rough: &[RoughCoat; 2]) -> Vec<(&'static str, Model<'_>)> {
    let gold = named_metal("Au", DVec3::ONE);
    let plastic = coat(1.5, true, rgb(0.6, 0.3, 0.1), DVec3::ONE);
    let coated = PrincipledParameters { clearcoat: 1.0, metallic: 0.3, anisotropic: 0.8, ..PRINCIPLED };
    vec![
        ("Beckmann", rough_conductor(gold, Beckmann, 0.2, 0.5)),
        ("smooth Beckmann", rough_conductor(gold, Beckmann, 0.15, 0.15)),
        ("GGX", rough_conductor(gold, Ggx, 0.6, 0.2)),
        ("glass, Beckmann", rough_dielectric(clear(1.5), Beckmann, DVec2::new(0.3, 0.4))),
        ("glass, GGX", rough_dielectric(clear(1.5), Ggx, DVec2::new(0.5, 0.25))),
        ("inverted glass", rough_dielectric(clear(1.0 / 1.5), Ggx, DVec2::splat(0.4))),
        ("plastic", Model::Plastic(Plastic(plastic))),
        ("rough plastic, Beckmann", Model::RoughPlastic(RoughPlastic { coat: plastic, rough: &rough[0] })),
        ("rough plastic, GGX", Model::RoughPlastic(RoughPlastic { coat: plastic, rough: &rough[1] })),
        ("principled", Model::Principled(Principled::new(coated))),
        ("principled glass", principled_glass()),
    ]
}

fn rough_coats() -> [RoughCoat; 2] {
    [RoughCoat::new(Beckmann, 0.2, 1.5), RoughCoat::new(Ggx, 0.4, 1.5)]
}

/// A direction, and whether light comes from there; viewers from above, from below and grazing.
const VIEWERS: [(f64, f64); 5] = [(20.0, 30.0), (65.0, -100.0), (85.0, 170.0), (125.0, 50.0), (165.0, -20.0)];

#[test]
fn samples_agree_with_values() {
    let rough = rough_coats();
    for (name, model) in models(&rough) {
        let mut drawn = 0;
        for i in 0..4000 {
            let mut sampler = Sampler::new(5, [i, 0], 0);
            let viewer = warp::uniform_sphere(sampler.next_2d()).normalize();
            let Some(sample) = model.sample(viewer, sampler.next_1d(), sampler.next_2d()) else { continue };
            assert!((sample.to_light.length() - 1.0).abs() < 1e-12, "{name}, sample {i}");
            assert!(sample.weight.min_element() >= 0.0 && sample.weight.is_finite(), "{name}, sample {i}");
            if sample.is_delta {
                continue;
            }
            drawn += 1;
            let value = model.eval(viewer, sample.to_light);
            assert!((value.pdf / sample.pdf - 1.0).abs() < 1e-7, "{name}, {i}: {} {}", value.pdf, sample.pdf);
            let off = (value.value / value.pdf - sample.weight).abs().max_element();
            assert!(off <= 1e-7 * sample.weight.max_element(), "{name}, sample {i}: off by {off:e}");
            let through = viewer.z * sample.to_light.z < 0.0;
            assert_eq!(sample.eta != 1.0, through, "{name}, sample {i}: eta {}", sample.eta);
        }
        assert!(drawn > 1000, "{name}: only {drawn} samples");
    }
}

#[test]
fn degenerate_directions_are_black() {
    let rough = rough_coats();
    let smooth = [
        ("mirror", Model::Conductor(Conductor(named_metal("none", DVec3::ONE)))),
        ("clear glass", Model::Dielectric(Dielectric(clear(1.5)))),
        ("diffuse", Model::Diffuse(Diffuse { reflectance: DVec3::ONE })),
    ];
    let good = DVec3::new(0.6, 0.0, 0.8);
    for (name, model) in models(&rough).into_iter().chain(smooth) {
        for bad in [DVec3::X, DVec3::new(0.0, -1.0, -0.0), DVec3::ZERO, DVec3::NAN] {
            assert_eq!(model.sample(bad, 0.7, DVec2::splat(0.4)), None, "{name} from {bad}");
            for [viewer, light] in [[bad, good], [good, bad], [bad, bad]] {
                assert_eq!(model.eval(viewer, light), BsdfValue::BLACK, "{name}, {viewer}, {light}");
            }
        }
        // nearly along the surface, at the corners of the unit square, and straight on
        let grazing = DVec3::new(1.0, 0.0, 1e-300);
        for viewer in [grazing, -grazing, DVec3::new(0.6, 0.8, 1e-9), DVec3::Z, DVec3::NEG_Z] {
            for u in [DVec2::ZERO, DVec2::splat(1.0 - f64::EPSILON), DVec2::new(0.5, 0.0), DVec2::splat(0.5)]
            {
                for choice in [0.0, 0.5, 1.0 - f64::EPSILON] {
                    let Some(sample) = model.sample(viewer, choice, u) else { continue };
                    let finite = sample.to_light.is_finite() && sample.weight.is_finite() && sample.pdf > 0.0;
                    assert!(finite && sample.pdf.is_finite(), "{name} from {viewer}, {u}: {sample:?}");
                    let value = model.eval(viewer, sample.to_light);
                    assert!(
                        value.value.is_finite() && value.pdf.is_finite(),
                        "{name} from {viewer}: {value:?}"
                    );
                }
            }
        }
    }
}

/// Cells of equal solid angle, from below to above.
const ROWS: u32 = 20;
const COLUMNS: u32 = 40;
const COUNT: u32 = 100_000;

/// Samples expected in each cell, and at last those without a direction.
fn expected(model: &Model<'_>, viewer: DVec3) -> Vec<f64> {
    let rule = gauss_legendre(16);
    let area = 4.0 * PI / f64::from(ROWS * COLUMNS);
    let mut expected = Vec::new();
    for (row, column) in (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column))) {
        let mut mean = 0.0;
        for (x, x_weight) in &rule {
            for (y, y_weight) in &rule {
                let z = -1.0 + 2.0 * (f64::from(row) + x) / f64::from(ROWS);
                let (sin, cos) = libm::sincos(2.0 * PI * (f64::from(column) + y) / f64::from(COLUMNS));
                let radius = (1.0 - z * z).sqrt();
                let pdf = model.eval(viewer, DVec3::new(radius * cos, radius * sin, z)).pdf;
                mean += x_weight * y_weight * pdf;
            }
        }
        expected.push(mean * area * f64::from(COUNT));
    }
    expected.push((f64::from(COUNT) - expected.iter().sum::<f64>()).max(0.0));
    expected
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "cells are few")]
fn cell(direction: DVec3) -> usize {
    let row = (f64::from(ROWS) * 0.5 * (direction.z + 1.0)).min(f64::from(ROWS - 1)) as u32;
    let turn = libm::atan2(direction.y, direction.x).rem_euclid(2.0 * PI) / (2.0 * PI);
    let column = (f64::from(COLUMNS) * turn).min(f64::from(COLUMNS - 1)) as u32;
    (row * COLUMNS + column) as usize
}

#[test]
fn samples_have_their_density() {
    let rough = rough_coats();
    for (name, model) in models(&rough) {
        for (angle, azimuth) in VIEWERS {
            let viewer = direction(angle, azimuth);
            let mut expected = expected(&model, viewer);
            let mut observed = vec![0.0; expected.len()];
            for i in 0..COUNT {
                let mut sampler = Sampler::new(11, [i, 1], 0);
                let sample = model.sample(viewer, sampler.next_1d(), sampler.next_2d());
                let smooth = sample.filter(|sample| !sample.is_delta);
                observed[smooth.map_or(expected.len() - 1, |sample| cell(sample.to_light))] += 1.0;
            }
            // the fit of Beckmann's masking makes densities wrong by up to 0.35 %, and the grid cannot resolve the
            // critical angle
            let none = expected.pop().unwrap_or_default() - observed.pop().unwrap_or_default();
            assert!(
                none.abs() < 0.005 * f64::from(COUNT),
                "{name} from {angle}: {none} samples without direction"
            );
            // cells of few samples together
            let (mut chi_sq, mut cells, mut pooled) = (0.0, 0, [0.0; 2]);
            for (expected, observed) in expected.iter().zip(&observed) {
                if *expected < 10.0 {
                    pooled[0] += expected;
                    pooled[1] += observed;
                } else {
                    chi_sq += (observed - expected) * (observed - expected) / expected;
                    cells += 1;
                }
            }
            if pooled[0] > 10.0 {
                chi_sq += (pooled[1] - pooled[0]) * (pooled[1] - pooled[0]) / pooled[0];
                cells += 1;
            } else {
                assert!(pooled[1] < 40.0, "{name}, {angle}: {pooled:?} samples where there should be none");
            }
            let freedom = f64::from(cells - 1).max(1.0);
            let sigmas = (chi_sq - freedom) / (2.0 * freedom).sqrt();
            assert!(sigmas < 4.5, "{name} from {angle}: chi² {chi_sq} of {cells} cells, {sigmas} sigma");
        }
    }
}
