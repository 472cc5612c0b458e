//! Outputs that would replace what a command reads.

use std::fs::{self, Metadata};
use std::path::{Path, PathBuf};

use super::CliError;

/// Refuses files to write that are files to read, by whatever path, link or second name.
pub(super) fn check_not_inputs(outputs: &[&Path], inputs: &[&Path]) -> Result<(), CliError> {
    for output in outputs {
        if let Some(input) = inputs.iter().find(|input| is_same_file(output, input)) {
            let message = match output == input {
                true => "is read by this command; another name is needed".to_owned(),
                false => format!("is {}, which this command reads; another name is needed", input.display()),
            };
            return Err(CliError::Input(format!("{}: {message}", output.display())));
        }
    }
    Ok(())
}

/// Refuses a folder to write if one of `names` in it, which are replaced, is or holds a file to read.
pub(super) fn check_replaces_no_inputs(
    folder: &Path,
    names: &[&str],
    inputs: &[&Path],
) -> Result<(), CliError> {
    let Ok(folder_place) = fs::canonicalize(folder) else { return Ok(()) };
    let replaced: Vec<PathBuf> = names.iter().map(|name| folder_place.join(name)).collect();
    let is_replaced = |input: &&&Path| {
        fs::canonicalize(input).is_ok_and(|place| replaced.iter().any(|replaced| place.starts_with(replaced)))
    };
    match inputs.iter().find(is_replaced) {
        None => Ok(()),
        Some(input) => {
            let (folder, input) = (folder.display(), input.display());
            let message =
                format!("{folder}: would replace {input}, which this command reads; name another folder");
            Err(CliError::Input(message))
        }
    }
}

/// Whether two paths lead to the same file; devices, which nothing replaces, are never the same.
fn is_same_file(a: &Path, b: &Path) -> bool {
    let [Ok(first), Ok(second)] = [a, b].map(fs::metadata) else { return false };
    let places = [a, b].map(|path| fs::canonicalize(path).ok());
    first.is_file() && (places[0] == places[1] || is_same_node(&first, &second))
}

/// Whether two names are of one file: hard links.
#[cfg(unix)]
fn is_same_node(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn is_same_node(_: &Metadata, _: &Metadata) -> bool {
    false
}
