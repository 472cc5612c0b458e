//! What a picture is of: the same for the file's header, for checkpoints, and for whoever puts shares of a picture together.

mod digest;
mod parameter_json;
mod settings;

use glam::DVec4;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::film::ExrHeader;
use crate::patch::Face;
use crate::scene::{BuiltScene, SceneDescription};
use crate::shade::Camera;
use crate::spline::SplineVolume;

use digest::Digest;
use settings::settings_json;

/// All that decides a picture's pixels: equal identities are the same picture, bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PictureIdentity {
    /// The program's, since another one may compute other samples.
    version: String,
    /// Hash of what the scene shows: its patches, materials, lights, camera and picture size; not of seed or samples.
    scene: String,
    /// What decides the pixels besides geometry.
    settings: Value,
}

impl PictureIdentity {
    /// The identity of a scene's picture, by the scene and what was built of it.
    #[must_use]
    pub fn new(scene: &SceneDescription, built: &BuiltScene) -> Self {
        let settings = settings_json(scene, built);
        let hash = scene_hash(settings.clone(), built);
        Self { version: env!("CARGO_PKG_VERSION").to_owned(), scene: hash, settings }
    }

    /// A picture that is of no scene.
    #[cfg(test)]
    pub(crate) fn from_settings(settings: Value) -> Self {
        Self { version: env!("CARGO_PKG_VERSION").to_owned(), scene: "hash".to_owned(), settings }
    }

    /// The version of the program that makes the picture.
    #[must_use]
    pub fn version(&self) -> &str {
        &self.version
    }

    /// What an EXR file's header says of the picture.
    #[must_use]
    pub fn header(&self, scene: &SceneDescription, camera: &Camera) -> ExrHeader {
        ExrHeader {
            camera_from_world: camera.camera_from_world(),
            screen_window_width: camera.screen_window_width(),
            scene_hash: self.scene.clone(),
            seed: scene.render.seed,
            spp: scene.render.spp,
            settings: self.settings.to_string(),
            reference_scene: None,
        }
    }

    /// The same for pictures of any number of samples.
    #[must_use]
    pub fn without_samples(&self) -> Self {
        let mut identity = self.clone();
        if let Some(spp) = identity.settings.pointer_mut("/render/spp") {
            *spp = Value::Null;
        }
        identity
    }

    /// What is not the same, but for the version: the settings' names, or the scene.
    #[must_use]
    pub fn difference(&self, other: &Self) -> Option<String> {
        let mut names = Vec::new();
        list_differences("", &self.settings, &other.settings, &mut names);
        if names.is_empty() && self.scene != other.scene {
            names.push("the scene".to_owned());
        }
        (!names.is_empty()).then(|| names.join(", "))
    }
}

fn list_differences(name: &str, ours: &Value, theirs: &Value, names: &mut Vec<String>) {
    match (ours.as_object(), theirs.as_object()) {
        (Some(a), Some(b)) => {
            for key in a.keys().chain(b.keys().filter(|key| !a.contains_key(*key))) {
                let name = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
                list_differences(&name, &ours[key], &theirs[key], names);
            }
        }
        _ if ours != theirs => names.push(name.to_owned()),
        _ => {}
    }
}

/// Hash of all numbers that decide what the scene shows.
fn scene_hash(mut settings: Value, built: &BuiltScene) -> String {
    settings["render"] = Value::Null;
    settings["film"]["crop"] = Value::Null;
    let mut digest = Digest::default();
    digest.text(&settings.to_string());
    digest.count(built.objects.len());
    for (traced, object) in built.traced.objects().iter().zip(&built.objects) {
        digest.text(&traced.name);
        digest.count(object.lattices.len());
        object.lattices.iter().for_each(|lattice| add_volume(&mut digest, &lattice.volume));
        digest.count(traced.faces().len());
        traced.faces().iter().for_each(|patch| add_patch(&mut digest, patch));
        let mut count = 0;
        traced.attributes.each_number(&mut |number| {
            digest.number(number);
            count += 1;
        });
        digest.count(count);
    }
    digest.finish()
}

fn add_volume(digest: &mut Digest, volume: &SplineVolume) {
    for axis in volume.axes() {
        digest.count(axis.knots().len());
        digest.numbers(axis.knots());
    }
    volume.degree().into_iter().for_each(|degree| digest.count(degree));
    let points = volume.control_points();
    digest.count(points.len());
    points.iter().for_each(|point| digest.numbers(&DVec4::to_array(point)));
}

fn add_patch(digest: &mut Digest, trimmed: &Face) {
    digest.count(trimmed.knot_box().is_some().into());
    trimmed.knot_box().into_iter().flatten().for_each(|index| digest.count(index));
    trimmed.patch.degree().into_iter().for_each(|degree| digest.count(degree));
    trimmed.patch.control_points().for_each(|point| digest.numbers(&point.to_array()));
    trimmed.chart.coordinates().iter().for_each(|vector| digest.numbers(&vector.to_array()));
    digest.count(trimmed.region.len());
    for trim_loop in trimmed.region.loops() {
        digest.count(trim_loop.face as usize);
        let corners = trimmed.region.corners(&trim_loop);
        digest.count(corners.len());
        corners.iter().for_each(|corner| digest.numbers(&corner.to_array()));
    }
    digest.count(trimmed.exact.is_some().into());
    if let Some(exact) = &trimmed.exact {
        digest.number(exact.error());
        digest.count(exact.has_borders().into());
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::parse_scene_str;

    /// The identity of the twisted cube's picture, with texts of its scene exchanged.
    fn identity(changes: &[(&str, &str)]) -> PictureIdentity {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/feng_fig07.toml");
        let mut text = std::fs::read_to_string(&path).unwrap();
        for (from, to) in changes {
            assert!(text.contains(from), "{from}");
            text = text.replace(from, to);
        }
        let scene = parse_scene_str(&text, &path).unwrap();
        PictureIdentity::new(&scene, &scene.build().unwrap())
    }

    #[test]
    fn the_hash_is_of_what_the_scene_shows() {
        let own = identity(&[]);
        assert!(own.scene.len() == 32 && own == identity(&[]));
        let same = identity(&[("spp = 32", "spp = 48\nseed = 5"), ("480]", "480]\ncrop = [1, 2, 3, 4]")]);
        assert_eq!(same.scene, own.scene);
        assert_eq!(own.difference(&same).unwrap(), "film.crop, render.seed, render.spp");
        let more = identity(&[("spp = 32", "spp = 48")]);
        assert!(more != own && more.without_samples() == own.without_samples());
        let changes = [
            (("angle = 60.0", "angle = 60.000001"), "the scene"),
            (("mesh = \"meshes/ground.obj\"", "mesh = \"meshes/feng_fig07_cube.obj\""), "the scene"),
            (("name = \"cube\"", "name = \"die\""), "the scene"),
            (("0.33", "0.34"), "materials"),
            (("size = [640", "size = [641"), "film.size"),
        ];
        for ((from, to), what) in changes {
            let other = identity(&[(from, to)]);
            assert_ne!(other.scene, own.scene, "{to}");
            assert_eq!(own.difference(&other).unwrap(), what, "{to}");
        }
    }
}
