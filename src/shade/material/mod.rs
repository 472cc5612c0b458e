//! Materials: Mitsuba's, by its names and with its defaults.
//!
//! Each is in a file of its own: its parameters, how they are read, and what it does to light. To add one, write such a file,
//! and list it here in [`Material`], in [`KINDS`](Material::kinds) and in `Model`.
//!
//! Directions point away from the surface and have length 1. Within the models they are in the shading frame, whose z axis is
//! the shading normal. Colours are linear RGB, and like all parameters but indices of refraction and roughness in `[0, 1]`.

mod bsdf;
mod conductor;
mod dielectric;
mod diffuse;
mod fresnel;
mod metals;
mod microfacet;
mod object_materials;
mod plastic;
mod prepared;
mod principled;
mod quadrature;
mod refractive_index;
mod roughness;
#[cfg(test)]
mod tests;

use std::fmt::Debug;

use glam::{DVec2, DVec3};

use self::conductor::{Conductor, RoughConductor};
use self::dielectric::{Dielectric, RoughDielectric};
use self::diffuse::Diffuse;
use self::plastic::{Plastic, RoughPlastic};
use self::prepared::Textures;
use self::principled::Principled;
use super::parameters::{Parameter, ParameterSource, Parameters, TextureRange};
use super::texture::TextureSource;

pub use bsdf::{BsdfSample, BsdfValue};
pub use conductor::{ConductorSource, MetalSource, RoughConductorSource};
pub use dielectric::{DielectricSource, GlassSource, RoughDielectricSource};
pub use diffuse::DiffuseSource;
pub use metals::{METAL_NAMES, metal};
pub use microfacet::MicrofacetDistribution;
pub use object_materials::ObjectMaterials;
pub use plastic::{CoatSource, PlasticSource, RoughPlasticSource};
pub use prepared::{Bsdf, MaterialError, PreparedMaterial};
pub use principled::{PrincipledInterface, PrincipledSource};
pub use refractive_index::{REFRACTIVE_INDICES, refractive_index};
pub use roughness::{DEFAULT_ALPHA, Roughness};

/// A material as the scene file gives it.
///
/// One that is two-sided does on the side that the normal turns away from what it does on the other; it is black there
/// otherwise.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// Lambertian reflection.
    Diffuse(DiffuseSource),
    /// A smooth metal or mirror.
    Conductor(ConductorSource),
    /// A rough metal.
    RoughConductor(RoughConductorSource),
    /// A clear interface between two media.
    Dielectric(DielectricSource),
    /// A rough interface between two media.
    RoughDielectric(RoughDielectricSource),
    /// A diffuse base under a smooth coat.
    Plastic(PlasticSource),
    /// A diffuse base under a rough coat.
    RoughPlastic(RoughPlasticSource),
    /// Disney's model of many lobes.
    Principled(Box<PrincipledSource>),
}

/// The kinds of material, in the order that messages list them.
const KINDS: &[MaterialKind] = &[
    diffuse::KIND,
    conductor::KIND,
    conductor::ROUGH_KIND,
    dielectric::KIND,
    dielectric::ROUGH_KIND,
    plastic::KIND,
    plastic::ROUGH_KIND,
    principled::KIND,
];

/// A kind of material.
#[derive(Clone, Copy, Debug)]
pub struct MaterialKind {
    /// Its name in scene files.
    pub name: &'static str,
    /// The names of its parameters.
    keys: &'static [&'static [&'static str]],
    /// Reads the parameters; only faults that the source is told of make it none.
    pub read: fn(&dyn ParameterSource) -> Option<Material>,
}

impl MaterialKind {
    /// The names of its parameters.
    #[must_use]
    pub fn keys(&self) -> Vec<&'static str> {
        self.keys.concat()
    }
}

/// What all materials have.
trait MaterialSettings {
    /// The material's name in scene files.
    fn kind(&self) -> &'static str;

    /// All parameters but `two_sided`.
    fn parameters(&self) -> Parameters<'_>;

    /// The parameters as Mitsuba must have them.
    fn mitsuba_parameters(&self) -> Parameters<'_> {
        self.parameters()
    }

    /// Whether both sides reflect; none of a material that light passes through.
    fn two_sided(&self) -> Option<bool>;

    /// Reads the textures, in the order of the parameters, and computes tables.
    fn prepare(&self, textures: &mut Textures) -> Result<Box<dyn Prepared>, MaterialError>;
}

/// A material with its textures read.
trait Prepared: Debug + Send + Sync {
    /// The model at a point's texture coordinates.
    fn model(&self, uv: DVec2) -> Model<'_>;

    /// The diffuse colour there, if the material has one.
    fn diffuse_colour(&self, _uv: DVec2) -> Option<DVec3> {
        None
    }
}

impl Default for Material {
    fn default() -> Self {
        Self::Diffuse(DiffuseSource::default())
    }
}

