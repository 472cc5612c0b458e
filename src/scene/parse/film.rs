//! `[film]` and `[render]`.

use crate::choice::Choice;
use crate::film::{Aov, FilmSettings};
use crate::scene::film_area::{MAX_SIDE, validate_film};
use crate::scene::reader::{Table, Value};
use crate::shade::RenderSettings;

/// Reads and checks the film.
pub(super) fn read_film(mut table: Table<'_>) -> FilmSettings {
    table.check_keys(&["size", "filter", "crop"]);
    let default = FilmSettings::default();
    let sides = format!("[width, height] in pixels, each an integer from 1 to {MAX_SIDE}");
    let given_size =
        table.optional("size", &sides, |value| value.array(|side| side.integer(1..=i128::from(MAX_SIDE))));
    let crop = table.optional("crop", "[x, y, width, height] in pixels, integers of at least 0", |value| {
        value.array(|element| element.integer(0..=i128::from(u32::MAX)))
    });
    let film = FilmSettings {
        size: given_size.unwrap_or(default.size),
        filter: table.choice("filter").unwrap_or(default.filter),
        crop,
    };
    // a size and a crop can only be judged together
    if given_size.is_some() == table.has("size") && crop.is_some() == table.has("crop") {
        let key = if crop.is_some() { "crop" } else { "size" };
        table.converted(key, validate_film(&film));
    }
    film
}

/// Reads and checks what decides the picture besides the scene.
pub(super) fn read_render(mut table: Table<'_>) -> RenderSettings {
    table.check_keys(&[
        "integrator",
        "sampler",
        "spp",
        "max_depth",
        "rr_depth",
        "seed",
        "aovs",
        "hide_emitters",
    ]);
    let default = RenderSettings::default();
    let integrator = table.choice("integrator");
    let sampler = table.choice("sampler");
    let count = format!("an integer from 1 to {}", u32::MAX);
    let positive = |value: Value<'_>| value.integer(1..=i128::from(u32::MAX));
    let spp = table.optional("spp", &count, positive);
    let depth = format!("an integer from -1 (unlimited) to {}", i32::MAX);
    let max_depth = table.optional("max_depth", &depth, |value| value.integer(-1..=i128::from(i32::MAX)));
    let rr_depth = table.optional("rr_depth", &count, positive);
    let seeds = format!("an integer from 0 to {}", u64::MAX);
    let seed = table.optional("seed", &seeds, |value| value.integer(0..=i128::from(u64::MAX)));
    let hide_emitters = table.optional("hide_emitters", "true or false", Value::boolean);
    RenderSettings {
        integrator: integrator.unwrap_or(default.integrator),
        sampler: sampler.unwrap_or(default.sampler),
        spp: spp.unwrap_or(default.spp),
        max_depth: max_depth.unwrap_or(default.max_depth),
        rr_depth: rr_depth.unwrap_or(default.rr_depth),
        seed: seed.unwrap_or(default.seed),
        aovs: read_aovs(&table),
        hide_emitters: hide_emitters.unwrap_or(default.hide_emitters),
    }
}

fn read_aovs(table: &Table<'_>) -> Vec<Aov> {
    let expected = r#"a list of names, such as ["depth", "position"]"#;
    let mut aovs = Vec::new();
    let Some(value) = table.value("aovs") else {
        return aovs;
    };
    let Some(elements) = value.accept("aovs", expected, value.elements()) else {
        return aovs;
    };
    for element in elements {
        let Some(name) = element.accept("aovs", expected, element.text()) else {
            continue;
        };
        match Aov::from_name(name) {
            Ok(aov) if aovs.contains(&aov) => {
                element.report(format!("aov {name:?} is asked for twice"));
            }
            Ok(aov) => aovs.push(aov),
            Err(error) => element.report(error.to_string()),
        }
    }
    aovs
}
