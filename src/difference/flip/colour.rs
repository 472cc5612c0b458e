//! The colour spaces of FLIP, step by step in single precision, as NVIDIA's tool has them: the roots that follow make
//! a rounding error of 1e-7 an error of 1e-4 in the map.

/// A colour of any space: R, G, B; X, Y, Z; L*, a*, b*.
pub(super) type Colour = [f32; 3];

/// XYZ of Rec. 709 primaries under D65.
const XYZ_FROM_LINEAR: [Colour; 3] = [
    [10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0],
    [2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0],
    [1425312.0 / 73733382.0, 8788810.0 / 73733382.0, 70074185.0 / 73733382.0],
];

const LINEAR_FROM_XYZ: [Colour; 3] = [
    [3.241003275, -1.537398934, -0.498615861],
    [-0.969224334, 1.875930071, 0.041554224],
    [0.055639423, -0.204011202, 1.057148933],
];

/// XYZ of D65, and its inverse.
const WHITE: Colour = [0.950428545, 1.0, 1.0889003710];
const PER_WHITE: Colour = [1.052156925, 1.0, 0.918357670];

/// The sRGB curve (IEC 61966-2-1) of a linear value.
#[must_use]
pub fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * power(linear, 1.0 / 2.4) - 0.055 }
}

/// The linear value of a number on the sRGB curve.
pub(super) fn linear_from_srgb(share: f32) -> f32 {
    if share <= 0.04045 { share / 12.92 } else { power((share + 0.055) / 1.055, 2.4) }
}

/// Y of a linear colour (Rec. 709).
pub(super) fn luminance([red, green, blue]: Colour) -> f32 {
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}

/// `YyCxCz` of a linear colour: luminance, red against green, blue against yellow (2020 paper, spatial filtering). It
/// is linear in its argument, unlike CIELAB, so that it can be filtered.
pub(super) fn opponent(linear: Colour) -> Colour {
    let [x, y, z] = product(times(&XYZ_FROM_LINEAR, linear), PER_WHITE);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The linear colour of an opponent one, clamped to `[0, 1]`.
pub(super) fn linear_from_opponent([y, cx, cz]: Colour) -> Colour {
    let y = (y + 16.0) / 116.0;
    let xyz = [y + cx / 500.0, y, y - cz / 200.0];
    times(&LINEAR_FROM_XYZ, product(xyz, WHITE)).map(|value| value.clamp(0.0, 1.0))
}

/// CIELAB of a linear colour, a* and b* scaled by lightness for the Hunt effect: dark colours look less colourful
/// (Hunt 1952, as in the 2020 paper).
pub(super) fn perceived(linear: Colour) -> Colour {
    const DELTA: f32 = 6.0 / 29.0;
    const DELTA_SQ: f32 = DELTA * DELTA;
    let response = |share: f32| {
        if share > DELTA * DELTA_SQ {
            power(share, 1.0 / 3.0)
        } else {
            1.0 / (3.0 * DELTA_SQ) * share + 4.0 / 29.0
        }
    };
    let [x, y, z] = product(times(&XYZ_FROM_LINEAR, linear), PER_WHITE).map(response);
    let lightness = 116.0 * y - 16.0;
    let hunt = 0.01 * lightness;
    [lightness, hunt * (500.0 * (x - y)), hunt * (200.0 * (y - z))]
}

/// The `HyAB` distance: |ΔL*| and, added to it, the Euclidean one of a* and b* (Abasi, Tehran and Fairchild 2020).
pub(super) fn hyab(a: Colour, b: Colour) -> f32 {
    let [lightness, red_green, blue_yellow] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    lightness.abs() + (red_green * red_green + blue_yellow * blue_yellow).sqrt()
}

/// `base` to the power of `exponent`, rounded once; `base` is not negative.
pub(super) fn power(base: f32, exponent: f32) -> f32 {
    to_f32(libm::exp2(f64::from(exponent) * libm::log2(f64::from(base))))
}

pub(super) fn exp(exponent: f32) -> f32 {
    to_f32(libm::exp(f64::from(exponent)))
}

pub(super) fn exp2(exponent: f32) -> f32 {
    to_f32(libm::exp2(f64::from(exponent)))
}

pub(super) fn log2(value: f32) -> f32 {
    to_f32(libm::log2(f64::from(value)))
}

#[expect(clippy::cast_possible_truncation, reason = "pictures are kept in single precision")]
pub(super) const fn to_f32(value: f64) -> f32 {
    value as f32
}

fn times(matrix: &[Colour; 3], [x, y, z]: Colour) -> Colour {
    matrix.map(|row| row[0] * x + row[1] * y + row[2] * z)
}

fn product(a: Colour, b: Colour) -> Colour {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}
