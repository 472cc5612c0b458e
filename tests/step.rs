//! STEP files through the real program.

mod common;

use common::TestFolder;

#[test]
fn step_files_say_what_they_hold() {
    let at = TestFolder::new();
    for name in ["x.step", "x.stp", "X.STEP"] {
        let run = at.succeed(&["export", "scene.toml", "-o", name]);
        assert!(run.stderr.contains("1 solid, "), "{}", run.stderr);
        assert!(run.stderr.trim_end().ends_with("exact"), "{}", run.stderr);
        let text = String::from_utf8(at.read(name)).unwrap();
        assert!(text.starts_with("ISO-10303-21;\n") && text.ends_with("END-ISO-10303-21;\n"));
        assert!(text.contains("MANIFOLD_SOLID_BREP") && text.contains("B_SPLINE_SURFACE_WITH_KNOTS"));
        assert!(text.contains("SI_UNIT(.MILLI.,.METRE.)") && text.contains("AP242"));
        assert!(text.contains(&format!("FILE_NAME('{name}'")));
    }
    at.succeed(&["export", "scene.toml", "-o", "inch.step", "--unit", "in", "--schema", "ap214", "--quiet"]);
    let text = String::from_utf8(at.read("inch.step")).unwrap();
    assert!(text.contains("'INCH'") && text.contains("AUTOMOTIVE_DESIGN"));
}

#[test]
fn the_same_scene_and_time_give_the_same_bytes() {
    let at = TestFolder::new();
    let text = || {
        at.succeed(&["export", "scene.toml", "-o", "x.step"]);
        let text = String::from_utf8(at.read("x.step")).unwrap();
        // the time is the header's alone
        text.split_once("FILE_SCHEMA").unwrap().1.to_owned()
    };
    assert_eq!(text(), text());
}

#[test]
fn what_has_no_step_form_is_refused() {
    let at = TestFolder::new();
    for (arguments, said) in [
        (&["--method", "pointwise:2"][..], "makes triangles"),
        (&["--method", "adaptive:1e-2"], "makes triangles"),
        (&["--level", "2"], "--level is for triangles"),
        (&["--unit", "furlong"], "furlong"),
        (&["--schema", "ap209"], "ap209"),
        (&["--tolerance=-1"], "tolerance"),
    ] {
        at.refuse(&[&["export", "scene.toml", "-o", "x.step"], arguments].concat(), &[said]);
    }
}
