//! The models against Mitsuba, and against the laws of physics and of chance.

mod agreement;
mod chance;
mod physics;
mod reference_values;
mod sides;

use super::conductor::Metal;
use super::dielectric::Glass;
use super::microfacet::Microfacets;
use super::plastic::{Coat, RoughCoat};
use super::principled::PrincipledParameters;
use super::*;
use MicrofacetDistribution::{Beckmann, Ggx};

/// The direction at an angle with the normal and an azimuth, in degrees.
fn direction(angle: f64, azimuth: f64) -> DVec3 {
    let (sin, cos) = libm::sincos(angle.to_radians());
    let (sin_azimuth, cos_azimuth) = libm::sincos(azimuth.to_radians());
    DVec3::new(sin * cos_azimuth, sin * sin_azimuth, cos)
}

fn rgb(r: f64, g: f64, b: f64) -> DVec3 {
    DVec3::new(r, g, b)
}

fn index(name: &str) -> f64 {
    refractive_index(name).unwrap()
}

fn named_metal(name: &str, specular_reflectance: DVec3) -> Metal {
    let [eta, k] = metal(name).unwrap();
    Metal { eta, k, specular_reflectance }
}

fn rough_conductor(metal: Metal, distribution: MicrofacetDistribution, u: f64, v: f64) -> Model<'static> {
    Model::RoughConductor(RoughConductor { metal, facets: Microfacets::new(distribution, DVec2::new(u, v)) })
}

fn clear(eta: f64) -> Glass {
    Glass { eta, specular_reflectance: DVec3::ONE, specular_transmittance: DVec3::ONE }
}

fn tinted(eta: f64) -> Glass {
    let (specular_reflectance, specular_transmittance) = (rgb(0.9, 0.8, 0.7), rgb(0.5, 0.6, 0.8));
    Glass { eta, specular_reflectance, specular_transmittance }
}

fn rough_dielectric(glass: Glass, distribution: MicrofacetDistribution, alpha: DVec2) -> Model<'static> {
    Model::RoughDielectric(RoughDielectric { glass, facets: Microfacets::new(distribution, alpha) })
}

fn coat(eta: f64, nonlinear: bool, diffuse_reflectance: DVec3, specular_reflectance: DVec3) -> Coat {
    let [diffuse, specular] = [diffuse_reflectance, specular_reflectance].map(|c| c.element_sum() / 3.0);
    let specular_weight = specular / (diffuse + specular);
    Coat { eta, diffuse_reflectance, specular_reflectance, nonlinear, specular_weight }
}

/// Mitsuba's defaults.
const PRINCIPLED: PrincipledParameters = PrincipledParameters {
    base_color: DVec3::splat(0.5),
    roughness: 0.5,
    anisotropic: 0.0,
    metallic: 0.0,
    spec_trans: 0.0,
    // of specular 0.5
    eta: 1.5,
    spec_tint: 0.0,
    sheen: 0.0,
    sheen_tint: 0.0,
    flatness: 0.0,
    clearcoat: 0.0,
    clearcoat_gloss: 0.0,
};

/// What a `specular` stands for.
fn eta_of(specular: f64) -> f64 {
    2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0
}

/// The material that [`reference_values::PRINCIPLED_GLASS`] is of: all lobes at once.
fn principled_glass() -> Model<'static> {
    Model::Principled(Principled::new(PrincipledParameters {
        base_color: rgb(0.9, 0.8, 0.7),
        spec_trans: 0.8,
        metallic: 0.1,
        clearcoat: 0.5,
        clearcoat_gloss: 0.3,
        sheen: 0.3,
        flatness: 0.2,
        spec_tint: 0.5,
        anisotropic: 0.3,
        eta: 1.45,
        ..PRINCIPLED
    }))
}
