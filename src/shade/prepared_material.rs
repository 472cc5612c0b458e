//! Materials ready to be met by rays.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use thiserror::Error;

use super::bsdf::{
    Bsdf, Coat, Conductor, Dielectric, Diffuse, Glass, Metal, MicrofacetDistribution, Microfacets, Model,
    Plastic, Principled, PrincipledParameters, RoughCoat, RoughConductor, RoughDielectric, RoughPlastic,
};
use super::material::{CoatSource, GlassSource, Material, MetalSource, PrincipledSource, Roughness};
use super::texture::Texture;
use crate::film::{Picture, PictureError};
use crate::trace::SurfaceInteraction;

/// Why a material cannot be prepared.
#[derive(Debug, Error)]
pub enum MaterialError {
    /// A texture's picture cannot be read.
    #[error(transparent)]
    Picture(#[from] PictureError),
}

/// A material with its pictures read and its tables computed. Copies share them.
#[derive(Clone, Debug)]
pub struct PreparedMaterial {
    model: Arc<PreparedModel>,
    two_sided: bool,
}

/// [`Model`] with textures for parameters.
#[derive(Debug)]
enum PreparedModel {
    Diffuse(Texture),
    Conductor(PreparedMetal),
    RoughConductor(PreparedMetal, PreparedRoughness),
    Dielectric(PreparedGlass),
    RoughDielectric(PreparedGlass, PreparedRoughness),
    Plastic(PreparedCoat),
    RoughPlastic(PreparedCoat, RoughCoat),
    Principled(Box<PreparedPrincipled>),
}

impl PreparedMaterial {
    /// Reads pictures and computes tables.
    ///
    /// # Errors
    /// If a picture cannot be read.
    pub fn try_new(material: &Material) -> Result<Self, MaterialError> {
        let (model, two_sided) = match material {
            Material::Diffuse { reflectance, two_sided } => {
                (PreparedModel::Diffuse(Texture::try_new(reflectance)?), *two_sided)
            }
            Material::Conductor { metal, two_sided } => {
                (PreparedModel::Conductor(PreparedMetal::try_new(metal)?), *two_sided)
            }
            Material::RoughConductor { metal, roughness, two_sided } => {
                let metal = PreparedMetal::try_new(metal)?;
                (PreparedModel::RoughConductor(metal, PreparedRoughness::try_new(roughness)?), *two_sided)
            }
            Material::Dielectric { glass } => {
                (PreparedModel::Dielectric(PreparedGlass::try_new(glass)?), false)
            }
            Material::RoughDielectric { glass, roughness } => {
                let glass = PreparedGlass::try_new(glass)?;
                (PreparedModel::RoughDielectric(glass, PreparedRoughness::try_new(roughness)?), false)
            }
            Material::Plastic { coat, two_sided } => {
                (PreparedModel::Plastic(PreparedCoat::try_new(coat)?), *two_sided)
            }
            Material::RoughPlastic { coat, distribution, alpha, two_sided } => {
                let coat = PreparedCoat::try_new(coat)?;
                let rough = RoughCoat::new(*distribution, *alpha, coat.eta);
                (PreparedModel::RoughPlastic(coat, rough), *two_sided)
            }
            Material::Principled(source) => {
                (PreparedModel::Principled(Box::new(PreparedPrincipled::try_new(source)?)), source.two_sided)
            }
        };
        Ok(Self { model: Arc::new(model), two_sided })
    }

    /// The material at a point.
    pub fn bsdf(&self, surface: &SurfaceInteraction) -> Bsdf<'_> {
        let uv = surface.uv;
        let model = match &*self.model {
            PreparedModel::Diffuse(reflectance) => {
                Model::Diffuse(Diffuse { reflectance: reflectance.colour(uv) })
            }
            PreparedModel::Conductor(metal) => Model::Conductor(Conductor(metal.at(uv))),
            PreparedModel::RoughConductor(metal, roughness) => {
                Model::RoughConductor(RoughConductor { metal: metal.at(uv), facets: roughness.at(uv) })
            }
            PreparedModel::Dielectric(glass) => Model::Dielectric(Dielectric(glass.at(uv))),
            PreparedModel::RoughDielectric(glass, roughness) => {
                Model::RoughDielectric(RoughDielectric { glass: glass.at(uv), facets: roughness.at(uv) })
            }
            PreparedModel::Plastic(coat) => Model::Plastic(Plastic(coat.at(uv))),
            PreparedModel::RoughPlastic(coat, rough) => {
                Model::RoughPlastic(RoughPlastic { coat: coat.at(uv), rough })
            }
            PreparedModel::Principled(principled) => Model::Principled(principled.at(uv)),
        };
        Bsdf::new(model, self.two_sided, surface)
    }

