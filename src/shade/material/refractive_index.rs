//! Transparent materials by name.

use crate::shade::parameters::ParameterSource;
use crate::suggestion::lookup;

/// Names and indices of refraction, Mitsuba's: many from Hecht, Optics (4th edition), at about 589 nm.
pub const REFRACTIVE_INDICES: &[(&str, f64)] = &[
    ("vacuum", 1.0),
    ("helium", 1.000_036),
    ("hydrogen", 1.000_132),
    ("air", 1.000_277),
    ("carbon dioxide", 1.000_45),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.520_45),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.47),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.575),
    ("diamond", 2.419),
];

/// The index of refraction of a named material.
#[must_use]
pub fn refractive_index(name: &str) -> Option<f64> {
    REFRACTIVE_INDICES.iter().find(|(known, _)| *known == name).map(|(_, index)| *index)
}

/// The index of a name known to be in the table.
pub(super) fn named_index(name: &str) -> f64 {
    refractive_index(name).unwrap_or(f64::NAN)
}

/// Whether a number can be an index of refraction.
pub(super) fn is_index(number: f64) -> bool {
    number > 0.0
}

/// An index of refraction: a number or a name.
pub(super) fn read_index(source: &dyn ParameterSource, key: &str) -> Option<f64> {
    let Some(name) = source.text(key) else {
        return source.number(key, "a number above 0, or a name such as \"water\"", &is_index);
    };
    let names: Vec<&str> = REFRACTIVE_INDICES.iter().map(|(name, _)| *name).collect();
    let found = lookup("medium", &names, &name.to_lowercase());
    found
        .map_err(|error| source.report_value(key, error.to_string()))
        .ok()
        .map(|index| REFRACTIVE_INDICES[index].1)
}

/// Reports indices of refraction that are the same: nothing is reflected then, and a rough surface has no meaning.
pub(super) fn check_media(source: &dyn ParameterSource, int_ior: f64, ext_ior: f64) {
    if int_ior == ext_ior {
        let key = if source.has("int_ior") { "int_ior" } else { "ext_ior" };
        let message = format!("int_ior and ext_ior must differ for a rough surface; both are {int_ior}");
        source.report_value(key, message);
    }
}
