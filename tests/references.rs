//! Pictures against those of Mitsuba 3 in `refs`, by statistics: no difference that the noise does not explain.
//!
//! `refs/make.sh` renders the references from this program's exports. Every scene of `refs/scenes` has one, and asks for as
//! many samples as it takes for the variance that they show to be true.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use exr::prelude::{AttributeValue, ReadChannels, ReadLayers, Text, read, write_rgb_file};
use trimray::film::Aov;
use trimray::render::{RenderControl, Rendered, render};
use trimray::scene::{SceneDescription, parse_scene};
use trimray::shade::{Camera, ShadingScene};

/// Another one than any of Mitsuba's.
const SEED: u64 = 4711;

/// Greatest difference of mean radiance, unless the noise explains a greater one.
const MEAN: f64 = 0.003;

/// Standard deviations that noise explains.
const SIGMAS: f64 = 3.0;

/// Chance for one whole picture to fail a value's test if both programs compute the same (Šidák).
const SIGNIFICANCE: f64 = 0.01;

/// Share of the values that must pass.
const SHARE: f64 = 0.9975;

/// Relative variance below which a value has no noise, and the difference by rounding that it may have then.
const NOISELESS: f64 = 1e-12;
const ROUNDING: f64 = 1e-5;

/// Radiance and the variance of its mean: three colours of each pixel.
#[derive(Clone)]
struct Picture {
    size: [usize; 2],
    /// Colours one after the other.
    radiance: Vec<f64>,
    variance: Vec<f64>,
}

impl Picture {
    fn new(size: [usize; 2], mut channel: impl FnMut(&str) -> Vec<f64>) -> Self {
        let [radiance, variance] = [["R", "G", "B"], ["variance.R", "variance.G", "variance.B"]]
            .map(|names| names.map(&mut channel).concat());
        assert_eq!(radiance.len(), 3 * size[0] * size[1]);
        Self { size, radiance, variance }
    }

    #[expect(clippy::cast_possible_truncation, reason = "the file is in single precision")]
    fn write(&self, path: &Path) {
        let pixels = self.size[0] * self.size[1];
        write_rgb_file(path, self.size[0], self.size[1], |x, y| {
            let at = |colour: usize| self.radiance[colour * pixels + y * self.size[0] + x] as f32;
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
    let mut said = String::new();
    if ours.size != theirs.size {
        return (false, format!("size {:?}, want {:?}", ours.size, theirs.size));
    }
    let pixels = ours.size[0] * ours.size[1];
    let mut passes = true;
    for colour in 0..3 {
        let part = colour * pixels..(colour + 1) * pixels;
        let sum = |values: &[f64]| values[part.clone()].iter().sum::<f64>();
        let relative = sum(&ours.radiance) / sum(&theirs.radiance) - 1.0;
        let sigma = (sum(&ours.variance) + sum(&theirs.variance)).sqrt() / sum(&theirs.radiance);
        // NaN fails too
        passes &= relative.abs() <= MEAN.max(SIGMAS * sigma);
        let _ = write!(said, "{:+.3} % ({:+.2} sigma) ", 100.0 * relative, relative / sigma);
    }
    let (mut noisy, mut noiseless_off) = (Vec::new(), 0);
    for (index, (a, b)) in ours.radiance.iter().zip(&theirs.radiance).enumerate() {
        let variance = ours.variance[index] + theirs.variance[index];
        if variance > NOISELESS * b * b {
            noisy.push((a - b) * (a - b) / variance);
        } else if (a - b).abs() > ROUNDING * b.abs() {
            noiseless_off += 1;
        }
    }
    let bound = 1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / noisy.len().max(1) as f64);
    let passed = noisy.iter().filter(|&&z_sq| libm::erfc((0.5 * z_sq).sqrt()) > bound).count();
    let share = passed as f64 / noisy.len().max(1) as f64;
    let largest = noisy.iter().fold(0.0, |most: f64, &z_sq| most.max(z_sq)).sqrt();
    let mean_sq = noisy.iter().sum::<f64>() / noisy.len().max(1) as f64;
    passes &= share >= SHARE && noiseless_off == 0 && noisy.iter().all(|z_sq| z_sq.is_finite());
    let _ = write!(
        said,
        "| {:.3} % of {} values pass, largest |z| {largest:.2}, root mean square {:.3}",
        100.0 * share,
        noisy.len(),
        mean_sq.sqrt()
    );
    if noiseless_off > 0 {
        let _ = write!(said, ", {noiseless_off} WITHOUT NOISE ARE OFF");
    }
    (passes, said)
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
        let difference = ours.radiance.iter().zip(&theirs.radiance).map(|(a, b)| a - b).collect();
        let difference = Picture { radiance: difference, ..ours.clone() };
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
    assert!(!with(&|p| p.radiance.iter_mut().for_each(|x| *x *= 1.006)), "too bright");
    assert!(!with(&|p| p.radiance[pixels..].rotate_left(pixels)), "colours exchanged");
    assert!(!with(&|p| p.radiance.rotate_right(1)), "a pixel to the right");
    assert!(!with(&|p| p.radiance.rotate_left(width)), "a pixel up");
    assert!(!with(&|p| p.radiance[0] = f64::NAN), "no number");
    let patch = |p: &mut Picture| {
        // a speck of 6 x 6 pixels in the middle, 20 % too dark
        for y in height / 2 - 3..height / 2 + 3 {
            for x in width / 2 - 3..width / 2 + 3 {
                p.radiance[y * width + x] *= 0.8;
            }
        }
    };
    assert!(!with(&patch), "a speck");
}