    /// The `albedo` layer's value at a point, as Mitsuba has it: the diffuse colour; of metals and glass π times what
    /// they send from the normal's direction to the viewer, which is nothing if they are smooth.
    pub fn albedo(&self, surface: &SurfaceInteraction, to_viewer: DVec3) -> DVec3 {
        match &*self.model {
            PreparedModel::Diffuse(colour) => colour.colour(surface.uv),
            PreparedModel::Plastic(coat) | PreparedModel::RoughPlastic(coat, _) => {
                coat.diffuse_reflectance.colour(surface.uv)
            }
            PreparedModel::Principled(principled) => principled.base_color.colour(surface.uv),
            _ => self.bsdf(surface).under_normal_light(to_viewer.normalize()) * PI,
        }
    }

    /// The pictures of its textures, in the order of its parameters.
    pub fn pictures(&self) -> Vec<&Picture> {
        let textures = match &*self.model {
            PreparedModel::Diffuse(reflectance) => vec![reflectance],
            PreparedModel::Conductor(metal) => vec![&metal.specular_reflectance],
            PreparedModel::RoughConductor(metal, roughness) => {
                vec![&metal.specular_reflectance, &roughness.alpha_u, &roughness.alpha_v]
            }
            PreparedModel::Dielectric(glass) => glass.textures().to_vec(),
            PreparedModel::RoughDielectric(glass, roughness) => {
                let [reflectance, transmittance] = glass.textures();
                vec![reflectance, transmittance, &roughness.alpha_u, &roughness.alpha_v]
            }
            PreparedModel::Plastic(coat) | PreparedModel::RoughPlastic(coat, _) => {
                vec![&coat.diffuse_reflectance, &coat.specular_reflectance]
            }
            PreparedModel::Principled(principled) => principled.textures(),
        };
        textures.into_iter().filter_map(Texture::picture).collect()
    }
}

#[derive(Debug)]
struct PreparedMetal {
    eta: DVec3,
    k: DVec3,
    specular_reflectance: Texture,
}

impl PreparedMetal {
    fn try_new(source: &MetalSource) -> Result<Self, MaterialError> {
        let specular_reflectance = Texture::try_new(&source.specular_reflectance)?;
        Ok(Self { eta: source.eta, k: source.k, specular_reflectance })
    }

    fn at(&self, uv: DVec2) -> Metal {
        Metal { eta: self.eta, k: self.k, specular_reflectance: self.specular_reflectance.colour(uv) }
    }
}

#[derive(Debug)]
struct PreparedRoughness {
    distribution: MicrofacetDistribution,
    alpha_u: Texture,
    alpha_v: Texture,
}

impl PreparedRoughness {
    fn try_new(source: &Roughness) -> Result<Self, MaterialError> {
        let Roughness { distribution, alpha_u, alpha_v } = source;
        let [alpha_u, alpha_v] = [Texture::try_new(alpha_u)?, Texture::try_new(alpha_v)?];
        Ok(Self { distribution: *distribution, alpha_u, alpha_v })
    }

    fn at(&self, uv: DVec2) -> Microfacets {
        Microfacets::new(self.distribution, DVec2::new(self.alpha_u.number(uv), self.alpha_v.number(uv)))
    }
}

#[derive(Debug)]
struct PreparedGlass {
    eta: f64,
    specular_reflectance: Texture,
    specular_transmittance: Texture,
}

impl PreparedGlass {
    fn try_new(source: &GlassSource) -> Result<Self, MaterialError> {
        Ok(Self {
            eta: source.int_ior / source.ext_ior,
            specular_reflectance: Texture::try_new(&source.specular_reflectance)?,
            specular_transmittance: Texture::try_new(&source.specular_transmittance)?,
        })
    }

