//! Energy and reciprocity.

use super::*;
use crate::shade::{Sampler, warp};

/// All models that keep to the laws of physics, with all reflectances 1.
fn lossless(rough: &[RoughCoat; 2]) -> Vec<(&'static str, Model<'_>, f64)> {
    let mirror = named_metal("none", DVec3::ONE);
    let plastic = |nonlinear| coat(1.5, nonlinear, DVec3::ONE, DVec3::ONE);
    let white = PrincipledParameters { base_color: DVec3::ONE, ..PRINCIPLED };
    let metal = PrincipledParameters { metallic: 1.0, ..white };
    let glass = PrincipledParameters { spec_trans: 1.0, ..white };
    let principled = |parameters| Model::Principled(Principled::new(parameters));
    vec![
        ("diffuse", Model::Diffuse(Diffuse { reflectance: DVec3::ONE }), 1.0),
        ("mirror", Model::Conductor(Conductor(mirror)), 1.0),
        ("rough mirror", rough_conductor(mirror, Beckmann, 0.2, 0.4), 1.0),
        ("rough GGX mirror", rough_conductor(mirror, Ggx, 0.7, 0.3), 1.0),
        ("glass", Model::Dielectric(Dielectric(clear(1.5))), 1.5),
        ("diamond", Model::Dielectric(Dielectric(clear(1.0 / 2.4))), 1.0 / 2.4),
        ("rough glass", rough_dielectric(clear(1.5), Beckmann, DVec2::new(0.2, 0.3)), 1.5),
        ("rough GGX glass", rough_dielectric(clear(1.5), Ggx, DVec2::new(0.2, 0.5)), 1.5),
        ("plastic", Model::Plastic(Plastic(plastic(false))), 1.0),
        ("nonlinear plastic", Model::Plastic(Plastic(plastic(true))), 1.0),
        ("rough plastic", Model::RoughPlastic(RoughPlastic { coat: plastic(false), rough: &rough[0] }), 1.0),
        (
            "rough GGX plastic",
            Model::RoughPlastic(RoughPlastic { coat: plastic(true), rough: &rough[1] }),
            1.0,
        ),
        ("principled metal", principled(metal), 1.0),
        ("principled glass", principled(glass), 1.5),
    ]
}

fn rough_coats() -> [RoughCoat; 2] {
    [RoughCoat::new(Beckmann, 0.2, 1.5), RoughCoat::new(Ggx, 0.4, 1.5)]
}

/// What comes back of the same light from everywhere; radiance in a medium is by the square of its index of refraction
/// more.
#[test]
fn no_material_gives_more_light_than_it_gets() {
    let rough = rough_coats();
    for (name, model, _) in lossless(&rough) {
        for angle in [5.0, 45.0, 75.0, 88.0, 100.0, 130.0, 170.0] {
            let (mut sum, mut sum_sq, count) = (0.0, 0.0, 40_000);
            for i in 0..count {
                let mut sampler = Sampler::new(21, [i, 0], 0);
                let sample = model.sample(direction(angle, 33.0), sampler.next_1d(), sampler.next_2d());
                let power =
                    sample.map_or(0.0, |sample| sample.weight.max_element() * sample.eta * sample.eta);
                sum += power;
                sum_sq += power * power;
            }
            let n = f64::from(count);
            let mean = sum / n;
            let sigma = ((sum_sq / n - mean * mean).max(0.0) / n).sqrt();
            assert!(mean <= 1.0 + 5.0 * sigma + 1e-12, "{name} from {angle}: {mean}, sigma {sigma}");
            let smooth =
                ["glass", "diamond"].contains(&name) || ["mirror", "diffuse"].contains(&name) && angle < 90.0;
            assert!(!smooth || (mean - 1.0).abs() < 1e-12, "{name} from {angle} loses light: {mean}");
            assert!(mean > 0.5 || angle > 80.0, "{name} from {angle}: only {mean}");
        }
    }
}

/// Helmholtz: light takes the way back as it came; between media by the ratio of the squares of their indices of
/// refraction (Walter et al. 2007, section 4.2).
#[test]
fn light_takes_the_same_way_back() {
    let rough = rough_coats();
    let mut models = lossless(&rough);
    models.push(("all lobes", principled_glass(), 1.45));
    for (name, model, eta) in models {
        let mut compared = 0;
        for i in 0..4000 {
            let mut sampler = Sampler::new(31, [i, 0], 0);
            let [a, b] = [sampler.next_2d(), sampler.next_2d()].map(|u| warp::uniform_sphere(u).normalize());
            let (there, back) = (model.eval(a, b).value / b.z.abs(), model.eval(b, a).value / a.z.abs());
            let factor = if a.z * b.z > 0.0 {
                1.0
            } else if a.z > 0.0 {
                eta * eta
            } else {
                1.0 / (eta * eta)
            };
            let off = (there * factor - back).abs().max_element();
            assert!(
                off <= 1e-9 * (1.0 + back.max_element()),
                "{name}, pair {i}: {there} by {factor} is not {back}"
            );
            compared += usize::from(back.max_element() > 0.0);
        }
        assert!(!model.has_smooth_part() || compared > 500, "{name}: only {compared} pairs");
    }
}
