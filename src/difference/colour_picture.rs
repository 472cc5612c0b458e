//! Pictures to compare.

/// The colours of a picture.
#[derive(Clone, Copy, Debug)]
pub struct ColourPicture<'a> {
    /// Width and height, neither 0.
    pub size: [usize; 2],
    /// Rows from the top, each from the left.
    pub pixels: &'a [[f32; 3]],
}

/// Two pictures of one size, whose colours are looked up one by one.
pub(crate) trait PicturePair: Sync {
    /// Width and height, neither 0.
    fn size(&self) -> [usize; 2];

    /// A pixel of the reference, which is 0, or of the other, which is 1, by its place row by row.
    fn colour(&self, which: usize, place: usize) -> [f32; 3];
}

impl PicturePair for [ColourPicture<'_>; 2] {
    fn size(&self) -> [usize; 2] {
        self[0].size
    }

    fn colour(&self, which: usize, place: usize) -> [f32; 3] {
        self[which].pixels[place]
    }
}

/// Two pictures, with black for pixels that are not finite in either.
#[derive(Debug)]
pub(crate) struct Pair<'a, P> {
    pub(crate) size: [usize; 2],
    pictures: &'a P,
    /// Whether all pixels are finite.
    is_finite: bool,
    /// Places of pixels that are not finite in one picture, and not the same in the other.
    pub(crate) damaged: Vec<usize>,
}

impl<'a, 'p> Pair<'a, [ColourPicture<'p>; 2]> {
    /// # Panics
    /// If the sizes differ or are none, or if there are not as many pixels as they say.
    pub(crate) fn checked(pictures: &'a [ColourPicture<'p>; 2]) -> Self {
        let [reference, test] = pictures;
        let [width, height] = reference.size;
        assert_eq!(reference.size, test.size, "the pictures are of one size");
        let counts = [reference, test].map(|picture| picture.pixels.len());
        assert_eq!(counts, [width * height; 2], "a picture has as many pixels as its size");
        Self::new(pictures)
    }
}

impl<'a, P: PicturePair> Pair<'a, P> {
    /// # Panics
    /// If there are no pixels.
    pub(crate) fn new(pictures: &'a P) -> Self {
        let [width, height] = pictures.size();
        assert!(width > 0 && height > 0, "a picture has pixels");
        let mut pair = Self { size: [width, height], pictures, is_finite: true, damaged: Vec::new() };
        for place in 0..width * height {
            let [a, b] = [0, 1].map(|which| pictures.colour(which, place));
            if !(is_finite(&a) && is_finite(&b)) {
                pair.is_finite = false;
                if !is_same(&a, &b) {
                    pair.damaged.push(place);
                }
            }
        }
        pair
    }

    /// A pixel, black where it is not finite in both.
    pub(crate) fn colour(&self, which: usize, place: usize) -> [f32; 3] {
        let colour = self.pictures.colour(which, place);
        let is_usable = || is_finite(&colour) && is_finite(&self.pictures.colour(1 - which, place));
        if self.is_finite || is_usable() { colour } else { [0.0; 3] }
    }

    /// All pixels of one picture.
    pub(crate) fn colours(&self, which: usize) -> Vec<[f32; 3]> {
        (0..self.size[0] * self.size[1]).map(|place| self.colour(which, place)).collect()
    }
}

/// Whether all channels are finite.
pub(crate) fn is_finite(colour: &[f32; 3]) -> bool {
    colour.iter().all(|value| value.is_finite())
}

fn is_same(a: &[f32; 3], b: &[f32; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()))
}
