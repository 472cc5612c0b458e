//! Which scenes a folder has, and where their references are.

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// A scene and its reference.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneTest {
    /// The scene file's name without its ending.
    pub name: String,
    /// The scene file.
    pub scene: PathBuf,
    /// The reference, or, while there is none, where it belongs.
    pub reference: PathBuf,
}

/// What a folder has to test.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TestFolder {
    /// In the order of their names.
    pub tests: Vec<SceneTest>,
    /// Pictures among the references that are of no scene.
    pub unused: Vec<PathBuf>,
}

/// Why a folder cannot be tested.
#[derive(Debug, Error)]
pub enum FolderError {
    /// It cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The folder.
        path: PathBuf,
        /// What happened.
        source: io::Error,
    },
    /// It has no scenes.
    #[error("{}: there are no scenes (.toml), neither here nor in its folder scenes", path.display())]
    NoScenes {
        /// The folder.
        path: PathBuf,
    },
}

/// The scenes `*.toml` of a folder or, if it has none itself, of its folder `scenes`, each with the reference `NAME.exr` of the
/// folder `references`. If none is given, it is beside the scene or else in the folder above, which for `scenes` is where new
/// references belong.
///
/// # Errors
/// If a folder cannot be read, or if there is no scene.
pub fn find_tests(folder: &Path, references: Option<&Path>) -> Result<TestFolder, FolderError> {
    let (mut scenes, mut home) = (files(folder, "toml")?, folder.to_owned());
    let below = folder.join("scenes");
    let has_folder = scenes.is_empty() && below.is_dir();
    if has_folder {
        scenes = files(&below, "toml")?;
        home = below;
    }
    if scenes.is_empty() {
        return Err(FolderError::NoScenes { path: folder.to_owned() });
    }
    // beside the scenes and above them; the last is searched last
    let above = if has_folder { folder.to_owned() } else { parent(folder) };
    let places =
        references.map_or_else(|| vec![home.clone(), above.clone()], |folder| vec![folder.to_owned()]);
    let new = references.unwrap_or(if has_folder { &above } else { &home });
    let tests: Vec<_> = scenes
        .iter()
        .map(|scene| {
            let name = stem(scene);
            let file = format!("{name}.exr");
            let found = places.iter().map(|place| place.join(&file)).find(|path| path.is_file());
            SceneTest { scene: scene.clone(), reference: found.unwrap_or_else(|| new.join(&file)), name }
        })
        .collect();
    // the folder above one that has scenes itself is somebody else's
    let owned = places.iter().filter(|&place| references.is_some() || has_folder || *place == home);
    let mut unused = Vec::new();
    for place in owned {
        unused.extend(files(place, "exr")?);
    }
    unused.retain(|picture| tests.iter().all(|test| test.name != stem(picture)));
    Ok(TestFolder { tests, unused })
}

fn parent(folder: &Path) -> PathBuf {
    match (folder.file_name(), folder.parent()) {
        (Some(_), Some(parent)) => parent.to_owned(),
        // `.` and `..`
        _ => folder.join(".."),
    }
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The files with an ending, sorted.
fn files(folder: &Path, ending: &str) -> Result<Vec<PathBuf>, FolderError> {
    let failed = |source| FolderError::Read { path: folder.to_owned(), source };
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.extension() == Some(OsStr::new(ending)) && path.is_file() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}
