//! Pictures with all that their files hold: parts, windows, channels and what is recorded of their making.

/// A rectangle of pixels that may begin left of or above the origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    /// First column.
    pub x: i32,
    /// First row.
    pub y: i32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

impl Area {
    /// How many pixels it has.
    #[must_use]
    pub const fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The place of a pixel, by its index row by row.
    ///
    /// # Panics
    /// If the area has no columns.
    #[must_use]
    pub fn place(&self, index: usize) -> [i32; 2] {
        let (row, column) = (index / self.width as usize, index % self.width as usize);
        #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "within the area")]
        let [right, down] = [column as i32, row as i32];
        [self.x + right, self.y + down]
    }

    /// Index of a pixel, row by row; none outside.
    #[must_use]
    pub fn index(&self, [x, y]: [i32; 2]) -> Option<usize> {
        let column = u32::try_from(i64::from(x) - i64::from(self.x)).ok()?;
        let row = u32::try_from(i64::from(y) - i64::from(self.y)).ok()?;
        (column < self.width && row < self.height)
            .then(|| row as usize * self.width as usize + column as usize)
    }

    /// The least area that holds both; none if it is too large to count.
    pub fn union(&self, other: Self) -> Option<Self> {
        let end = |start: i32, length: u32| i64::from(start) + i64::from(length);
        let (x, y) = (self.x.min(other.x), self.y.min(other.y));
        let right = end(self.x, self.width).max(end(other.x, other.width));
        let bottom = end(self.y, self.height).max(end(other.y, other.height));
        let width = u32::try_from(right - i64::from(x)).ok()?;
        let height = u32::try_from(bottom - i64::from(y)).ok()?;
        Some(Self { x, y, width, height })
    }

    /// The pixels that are in both, if any.
    #[must_use]
    pub fn intersection(&self, other: Self) -> Option<Self> {
        let end = |start: i32, length: u32| i64::from(start) + i64::from(length);
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        let right = end(self.x, self.width).min(end(other.x, other.width));
        let bottom = end(self.y, self.height).min(end(other.y, other.height));
        let width = u32::try_from(right - i64::from(x)).ok().filter(|&width| width > 0)?;
        let height = u32::try_from(bottom - i64::from(y)).ok().filter(|&height| height > 0)?;
        Some(Self { x, y, width, height })
    }
}

impl std::fmt::Display for Area {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{} at {},{}", self.width, self.height, self.x, self.y)
    }
}

/// How a file holds the values of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleKind {
    /// 16-bit floating point.
    Half,
    /// 32-bit floating point.
    Float,
    /// 32-bit whole numbers.
    Uint,
    /// 8 bits: n/255.
    Byte,
    /// 16 bits: n/65535.
    Short,
}

impl SampleKind {
    /// As OpenEXR and OpenImageIO call it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Half => "half",
            Self::Float => "float",
            Self::Uint => "uint",
            Self::Byte => "uint8",
            Self::Short => "uint16",
        }
    }
}

/// The values of a channel, row by row, without loss.
#[derive(Clone, Debug, PartialEq)]
pub enum Numbers {
    /// The values of a channel of any kind but [`SampleKind::Uint`].
    Real(Vec<f32>),
    /// The values of a channel of [`SampleKind::Uint`].
    Whole(Vec<u32>),
}

/// One channel of a part.
#[derive(Clone, Debug, PartialEq)]
pub struct LayeredChannel {
    /// The full name, with its layer: `R`, `normal.X`.
    pub name: String,
    /// How the file holds it.
    pub kind: SampleKind,
    /// One for each pixel of the part's data window.
    pub numbers: Numbers,
}

impl LayeredChannel {
    /// The name of the channel's layer: all before the last dot; empty for colours.
    #[must_use]
    pub fn layer(&self) -> &str {
        self.name.rsplit_once('.').map_or("", |(layer, _)| layer)
    }

    /// The name within its layer.
    #[must_use]
    pub fn short_name(&self) -> &str {
        self.name.rsplit_once('.').map_or(self.name.as_str(), |(_, short)| short)
    }

    /// The value of a pixel.
    ///
    /// # Panics
    /// If there is no such pixel.
    #[must_use]
    pub fn value(&self, index: usize) -> f64 {
        match &self.numbers {
            Numbers::Real(values) => f64::from(values[index]),
            Numbers::Whole(values) => f64::from(values[index]),
        }
    }
}

/// One part of a file, with the same pixels for all its channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its name; files of one part need none.
    pub name: Option<String>,
    /// The pixels that there are (OpenEXR's data window).
    pub data: Area,
    /// In the file's order.
    pub channels: Vec<LayeredChannel>,
}

impl Part {
    /// The part with more pixels around its own, all black; those outside of `data` are left out.
    #[must_use]
    pub fn over(&self, data: Area) -> Self {
        let place = |index: usize| self.data.index(data.place(index));
        let channels = self.channels.iter().map(|channel| {
            let numbers = match &channel.numbers {
                Numbers::Real(values) => Numbers::Real(
                    (0..data.pixels()).map(|index| place(index).map_or(0.0, |index| values[index])).collect(),
                ),
                Numbers::Whole(values) => Numbers::Whole(
                    (0..data.pixels()).map(|index| place(index).map_or(0, |index| values[index])).collect(),
                ),
            };
            LayeredChannel { name: channel.name.clone(), kind: channel.kind, numbers }
        });
        Self { name: self.name.clone(), data, channels: channels.collect() }
    }

    /// The channel of that name.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&LayeredChannel> {
        self.channels.iter().find(|channel| channel.name == name)
    }
}

/// What a file says of how its picture was made.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recorded {
    /// `software`.
    pub software: Option<String>,
    /// `trimray/version`.
    pub version: Option<String>,
    /// `trimray/sceneHash`.
    pub scene_hash: Option<String>,
    /// `trimray/seed`.
    pub seed: Option<String>,
    /// `trimray/spp`.
    pub spp: Option<String>,
    /// `trimray/settings`: JSON.
    pub settings: Option<String>,
    /// `reference/scene`: hash of the files of the scene that a reference was made from.
    pub reference_scene: Option<String>,
    /// `reference/command`: what makes the reference anew.
    pub reference_command: Option<String>,
}

/// A picture with everything that its file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct LayeredPicture {
    /// The format's name.
    pub format: &'static str,
    /// The full frame (OpenEXR's display window).
    pub display: Area,
    /// At least one.
    pub parts: Vec<Part>,
    /// Whether the colours are on the sRGB curve, as those of PNG and JPEG are taken to be.
    pub srgb_encoded: bool,
    /// What the first part says of its making.
    pub recorded: Recorded,
    /// What is odd about it, for people.
    pub notes: Vec<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_meet() {
        let area = Area { x: -2, y: 1, width: 4, height: 3 };
        let other = Area { x: 1, y: -5, width: 9, height: 7 };
        assert_eq!(area.intersection(other), Some(Area { x: 1, y: 1, width: 1, height: 1 }));
        assert_eq!(area.intersection(Area { x: 2, ..other }), None);
        for index in 0..area.pixels() {
            assert_eq!(area.index(area.place(index)), Some(index));
        }
        assert_eq!((area.index([2, 1]), area.index([-3, 1]), area.index([0, 4])), (None, None, None));
    }
}
