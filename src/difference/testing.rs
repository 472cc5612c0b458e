//! Pictures for the tests.

use crate::film::{Area, LayeredChannel, LayeredPicture, Numbers, Part, Recorded, SampleKind};

/// Channels with the value of all their pixels.
pub(crate) type Layers<'a> = &'a [(&'a str, f32)];

/// A picture of one part.
pub(crate) fn picture([width, height]: [u32; 2], channels: Layers) -> LayeredPicture {
    let area = Area { x: 0, y: 0, width, height };
    let channels = channels.iter().map(|(name, value)| LayeredChannel {
        name: (*name).to_owned(),
        kind: SampleKind::Float,
        numbers: Numbers::Real(vec![*value; area.pixels()]),
    });
    LayeredPicture {
        format: "OpenEXR",
        display: area,
        parts: vec![Part { name: None, data: area, channels: channels.collect() }],
        srgb_encoded: false,
        recorded: Recorded::default(),
        notes: Vec::new(),
    }
}

/// The values of a channel.
pub(crate) fn values<'a>(picture: &'a mut LayeredPicture, name: &str) -> &'a mut Vec<f32> {
    let channel = picture.parts[0].channels.iter_mut().find(|channel| channel.name == name);
    match &mut channel.expect("a channel of that name").numbers {
        Numbers::Real(values) => values,
        Numbers::Whole(_) => panic!("{name} is not real"),
    }
}
