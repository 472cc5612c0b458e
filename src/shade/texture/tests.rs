use super::*;
use TextureFilter::{Bilinear, Nearest};
use TextureWrap::{Clamp, Mirror, Repeat};

/// Texture coordinates, colour and number there.
type Row = ([f64; 2], [f64; 3], f64);

/// Printed by Mitsuba 3.9.1, variant `scalar_rgb`, of [`picture`], at (u, 1 - v) as it has them for OBJ files.
const BITMAPS: &[(TextureFilter, TextureWrap, bool, &[Row])] = &[
    (
        Bilinear,
        Repeat,
        false,
        &[
            ([0.1, 0.1], [0.3613068, 0.02969025, 0.06990618], 0.1031178),
            ([0.4, 0.3], [0.4521582, 0.1641286, 0.003899844], 0.2138206),
            ([0.5, 0.5], [0.2887904, 0.5637189, 0.0], 0.4645666),
            ([0.93, 0.97], [0.190892, 0.008727343, 0.403499], 0.07595875),
            ([-0.3, 1.2], [0.2095682, 0.08965514, 0.06701086], 0.1135229),
            ([1.7, -0.8], [0.2095679, 0.089655, 0.06701083], 0.1135228),
            ([2.6, 3.3], [0.3646956, 0.1521746, 0.03350537], 0.1888074),
            ([0.0, 0.0], [0.3047239, 0.01456621, 0.2568567], 0.09376021),
            ([0.3333333, 0.5], [0.4483603, 0.2946768, 0.003610967], 0.3063549),
        ],
    ),
    (
        Bilinear,
        Mirror,
        false,
        &[
            ([0.1, 0.1], [0.2158604, 0.05126944, 0.01444387], 0.08361551),
            ([0.4, 0.3], [0.4521582, 0.1641286, 0.003899844], 0.2138206),
            ([0.5, 0.5], [0.2887904, 0.5637189, 0.0], 0.4645666),
            ([0.93, 0.97], [0.0, 0.0, 1.0], 0.072169),
            ([-0.3, 1.2], [0.5999999, 0.4000001, 0.0], 0.4136666),
            ([1.7, -0.8], [0.6000004, 0.3999996, 0.0], 0.4136664),
            ([2.6, 3.3], [0.04052169, 0.6391308, 0.2703893], 0.4852123),
            ([0.0, 0.0], [0.2158604, 0.05126944, 0.01444387], 0.0836155),
            ([0.3333333, 0.5], [0.4483603, 0.2946768, 0.003610967], 0.3063549),
        ],
    ),
    (
        Bilinear,
        Clamp,
        false,
        &[
            ([0.1, 0.1], [0.2158604, 0.05126944, 0.01444387], 0.08361551),
            ([0.4, 0.3], [0.4521582, 0.1641286, 0.003899844], 0.2138206),
            ([0.5, 0.5], [0.2887904, 0.5637189, 0.0], 0.4645666),
            ([0.93, 0.97], [0.0, 0.0, 1.0], 0.072169),
            ([-0.3, 1.2], [1.0, 0.0, 0.0], 0.212671),
            ([1.7, -0.8], [0.00303527, 0.006995399, 0.01298306], 0.006585317),
            ([2.6, 3.3], [0.0, 0.0, 1.0], 0.072169),
            ([0.0, 0.0], [0.2158604, 0.05126944, 0.01444387], 0.0836155),
            ([0.3333333, 0.5], [0.4483603, 0.2946768, 0.003610967], 0.3063549),
        ],
    ),
    (
        Nearest,
        Repeat,
        true,
        &[
            ([0.1, 0.1], [0.5019608, 0.2509804, 0.1254902], 0.2953002),
            ([0.4, 0.3], [0.7843138, 0.3921569, 0.0], 0.4472557),
            ([0.93, 0.97], [0.0, 0.0, 1.0], 0.072169),
            ([-0.3, 1.2], [0.03921569, 0.07843138, 0.1176471], 0.0729215),
            ([1.7, -0.8], [0.03921569, 0.07843138, 0.1176471], 0.0729215),
            ([2.6, 3.3], [0.7843138, 0.3921569, 0.0], 0.4472557),
        ],
    ),
    (
        Nearest,
        Mirror,
        true,
        &[
            ([0.1, 0.1], [0.5019608, 0.2509804, 0.1254902], 0.2953002),
            ([0.4, 0.3], [0.7843138, 0.3921569, 0.0], 0.4472557),
            ([0.93, 0.97], [0.0, 0.0, 1.0], 0.072169),
            ([-0.3, 1.2], [1.0, 0.0, 0.0], 0.212671),
            ([1.7, -0.8], [1.0, 0.0, 0.0], 0.212671),
            ([2.6, 3.3], [0.0, 1.0, 0.0], 0.71516),
        ],
    ),
    (
        Nearest,
        Clamp,
        true,
        &[
            ([0.1, 0.1], [0.5019608, 0.2509804, 0.1254902], 0.2953002),
            ([0.4, 0.3], [0.7843138, 0.3921569, 0.0], 0.4472557),
            ([0.93, 0.97], [0.0, 0.0, 1.0], 0.072169),
            ([-0.3, 1.2], [1.0, 0.0, 0.0], 0.212671),
            ([1.7, -0.8], [0.03921569, 0.07843138, 0.1176471], 0.0729215),
            ([2.6, 3.3], [0.0, 0.0, 1.0], 0.072169),
        ],
    ),
];

