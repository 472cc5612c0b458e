//! Which channel of one picture is compared with which of the other.

use crate::film::{Area, LayeredChannel, LayeredPicture, Numbers, Part, SampleKind};
use crate::suggestion::closest;

/// Why two pictures cannot be compared pixel by pixel.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", reasons.join("\n"))]
pub struct Mismatch {
    /// One line for each reason.
    pub reasons: Vec<String>,
}

/// What a layer's numbers are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LayerKind {
    /// Channels without a dot in their name.
    Color,
    /// Numbers that name something: equal or not.
    Id,
    /// Directions.
    Normal,
    /// Anything else.
    Other,
}

/// Two channels of one name.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChannelPair<'a> {
    pub(super) reference: &'a LayeredChannel,
    pub(super) test: &'a LayeredChannel,
}

impl ChannelPair<'_> {
    /// Whether the numbers name something: the next number is another thing.
    pub(super) fn is_id(&self) -> bool {
        self.reference.kind == SampleKind::Uint
            || self.test.kind == SampleKind::Uint
            || self.reference.name.ends_with(".I")
    }

    /// The kind whose last place is the unit: that of both, or single precision.
    pub(super) fn kind(&self) -> SampleKind {
        if self.reference.kind == self.test.kind { self.reference.kind } else { SampleKind::Float }
    }
}

/// The channels of a layer.
#[derive(Debug)]
pub(super) struct LayerPair<'a> {
    /// Empty for colours.
    pub(super) name: &'a str,
    pub(super) kind: LayerKind,
    pub(super) channels: Vec<ChannelPair<'a>>,
}

/// Two parts with the same layers.
#[derive(Debug)]
pub(super) struct PartPair<'a> {
    /// Empty if it has none.
    pub(super) name: &'a str,
    /// The pixels that are compared.
    pub(super) area: Area,
    windows: [Area; 2],
    pub(super) layers: Vec<LayerPair<'a>>,
}

impl PartPair<'_> {
    /// Both values of each pixel, by its index in the area.
    pub(super) fn each(&self, channel: ChannelPair<'_>, mut each: impl FnMut(usize, Value, Value)) {
        let width = self.area.width as usize;
        for row in 0..self.area.height {
            let y = self.area.y.saturating_add_unsigned(row);
            let [Some(a), Some(b)] = self.windows.map(|window| window.index([self.area.x, y])) else {
                continue;
            };
            for column in 0..width {
                let index = row as usize * width + column;
                each(index, value(channel.reference, a + column), value(channel.test, b + column));
            }
        }
    }

    /// Where a pixel of the area is in one picture's data window.
    pub(super) fn index(&self, which: usize, place: usize) -> Option<usize> {
        if self.windows[which] == self.area {
            return Some(place);
        }
        self.windows[which].index(self.area.place(place))
    }

    /// One picture's value of a pixel.
    pub(super) fn at(&self, which: usize, channel: &LayeredChannel, index: usize) -> f64 {
        let place = self.area.place(index);
        self.windows[which].index(place).map_or(f64::NAN, |index| channel.value(index))
    }
}

/// A channel's value, still exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value {
    Real(f32),
    Whole(u32),
}

impl Value {
    pub(super) const fn number(self) -> f64 {
        match self {
            Self::Real(value) => value as f64,
            Self::Whole(value) => value as f64,
        }
    }
}

fn value(channel: &LayeredChannel, index: usize) -> Value {
    match &channel.numbers {
        Numbers::Real(values) => Value::Real(values[index]),
        Numbers::Whole(values) => Value::Whole(values[index]),
    }
}

