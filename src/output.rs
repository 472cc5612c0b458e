//! Files that are whole or not there.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};

use thiserror::Error;

/// Why a picture cannot be written.
#[derive(Debug, Error)]
pub enum OutputError {
    /// The folder to write to is not there.
    #[error("{}: there is no folder {}", .path.display(), .folder.display())]
    NoFolder {
        /// The file to write.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
    },
    /// The path is a folder's.
    #[error("{}: is a folder; a file's name is needed", .path.display())]
    IsFolder {
        /// The path.
        path: PathBuf,
    },
    /// The system refused.
    #[error("{}: cannot be written: {source}", .path.display())]
    Io {
        /// The file to write.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The picture does not fit the format.
    #[error("{}: cannot be encoded: {reason}", .path.display())]
    Encode {
        /// The file to write.
        path: PathBuf,
        /// What the encoder said.
        reason: String,
    },
}

/// Finds out whether a file can be written, before hours of work go into its content.
///
/// # Errors
/// If the folder does not exist or refuses new files, or the path is a folder's.
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    match Target::of(path)? {
        Target::Special(path) => open_special(&path).map(|_| ()),
        Target::Regular(path) => Beside::create(&path).map(|_| ()),
    }
}

/// Writes the file beside its place and renames it when it is whole.
///
/// # Errors
/// As [`check_writable`]; also when the disk is full. Nothing is left then but what was before.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    match Target::of(path)? {
        Target::Special(path) => {
            let written = open_special(&path)?.write_all(bytes);
            written.map_err(|source| OutputError::Io { path, source })
        }
        Target::Regular(path) => {
            let mut beside = Beside::create(&path)?;
            let written = beside.finish(bytes, &path);
            written.map_err(|source| OutputError::Io { path, source })
        }
    }
}

/// Where a path leads.
enum Target {
    /// A file, there already or not. Links are followed, so that a link stays one.
    Regular(PathBuf),
    /// A device or a pipe: must not be replaced by a file.
    Special(PathBuf),
}

impl Target {
    fn of(path: &Path) -> Result<Self, OutputError> {
        match fs::metadata(path) {
            Ok(there) if there.is_dir() => Err(OutputError::IsFolder { path: path.into() }),
            Ok(there) if there.is_file() => match fs::canonicalize(path) {
                Ok(path) => Ok(Self::Regular(path)),
                Err(source) => Err(OutputError::Io { path: path.into(), source }),
            },
            Ok(_) => Ok(Self::Special(path.into())),
            Err(_) => Ok(Self::Regular(path.into())),
        }
    }
}

fn open_special(path: &Path) -> Result<File, OutputError> {
    let opened = OpenOptions::new().write(true).open(path);
    opened.map_err(|source| OutputError::Io { path: path.into(), source })
}

/// A file in the same folder, removed when dropped unless it took the other's place.
struct Beside {
    file: File,
    path: PathBuf,
    kept: bool,
}

impl Beside {
    fn create(path: &Path) -> Result<Self, OutputError> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let folder = match path.parent() {
            Some(folder) if folder.as_os_str().is_empty() => Path::new("."),
            Some(folder) => folder,
            None => return Err(OutputError::IsFolder { path: path.into() }),
        };
        if !folder.is_dir() {
            return Err(OutputError::NoFolder { path: path.into(), folder: folder.into() });
        }
        // hidden, and unlike that of any other writer at the same time
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let mut name = OsString::from(".");
        name.push(path.file_name().unwrap_or_default());
        name.push(format!(".{}-{count}.part", process::id()));
        let beside = folder.join(name);
        let opened = OpenOptions::new().write(true).create_new(true).open(&beside);
        let file = opened.map_err(|source| OutputError::Io { path: path.into(), source })?;
        Ok(Self { file, path: beside, kept: false })
    }

    fn finish(&mut self, bytes: &[u8], path: &Path) -> io::Result<()> {
        self.file.write_all(bytes)?;
        // a rename may reach the disk before the content does
        self.file.sync_all()?;
        fs::rename(&self.path, path)?;
        self.kept = true;
        Ok(())
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        if !self.kept {
            // nothing more can be done about a file that cannot be removed
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<OsString> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name()).collect()
    }

    #[test]
    fn checks_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        check_writable(&path).unwrap();
        assert!(names(folder.path()).is_empty());
        let inner = folder.path().join("none").join("a.exr");
        let error = check_writable(&inner).unwrap_err();
        assert!(matches!(error, OutputError::NoFolder { .. }), "{error}");
        assert!(error.to_string().contains("there is no folder"), "{error}");
        let error = check_writable(folder.path()).unwrap_err();
        assert!(matches!(error, OutputError::IsFolder { .. }), "{error}");
    }

    #[test]
    fn files_are_replaced_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write_whole(&path, b"old").unwrap();
        write_whole(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["a.exr"]);
    }

    #[test]
    fn interrupted_writes_leave_what_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write_whole(&path, b"old").unwrap();
        let mut beside = Beside::create(&path).unwrap();
        beside.file.write_all(b"half").unwrap();
        drop(beside);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        // a rename that cannot be done: a folder has come to stand there
        let taken = folder.path().join("taken");
        let mut beside = Beside::create(&taken).unwrap();
        fs::create_dir(&taken).unwrap();
        assert!(beside.finish(b"whole", &taken).is_err());
        drop(beside);
        let mut left = names(folder.path());
        left.sort();
        assert_eq!(left, ["a.exr", "taken"]);
    }

    #[cfg(unix)]
    #[test]
    fn links_and_devices_stay() {
        let folder = tempfile::tempdir().unwrap();
        let (path, link) = (folder.path().join("a.exr"), folder.path().join("link.exr"));
        write_whole(&path, b"old").unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        write_whole(&link, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&path).unwrap(), b"new");
        write_whole(Path::new("/dev/null"), b"gone").unwrap();
        check_writable(Path::new("/dev/null")).unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }
}
