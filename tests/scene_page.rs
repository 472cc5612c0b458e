//! `docs/scene.md` has every key that scene files know, and no other; its examples are accepted.
//!
//! What the parser knows is asked of the parser: a key or a name that there is not is answered with all that there are.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use trimray::scene::parse_scene_str;

/// A name that nothing has.
const UNKNOWN: &str = "zzz";

const PAGE: &str = include_str!("../docs/scene.md");

/// One table of scene files, inside a scene that has nothing wrong around it.
struct Table {
    /// The scene, with `@` where the table's entries are.
    scene: String,
    /// The same in another mode, where other keys are allowed.
    other_mode: Option<String>,
    /// What stands between two entries.
    separator: &'static str,
    /// The entries that the table needs: keys and values.
    entries: Vec<(String, String)>,
}

impl Table {
    /// A table under a header, one entry a line.
    fn headed(before: &str, entries: &[(&str, &str)]) -> Self {
        Self::new(format!("{before}\n@\n"), "\n", entries)
    }

    /// A table in braces, within the text `scene`.
    fn inline(scene: String, entries: &[(&str, &str)]) -> Self {
        Self::new(scene, ", ", entries)
    }

    fn new(scene: String, separator: &'static str, entries: &[(&str, &str)]) -> Self {
        let entries = entries.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        Self { scene, other_mode: None, separator, entries }
    }

    /// The scene with the table's own entries, and `more` in their places or after them.
    fn with(&self, more: &[(String, String)]) -> String {
        let kept = self.entries.iter().filter(|(key, _)| more.iter().all(|(other, _)| other != key));
        let lines: Vec<String> = kept.chain(more).map(|(key, value)| format!("{key} = {value}")).collect();
        self.scene.replace('@', &lines.join(self.separator))
    }

    /// What the parser has to say of an example, in the mode that suits it.
    fn faults(&self, example: &[(String, String)]) -> Vec<String> {
        let found = messages(&self.with(example));
        let in_other_mode = self.other_mode.as_ref().map(|scene| {
            let entries = self.entries.clone();
            messages(&Self { scene: scene.clone(), other_mode: None, entries, ..*self }.with(example))
        });
        in_other_mode.filter(Vec::is_empty).unwrap_or(found)
    }

    /// The keys that the parser knows in the table.
    fn keys(&self) -> BTreeSet<String> {
        let scene = self.with(&[(UNKNOWN.to_owned(), "1".to_owned())]);
        let known = listed(&scene, &format!("unknown key \"{UNKNOWN}\" in "), "(known: ");
        known.into_iter().collect()
    }
}

/// What the parser has to say of a scene.
fn messages(scene: &str) -> Vec<String> {
    match parse_scene_str(scene, Path::new("scene.toml")) {
        Ok(_) => Vec::new(),
        Err(error) => error.diagnostics.into_iter().map(|fault| fault.message).collect(),
    }
}

/// The list after `mark` in the message that begins with `beginning`.
fn listed(scene: &str, beginning: &str, mark: &str) -> Vec<String> {
    let messages = messages(scene);
    let message = messages.iter().find(|message| message.starts_with(beginning));
    let message = message.unwrap_or_else(|| panic!("no {beginning:?} in {messages:?} of\n{scene}"));
    let (_, list) = message.split_once(mark).unwrap_or_else(|| panic!("no list in {message}"));
    let list = list.split_once(')').map_or(list, |(list, _)| list);
    list.split(", ").map(str::to_owned).collect()
}

/// The names that the parser knows where `scene` has the unknown one.
fn names(scene: &str, what: &str) -> Vec<String> {
    listed(scene, &format!("unknown {what} \"{UNKNOWN}\""), "(known: ")
}

const OBJECT: &str = "[[object]]\nname = \"ball\"\nsurface = { type = \"sphere\", radius = 1.0 }\n[[material]]\nname = \"clay\"\ntype = \"diffuse\"\n";

/// A header and what a table under it is.
fn under(header: &str) -> String {
    format!("{OBJECT}{header}")
}

