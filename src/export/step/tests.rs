use std::collections::HashMap;

use super::*;
use crate::subdivide::FrameChoice;
use crate::test_support::{Noise, ball_triangles, cube_triangles, deform, random_volume};

/// The instances of a file by their names.
struct File {
    instances: HashMap<u32, String>,
}

impl File {
    fn new(text: &str) -> Self {
        let data = text.split_once("DATA;\n").and_then(|(_, rest)| rest.split_once("ENDSEC;")).unwrap().0;
        let instances = data.lines().map(|line| {
            let (id, definition) = line.split_once('=').unwrap();
            (id[1..].parse().unwrap(), definition.trim_end_matches(';').to_owned())
        });
        let file = Self { instances: instances.collect() };
        for definition in file.instances.values() {
            assert!(
                references(definition).iter().all(|id| file.instances.contains_key(id)),
                "all instances are there: {definition}"
            );
        }
        file
    }

    fn all(&self, keyword: &str) -> Vec<&str> {
        let start = format!("{keyword}(");
        self.instances
            .values()
            .map(String::as_str)
            .filter(|definition| definition.starts_with(&start))
            .collect()
    }

    fn count(&self, keyword: &str) -> usize {
        self.all(keyword).len()
    }
}

/// The instances that a definition names.
fn references(definition: &str) -> Vec<u32> {
    let parts = definition.split('#').skip(1);
    parts.map(|part| part.split(|c: char| !c.is_ascii_digit()).next().unwrap().parse().unwrap()).collect()
}

fn settings() -> StepSettings {
    StepSettings {
        unit: LengthUnit::Millimetre,
        schema: Schema::Ap242,
        file_name: "test.step".to_owned(),
        time_stamp: "2026-01-01T00:00:00".to_owned(),
    }
}

fn written(shell: &Shell) -> (File, StepReport) {
    let object = StepObject { name: "part", shell, colour: None, group: &|_| None };
    let (text, mut reports) = step(&[object], &settings()).unwrap();
    (File::new(&text), reports.remove(0))
}

/// Every edge of a solid is used once in each direction.
fn assert_closed(file: &File) {
    let mut uses: HashMap<u32, [usize; 2]> = HashMap::new();
    for oriented in file.all("ORIENTED_EDGE") {
        uses.entry(references(oriented)[0]).or_default()[usize::from(oriented.ends_with(".T.)"))] += 1;
    }
    assert_eq!(uses.len(), file.count("EDGE_CURVE"));
    assert!(uses.values().all(|uses| *uses == [1, 1]), "{uses:?}");
}

fn turned(triangles: &[[DVec3; 3]], scale: f64, offset: DVec3) -> Vec<[DVec3; 3]> {
    triangles.iter().map(|&[a, b, c]| [a, c, b].map(|corner| offset + scale * (corner - 0.5))).collect()
}

#[test]
fn a_cube_is_six_planes_and_twelve_lines() {
    let (file, report) = written(&deform(&cube_triangles(), None, FrameChoice::Parallelogram));
    assert_eq!((report.solids, report.faces, report.edges, report.degree), (1, 6, 12, 1));
    let counts = [
        "PLANE",
        "LINE",
        "EDGE_CURVE",
        "VERTEX_POINT",
        "MANIFOLD_SOLID_BREP",
        "CLOSED_SHELL",
        "SURFACE_CURVE",
    ];
    assert_eq!(counts.map(|keyword| file.count(keyword)), [6, 12, 12, 8, 1, 1, 0]);
    assert_closed(&file);
}

#[test]
fn deformed_solids_share_their_edges() {
    let mut noise = Noise(12);
    for rational in [false, true] {
        let volume = random_volume(&mut noise, [2; 3], [5; 3], 0.1, rational);
        for triangles in [cube_triangles(), ball_triangles()] {
            let (file, report) = written(&deform(&triangles, Some(&volume), FrameChoice::Parallelogram));
            assert_eq!((report.solids, report.open_shells, report.error), (1, 0, 0.0));
            assert_eq!(file.count("ADVANCED_FACE"), report.faces);
            assert_eq!(file.count("EDGE_CURVE"), report.edges);
            assert_eq!(file.count("PCURVE"), 2 * report.edges);
            assert!(report.degree <= 6, "an edge moves along three axes: {}", report.degree);
            assert_closed(&file);
        }
    }
}

