//! Two pictures compared: all parts, all layers, and the verdict.

use std::collections::BTreeMap;

use serde::Serialize;
use thiserror::Error;

use super::angle::{Angles, angles};
use super::colours::{ColourChannels, Colours};
use super::metrics::{self, ErrorMap, Measured, Metric};
use super::pairing::{ChannelPair, LayerKind, LayerPair, Mismatch, PartPair, pair};
use super::pixels::{Counts, Figures, Measured as Into, Status, measure};
use super::thresholds::{COLOUR_NAMES, LayerRule, Thresholds};
use super::worst::{Scores, WorstPixel};
use super::ztest::{Estimate, ZTest, z_test};
use crate::film::LayeredPicture;
use crate::suggestion::did_you_mean;

/// How to compare.
#[derive(Clone, Debug, Default)]
pub struct CompareSettings {
    /// What is allowed to layers without rules of their own, but for ids, which are exact.
    pub thresholds: Thresholds,
    /// What is allowed to single layers and channels; the last of several rules for the same counts.
    pub rules: Vec<LayerRule>,
    /// Whether to compare only the pixels that both have.
    pub overlap: bool,
    /// Whether colours are judged by [`z_test`] instead of thresholds.
    pub ztest: bool,
    /// Measures of the colours.
    pub metrics: Vec<Metric>,
    /// The greatest value of each metric that does not fail; of similarities the least.
    pub metric_fail: Option<f64>,
    /// Whether the colours are kept, for people to look at.
    pub keep_colours: bool,
}

/// Why there is no comparison.
#[derive(Clone, Debug, Error)]
pub enum CompareError {
    /// The pictures are of different kinds.
    #[error(transparent)]
    Different(#[from] Mismatch),
    /// What was asked for does not fit the pictures.
    #[error("{0}")]
    Input(String),
}

/// By what a layer is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Judge {
    /// Thresholds.
    Thresholds,
    /// The z-test of all colours; NaN and Inf fail all the same.
    ZTest,
    /// Nothing but that NaN and Inf fail.
    Nothing,
}

/// One layer's difference.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerDifference {
    /// The part's name, or nothing.
    pub part: String,
    /// The layer's name; `color` for channels without a dot.
    pub name: String,
    /// What its numbers are.
    pub kind: LayerKind,
    /// By what it is judged.
    pub judge: Judge,
    /// Its own verdict; that on the picture may be worse, where pixels of several layers fail.
    pub status: Status,
    /// The figures of all its channels together.
    pub figures: Figures,
    /// How many pixels are compared.
    pub pixels: usize,
    /// Pixels over the thresholds of failures.
    pub failing: u64,
    /// Pixels over the thresholds of warnings.
    pub warning: u64,
    /// What they are judged by, but for channels with rules of their own.
    pub thresholds: Thresholds,
    /// The angles between directions, if it holds any.
    pub angles: Option<Angles>,
    /// Each channel's name and figures.
    pub channels: Vec<(String, Figures)>,
}

/// What comparing found.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The verdict.
    pub status: Status,
    /// Over all channels that are compared.
    pub figures: Figures,
    /// How many pixels are compared, in all parts.
    pub pixels: usize,
    /// Pixels of which any value is over its thresholds of failures.
    pub failing: u64,
    /// Pixels of which any value is over its thresholds of warnings.
    pub warning: u64,
    /// Part by part; colours first.
    pub layers: Vec<LayerDifference>,
    /// If it was asked for.
    pub ztest: Option<ZTest>,
    /// As asked for.
    pub metrics: Vec<Measured>,
    /// The greatest absolute difference of each pixel's colours, or, without colours, of everything in parts of each layer's
    /// greatest.
    pub errors: ErrorMap,
    /// The colours of the first part, if it has any and they are kept.
    pub colours: Option<Colours>,
    /// The worst first.
    pub worst: Vec<WorstPixel>,
    /// What is odd about the comparison, for people.
    pub notes: Vec<String>,
}

impl Comparison {
    /// The first metric's map, or that of absolute differences.
    #[must_use]
    pub fn heat_map(&self) -> &ErrorMap {
        self.metrics.iter().find_map(|metric| metric.map.as_ref()).unwrap_or(&self.errors)
    }
}