/// The entries that a table of a type needs besides the type.
fn needed(id: &str) -> &'static [(&'static str, &'static str)] {
    match id {
        "camera thinlens" => &[("aperture_radius", "0.1")],
        "camera orthographic" => &[("width", "2.0")],
        "light envmap" => &[("file", "\"sky.exr\"")],
        "light point" => &[("position", "[0, 0, 2]")],
        "light area object" => &[("object", "\"lamp\"")],
        "deform ffd" => &[("degree", "[2, 2, 2]"), ("points", "[4, 4, 4]")],
        "deform extension" => {
            &[("mode", "\"operator\""), ("region", "[{ bound = \"u - 0.5\", index = 2, h = 1.0 }]")]
        }
        "surface bezier" => {
            &[("degree", "[1, 2]"), ("points", "[[0,0,0], [0,1,1], [0,2,0], [2,0,0], [2,1,1], [2,2,0]]")]
        }
        "surface bspline" | "surface nurbs" => &[
            ("degree", "[1, 1]"),
            ("size", "[2, 3]"),
            ("points", "[[0,0,0], [0,1,1], [0,2,0], [2,0,0], [2,1,1], [2,2,0]]"),
        ],
        "surface plane" => &[("u", "[1, 0, 0]"), ("v", "[0, 1, 0]")],
        "surface sphere" | "surface cylinder" | "surface cone" => &[("radius", "1.0")],
        "surface torus" => &[("major_radius", "1.0"), ("minor_radius", "0.25")],
        "edit drag" => &[("to", "[[0.5, 0.5, 1.2]]")],
        "edit pick" => &[("to", "[[0.5, 0.5, 1.2]]")],
        "edit weight" => &[("value", "2.0")],
        _ => &[],
    }
}

/// The value under an edit's own key.
fn edit_value(kind: &str) -> &'static str {
    match kind {
        "move" | "weight" => "[1, 1, 1]",
        "drag" => "[[0.5, 0.5, 1.0]]",
        "pick" => "[[320, 200]]",
        "twist" => "{ axis = \"z\", angle = 90.0 }",
        "taper" => "{ axis = \"z\", scale = 0.5 }",
        "bend" => "{ axis = \"z\", angle = 90.0, toward = \"x\" }",
        "bulge" => "{ axis = \"z\", amount = 0.5 }",
        "control_points" => "\"lattice.npy\"",
        kind => panic!("this test does not know the edit {kind}: give it a value here"),
    }
}

/// The tables of scene files that are chosen by a type.
fn add_typed(tables: &mut BTreeMap<String, Table>) {
    let mut add = |id: String, before: &str, first: &[(&str, &str)]| {
        let entries: Vec<_> = first.iter().chain(needed(&id)).copied().collect();
        tables.insert(id, Table::headed(before, &entries));
    };
    let typed = |header: &str| format!("{}\ntype = \"{UNKNOWN}\"\n", under(header));
    let text = |name: &str| format!("{name:?}");
    for kind in names(&typed("[camera]"), "camera type") {
        let view = [("type", &*text(&kind)), ("origin", "[3, -4, 2]"), ("target", "[0, 0, 0]")];
        add(format!("camera {kind}"), &under("[camera]"), &view);
    }
    for kind in names(&typed("[[material]]\nname = \"m\""), "material type") {
        let entries = [("name", "\"m\""), ("type", &*text(&kind))];
        add(format!("material {kind}"), &under("[[material]]"), &entries);
    }
    let lamp = format!("{OBJECT}[[object]]\nname = \"lamp\"\nmesh = \"lamp.obj\"\n[[light]]");
    for kind in names(&typed("[[light]]"), "light type") {
        if kind != "area" {
            add(format!("light {kind}"), &lamp, &[("type", &*text(&kind))]);
            continue;
        }
        let area = format!("{lamp}\ntype = \"area\"\nshape = \"{UNKNOWN}\"\n");
        for shape in names(&area, "light shape") {
            let entries = [("type", "\"area\""), ("shape", &*text(&shape))];
            add(format!("light area {shape}"), &lamp, &entries);
        }
    }
    for kind in names(&typed("[[object.deform]]").replace(OBJECT, BALL_LAST), "deform type") {
        let before = format!("{BALL_LAST}[[object.deform]]");
        add(format!("deform {kind}"), &before, &[("type", &*text(&kind))]);
    }
}

/// As [`OBJECT`], with the object last, so that its deformations can follow.
const BALL_LAST: &str = "[[object]]\nname = \"ball\"\nsurface = { type = \"sphere\", radius = 1.0 }\n";

