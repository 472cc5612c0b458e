//! Roughness along and across a surface, as rough metals and glass have it.

use glam::DVec2;

use super::microfacet::{MicrofacetDistribution, Microfacets};
use super::prepared::{MaterialError, Textures};
use crate::choice::Choice;
use crate::shade::parameters::{Parameter, ParameterSource, Parameters, TextureRange, choice};
use crate::shade::texture::{Texture, TextureSource};

/// Roughness where none is given.
pub const DEFAULT_ALPHA: f64 = 0.1;

pub(super) const ROUGHNESS_KEYS: &[&str] = &["distribution", "alpha", "alpha_u", "alpha_v"];

/// The roughness of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Roughness {
    /// How its normals are spread.
    pub distribution: MicrofacetDistribution,
    /// Along the texture coordinate u; of a Beckmann distribution √2 times the root mean square slope.
    pub alpha_u: TextureSource,
    /// The same across.
    pub alpha_v: TextureSource,
}

impl Default for Roughness {
    fn default() -> Self {
        let alpha = TextureSource::from(DEFAULT_ALPHA);
        Self { distribution: MicrofacetDistribution::default(), alpha_u: alpha.clone(), alpha_v: alpha }
    }
}

impl Roughness {
    pub(super) fn read(source: &dyn ParameterSource) -> Self {
        let default = Self::default();
        let both = source.texture("alpha", TextureRange::Roughness);
        let [u, v] = ["alpha_u", "alpha_v"].map(|key| source.texture(key, TextureRange::Roughness));
        match ["alpha", "alpha_u", "alpha_v"].map(|key| source.has(key)) {
            [true, true, _] | [true, _, true] => {
                source.report_key("alpha", "alpha cannot stand beside alpha_u and alpha_v".to_owned());
            }
            [_, true, false] => source.report_key("alpha_u", "alpha_u needs alpha_v beside it".to_owned()),
            [_, false, true] => source.report_key("alpha_v", "alpha_v needs alpha_u beside it".to_owned()),
            _ => {}
        }
        Self {
            distribution: choice(source, "distribution").unwrap_or_default(),
            alpha_u: u.or_else(|| both.clone()).unwrap_or(default.alpha_u),
            alpha_v: v.or(both).unwrap_or(default.alpha_v),
        }
    }

    pub(super) fn parameters(&self) -> Parameters<'_> {
        vec![
            ("distribution", Parameter::Name(self.distribution.name())),
            ("alpha_u", Parameter::NumberTexture(&self.alpha_u)),
            ("alpha_v", Parameter::NumberTexture(&self.alpha_v)),
        ]
    }
}

/// Roughness with its textures read.
#[derive(Debug)]
pub(super) struct PreparedRoughness {
    distribution: MicrofacetDistribution,
    alpha_u: Texture,
    alpha_v: Texture,
}

impl PreparedRoughness {
    pub(super) fn try_new(source: &Roughness, textures: &mut Textures) -> Result<Self, MaterialError> {
        let Roughness { distribution, alpha_u, alpha_v } = source;
        let [alpha_u, alpha_v] = [textures.read(alpha_u)?, textures.read(alpha_v)?];
        Ok(Self { distribution: *distribution, alpha_u, alpha_v })
    }

    pub(super) fn at(&self, uv: DVec2) -> Microfacets {
        Microfacets::new(self.distribution, DVec2::new(self.alpha_u.number(uv), self.alpha_v.number(uv)))
    }
}
