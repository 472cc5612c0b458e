//! All that decides a picture's pixels besides geometry, by the scene file's names.

use glam::{DAffine3, DVec3};
use serde_json::json;

use super::digest::Digest;
use super::material_json::material_json;
use crate::film::{Aov, Picture};
use crate::scene::{BuiltScene, Choice, SceneDescription};
use crate::shade::{Light, Projection};

/// All that decides the pixels besides geometry, which the hash stands for.
pub(super) fn settings_json(scene: &SceneDescription, built: &BuiltScene) -> serde_json::Value {
    let (camera, film, render) = (&built.camera, &scene.film, &scene.render);
    let materials = scene.objects.iter().zip(&built.materials).map(|(object, prepared)| {
        let mut material = material_json(&scene.material_of(object));
        material["pictures"] = prepared.pictures().into_iter().map(picture_hash).collect();
        material
    });
    json!({
        "camera": {
            "origin": camera.origin.to_array(), "target": camera.target.to_array(), "up": camera.up.to_array(),
            "projection": projection_json(&camera.projection),
        },
        "film": { "size": film.size, "filter": film.filter.name(), "crop": film.crop },
        "render": {
            "integrator": render.integrator.name(), "sampler": render.sampler.name(), "spp": render.spp, "max_depth": render.max_depth,
            "rr_depth": render.rr_depth, "seed": render.seed, "hide_emitters": render.hide_emitters,
            "aovs": render.aovs.iter().map(|aov: &Aov| aov.name()).collect::<Vec<_>>(),
        },
        "materials": materials.collect::<Vec<_>>(),
        "lights": built.light_settings.iter().map(|light| light_json(light, built)).collect::<Vec<_>>(),
    })
}

fn projection_json(projection: &Projection) -> serde_json::Value {
    match projection {
        Projection::Perspective { fov, fov_axis, lens } => json!({
            "type": if lens.is_some() { "thinlens" } else { "perspective" },
            "fov": fov, "fov_axis": fov_axis.name(),
            "aperture_radius": lens.map(|lens| lens.aperture_radius),
            "focus_distance": lens.map(|lens| lens.focus_distance),
        }),
        Projection::Orthographic { width } => json!({ "type": "orthographic", "width": width }),
    }
}

fn light_json(light: &Light, built: &BuiltScene) -> serde_json::Value {
    let area = |shape: &str, to_world: &DAffine3, radiance: &DVec3| {
        json!({
            "type": "area", "shape": shape, "radiance": radiance.to_array(), "to_world": to_world.to_cols_array(),
        })
    };
    match light {
        Light::Constant { radiance } => json!({ "type": "constant", "radiance": radiance.to_array() }),
        Light::Point { position, intensity } => {
            json!({ "type": "point", "position": position.to_array(), "intensity": intensity.to_array() })
        }
        Light::Envmap { picture, scale, to_world } => json!({
            "type": "envmap", "size": picture.size, "pixels": picture_hash(picture), "scale": scale,
            "to_world": to_world.to_cols_array(),
        }),
        Light::Directional { direction, irradiance } => json!({
            "type": "directional", "direction": direction.to_array(), "irradiance": irradiance.to_array(),
        }),
        Light::Spot { to_world, intensity, cutoff_angle, beam_width } => json!({
            "type": "spot", "to_world": to_world.to_cols_array(), "intensity": intensity.to_array(),
            "cutoff_angle": cutoff_angle, "beam_width": beam_width,
        }),
        Light::Rectangle { to_world, radiance } => area("rectangle", to_world, radiance),
        Light::Disk { to_world, radiance } => area("disk", to_world, radiance),
        Light::Sphere { to_world, radiance } => area("sphere", to_world, radiance),
        Light::Object { object, radiance } => json!({
            "type": "area", "shape": "object", "object": built.traced.objects()[*object].name,
            "radiance": radiance.to_array(),
        }),
    }
}

/// Hash of a picture's pixels, row by row, red, green, blue, each as a 32-bit float of little endian.
fn picture_hash(picture: &Picture) -> String {
    let mut digest = Digest::default();
    picture.pixels.iter().flatten().for_each(|value| digest.bytes(&value.to_le_bytes()));
    digest.finish()
}