/// The tables in braces, and those of edits.
fn add_inner(tables: &mut BTreeMap<String, Table>) {
    let lattice = "[[object]]\nname = \"a\"\nmesh = \"a.obj\"\n[[object.deform]]\ntype = \"ffd\"\ndegree = [2, 2, 2]\n\
                   points = [4, 4, 4]\n[[object.deform.edit]]\n";
    for kind in listed(lattice, "an edit needs one of ", "one of ") {
        let id = format!("edit {kind}");
        let entries: Vec<_> = [(&*kind, edit_value(&kind))].into_iter().chain(needed(&id).to_vec()).collect();
        let table = Table::headed(lattice, &entries);
        tables.insert(id, table);
        if let Some(inner) = edit_value(&kind).strip_prefix("{ ").and_then(|inner| inner.strip_suffix(" }")) {
            let entries: Vec<_> = inner.split(", ").filter_map(|entry| entry.split_once(" = ")).collect();
            tables.insert(kind.clone(), Table::inline(format!("{lattice}{kind} = {{ @ }}\n"), &entries));
        }
    }
    let surface = |inner: &str| format!("[[object]]\nname = \"a\"\nsurface = {{ {inner} }}\n");
    for kind in names(&surface(&format!("type = \"{UNKNOWN}\"")), "surface type") {
        let id = format!("surface {kind}");
        let kind = format!("{kind:?}");
        let entries: Vec<_> = [("type", &*kind)].into_iter().chain(needed(&id).to_vec()).collect();
        tables.insert(id, Table::inline(surface("@"), &entries));
    }
    let material = |value: &str| {
        under(&format!("[[material]]\nname = \"m\"\ntype = \"diffuse\"\nreflectance = {value}\n"))
    };
    let step =
        |inner: &str| format!("[[object]]\nname = \"a\"\nmesh = \"a.obj\"\ntransform = [{{ {inner} }}]\n");
    for (id, scene, entries) in [
        ("texture", material("{ @ }"), &[][..]),
        ("texture checkerboard", material("{ @ }"), &[("checkerboard", "{}")]),
        ("checkerboard", material("{ checkerboard = { @ } }"), &[]),
        ("to_uv step", material("{ texture = \"a.png\", to_uv = [{ @ }] }"), &[]),
        ("transform step", step("@"), &[]),
        ("rotate", step("rotate = { @ }"), &[("axis", "[0, 0, 1]"), ("angle", "1.0")]),
        ("look_at", step("look_at = { @ }"), &[("origin", "[0, -4, 2]"), ("target", "[0, 0, 0]")]),
    ] {
        tables.insert(id.to_owned(), Table::inline(scene, entries));
    }
}

/// All tables of scene files by the names that the page has for them.
fn tables() -> BTreeMap<String, Table> {
    let mut tables = BTreeMap::new();
    let region = format!(
        "{BALL_LAST}[[object.deform]]\ntype = \"extension\"\nmode = \"operator\"\n[[object.deform.region]]"
    );
    let mut add = |id: &str, before: &str, entries: &[(&str, &str)]| {
        tables.insert(id.to_owned(), Table::headed(before, entries));
    };
    add("scene", "", &[("object", "[{ name = \"a\", mesh = \"a.obj\" }]")]);
    add("film", &under("[film]"), &[]);
    add("render", &under("[render]"), &[]);
    add("object", &under("[[object]]"), &[("name", "\"a\""), ("mesh", "\"a.obj\"")]);
    add("region", &region, &[("bound", "\"u - 0.5\""), ("index", "2"), ("h", "1.0")]);
    let region = tables.get_mut("region").expect("it was put there");
    region.other_mode = Some(region.scene.replace("operator", "radial"));
    add_typed(&mut tables);
    add_inner(&mut tables);
    tables
}

/// A row of the page: its key, and the entries of its example.
struct Row {
    key: String,
    example: Vec<(String, String)>,
}

/// The texts in backticks of a cell.
fn quoted(cell: &str) -> Vec<&str> {
    cell.split('`').skip(1).step_by(2).collect()
}

/// The rows of the page's tables of keys, by the names of the tables.
fn page() -> Vec<(Vec<String>, Vec<Row>)> {
    let mut found = Vec::new();
    let mut lines = PAGE.lines();
    while let Some(line) = lines.next() {
        let Some(ids) = line.strip_prefix("<!-- keys: ").and_then(|line| line.strip_suffix(" -->")) else {
            continue;
        };
        let rows = lines.by_ref().take_while(|line| line.starts_with('|')).skip(2).map(|line| {
            let cells: Vec<&str> = line.trim_matches('|').split('|').collect();
            let [key] = quoted(cells[0])[..] else { panic!("one key in backticks first: {line}") };
            let entries = quoted(cells[cells.len() - 1]).into_iter();
            let example = entries.map(|entry| {
                let (key, value) = entry.split_once(" = ").unwrap_or_else(|| panic!("{entry} in {line}"));
                (key.to_owned(), value.to_owned())
            });
            Row { key: key.to_owned(), example: example.collect() }
        });
        let rows: Vec<Row> = rows.collect();
        assert!(!rows.is_empty(), "a table stands below {line}");
        if ids == "edit of the key" {
            found.extend(rows.into_iter().map(|row| (vec![format!("edit {}", row.key)], vec![row])));
        } else {
            found.push((ids.split(", ").map(str::to_owned).collect(), rows));
        }
    }
    found
}

