//! The commands for programs that hold scenes and pictures in memory, as the Python package does: the same flags, results and
//! messages.

use std::ffi::OsString;

use clap::Parser;

use trimray::difference::Comparison;
use trimray::film::LayeredPicture;
use trimray::scene::{BuiltScene, SceneDescription};

use super::{Cli, CliError, Command, diff, drags, export, info};

/// The tolerance of triangles where none is asked for, in parts of the object's diagonal.
pub const TOLERANCE: f64 = export::TOLERANCE;

/// `trimray export` of a scene that is built already: `flags` are all but the scene's name.
///
/// # Errors
/// As of the command.
pub fn export_scene(
    scene: &SceneDescription,
    built: &BuiltScene,
    flags: impl IntoIterator<Item = OsString>,
) -> Result<(), CliError> {
    match parsed("export", [scene.path.clone().into(), "--quiet".into()], flags)? {
        Command::Export(args) => export::run_built(&args, scene, built),
        _ => Ok(()),
    }
}

/// The JSON of `trimray info`.
///
/// # Errors
/// If the scene's camera is not valid.
pub fn info_json(scene: &SceneDescription, built: &BuiltScene) -> Result<String, CliError> {
    info::json(scene, built)
}

/// The JSON of `trimray drags`.
///
/// # Errors
/// If the JSON cannot be written, which is not expected.
pub fn drags_json(scene: &SceneDescription, built: &BuiltScene) -> Result<String, CliError> {
    drags::json(scene, built)
}

/// `trimray diff` of pictures that are read already, a reference and a test: the comparison, and its JSON. `names` are what to call
/// the pictures, `flags` are all others.
///
/// # Errors
/// As of the command; also if the pictures are of different kinds.
pub fn diff_pictures(
    pictures: [LayeredPicture; 2],
    names: [OsString; 2],
    flags: impl IntoIterator<Item = OsString>,
) -> Result<(Comparison, String), CliError> {
    match parsed("diff", names, flags)? {
        Command::Diff(args) => diff::run_read(&args, pictures),
        other => Err(CliError::Input(format!("not a comparison: {other:?}"))),
    }
}

/// A command line as the program reads it.
fn parsed<const N: usize>(
    command: &str,
    first: [OsString; N],
    flags: impl IntoIterator<Item = OsString>,
) -> Result<Command, CliError> {
    let arguments = ["trimray".into(), command.into()].into_iter().chain(first).chain(flags);
    let cli = Cli::try_parse_from(diff::with_idiff_spellings(arguments));
    // the rest is of usage, which programs do not have
    let said = |error: clap::Error| {
        error.render().to_string().split("\n\n").next().map(str::to_owned).unwrap_or_default()
    };
    let short = |error: clap::Error| CliError::Input(said(error).trim_start_matches("error: ").to_owned());
    Ok(cli.map_err(short)?.command)
}