    fn at(&self, uv: DVec2) -> Glass {
        let specular_reflectance = self.specular_reflectance.colour(uv);
        let specular_transmittance = self.specular_transmittance.colour(uv);
        Glass { eta: self.eta, specular_reflectance, specular_transmittance }
    }

    const fn textures(&self) -> [&Texture; 2] {
        [&self.specular_reflectance, &self.specular_transmittance]
    }
}

#[derive(Debug)]
struct PreparedCoat {
    eta: f64,
    diffuse_reflectance: Texture,
    specular_reflectance: Texture,
    nonlinear: bool,
    specular_weight: f64,
}

impl PreparedCoat {
    fn try_new(source: &CoatSource) -> Result<Self, MaterialError> {
        let diffuse_reflectance = Texture::try_new(&source.diffuse_reflectance)?;
        let specular_reflectance = Texture::try_new(&source.specular_reflectance)?;
        let [diffuse, specular] = [diffuse_reflectance.mean(), specular_reflectance.mean()];
        // a coat and a base that are black are sampled alike
        let specular_weight = if diffuse + specular > 0.0 { specular / (diffuse + specular) } else { 0.5 };
        let (eta, nonlinear) = (source.int_ior / source.ext_ior, source.nonlinear);
        Ok(Self { eta, diffuse_reflectance, specular_reflectance, nonlinear, specular_weight })
    }

    fn at(&self, uv: DVec2) -> Coat {
        Coat {
            eta: self.eta,
            diffuse_reflectance: self.diffuse_reflectance.colour(uv),
            specular_reflectance: self.specular_reflectance.colour(uv),
            nonlinear: self.nonlinear,
            specular_weight: self.specular_weight,
        }
    }
}

#[derive(Debug)]
struct PreparedPrincipled {
    base_color: Texture,
    roughness: Texture,
    anisotropic: Texture,
    metallic: Texture,
    spec_trans: Texture,
    eta: f64,
    spec_tint: Texture,
    sheen: Texture,
    sheen_tint: Texture,
    flatness: Texture,
    clearcoat: Texture,
    clearcoat_gloss: Texture,
}

impl PreparedPrincipled {
    fn try_new(source: &PrincipledSource) -> Result<Self, MaterialError> {
        Ok(Self {
            base_color: Texture::try_new(&source.base_color)?,
            roughness: Texture::try_new(&source.roughness)?,
            anisotropic: Texture::try_new(&source.anisotropic)?,
            metallic: Texture::try_new(&source.metallic)?,
            spec_trans: Texture::try_new(&source.spec_trans)?,
            eta: source.eta(),
            spec_tint: Texture::try_new(&source.spec_tint)?,
            sheen: Texture::try_new(&source.sheen)?,
            sheen_tint: Texture::try_new(&source.sheen_tint)?,
            flatness: Texture::try_new(&source.flatness)?,
            clearcoat: Texture::try_new(&source.clearcoat)?,
            clearcoat_gloss: Texture::try_new(&source.clearcoat_gloss)?,
        })
    }

    fn at(&self, uv: DVec2) -> Principled {
        Principled::new(PrincipledParameters {
            base_color: self.base_color.colour(uv),
            roughness: self.roughness.number(uv),
            anisotropic: self.anisotropic.number(uv),
            metallic: self.metallic.number(uv),
            spec_trans: self.spec_trans.number(uv),
            eta: self.eta,
            spec_tint: self.spec_tint.number(uv),
            sheen: self.sheen.number(uv),
            sheen_tint: self.sheen_tint.number(uv),
            flatness: self.flatness.number(uv),
            clearcoat: self.clearcoat.number(uv),
            clearcoat_gloss: self.clearcoat_gloss.number(uv),
        })
    }

    fn textures(&self) -> Vec<&Texture> {
        vec![
            &self.base_color,
            &self.roughness,
            &self.anisotropic,
            &self.metallic,
            &self.spec_trans,
            &self.spec_tint,
            &self.sheen,
            &self.sheen_tint,
            &self.flatness,
            &self.clearcoat,
            &self.clearcoat_gloss,
        ]
    }
}

#[cfg(test)]
mod tests;
