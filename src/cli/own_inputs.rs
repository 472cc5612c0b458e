//! Outputs that would replace what a command reads.

use std::fs::{self, Metadata};
use std::path::{Path, PathBuf};

use super::CliError;

/// Refuses files to write that are files to read, by whatever path, link or second name.
pub(super) fn check_not_inputs(outputs: &[&Path], inputs: &[impl AsRef<Path>]) -> Result<(), CliError> {
    for output in outputs {
        if let Some(input) = inputs.iter().map(AsRef::as_ref).find(|input| is_same_file(output, input)) {
            let message = match *output == input {
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
    inputs: &[impl AsRef<Path>],
) -> Result<(), CliError> {
    let Ok(folder_place) = fs::canonicalize(folder) else { return Ok(()) };
    let replaced: Vec<PathBuf> = names.iter().map(|name| folder_place.join(name)).collect();
    let is_replaced = |input: &&Path| {
        fs::canonicalize(input).is_ok_and(|place| replaced.iter().any(|replaced| place.starts_with(replaced)))
    };
    match inputs.iter().map(AsRef::as_ref).find(is_replaced) {
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
    let is_same_place = || match [a, b].map(fs::canonicalize) {
        [Ok(first), Ok(second)] => first == second,
        _ => false,
    };
    first.is_file() && (is_same_node(&first, &second) || is_same_place())
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

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::os::fd::AsRawFd;

    use super::*;

    #[test]
    fn files_that_no_path_leads_to_are_told_apart() {
        let files = [tempfile::tempfile().unwrap(), tempfile::tempfile().unwrap()];
        let [a, b] =
            files.each_ref().map(|file| PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd())));
        assert!(fs::metadata(&a).is_ok() && fs::canonicalize(&a).is_err());
        assert!(is_same_file(&a, &a) && !is_same_file(&a, &b));
    }
}
