//! `[[material]]`: the names and defaults are Mitsuba's.

use glam::DVec3;

use super::names::Names;
use super::texture;
use crate::scene::description::NamedMaterial;
use crate::scene::names::lookup;
use crate::scene::reader::{Converted, Table, Value};
use crate::shade::{
    CoatSource, DEFAULT_ALPHA, GlassSource, METAL_NAMES, Material, MetalSource, MicrofacetDistribution,
    PrincipledInterface, PrincipledSource, REFRACTIVE_INDICES, Roughness, TextureSource,
};

/// The materials of a scene.
pub(super) struct Materials {
    /// Those without fault.
    pub(super) described: Vec<NamedMaterial>,
    /// All names, also of materials with other faults, in the order of `described` if there are no
    /// faults.
    pub(super) names: Vec<String>,
}

/// Reads and checks all materials.
pub(super) fn read_materials(tables: Vec<Table<'_>>) -> Materials {
    let mut names = Names::default();
    let mut materials = Materials { described: Vec::new(), names: Vec::new() };
    for table in tables {
        let name = names.read(&table);
        materials.names.extend(name.iter().map(|name| name.value.clone()));
        if let (Some(name), Some(material)) = (name, read_material(table)) {
            materials.described.push(NamedMaterial { name, material });
        }
    }
    materials
}

const COMMON_KEYS: &[&str] = &["name", "type"];
const METAL_KEYS: &[&str] = &["material", "eta", "k", "specular_reflectance"];
const ROUGHNESS_KEYS: &[&str] = &["distribution", "alpha", "alpha_u", "alpha_v"];
const GLASS_KEYS: &[&str] = &["int_ior", "ext_ior", "specular_reflectance", "specular_transmittance"];
const COAT_KEYS: &[&str] =
    &["int_ior", "ext_ior", "diffuse_reflectance", "specular_reflectance", "nonlinear"];
