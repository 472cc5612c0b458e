//! EXR files written, and read back by the crate itself.

use std::fs;

use super::*;
use crate::film::{Aov, Film, FilmSettings, read_picture};
use exr::prelude::{FlatImage, MetaData, read_all_flat_layers_from_file};

fn picture() -> Image {
    let settings = FilmSettings { size: [40, 30], crop: Some([7, 11, 5, 3]), ..FilmSettings::default() };
    let film = Film::try_new(&settings, &Aov::ALL).unwrap();
    let mut image = film.image();
    let count = image.channels().len();
    let values: Vec<f32> = (0..15 * count).map(|i| i as f32 * 0.1 - 3.0).collect();
    image.put_tile(film.window(), &values);
    image
}

fn header() -> ExrHeader {
    ExrHeader {
        camera_from_world: DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0)),
        screen_window_width: 0.75,
        scene_hash: "abc".to_owned(),
        seed: u64::MAX,
        spp: 64,
        settings: "{\"object\":\"Würfel 立方体\"}".to_owned(),
        reference_scene: Some("0123".to_owned()),
    }
}

fn write(folder: &Path, name: &str) -> std::path::PathBuf {
    let path = folder.join(name);
    write_exr(&path, &picture(), &header()).unwrap();
    path
}

#[test]
fn channels_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "a.exr");
    let back: FlatImage = read_all_flat_layers_from_file(&path).unwrap();
    assert_eq!(back.layer_data.len(), 1, "one part");
    let image = picture();
    let channels = &back.layer_data[0].channel_data.list;
    assert_eq!(channels.len(), image.channels().len());
    for channel in channels {
        let name = channel.name.to_string();
        let want = image.channel(&name).expect("no channel that was not asked for");
        let FlatSamples::F32(got) = &channel.sample_data else {
            panic!("{name} is not 32-bit float");
        };
        assert_eq!(got, want, "{name}");
    }
    for name in ["R", "A", "depth.T", "st.S", "object.I", "variance.B", "geo_normal.Z"] {
        assert!(channels.iter().any(|c| c.name.eq(name)), "{name}");
    }
}

#[test]
fn pictures_are_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "a.exr");
    let read = read_picture(&path, false).unwrap();
    assert_eq!(read.size, [5, 3], "the data window");
    let image = picture();
    let colours = ["R", "G", "B"].map(|name| image.channel(name).unwrap());
    for (i, pixel) in read.pixels.iter().enumerate() {
        assert_eq!(*pixel, colours.map(|colour| colour[i]));
    }
    assert_ne!(read.pixels[0], read.pixels[5]);
}

fn written_by_the_crate(channels: &[(&str, FlatSamples)]) -> Result<Picture, PictureError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let list = channels.iter().map(|(name, samples)| AnyChannel::new(*name, samples.clone()));
    let channels = AnyChannels::sort(list.collect());
    exr::image::Image::from_channels((2, 1), channels).write().to_file(&path).unwrap();
    read_picture(&path, true)
}

#[test]
fn luminance_halves_and_missing_channels() {
    let halves = [0.5, 0.1].map(exr::prelude::f16::from_f32);
    let grey = written_by_the_crate(&[("Y", FlatSamples::F16(halves.to_vec()))]).unwrap();
    assert_eq!(grey.pixels, [[0.5; 3], [halves[1].to_f32(); 3]]);
    let depth = FlatSamples::F32(vec![1.0, 2.0]);
    let chroma = [("Y", depth.clone()), ("RY", depth.clone()), ("BY", depth.clone())];
    assert!(matches!(written_by_the_crate(&chroma), Err(PictureError::LuminanceChroma { .. })));
    let error = written_by_the_crate(&[("Z", depth.clone()), ("R", depth)]).unwrap_err().to_string();
    assert!(
        error.ends_with("a.exr: has the channels R, Z; a picture needs R, G and B, or one channel alone"),
        "{error}"
    );
}

