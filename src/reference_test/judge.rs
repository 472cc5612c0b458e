//! Whether a picture is what its reference shows.

use crate::difference::{
    CompareError, CompareSettings, Comparison, Judge, LayerDifference, LayerRule, Metric, Status, Thresholds,
    compare,
};
use crate::film::{LayeredPicture, Part};

/// By what pictures are judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JudgeSettings {
    /// Greatest absolute error that does not fail, of references without variance.
    pub fail: f32,
    /// Whether a reference without variance fails, instead of being met value by value.
    pub ztest: bool,
}

impl Default for JudgeSettings {
    /// idiff's threshold.
    fn default() -> Self {
        Self { fail: Thresholds::default().fail, ztest: false }
    }
}

/// A verdict and its reasons.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// By what: thresholds or the z-test.
    pub by: Judge,
    /// Why it failed; nothing if it passed.
    pub failures: Vec<String>,
    /// What else is odd.
    pub notes: Vec<String>,
    /// The comparison, of pictures of one kind.
    pub comparison: Option<Comparison>,
}

impl Judgement {
    /// The figures in one line.
    #[must_use]
    pub fn figures(&self) -> String {
        let Some(found) = &self.comparison else { return String::new() };
        let mut told = match &found.ztest {
            Some(test) => test.to_string(),
            None if found.figures.max_error == 0.0 && found.figures.non_finite == 0 => "identical".to_owned(),
            None => {
                let figures = &found.figures;
                format!("max error {:.3e}, RMS {:.3e}", figures.max_error, figures.rms_error())
            }
        };
        if let Some(flip) = found.metrics.first() {
            told += &format!(", FLIP {:.4}", flip.mean);
        }
        told
    }
}

/// Whether a reference says how far its noise goes: by the z-test alone it can be judged then.
pub(super) fn is_estimate(reference: &LayeredPicture) -> bool {
    let has = |names: &[&str]| {
        reference.parts.first().is_some_and(|part| names.iter().all(|name| part.channel(name).is_some()))
    };
    has(&["R", "G", "B", "variance.R", "variance.G", "variance.B"]) || has(&["Y", "variance.Y"])
}

/// Judges a picture by all channels that its reference has.
///
/// A reference with the variance of its colours is judged by the z-test of the colours; its other layers, each pixel's first
/// sample, are of other places than the test's and only need to be finite. Other references are judged by thresholds, ids exactly.
/// Values that are not finite fail, in whichever of the two, in both too. Channels of the test alone are left out. A reference that
/// knows nothing of windows may be a crop.
#[must_use]
pub fn judge(reference: &LayeredPicture, test: &LayeredPicture, settings: &JudgeSettings) -> Judgement {
    let estimate = is_estimate(reference);
    let ztest = estimate || settings.ztest;
    let by = if ztest { Judge::ZTest } else { Judge::Thresholds };
    let mut judged = Judgement { by, failures: Vec::new(), notes: Vec::new(), comparison: None };
    if ztest && !estimate {
        judged
            .failures
            .push("the z-test needs a reference with variance.R, variance.G and variance.B".into());
        return judged;
    }
    let (reference, test) = fitted(reference, test);
    for (which, picture) in [("reference", &reference), ("test", &test)] {
        judged.failures.extend(non_finite(which, picture));
    }
    let has_colours = reference.parts.first().is_some_and(|part| {
        ["R", "G", "B"].iter().all(|name| part.channel(name).is_some()) || part.channel("Y").is_some()
    });
    let asked = CompareSettings {
        thresholds: Thresholds { fail: settings.fail, warn: settings.fail, ..Thresholds::default() },
        rules: if ztest { ignored(&reference, &mut judged.notes) } else { Vec::new() },
        ztest,
        metrics: if has_colours { vec![Metric::Flip] } else { Vec::new() },
        keep_colours: true,
        ..CompareSettings::default()
    };
    match compare(&reference, &test, &asked) {
        Ok(found) => {
            judged.failures.extend(reason(&found));
            judged.notes.extend(found.notes.iter().cloned());
            judged.comparison = Some(found);
        }
        Err(CompareError::Different(mismatch)) => judged.failures.extend(mismatch.reasons),
        Err(CompareError::Input(message)) => judged.failures.push(message),
    }
    judged
}

/// Both with the channels of the reference, and with the test's windows if the reference's file knows of none.
fn fitted(reference: &LayeredPicture, test: &LayeredPicture) -> (LayeredPicture, LayeredPicture) {
    let (mut reference, mut test) = (reference.clone(), test.clone());
    if let ([theirs], [ours]) = (reference.parts.as_mut_slice(), test.parts.as_mut_slice()) {
        ours.channels.retain(|channel| theirs.channel(&channel.name).is_some());
        let whole = reference.recorded.scene_hash.is_none() && theirs.data == reference.display;
        if whole && [theirs.data.width, theirs.data.height] == [ours.data.width, ours.data.height] {
            theirs.data = ours.data;
            reference.display = test.display;
        }
    }
    (reference, test)
}

/// How many values of a picture are not finite.
fn non_finite(which: &str, picture: &LayeredPicture) -> Option<String> {
    let (mut count, mut first) = (0_usize, None);
    for part in &picture.parts {
        for channel in &part.channels {
            for index in 0..part.data.pixels() {
                let value = channel.value(index);
                if !value.is_finite() {
                    count += 1;
                    first.get_or_insert_with(|| {
                        let [x, y] = part.data.place(index);
                        format!("{value} at ({x}, {y}, {})", channel.name)
                    });
                }
            }
        }
    }
    first.map(|first| format!("the {which} has {count} values that are not finite: {first}"))
}

/// Rules that let everything pass, of all layers but colours and variance.
fn ignored(reference: &LayeredPicture, notes: &mut Vec<String>) -> Vec<LayerRule> {
    let channels = reference.parts.iter().flat_map(|part: &Part| &part.channels);
    let mut layers: Vec<_> = channels.map(|channel| channel.layer()).collect();
    layers.sort_unstable();
    layers.dedup();
    layers.retain(|layer| !["", "variance"].contains(layer));
    if !layers.is_empty() {
        notes.push(format!("not compared, since other samples hit other places: {}", layers.join(", ")));
    }
    // no rule of that kind can fail to be read
    layers.iter().filter_map(|layer| LayerRule::parse(layer, "fail=inf,warn=inf").ok()).collect()
}

/// Why a comparison failed.
fn reason(found: &Comparison) -> Option<String> {
    if let Some(test) = found.ztest.as_ref().filter(|test| !test.passes) {
        return Some(format!("noise does not explain the difference: {test}"));
    }
    if found.status != Status::Fail {
        return None;
    }
    let fails = |layer: &&LayerDifference| layer.status == Status::Fail;
    let layers: Vec<_> = found.layers.iter().filter(fails).map(|layer| layer.name.as_str()).collect();
    let place = found.figures.max_place.as_ref().map_or_else(String::new, |place| {
        let (x, y, channel) = (place.x, place.y, &place.channel);
        format!(" at ({x}, {y}, {channel}): {} instead of {}", place.test, place.reference)
    });
    let (failing, pixels, most) = (found.failing, found.pixels, found.figures.max_error);
    let layers = layers.join(", ");
    Some(format!("{failing} of {pixels} pixels differ ({layers}), most by {most:.3e}{place}"))
}
