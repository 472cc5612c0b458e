//! Files of other formats, told by how they begin.

use super::stl::is_binary_stl;

/// How many bytes of a text are looked at.
const START: usize = 4096;

/// What a file is that is no OBJ file, with its article; none if that cannot be told.
pub(super) fn other_format(bytes: &[u8]) -> Option<&'static str> {
    const MARKS: [(&[u8], &str); 10] = [
        (b"glTF", "a binary glTF file"),
        (b"PK\x03\x04", "a ZIP archive"),
        (b"\x1f\x8b", "compressed by gzip"),
        (b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive"),
        (b"\x89PNG", "a PNG picture"),
        (b"\xff\xd8\xff", "a JPEG picture"),
        (b"\x76\x2f\x31\x01", "an OpenEXR picture"),
        (b"%PDF-", "a PDF file"),
        (b"Kaydara FBX Binary", "a binary FBX file"),
        (b"BLENDER", "a Blender file"),
    ];
    let marked = MARKS.iter().find(|(mark, _)| bytes.starts_with(mark)).map(|&(_, format)| format);
    marked.or_else(|| is_binary_stl(bytes).then_some("a binary STL file")).or_else(|| text_format(bytes))
}

fn text_format(bytes: &[u8]) -> Option<&'static str> {
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(START)]).to_lowercase();
    let start = start.trim_start_matches('\u{feff}').trim_start();
    let first_line = start.lines().next().unwrap_or_default().trim_end();
    match first_line {
        "ply" => return Some("a PLY file"),
        "off" | "coff" | "noff" | "stoff" => return Some("an OFF file"),
        _ => {}
    }
    if first_line.starts_with("solid") && (start.contains("facet") || start.contains("endsolid")) {
        return Some("an STL file in text");
    }
    let marks = [
        ("<!doctype html", "an HTML page"),
        ("<html", "an HTML page"),
        ("<?xml", "an XML file"),
        ("{", "a JSON file (glTF?)"),
        ("iso-10303-21", "a STEP file"),
        ("version https://git-lfs", "a pointer of Git LFS, which `git lfs pull` replaces by the file"),
        ("#vrml", "a VRML file"),
        ("; fbx", "an FBX file"),
    ];
    marks.iter().find(|(mark, _)| start.starts_with(mark)).map(|&(_, format)| format)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_told_by_their_start() {
        let mut stl = vec![b' '; 84 + 2 * 50];
        stl[80..84].copy_from_slice(&2_u32.to_le_bytes());
        assert_eq!(other_format(&stl), Some("a binary STL file"));
        assert_eq!(other_format(&stl[1..]), None);
        let cases: [(&str, &str); 6] = [
            ("solid x\n facet normal 0 0 1\n", "an STL file in text"),
            ("ply\r\nformat ascii 1.0\r\n", "a PLY file"),
            ("OFF\n4 4 6\n", "an OFF file"),
            ("\u{feff}\n<!DOCTYPE HTML><html>", "an HTML page"),
            ("{\"asset\":{}}", "a JSON file (glTF?)"),
            ("PK\u{3}\u{4}", "a ZIP archive"),
        ];
        for (text, want) in cases {
            assert_eq!(other_format(text.as_bytes()), Some(want), "{text}");
        }
        for text in ["", "# made by hand\nv 0 0 0\n", "solid ground\n", "plywood\n", "v 0 0 0\nf 1 1 1"] {
            assert_eq!(other_format(text.as_bytes()), None, "{text}");
        }
    }
}
