//! Files that are whole or not there.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};

use thiserror::Error;

/// Why a file or folder cannot be written.
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
    /// The path is a file's.
    #[error("{}: is a file; a folder's name is needed", .path.display())]
    IsFile {
        /// The path.
        path: PathBuf,
    },
    /// The folder has something in it that was not written by this program.
    #[error("{}: is not empty, and not an export of this program; name a new folder, or empty this one", .path.display())]
    Taken {
        /// The folder.
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

/// Bytes that are gathered before they are written.
const BUFFER: usize = 1 << 18;

/// Finds out whether a file can be written, before hours of work go into its content.
///
/// # Errors
/// If the folder does not exist or refuses new files, or the path is a folder's.
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    match Target::at(path)? {
        Target::Special(path) => open_special(&path).map(|_| ()),
        Target::Regular(path) => Beside::create(&path).map(|_| ()),
    }
}

/// Writes the file beside its place and renames it when it is whole.
///
/// # Errors
/// As [`check_writable`]; also when the disk is full. Nothing is left then but what was before.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    write_whole_by(path, |file| file.write_all(bytes))
}

/// As [`write_whole`], of content that is written bit by bit and never in memory as a whole.
///
/// # Errors
/// As [`write_whole`].
pub fn write_whole_by(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), OutputError> {
    match Target::at(path)? {
        Target::Special(path) => {
            let written = written_by(&mut open_special(&path)?, write);
            written.map_err(|source| OutputError::Io { path, source })
        }
        Target::Regular(path) => {
            let mut beside = Beside::create(&path)?;
            let written = written_by(&mut beside.file, write).and_then(|()| beside.finish(&path));
            written.map_err(|source| OutputError::Io { path, source })
        }
    }
}

/// Writes to a file, many bytes at a time.
fn written_by(file: &mut File, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut buffer = BufWriter::with_capacity(BUFFER, file);
    write(&mut buffer)?;
    buffer.flush()
}

/// A folder that may be replaced by a new one.
#[derive(Clone, Copy, Debug)]
pub struct OwnFolder<'a> {
    /// Tells such folders from others.
    pub is_own: fn(&Path) -> bool,
    /// What is replaced at its top level; everything else stays.
    pub names: &'a [&'a str],
}

/// Finds out whether a folder can be written, before hours of work go into its content.
///
/// # Errors
/// If the path is a file's, or a folder's that is neither empty nor an own one, or the folder around it refuses new ones.
pub fn check_folder_writable(path: &Path, own: OwnFolder<'_>) -> Result<(), OutputError> {
    let path = folder_place(path, own)?;
    FolderBeside::create(&path).map(|_| ())
}

/// Writes a folder beside its place and renames it when it is whole. `files` are paths in it, with `/`, and their contents.
///
/// An own folder that is there already is replaced but for what others have put into it.
///
/// # Errors
/// As [`check_folder_writable`]; also when the disk is full. Nothing is left then but what was before.
pub fn write_folder_whole<'a>(
    path: &Path,
    own: OwnFolder<'_>,
    files: impl IntoIterator<Item = (&'a str, &'a [u8])>,
) -> Result<(), OutputError> {
    let path = folder_place(path, own)?;
    let failed = |source| OutputError::Io { path: path.clone(), source };
    let mut beside = FolderBeside::create(&path)?;
    for (name, bytes) in files {
        beside.add(name, bytes).map_err(failed)?;
    }
    beside.finish(&path, own.names).map_err(failed)
}

/// The path of a folder to write, links followed.
fn folder_place(path: &Path, own: OwnFolder<'_>) -> Result<PathBuf, OutputError> {
    let Ok(there) = fs::metadata(path) else { return Ok(path.into()) };
    if !there.is_dir() {
        return Err(OutputError::IsFile { path: path.into() });
    }
    let failed = |source| OutputError::Io { path: path.into(), source };
    let is_empty = fs::read_dir(path).map_err(failed)?.next().is_none();
    if !is_empty && !(own.is_own)(path) {
        return Err(OutputError::Taken { path: path.into() });
    }
    fs::canonicalize(path).map_err(failed)
}

/// A folder in the same folder, removed when dropped unless it took the other's place.
struct FolderBeside {
    path: PathBuf,
    /// Locked as [`Beside::file`]; none where folders cannot be opened.
    _lock: Option<File>,
    kept: bool,
}

impl FolderBeside {
    fn create(path: &Path) -> Result<Self, OutputError> {
        let beside = beside(path)?;
        fs::create_dir(&beside).map_err(|source| OutputError::Io { path: path.into(), source })?;
        let lock = File::open(&beside).ok().filter(|folder| folder.try_lock().is_ok());
        Ok(Self { path: beside, _lock: lock, kept: false })
    }

