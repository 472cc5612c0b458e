//! Files of a folder that is exported.

use std::path::Path;
use std::{fs, io};

use crate::film::{
    Area, LayeredChannel, LayeredPicture, Numbers, Part, PictureLimits, Recorded, SampleKind, encode_layers,
    read_channel_within,
};

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

/// The pictures of textures and environment maps, copied as they are, and single channels of them.
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

    /// Takes one channel of a picture along as an EXR file; returns its path in the folder.
    pub(super) fn take_channel(&mut self, path: &Path, channel: &str, raw: bool) -> io::Result<String> {
        let picture =
            read_channel_within(path, channel, raw, PictureLimits::NONE).map_err(io::Error::other)?;
        let [width, height] = picture.size;
        let area = Area { x: 0, y: 0, width, height };
        let numbers = Numbers::Real(picture.pixels.iter().map(|pixel| pixel[0]).collect());
        let grey = LayeredChannel { name: "Y".to_owned(), kind: SampleKind::Float, numbers };
        let picture = LayeredPicture {
            format: "OpenEXR",
            display: area,
            parts: vec![Part { name: None, data: area, channels: vec![grey] }],
            srgb_encoded: false,
            recorded: Recorded::default(),
            notes: Vec::new(),
        };
        let bytes = encode_layers(&picture).map_err(io::Error::other)?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let path = format!("{PICTURES}/{}.exr", id(self.files.len(), &stem));
        self.files.push(ExportedFile { path: path.clone(), bytes });
        Ok(path)
    }
}

/// A number and a name in letters that files and references can have.
pub(super) fn id(number: usize, name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    format!("{number}_{}", name.chars().take(40).map(plain).collect::<String>())
}
