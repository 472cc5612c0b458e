//! The text of a scene file: read with care, and places in it.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::diagnostic::{Diagnostic, Location};

/// Largest scene file in bytes. Scenes are written by hand or by small programs and meshes are
/// files of their own, so a larger one is another file by mistake, or a device without end.
const MAX_BYTES: u64 = 64 << 20;

/// A scene's text, without byte order mark, and its lines.
pub(super) struct Source<'a> {
    /// The scene file.
    pub(super) path: &'a Path,
    /// Its text.
    pub(super) text: &'a str,
    line_starts: Vec<usize>,
}

impl<'a> Source<'a> {
    pub(super) fn new(path: &'a Path, text: &'a str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        let line_starts = std::iter::once(0).chain(ends.map(|(end, _)| end + 1)).collect();
        Self { path, text, line_starts }
    }

    /// The place of a byte; of the text's end for any byte beyond.
    pub(super) fn locate(&self, byte: usize) -> Location {
        let byte = self.text.floor_char_boundary(byte);
        let line = self.line_starts.partition_point(|start| *start <= byte);
        let before = &self.text[self.line_starts[line - 1]..byte];
        Location { line, column: before.chars().count() + 1 }
    }
}

/// Reads a scene file.
pub(super) fn read_text(path: &Path) -> Result<String, Diagnostic> {
    let fault = |location, message: String| Diagnostic {
        file: path.to_owned(),
        location,
        message,
        lacks_memory: false,
    };
    if path.is_dir() {
        return Err(fault(None, "is a folder; a scene is a TOML file".to_owned()));
    }
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(MAX_BYTES + 1).read_to_end(&mut bytes))
        .map_err(|error| fault(None, format!("cannot read the scene file: {error}")))?;
    if bytes.len() as u64 > MAX_BYTES {
        let message = format!("is larger than {MAX_BYTES} bytes; a scene is a small TOML file");
        return Err(fault(None, message));
    }
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let bytes = error.as_bytes();
        let prefix = String::from_utf8_lossy(&bytes[..valid]);
        let location = Source::new(path, &prefix).locate(valid);
        let byte = bytes[valid];
        let message = format!("is not UTF-8 text (byte 0x{byte:02x}); a scene is TOML in UTF-8");
        fault(Some(location), message)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters() {
        let source = Source::new(Path::new("a.toml"), "\u{feff}é = 1\r\nπ = 2\n");
        for (byte, line, column) in [(0, 1, 1), (2, 1, 2), (1, 1, 1), (8, 2, 1), (10, 2, 2), (99, 3, 1)] {
            assert_eq!(source.locate(byte), Location { line, column }, "byte {byte}");
        }
        let empty = Source::new(Path::new("a.toml"), "");
        assert_eq!(empty.locate(0), Location { line: 1, column: 1 });
    }
}
