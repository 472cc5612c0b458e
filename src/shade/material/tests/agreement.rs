//! The numbers of Mitsuba.

use super::reference_values::{self as reference, PAIRS, Table};
use super::*;

/// Mitsuba computes in single precision, and the rough coats' tables sum up some of its errors.
fn agrees(got: f64, want: f64) -> bool {
    (got - want).abs() <= 3e-5 * want.abs() + 1e-9
}

fn assert_table(name: &str, model: &Model<'_>, table: &Table) {
    for (i, [viewer, light]) in PAIRS.into_iter().enumerate() {
        let got = model.eval(direction(viewer.0, viewer.1), direction(light.0, light.1));
        let got = [got.value.x, got.value.y, got.value.z, got.pdf];
        let want = table.get(i).copied().unwrap_or_default();
        let good = got.into_iter().zip(want).all(|(got, want)| agrees(got, want));
        assert!(good, "{name}, pair {i}: got {got:?}, Mitsuba has {want:?}");
    }
}

#[test]
fn diffuse_and_conductors() {
    let diffuse = Model::Diffuse(Diffuse { reflectance: rgb(0.6, 0.5, 0.4) });
    assert_table("diffuse", &diffuse, reference::DIFFUSE);
    let gold = rough_conductor(named_metal("Au", DVec3::ONE), Beckmann, 0.1, 0.1);
    assert_table("gold", &gold, reference::ROUGHCONDUCTOR);
    let metal =
        Metal { eta: rgb(0.2, 0.9, 1.5), k: rgb(3.9, 2.4, 1.1), specular_reflectance: rgb(0.9, 0.8, 0.7) };
    assert_table("GGX", &rough_conductor(metal, Ggx, 0.3, 0.12), reference::ROUGHCONDUCTOR_GGX);
    let mirror = rough_conductor(named_metal("none", DVec3::ONE), Beckmann, 0.25, 0.6);
    assert_table("Beckmann", &mirror, reference::ROUGHCONDUCTOR_BECKMANN);
}

#[test]
fn dielectrics() {
    let glass = clear(index("bk7") / index("air"));
    let default = rough_dielectric(glass, Beckmann, DVec2::splat(0.3));
    assert_table("glass", &default, reference::ROUGHDIELECTRIC);
    let diamond = rough_dielectric(tinted(index("diamond") / index("water")), Ggx, DVec2::new(0.4, 0.25));
    assert_table("GGX", &diamond, reference::ROUGHDIELECTRIC_GGX);
    let inverted = rough_dielectric(clear(1.0 / 1.5), Ggx, DVec2::splat(0.35));
    assert_table("inverted", &inverted, reference::ROUGHDIELECTRIC_INVERTED);
}

#[test]
fn plastics() {
    let (orange, bluish) = (rgb(0.6, 0.3, 0.1), rgb(0.5, 0.6, 0.7));
    let eta = index("polypropylene") / index("air");
    let linear = coat(eta, false, orange, DVec3::ONE);
    assert_table("plastic", &Model::Plastic(Plastic(linear)), reference::PLASTIC);
    let nonlinear = coat(index("diamond") / index("air"), true, orange, bluish);
    assert_table("nonlinear", &Model::Plastic(Plastic(nonlinear)), reference::PLASTIC_NONLINEAR);
    for (name, distribution, alpha, coat, table) in [
        ("rough", Beckmann, 0.1, linear, reference::ROUGHPLASTIC),
        ("GGX", Ggx, 0.3, coat(1.9 / index("air"), true, orange, bluish), reference::ROUGHPLASTIC_GGX),
        (
            "inverted",
            Beckmann,
            0.4,
            coat(1.2 / 1.4, false, DVec3::splat(0.5), DVec3::ONE),
            reference::ROUGHPLASTIC_INVERTED,
        ),
    ] {
        let rough = RoughCoat::new(distribution, alpha, coat.eta);
        assert_table(name, &Model::RoughPlastic(RoughPlastic { coat, rough: &rough }), table);
    }
}

#[test]
fn principled() {
    let model = |parameters| Model::Principled(Principled::new(parameters));
    assert_table(
        "default",
        &model(PrincipledParameters { eta: eta_of(0.5), ..PRINCIPLED }),
        reference::PRINCIPLED,
    );
    let metal = PrincipledParameters {
        base_color: rgb(0.8, 0.5, 0.2),
        roughness: 0.4,
        metallic: 0.7,
        anisotropic: 0.6,
        spec_tint: 0.3,
        eta: eta_of(0.7),
        ..PRINCIPLED
    };
    assert_table("metal", &model(metal), reference::PRINCIPLED_METAL);
    let cloth = PrincipledParameters {
        base_color: rgb(0.3, 0.5, 0.8),
        roughness: 0.8,
        sheen: 0.9,
        sheen_tint: 0.6,
        flatness: 0.7,
        eta: eta_of(0.2),
        ..PRINCIPLED
    };
    assert_table("cloth", &model(cloth), reference::PRINCIPLED_CLOTH);
    let coated = PrincipledParameters {
        base_color: rgb(0.7, 0.1, 0.1),
        roughness: 0.6,
        clearcoat: 0.8,
        clearcoat_gloss: 0.4,
        eta: 1.7,
        ..PRINCIPLED
    };
    assert_table("coated", &model(coated), reference::PRINCIPLED_COATED);
    assert_table("glass", &principled_glass(), reference::PRINCIPLED_GLASS);
}

