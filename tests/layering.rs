//! Modules import one way, along the pipeline, and outside crates stay behind one file each.

use std::fs;
use std::path::{Path, PathBuf};

/// The modules in the order of the pipeline; each may use those before it.
const ORDER: [&str; 31] = [
    "math",
    "random",
    "memory",
    "input",
    "output",
    "suggestion",
    "choice",
    "arrays",
    "mesh",
    "spline",
    "manipulate",
    "subdivide",
    "patch",
    "surface",
    "analytic",
    "trace",
    "tessellate",
    "model",
    "deviation",
    "film",
    "difference",
    "shade",
    "scene",
    "identity",
    "render",
    "export",
    "compare",
    "reference_test",
    "report",
    "prelude",
    "cli",
];

/// Crates and the only files that may name them.
const BEHIND_ONE_FILE: [(&str, &str); 10] = [
    ("zmij", "src/export/step/entity.rs"),
    ("obvhs", "src/trace/bvh.rs"),
    ("exr", "src/film/exr_file.rs"),
    ("image", "src/film/image_file.rs"),
    ("png", "src/film/animated_png.rs"),
    ("base64", "src/report/pictures.rs"),
    ("plotters", "src/report/plot.rs"),
    ("npyz", "src/arrays.rs"),
    ("quick_xml", "src/export/xml.rs"),
    ("winnow", "src/analytic/syntax.rs"),
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// All files below `src`, with their paths from the repository's folder and their text.
fn all_sources() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    sources(&root.join("src"), &mut found);
    found
        .into_iter()
        .map(|path| {
            let name = path.strip_prefix(root).expect("below the root").to_string_lossy().replace('\\', "/");
            (name, fs::read_to_string(path).expect("readable"))
        })
        .collect()
}

/// A file's own code, without comments and without the bodies of its unit tests: `#[cfg(test)] mod … { … }`, `#[cfg(test)]` before
/// one item, and all of files of tests.
fn own_code(name: &str, text: &str) -> String {
    if is_tests(name) {
        return String::new();
    }
    let mut code = String::new();
    // the braces that an item of unit tests has opened and not closed; none outside of one
    let mut depth: Option<usize> = None;
    for line in text.lines().filter(|line| !line.trim_start().starts_with("//")) {
        match &mut depth {
            None if line.trim() == "#[cfg(test)]" => depth = Some(0),
            None => {
                code.push_str(line);
                code.push('\n');
            }
            Some(_) if line.trim_start().starts_with("#[") => {}
            Some(open) => {
                *open = (*open + line.matches('{').count()).saturating_sub(line.matches('}').count());
                // formatted code: an item ends with its line, or with a brace at its own indentation
                if *open == 0 && line.trim_end().ends_with([';', '}']) {
                    depth = None;
                }
            }
        }
    }
    code
}

/// Whether a file has unit tests, or what they share, alone.
fn is_tests(name: &str) -> bool {
    name.split(['/', '.']).any(|part| ["tests", "test_support", "testing", "hard_cases"].contains(&part))
}

#[test]
fn unit_tests_are_told_from_code() {
    let text = "use a::b;\n// use c::d;\n#[cfg(test)]\nmod tests;\nuse e::f;\n#[cfg(test)]\nmod more {\n    use g::h;\n    \
                fn i() {}\n}\nuse j::k;\n";
    assert_eq!(own_code("src/x.rs", text), "use a::b;\nuse e::f;\nuse j::k;\n");
    assert_eq!(own_code("src/x/tests.rs", text), "");
}

/// The files of its own folder that a file imports from, by their names without endings.
fn neighbours(name: &str, code: &str) -> Vec<String> {
    let folder: Vec<_> = name.trim_start_matches("src/").split('/').rev().skip(1).collect();
    let path: String = folder.iter().rev().map(|part| format!("{part}::")).collect();
    let roots = ["super::".to_owned(), format!("crate::{path}")];
    let mut found = Vec::new();
    for root in roots {
        for used in code.split(root.as_str()).skip(1) {
            // one name, or several in braces
            let list = used.strip_prefix('{').map_or(used, |list| list.split('}').next().unwrap_or_default());
            let many = used.starts_with('{');
            let names = list.split(',').take(if many { usize::MAX } else { 1 });
            found.extend(names.map(|name| {
                let name = name.trim();
                name.split(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or_default().to_owned()
            }));
        }
    }
    found
}

#[test]
fn no_two_files_of_a_folder_import_each_other() {
    let mut imports = Vec::new();
    for (name, text) in all_sources() {
        let folder = name.rsplit_once('/').expect("in src").0.to_owned();
        let others = neighbours(&name, &own_code(&name, &text));
        imports.extend(others.into_iter().map(|other| (name.clone(), format!("{folder}/{other}.rs"))));
    }
    assert!(imports.len() > 100, "the search finds the imports: {}", imports.len());
    let mut circles: Vec<_> = imports
        .iter()
        .filter(|(name, other)| name < other && imports.contains(&(other.clone(), name.clone())))
        .map(|(name, other)| (name.as_str(), other.as_str()))
        .collect();
    circles.dedup();
    assert!(circles.is_empty(), "import each other: {circles:#?}");
}

#[test]
fn modules_import_along_the_pipeline_only() {
    let mut checked = 0;
    for (name, text) in all_sources() {
        let module = name.trim_start_matches("src/").split(['/', '.']).next().unwrap_or_default().to_owned();
        let Some(place) = ORDER.iter().position(|known| *known == module) else {
            assert!(
                ["lib", "main", "test_support", "render_tests"].contains(&module.as_str()),
                "{name}: where in the order?"
            );
            continue;
        };
        // unit tests may use anything
        let code = own_code(&name, &text);
        // the program names the library
        let imports = code.split("crate::").skip(1).chain(code.split("trimray::").skip(1));
        for used in imports {
            let used = used.split(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or_default();
            if let Some(other) = ORDER.iter().position(|known| *known == used) {
                assert!(other <= place, "{name} uses {used}, which comes after {module}");
                checked += 1;
            }
        }
    }
    assert!(checked > 50, "the search finds the imports: {checked}");
}

#[test]
fn outside_crates_stay_behind_one_file() {
    let sources = all_sources();
    for (outside, file) in BEHIND_ONE_FILE {
        let uses = [format!("use {outside}::"), format!(" {outside}::"), format!("({outside}::")];
        let namers: Vec<_> = sources
            .iter()
            .filter(|(name, text)| {
                let code = own_code(name, text);
                uses.iter().any(|used| code.contains(used.as_str()))
            })
            .map(|(name, _)| name.as_str())
            .collect();
        assert!(namers.contains(&file), "{file} names {outside}");
        for name in namers {
            assert!(name == file, "{name} names {outside}; only {file} may");
        }
    }
}

#[test]
fn the_command_line_stays_in_its_folder() {
    for (name, text) in all_sources() {
        let code = own_code(&name, &text);
        for outside in ["clap::", "indicatif::", "anyhow::", "println!", "eprintln!", "process::exit"] {
            assert!(name.starts_with("src/cli/") || !code.contains(outside), "{name} names {outside}");
        }
    }
}

#[test]
fn pages_are_written_in_their_folder() {
    for (name, text) in all_sources() {
        assert!(name.starts_with("src/report/") || !text.contains("maud::"), "{name} names maud");
    }
}
