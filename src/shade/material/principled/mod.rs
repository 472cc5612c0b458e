//! Disney's material of many parameters (Burley 2012 and 2015), as Mitsuba has it.

mod lobes;

use glam::{DVec2, DVec3};

use super::prepared::{MaterialError, Textures};
use super::refractive_index::is_index;
use super::{Material, MaterialKind, MaterialSettings, Model, Prepared, SIDES, read_colour, read_sides};
use crate::shade::parameters::{Parameter, ParameterSource, Parameters, TextureRange};
use crate::shade::texture::{Texture, TextureSource};

pub(super) use self::lobes::{Parameters as PrincipledParameters, Principled};

const KEYS: &[&str] = &[
    "base_color",
    "roughness",
    "anisotropic",
    "metallic",
    "spec_trans",
    "eta",
    "specular",
    "spec_tint",
    "sheen",
    "sheen_tint",
    "flatness",
    "clearcoat",
    "clearcoat_gloss",
];

/// Mitsuba's `principled`.
pub(super) const KIND: MaterialKind = MaterialKind {
    name: "principled",
    keys: &[KEYS, SIDES],
    read: |source| Some(Material::Principled(Box::new(PrincipledSource::read(source)))),
};

/// The parameters of Disney's model.
#[derive(Clone, Debug, PartialEq)]
pub struct PrincipledSource {
    /// The colour.
    pub base_color: TextureSource,
    /// Square root of the main reflection's roughness.
    pub roughness: TextureSource,
    /// How far the roughness differs along and across the texture coordinate u.
    pub anisotropic: TextureSource,
    /// Weight of a metal.
    pub metallic: TextureSource,
    /// Weight of transmission, against a diffuse base.
    pub spec_trans: TextureSource,
    /// The interface.
    pub interface: PrincipledInterface,
    /// Weight of the base colour in the main reflection.
    pub spec_tint: TextureSource,
    /// Weight of the reflection at grazing angles, as of cloth.
    pub sheen: TextureSource,
    /// Weight of the base colour in the sheen.
    pub sheen_tint: TextureSource,
    /// Weight of the look of light that scatters below the surface.
    pub flatness: TextureSource,
    /// Weight of a clear coat.
    pub clearcoat: TextureSource,
    /// How sharp the clear coat reflects.
    pub clearcoat_gloss: TextureSource,
    /// Whether both sides reflect; only without transmission.
    pub two_sided: bool,
}

impl Default for PrincipledSource {
    fn default() -> Self {
        let (zero, half) = (|| TextureSource::from(0.0), || TextureSource::from(0.5));
        Self {
            base_color: half(),
            roughness: half(),
            anisotropic: zero(),
            metallic: zero(),
            spec_trans: zero(),
            interface: PrincipledInterface::Specular(0.5),
            spec_tint: zero(),
            sheen: zero(),
            sheen_tint: zero(),
            flatness: zero(),
            clearcoat: zero(),
            clearcoat_gloss: zero(),
            two_sided: true,
        }
    }
}

/// The main reflection of Disney's model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PrincipledInterface {
    /// By the index of refraction.
    Eta(f64),
    /// By the share of light at normal incidence, of which 1 is 8 %.
    Specular(f64),
}

impl PrincipledSource {
    /// The index of refraction. With transmission it is not quite 1, as in Mitsuba.
    pub(super) fn eta(&self) -> f64 {
        let transmits = !self.spec_trans.is_zero();
        match self.interface {
            PrincipledInterface::Eta(1.0) if transmits => 1.001,
            PrincipledInterface::Eta(eta) => eta,
            PrincipledInterface::Specular(specular) => {
                let specular = if transmits && specular == 0.0 { 1e-3 } else { specular };
                2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0
            }
        }
    }

