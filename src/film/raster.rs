//! Pictures as a screen shows them.

/// Rows of 8-bit colours on the sRGB curve.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Raster {
    /// Width and height.
    pub size: [u32; 2],
    /// Rows from the top, each from the left.
    pub pixels: Vec<[u8; 3]>,
}

impl Raster {
    /// The raster of colours on the sRGB curve, which are clamped to `[0, 1]`; NaN is black.
    #[must_use]
    pub fn from_screen(size: [u32; 2], colours: &[[f32; 3]]) -> Self {
        let pixels = colours.iter().map(|colour| colour.map(|share| to_byte(f64::from(share))));
        Self { size, pixels: pixels.collect() }
    }

    /// Rasters of one height from left to right, with a gap of `gap` grey columns.
    ///
    /// # Panics
    /// If their heights differ.
    #[must_use]
    pub fn beside(rasters: &[&Self], gap: u32) -> Self {
        const GREY: [u8; 3] = [128; 3];
        let height = rasters.first().map_or(0, |raster| raster.size[1]);
        assert!(rasters.iter().all(|raster| raster.size[1] == height), "rasters of one height");
        let mut pixels = Vec::new();
        for row in 0..height as usize {
            for (index, raster) in rasters.iter().enumerate() {
                if index > 0 {
                    pixels.extend((0..gap).map(|_| GREY));
                }
                let width = raster.size[0] as usize;
                pixels.extend(&raster.pixels[row * width..][..width]);
            }
        }
        let gaps = u32::try_from(rasters.len()).unwrap_or_default().saturating_sub(1) * gap;
        let width = rasters.iter().map(|raster| raster.size[0]).sum::<u32>() + gaps;
        Self { size: [width, height], pixels }
    }

    /// The raster if neither side is longer than `most`, or else means of squares of pixels, as few as it takes; what is left at the
    /// right and at the bottom counts for itself.
    #[must_use]
    pub fn shrunk(&self, most: u32) -> Self {
        let [width, height] = self.size;
        let side = width.max(height).div_ceil(most.max(1)).max(1);
        if side == 1 {
            return self.clone();
        }
        let size = self.size.map(|length| length.div_ceil(side));
        let mut pixels = Vec::new();
        for (row, column) in (0..size[1]).flat_map(|row| (0..size[0]).map(move |column| (row, column))) {
            let (mut sums, mut count) = ([0_u32; 3], 0);
            for y in row * side..((row + 1) * side).min(height) {
                for x in column * side..((column + 1) * side).min(width) {
                    let pixel = self.pixels[y as usize * width as usize + x as usize];
                    sums.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += u32::from(value));
                    count += 1;
                }
            }
            pixels.push(sums.map(|sum| u8::try_from((sum + count / 2) / count).unwrap_or(u8::MAX)));
        }
        Self { size, pixels }
    }
}

/// `[0, 1]` to the nearest of 0..=255; what is outside is clamped, NaN is 0.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the clamped value is in range, and the cast takes NaN to 0"
)]
pub(super) fn to_byte(value: f64) -> u8 {
    (255.0 * value.clamp(0.0, 1.0)).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rasters_stand_beside_each_other() {
        let one = Raster::from_screen([1, 2], &[[0.0, 0.5, 1.0], [2.0, -1.0, f32::NAN]]);
        assert_eq!(one.pixels, [[0, 128, 255], [255, 0, 0]]);
        let two = Raster { size: [2, 2], pixels: vec![[1; 3], [2; 3], [3; 3], [4; 3]] };
        let both = Raster::beside(&[&one, &two], 1);
        assert_eq!(both.size, [4, 2]);
        let want = [[0, 128, 255], [128; 3], [1; 3], [2; 3], [255, 0, 0], [128; 3], [3; 3], [4; 3]];
        assert_eq!(both.pixels, want);
    }

    #[test]
    fn large_rasters_are_shrunk() {
        let pixels = vec![[0; 3], [4; 3], [9; 3], [8; 3], [0; 3], [10; 3]];
        let raster = Raster { size: [3, 2], pixels };
        assert_eq!(raster.shrunk(3), raster);
        let small = Raster { size: [2, 1], pixels: vec![[3; 3], [10; 3]] };
        assert_eq!(raster.shrunk(2), small);
    }
}
