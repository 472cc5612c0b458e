//! Pictures against those of Mitsuba 3 in `refs`, by statistics: no difference that the noise does not explain.
//!
//! `refs/make.sh` renders the references from this program's exports. Every scene of `refs/scenes` has one, and asks for as
//! many samples as it takes for the variance that they show to be true.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use exr::prelude::{AttributeValue, ReadChannels, ReadLayers, Text, read, write_rgb_file};
use trimray::difference::{Estimate, z_test};
use trimray::film::Aov;
use trimray::render::{RenderControl, Rendered, render};
use trimray::scene::{SceneDescription, parse_scene};
use trimray::shade::{Camera, ShadingScene};

/// Another one than any of Mitsuba's.
const SEED: u64 = 4711;

/// Radiance and the variance of its mean: three colours of each pixel.
#[derive(Clone)]
struct Picture {
    size: [usize; 2],
    /// Colours one after the other.
    estimate: Estimate,
}

impl Picture {
    fn new(size: [usize; 2], mut channel: impl FnMut(&str) -> Vec<f64>) -> Self {
        let [radiance, variance] = [["R", "G", "B"], ["variance.R", "variance.G", "variance.B"]]
            .map(|names| names.map(&mut channel).concat());
        assert_eq!(radiance.len(), 3 * size[0] * size[1]);
        Self { size, estimate: Estimate { radiance, variance, colours: 3 } }
    }

    #[expect(clippy::cast_possible_truncation, reason = "the file is in single precision")]
    fn write(&self, path: &Path) {
        let pixels = self.size[0] * self.size[1];
        write_rgb_file(path, self.size[0], self.size[1], |x, y| {
            let at = |colour: usize| self.estimate.radiance[colour * pixels + y * self.size[0] + x] as f32;
            (at(0), at(1), at(2))
        })
        .unwrap();
    }
}

/// The reference and the hash of the scene that it was made from.
fn reference(path: &Path) -> (Picture, String) {
    let file = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .unwrap_or_else(|error| panic!("{}: {error}; refs/make.sh makes it", path.display()));
    let layer = file.layer_data;
    let channel = |name: &str| {
        let found = layer.channel_data.list.iter().find(|channel| channel.name == *name);
        let values = found.unwrap_or_else(|| panic!("{}: no channel {name}", path.display()));
        values.sample_data.values_as_f32().map(f64::from).collect()
    };
    let picture = Picture::new([layer.size.0, layer.size.1], channel);
    let key = Text::from("reference/scene");
    let attributes = layer.attributes.other.iter().chain(&file.attributes.other);
    let hash = attributes.filter(|(name, _)| **name == key).find_map(|(_, value)| match value {
        AttributeValue::Text(text) => Some(text.to_string()),
        _ => None,
    });
    (picture, hash.unwrap_or_default())
}