    fn read(source: &dyn ParameterSource) -> Self {
        let default = Self::default();
        let share = |key, default| source.texture(key, TextureRange::Share).unwrap_or(default);
        let eta = source.number("eta", "a number above 0", &is_index);
        let specular =
            source.number("specular", "a number in [0, 1]", &|specular| (0.0..=1.0).contains(&specular));
        if source.has("eta") && source.has("specular") {
            let message = "specular cannot stand beside eta: it stands for one";
            source.report_key("specular", message.to_owned());
        }
        let spec_trans = share("spec_trans", default.spec_trans);
        let (two_sided, opaque) = (read_sides(source), spec_trans.is_zero());
        if two_sided == Some(true) && !opaque {
            let message = "a material that transmits light (spec_trans) is never two_sided";
            source.report_value("two_sided", message.to_owned());
        }
        Self {
            base_color: read_colour(source, "base_color", default.base_color),
            roughness: share("roughness", default.roughness),
            anisotropic: share("anisotropic", default.anisotropic),
            metallic: share("metallic", default.metallic),
            spec_trans,
            interface: eta
                .map(PrincipledInterface::Eta)
                .or(specular.map(PrincipledInterface::Specular))
                .unwrap_or(default.interface),
            spec_tint: share("spec_tint", default.spec_tint),
            sheen: share("sheen", default.sheen),
            sheen_tint: share("sheen_tint", default.sheen_tint),
            flatness: share("flatness", default.flatness),
            clearcoat: share("clearcoat", default.clearcoat),
            clearcoat_gloss: share("clearcoat_gloss", default.clearcoat_gloss),
            two_sided: two_sided.unwrap_or(opaque),
        }
    }

    /// The parameters that are numbers in `[0, 1]`, with their names.
    const fn shares(&self) -> [(&'static str, &TextureSource); 10] {
        [
            ("roughness", &self.roughness),
            ("anisotropic", &self.anisotropic),
            ("metallic", &self.metallic),
            ("spec_trans", &self.spec_trans),
            ("spec_tint", &self.spec_tint),
            ("sheen", &self.sheen),
            ("sheen_tint", &self.sheen_tint),
            ("flatness", &self.flatness),
            ("clearcoat", &self.clearcoat),
            ("clearcoat_gloss", &self.clearcoat_gloss),
        ]
    }
}

impl MaterialSettings for PrincipledSource {
    fn kind(&self) -> &'static str {
        KIND.name
    }

    fn parameters(&self) -> Parameters<'_> {
        let interface = match self.interface {
            PrincipledInterface::Eta(eta) => ("eta", Parameter::Number(eta)),
            PrincipledInterface::Specular(specular) => ("specular", Parameter::Number(specular)),
        };
        let mut parameters = vec![interface, ("base_color", Parameter::ColourTexture(&self.base_color))];
        parameters.extend(self.shares().map(|(name, share)| (name, Parameter::NumberTexture(share))));
        parameters
    }

    /// Mitsuba makes room for a lobe whose parameter is given, be it 0.
    fn mitsuba_parameters(&self) -> Parameters<'_> {
        let mut parameters = self.parameters();
        parameters.retain(|(_, value)| !matches!(value, Parameter::NumberTexture(share) if share.is_zero()));
        parameters
    }

    fn two_sided(&self) -> Option<bool> {
        Some(self.two_sided)
    }

    fn prepare(&self, textures: &mut Textures) -> Result<Box<dyn Prepared>, MaterialError> {
        let base_color = textures.read(&self.base_color)?;
        let shares = self.shares().into_iter().map(|(_, share)| textures.read(share));
        let shares = shares.collect::<Result<Vec<Texture>, _>>()?;
        let shares = shares.try_into().expect("as many as there were");
        Ok(Box::new(PreparedPrincipled { base_color, shares, eta: self.eta() }))
    }
}

#[derive(Debug)]
struct PreparedPrincipled {
    base_color: Texture,
    /// In the order of [`PrincipledSource::shares`].
    shares: [Texture; 10],
    eta: f64,
}

impl Prepared for PreparedPrincipled {
    fn model(&self, uv: DVec2) -> Model<'_> {
        let shares = self.shares.each_ref().map(|share| share.number(uv));
        let [
            roughness,
            anisotropic,
            metallic,
            spec_trans,
            spec_tint,
            sheen,
            sheen_tint,
            flatness,
            clearcoat,
            clearcoat_gloss,
        ] = shares;
        Model::Principled(Principled::new(PrincipledParameters {
            base_color: self.base_color.colour(uv),
            eta: self.eta,
            roughness,
            anisotropic,
            metallic,
            spec_trans,
            spec_tint,
            sheen,
            sheen_tint,
            flatness,
            clearcoat,
            clearcoat_gloss,
        }))
    }

    fn diffuse_colour(&self, uv: DVec2) -> Option<DVec3> {
        Some(self.base_color.colour(uv))
    }
}
