//! Pictures that the real program must refuse by name, at once, whatever their headers ask for.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::io::Cursor;
use std::process::Command;

use common::{Run, SCENE, TestFolder};
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, ImageAttributes, IntegerBounds, Layer, LayerAttributes,
    WritableImage,
};
use image::{ImageFormat, RgbImage};
use trimray::film::Numbers;

/// An EXR file of 4 x 4 pixels with these channels, uncompressed or deflated.
fn exr(channels: &[&str], encoding: Encoding) -> Vec<u8> {
    let list = channels.iter().map(|name| AnyChannel::new(*name, FlatSamples::F32(vec![0.5; 16])));
    let layer = Layer::new((4, 4), LayerAttributes::default(), encoding, AnyChannels::sort(list.collect()));
    let attributes = ImageAttributes::new(IntegerBounds::from_dimensions((4, 4)));
    let mut file = Cursor::new(Vec::new());
    exr::image::Image::new(attributes, layer).write().to_buffered(&mut file).unwrap();
    file.into_inner()
}

/// The file with another last column and row in its data window.
fn with_window(mut file: Vec<u8>, last: [i32; 2]) -> Vec<u8> {
    let name = b"dataWindow\0box2i\0";
    let at = file.windows(name.len()).position(|bytes| bytes == name).unwrap() + name.len() + 4 + 8;
    file[at..at + 4].copy_from_slice(&last[0].to_le_bytes());
    file[at + 4..at + 8].copy_from_slice(&last[1].to_le_bytes());
    file
}

fn encoded(format: ImageFormat) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    RgbImage::new(4, 4).write_to(&mut file, format).unwrap();
    file.into_inner()
}

/// The checksum of PNG's chunks (ISO 3309).
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc: u32, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & 0_u32.wrapping_sub(crc & 1)))
    })
}

fn png_of(width: u32, height: u32) -> Vec<u8> {
    let mut file = encoded(ImageFormat::Png);
    file[16..20].copy_from_slice(&width.to_be_bytes());
    file[20..24].copy_from_slice(&height.to_be_bytes());
    let sum = crc(&file[12..29]).to_be_bytes();
    file[29..33].copy_from_slice(&sum);
    file
}

fn jpeg_of(width: u16, height: u16) -> Vec<u8> {
    let mut file = encoded(ImageFormat::Jpeg);
    let frame = file.windows(2).position(|mark| mark == [0xff, 0xc0]).unwrap();
    file[frame + 5..frame + 7].copy_from_slice(&height.to_be_bytes());
    file[frame + 7..frame + 9].copy_from_slice(&width.to_be_bytes());
    file
}

/// Runs the program with at most 1 GiB of address space and 20 s of processor time.
fn bounded(at: &TestFolder, arguments: &[&str]) -> Run {
    let program = env!("CARGO_BIN_EXE_trimray");
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -v 1048576; ulimit -t 20; exec \"$@\"", "sh", program]).args(arguments);
    let run = Run::of(command.current_dir(at.path("")).output().unwrap());
    assert!(!run.stderr.contains("panicked"), "{run:?}");
    run
}

#[test]
fn headers_that_promise_more_than_the_file_holds() {
    let at = TestFolder::new();
    let plain = exr(&["B", "G", "R"], Encoding::UNCOMPRESSED);
    let cases = [
        ("plain.exr", with_window(plain, [19_999, 19_999])),
        ("deflated.exr", with_window(exr(&["B", "G", "R"], Encoding::SMALL_LOSSLESS), [29_999, 19_999])),
        ("rows.exr", with_window(exr(&["B", "G", "R"], Encoding::SMALL_LOSSLESS), [3, 99_999_999])),
        ("tiles.exr", with_window(exr(&["B", "G", "R"], Encoding::FAST_LOSSLESS), [9_999, 99_999])),
        ("a.png", png_of(30_000, 30_000)),
        ("a.jpg", jpeg_of(30_000, 30_000)),
        ("wide.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 200000000\n\x01\x02\x03\x04".to_vec()),
        ("high.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 200000000 +X 4\n\x01\x02\x03\x04".to_vec()),
    ];
    at.write("good.exr", exr(&["B", "G", "R"], Encoding::UNCOMPRESSED));
    for (name, bytes) in cases {
        at.write(name, bytes);
        let run = bounded(&at, &["diff", "good.exr", name]);
        assert_eq!(run.code, 4, "{name}: {run:?}");
        assert!(run.stderr.contains(name) && run.stderr.contains("its header promises"), "{run:?}");
        let material = format!(
            "[[material]]\nname = \"m\"\ntype = \"diffuse\"\nreflectance = {{ texture = \"{name}\" }}\n{}",
            SCENE.replace("cube.obj\"", "cube.obj\"\nmaterial = \"m\"")
        );
        at.write("scene.toml", material);
        let run = bounded(&at, &["info", "scene.toml", "--threads", "1"]);
        assert_eq!(run.code, 2, "{name}: {run:?}");
        assert!(run.stderr.contains(name) && run.stderr.contains("its header promises"), "{run:?}");
    }
}

