//! Materials in a picture's header.

use glam::DAffine2;
use serde_json::{Value, json};

use crate::scene::Choice;
use crate::shade::{
    BitmapSource, Checkerboard, CoatSource, GlassSource, Material, MetalSource, PrincipledInterface,
    PrincipledSource, Roughness, TextureSource,
};

/// All that decides the pixels, by the scene file's names; of pictures the files' names, without folders.
pub(super) fn material_json(material: &Material) -> Value {
    match material {
        Material::Diffuse { reflectance, two_sided } => {
            json!({ "type": "diffuse", "reflectance": texture(reflectance), "two_sided": two_sided })
        }
        Material::Conductor { metal, two_sided } => {
            merged([json!({ "type": "conductor", "two_sided": two_sided }), metal_json(metal)])
        }
        Material::RoughConductor { metal, roughness, two_sided } => merged([
            json!({ "type": "roughconductor", "two_sided": two_sided }),
            metal_json(metal),
            roughness_json(roughness),
        ]),
        Material::Dielectric { glass } => merged([json!({ "type": "dielectric" }), glass_json(glass)]),
        Material::RoughDielectric { glass, roughness } => {
            merged([json!({ "type": "roughdielectric" }), glass_json(glass), roughness_json(roughness)])
        }
        Material::Plastic { coat, two_sided } => {
            merged([json!({ "type": "plastic", "two_sided": two_sided }), coat_json(coat)])
        }
        Material::RoughPlastic { coat, distribution, alpha, two_sided } => merged([
            json!({
                "type": "roughplastic", "distribution": distribution.name(), "alpha": alpha,
                "two_sided": two_sided,
            }),
            coat_json(coat),
        ]),
        Material::Principled(source) => principled_json(source),
    }
}

/// The entries of all objects.
fn merged<const N: usize>(parts: [Value; N]) -> Value {
    let entries = parts.into_iter().filter_map(|part| match part {
        Value::Object(entries) => Some(entries),
        _ => None,
    });
    Value::Object(entries.flatten().collect())
}

fn metal_json(metal: &MetalSource) -> Value {
    let MetalSource { eta, k, specular_reflectance } = metal;
    json!({
        "eta": eta.to_array(), "k": k.to_array(), "specular_reflectance": texture(specular_reflectance),
    })
}

fn roughness_json(roughness: &Roughness) -> Value {
    let Roughness { distribution, alpha_u, alpha_v } = roughness;
    json!({ "distribution": distribution.name(), "alpha_u": texture(alpha_u), "alpha_v": texture(alpha_v) })
}

fn glass_json(glass: &GlassSource) -> Value {
    let GlassSource { int_ior, ext_ior, specular_reflectance, specular_transmittance } = glass;
    json!({
        "int_ior": int_ior, "ext_ior": ext_ior, "specular_reflectance": texture(specular_reflectance),
        "specular_transmittance": texture(specular_transmittance),
    })
}

fn coat_json(coat: &CoatSource) -> Value {
    let CoatSource { int_ior, ext_ior, diffuse_reflectance, specular_reflectance, nonlinear } = coat;
    json!({
        "int_ior": int_ior, "ext_ior": ext_ior, "diffuse_reflectance": texture(diffuse_reflectance),
        "specular_reflectance": texture(specular_reflectance), "nonlinear": nonlinear,
    })
}

fn principled_json(source: &PrincipledSource) -> Value {
    let mut material = json!({
        "type": "principled",
        "base_color": texture(&source.base_color), "roughness": texture(&source.roughness),
        "anisotropic": texture(&source.anisotropic), "metallic": texture(&source.metallic),
        "spec_trans": texture(&source.spec_trans), "spec_tint": texture(&source.spec_tint),
        "sheen": texture(&source.sheen), "sheen_tint": texture(&source.sheen_tint),
        "flatness": texture(&source.flatness), "clearcoat": texture(&source.clearcoat),
        "clearcoat_gloss": texture(&source.clearcoat_gloss), "two_sided": source.two_sided,
    });
    let (key, value) = match source.interface {
        PrincipledInterface::Eta(eta) => ("eta", eta),
        PrincipledInterface::Specular(specular) => ("specular", specular),
    };
    material[key] = value.into();
    material
}

fn texture(texture: &TextureSource) -> Value {
    match texture {
        TextureSource::Uniform(colour) => colour.to_array().to_vec().into(),
        TextureSource::Bitmap(BitmapSource { path, filter, wrap, raw, to_uv }) => json!({
            "texture": path.file_name().unwrap_or_default().to_string_lossy(), "filter": filter.name(),
            "wrap": wrap.name(), "raw": raw, "to_uv": columns(to_uv),
        }),
        TextureSource::Checkerboard(Checkerboard { colours: [color0, color1], to_uv }) => json!({
            "checkerboard": {
                "color0": color0.to_array(), "color1": color1.to_array(), "to_uv": columns(to_uv),
            },
        }),
    }
}

fn columns(map: &DAffine2) -> [f64; 6] {
    map.to_cols_array()
}
