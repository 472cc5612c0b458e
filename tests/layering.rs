//! Modules import one way, along the pipeline, and outside crates stay behind one file each.

use std::fs;
use std::path::{Path, PathBuf};

/// The modules in the order of the pipeline; each may use those before it.
const ORDER: [&str; 25] = [
    "math",
    "output",
    "suggestion",
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
    "cli",
];

/// Crates and the only files that may name them.
const BEHIND_ONE_FILE: [(&str, &str); 10] = [
    ("obvhs", "src/trace/bvh.rs"),
    ("exr", "src/film/exr_file.rs"),
    ("image", "src/film/image_file.rs"),
    ("png", "src/film/animated_png.rs"),
    ("base64", "src/report/pictures.rs"),
    ("plotters", "src/report/plot.rs"),
    ("tobj", "src/mesh/obj.rs"),
    ("npyz", "src/arrays.rs"),
    ("quick_xml", "src/export/xml.rs"),
    ("winnow", "src/analytic/expression.rs"),
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

#[test]
fn modules_import_along_the_pipeline_only() {
    let mut checked = 0;
    for (name, text) in all_sources() {
        let module = name.trim_start_matches("src/").split(['/', '.']).next().unwrap_or_default().to_owned();
        let Some(place) = ORDER.iter().position(|known| *known == module) else {
            assert!(
                ["lib", "main", "model", "test_support", "render_tests"].contains(&module.as_str()),
                "{name}: where in the order?"
            );
            continue;
        };
        // unit tests may use anything
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
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
            .filter(|(_, text)| {
                let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
                code.into_iter().any(|line| uses.iter().any(|used| line.contains(used.as_str())))
            })
            .map(|(name, _)| name.as_str())
            .filter(|name| !name.contains("tests"))
            .collect();
        assert!(namers.contains(&file), "{file} names {outside}");
        for name in namers {
            assert!(
                name == file || in_unit_tests(&sources, name, outside),
                "{name} names {outside}; only {file} may"
            );
        }
    }
}

#[test]
fn the_command_line_stays_in_its_folder() {
    for (name, text) in all_sources() {
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
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

/// Whether a file names a crate in its unit tests alone.
fn in_unit_tests(sources: &[(String, String)], name: &str, outside: &str) -> bool {
    let (_, text) = sources.iter().find(|(other, _)| other == name).expect("one of the sources");
    !text.split("#[cfg(test)]").next().unwrap_or_default().contains(&format!("{outside}::"))
}