/// Pairs parts and channels by their names; parts without one by their order.
///
/// With `overlap` only the pixels that are in both data windows are compared, and the display windows may differ.
///
/// # Errors
/// Every way in which the pictures are of different kinds.
pub(super) fn pair<'a>(
    reference: &'a LayeredPicture,
    test: &'a LayeredPicture,
    overlap: bool,
) -> Result<(Vec<PartPair<'a>>, Vec<String>), Mismatch> {
    let (mut reasons, mut notes, mut pairs) = (Vec::new(), Vec::new(), Vec::new());
    if reference.display != test.display {
        let said = format!("the display windows differ: {} against {}", reference.display, test.display);
        if overlap { notes.push(said) } else { reasons.push(said) }
    }
    for (a, b) in pair_parts(reference, test, &mut reasons, &mut notes) {
        let name = a.name.as_deref().unwrap_or_default();
        let of_part = if name.is_empty() { String::new() } else { format!(" of part {name:?}") };
        let area = match (a.data == b.data, a.data.intersection(b.data)) {
            (true, _) => Some(a.data),
            (false, Some(common)) if overlap => {
                notes.push(format!(
                    "only the {common} that both have{of_part} are compared: {} against {}",
                    a.data, b.data
                ));
                Some(common)
            }
            (false, common) => {
                let hint = if common.is_some() && !overlap {
                    "; --overlap compares what both have, --outside black all that one has"
                } else {
                    ""
                };
                reasons
                    .push(format!("the data windows{of_part} differ: {} against {}{hint}", a.data, b.data));
                None
            }
        };
        compare_names(a, b, &of_part, &mut reasons);
        note_kinds(a, b, &of_part, &mut notes);
        if let Some(area) = area {
            pairs.push(PartPair { name, area, windows: [a.data, b.data], layers: layers(a, b) });
        }
    }
    if reasons.is_empty() { Ok((pairs, notes)) } else { Err(Mismatch { reasons }) }
}

/// Both pictures with data windows that hold those of both, part by part, and black where there were no pixels.
///
/// # Errors
/// If a window that holds both has more than `max_pixels`.
pub fn with_black_outside(
    pictures: &[LayeredPicture; 2],
    max_pixels: u64,
) -> Result<[LayeredPicture; 2], Mismatch> {
    let [reference, test] = pictures;
    let (mut wide, mut reasons) = ([reference.clone(), test.clone()], Vec::new());
    let index =
        |picture: &LayeredPicture, part: &Part| picture.parts.iter().position(|own| std::ptr::eq(own, part));
    // what cannot be paired is told when the pictures are compared
    for (a, b) in pair_parts(reference, test, &mut Vec::new(), &mut Vec::new()) {
        let data = a.data.union(b.data).filter(|data| data.pixels() as u64 <= max_pixels);
        let Some(data) = data else {
            reasons.push(format!("the data windows {} and {} together have too many pixels", a.data, b.data));
            continue;
        };
        for ((picture, given), part) in wide.iter_mut().zip(pictures).zip([a, b]) {
            if let Some(index) = index(given, part).filter(|_| part.data != data) {
                picture.parts[index] = part.over(data);
            }
        }
    }
    if reasons.is_empty() { Ok(wide) } else { Err(Mismatch { reasons }) }
}

fn pair_parts<'a>(
    reference: &'a LayeredPicture,
    test: &'a LayeredPicture,
    reasons: &mut Vec<String>,
    notes: &mut Vec<String>,
) -> Vec<(&'a Part, &'a Part)> {
    if let ([a], [b]) = (reference.parts.as_slice(), test.parts.as_slice()) {
        if a.name.is_some() && b.name.is_some() && a.name != b.name {
            notes.push(format!(
                "the only parts are named {} and {}",
                a.name.as_deref().unwrap_or_default(),
                b.name.as_deref().unwrap_or_default()
            ));
        }
        return vec![(a, b)];
    }
    let unnamed = |picture: &'a LayeredPicture| picture.parts.iter().filter(|part| part.name.is_none());
    let mut pairs: Vec<_> = unnamed(reference).zip(unnamed(test)).collect();
    let [count, other] = [reference, test].map(|picture| unnamed(picture).count());
    if count != other {
        reasons.push(format!("the numbers of parts without a name differ: {count} against {other}"));
    }
    let named = |picture: &'a LayeredPicture, name: &Option<String>| {
        picture.parts.iter().find(|part| part.name.is_some() && part.name == *name)
    };
    for part in reference.parts.iter().filter(|part| part.name.is_some()) {
        match named(test, &part.name) {
            Some(other) => pairs.push((part, other)),
            None => {
                reasons.push(format!("the part {:?} is missing", part.name.as_deref().unwrap_or_default()));
            }
        }
    }
    for part in test.parts.iter().filter(|part| part.name.is_some()) {
        if named(reference, &part.name).is_none() {
            reasons.push(format!("the part {:?} is new", part.name.as_deref().unwrap_or_default()));
        }
    }
    pairs
}

