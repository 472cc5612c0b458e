//! Glass and liquids: light is reflected and refracted. Directions may be on both sides.

use glam::{DVec2, DVec3};

use super::bsdf::{BsdfSample, BsdfValue};
use super::fresnel;
use super::microfacet::Microfacets;
use super::prepared::{MaterialError, Textures};
use super::refractive_index::{check_media, named_index, read_index};
use super::roughness::{PreparedRoughness, ROUGHNESS_KEYS, Roughness};
use super::{Material, MaterialKind, MaterialSettings, Model, Prepared, read_colour};
use crate::shade::parameters::{Parameter, ParameterSource, Parameters};
use crate::shade::texture::{Texture, TextureSource};

const GLASS_KEYS: &[&str] = &["int_ior", "ext_ior", "specular_reflectance", "specular_transmittance"];

/// Mitsuba's `dielectric`.
pub(super) const KIND: MaterialKind = MaterialKind {
    name: "dielectric",
    keys: &[GLASS_KEYS],
    read: |source| Some(Material::Dielectric(DielectricSource { glass: GlassSource::read(source) })),
};

/// Mitsuba's `roughdielectric`.
pub(super) const ROUGH_KIND: MaterialKind = MaterialKind {
    name: "roughdielectric",
    keys: &[GLASS_KEYS, ROUGHNESS_KEYS],
    read: |source| {
        let glass = GlassSource::read(source);
        check_media(source, glass.int_ior, glass.ext_ior);
        Some(Material::RoughDielectric(RoughDielectricSource { glass, roughness: Roughness::read(source) }))
    },
};

/// A clear interface between two media.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DielectricSource {
    /// The media.
    pub glass: GlassSource,
}

/// A rough interface between two media.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RoughDielectricSource {
    /// The media, of different indices of refraction.
    pub glass: GlassSource,
    /// Its roughness.
    pub roughness: Roughness,
}

/// Two transparent media.
#[derive(Clone, Debug, PartialEq)]
pub struct GlassSource {
    /// Index of refraction where the normal points away from.
    pub int_ior: f64,
    /// Index of refraction where the normal points to.
    pub ext_ior: f64,
    /// Factor of all that is reflected.
    pub specular_reflectance: TextureSource,
    /// Factor of all that is transmitted.
    pub specular_transmittance: TextureSource,
}

impl Default for GlassSource {
    fn default() -> Self {
        Self {
            int_ior: named_index("bk7"),
            ext_ior: named_index("air"),
            specular_reflectance: TextureSource::from(1.0),
            specular_transmittance: TextureSource::from(1.0),
        }
    }
}

impl GlassSource {
    fn read(source: &dyn ParameterSource) -> Self {
        let default = Self::default();
        let colour = |key, default| read_colour(source, key, default);
        Self {
            int_ior: read_index(source, "int_ior").unwrap_or(default.int_ior),
            ext_ior: read_index(source, "ext_ior").unwrap_or(default.ext_ior),
            specular_reflectance: colour("specular_reflectance", default.specular_reflectance),
            specular_transmittance: colour("specular_transmittance", default.specular_transmittance),
        }
    }

    fn parameters(&self) -> Parameters<'_> {
        vec![
            ("int_ior", Parameter::Number(self.int_ior)),
            ("ext_ior", Parameter::Number(self.ext_ior)),
            ("specular_reflectance", Parameter::ColourTexture(&self.specular_reflectance)),
            ("specular_transmittance", Parameter::ColourTexture(&self.specular_transmittance)),
        ]
    }
}

impl MaterialSettings for DielectricSource {
    fn kind(&self) -> &'static str {
        KIND.name
    }

    fn parameters(&self) -> Parameters<'_> {
        self.glass.parameters()
    }

    fn two_sided(&self) -> Option<bool> {
        None
    }

    fn prepare(&self, textures: &mut Textures) -> Result<Box<dyn Prepared>, MaterialError> {
        Ok(Box::new(PreparedDielectric(PreparedGlass::try_new(&self.glass, textures)?)))
    }
}