/// Compares a picture with a reference.
///
/// Every value of every channel is compared with the reference's of the same name, at the same pixel. A pixel fails if any of its
/// values does, and counts once; percentages and counts that are allowed are of all layers together, but for ids and for layers
/// with rules of their own, which are judged each for itself.
///
/// # Errors
/// [`CompareError::Different`] if the pictures have other parts, channels or windows, [`CompareError::Input`] if a rule names no
/// layer, or if there are no colours for a metric or no variance for the z-test.
pub fn compare(
    reference: &LayeredPicture,
    test: &LayeredPicture,
    settings: &CompareSettings,
) -> Result<Comparison, CompareError> {
    let (parts, mut notes) = pair(reference, test, settings.overlap)?;
    check_rules(&parts, &settings.rules)?;
    for (which, picture) in [("reference", reference), ("test", test)] {
        notes.extend(picture.notes.iter().map(|note| format!("{which}: {note}")));
    }
    let srgb_encoded = [reference, test].map(|picture| picture.srgb_encoded);
    if srgb_encoded[0] != srgb_encoded[1] {
        notes.push(
            "one picture is on the sRGB curve and the other linear; thresholds compare them as they are"
                .into(),
        );
    }
    let first = parts.first().ok_or_else(|| CompareError::Input("there is no part to compare".to_owned()))?;
    let colours = ColourChannels::of_part(first, srgb_encoded);
    let ztest = settings.ztest.then(|| z_test_of(first)).transpose()?;
    let mut metrics = Vec::new();
    for &metric in &settings.metrics {
        let colours = colours.as_ref().ok_or_else(|| {
            CompareError::Input(format!(
                "--metric {}: the pictures have no colours R, G, B or Y",
                metric.name()
            ))
        })?;
        metrics.push(metrics::measure(metric, colours, settings.metric_fail));
    }
    let mut found = Comparison {
        status: Status::Pass,
        figures: Figures::default(),
        pixels: 0,
        failing: 0,
        warning: 0,
        layers: Vec::new(),
        ztest,
        metrics,
        errors: ErrorMap { name: "absolute difference", size: [0; 2], values: Vec::new(), scale: 0.0 },
        colours: colours.filter(|_| settings.keep_colours).map(|colours| colours.copied()),
        worst: Vec::new(),
        notes,
    };
    for (index, part) in parts.iter().enumerate() {
        let scores = compare_part(part, settings, &mut found);
        found.worst.extend(scores.worst());
        if index == 0 {
            found.errors = scores.error_map();
        }
    }
    found.worst.sort_by(|a, b| b.error.total_cmp(&a.error));
    found.worst.truncate(WorstPixel::MOST);
    let fails = found.ztest.as_ref().is_some_and(|test| !test.passes)
        || found.metrics.iter().any(|measured| measured.fails);
    if fails {
        found.status = Status::Fail;
    }
    Ok(found)
}

/// Whose thresholds a channel is judged by; those of one group count pixels together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Group {
    All,
    Ids,
    Rule(usize),
    ZTest,
    Nothing,
}

impl Group {
    /// The group of a channel; none if it is ignored.
    fn for_channel(
        layer: &LayerPair<'_>,
        channel: &ChannelPair<'_>,
        settings: &CompareSettings,
    ) -> Option<Self> {
        let name = channel.reference.name.as_str();
        if settings.ztest && ["R", "G", "B", "Y"].contains(&name) {
            return Some(Self::ZTest);
        }
        let rules = settings.rules.iter().enumerate();
        let ruled =
            rules.filter_map(|(index, rule)| rule.is_for(name, layer.name).map(|scope| (scope, index))).max();
        match ruled {
            Some((_, index)) if settings.rules[index].ignores() => None,
            Some((_, index)) => Some(Self::Rule(index)),
            None if settings.ztest && (name == "A" || layer.name == "variance") => Some(Self::Nothing),
            None if channel.is_id() => Some(Self::Ids),
            None => Some(Self::All),
        }
    }

    fn thresholds(self, settings: &CompareSettings) -> Thresholds {
        match self {
            Self::All => settings.thresholds,
            Self::Ids => Thresholds::exact(),
            Self::Rule(index) => settings.rules[index].over(settings.thresholds),
            Self::ZTest | Self::Nothing => {
                Thresholds { fail: f32::INFINITY, warn: f32::INFINITY, ..Thresholds::default() }
            }
        }
    }

    const fn judge(self) -> Judge {
        match self {
            Self::All | Self::Ids | Self::Rule(_) => Judge::Thresholds,
            Self::ZTest => Judge::ZTest,
            Self::Nothing => Judge::Nothing,
        }
    }
}

/// Adds a part's layers to what was found.
fn compare_part(part: &PartPair<'_>, settings: &CompareSettings, found: &mut Comparison) -> Scores {
    let pixels = part.area.pixels();
    let mut groups: BTreeMap<Group, Vec<u8>> = BTreeMap::new();
    let mut scores = Scores::new(part);
    for layer in &part.layers {
        let Some((difference, flags)) = compare_layer(part, layer, settings, &mut scores) else {
            let name = label(layer);
            found.notes.push(format!("layer {name} is ignored"));
            continue;
        };
        found.figures.add(&difference.figures);
        found.layers.push(difference);
        for (group, flags) in flags {
            unite(groups.entry(group).or_insert_with(|| vec![0; pixels]), &flags);
        }
    }
    let mut all = vec![0; pixels];
    for (group, flags) in &groups {
        let verdict = Counts::from_flags(flags).judge(&group.thresholds(settings), pixels);
        found.status = found.status.max(verdict);
        unite(&mut all, flags);
    }
    let counts = Counts::from_flags(&all);
    found.failing += counts.failing;
    found.warning += counts.warning;
    found.pixels += pixels;
    scores
}

fn unite(all: &mut [u8], more: &[u8]) {
    all.iter_mut().zip(more).for_each(|(all, more)| *all |= more);
}