/// Says which channels are in one part alone.
fn compare_names(a: &Part, b: &Part, of_part: &str, reasons: &mut Vec<String>) {
    let alone = |part: &Part, other: &Part| -> Vec<String> {
        let alone = part.channels.iter().filter(|channel| other.channel(&channel.name).is_none());
        alone.map(|channel| channel.name.clone()).collect()
    };
    let (missing, new) = (alone(a, b), alone(b, a));
    let mut said = Vec::new();
    if !missing.is_empty() {
        let candidates: Vec<_> = new.iter().map(String::as_str).collect();
        let meant = |name: &String| match closest(name, &candidates) {
            Some(near) => format!("{name} (did you mean the new {near}?)"),
            None => name.clone(),
        };
        said.push(format!("missing {}", missing.iter().map(meant).collect::<Vec<_>>().join(", ")));
    }
    if !new.is_empty() {
        said.push(format!("new {}", new.join(", ")));
    }
    if !said.is_empty() {
        reasons.push(format!("the channels{of_part} differ: {}", said.join("; ")));
    }
}

/// Says where the files hold the same channels with different precision.
fn note_kinds(a: &Part, b: &Part, of_part: &str, notes: &mut Vec<String>) {
    let mut found: Vec<(SampleKind, SampleKind, Vec<&str>)> = Vec::new();
    for channel in &a.channels {
        let Some(other) = b.channel(&channel.name).filter(|other| other.kind != channel.kind) else {
            continue;
        };
        match found.iter_mut().find(|(kind, with, _)| (*kind, *with) == (channel.kind, other.kind)) {
            Some((_, _, names)) => names.push(&channel.name),
            None => found.push((channel.kind, other.kind, vec![&channel.name])),
        }
    }
    notes.extend(found.into_iter().map(|(kind, with, names)| {
        let names = names.join(", ");
        format!(
            "samples{of_part} are {} in the reference and {} in the test: {names}",
            kind.name(),
            with.name()
        )
    }));
}

/// The layers of two parts, colours first, then in the order of their names.
fn layers<'a>(a: &'a Part, b: &'a Part) -> Vec<LayerPair<'a>> {
    let mut layers: Vec<LayerPair<'a>> = Vec::new();
    for reference in &a.channels {
        let Some(test) = b.channel(&reference.name) else { continue };
        let channel = ChannelPair { reference, test };
        match layers.iter_mut().find(|layer| layer.name == reference.layer()) {
            Some(layer) => layer.channels.push(channel),
            None => layers.push(LayerPair {
                name: reference.layer(),
                kind: LayerKind::Other,
                channels: vec![channel],
            }),
        }
    }
    for layer in &mut layers {
        layer.channels.sort_by_key(|channel| {
            let name = channel.reference.short_name();
            (["R", "G", "B", "A"].iter().position(|known| *known == name).unwrap_or(4), name)
        });
        layer.kind = kind(a, layer);
    }
    layers.sort_by_key(|layer| layer.name);
    layers
}