impl MaterialSettings for RoughDielectricSource {
    fn kind(&self) -> &'static str {
        ROUGH_KIND.name
    }

    fn parameters(&self) -> Parameters<'_> {
        [self.glass.parameters(), self.roughness.parameters()].concat()
    }

    fn two_sided(&self) -> Option<bool> {
        None
    }

    fn prepare(&self, textures: &mut Textures) -> Result<Box<dyn Prepared>, MaterialError> {
        let glass = PreparedGlass::try_new(&self.glass, textures)?;
        let roughness = PreparedRoughness::try_new(&self.roughness, textures)?;
        Ok(Box::new(PreparedRoughDielectric { glass, roughness }))
    }
}

#[derive(Debug)]
struct PreparedGlass {
    eta: f64,
    specular_reflectance: Texture,
    specular_transmittance: Texture,
}

impl PreparedGlass {
    fn try_new(source: &GlassSource, textures: &mut Textures) -> Result<Self, MaterialError> {
        Ok(Self {
            eta: source.int_ior / source.ext_ior,
            specular_reflectance: textures.read(&source.specular_reflectance)?,
            specular_transmittance: textures.read(&source.specular_transmittance)?,
        })
    }

    fn at(&self, uv: DVec2) -> Glass {
        let specular_reflectance = self.specular_reflectance.colour(uv);
        let specular_transmittance = self.specular_transmittance.colour(uv);
        Glass { eta: self.eta, specular_reflectance, specular_transmittance }
    }
}

#[derive(Debug)]
struct PreparedDielectric(PreparedGlass);

impl Prepared for PreparedDielectric {
    fn model(&self, uv: DVec2) -> Model<'_> {
        Model::Dielectric(Dielectric(self.0.at(uv)))
    }
}

#[derive(Debug)]
struct PreparedRoughDielectric {
    glass: PreparedGlass,
    roughness: PreparedRoughness,
}

impl Prepared for PreparedRoughDielectric {
    fn model(&self, uv: DVec2) -> Model<'_> {
        Model::RoughDielectric(RoughDielectric { glass: self.glass.at(uv), facets: self.roughness.at(uv) })
    }
}

/// An interface between two transparent media.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Glass {
    /// Index of refraction where the normal points away from, over that on the other side.
    pub(super) eta: f64,
    /// Factor of all that is reflected.
    pub(super) specular_reflectance: DVec3,
    /// Factor of all that is transmitted.
    pub(super) specular_transmittance: DVec3,
}

/// A smooth interface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Dielectric(pub(super) Glass);

impl Dielectric {
    /// Reflects with the probability that light does, or refracts.
    ///
    /// What is refracted shrinks with its cone by 1/eta²: this is radiance, not power.
    pub(super) fn sample(&self, to_viewer: DVec3, choice: f64) -> Option<BsdfSample> {
        let Glass { eta, specular_reflectance, specular_transmittance } = self.0;
        if !(to_viewer.z != 0.0 && to_viewer.is_finite()) {
            return None;
        }
        let interface = fresnel::dielectric(to_viewer.z, eta);
        let sample = if choice < interface.reflectance {
            BsdfSample {
                to_light: DVec3::new(-to_viewer.x, -to_viewer.y, to_viewer.z),
                weight: specular_reflectance,
                pdf: interface.reflectance,
                is_delta: true,
                eta: 1.0,
            }
        } else {
            let shrink = interface.inverse_eta;
            BsdfSample {
                to_light: DVec3::new(-shrink * to_viewer.x, -shrink * to_viewer.y, interface.cos_transmitted),
                weight: specular_transmittance * (shrink * shrink),
                pdf: 1.0 - interface.reflectance,
                is_delta: true,
                eta: interface.eta,
            }
        };
        (sample.to_light.z != 0.0).then_some(sample)
    }
}