#[test]
fn pictures_that_do_not_fit_in_memory_are_refused() {
    // 36 million pixels of one colour: a run of 127 takes two bytes
    let (width, height) = (30_000_u16, 1_200);
    let runs = std::iter::repeat_n([255, 80], usize::from(width) / 127).flatten();
    let channel: Vec<u8> = runs.chain([128 + u8::try_from(width % 127).unwrap(), 80]).collect();
    let row = [&[2, 2], &width.to_be_bytes()[..], &channel.repeat(4)].concat();
    let mut file = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    file.extend(row.repeat(height));
    let at = TestFolder::new();
    at.write("a.hdr", file);
    let run = bounded(&at, &["diff", "a.hdr", "a.hdr"]);
    assert!(run.code == 4 && run.stderr.contains("a.hdr: takes 1584000000 bytes of memory"), "{run:?}");
}

#[test]
fn pictures_beyond_the_limit_are_refused_by_name() {
    let at = TestFolder::new();
    at.write("a.exr", exr(&["B", "G", "R"], Encoding::UNCOMPRESSED));
    at.write("a.png", encoded(ImageFormat::Png));
    assert_eq!(bounded(&at, &["diff", "a.exr", "a.exr", "--max-pixels", "16"]).code, 0);
    for name in ["a.exr", "a.png"] {
        let run = bounded(&at, &["diff", name, name, "--max-pixels", "15"]);
        assert_eq!(run.code, 4, "{run:?}");
        let message = format!(
            "{name}: has 4x4 pixels, more than the 15 that a picture may have; --max-pixels N allows"
        );
        assert!(run.stderr.contains(&message), "{run:?}");
        let sky = format!("[[light]]\ntype = \"envmap\"\nfile = \"{name}\"\n{SCENE}");
        at.write("sky.toml", sky);
        let run = at.refuse(&["info", "sky.toml", "--max-pixels", "15"], &[&message]);
        assert!(run.stderr.contains("sky.toml:3:"), "{run:?}");
        at.succeed(&["info", "sky.toml", "--max-pixels", "16"]);
    }
    // the default, 2^30, is beyond what any file of the test could hold
    let huge = with_window(exr(&["B", "G", "R"], Encoding::UNCOMPRESSED), [32_768, 32_767]);
    at.write("huge.exr", huge);
    let run = bounded(&at, &["diff", "a.exr", "huge.exr"]);
    assert!(run.code == 4 && run.stderr.contains("32769x32768 pixels, more than the 1073741824"), "{run:?}");
}

#[test]
fn pictures_of_all_formats_are_compared() {
    let at = TestFolder::new();
    let picture =
        RgbImage::from_fn(20, 10, |x, y| image::Rgb([x * 12, y * 25, 90].map(|n| u8::try_from(n).unwrap())));
    let formats = [
        ("a.png", ImageFormat::Png),
        ("a.tif", ImageFormat::Tiff),
        ("a.bmp", ImageFormat::Bmp),
        ("a.webp", ImageFormat::WebP),
        ("a.tga", ImageFormat::Tga),
    ];
    for (name, format) in formats {
        let mut file = Cursor::new(Vec::new());
        picture.write_to(&mut file, format).unwrap();
        at.write(name, file.into_inner());
        let run = bounded(&at, &["diff", "a.png", name]);
        assert_eq!(run.code, 0, "{name}: {run:?}");
        let mut other = picture.clone();
        other.put_pixel(3, 4, image::Rgb([0, 0, 0]));
        let mut file = Cursor::new(Vec::new());
        other.write_to(&mut file, format).unwrap();
        at.write(&format!("b{name}"), file.into_inner());
        let run = bounded(&at, &["diff", name, &format!("b{name}")]);
        assert!(run.code == 2 && run.stdout.contains("@ (3, 4, "), "{name}: {run:?}");
        // cut off, or refused for its size
        let bytes = at.read(name);
        at.write(name, &bytes[..bytes.len() / 2]);
        assert_eq!(bounded(&at, &["diff", name, name]).code, 4, "{name}");
        let run = bounded(&at, &["diff", "a.png", &format!("b{name}"), "--max-pixels", "199"]);
        assert!(
            run.code == 4 && run.stderr.contains(&format!("b{name}: has 20x10 pixels")),
            "{name}: {run:?}"
        );
        at.write("a.png", if name == "a.png" { bytes } else { at.read("a.png") });
    }
    let float = image::Rgba32FImage::from_pixel(2, 2, image::Rgba([2.0, 1.0, 0.5, 1.0]));
    image::DynamicImage::from(float).save(at.path("float.tif")).unwrap();
    let run = bounded(&at, &["diff", "float.tif", "float.tif", "--json"]);
    assert!(run.code == 0 && !run.stdout.contains("sRGB"), "{run:?}");
}