/// A delta sample as Mitsuba 3.9.1 prints it: angles of the viewer, choice, direction, weight, pdf, eta.
type DeltaRow = ((f64, f64), f64, [f64; 3], [f64; 3], f64, f64);

fn assert_deltas(name: &str, model: &Model<'_>, rows: &[DeltaRow]) {
    for (i, &((angle, azimuth), choice, to_light, weight, pdf, eta)) in rows.iter().enumerate() {
        let got = model.sample(direction(angle, azimuth), choice, DVec2::new(0.3, 0.6)).unwrap();
        assert!(got.is_delta);
        let off = (got.to_light - DVec3::from_array(to_light)).abs().max_element();
        assert!(off < 1e-6, "{name}, sample {i}: direction {}", got.to_light);
        let good = got.weight.to_array().into_iter().zip(weight).all(|(got, want)| agrees(got, want));
        assert!(good && agrees(got.pdf, pdf) && agrees(got.eta, eta), "{name}, sample {i}: {got:?}");
    }
}

#[test]
fn smooth_conductors() {
    let copper = Model::Conductor(Conductor(named_metal("Cu", rgb(0.9, 0.8, 0.7))));
    let down = direction(110.0, 0.0);
    assert_eq!(copper.sample(down, 0.5, DVec2::splat(0.5)), None, "black from below");
    assert_deltas(
        "copper",
        &copper,
        &[
            (
                (30.0, 20.0),
                0.0,
                [-0.4698463, -0.1710101, 0.8660254],
                [0.8564865, 0.4956518, 0.3578026],
                1.0,
                1.0,
            ),
            (
                (80.0, -50.0),
                0.0,
                [-0.6330222, 0.7544065, 0.1736482],
                [0.8534616, 0.5924091, 0.4816046],
                1.0,
                1.0,
            ),
        ],
    );
}

#[test]
fn smooth_dielectrics_and_coats() {
    assert_deltas(
        "glass",
        &Model::Dielectric(Dielectric(tinted(index("bk7") / index("air")))),
        &[
            ((30.0, 20.0), 0.0, [-0.4698463, -0.1710101, 0.8660254], [0.9, 0.8, 0.7], 0.04206778, 1.0),
            (
                (30.0, 20.0),
                0.999,
                [-0.3123598, -0.1136897, -0.9431363],
                [0.2209879, 0.2651855, 0.3535807],
                0.9579322,
                1.504183,
            ),
            ((80.0, -50.0), 0.0, [-0.6330222, 0.7544065, 0.1736482], [0.9, 0.8, 0.7], 0.3884033, 1.0),
            (
                (80.0, -50.0),
                0.999,
                [-0.4208412, 0.501539, -0.7558779],
                [0.2209879, 0.2651855, 0.3535807],
                0.6115967,
                1.504183,
            ),
            ((130.0, 10.0), 0.0, [-0.7544065, -0.1330222, -0.6427876], [0.9, 0.8, 0.7], 1.0, 1.0),
            ((130.0, 10.0), 0.999, [-0.7544065, -0.1330222, -0.6427876], [0.9, 0.8, 0.7], 1.0, 1.0),
            ((160.0, 100.0), 0.0, [0.05939117, -0.3368241, -0.9396926], [0.9, 0.8, 0.7], 0.04229896, 1.0),
            (
                (160.0, 100.0),
                0.999,
                [0.08933521, -0.5066451, 0.8575138],
                [1.131284, 1.35754, 1.810054],
                0.957701,
                0.6648126,
            ),
        ],
    );
    let plastic = coat(index("polypropylene") / index("air"), false, rgb(0.6, 0.3, 0.1), rgb(0.5, 0.6, 0.7));
    assert_deltas(
        "plastic",
        &Model::Plastic(Plastic(plastic)),
        &[
            (
                (30.0, 20.0),
                0.0,
                [-0.4698463, -0.1710101, 0.8660254],
                [0.2867051, 0.3440462, 0.4013872],
                0.07005972,
                1.0,
            ),
            (
                (80.0, -50.0),
                0.0,
                [-0.6330222, 0.7544065, 0.1736482],
                [0.363537, 0.4362444, 0.5089517],
                0.5307802,
                1.0,
            ),
        ],
    );
}
