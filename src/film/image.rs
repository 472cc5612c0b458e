//! Pictures in memory.

/// A rectangle of pixels: its least corner, counted from the top left, and its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

impl Window {
    /// How many pixels it has.
    #[must_use]
    pub const fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The pixels that are in both, if any.
    #[must_use]
    pub fn intersection(&self, other: Self) -> Option<Self> {
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        let right = (self.x + self.width).min(other.x + other.width);
        let bottom = (self.y + self.height).min(other.y + other.height);
        (x < right && y < bottom).then(|| Self { x, y, width: right - x, height: bottom - y })
    }

    /// The window and the pixels up to `border` away from it, within `limit`, which must hold it.
    #[must_use]
    pub fn grown(&self, border: u32, limit: Self) -> Self {
        let (x, y) = (self.x.saturating_sub(border).max(limit.x), self.y.saturating_sub(border).max(limit.y));
        let right = self.x.saturating_add(self.width).saturating_add(border).min(limit.x + limit.width);
        let bottom = self.y.saturating_add(self.height).saturating_add(border).min(limit.y + limit.height);
        Self { x, y, width: right - x, height: bottom - y }
    }

    /// Index of a pixel of the window, row by row.
    #[must_use]
    pub const fn index(&self, [x, y]: [u32; 2]) -> usize {
        (y - self.y) as usize * self.width as usize + (x - self.x) as usize
    }

    /// The pixels, row by row.
    pub fn places(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let Self { x, y, width, height } = *self;
        (y..y + height).flat_map(move |row| (x..x + width).map(move |column| [column, row]))
    }

    /// The window in tiles of at most `side`² pixels, row by row.
    pub fn tiles(&self, side: u32) -> impl Iterator<Item = Self> + use<> {
        let window = *self;
        let starts = move |length: u32| (0..length).step_by(side as usize);
        starts(window.height).flat_map(move |y| {
            starts(window.width).map(move |x| Self {
                x: window.x + x,
                y: window.y + y,
                width: side.min(window.width - x),
                height: side.min(window.height - y),
            })
        })
    }
}

/// One channel: a number for each pixel of the image's data window, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The full name, with its layer: `R`, `normal.X`.
    pub name: String,
    /// The numbers.
    pub values: Vec<f32>,
}

/// A picture of named 32-bit float channels, scene-linear.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    display_size: [u32; 2],
    data_window: Window,
    channels: Vec<Channel>,
}

impl Image {
    /// A black picture: `data_window` of a full frame of `display_size` pixels.
    #[must_use]
    pub fn new(display_size: [u32; 2], data_window: Window, names: &[String]) -> Self {
        let channel = |name: &String| Channel { name: name.clone(), values: vec![0.0; data_window.pixels()] };
        Self { display_size, data_window, channels: names.iter().map(channel).collect() }
    }

    /// Width and height of the full frame (OpenEXR's display window, which starts at 0, 0).
    #[must_use]
    pub const fn display_size(&self) -> [u32; 2] {
        self.display_size
    }

    /// The pixels there are (OpenEXR's data window).
    #[must_use]
    pub const fn data_window(&self) -> Window {
        self.data_window
    }

    /// The channels, in the order they were asked for.
    #[must_use]
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// The channel of that name.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        let channel = self.channels.iter().find(|channel| channel.name == name);
        channel.map(|channel| channel.values.as_slice())
    }

    /// Mixes a colour into R, G and B of a pixel, and 1 into A: `share` of it.
    ///
    /// # Panics
    /// If the pixel is not within the data window.
    pub(super) fn blend(&mut self, pixel: [u32; 2], colour: glam::DVec3, share: f64) {
        let index = self.data_window.index(pixel);
        for channel in &mut self.channels {
            let value = match channel.name.as_str() {
                "R" => colour.x,
                "G" => colour.y,
                "B" => colour.z,
                "A" => 1.0,
                _ => continue,
            };
            let before = f64::from(channel.values[index]);
            #[expect(clippy::cast_possible_truncation, reason = "pictures are 32-bit")]
            let mixed = (before + share * (value - before)) as f32;
            channel.values[index] = mixed;
        }
    }

    /// Writes a tile: `pixels` has all channels of its first pixel, then of its second, row by row.
    ///
    /// # Panics
    /// If the tile is not within the data window, or `pixels` is of another length.
    pub fn put_tile(&mut self, tile: Window, pixels: &[f32]) {
        let count = self.channels.len();
        assert_eq!(pixels.len(), tile.pixels() * count, "one number per channel and pixel");
        let (left, top) = (tile.x - self.data_window.x, tile.y - self.data_window.y);
        let (stride, width) = (self.data_window.width as usize, tile.width as usize);
        for (c, channel) in self.channels.iter_mut().enumerate() {
            for (row, line) in pixels.chunks_exact(width * count).enumerate() {
                let start = (top as usize + row) * stride + left as usize;
                let values = &mut channel.values[start..start + width];
                for (value, pixel) in values.iter_mut().zip(line.chunks_exact(count)) {
                    *value = pixel[c];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_the_window_once() {
        let window = Window { x: 3, y: 5, width: 37, height: 20 };
        let names = ["x".to_owned(), "y".to_owned()];
        let mut image = Image::new([100, 100], window, &names);
        let mut pixels = 0;
        for tile in window.tiles(16) {
            pixels += tile.pixels();
            let rows = tile.y..tile.y + tile.height;
            let values: Vec<f32> = rows
                .flat_map(|y| (tile.x..tile.x + tile.width).flat_map(move |x| [x as f32, y as f32]))
                .collect();
            image.put_tile(tile, &values);
        }
        assert_eq!(pixels, window.pixels());
        let (x, y) = (image.channel("x").unwrap(), image.channel("y").unwrap());
        for i in 0..window.pixels() {
            assert_eq!((x[i], y[i]), ((3 + i % 37) as f32, (5 + i / 37) as f32), "pixel {i}");
        }
        assert_eq!(image.channel("z"), None);
    }
}