#[test]
fn cavities_are_voids_and_what_is_inside_out_is_turned() {
    let ball = ball_triangles();
    let cavity = turned(&ball, 0.4, DVec3::splat(0.5));
    let volume = random_volume(&mut Noise(4), [2; 3], [4; 3], 0.05, false);
    for volume in [None, Some(&volume)] {
        let hollow = deform(&[cube_triangles(), cavity.clone()].concat(), volume, FrameChoice::Parallelogram);
        let (file, report) = written(&hollow);
        assert_eq!((report.solids, report.voids, report.turned), (1, 1, 0));
        let counts = ["BREP_WITH_VOIDS", "ORIENTED_CLOSED_SHELL", "MANIFOLD_SOLID_BREP"];
        assert_eq!(counts.map(|keyword| file.count(keyword)), [1, 1, 0]);
        assert_closed(&file);
        // beside the cube, and turned about, it is a solid that is inside out
        let (file, report) = written(&deform(&cavity, volume, FrameChoice::Parallelogram));
        assert_eq!((report.solids, report.voids, report.turned), (1, 0, 1));
        assert!(file.all("ADVANCED_FACE").iter().all(|face| face.ends_with(".F.)")));
    }
    let apart = turned(&ball, 0.4, DVec3::splat(2.0));
    let (_, report) = written(&deform(&[cube_triangles(), apart].concat(), None, FrameChoice::Parallelogram));
    assert_eq!((report.solids, report.voids, report.turned), (2, 0, 1));
}

#[test]
fn what_is_not_closed_is_an_open_shell() {
    let triangles = cube_triangles();
    let (file, report) = written(&deform(&triangles[2..], None, FrameChoice::Parallelogram));
    assert_eq!((report.solids, report.open_shells), (0, 1));
    assert_eq!((file.count("OPEN_SHELL"), file.count("SHELL_BASED_SURFACE_MODEL")), (1, 1));
    assert_eq!(file.count("MANIFOLD_SURFACE_SHAPE_REPRESENTATION"), 1);
}

#[test]
fn faces_have_the_names_of_their_groups_and_parts_their_colours() {
    let shell = deform(&cube_triangles(), None, FrameChoice::Parallelogram);
    // the two triangles of a side in groups of different names are two faces
    let group = |face: u32| Some(if face == 0 { "it's one" } else { "rest" });
    let object =
        StepObject { name: "teil Ø", shell: &shell, colour: Some(DVec3::new(0.1, 0.2, 0.3)), group: &group };
    let (text, reports) = step(&[object, object], &settings()).unwrap();
    let file = File::new(&text);
    assert_eq!(reports[0].faces, 7);
    assert_eq!(text.matches("ADVANCED_FACE('it''s one'").count(), 2);
    assert_eq!(text.matches("PRODUCT('teil \\X2\\00D8\\X0\\'").count(), 2);
    assert_eq!((file.count("STYLED_ITEM"), file.count("COLOUR_RGB")), (2, 2));
    assert!(text.contains("COLOUR_RGB('',0.1,0.2,0.3)"));
}

#[test]
fn schemas_and_units_are_named() {
    let shell = deform(&cube_triangles(), None, FrameChoice::Parallelogram);
    let object = StepObject { name: "part", shell: &shell, colour: None, group: &|_| None };
    for (schema, unit, named) in [
        (Schema::Ap203, LengthUnit::Inch, ["CONFIG_CONTROL_DESIGN", "'INCH'"]),
        (Schema::Ap214, LengthUnit::Metre, ["AUTOMOTIVE_DESIGN", "SI_UNIT($,.METRE.)"]),
        (Schema::Ap242, LengthUnit::Centimetre, ["AP242_MANAGED_MODEL", "SI_UNIT(.CENTI.,.METRE.)"]),
    ] {
        let (text, _) = step(&[object], &StepSettings { unit, schema, ..settings() }).unwrap();
        File::new(&text);
        assert!(named.iter().all(|name| text.contains(name)), "{schema:?} {unit:?}");
    }
}