fn kind(part: &Part, layer: &LayerPair<'_>) -> LayerKind {
    let name = if layer.name.is_empty() { part.name.as_deref().unwrap_or_default() } else { layer.name };
    let short = |channel: &ChannelPair<'_>| channel.reference.short_name().to_owned();
    if layer.channels.iter().all(ChannelPair::is_id) {
        LayerKind::Id
    } else if ["normal", "geo_normal", "N", "Ng"].contains(&name)
        && layer.channels.iter().map(short).eq(["X", "Y", "Z"].map(str::to_owned))
    {
        LayerKind::Normal
    } else if layer.name.is_empty() {
        LayerKind::Color
    } else {
        LayerKind::Other
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::difference::testing::{Layers, picture};

    fn reasons(a: &LayeredPicture, b: &LayeredPicture) -> String {
        pair(a, b, false).map(|_| ()).unwrap_err().reasons.join("\n")
    }

    #[test]
    fn channels_are_matched_by_name() {
        let names: Layers = &[("B", 0.3), ("depth.T", 2.0), ("R", 0.1), ("G", 0.2), ("object.I", 1.0)];
        let (a, mut b) = (picture([2, 2], names), picture([2, 2], names));
        b.parts[0].channels.reverse();
        let (pairs, notes) = pair(&a, &b, false).unwrap();
        let layers: Vec<_> = pairs[0].layers.iter().map(|layer| (layer.name, layer.kind)).collect();
        let want = [("", LayerKind::Color), ("depth", LayerKind::Other), ("object", LayerKind::Id)];
        assert_eq!((layers.as_slice(), notes.len()), (&want[..], 0));
        for layer in &pairs[0].layers {
            assert!(layer.channels.iter().all(|pair| pair.reference.name == pair.test.name));
        }
        let order: Vec<_> = pairs[0].layers[0].channels.iter().map(|pair| pair.test.name.as_str()).collect();
        assert_eq!(order, ["R", "G", "B"]);
    }

    #[test]
    fn all_reasons_are_told() {
        let a = picture([2, 2], &[("R", 0.0), ("normal.X", 0.0)]);
        let mut b = picture([3, 2], &[("R", 0.0), ("normals.X", 0.0)]);
        let said = reasons(&a, &b);
        for part in [
            "the display windows differ: 2x2 at 0,0 against 3x2 at 0,0",
            "the data windows differ",
            "--overlap",
            "missing normal.X (did you mean the new normals.X?); new normals.X",
        ] {
            assert!(said.contains(part), "{part} is not in {said}");
        }
        b = a.clone();
        b.parts.push(Part { name: Some("more".into()), ..a.parts[0].clone() });
        b.parts[0].name = Some("first".into());
        let said = reasons(&a, &b);
        assert!(said.contains("the part \"more\" is new") && said.contains("without a name"), "{said}");
    }

    #[test]
    fn the_overlap_is_read_from_both_windows() {
        let (mut a, mut b) = (picture([4, 4], &[("Y", 0.0)]), picture([4, 4], &[("Y", 0.0)]));
        for (picture, [x, y]) in [(&mut a, [-1, 0]), (&mut b, [1, 2])] {
            let part = &mut picture.parts[0];
            part.data = Area { x, y, width: 4, height: 3 };
            let values = (0..12).map(|index| {
                let [x, y] = part.data.place(index);
                (10 * y + x) as f32
            });
            part.channels[0].numbers = Numbers::Real(values.collect());
        }
        let (pairs, notes) = pair(&a, &b, true).unwrap();
        assert_eq!(pairs[0].area, Area { x: 1, y: 2, width: 2, height: 1 });
        let mut seen = Vec::new();
        pairs[0]
            .each(pairs[0].layers[0].channels[0], |index, a, b| seen.push((index, a.number(), b.number())));
        assert_eq!(seen, [(0, 21.0, 21.0), (1, 22.0, 22.0)]);
        assert!(notes[0].contains("only the 2x1 at 1,2"), "{notes:?}");
        assert!(reasons(&a, &b).contains("--overlap"));
    }
}