/// Printed by Mitsuba 3.9.1 of a board of 0.8 and (0.1, 0.2, 0.3), as [`BITMAPS`].
const BOARD: [Row; 7] = [
    ([0.1, 0.1], [0.1, 0.2, 0.3], 0.8),
    ([0.4, 0.3], [0.1, 0.2, 0.3], 0.8),
    ([0.5, 0.5], [0.8; 3], 0.2),
    ([0.93, 0.97], [0.1, 0.2, 0.3], 0.8),
    ([-0.3, 1.2], [0.8; 3], 0.2),
    ([1.7, -0.8], [0.8; 3], 0.2),
    ([2.6, 3.3], [0.8; 3], 0.2),
];

/// As [`BITMAPS`], bilinear and repeated, turned as by [`to_uv`]; and the default board, turned.
const TURNED: [([f64; 2], [f64; 3], f64); 7] = [
    ([0.1, 0.1], [0.4767033, 0.02623056, 0.06343074], 0.2),
    ([0.4, 0.3], [0.2933763, 0.00295727, 0.5811807], 0.2),
    ([0.5, 0.5], [0.4165467, 0.2989663, 0.002554129], 0.2),
    ([0.93, 0.97], [0.0764958, 0.003212963, 0.6498709], 0.2),
    ([-0.3, 1.2], [0.7058848, 0.002419193, 0.2439705], 0.4),
    ([1.7, -0.8], [0.2269456, 0.52439, 0.07377742], 0.2),
    ([2.6, 3.3], [0.331906, 0.08073643, 0.01014179], 0.2),
];

/// `translate([0.3, 0.1]).rotate(30).scale([2, 3])`.
fn to_uv() -> DAffine2 {
    let turn = DAffine2::from_angle_translation(30_f64.to_radians(), DVec2::new(0.3, 0.1));
    turn * DAffine2::from_scale(DVec2::new(2.0, 3.0))
}

/// Three by two pixels.
fn picture(raw: bool) -> Picture {
    let bytes = [[255_u8, 0, 0], [0, 255, 0], [0, 0, 255], [128, 64, 32], [200, 100, 0], [10, 20, 30]];
    let decoded = |byte: u8| {
        let encoded = f64::from(byte) / 255.0;
        let linear = if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) };
        #[expect(clippy::cast_possible_truncation, reason = "pictures are in single precision")]
        let value = if raw { encoded } else { linear } as f32;
        value
    };
    Picture { size: [3, 2], pixels: bytes.map(|pixel| pixel.map(decoded)).to_vec() }
}

fn bitmap(filter: TextureFilter, wrap: TextureWrap, raw: bool, to_uv: DAffine2) -> Texture {
    let source = BitmapSource { path: PathBuf::new(), channel: None, filter, wrap, raw, to_uv };
    Texture::Bitmap(Bitmap::new(picture(raw), &source))
}

fn assert_looks(name: &str, texture: &Texture, uv: [f64; 2], colour: [f64; 3], number: f64) {
    let got = texture.colour(uv.into());
    let off = (got - DVec3::from_array(colour)).abs().max_element();
    // Mitsuba weighs pixels in single precision
    assert!(off < 2e-6, "{name} at {uv:?}: {got}, Mitsuba has {colour:?}");
    let got = texture.number(uv.into());
    assert!((got - number).abs() < 2e-6, "{name} at {uv:?}: {got}, Mitsuba has {number}");
}

#[test]
fn bitmaps_are_those_of_mitsuba() {
    for (filter, wrap, raw, rows) in BITMAPS {
        let texture = bitmap(*filter, *wrap, *raw, DAffine2::IDENTITY);
        for (uv, colour, number) in *rows {
            assert_looks(&format!("{filter:?}, {wrap:?}"), &texture, *uv, *colour, *number);
        }
        let mean = if *raw { 0.3025796 } else { 0.2173623 };
        assert!((texture.mean() - mean).abs() < 1e-6, "{}", texture.mean());
    }
}

#[test]
fn boards_are_those_of_mitsuba() {
    let colours = [DVec3::splat(0.8), DVec3::new(0.1, 0.2, 0.3)];
    let board = Texture::Checkerboard(Checkerboard { colours, to_uv: DAffine2::IDENTITY });
    for (uv, colour, number) in BOARD {
        assert_looks("board", &board, uv, colour, number);
    }
    assert!((board.mean() - 0.5).abs() < 1e-15);
}

#[test]
fn textures_turn_as_in_mitsuba() {
    let turned = bitmap(Bilinear, Repeat, false, to_uv());
    let board = Texture::Checkerboard(Checkerboard { to_uv: to_uv(), ..Checkerboard::default() });
    for (uv, colour, of_board) in TURNED {
        assert_looks("turned", &turned, uv, colour, luminance(DVec3::from_array(colour)));
        assert_eq!(board.colour(uv.into()), DVec3::splat(of_board), "board at {uv:?}");
    }
}

#[test]
fn places_without_coordinates_have_a_colour() {
    for texture in [
        bitmap(Bilinear, Repeat, true, DAffine2::IDENTITY),
        bitmap(Nearest, Clamp, true, DAffine2::from_scale(DVec2::splat(1e308))),
        bitmap(Bilinear, Mirror, true, DAffine2::from_scale(DVec2::splat(1e308))),
    ] {
        let at_origin = texture.colour(DVec2::ZERO);
        for uv in [DVec2::NAN, DVec2::new(0.0, f64::INFINITY)] {
            assert!(texture.colour(uv) == at_origin || at_origin.is_nan(), "{texture:?} at {uv}");
        }
        // never outside of the picture
        for uv in [DVec2::splat(1e308), DVec2::splat(-1e308), DVec2::new(1e17, -1e-300)] {
            texture.colour(uv);
        }
    }
}
