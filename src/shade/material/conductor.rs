//! Metals, and mirrors.

use glam::{DVec2, DVec3};

use super::bsdf::{BsdfSample, BsdfValue, is_above};
use super::fresnel;
use super::metals::{METAL_NAMES, metal};
use super::microfacet::Microfacets;
use super::prepared::{MaterialError, Textures};
use super::roughness::{PreparedRoughness, ROUGHNESS_KEYS, Roughness};
use super::{Material, MaterialKind, MaterialSettings, Model, Prepared, SIDES, read_colour, read_sides};
use crate::shade::parameters::{Parameter, ParameterSource, Parameters};
use crate::shade::texture::{Texture, TextureSource};

const METAL_KEYS: &[&str] = &["material", "eta", "k", "specular_reflectance"];

/// Mitsuba's `conductor`.
pub(super) const KIND: MaterialKind = MaterialKind {
    name: "conductor",
    keys: &[METAL_KEYS, SIDES],
    read: |source| {
        Some(Material::Conductor(ConductorSource {
            metal: MetalSource::read(source),
            two_sided: read_sides(source).unwrap_or(true),
        }))
    },
};

/// Mitsuba's `roughconductor`.
pub(super) const ROUGH_KIND: MaterialKind = MaterialKind {
    name: "roughconductor",
    keys: &[METAL_KEYS, ROUGHNESS_KEYS, SIDES],
    read: |source| {
        Some(Material::RoughConductor(RoughConductorSource {
            metal: MetalSource::read(source),
            roughness: Roughness::read(source),
            two_sided: read_sides(source).unwrap_or(true),
        }))
    },
};

/// A smooth metal or mirror.
#[derive(Clone, Debug, PartialEq)]
pub struct ConductorSource {
    /// The metal.
    pub metal: MetalSource,
    /// Whether both sides reflect.
    pub two_sided: bool,
}

/// A rough metal.
#[derive(Clone, Debug, PartialEq)]
pub struct RoughConductorSource {
    /// The metal.
    pub metal: MetalSource,
    /// Its roughness.
    pub roughness: Roughness,
    /// Whether both sides reflect.
    pub two_sided: bool,
}

/// The optics of a conductor.
#[derive(Clone, Debug, PartialEq)]
pub struct MetalSource {
    /// Real part of the index of refraction.
    pub eta: DVec3,
    /// Its imaginary part, the absorption.
    pub k: DVec3,
    /// Factor of all that is reflected.
    pub specular_reflectance: TextureSource,
}

impl MetalSource {
    /// One of the named materials.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let [eta, k] = metal(name)?;
        Some(Self { eta, k, specular_reflectance: TextureSource::from(1.0) })
    }

    fn read(source: &dyn ParameterSource) -> Self {
        let index = source.name("material", "metal", &METAL_NAMES);
        let name = index.map_or("none", |index| METAL_NAMES[index]);
        let named = Self::named(name).unwrap_or_default();
        let index = |key| {
            let given = source.colour(key, "a number or [r, g, b], each at least 0", &|index| index >= 0.0);
            if name != "none" && source.has(key) {
                let message = format!("{key} cannot stand beside material: the name stands for eta and k");
                source.report_key(key, message);
            }
            given
        };
        Self {
            eta: index("eta").unwrap_or(named.eta),
            k: index("k").unwrap_or(named.k),
            specular_reflectance: read_colour(source, "specular_reflectance", named.specular_reflectance),
        }
    }

    fn parameters(&self) -> Parameters<'_> {
        vec![
            ("eta", Parameter::Colour(self.eta)),
            ("k", Parameter::Colour(self.k)),
            ("specular_reflectance", Parameter::ColourTexture(&self.specular_reflectance)),
        ]
    }

    /// A perfect mirror has no indices of refraction in Mitsuba.
    fn mitsuba_parameters(&self) -> Parameters<'_> {
        let mirror = Self::default();
        let mut parameters = self.parameters();
        if (self.eta, self.k) == (mirror.eta, mirror.k) {
            parameters.splice(..2, [("material", Parameter::Name("none"))]);
        }
        parameters
    }
}

impl Default for MetalSource {
    /// A perfect mirror.
    fn default() -> Self {
        Self { eta: DVec3::ZERO, k: DVec3::ONE, specular_reflectance: TextureSource::from(1.0) }
    }
}

impl MaterialSettings for ConductorSource {
    fn kind(&self) -> &'static str {
        KIND.name
    }

    fn parameters(&self) -> Parameters<'_> {
        self.metal.parameters()
    }

    fn mitsuba_parameters(&self) -> Parameters<'_> {
        self.metal.mitsuba_parameters()
    }

    fn two_sided(&self) -> Option<bool> {
        Some(self.two_sided)
    }

    fn prepare(&self, textures: &mut Textures) -> Result<Box<dyn Prepared>, MaterialError> {
        Ok(Box::new(PreparedConductor(PreparedMetal::try_new(&self.metal, textures)?)))
    }
}