#[test]
fn one_channel_of_a_picture_is_a_texture() {
    let at = TestFolder::new();
    let channels = |list: &[(&str, f32)]| {
        let list = list.iter().map(|&(name, value)| AnyChannel::new(name, FlatSamples::F32(vec![value; 16])));
        let attributes = ImageAttributes::new(IntegerBounds::from_dimensions((4, 4)));
        let channels = AnyChannels::sort(list.collect());
        let layer = Layer::new((4, 4), LayerAttributes::default(), Encoding::UNCOMPRESSED, channels);
        let mut file = Cursor::new(Vec::new());
        exr::image::Image::new(attributes, layer).write().to_buffered(&mut file).unwrap();
        file.into_inner()
    };
    at.write("maps.exr", channels(&[("R", 0.1), ("G", 0.2), ("B", 0.3), ("masks.rough", 0.4)]));
    at.write("only.exr", channels(&[("masks.rough", 0.4)]));
    at.write("grey.exr", channels(&[("Y", 0.4)]));
    let scene = |texture: &str| {
        format!(
            "[[light]]\ntype = \"constant\"\n[[material]]\nname = \"m\"\ntype = \"diffuse\"\nreflectance = {texture}\n\
             [[object]]\nname = \"plane\"\nmaterial = \"m\"\nsurface = {{ type = \"plane\", origin = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0] }}\n"
        )
    };
    let rendered = |texture: &str| {
        at.write("scene.toml", scene(texture));
        at.succeed(&["render", "scene.toml", "-o", "a.exr", "--size", "8x8", "--spp", "1"]);
        let picture = trimray::film::read_layers(&at.path("a.exr")).unwrap();
        picture.parts[0].channels.iter().map(|channel| channel.numbers.clone()).collect::<Vec<_>>()
    };
    let want = rendered("0.4");
    for texture in [
        "{ texture = \"maps.exr\", channel = \"masks.rough\" }",
        "{ texture = \"only.exr\" }",
        "{ texture = \"grey.exr\" }",
    ] {
        let found = rendered(texture);
        let near = |a: &Numbers, b: &Numbers| match (a, b) {
            (Numbers::Real(a), Numbers::Real(b)) => a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6),
            _ => false,
        };
        assert!(found.iter().zip(&want).all(|(a, b)| near(a, b)), "{texture}");
    }
    at.write("scene.toml", scene("{ texture = \"maps.exr\", channel = \"masks.smooth\" }"));
    at.refuse(
        &["info", "scene.toml"],
        &["maps.exr: has no channel \"masks.smooth\", but B, G, R, masks.rough"],
    );
    // for Mitsuba, which takes no channel, it is a picture of its own
    at.write("scene.toml", scene("{ texture = \"maps.exr\", channel = \"masks.rough\" }"));
    at.succeed(&["export", "scene.toml", "--format", "mitsuba", "-o", "made", "--level", "0"]);
    let pictures: Vec<_> = std::fs::read_dir(at.path("made/pictures")).unwrap().collect();
    let picture = trimray::film::read_layers(&pictures[0].as_ref().unwrap().path()).unwrap();
    assert_eq!((pictures.len(), picture.parts[0].channels.len()), (1, 1));
    assert_eq!(picture.parts[0].channels[0].numbers, Numbers::Real(vec![0.4; 16]));
}

#[test]
fn kinds_of_exr_that_are_not_read_are_named() {
    let at = TestFolder::new();
    at.write("chroma.exr", exr(&["BY", "RY", "Y"], Encoding::UNCOMPRESSED));
    let mut deep = exr(&["Z"], Encoding::UNCOMPRESSED);
    deep[5] |= 0x08;
    at.write("deep.exr", deep);
    for (name, says) in
        [("chroma.exr", "is a luminance-chroma OpenEXR picture"), ("deep.exr", "is a deep OpenEXR picture")]
    {
        let run = bounded(&at, &["diff", name, name]);
        assert!(run.code == 4 && run.stderr.contains(&format!("{name}: {says}")), "{run:?}");
        at.write("sky.toml", format!("[[light]]\ntype = \"envmap\"\nfile = \"{name}\"\n{SCENE}"));
        at.refuse(&["info", "sky.toml"], &[name, says]);
    }
}
