use glam::DVec2;

use super::*;
use crate::shade::material::{
    CoatSource, ConductorSource, DielectricSource, DiffuseSource, GlassSource, MetalSource, PlasticSource,
    PrincipledInterface, PrincipledSource, RoughConductorSource, RoughDielectricSource, Roughness,
};
use crate::shade::testing::surface;
use crate::shade::texture::{Checkerboard, TextureSource};

fn prepared(material: &Material) -> PreparedMaterial {
    PreparedMaterial::try_new(material).unwrap()
}

fn board(first: f64, second: f64) -> TextureSource {
    let colours = [DVec3::splat(first), DVec3::splat(second)];
    TextureSource::Checkerboard(Checkerboard { colours, ..Checkerboard::default() })
}

#[test]
fn parameters_are_looked_up_at_the_hit() {
    let (above, aslant) = (DVec3::Z, DVec3::new(0.6, 0.0, 0.8));
    let at = |uv: [f64; 2]| SurfaceInteraction { uv: uv.into(), ..surface(DVec3::Z) };
    let diffuse =
        prepared(&Material::Diffuse(DiffuseSource { reflectance: board(0.25, 0.5), two_sided: true }));
    for (uv, reflectance) in [([0.2, 0.8], 0.25), ([0.2, 0.2], 0.5), ([0.7, 0.8], 0.5)] {
        assert_eq!(diffuse.albedo(&at(uv), above), DVec3::splat(reflectance));
        let got = diffuse.bsdf(&at(uv)).eval(above, aslant).value * PI / 0.8;
        assert!((got - reflectance).abs().max_element() < 1e-15, "{uv:?}: {got}");
    }
    // a rougher place reflects less where it is smooth
    let roughness = Roughness { alpha_u: board(0.5, 0.1), alpha_v: board(0.5, 0.1), ..Roughness::default() };
    let metal = prepared(&Material::RoughConductor(RoughConductorSource {
        metal: MetalSource::default(),
        roughness,
        two_sided: true,
    }));
    let peaks = [[0.2, 0.8], [0.2, 0.2]].map(|uv| metal.bsdf(&at(uv)).eval(above, above).value.x);
    let want = [0.1, 0.5].map(|alpha: f64| 1.0 / (4.0 * PI * alpha * alpha));
    for (peak, want) in peaks.into_iter().zip(want) {
        assert!((peak / want - 1.0).abs() < 1e-14, "{peak}, want {want}");
    }
}

#[test]
fn albedo_is_that_of_mitsuba() {
    // Mitsuba 3.9.1: bsdf.eval_diffuse_reflectance with wi = (0.6, 0, 0.8)
    let viewer = DVec3::new(0.6, 0.0, 0.8);
    let rough = Roughness { alpha_u: 0.4.into(), alpha_v: 0.4.into(), ..Roughness::default() };
    let gold = MetalSource::named("Au").unwrap();
    let half = DVec3::splat(0.5);
    let cases = [
        (Material::default(), half),
        (Material::Conductor(ConductorSource { metal: gold.clone(), two_sided: true }), DVec3::ZERO),
        (
            Material::RoughConductor(RoughConductorSource {
                metal: gold,
                roughness: rough.clone(),
                two_sided: true,
            }),
            DVec3::new(1.163905, 0.9655998, 0.3905993),
        ),
        (Material::Dielectric(DielectricSource { glass: GlassSource::default() }), DVec3::ZERO),
        (
            Material::RoughDielectric(RoughDielectricSource {
                glass: GlassSource::default(),
                roughness: rough,
            }),
            DVec3::splat(0.04903807),
        ),
        (Material::Plastic(PlasticSource { coat: CoatSource::default(), two_sided: true }), half),
        (Material::Principled(Box::default()), half),
    ];
    for (material, want) in cases {
        let surface = surface(DVec3::Z);
        let material = prepared(&material);
        for length in [1.0, 3.0] {
            let got = material.albedo(&surface, length * viewer);
            assert!((got - want).abs().max_element() < 1e-6, "{got}, want {want}");
        }
    }
}

#[test]
fn only_two_sided_materials_reflect_below() {
    let below = DVec3::new(0.6, 0.0, -0.8);
    for two_sided in [true, false] {
        let rough = Material::RoughConductor(RoughConductorSource {
            metal: MetalSource::default(),
            roughness: Roughness::default(),
            two_sided,
        });
        let mirror = Material::Conductor(ConductorSource { metal: MetalSource::default(), two_sided });
        let plastic = Material::Plastic(PlasticSource { coat: CoatSource::default(), two_sided });
        let principled =
            Material::Principled(Box::new(PrincipledSource { two_sided, ..PrincipledSource::default() }));
        for material in [rough, mirror, plastic, principled] {
            let prepared = prepared(&material);
            let sample = prepared.bsdf(&surface(DVec3::Z)).sample(below, 0.3, DVec2::new(0.4, 0.3));
            assert_eq!(sample.is_some(), two_sided, "{material:?}");
            assert!(sample.is_none_or(|sample| sample.to_light.z < 0.0), "{material:?}");
        }
    }
}

#[test]
fn principled_interfaces_are_those_of_mitsuba() {
    let eta = |interface, spec_trans: f64| {
        PrincipledSource { interface, spec_trans: spec_trans.into(), ..PrincipledSource::default() }.eta()
    };
    assert!((eta(PrincipledInterface::Specular(0.5), 0.0) - 1.5).abs() < 1e-15);
    assert_eq!(eta(PrincipledInterface::Specular(0.0), 0.0), 1.0);
    assert!(eta(PrincipledInterface::Specular(0.0), 1.0) > 1.01);
    assert_eq!(eta(PrincipledInterface::Eta(1.0), 0.0), 1.0);
    assert_eq!(eta(PrincipledInterface::Eta(1.0), 0.5), 1.001);
}

#[test]
fn missing_pictures_are_named() {
    let reflectance = TextureSource::Bitmap(crate::shade::BitmapSource {
        path: "nowhere/none.png".into(),
        channel: None,
        filter: crate::shade::TextureFilter::Nearest,
        wrap: crate::shade::TextureWrap::Clamp,
        raw: false,
        to_uv: glam::DAffine2::IDENTITY,
    });
    let error = PreparedMaterial::try_new(&Material::Diffuse(DiffuseSource { reflectance, two_sided: true }))
        .unwrap_err();
    assert!(error.to_string().contains("none.png"), "{error}");
}