/// FNV-1a (64 bits) of a scene file and of the meshes that it names.
fn fnv(scene: &SceneDescription) -> String {
    let mut state: u64 = 0xcbf2_9ce4_8422_2325;
    for path in std::iter::once(scene.path.as_path())
        .chain(scene.objects.iter().filter_map(|object| object.shape.mesh()))
    {
        for byte in fs::read(path).unwrap() {
            state = (state ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
    }
    format!("{state:016x}")
}

fn ours(mut scene: SceneDescription) -> Picture {
    scene.render.seed = SEED;
    scene.render.aovs = vec![Aov::Variance];
    let built = scene.build().unwrap();
    let shading =
        ShadingScene { geometry: &built.traced, object_materials: &built.materials, lights: &built.lights };
    let camera = Camera::try_new(&built.camera, scene.film.size).unwrap();
    let cancel = AtomicBool::new(false);
    let control = RenderControl::new(&cancel);
    let Rendered { image, statistics, .. } =
        render(&shading, &camera, &scene.film, &scene.render, &control).unwrap();
    assert_eq!(statistics.non_finite_samples, 0);
    let window = image.data_window();
    Picture::new([window.width as usize, window.height as usize], |name| {
        image.channel(name).unwrap().iter().copied().map(f64::from).collect()
    })
}

/// Whether the pictures are the same but for noise, and what was found.
fn compare(ours: &Picture, theirs: &Picture) -> (bool, String) {
    if ours.size != theirs.size {
        return (false, format!("size {:?}, want {:?}", ours.size, theirs.size));
    }
    let found = z_test(&theirs.estimate, &ours.estimate);
    (found.passes, found.to_string())
}

fn scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("refs/scenes");
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut scenes: Vec<_> =
        entries.filter(|path| path.extension().is_some_and(|extension| extension == "toml")).collect();
    scenes.sort();
    scenes
}

fn reference_of(scene: &Path) -> PathBuf {
    let name = scene.file_stem().unwrap().to_string_lossy();
    Path::new(env!("CARGO_MANIFEST_DIR")).join("refs").join(format!("{name}.exr"))
}

/// Writes both pictures and their difference for a look at what is wrong.
fn write_failure(name: &str, ours: &Picture, theirs: &Picture) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("../references");
    fs::create_dir_all(&folder).unwrap();
    ours.write(&folder.join(format!("{name}_trimray.exr")));
    theirs.write(&folder.join(format!("{name}_mitsuba.exr")));
    if ours.size == theirs.size {
        let mut difference = ours.clone();
        for (a, b) in difference.estimate.radiance.iter_mut().zip(&theirs.estimate.radiance) {
            *a -= b;
        }
        difference.write(&folder.join(format!("{name}_difference.exr")));
    }
    folder
}

#[test]
fn every_scene_is_the_picture_that_mitsuba_renders() {
    let (mut failed, mut checked) = (Vec::new(), 0);
    for path in scenes() {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let scene = parse_scene(&path).unwrap_or_else(|error| panic!("{error}"));
        let (theirs, hash) = reference(&reference_of(&path));
        assert_eq!(
            hash,
            fnv(&scene),
            "refs/{name}.exr is of another scene; refs/make.sh {name} makes it anew"
        );
        let ours = ours(scene);
        let (passes, said) = compare(&ours, &theirs);
        println!("{name}: {said}");
        checked += 1;
        if !passes {
            let folder = write_failure(&name, &ours, &theirs);
            failed.push(format!("{name}: {said}; see {}", folder.display()));
        }
    }
    assert!(checked >= 12, "{checked} scenes");
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn wrong_pictures_are_told_from_noise() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("refs/scenes/diffuse_constant.toml");
    let (theirs, _) = reference(&reference_of(&path));
    let ours = ours(parse_scene(&path).unwrap());
    assert!(compare(&ours, &theirs).0);
    let with = |change: &dyn Fn(&mut Picture)| {
        let mut changed = ours.clone();
        change(&mut changed);
        compare(&changed, &theirs).0
    };
    let [width, height] = ours.size;
    let pixels = width * height;
    assert!(!with(&|p| p.estimate.radiance.iter_mut().for_each(|x| *x *= 1.006)), "too bright");
    assert!(!with(&|p| p.estimate.radiance[pixels..].rotate_left(pixels)), "colours exchanged");
    assert!(!with(&|p| p.estimate.radiance.rotate_right(1)), "a pixel to the right");
    assert!(!with(&|p| p.estimate.radiance.rotate_left(width)), "a pixel up");
    assert!(!with(&|p| p.estimate.radiance[0] = f64::NAN), "no number");
    let patch = |p: &mut Picture| {
        // a speck of 6 x 6 pixels in the middle, 20 % too dark
        for y in height / 2 - 3..height / 2 + 3 {
            for x in width / 2 - 3..width / 2 + 3 {
                p.estimate.radiance[y * width + x] *= 0.8;
            }
        }
    };
    assert!(!with(&patch), "a speck");
}