const PRINCIPLED_KEYS: &[&str] = &[
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
const SIDES: &[&str] = &["two_sided"];

/// The materials' types and their keys besides the common ones.
const TYPES: &[(&str, &[&[&str]])] = &[
    ("diffuse", &[&["reflectance"], SIDES]),
    ("conductor", &[METAL_KEYS, SIDES]),
    ("roughconductor", &[METAL_KEYS, ROUGHNESS_KEYS, SIDES]),
    ("dielectric", &[GLASS_KEYS]),
    ("roughdielectric", &[GLASS_KEYS, ROUGHNESS_KEYS]),
    ("plastic", &[COAT_KEYS, SIDES]),
    ("roughplastic", &[COAT_KEYS, &["distribution", "alpha"], SIDES]),
    ("principled", &[PRINCIPLED_KEYS, SIDES]),
];

fn read_material(mut table: Table<'_>) -> Option<Material> {
    if !table.has("type") {
        let mut all = COMMON_KEYS.to_vec();
        for key in TYPES.iter().flat_map(|(_, keys)| keys.concat()) {
            if !all.contains(&key) {
                all.push(key);
            }
        }
        table.check_keys(&all);
    }
    let names: Vec<&str> = TYPES.iter().map(|(name, _)| *name).collect();
    let kind = table.required_name("type", "material type", &names)?;
    let (_, keys) = TYPES.iter().find(|(name, _)| *name == kind)?;
    table.check_keys(&[COMMON_KEYS, &keys.concat()].concat());
    let two_sided = table.optional("two_sided", "true or false", Value::boolean);
    let table = &table;
    let sides = two_sided.unwrap_or(true);
    Some(match kind {
        "conductor" => Material::Conductor { metal: read_metal(table), two_sided: sides },
        "roughconductor" => Material::RoughConductor {
            metal: read_metal(table),
            roughness: read_roughness(table),
            two_sided: sides,
        },
        "dielectric" => Material::Dielectric { glass: read_glass(table) },
        "roughdielectric" => {
            let glass = read_glass(table);
            check_media(table, glass.int_ior, glass.ext_ior);
            Material::RoughDielectric { glass, roughness: read_roughness(table) }
        }
        "plastic" => Material::Plastic { coat: read_coat(table), two_sided: sides },
        "roughplastic" => {
            let coat = read_coat(table);
            check_media(table, coat.int_ior, coat.ext_ior);
            let alpha = "a number of at least 0";
            let alpha = table.optional("alpha", alpha, |value| value.number_where(|alpha| alpha >= 0.0));
            Material::RoughPlastic {
                coat,
                distribution: table.choice("distribution").unwrap_or_default(),
                alpha: alpha.unwrap_or(DEFAULT_ALPHA),
                two_sided: sides,
            }
        }
        "principled" => Material::Principled(Box::new(read_principled(table, two_sided))),
        _ => {
            let Material::Diffuse { reflectance: default, .. } = Material::default() else { return None };
            Material::Diffuse { reflectance: colour(table, "reflectance", default), two_sided: sides }
        }
    })
}

fn colour(table: &Table<'_>, key: &str, default: TextureSource) -> TextureSource {
    texture::colour(table, key).unwrap_or(default)
}

fn read_metal(table: &Table<'_>) -> MetalSource {
    let name = table.name_index("material", "metal", &METAL_NAMES).map_or("none", |index| METAL_NAMES[index]);
    let named = MetalSource::named(name).unwrap_or_default();
    let index = |key| {
        let expected = "a number or [r, g, b], each at least 0";
        let given: Option<DVec3> = table.optional(key, expected, |value| value.rgb(|index| index >= 0.0));
        if name != "none" && table.has(key) {
            table.report_key(
                key,
                format!("{key} cannot stand beside material: the name stands for eta and k"),
            );
        }
        given
    };
    MetalSource {
        eta: index("eta").unwrap_or(named.eta),
        k: index("k").unwrap_or(named.k),
        specular_reflectance: colour(table, "specular_reflectance", named.specular_reflectance),
    }
}

fn read_roughness(table: &Table<'_>) -> Roughness {
    let default = Roughness::default();
    let both = texture::roughness(table, "alpha");
    let [u, v] = ["alpha_u", "alpha_v"].map(|key| texture::roughness(table, key));
    match ["alpha", "alpha_u", "alpha_v"].map(|key| table.has(key)) {
        [true, true, _] | [true, _, true] => {
            table.report_key("alpha", "alpha cannot stand beside alpha_u and alpha_v".to_owned());
        }
        [_, true, false] => table.report_key("alpha_u", "alpha_u needs alpha_v beside it".to_owned()),
        [_, false, true] => table.report_key("alpha_v", "alpha_v needs alpha_u beside it".to_owned()),
        _ => {}
    }
    Roughness {
        distribution: table.choice::<MicrofacetDistribution>("distribution").unwrap_or_default(),
        alpha_u: u.or_else(|| both.clone()).unwrap_or(default.alpha_u),
        alpha_v: v.or(both).unwrap_or(default.alpha_v),
    }
}

fn read_glass(table: &Table<'_>) -> GlassSource {
    let default = GlassSource::default();
    GlassSource {
        int_ior: read_index(table, "int_ior").unwrap_or(default.int_ior),
        ext_ior: read_index(table, "ext_ior").unwrap_or(default.ext_ior),
        specular_reflectance: colour(table, "specular_reflectance", default.specular_reflectance),
        specular_transmittance: colour(table, "specular_transmittance", default.specular_transmittance),
    }
}

fn read_coat(table: &Table<'_>) -> CoatSource {
    let default = CoatSource::default();
    CoatSource {
        int_ior: read_index(table, "int_ior").unwrap_or(default.int_ior),
        ext_ior: read_index(table, "ext_ior").unwrap_or(default.ext_ior),
        diffuse_reflectance: colour(table, "diffuse_reflectance", default.diffuse_reflectance),
        specular_reflectance: colour(table, "specular_reflectance", default.specular_reflectance),
        nonlinear: table.optional("nonlinear", "true or false", Value::boolean).unwrap_or(default.nonlinear),
    }
}

/// An index of refraction: a number or a name.
fn read_index(table: &Table<'_>, key: &str) -> Option<f64> {
    if let Ok(name) = table.value(key)?.text() {
        let names: Vec<&str> = REFRACTIVE_INDICES.iter().map(|(name, _)| *name).collect();
        let index = table.converted(key, lookup("medium", &names, &name.to_lowercase()))?;
        return Some(REFRACTIVE_INDICES[index].1);
    }
    table.optional(key, "a number above 0, or a name such as \"water\"", positive)
}

fn positive(value: Value<'_>) -> Converted<f64> {
    value.number_where(|number| number > 0.0)
}

fn check_media(table: &Table<'_>, int_ior: f64, ext_ior: f64) {
    if int_ior == ext_ior {
        let key = if table.has("int_ior") { "int_ior" } else { "ext_ior" };
        let message = format!("int_ior and ext_ior must differ for a rough surface; both are {int_ior}");
        table.report_value(key, message);
    }
}

fn read_principled(table: &Table<'_>, two_sided: Option<bool>) -> PrincipledSource {
    let default = PrincipledSource::default();
    let share = |key, default| texture::share(table, key).unwrap_or(default);
    let eta = table.optional("eta", "a number above 0", positive);
    let expected = "a number in [0, 1]";
    let specular = table.optional("specular", expected, |value| {
        value.number_where(|specular| (0.0..=1.0).contains(&specular))
    });
    if table.has("eta") && table.has("specular") {
        table.report_key("specular", "specular cannot stand beside eta: it stands for one".to_owned());
    }
    let spec_trans = share("spec_trans", default.spec_trans);
    let opaque = spec_trans.is_zero();
    if two_sided == Some(true) && !opaque {
        let message = "a material that transmits light (spec_trans) is never two_sided";
        table.report_value("two_sided", message.to_owned());
    }
    PrincipledSource {
        base_color: colour(table, "base_color", default.base_color),
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
