//! Where pictures differ most, and the picture of their difference.

use serde::Serialize;

use super::metrics::ErrorMap;
use super::pairing::{Mismatch, PartPair, pair};
use crate::film::{Area, LayeredChannel, LayeredPicture, Numbers, Part, Recorded, SampleKind};

/// Least distance of two of the worst pixels, in columns or rows: neighbours tell the same.
const APART: i32 = 8;

/// A pixel that differs much.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorstPixel {
    /// Column.
    pub x: i32,
    /// Row.
    pub y: i32,
    /// The part's name, if it has one.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub part: String,
    /// The greatest absolute error of its colours; if all colours are equal, of another layer in parts of that layer's
    /// greatest; infinite (in JSON null) where a value is not finite.
    pub error: f64,
}

impl WorstPixel {
    /// How many are told.
    pub const MOST: usize = 5;
}

/// The errors of a part's pixels.
pub(super) struct Scores {
    name: String,
    area: Area,
    /// The errors of colours without alpha.
    colour: Option<Vec<f32>>,
    /// The errors of colours and alpha, and where anything is not finite.
    main: Vec<f32>,
    /// The errors of the other layers, in parts of each one's greatest.
    others: Vec<f32>,
}

impl Scores {
    pub(super) fn new(part: &PartPair<'_>) -> Self {
        let none = vec![0.0; part.area.pixels()];
        Self { name: part.name.to_owned(), area: part.area, colour: None, main: none.clone(), others: none }
    }

    /// Takes in a colour channel's errors.
    pub(super) fn add_colour(&mut self, errors: &[f32]) {
        let colour = self.colour.get_or_insert_with(|| vec![0.0; errors.len()]);
        greatest(colour, errors.iter().copied());
    }

    /// Takes in a layer's errors.
    pub(super) fn add_layer(&mut self, is_colour: bool, errors: &[f32]) {
        if is_colour {
            greatest(&mut self.main, errors.iter().copied());
            return;
        }
        let most = finite_maximum(errors);
        if most > 0.0 {
            greatest(&mut self.others, errors.iter().map(|error| error / most));
        }
        let broken = errors.iter().map(|error| if error.is_finite() { 0.0 } else { *error });
        greatest(&mut self.main, broken);
    }

    /// The greatest differences of colours; without colours those of all layers.
    pub(super) fn error_map(&self) -> ErrorMap {
        let (name, values) = match &self.colour {
            Some(colour) => ("greatest absolute difference of the colours", colour.clone()),
            None => ("difference in parts of each layer's greatest", self.others.clone()),
        };
        let scale = finite_maximum(&values);
        ErrorMap { name, size: [self.area.width as usize, self.area.height as usize], values, scale }
    }

    /// The worst pixels that are not close to a worse one.
    pub(super) fn worst(&self) -> Vec<WorstPixel> {
        let same_colours = self.main.iter().all(|&error| error == 0.0);
        let scores = if same_colours { &self.others } else { &self.main };
        let mut worst: Vec<WorstPixel> = Vec::new();
        while worst.len() < WorstPixel::MOST {
            let mut most: Option<(f32, [i32; 2])> = None;
            for (index, &score) in scores.iter().enumerate() {
                if score > most.map_or(0.0, |(most, _)| most) {
                    let [x, y] = self.area.place(index);
                    let close =
                        |other: &WorstPixel| (other.x - x).abs() < APART && (other.y - y).abs() < APART;
                    if !worst.iter().any(close) {
                        most = Some((score, [x, y]));
                    }
                }
            }
            let Some((score, [x, y])) = most else { break };
            worst.push(WorstPixel { x, y, part: self.name.clone(), error: f64::from(score) });
        }
        worst
    }
}

fn greatest(all: &mut [f32], more: impl Iterator<Item = f32>) {
    all.iter_mut().zip(more).for_each(|(most, error)| *most = error.max(*most));
}

fn finite_maximum(values: &[f32]) -> f32 {
    values.iter().copied().filter(|value| value.is_finite()).fold(0.0, f32::max)
}

