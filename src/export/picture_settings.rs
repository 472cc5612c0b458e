//! What a picture was made of, for its header and for checkpoints.

use std::path::PathBuf;
use std::time::Duration;

use glam::{DAffine3, DVec3};
use serde_json::json;

use crate::film::{Aov, ExrHeader, Picture};
use crate::render::CheckpointFile;
use crate::scene::{BuiltScene, Choice, SceneDescription};
use crate::shade::{Camera, Light, Projection};

use super::material_json::material_json;

/// All that a picture depends on.
#[derive(Debug)]
pub struct PictureSettings {
    /// What decides the pixels besides geometry.
    settings: serde_json::Value,
    /// See [`scene_hash`].
    scene_hash: String,
}

impl PictureSettings {
    /// Those of a scene and what was built of it.
    ///
    /// # Errors
    /// None in practice: what is hashed is written to memory.
    pub fn of(scene: &SceneDescription, built: &BuiltScene) -> std::io::Result<Self> {
        let settings = settings_json(scene, built);
        let scene_hash = scene_hash(settings.clone(), built)?;
        Ok(Self { settings, scene_hash })
    }

    /// What an EXR file's header says of the picture.
    pub fn header(&self, scene: &SceneDescription, camera: &Camera) -> ExrHeader {
        ExrHeader {
            camera_from_world: camera.camera_from_world(),
            screen_window_width: camera.screen_window_width(),
            scene_hash: self.scene_hash.clone(),
            seed: scene.render.seed,
            spp: scene.render.spp,
            settings: self.settings.to_string(),
            reference_scene: None,
        }
    }

    /// Where the picture's state is saved; a state serves for any number of samples.
    pub fn checkpoint_file(&self, path: PathBuf, interval: Duration) -> CheckpointFile {
        let mut settings = self.settings.clone();
        settings["render"]["spp"] = serde_json::Value::Null;
        CheckpointFile::new(path, self.scene_hash.clone(), settings, interval)
    }
}

/// All that decides the pixels besides geometry, which the hash stands for.
fn settings_json(scene: &SceneDescription, built: &BuiltScene) -> serde_json::Value {
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
    let mut hasher = blake3::Hasher::new();
    for row in picture.pixels.chunks(picture.size[0] as usize) {
        let bytes: Vec<u8> = row.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        hasher.update(&bytes);
    }
    hasher.finalize().to_hex()[..32].to_owned()
}

/// Hash of what the scene shows: its patches, materials, lights, camera and picture size; not of seed or samples.
fn scene_hash(mut settings: serde_json::Value, built: &BuiltScene) -> std::io::Result<String> {
    settings["render"] = serde_json::Value::Null;
    settings["film"]["crop"] = serde_json::Value::Null;
    let mut hasher = blake3::Hasher::new();
    hasher.update(settings.to_string().as_bytes());
    hasher.update(&crate::export::exact_patches(built)?);
    for object in built.traced.objects() {
        let mut numbers = Vec::new();
        object.attributes.each_number(&mut |number| numbers.extend(number.to_le_bytes()));
        hasher.update(blake3::hash(&numbers).as_bytes());
    }
    Ok(hasher.finalize().to_hex()[..32].to_owned())
}
