//! Pictures judged, and folders searched.

use std::fs;
use std::path::Path;

use super::*;
use crate::difference::Judge;
use crate::film::{Area, LayeredChannel, LayeredPicture, Numbers, Part, Recorded, SampleKind};

/// A picture of 20 x 10 pixels; each channel has one value.
fn picture(channels: &[(&str, f32)]) -> LayeredPicture {
    let area = Area { x: 0, y: 0, width: 20, height: 10 };
    let channel = |&(name, value): &(&str, f32)| LayeredChannel {
        name: name.to_owned(),
        kind: SampleKind::Float,
        numbers: Numbers::Real(vec![value; area.pixels()]),
    };
    LayeredPicture {
        format: "OpenEXR",
        display: area,
        parts: vec![Part { name: None, data: area, channels: channels.iter().map(channel).collect() }],
        srgb_encoded: false,
        recorded: Recorded::default(),
        notes: Vec::new(),
    }
}

fn failures(reference: &LayeredPicture, test: &LayeredPicture) -> String {
    judge(reference, test, &JudgeSettings::default()).failures.join("; ")
}

const GREY: [(&str, f32); 3] = [("R", 0.5), ("G", 0.5), ("B", 0.5)];

fn with(more: &[(&'static str, f32)]) -> LayeredPicture {
    picture(&[&GREY, more].concat())
}

#[test]
fn references_without_variance_are_met_by_value() {
    let (reference, test) = (with(&[("object.I", 3.0)]), with(&[("object.I", 3.0), ("A", 1.0)]));
    let judged = judge(&reference, &test, &JudgeSettings::default());
    assert_eq!((judged.by, judged.failures.len()), (Judge::Thresholds, 0), "{:?}", judged.failures);
    assert_eq!(judged.figures(), "identical, FLIP 0.0000");
    assert!(failures(&reference, &with(&[("object.I", 4.0)])).contains("200 of 200 pixels differ (object)"));
    let lenient = JudgeSettings { fail: 2.0, ..JudgeSettings::default() };
    assert_eq!(judge(&reference, &with(&[("object.I", 4.0)]), &lenient).failures.len(), 1, "ids are exact");
    assert!(failures(&reference, &with(&[])).contains("object.I"), "a layer is missing");
    let strict = JudgeSettings { ztest: true, ..JudgeSettings::default() };
    assert!(judge(&reference, &test, &strict).failures[0].contains("variance"));
}

#[test]
fn noise_is_allowed_what_it_explains() {
    let variance = [("variance.R", 1e-4), ("variance.G", 1e-4), ("variance.B", 1e-4)];
    let more = |depth| with(&[variance.as_slice(), &[("depth.T", depth)]].concat());
    let judged = judge(&more(1.0), &more(2.0), &JudgeSettings::default());
    assert_eq!((judged.by, judged.failures.len()), (Judge::ZTest, 0), "{:?}", judged.failures);
    assert!(judged.notes.iter().any(|note| note.contains("depth")), "{:?}", judged.notes);
    let mut off = more(1.0);
    let Numbers::Real(red) = &mut off.parts[0].channels[0].numbers else { panic!("real") };
    red.iter_mut().for_each(|value| *value += 0.01);
    assert!(failures(&more(1.0), &off).contains("noise does not explain"));
}

#[test]
fn values_that_are_not_finite_fail_in_both_too() {
    for variance in [[].as_slice(), &[("variance.R", 0.1), ("variance.G", 0.1), ("variance.B", 0.1)]] {
        let fine = with(variance);
        for channel in 0..fine.parts[0].channels.len() {
            let mut broken = fine.clone();
            let Numbers::Real(values) = &mut broken.parts[0].channels[channel].numbers else {
                panic!("real")
            };
            values[41] = f32::NAN;
            assert!(failures(&fine, &broken).contains("the test has 1 values"));
            assert!(failures(&broken, &fine).contains("the reference has 1 values"));
            assert!(failures(&broken, &broken).contains("NaN at (1, 2, "));
        }
    }
}

#[test]
fn references_that_know_no_windows_may_be_crops() {
    let (reference, mut test) = (with(&[]), with(&[]));
    test.parts[0].data.x = 30;
    test.display.width = 100;
    assert_eq!(failures(&reference, &test), "");
    let own = Recorded { scene_hash: Some("abc".into()), ..Recorded::default() };
    let own = LayeredPicture { recorded: own, ..reference };
    assert!(!failures(&own, &test).is_empty(), "this program writes windows");
}

#[test]
fn scenes_are_found_with_their_references() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let found = || find_tests(folder.path(), None);
    assert!(matches!(found(), Err(FolderError::NoScenes { .. })));
    fs::create_dir(at("scenes")).unwrap();
    for name in ["scenes/b.toml", "scenes/a.toml", "scenes/notes.txt", "a.exr", "old.exr"] {
        fs::write(at(name), "").unwrap();
    }
    let layout = found().unwrap();
    let names: Vec<_> = layout.tests.iter().map(|test| test.name.as_str()).collect();
    assert_eq!(names, ["a", "b"]);
    assert_eq!(layout.tests[0].reference, at("a.exr"));
    assert_eq!(layout.tests[1].reference, at("b.exr"), "where it belongs");
    assert_eq!(layout.unused, [at("old.exr")]);
    fs::write(at("scenes/a.exr"), "").unwrap();
    assert_eq!(found().unwrap().tests[0].reference, at("scenes/a.exr"), "beside the scene first");
    // seen from the scenes' own folder, others are none of its business
    let inner = find_tests(&at("scenes"), None).unwrap();
    assert_eq!((inner.tests[1].reference.clone(), inner.unused.len()), (at("scenes/b.exr"), 0));
    assert!(matches!(find_tests(Path::new("no such folder"), None), Err(FolderError::Read { .. })));
    let elsewhere = find_tests(folder.path(), Some(&at("scenes"))).unwrap();
    assert_eq!(elsewhere.tests[1].reference, at("scenes/b.exr"));
}
