//! Pictures with known differences.

use super::*;
use crate::difference::testing::{picture, values};
use crate::film::{Area, Numbers, SampleKind};

const ALL: [(&str, f32); 9] = [
    ("R", 0.5),
    ("G", 0.25),
    ("B", 0.125),
    ("A", 1.0),
    ("depth.T", 10.0),
    ("normal.X", 0.0),
    ("normal.Y", 0.0),
    ("normal.Z", 1.0),
    ("object.I", 3.0),
];

fn changed(change: impl Fn(&mut LayeredPicture)) -> [LayeredPicture; 2] {
    let mut test = picture([16, 8], &ALL);
    change(&mut test);
    [picture([16, 8], &ALL), test]
}

fn found([reference, test]: &[LayeredPicture; 2], rules: &[(&str, &str)], fail: f32) -> Comparison {
    let settings = CompareSettings {
        thresholds: Thresholds { fail, warn: fail, ..Thresholds::default() },
        rules: rules.iter().map(|(name, rule)| LayerRule::parse(name, rule).unwrap()).collect(),
        ..CompareSettings::default()
    };
    compare(reference, test, &settings).unwrap()
}

#[test]
fn equal_pictures_pass() {
    let found = found(&changed(|_| ()), &[], 0.0);
    assert_eq!((found.status, found.failing, found.figures.psnr()), (Status::Pass, 0, f64::INFINITY));
    let names: Vec<_> = found.layers.iter().map(|layer| layer.name.as_str()).collect();
    assert_eq!(names, ["color", "depth", "normal", "object"]);
    assert!(found.worst.is_empty() && found.figures.values == 9 * 128);
}

#[test]
fn a_pixel_counts_once() {
    let pictures = changed(|test| {
        for name in ["R", "G", "depth.T"] {
            values(test, name)[5] += 0.5;
        }
        values(test, "B")[6] += 0.25;
    });
    let found = found(&pictures, &[], 1e-6);
    assert_eq!((found.status, found.failing, found.warning), (Status::Fail, 2, 2));
    let place = found.figures.max_place.clone().unwrap();
    assert_eq!((place.x, place.channel.as_str(), place.reference, place.test), (5, "R", 0.5, 1.0));
    let want = (0.5 * 3.0 + 0.25) / (9.0 * 128.0);
    assert!((found.figures.mean_error() / want - 1.0).abs() < 1e-12);
    assert_eq!(found.layers[0].failing, 2);
    assert_eq!(found.layers[1].failing, 1);
}

#[test]
fn percentages_are_of_all_layers_together() {
    let pictures = changed(|test| {
        values(test, "R")[0] += 0.5;
        values(test, "depth.T")[1] += 0.5;
    });
    let settings = |failpercent| CompareSettings {
        thresholds: Thresholds { failpercent, warnpercent: 100.0, ..Thresholds::default() },
        ..CompareSettings::default()
    };
    let status = |percent| compare(&pictures[0], &pictures[1], &settings(percent)).unwrap().status;
    // 2 of 128 are 1.5625 %
    assert_eq!((status(1.0), status(1.6)), (Status::Fail, Status::Pass));
}

#[test]
fn ids_are_exact() {
    let pictures = changed(|test| values(test, "object.I")[7] += 1.0);
    let lax = found(&pictures, &[], 10.0);
    assert_eq!(lax.status, Status::Fail);
    let object = &lax.layers[3];
    assert_eq!((object.kind, object.failing), (LayerKind::Id, 1));
    assert!((object.figures.equal_share() - 127.0 / 128.0).abs() < 1e-12);
    assert_eq!(found(&pictures, &[("object", "fail=1,warn=1")], 0.0).status, Status::Pass);
    let mut whole = changed(|_| ());
    for (picture, id) in whole.iter_mut().zip([u32::MAX, u32::MAX - 1]) {
        let part = &mut picture.parts[0];
        let last = part.channels.last_mut().unwrap();
        (last.kind, last.numbers) = (SampleKind::Uint, Numbers::Whole(vec![id; 128]));
    }
    let exact = found(&whole, &[], 10.0);
    assert_eq!((exact.status, exact.layers[3].figures.max_error), (Status::Fail, 1.0));
}

