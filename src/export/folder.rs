//! Files of a folder that is exported.

use std::path::Path;
use std::{fs, io};

/// A file of an exported folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportedFile {
    /// Its path in the folder, with `/`.
    pub path: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// The folder of pictures.
pub(super) const PICTURES: &str = "pictures";

/// The pictures of textures and environment maps, copied as they are.
#[derive(Debug, Default)]
pub(super) struct Pictures {
    files: Vec<ExportedFile>,
}

impl Pictures {
    /// The files, in the order they were taken along.
    pub(super) fn into_files(self) -> Vec<ExportedFile> {
        self.files
    }

    /// Takes a picture along; returns its path in the folder.
    pub(super) fn take(&mut self, path: &Path) -> io::Result<String> {
        let bytes = fs::read(path)
            .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        let path = format!("{PICTURES}/{}.{extension}", id(self.files.len(), &stem));
        self.files.push(ExportedFile { path: path.clone(), bytes });
        Ok(path)
    }
}

/// A number and a name in letters that files and references can have.
pub(super) fn id(number: usize, name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    format!("{number}_{}", name.chars().take(40).map(plain).collect::<String>())
}