impl Material {
    /// All kinds, in the order that messages list them.
    #[must_use]
    pub const fn kinds() -> &'static [MaterialKind] {
        KINDS
    }

    fn settings(&self) -> &dyn MaterialSettings {
        match self {
            Self::Diffuse(source) => source,
            Self::Conductor(source) => source,
            Self::RoughConductor(source) => source,
            Self::Dielectric(source) => source,
            Self::RoughDielectric(source) => source,
            Self::Plastic(source) => source,
            Self::RoughPlastic(source) => source,
            Self::Principled(source) => &**source,
        }
    }

    /// Its name in scene files.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        self.settings().kind()
    }

    /// All parameters but `two_sided`.
    #[must_use]
    pub fn parameters(&self) -> Parameters<'_> {
        self.settings().parameters()
    }

    /// The parameters as Mitsuba must have them, where they differ from [`Self::parameters`].
    #[must_use]
    pub fn mitsuba_parameters(&self) -> Parameters<'_> {
        self.settings().mitsuba_parameters()
    }

    /// Whether both sides reflect; none of a material that light passes through.
    #[must_use]
    pub fn two_sided(&self) -> Option<bool> {
        self.settings().two_sided()
    }

    /// The colour of its first texture, if that is the same everywhere: what programs show that know one colour for a part.
    #[must_use]
    pub fn uniform_colour(&self) -> Option<DVec3> {
        let colours = self.parameters().into_iter().filter_map(|(_, parameter)| match parameter {
            Parameter::ColourTexture(texture) => Some(texture),
            _ => None,
        });
        match colours.into_iter().next() {
            Some(&TextureSource::Uniform(colour)) => Some(colour),
            _ => None,
        }
    }

    /// All its textures, in the order of its parameters.
    #[must_use]
    pub fn textures(&self) -> Vec<&TextureSource> {
        let parameters = self.parameters().into_iter();
        let textures = parameters.filter_map(|(_, parameter)| match parameter {
            Parameter::ColourTexture(texture) | Parameter::NumberTexture(texture) => Some(texture),
            _ => None,
        });
        textures.collect()
    }

    /// Whether it needs texture coordinates.
    #[must_use]
    pub fn is_textured(&self) -> bool {
        self.textures().into_iter().any(TextureSource::varies)
    }
}

/// The model of a material at one point, its parameters looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Model<'a> {
    Diffuse(Diffuse),
    Conductor(Conductor),
    RoughConductor(RoughConductor),
    Dielectric(Dielectric),
    RoughDielectric(RoughDielectric),
    Plastic(Plastic),
    RoughPlastic(RoughPlastic<'a>),
    Principled(Principled),
}

impl Model<'_> {
    fn eval(&self, to_viewer: DVec3, to_light: DVec3) -> BsdfValue {
        match self {
            Self::Diffuse(diffuse) => diffuse.eval(to_viewer, to_light),
            Self::Conductor(_) | Self::Dielectric(_) => BsdfValue::BLACK,
            Self::RoughConductor(conductor) => conductor.eval(to_viewer, to_light),
            Self::RoughDielectric(dielectric) => dielectric.eval(to_viewer, to_light),
            Self::Plastic(plastic) => plastic.eval(to_viewer, to_light),
            Self::RoughPlastic(plastic) => plastic.eval(to_viewer, to_light),
            Self::Principled(principled) => principled.eval(to_viewer, to_light),
        }
    }

    fn sample(&self, to_viewer: DVec3, choice: f64, u: DVec2) -> Option<BsdfSample> {
        match self {
            Self::Diffuse(diffuse) => diffuse.sample(to_viewer, u),
            Self::Conductor(conductor) => conductor.sample(to_viewer),
            Self::RoughConductor(conductor) => conductor.sample(to_viewer, u),
            Self::Dielectric(dielectric) => dielectric.sample(to_viewer, choice),
            Self::RoughDielectric(dielectric) => dielectric.sample(to_viewer, choice, u),
            Self::Plastic(plastic) => plastic.sample(to_viewer, choice, u),
            Self::RoughPlastic(plastic) => plastic.sample(to_viewer, choice, u),
            Self::Principled(principled) => principled.sample(to_viewer, choice, u),
        }
    }

    const fn has_smooth_part(&self) -> bool {
        !matches!(self, Self::Conductor(_) | Self::Dielectric(_))
    }
}

/// The parameter of materials that reflect on one side or on both.
const SIDES: &[&str] = &["two_sided"];

/// Whether both sides reflect.
fn read_sides(source: &dyn ParameterSource) -> Option<bool> {
    source.flag("two_sided")
}

/// A colour in `[0, 1]`, or its default.
fn read_colour(source: &dyn ParameterSource, key: &str, default: TextureSource) -> TextureSource {
    source.texture(key, TextureRange::Colour).unwrap_or(default)
}
