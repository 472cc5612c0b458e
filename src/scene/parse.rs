//! A scene file to a [`SceneDescription`], or to all of its faults.

mod camera;
mod deform;
mod film;
mod light;
mod material;
mod names;
mod object;
mod parameters;
mod surface;
#[cfg(test)]
mod tests;
mod texture;

use std::path::Path;

use toml::de::DeTable;

use crate::film::PictureLimits;
use crate::memory::MemoryLimit;
use crate::model::Borders;

use super::description::SceneDescription;
use super::diagnostic::SceneError;
use super::reader::{Faults, Table};
use super::source::{Source, read_text};
use crate::suggestion::quoted;

pub use deform::MAX_CONTROL_POINTS;

/// Faults of the TOML itself that are shown. A file of another format is one on every line, and
/// thousands of messages would hide the first.
const MAX_TOML_FAULTS: usize = 20;

/// Reads and checks a scene file.
///
/// # Errors
/// All faults that the file has by itself; the files it names are not opened.
pub fn parse_scene(path: &Path) -> Result<SceneDescription, SceneError> {
    let text = read_text(path)?;
    parse_scene_str(&text, path)
}

/// Checks the text of a scene file; `path` is named in messages, and paths are taken from its folder.
///
/// # Errors
/// As [`parse_scene`].
pub fn parse_scene_str(text: &str, path: &Path) -> Result<SceneDescription, SceneError> {
    let source = Source::new(path, text);
    let faults = Faults::new(&source);
    let scene = read_document(&source, &faults);
    let diagnostics = faults.into_sorted();
    match scene {
        Some(scene) if diagnostics.is_empty() => Ok(scene),
        _ => Err(SceneError { diagnostics }),
    }
}

fn read_document(source: &Source<'_>, faults: &Faults<'_>) -> Option<SceneDescription> {
    if let Some(byte) = source.text.find('\0') {
        let message = "is not text (a zero byte); a scene is TOML in UTF-8";
        faults.report(byte, message.to_owned());
        return None;
    }
    if let Some(byte) = deep_key(source.text) {
        faults.report(byte, format!("a key of more than {MAX_KEY_PARTS} parts"));
        return None;
    }
    let (document, errors) = DeTable::parse_recoverable(source.text);
    let sound = report_toml(source, faults, &errors);
    // what is recovered from broken TOML would be blamed for faults that are not the user's
    if !sound {
        return None;
    }
    read_scene(Table::root(document.get_ref(), faults), source.path)
}

/// Reports the faults of the TOML itself, one a line; false if the document cannot be trusted.
fn report_toml(source: &Source<'_>, faults: &Faults<'_>, errors: &[toml::de::Error]) -> bool {
    let mut sound = true;
    let mut lines: Vec<usize> = Vec::new();
    for error in errors {
        let span = error.span().unwrap_or_default();
        let line = source.locate(span.start).line;
        let twice = error.message() == "duplicate key";
        sound &= twice;
        // the first fault of a line most often brings the others about
        if lines.contains(&line) {
            continue;
        }
        lines.push(line);
        if lines.len() > MAX_TOML_FAULTS {
            let message = format!("more than {MAX_TOML_FAULTS} faults in the TOML; is it a scene?");
            faults.report_file(message);
            return false;
        }
        let text = source.text.get(span.clone()).unwrap_or_default();
        let message = if twice {
            format!("key {} is given twice", quoted(text.trim_matches('"')))
        } else {
            let message: Vec<&str> = error.message().split_whitespace().collect();
            format!("not valid TOML: {}", message.join(" "))
        };
        faults.report(span.start, message);
    }
    sound
}

/// Most parts of a dotted key. The TOML reader nests a table for each, and frees them recursively:
/// keys of a hundred thousand parts would exhaust the stack. Scenes need four.
const MAX_KEY_PARTS: usize = 1000;

/// Where a key of too many parts begins, if there is one.
fn deep_key(text: &str) -> Option<usize> {
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        // cheap and safe: counts every dot, also of numbers, so that only odd lines are looked at
        if line.matches('.').count() > MAX_KEY_PARTS && longest_key(line) > MAX_KEY_PARTS {
            return Some(start);
        }
        start += line.len();
    }
    None
}

/// The longest run of dots in a line that no other punctuation of TOML breaks.
fn longest_key(line: &str) -> usize {
    let (mut parts, mut longest) = (0, 0);
    for byte in line.bytes() {
        match byte {
            b'.' => parts += 1,
            b',' | b'=' | b'[' | b']' | b'{' | b'}' | b'#' => parts = 0,
            _ => {}
        }
        longest = longest.max(parts);
    }
    longest
}

fn read_scene(mut root: Table<'_>, path: &Path) -> Option<SceneDescription> {
    root.check_keys(&["camera", "film", "render", "material", "light", "object"]);
    let camera = root.table("camera", "[camera]").map(camera::read);
    let film = root.table("film", "[film]").map(film::read_film);
    let render = root.table("render", "[render]").map(film::read_render);
    let materials = root.tables("material", "[[material]]").unwrap_or_default();
    let materials = material::read_materials(materials);
    let objects = root.tables("object", "[[object]]").unwrap_or_default();
    let object_names = object::names(&objects);
    let lights = root.tables("light", "[[light]]").map(|tables| light::read_all(tables, &object_names));
    if root.lacks("object") {
        root.report_file(
            "has no object; a scene needs at least one [[object]] with a name and a mesh, such as \
             name = \"cube\" and mesh = \"cube.obj\""
                .to_owned(),
        );
    }
    let objects = object::read_all(objects, &materials);
    Some(SceneDescription {
        path: path.to_owned(),
        // a table with faults is none here, which the faults keep from being used
        camera: camera.flatten(),
        film: film.unwrap_or_default(),
        render: render.unwrap_or_default(),
        materials: materials.described,
        lights,
        objects,
        least_squares: false,
        pictures: PictureLimits::default(),
        memory: MemoryLimit::NONE,
        borders: Borders::Curves,
    })
}