    fn add(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        let path = self.path.join(name);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        let mut file = OpenOptions::new().write(true).create_new(true).open(&path)?;
        file.write_all(bytes)?;
        file.sync_all()
    }

    fn finish(&mut self, path: &Path, names: &[&str]) -> io::Result<()> {
        if !path.is_dir() {
            fs::rename(&self.path, path)?;
            self.kept = true;
            return Ok(());
        }
        // what others have put there moves along
        for entry in fs::read_dir(path)? {
            let entry = entry?;
            if !names.iter().any(|name| entry.file_name() == *name) {
                fs::rename(entry.path(), self.path.join(entry.file_name()))?;
            }
        }
        let old = self.path.with_extension("old");
        fs::rename(path, &old)?;
        if let Err(error) = fs::rename(&self.path, path) {
            fs::rename(&old, path)?;
            return Err(error);
        }
        self.kept = true;
        fs::remove_dir_all(&old)
    }
}

impl Drop for FolderBeside {
    fn drop(&mut self) {
        if !self.kept {
            // nothing more can be done about a folder that cannot be removed
            let _ = fs::remove_dir_all(&self.path);
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
    fn at(path: &Path) -> Result<Self, OutputError> {
        match fs::metadata(path) {
            Ok(there) if there.is_dir() => Err(OutputError::IsFolder { path: path.into() }),
            Ok(there) if there.is_file() => match fs::canonicalize(path) {
                Ok(path) => Ok(Self::Regular(path)),
                Err(source) => Err(OutputError::Io { path: path.into(), source }),
            },
            Ok(_) => Ok(Self::Special(path.into())),
            // nothing there yet, perhaps at the end of a link
            Err(_) => linked(path).map(Self::Regular),
        }
    }
}

/// Where a path leads that has no file yet: what its link names, if it is one, from the link's folder.
fn linked(path: &Path) -> Result<PathBuf, OutputError> {
    /// As many as Linux follows.
    const MOST_LINKS: usize = 40;
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        let Ok(named) = fs::read_link(&path) else { return Ok(path) };
        path = path.parent().unwrap_or("".as_ref()).join(named);
    }
    Err(OutputError::Io { path, source: io::Error::other("too many links one after another") })
}

fn open_special(path: &Path) -> Result<File, OutputError> {
    let opened = OpenOptions::new().write(true).open(path);
    opened.map_err(|source| OutputError::Io { path: path.into(), source })
}

/// A path in the same folder for what is not whole yet: hidden, and unlike that of any other writer at the same time.
fn beside(path: &Path) -> Result<PathBuf, OutputError> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let folder = match path.parent() {
        Some(folder) if folder.as_os_str().is_empty() => Path::new("."),
        Some(folder) => folder,
        None => return Err(OutputError::IsFolder { path: path.into() }),
    };
    if !folder.is_dir() {
        return Err(OutputError::NoFolder { path: path.into(), folder: folder.into() });
    }
    remove_leftovers(folder, path.file_name().unwrap_or_default());
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}-{count}.part", process::id()));
    Ok(folder.join(name))
}

/// Removes what runs that were killed have left beside a path: files and folders of such names as [`beside`] gives, which
/// nobody has locked.
fn remove_leftovers(folder: &Path, name: &OsStr) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.filter_map(Result::ok).filter(|entry| is_part(&entry.file_name(), name)) {
        let path = entry.path();
        // one that cannot be opened or locked is in use, or not ours to remove
        if File::open(&path).is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
        }
    }
}

/// Whether a name is one that [`beside`] gives for `name`: `.NAME.PID-COUNT.part`.
fn is_part(found: &OsStr, name: &OsStr) -> bool {
    let start = [b".", name.as_encoded_bytes(), b"."].concat();
    let middle =
        found.as_encoded_bytes().strip_prefix(&start[..]).and_then(|rest| rest.strip_suffix(b".part"));
    middle.is_some_and(|numbers| {
        let mut numbers = numbers.split(|&byte| byte == b'-');
        let is_number = |part: Option<&[u8]>| {
            part.is_some_and(|part| !part.is_empty() && part.iter().all(u8::is_ascii_digit))
        };
        is_number(numbers.next()) && is_number(numbers.next()) && numbers.next().is_none()
    })
}

/// A file in the same folder, removed when dropped unless it took the other's place.
struct Beside {
    /// Locked as long as it is written, so that another run does not take it for one that was left.
    file: File,
    path: PathBuf,
    kept: bool,
}