/// What is in one set alone, as lines.
fn beyond(has: &BTreeSet<String>, lacks: &BTreeSet<String>, what: &str) -> String {
    has.difference(lacks).map(|name| format!("{what}: {name}\n")).collect()
}

#[test]
fn the_page_has_the_keys_that_the_parser_knows_and_no_others() {
    let mut on_page: BTreeSet<String> = BTreeSet::new();
    for (ids, rows) in page() {
        for id in ids {
            on_page.extend(rows.iter().map(|row| format!("{id}: {}", row.key)));
        }
    }
    let known: BTreeSet<String> = tables()
        .iter()
        .flat_map(|(id, table)| table.keys().into_iter().map(move |key| format!("{id}: {key}")))
        .collect();
    assert!(known.len() > 150, "the parser was asked: {known:?}");
    let differ =
        beyond(&known, &on_page, "not in docs/scene.md") + &beyond(&on_page, &known, "unknown to the parser");
    assert!(differ.is_empty(), "{differ}");
}

#[test]
fn the_page_has_each_key_of_a_table_once() {
    let mut seen = BTreeSet::new();
    for (ids, rows) in page() {
        for (id, row) in ids.iter().flat_map(|id| rows.iter().map(move |row| (id, row))) {
            assert!(seen.insert(format!("{id}: {}", row.key)), "{id} has {} twice", row.key);
        }
    }
}

#[test]
fn the_examples_of_keys_are_accepted() {
    let tables = tables();
    let mut wrong = String::new();
    for (ids, rows) in page() {
        for id in &ids {
            let table = tables.get(id).unwrap_or_else(|| panic!("the parser has no table {id}"));
            for row in rows.iter().filter(|row| !row.example.is_empty()) {
                let own = row.example.iter().any(|(key, _)| *key == row.key);
                for message in table.faults(&row.example) {
                    wrong += &format!("{id}, {}: {message}\n", row.key);
                }
                if !own {
                    wrong += &format!("{id}, {}: the example has another key\n", row.key);
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn keys_without_an_example_are_types_and_names_alone() {
    let without: BTreeSet<String> = page()
        .into_iter()
        .flat_map(|(_, rows)| rows)
        .filter(|row| row.example.is_empty())
        .map(|row| row.key)
        .collect();
    assert_eq!(without, ["shape", "surface", "type"].map(str::to_owned).into());
}

#[test]
fn the_page_has_the_names_that_the_parser_knows() {
    let on_page: BTreeSet<&str> = quoted(PAGE).into_iter().map(|text| text.trim_matches('"')).collect();
    let tables = tables();
    let mut missing = String::new();
    for (id, key, what) in [
        ("camera perspective", "fov_axis", "fov_axis"),
        ("film", "filter", "filter"),
        ("render", "integrator", "integrator"),
        ("render", "sampler", "sampler"),
        ("render", "aovs", "aov"),
        ("object", "normals", "normals"),
        ("object", "method", "method"),
        ("deform ffd", "outside", "outside"),
        ("deform ffd", "frame", "frame"),
        ("deform extension", "mode", "mode"),
        ("deform extension", "field", "field"),
        ("edit drag", "using", "using"),
        ("twist", "axis", "axis"),
        ("material conductor", "material", "metal"),
        ("material dielectric", "int_ior", "medium"),
        ("material roughconductor", "distribution", "distribution"),
        ("texture", "filter", "texture filter"),
        ("texture", "wrap", "wrap"),
    ] {
        let value = if key == "aovs" { format!("[\"{UNKNOWN}\"]") } else { format!("\"{UNKNOWN}\"") };
        let mut entries = vec![(key.to_owned(), value)];
        if key == "field" {
            entries.push(("mode".to_owned(), "\"field\"".to_owned()));
        }
        if id == "texture" {
            entries.push(("texture".to_owned(), "\"a.png\"".to_owned()));
        }
        for name in names(&tables[id].with(&entries), what) {
            let parameter = |text: &&str| text.strip_prefix(&*name).is_some_and(|rest| rest.starts_with(':'));
            if !on_page.contains(&*name) && !on_page.iter().any(parameter) {
                missing += &format!("{what} {name}\n");
            }
        }
    }
    assert!(missing.is_empty(), "docs/scene.md lacks\n{missing}");
}

#[test]
fn the_scenes_of_the_page_are_accepted() {
    let scenes: Vec<&str> = PAGE
        .split("```toml\n")
        .skip(1)
        .filter_map(|rest| rest.split_once("```"))
        .map(|(scene, _)| scene)
        .collect();
    assert!(scenes.len() >= 2);
    for scene in scenes {
        assert_eq!(messages(scene), Vec::<String>::new(), "{scene}");
    }
}