#[test]
fn layers_have_their_own_thresholds() {
    let pictures = changed(|test| {
        values(test, "depth.T")[3] += 0.5;
        values(test, "normal.X")[4] = 0.01;
        values(test, "A")[5] = 0.0;
    });
    assert_eq!(found(&pictures, &[], 1e-6).failing, 3);
    let rules = [("depth", "fail=1,warn=1"), ("normal", "degrees=1"), ("A", "ignore")];
    let ruled = found(&pictures, &rules, 1e-6);
    assert_eq!((ruled.status, ruled.failing), (Status::Pass, 0));
    let angles = ruled.layers[2].angles.unwrap();
    assert!((angles.max - 0.01_f64.atan().to_degrees()).abs() < 1e-6, "{angles:?}");
    assert_eq!(found(&pictures, &[("normal", "degrees=0.5"), rules[0], rules[2]], 1e-6).failing, 1);
    assert_eq!(found(&pictures, &[("RGBA", "ignore"), rules[0], rules[1]], 1e-6).status, Status::Pass);
    let ulp = found(&pictures, &[("depth.T", "ulp=3"), rules[1], rules[2]], 1e-6);
    assert_eq!((ulp.status, ulp.layers[1].figures.max_ulp), (Status::Fail, 1 << 19));
}

#[test]
fn broken_values_fail_whatever_is_asked() {
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let pictures = changed(|test| values(test, "depth.T")[9] = value);
        let found = found(&pictures, &[("depth", "fail=1e30,failpercent=100,allowfailures=999")], 1e30);
        assert_eq!((found.status, found.figures.non_finite), (Status::Fail, 1));
        let place = found.figures.non_finite_place.unwrap();
        assert_eq!((place.x, place.channel.as_str()), (9, "depth.T"));
        assert_eq!(found.worst[0].x, 9);
    }
}

#[test]
fn unknown_layers_are_refused() {
    let [a, b] = changed(|_| ());
    let rules = vec![LayerRule::parse("dept", "fail=1").unwrap()];
    let error = compare(&a, &b, &CompareSettings { rules, ..CompareSettings::default() }).unwrap_err();
    let said = error.to_string();
    assert!(
        said.contains("did you mean \"depth\"?") && said.contains("color, depth, normal, object"),
        "{said}"
    );
}

#[test]
fn the_z_test_judges_colours() {
    let names = [
        ("R", 0.5),
        ("G", 0.5),
        ("B", 0.5),
        ("A", 1.0),
        ("variance.R", 1e-4),
        ("variance.G", 1e-4),
        ("variance.B", 1e-4),
    ];
    let (a, mut b) = (picture([16, 8], &names), picture([16, 8], &names));
    let test = |b: &LayeredPicture| {
        compare(&a, b, &CompareSettings { ztest: true, ..CompareSettings::default() }).unwrap()
    };
    values(&mut b, "G")[3] += 0.02;
    values(&mut b, "A")[3] = 0.0;
    values(&mut b, "variance.R")[3] = 2e-4;
    let passes = test(&b);
    assert_eq!(passes.status, Status::Pass, "{}", passes.ztest.unwrap());
    assert_eq!((passes.layers[0].judge, passes.layers[1].judge), (Judge::ZTest, Judge::Nothing));
    values(&mut b, "G").iter_mut().for_each(|green| *green += 0.01);
    assert_eq!(test(&b).status, Status::Fail);
    values(&mut b, "G").fill(0.5);
    assert_eq!(test(&b).status, Status::Pass);
    values(&mut b, "A")[0] = f32::NAN;
    assert_eq!(test(&b).status, Status::Fail, "NaN is a failure where nothing else is judged");
    let [plain, other] = changed(|_| ());
    let error = compare(&plain, &other, &CompareSettings { ztest: true, ..CompareSettings::default() });
    assert!(error.unwrap_err().to_string().contains("aovs = [\"variance\"]"));
}

#[test]
fn only_what_both_have_is_compared_if_asked() {
    let mut pictures = changed(|_| ());
    pictures[1].parts[0].data = Area { x: 4, y: 2, width: 16, height: 8 };
    let [a, b] = &pictures;
    assert!(matches!(compare(a, b, &CompareSettings::default()), Err(CompareError::Different(_))));
    let found = compare(a, b, &CompareSettings { overlap: true, ..CompareSettings::default() }).unwrap();
    assert_eq!((found.pixels, found.status), (12 * 6, Status::Pass));
    assert!(found.notes[0].contains("12x6 at 4,2"), "{:?}", found.notes);
}