impl Beside {
    fn create(path: &Path) -> Result<Self, OutputError> {
        let beside = beside(path)?;
        let opened = OpenOptions::new().write(true).create_new(true).open(&beside);
        let file = opened.map_err(|source| OutputError::Io { path: path.into(), source })?;
        // some file systems know no locks; then nobody takes it for a leftover either
        let _ = file.try_lock();
        Ok(Self { file, path: beside, kept: false })
    }

    fn finish(&mut self, path: &Path) -> io::Result<()> {
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
        assert!(beside.finish(&taken).is_err());
        drop(beside);
        let mut left = names(folder.path());
        left.sort();
        assert_eq!(left, ["a.exr", "taken"]);
    }

    const OWN: OwnFolder<'static> =
        OwnFolder { is_own: |path| path.join("mark").is_file(), names: &["mark", "parts"] };

    #[test]
    fn folders_are_replaced_whole() {
        let around = tempfile::tempdir().unwrap();
        let path = around.path().join("made");
        let first: [(&str, &[u8]); 2] = [("mark", b"1"), ("parts/a", b"a")];
        write_folder_whole(&path, OWN, first).unwrap();
        fs::write(path.join("picture"), "of others").unwrap();
        check_folder_writable(&path, OWN).unwrap();
        let second: [(&str, &[u8]); 2] = [("mark", b"2"), ("parts/b", b"b")];
        write_folder_whole(&path, OWN, second).unwrap();
        assert_eq!(names(around.path()), ["made"]);
        assert_eq!(fs::read(path.join("mark")).unwrap(), b"2");
        assert_eq!(names(&path.join("parts")), ["b"]);
        assert_eq!(fs::read(path.join("picture")).unwrap(), b"of others");
    }

    #[test]
    fn folders_of_others_are_left_alone() {
        let around = tempfile::tempdir().unwrap();
        let path = around.path().join("taken");
        fs::create_dir(&path).unwrap();
        check_folder_writable(&path, OWN).unwrap();
        fs::write(path.join("letter"), "dear").unwrap();
        let error = check_folder_writable(&path, OWN).unwrap_err();
        assert!(matches!(error, OutputError::Taken { .. }), "{error}");
        let file = check_folder_writable(&path.join("letter"), OWN).unwrap_err();
        assert!(matches!(file, OutputError::IsFile { .. }), "{file}");
        let none = check_folder_writable(&path.join("a").join("b"), OWN).unwrap_err();
        assert!(matches!(none, OutputError::NoFolder { .. }), "{none}");
        // a file's path cannot be a folder's: what was begun goes
        let new = around.path().join("new");
        let clash: [(&str, &[u8]); 2] = [("mark", b"1"), ("mark/a", b"a")];
        assert!(write_folder_whole(&new, OWN, clash).is_err());
        assert_eq!(names(around.path()), ["taken"]);
    }

    #[test]
    fn leftovers_of_killed_runs_go() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let others =
            [".a.exr.7-0.part.txt", ".a.exr.x-0.part", ".a.exr.part", ".b.exr.7-0.part", "a.exr.7-0.part"];
        for name in others.iter().chain(&[".a.exr.123-0.part", ".a.exr.123-45.part"]) {
            fs::write(folder.path().join(name), "half").unwrap();
        }
        fs::create_dir_all(folder.path().join(".a.exr.124-1.part").join("meshes")).unwrap();
        let busy = Beside::create(&path).unwrap();
        let mut left = names(folder.path());
        left.retain(|name| !others.iter().any(|other| name == other));
        assert_eq!(left, [busy.path.file_name().unwrap()]);
        // what another writer has locked stays
        check_writable(&path).unwrap();
        assert!(busy.path.exists());
        drop(busy);
        assert_eq!(names(folder.path()).len(), others.len());
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
        // a link to a file that is not there yet, by way of another link and of folders
        let inner = folder.path().join("inner");
        fs::create_dir(&inner).unwrap();
        std::os::unix::fs::symlink("../new.exr", inner.join("second.exr")).unwrap();
        std::os::unix::fs::symlink("inner/second.exr", folder.path().join("first.exr")).unwrap();
        check_writable(&folder.path().join("first.exr")).unwrap();
        write_whole(&folder.path().join("first.exr"), b"whole").unwrap();
        assert_eq!(fs::read(folder.path().join("new.exr")).unwrap(), b"whole");
        assert!(fs::symlink_metadata(inner.join("second.exr")).unwrap().is_symlink());
        assert!(fs::symlink_metadata(folder.path().join("first.exr")).unwrap().is_symlink());
        std::os::unix::fs::symlink("circle", folder.path().join("circle")).unwrap();
        assert!(write_whole(&folder.path().join("circle"), b"").is_err());
        write_whole(Path::new("/dev/null"), b"gone").unwrap();
        check_writable(Path::new("/dev/null")).unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }
}
