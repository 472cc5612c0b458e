//! Pictures against those of Mitsuba 3 in `refs`, by statistics: no difference that the noise does not explain.
//!
//! `refs/make.sh` renders the references from this program's exports. Every scene of `refs/scenes` has one, and asks for as
//! many samples as it takes for the variance that they show to be true. `trimray test refs` is the same test with a page to look
//! at.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use trimray::difference::{Judge, difference_layers};
use trimray::film::{LayeredPicture, Numbers, write_layers};
use trimray::reference_test::{
    JudgeSettings, SceneTest, TestFolder, TestResult, TestSettings, find_tests, judge, run_test,
};
use trimray::render::RenderControl;

fn references() -> TestFolder {
    find_tests(&Path::new(env!("CARGO_MANIFEST_DIR")).join("refs"), None).unwrap()
}

fn run(test: &SceneTest) -> TestResult {
    let cancel = AtomicBool::new(false);
    run_test(test, &TestSettings::default(), &RenderControl::new(&cancel)).unwrap()
}

/// Writes both pictures and their difference for a look at what is wrong.
fn write_failure(name: &str, result: &TestResult) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("../references");
    fs::create_dir_all(&folder).unwrap();
    let write = |which: &str, picture: &LayeredPicture| {
        write_layers(&folder.join(format!("{name}_{which}.exr")), picture).unwrap();
    };
    if let (Some(theirs), Some(ours)) = (&result.reference, &result.picture) {
        let ours = ours.layers();
        write("trimray", &ours);
        write("mitsuba", theirs);
        if let Ok(difference) = difference_layers(theirs, &ours, true, false, 1.0) {
            write("difference", &difference);
        }
    }
    folder
}

#[test]
fn every_scene_is_the_picture_that_mitsuba_renders() {
    let (mut failed, mut checked) = (Vec::new(), 0);
    let found = references();
    assert!(found.unused.is_empty(), "of no scene: {:?}", found.unused);
    for test in &found.tests {
        let (name, result) = (&test.name, run(test));
        if let Some(judged) = &result.judgement {
            println!("{name}: {}", judged.figures());
            assert_eq!(judged.by, Judge::ZTest, "{name}: the reference has its variance");
        }
        if let Some(reference) = &result.reference {
            assert!(reference.recorded.reference_scene.is_some(), "{name}: the reference tells of its scene");
        }
        checked += 1;
        if !result.passes() {
            let folder = write_failure(name, &result);
            failed.push(format!("{name}: {}; see {}", result.failures.join("; "), folder.display()));
        }
    }
    assert!(checked >= 12, "{checked} scenes");
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

/// The values of a picture's channel.
fn values<'a>(picture: &'a mut LayeredPicture, name: &str) -> &'a mut Vec<f32> {
    let channel = picture.parts[0].channels.iter_mut().find(|channel| channel.name == name);
    match &mut channel.unwrap().numbers {
        Numbers::Real(values) => values,
        Numbers::Whole(_) => panic!("{name} is of whole numbers"),
    }
}

#[test]
fn wrong_pictures_are_told_from_noise() {
    let found = references();
    let test = found.tests.iter().find(|test| test.name == "diffuse_constant").unwrap();
    let result = run(test);
    assert!(result.passes(), "{:?}", result.failures);
    let (theirs, ours) = (result.reference.unwrap(), result.picture.unwrap().layers());
    let with = |change: &dyn Fn(&mut LayeredPicture)| {
        let mut changed = ours.clone();
        change(&mut changed);
        judge(&theirs, &changed, &JudgeSettings::default()).failures.is_empty()
    };
    let each = |change: fn(&mut Vec<f32>, usize)| {
        move |picture: &mut LayeredPicture| {
            let width = picture.parts[0].data.width as usize;
            ["R", "G", "B"].iter().for_each(|name| change(values(picture, name), width));
        }
    };
    assert!(with(&|_| ()));
    assert!(!with(&each(|colour, _| colour.iter_mut().for_each(|x| *x *= 1.006))), "too bright");
    assert!(!with(&each(|colour, _| colour.rotate_right(1))), "a pixel to the right");
    assert!(!with(&each(|colour, width| colour.rotate_left(width))), "a pixel up");
    assert!(!with(&|p| values(p, "R")[0] = f32::NAN), "no number");
    assert!(!with(&|p| values(p, "variance.G")[5] = f32::INFINITY), "no variance");
    let exchanged = |picture: &mut LayeredPicture| {
        let (red, blue) = (values(picture, "R").clone(), values(picture, "B").clone());
        *values(picture, "R") = blue;
        *values(picture, "B") = red;
    };
    assert!(!with(&exchanged), "colours exchanged");
    let speck = |picture: &mut LayeredPicture| {
        // 6 x 6 pixels in the middle, 20 % too dark
        let [width, height] = [picture.parts[0].data.width as usize, picture.parts[0].data.height as usize];
        for y in height / 2 - 3..height / 2 + 3 {
            for x in width / 2 - 3..width / 2 + 3 {
                values(picture, "R")[y * width + x] *= 0.8;
            }
        }
    };
    assert!(!with(&speck), "a speck");
}