/// A rough interface: facets that each reflect and refract as a smooth one (Walter et al. 2007).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RoughDielectric {
    pub(super) glass: Glass,
    pub(super) facets: Microfacets,
}

impl RoughDielectric {
    /// Walter et al. 2007, eqs. 20 and 21, the latter by 1/eta² for radiance.
    pub(super) fn eval(&self, to_viewer: DVec3, to_light: DVec3) -> BsdfValue {
        let sides = to_viewer.z * to_light.z;
        if !(sides != 0.0 && sides.is_finite()) {
            return BsdfValue::BLACK;
        }
        let half =
            if sides > 0.0 { to_viewer + to_light } else { to_viewer + to_light * self.eta_from(to_viewer) };
        let Some(m) = half.try_normalize() else { return BsdfValue::BLACK };
        let m = if m.z < 0.0 { -m } else { m };
        let interface = fresnel::dielectric(to_viewer.dot(m), self.glass.eta);
        let (weight, pdf) = self.weight_and_pdf(to_viewer, to_light, m, &interface);
        if !(pdf > 0.0 && pdf.is_finite()) {
            return BsdfValue::BLACK;
        }
        BsdfValue { value: weight * pdf, pdf }
    }

    /// Draws a facet that the viewer sees, which reflects with the probability that light does, or refracts.
    pub(super) fn sample(&self, to_viewer: DVec3, choice: f64, u: DVec2) -> Option<BsdfSample> {
        if !(to_viewer.z != 0.0 && to_viewer.is_finite()) {
            return None;
        }
        // the same facets are seen from below
        let above = if to_viewer.z > 0.0 { to_viewer } else { -to_viewer };
        let m = self.facets.sample_visible(above, u);
        let interface = fresnel::dielectric(to_viewer.dot(m), self.glass.eta);
        let reflects = choice < interface.reflectance;
        let to_light = if reflects {
            fresnel::reflect(to_viewer, m)
        } else {
            fresnel::refract(to_viewer, m, &interface)
        };
        if (to_viewer.z * to_light.z > 0.0) != reflects {
            return None;
        }
        let (weight, pdf) = self.weight_and_pdf(to_viewer, to_light, m, &interface);
        let eta = if reflects { 1.0 } else { interface.eta };
        (pdf > 0.0 && pdf.is_finite()).then_some(BsdfSample { to_light, weight, pdf, is_delta: false, eta })
    }

    /// Value over density, and density.
    fn weight_and_pdf(
        &self,
        to_viewer: DVec3,
        to_light: DVec3,
        m: DVec3,
        interface: &fresnel::Interface,
    ) -> (DVec3, f64) {
        let (viewer_m, light_m) = (to_viewer.dot(m), to_light.dot(m));
        let seen = self.facets.density(m) * self.facets.masking(to_viewer, m);
        let lit = self.facets.masking(to_light, m);
        // what would come out on the wrong side is not drawn
        let seen = if lit > 0.0 { seen } else { 0.0 };
        if to_viewer.z * to_light.z > 0.0 {
            let pdf = interface.reflectance * seen / (4.0 * to_viewer.z.abs());
            return (self.glass.specular_reflectance * lit, pdf);
        }
        let sum = viewer_m + interface.eta * light_m;
        let jacobian = interface.eta * interface.eta * light_m.abs() / (sum * sum);
        let pdf = (1.0 - interface.reflectance) * seen * viewer_m.abs() / to_viewer.z.abs() * jacobian;
        let shrink = interface.inverse_eta * interface.inverse_eta;
        (self.glass.specular_transmittance * (shrink * lit), pdf)
    }

    /// Index of refraction of the far side over that of the viewer's.
    fn eta_from(&self, to_viewer: DVec3) -> f64 {
        if to_viewer.z > 0.0 { self.glass.eta } else { 1.0 / self.glass.eta }
    }
}