impl MaterialSettings for RoughConductorSource {
    fn kind(&self) -> &'static str {
        ROUGH_KIND.name
    }

    fn parameters(&self) -> Parameters<'_> {
        [self.metal.parameters(), self.roughness.parameters()].concat()
    }

    fn mitsuba_parameters(&self) -> Parameters<'_> {
        [self.metal.mitsuba_parameters(), self.roughness.parameters()].concat()
    }

    fn two_sided(&self) -> Option<bool> {
        Some(self.two_sided)
    }

    fn prepare(&self, textures: &mut Textures) -> Result<Box<dyn Prepared>, MaterialError> {
        let metal = PreparedMetal::try_new(&self.metal, textures)?;
        let roughness = PreparedRoughness::try_new(&self.roughness, textures)?;
        Ok(Box::new(PreparedRoughConductor { metal, roughness }))
    }
}

#[derive(Debug)]
struct PreparedMetal {
    eta: DVec3,
    k: DVec3,
    specular_reflectance: Texture,
}

impl PreparedMetal {
    fn try_new(source: &MetalSource, textures: &mut Textures) -> Result<Self, MaterialError> {
        let specular_reflectance = textures.read(&source.specular_reflectance)?;
        Ok(Self { eta: source.eta, k: source.k, specular_reflectance })
    }

    fn at(&self, uv: DVec2) -> Metal {
        Metal { eta: self.eta, k: self.k, specular_reflectance: self.specular_reflectance.colour(uv) }
    }
}

#[derive(Debug)]
struct PreparedConductor(PreparedMetal);

impl Prepared for PreparedConductor {
    fn model(&self, uv: DVec2) -> Model<'_> {
        Model::Conductor(Conductor(self.0.at(uv)))
    }
}

#[derive(Debug)]
struct PreparedRoughConductor {
    metal: PreparedMetal,
    roughness: PreparedRoughness,
}

impl Prepared for PreparedRoughConductor {
    fn model(&self, uv: DVec2) -> Model<'_> {
        Model::RoughConductor(RoughConductor { metal: self.metal.at(uv), facets: self.roughness.at(uv) })
    }
}

/// What a conductor reflects at an angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Metal {
    /// Real part of the index of refraction.
    pub(super) eta: DVec3,
    /// Its imaginary part, the absorption.
    pub(super) k: DVec3,
    /// Factor of all that is reflected.
    pub(super) specular_reflectance: DVec3,
}

impl Metal {
    fn reflectance(&self, cos: f64) -> DVec3 {
        fresnel::conductor(cos, self.eta, self.k) * self.specular_reflectance
    }
}

/// A smooth conductor: reflects in one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Conductor(pub(super) Metal);

impl Conductor {
    pub(super) fn sample(&self, to_viewer: DVec3) -> Option<BsdfSample> {
        is_above(to_viewer).then(|| BsdfSample {
            to_light: DVec3::new(-to_viewer.x, -to_viewer.y, to_viewer.z),
            weight: self.0.reflectance(to_viewer.z),
            pdf: 1.0,
            is_delta: true,
            eta: 1.0,
        })
    }
}

/// A rough conductor: facets that each reflect as a smooth one (Walter et al. 2007).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RoughConductor {
    pub(super) metal: Metal,
    pub(super) facets: Microfacets,
}

impl RoughConductor {
    /// F D G / (4 cos(viewer)), as the cosine of the light cancels (Walter et al. 2007, eq. 20).
    pub(super) fn eval(&self, to_viewer: DVec3, to_light: DVec3) -> BsdfValue {
        if !(is_above(to_viewer) && is_above(to_light)) {
            return BsdfValue::BLACK;
        }
        let m = (to_viewer + to_light).normalize();
        let pdf = self.pdf(to_viewer, m);
        if pdf > 0.0 {
            BsdfValue { value: self.weight(to_viewer, to_light, m) * pdf, pdf }
        } else {
            BsdfValue::BLACK
        }
    }

    /// Draws a facet that the viewer sees, and reflects.
    pub(super) fn sample(&self, to_viewer: DVec3, u: DVec2) -> Option<BsdfSample> {
        if !is_above(to_viewer) {
            return None;
        }
        let m = self.facets.sample_visible(to_viewer, u);
        let to_light = fresnel::reflect(to_viewer, m);
        let pdf = self.pdf(to_viewer, m);
        let weight = self.weight(to_viewer, to_light, m);
        (is_above(to_light) && pdf > 0.0).then_some(BsdfSample {
            to_light,
            weight,
            pdf,
            is_delta: false,
            eta: 1.0,
        })
    }

    /// The facets' density and the Jacobian 1 / (4 viewer·m) of reflection.
    fn pdf(&self, to_viewer: DVec3, m: DVec3) -> f64 {
        self.facets.density(m) * self.facets.masking(to_viewer, m) / (4.0 * to_viewer.z)
    }

    fn weight(&self, to_viewer: DVec3, to_light: DVec3, m: DVec3) -> DVec3 {
        self.metal.reflectance(to_viewer.dot(m)) * self.facets.masking(to_light, m)
    }
}