/// A layer's difference and each of its groups' flags; nothing if all of it is ignored.
fn compare_layer(
    part: &PartPair<'_>,
    layer: &LayerPair<'_>,
    settings: &CompareSettings,
    scores: &mut Scores,
) -> Option<(LayerDifference, BTreeMap<Group, Vec<u8>>)> {
    let pixels = part.area.pixels();
    let compared: Vec<_> = layer
        .channels
        .iter()
        .filter_map(|channel| Some((*channel, Group::for_channel(layer, channel, settings)?)))
        .collect();
    let (_, main) = *compared.first()?;
    let mut flags: BTreeMap<Group, Vec<u8>> = BTreeMap::new();
    let (mut figures, mut channels) = (Figures::default(), Vec::new());
    let mut layer_errors = vec![0.0; pixels];
    for &(channel, group) in &compared {
        let mut errors = vec![0.0; pixels];
        let into = Into { flags: flags.entry(group).or_insert_with(|| vec![0; pixels]), errors: &mut errors };
        let of_channel = measure(part, channel, &group.thresholds(settings), into);
        figures.add(&of_channel);
        channels.push((channel.reference.name.clone(), of_channel));
        if group != Group::Nothing {
            layer_errors.iter_mut().zip(&errors).for_each(|(most, error)| *most = error.max(*most));
        }
        if layer.name.is_empty() && channel.reference.name != "A" {
            scores.add_colour(&errors);
        }
    }
    scores.add_layer(layer.name.is_empty(), &layer_errors);
    let angles = match (layer.kind, compared.as_slice()) {
        (LayerKind::Normal, &[(x, _), (y, _), (z, _)]) => {
            let limit = main.thresholds(settings).degrees;
            let flags = flags.entry(main).or_insert_with(|| vec![0; pixels]);
            Some(angles(part, [x, y, z], limit, flags))
        }
        _ => None,
    };
    let mut all = vec![0; pixels];
    let mut status = Status::Pass;
    for (group, flags) in &flags {
        status = status.max(Counts::from_flags(flags).judge(&group.thresholds(settings), pixels));
        unite(&mut all, flags);
    }
    let counts = Counts::from_flags(&all);
    let difference = LayerDifference {
        part: part.name.to_owned(),
        name: label(layer).to_owned(),
        kind: layer.kind,
        judge: main.judge(),
        status,
        figures,
        pixels,
        failing: counts.failing,
        warning: counts.warning,
        thresholds: main.thresholds(settings),
        angles,
        channels,
    };
    Some((difference, flags))
}

fn label<'a>(layer: &LayerPair<'a>) -> &'a str {
    if layer.name.is_empty() { COLOUR_NAMES[0] } else { layer.name }
}

/// Every rule is for some layer or channel.
fn check_rules(parts: &[PartPair<'_>], rules: &[LayerRule]) -> Result<(), CompareError> {
    let layers = || parts.iter().flat_map(|part| &part.layers);
    let all = || layers().flat_map(|layer| layer.channels.iter().map(move |channel| (layer, channel)));
    for rule in rules {
        if all().any(|(layer, channel)| rule.is_for(&channel.reference.name, layer.name).is_some()) {
            continue;
        }
        let mut names: Vec<_> = layers().map(label).collect();
        let known = names.join(", ");
        names.extend(all().map(|(_, channel)| channel.reference.name.as_str()));
        let meant = did_you_mean(&rule.name, &names);
        return Err(CompareError::Input(format!(
            "--layer {}: the pictures have no such layer (they have {known}){meant}",
            rule.name
        )));
    }
    Ok(())
}

/// The z-test of a part's colours.
fn z_test_of(part: &PartPair<'_>) -> Result<ZTest, CompareError> {
    let find = |name: &str| {
        let channels = part.layers.iter().flat_map(|layer| &layer.channels);
        channels.into_iter().find(|channel| channel.reference.name == name).copied()
    };
    for colours in [["R", "G", "B"].as_slice(), &["Y"]] {
        let radiance: Option<Vec<_>> = colours.iter().map(|name| find(name)).collect();
        let variance: Option<Vec<_>> = colours.iter().map(|name| find(&format!("variance.{name}"))).collect();
        let (Some(radiance), Some(variance)) = (radiance, variance) else { continue };
        let mut estimates =
            [0, 1].map(|_| Estimate { radiance: Vec::new(), variance: Vec::new(), colours: colours.len() });
        for (of_radiance, channels) in [(true, radiance), (false, variance)] {
            for channel in channels {
                part.each(channel, |_, a, b| {
                    for (estimate, value) in estimates.iter_mut().zip([a, b]) {
                        let values =
                            if of_radiance { &mut estimate.radiance } else { &mut estimate.variance };
                        values.push(value.number());
                    }
                });
            }
        }
        let [reference, test] = estimates;
        return Ok(z_test(&reference, &test));
    }
    let message = "--ztest needs the variance of both pictures: render them with aovs = [\"variance\"] in [render], which adds \
                   variance.R, variance.G and variance.B";
    Err(CompareError::Input(message.to_owned()))
}

#[cfg(test)]
mod tests;
