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

/// A sphere that a cubic lattice bends: its pieces meet in curves, at the lattice's knot planes.
const BALL: &str = "[[object]]\nname = \"ball\"\nsurface = { type = \"sphere\", radius = 1.0 }\n\
    [[object.deform]]\ntype = \"ffd\"\ndegree = [3, 3, 3]\npoints = [5, 5, 5]\n\
    [[object.deform.edit]]\ntwist = { axis = \"z\", angle = 60 }\n";

/// Faces that a report tells.
fn faces(said: &str) -> usize {
    let words: Vec<_> = said.split_whitespace().collect();
    let place = words.iter().position(|word| word.starts_with("faces")).expect("a report tells of faces");
    words[place - 1].parse().expect("a number of them")
}

#[test]
fn pieces_that_meet_in_curves_are_written_within_the_tolerance() {
    let at = TestFolder::new();
    at.write("ball.toml", BALL);
    let said = |tolerance: &[&str]| {
        at.succeed(&[&["export", "ball.toml", "-o", "ball.step"], tolerance].concat()).stderr
    };
    let (fine, coarse) = (said(&[]), said(&["--tolerance", "1e-3"]));
    for said in [&fine, &coarse] {
        assert!(said.contains("ball: 1 solid, ") && said.contains("within "), "{said}");
    }
    assert!(faces(&coarse) < faces(&fine), "{coarse} {fine}");
}

#[test]
fn kinks_and_tears_that_are_curves_are_refused() {
    let at = TestFolder::new();
    let ball = "[[object]]\nname = \"ball\"\nsurface = { type = \"sphere\", radius = 1.0 }\n";
    // a lattice that is linear between its knot planes, and one that ends within the ball
    let kink = "[[object.deform]]\ntype = \"ffd\"\ndegree = [1, 1, 1]\npoints = [4, 4, 4]\n\
        [[object.deform.edit]]\nmove = [1, 2, 3]\nby = [0.2, 0.1, 0.3]\n";
    let tear = "[[object.deform]]\ntype = \"ffd\"\ndegree = [2, 2, 2]\npoints = [4, 4, 4]\n\
        bounds = [[-2, -2, -2], [0.3, 2, 2]]\noutside = \"keep\"\n\
        [[object.deform.edit]]\nmove = [3, 2, 2]\nby = [0.2, 0.1, 0.3]\n";
    for deform in [kink, tear] {
        at.write("ball.toml", format!("{ball}{deform}"));
        at.refuse(
            &["export", "ball.toml", "-o", "ball.step"],
            &["\"ball\"", "faces end in curves", "tears or has a kink", ".obj and .ply"],
        );
        assert!(!at.files().contains(&"ball.step".to_owned()));
    }
}
