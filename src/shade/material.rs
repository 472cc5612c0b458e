//! Materials as the scene file gives them: Mitsuba's, by its names and with its defaults.

use glam::DVec3;

use super::bsdf::{MicrofacetDistribution, metal, refractive_index};
use super::texture::TextureSource;

/// A material as the scene file gives it.
///
/// One with `two_sided` does on the side that the normal turns away from what it does on the other; it is black there
/// otherwise. Colours are linear RGB, and like all parameters but indices of refraction and roughness in `[0, 1]`.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// Lambertian reflection.
    Diffuse {
        /// Share of light that is reflected.
        reflectance: TextureSource,
        /// Whether both sides reflect.
        two_sided: bool,
    },
    /// A smooth metal or mirror.
    Conductor {
        /// The metal.
        metal: MetalSource,
        /// Whether both sides reflect.
        two_sided: bool,
    },
    /// A rough metal.
    RoughConductor {
        /// The metal.
        metal: MetalSource,
        /// Its roughness.
        roughness: Roughness,
        /// Whether both sides reflect.
        two_sided: bool,
    },
    /// A clear interface between two media.
    Dielectric {
        /// The media.
        glass: GlassSource,
    },
    /// A rough interface between two media.
    RoughDielectric {
        /// The media, of different indices of refraction.
        glass: GlassSource,
        /// Its roughness.
        roughness: Roughness,
    },
    /// A diffuse base under a smooth coat.
    Plastic {
        /// The coat and the base.
        coat: CoatSource,
        /// Whether both sides reflect.
        two_sided: bool,
    },
    /// A diffuse base under a rough coat.
    RoughPlastic {
        /// The coat and the base, of different indices of refraction.
        coat: CoatSource,
        /// How the coat's normals are spread.
        distribution: MicrofacetDistribution,
        /// The coat's roughness.
        alpha: f64,
        /// Whether both sides reflect.
        two_sided: bool,
    },
    /// Disney's model of many lobes.
    Principled(Box<PrincipledSource>),
}

impl Default for Material {
    fn default() -> Self {
        Self::Diffuse { reflectance: TextureSource::from(0.5), two_sided: true }
    }
}

/// A conductor.
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
}

impl Default for MetalSource {
    /// A perfect mirror.
    fn default() -> Self {
        Self { eta: DVec3::ZERO, k: DVec3::ONE, specular_reflectance: TextureSource::from(1.0) }
    }
}

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

/// Roughness where none is given.
pub const DEFAULT_ALPHA: f64 = 0.1;

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

/// A diffuse base under a transparent coat.
#[derive(Clone, Debug, PartialEq)]
pub struct CoatSource {
    /// Index of refraction of the coat.
    pub int_ior: f64,
    /// Index of refraction outside.
    pub ext_ior: f64,
    /// Colour of the base.
    pub diffuse_reflectance: TextureSource,
    /// Factor of what the coat reflects.
    pub specular_reflectance: TextureSource,
    /// Whether light that the coat reflects back to the base takes the base's colour again each time.
    pub nonlinear: bool,
}

impl Default for CoatSource {
    fn default() -> Self {
        Self {
            int_ior: named_index("polypropylene"),
            ext_ior: named_index("air"),
            diffuse_reflectance: TextureSource::from(0.5),
            specular_reflectance: TextureSource::from(1.0),
            nonlinear: false,
        }
    }
}

/// The index of a name known to be in the table.
fn named_index(name: &str) -> f64 {
    refractive_index(name).unwrap_or(f64::NAN)
}

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
}

impl Material {
    /// All its textures, in the order of its parameters.
    #[must_use]
    pub fn textures(&self) -> Vec<&TextureSource> {
        match self {
            Self::Diffuse { reflectance, .. } => vec![reflectance],
            Self::Conductor { metal, .. } => vec![&metal.specular_reflectance],
            Self::RoughConductor { metal, roughness, .. } => {
                vec![&metal.specular_reflectance, &roughness.alpha_u, &roughness.alpha_v]
            }
            Self::Dielectric { glass } => vec![&glass.specular_reflectance, &glass.specular_transmittance],
            Self::RoughDielectric { glass, roughness } => vec![
                &glass.specular_reflectance,
                &glass.specular_transmittance,
                &roughness.alpha_u,
                &roughness.alpha_v,
            ],
            Self::Plastic { coat, .. } | Self::RoughPlastic { coat, .. } => {
                vec![&coat.diffuse_reflectance, &coat.specular_reflectance]
            }
            Self::Principled(source) => vec![
                &source.base_color,
                &source.roughness,
                &source.anisotropic,
                &source.metallic,
                &source.spec_trans,
                &source.spec_tint,
                &source.sheen,
                &source.sheen_tint,
                &source.flatness,
                &source.clearcoat,
                &source.clearcoat_gloss,
            ],
        }
    }

    /// Whether it needs texture coordinates.
    #[must_use]
    pub fn is_textured(&self) -> bool {
        self.textures().into_iter().any(TextureSource::varies)
    }
}