#[test]
fn other_primaries_are_converted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let read = |primaries: Chromaticities, colour: [f32; 3]| {
        let list = ["R", "G", "B"].iter().zip(colour);
        let list = list.map(|(name, value)| AnyChannel::new(*name, FlatSamples::F32(vec![value])));
        let mut image = exr::image::Image::from_channels((1, 1), AnyChannels::sort(list.collect()));
        image.attributes.chromaticities = Some(primaries);
        image.write().to_file(&path).unwrap();
        let [pixel] = read_picture(&path, false).unwrap().pixels[..] else { panic!("one pixel") };
        pixel
    };
    let near = |got: [f32; 3], want: [f32; 3]| {
        assert!(got.iter().zip(want).all(|(got, want)| (got - want).abs() < 2e-4), "{got:?}, want {want:?}");
    };
    assert_eq!(read(REC_709, [0.1, 0.2, 0.3]), [0.1, 0.2, 0.3]);
    // CIE XYZ: the white D65, and Rec. 709's green (IEC 61966-2-1)
    let third = 1.0 / 3.0;
    let xyz = Chromaticities {
        red: Vec2(1.0, 0.0),
        green: Vec2(0.0, 1.0),
        blue: Vec2(0.0, 0.0),
        white: Vec2(third, third),
    };
    near(read(xyz, [0.9505, 1.0, 1.089]), [1.0; 3]);
    near(read(xyz, [0.3576, 0.7152, 0.1192]), [0.0, 1.0, 0.0]);
    // Rec. 2020 has the same white; its green is outside Rec. 709 (ITU-R BT.2087)
    let wide = Chromaticities {
        red: Vec2(0.708, 0.292),
        green: Vec2(0.17, 0.797),
        blue: Vec2(0.131, 0.046),
        white: REC_709.white,
    };
    near(read(wide, [1.0; 3]), [1.0; 3]);
    near(read(wide, [0.0, 1.0, 0.0]), [-0.5876, 1.1329, -0.1006]);
}

#[test]
fn header_says_all() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "a.exr");
    let meta = MetaData::read_from_file(&path, true).unwrap();
    let part = &meta.headers[0];
    let shared = &part.shared_attributes;
    assert_eq!(shared.display_window, IntegerBounds::new((0, 0), (40, 30)));
    assert_eq!(part.data_window(), IntegerBounds::new((7, 11), (5, 3)));
    assert_eq!(shared.chromaticities, Some(REC_709));
    let own = &part.own_attributes;
    assert!(own.software_name.as_ref().unwrap().to_string().starts_with("trimray "));
    let matrix = own.world_to_camera.unwrap();
    assert_eq!(matrix[12..], [1.0, 2.0, 3.0, 1.0], "row vectors");
    assert_eq!(own.screen_window_width, 0.75);
    let want = [
        ("trimray/version", AttributeValue::Text(text(env!("CARGO_PKG_VERSION")))),
        ("trimray/sceneHash", AttributeValue::Text(text("abc"))),
        ("trimray/seed", AttributeValue::Text(text("18446744073709551615"))),
        ("trimray/spp", AttributeValue::I32(64)),
        ("trimray/settings", AttributeValue::Text(text(&header().settings))),
    ];
    for (name, value) in want {
        assert_eq!(own.other.get(&text(name)), Some(&value), "{name}");
    }
    assert_eq!(own.capture_date, None);
}

#[test]
fn bytes_are_the_same_each_time() {
    let folder = tempfile::tempdir().unwrap();
    let first = fs::read(write(folder.path(), "first.exr")).unwrap();
    for i in 0..8 {
        let again = fs::read(write(folder.path(), "again.exr")).unwrap();
        assert!(first == again, "run {i} differs");
    }
}

#[test]
fn missing_folder_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("none/a.exr");
    let error = write_exr(&path, &picture(), &header()).unwrap_err();
    assert!(matches!(error, OutputError::NoFolder { .. }), "{error}");
}
