//! All that decides a picture's pixels besides geometry, by the scene file's names.

use serde_json::json;

use super::parameter_json::{light_json, material_json, picture_hash};
use crate::choice::Choice;
use crate::film::Aov;
use crate::scene::{BuiltScene, SceneDescription};
use crate::shade::{Material, ObjectMaterials, PreparedMaterial, Projection};

/// All that decides the pixels besides geometry, which the hash stands for.
pub(super) fn settings_json(scene: &SceneDescription, built: &BuiltScene) -> serde_json::Value {
    let (camera, film, render) = (&built.camera, &scene.film, &scene.render);
    let materials = built.materials.iter().map(materials_json);
    let objects = built.traced.objects();
    let lights = built.light_settings.iter().map(|light| light_json(light, objects));
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
        "lights": lights.collect::<Vec<_>>(),
    })
}

/// The one material of an object, or those of its faces.
fn materials_json(materials: &ObjectMaterials) -> serde_json::Value {
    let one = |(material, prepared): (&Material, &PreparedMaterial)| {
        let mut material = material_json(material);
        material["pictures"] = prepared.pictures().iter().map(|picture| picture_hash(picture)).collect();
        material
    };
    let mut all: Vec<_> = materials.iter().map(one).collect();
    if materials.of_face().is_empty() {
        return all.swap_remove(0);
    }
    let mut by_face = json!({ "materials": all, "of_face": materials.of_face() });
    if !materials.emission().is_empty() {
        by_face["emission"] = materials.emission().iter().map(|radiance| radiance.to_array()).collect();
    }
    by_face
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
