//! Pictures to compare.

use std::borrow::Cow;

/// The colours of a picture.
#[derive(Clone, Copy, Debug)]
pub struct ColourPicture<'a> {
    /// Width and height, neither 0.
    pub size: [usize; 2],
    /// Rows from the top, each from the left.
    pub pixels: &'a [[f32; 3]],
}

/// Two pictures of one size, with black for pixels that are not finite in either.
#[derive(Debug)]
pub(crate) struct Pair<'a> {
    pub(crate) size: [usize; 2],
    pub(crate) pixels: [Cow<'a, [[f32; 3]]>; 2],
    /// Places of pixels that are not finite in one picture, and not the same in the other.
    pub(crate) damaged: Vec<usize>,
}

impl<'a> Pair<'a> {
    /// # Panics
    /// If the sizes differ or are none, or if there are not as many pixels as they say.
    pub(crate) fn new(reference: ColourPicture<'a>, test: ColourPicture<'a>) -> Self {
        let [width, height] = reference.size;
        assert!(width > 0 && height > 0, "a picture has pixels");
        assert_eq!(reference.size, test.size, "the pictures are of one size");
        let originals = [reference.pixels, test.pixels];
        assert_eq!(
            originals.map(<[_]>::len),
            [width * height; 2],
            "a picture has as many pixels as its size"
        );
        let mut pixels = originals.map(Cow::Borrowed);
        let mut damaged = Vec::new();
        for (place, (a, b)) in reference.pixels.iter().zip(test.pixels).enumerate() {
            if !(is_finite(a) && is_finite(b)) {
                pixels.iter_mut().for_each(|pixels| pixels.to_mut()[place] = [0.0; 3]);
                if !is_same(a, b) {
                    damaged.push(place);
                }
            }
        }
        Self { size: reference.size, pixels, damaged }
    }
}

/// Whether all channels are finite.
pub(crate) fn is_finite(colour: &[f32; 3]) -> bool {
    colour.iter().all(|value| value.is_finite())
}

fn is_same(a: &[f32; 3], b: &[f32; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()))
}