/// The picture of test - reference, times a factor; all channels as 32-bit floats.
///
/// With `absolute` of |test - reference|. Values that are NaN or infinite in both alike have no difference.
///
/// # Errors
/// If the pictures have other parts, channels or windows; with `overlap` only the common pixels are in it.
pub fn difference_layers(
    reference: &LayeredPicture,
    test: &LayeredPicture,
    overlap: bool,
    absolute: bool,
    scale: f64,
) -> Result<LayeredPicture, Mismatch> {
    let (pairs, _) = pair(reference, test, overlap)?;
    let parts = pairs.iter().map(|part| {
        let channels = part.layers.iter().flat_map(|layer| &layer.channels).map(|&channel| {
            let mut values = vec![0.0; part.area.pixels()];
            part.each(channel, |index, a, b| {
                let (a, b) = (a.number(), b.number());
                let same = a == b || (a.is_nan() && b.is_nan());
                let difference = if same { 0.0 } else { b - a };
                let difference = scale * if absolute { difference.abs() } else { difference };
                #[expect(clippy::cast_possible_truncation, reason = "the file is in single precision")]
                let single = difference as f32;
                values[index] = single;
            });
            LayeredChannel {
                name: channel.reference.name.clone(),
                kind: SampleKind::Float,
                numbers: Numbers::Real(values),
            }
        });
        let name = Some(part.name.to_owned()).filter(|name| !name.is_empty());
        Part { name, data: part.area, channels: channels.collect() }
    });
    Ok(LayeredPicture {
        format: "OpenEXR",
        display: reference.display,
        parts: parts.collect(),
        srgb_encoded: false,
        recorded: Recorded::default(),
        notes: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::difference::testing::{picture, values};

    #[test]
    fn worst_pixels_are_apart() {
        let names = [("R", 0.0), ("depth.T", 1.0)];
        let (a, mut b) = (picture([40, 10], &names), picture([40, 10], &names));
        let red = values(&mut b, "R");
        (red[3], red[4], red[20], red[12]) = (0.5, 0.9, 0.7, 0.1);
        values(&mut b, "depth.T")[39] = f32::NAN;
        let found = crate::difference::compare(&a, &b, &Default::default()).unwrap();
        let places: Vec<_> = found.worst.iter().map(|worst| (worst.x, worst.y)).collect();
        assert_eq!(places, [(39, 0), (4, 0), (20, 0), (12, 0)]);
        assert_eq!(found.errors.scale, 0.9);
        assert_eq!(found.errors.values[20], 0.7);
    }

    #[test]
    fn other_layers_count_where_colours_are_equal() {
        let names = [("R", 0.0), ("depth.T", 1.0)];
        let (a, mut b) = (picture([20, 1], &names), picture([20, 1], &names));
        (values(&mut b, "depth.T")[2], values(&mut b, "depth.T")[15]) = (3.0, 5.0);
        let found = crate::difference::compare(&a, &b, &Default::default()).unwrap();
        let worst: Vec<_> = found.worst.iter().map(|worst| (worst.x, worst.error)).collect();
        assert_eq!(worst, [(15, 1.0), (2, 0.5)]);
    }

    #[test]
    fn differences_are_signed_scaled_or_absolute() {
        let (mut a, mut b) = (picture([3, 1], &[("R", 1.0)]), picture([3, 1], &[("R", 0.25)]));
        (values(&mut a, "R")[1], values(&mut b, "R")[1]) = (f32::NAN, f32::NAN);
        values(&mut b, "R")[2] = f32::INFINITY;
        let of = |absolute, scale| {
            let mut made = difference_layers(&a, &b, false, absolute, scale).unwrap();
            values(&mut made, "R").clone()
        };
        assert_eq!(of(false, 1.0), [-0.75, 0.0, f32::INFINITY]);
        assert_eq!(of(true, 4.0), [3.0, 0.0, f32::INFINITY]);
    }
}
