//! Materials and textures for Mitsuba 3.

use std::io;

use glam::{DAffine2, DAffine3, DMat3};

use super::mitsuba::Pictures;
use super::xml::Element;
use crate::scene::Choice;
use crate::shade::{
    CoatSource, GlassSource, Material, MetalSource, PrincipledInterface, PrincipledSource, Roughness,
    TextureSource,
};

/// An element being made, with what it takes along.
struct Maker<'p> {
    element: Element,
    pictures: &'p mut Pictures,
}

/// The plugin of a material.
pub(super) fn bsdf(material: &Material, pictures: &mut Pictures) -> io::Result<Element> {
    let made = |kind: &str, pictures| Maker { element: Element::plugin("bsdf", kind), pictures };
    let (model, two_sided) = match material {
        Material::Diffuse { reflectance, two_sided } => {
            (made("diffuse", pictures).colour("reflectance", reflectance)?, *two_sided)
        }
        Material::Conductor { metal, two_sided } => (made("conductor", pictures).metal(metal)?, *two_sided),
        Material::RoughConductor { metal, roughness, two_sided } => {
            (made("roughconductor", pictures).metal(metal)?.roughness(roughness)?, *two_sided)
        }
        Material::Dielectric { glass } => (made("dielectric", pictures).glass(glass)?, false),
        Material::RoughDielectric { glass, roughness } => {
            (made("roughdielectric", pictures).glass(glass)?.roughness(roughness)?, false)
        }
        Material::Plastic { coat, two_sided } => (made("plastic", pictures).coat(coat)?, *two_sided),
        Material::RoughPlastic { coat, distribution, alpha, two_sided } => {
            let made = made("roughplastic", pictures).coat(coat)?;
            let with =
                |element: Element| element.string("distribution", distribution.name()).float("alpha", *alpha);
            (made.with(with), *two_sided)
        }
        Material::Principled(source) => (made("principled", pictures).principled(source)?, source.two_sided),
    };
    Ok(if two_sided { Element::plugin("bsdf", "twosided").child(model.element) } else { model.element })
}

impl Maker<'_> {
    fn with(mut self, change: impl FnOnce(Element) -> Element) -> Self {
        self.element = change(self.element);
        self
    }

    fn colour(self, name: &'static str, source: &TextureSource) -> io::Result<Self> {
        match source {
            TextureSource::Uniform(colour) => Ok(self.with(|element| element.rgb(name, *colour))),
            _ => self.texture(name, source),
        }
    }

    fn scalar(self, name: &'static str, source: &TextureSource) -> io::Result<Self> {
        match source {
            TextureSource::Uniform(number) => Ok(self.with(|element| element.float(name, number.x))),
            _ => self.texture(name, source),
        }
    }

    fn texture(self, name: &'static str, source: &TextureSource) -> io::Result<Self> {
        let texture = match source {
            TextureSource::Uniform(colour) => return Ok(self.with(|element| element.rgb(name, *colour))),
            TextureSource::Bitmap(bitmap) => Element::plugin("texture", "bitmap")
                .string("filename", &self.pictures.take(&bitmap.path)?)
                .string("filter_type", bitmap.filter.name())
                .string("wrap_mode", bitmap.wrap.name())
                .boolean("raw", bitmap.raw)
                .transform("to_uv", &in_space(&bitmap.to_uv)),
            TextureSource::Checkerboard(board) => Element::plugin("texture", "checkerboard")
                .rgb("color0", board.colours[0])
                .rgb("color1", board.colours[1])
                .transform("to_uv", &in_space(&board.to_uv)),
        };
        Ok(self.with(|element| element.child(texture.attribute("name", name))))
    }

    fn metal(self, metal: &MetalSource) -> io::Result<Self> {
        let MetalSource { eta, k, specular_reflectance } = metal;
        let mirror = MetalSource::default();
        let made = if (eta, k) == (&mirror.eta, &mirror.k) {
            self.with(|element| element.string("material", "none"))
        } else {
            self.with(|element| element.rgb("eta", *eta).rgb("k", *k))
        };
        made.colour("specular_reflectance", specular_reflectance)
    }

    fn roughness(self, roughness: &Roughness) -> io::Result<Self> {
        let Roughness { distribution, alpha_u, alpha_v } = roughness;
        let made = self.with(|element| element.string("distribution", distribution.name()));
        made.scalar("alpha_u", alpha_u)?.scalar("alpha_v", alpha_v)
    }

    fn glass(self, glass: &GlassSource) -> io::Result<Self> {
        let GlassSource { int_ior, ext_ior, specular_reflectance, specular_transmittance } = glass;
        self.with(|element| element.float("int_ior", *int_ior).float("ext_ior", *ext_ior))
            .colour("specular_reflectance", specular_reflectance)?
            .colour("specular_transmittance", specular_transmittance)
    }

    fn coat(self, coat: &CoatSource) -> io::Result<Self> {
        let CoatSource { int_ior, ext_ior, diffuse_reflectance, specular_reflectance, nonlinear } = coat;
        let with = |element: Element| {
            element.float("int_ior", *int_ior).float("ext_ior", *ext_ior).boolean("nonlinear", *nonlinear)
        };
        self.with(with)
            .colour("diffuse_reflectance", diffuse_reflectance)?
            .colour("specular_reflectance", specular_reflectance)
    }

    fn principled(self, source: &PrincipledSource) -> io::Result<Self> {
        let made = self.with(|element| match source.interface {
            PrincipledInterface::Eta(eta) => element.float("eta", eta),
            PrincipledInterface::Specular(specular) => element.float("specular", specular),
        });
        let scalars = [
            ("roughness", &source.roughness),
            ("anisotropic", &source.anisotropic),
            ("metallic", &source.metallic),
            ("spec_trans", &source.spec_trans),
            ("spec_tint", &source.spec_tint),
            ("sheen", &source.sheen),
            ("sheen_tint", &source.sheen_tint),
            ("flatness", &source.flatness),
            ("clearcoat", &source.clearcoat),
            ("clearcoat_gloss", &source.clearcoat_gloss),
        ];
        // Mitsuba makes room for a lobe whose parameter is given, be it 0
        let given = scalars.into_iter().filter(|(_, source)| !source.is_zero());
        given.fold(made.colour("base_color", &source.base_color), |made, (name, source)| {
            made?.scalar(name, source)
        })
    }
}

/// A map of the plane as one of space.
fn in_space(map: &DAffine2) -> DAffine3 {
    let [x, y] = [map.matrix2.x_axis, map.matrix2.y_axis].map(|axis| axis.extend(0.0));
    DAffine3::from_mat3_translation(DMat3::from_cols(x, y, glam::DVec3::Z), map.translation.extend(0.0))
}
