//! Errors of channels, value by value, as OpenImageIO's `ImageBufAlgo::compare` counts them; with NaN and Inf counted apart.

use serde::Serialize;

use super::pairing::{ChannelPair, PartPair, Value};
use super::thresholds::Thresholds;
use super::ulp::ulp_distance;

/// A pixel's value is over the thresholds of failures.
pub(super) const FAIL: u8 = 1;
/// A pixel's error is beyond `hardfail`.
pub(super) const HARD_FAIL: u8 = 2;
/// A pixel's value is over the thresholds of warnings.
pub(super) const WARN: u8 = 4;
/// A pixel's error is beyond `hardwarn`.
pub(super) const HARD_WARN: u8 = 8;
/// A value is NaN or infinite, and the other picture's is not the same.
pub(super) const NON_FINITE: u8 = 16;

/// A pixel's value in both pictures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Place {
    /// Column.
    pub x: i32,
    /// Row.
    pub y: i32,
    /// The part's name, if it has one.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub part: String,
    /// The channel's full name.
    pub channel: String,
    /// In the reference.
    #[serde(serialize_with = "number_or_name")]
    pub reference: f64,
    /// In the other picture.
    #[serde(serialize_with = "number_or_name")]
    pub test: f64,
}

/// JSON has no NaN and no infinities; they are written as text.
fn number_or_name<S: serde::Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    if value.is_finite() { serializer.serialize_f64(*value) } else { serializer.collect_str(value) }
}

/// How far values are from those of the reference.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figures {
    /// Pairs of finite values; all means are over these.
    pub values: u64,
    sum: f64,
    sum_sq: f64,
    /// The greatest absolute error of finite values.
    pub max_error: f64,
    /// Where it is; none if there is no error.
    pub max_place: Option<Place>,
    max_index: usize,
    /// The greatest distance in units in the last place of the file's sample type.
    pub max_ulp: u64,
    sum_ulp: f64,
    /// Pairs that are equal.
    pub equal: u64,
    /// Values that are NaN or infinite in both pictures alike: they count as equal, and in no mean.
    pub equal_non_finite: u64,
    /// Values that are NaN or infinite in one picture, and not the same in the other.
    pub non_finite: u64,
    /// The first of these.
    pub non_finite_place: Option<Place>,
    non_finite_index: usize,
}

impl Figures {
    /// The mean absolute error; 0 if nothing is finite.
    #[must_use]
    pub fn mean_error(&self) -> f64 {
        self.sum / self.values.max(1) as f64
    }

    /// The mean squared error.
    #[must_use]
    pub fn mean_squared_error(&self) -> f64 {
        self.sum_sq / self.values.max(1) as f64
    }

    /// The root of the mean squared error.
    #[must_use]
    pub fn rms_error(&self) -> f64 {
        self.mean_squared_error().sqrt()
    }

    /// The peak signal-to-noise ratio in decibels, with peak 1; infinite if all finite values are equal.
    #[must_use]
    pub fn psnr(&self) -> f64 {
        -20.0 * libm::log10(self.rms_error())
    }

    /// The mean distance in units in the last place.
    #[must_use]
    pub fn mean_ulp(&self) -> f64 {
        self.sum_ulp / self.values.max(1) as f64
    }

    /// The share of values that are equal, NaN with NaN; 1 if there are none.
    #[must_use]
    pub fn equal_share(&self) -> f64 {
        let all = self.values + self.equal_non_finite + self.non_finite;
        if all == 0 { 1.0 } else { (self.equal + self.equal_non_finite) as f64 / all as f64 }
    }

    /// Takes in the figures of other values of the same pixels; of equal errors the first pixel's counts.
    pub(super) fn add(&mut self, other: &Self) {
        let greater = other.max_error > self.max_error;
        let earlier = other.max_error == self.max_error && other.max_index < self.max_index;
        if other.max_place.is_some() && (self.max_place.is_none() || greater || earlier) {
            (self.max_error, self.max_index) = (other.max_error, other.max_index);
            self.max_place.clone_from(&other.max_place);
        }
        if other.non_finite_place.is_some()
            && (self.non_finite_place.is_none() || other.non_finite_index < self.non_finite_index)
        {
            self.non_finite_index = other.non_finite_index;
            self.non_finite_place.clone_from(&other.non_finite_place);
        }
        self.values += other.values;
        self.sum += other.sum;
        self.sum_sq += other.sum_sq;
        self.max_ulp = self.max_ulp.max(other.max_ulp);
        self.sum_ulp += other.sum_ulp;
        self.equal += other.equal;
        self.equal_non_finite += other.equal_non_finite;
        self.non_finite += other.non_finite;
    }
}

/// What is found of a channel: figures, and for each pixel its flags and absolute error.
pub(super) struct Measured<'m> {
    /// Flags are added.
    pub(super) flags: &'m mut [u8],
    /// The greatest error of each pixel; infinite where values are not finite.
    pub(super) errors: &'m mut [f32],
}

/// Measures a channel under thresholds.
///
/// # Panics
/// If there are not as many flags and errors as pixels.
pub(super) fn measure(
    part: &PartPair<'_>,
    channel: ChannelPair<'_>,
    thresholds: &Thresholds,
    into: Measured<'_>,
) -> Figures {
    let mut figures = Figures::default();
    let kind = channel.kind();
    // summed row by row, so that a small error is not lost in a great sum
    let (mut row, mut row_sum, mut row_sum_sq) = (0, 0.0, 0.0);
    let width = part.area.width as usize;
    let (mut max_index, mut non_finite_index) = (None, None);
    part.each(channel, |index, a, b| {
        if index / width != row {
            figures.sum += std::mem::take(&mut row_sum);
            figures.sum_sq += std::mem::take(&mut row_sum_sq);
            row = index / width;
        }
        let (x, y) = (a.number(), b.number());
        if !(x.is_finite() && y.is_finite()) {
            if x == y || (x.is_nan() && y.is_nan()) {
                figures.equal_non_finite += 1;
            } else {
                figures.non_finite += 1;
                non_finite_index.get_or_insert(index);
                into.flags[index] |= FAIL | WARN | NON_FINITE;
                into.errors[index] = f32::INFINITY;
            }
            return;
        }
        let error = absolute_error(a, b);
        let ulp = if x == y { 0 } else { ulp_distance(kind, a, b) };
        figures.values += 1;
        figures.equal += u64::from(x == y);
        figures.max_ulp = figures.max_ulp.max(ulp);
        figures.sum_ulp += ulp as f64;
        row_sum += error;
        row_sum_sq += error * error;
        if error > figures.max_error {
            figures.max_error = error;
            max_index = Some(index);
        }
        into.flags[index] |= flags(thresholds, [x, y], error, ulp);
        #[expect(clippy::cast_possible_truncation, reason = "maps are in single precision")]
        let single = error as f32;
        into.errors[index] = into.errors[index].max(single);
    });
    figures.sum += row_sum;
    figures.sum_sq += row_sum_sq;
    let place = |index: usize| {
        let [x, y] = part.area.place(index);
        let (reference, test) = (part.at(0, channel.reference, index), part.at(1, channel.test, index));
        Place { x, y, part: part.name.to_owned(), channel: channel.reference.name.clone(), reference, test }
    };
    figures.max_place = max_index.map(place);
    figures.max_index = max_index.unwrap_or_default();
    figures.non_finite_place = non_finite_index.map(place);
    figures.non_finite_index = non_finite_index.unwrap_or_default();
    figures
}

/// |a - b|, of two singles in single precision as OpenImageIO has it.
fn absolute_error(a: Value, b: Value) -> f64 {
    match (a, b) {
        // the difference of finite singles may be too large for one
        (Value::Real(x), Value::Real(y)) if (x - y).is_finite() => f64::from((x - y).abs()),
        _ => (a.number() - b.number()).abs(),
    }
}

fn flags(thresholds: &Thresholds, [a, b]: [f64; 2], error: f64, ulp: u64) -> u8 {
    let mean = 0.5 * (a.abs() + b.abs());
    let relative = if mean > 0.0 { error / mean } else { 0.0 };
    let over = |absolute: f32, of_mean: f32| error > f64::from(absolute) && relative > f64::from(of_mean);
    let mut flags = 0;
    if over(thresholds.fail, thresholds.failrelative) || ulp > thresholds.ulp {
        flags |= FAIL;
    }
    if over(thresholds.warn, thresholds.warnrelative) {
        flags |= WARN;
    }
    if error > f64::from(thresholds.hardfail) {
        flags |= HARD_FAIL;
    }
    if error > f64::from(thresholds.hardwarn) {
        flags |= HARD_WARN;
    }
    flags
}

/// The verdict on pictures or layers; later ones are worse.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// No difference that counts.
    #[default]
    Pass,
    /// A difference that is worth a look.
    Warn,
    /// A difference that counts.
    Fail,
}

/// How many pixels have which flag.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Counts {
    pub(super) failing: u64,
    pub(super) warning: u64,
    fails_at_all: u64,
    warns_at_all: u64,
    hard_fail: u64,
    hard_warn: u64,
    non_finite: u64,
}

impl Counts {
    /// How many pixels have each flag.
    pub(super) fn from_flags(flags: &[u8]) -> Self {
        let count = |mask: u8| flags.iter().filter(|&&flags| flags & mask != 0).count() as u64;
        Self {
            failing: count(FAIL),
            warning: count(WARN),
            fails_at_all: count(FAIL | HARD_FAIL),
            warns_at_all: count(WARN | HARD_WARN),
            hard_fail: count(HARD_FAIL),
            hard_warn: count(HARD_WARN),
            non_finite: count(NON_FINITE),
        }
    }

    /// The verdict on `pixels` of them.
    ///
    /// A value that is not finite always fails. Otherwise the verdict is as OpenImageIO documents it for `idiff`, whose program
    /// looks at the hard thresholds and at warnings only if some pixel fails.
    pub(super) fn judge(&self, thresholds: &Thresholds, pixels: usize) -> Status {
        let over = |count: u64, percent: f32| count as f64 > f64::from(percent) / 100.0 * pixels as f64;
        let allowed = |count: u64| count <= thresholds.allowfailures;
        if self.non_finite > 0
            || (!allowed(self.fails_at_all)
                && (over(self.failing, thresholds.failpercent) || self.hard_fail > 0))
        {
            Status::Fail
        } else if !allowed(self.warns_at_all)
            && (over(self.warning, thresholds.warnpercent) || self.hard_warn > 0)
        {
            Status::Warn
        } else {
            Status::Pass
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::pairing::pair;
    use super::*;
    use crate::difference::testing::{picture, values};

    /// Figures, flags and errors of pictures of one row and one channel.
    fn measured(a: &[f32], b: &[f32], thresholds: &Thresholds) -> (Figures, Vec<u8>) {
        let width = u32::try_from(a.len()).unwrap();
        let (mut first, mut second) =
            (picture([width, 1], &[("R", 0.0)]), picture([width, 1], &[("R", 0.0)]));
        values(&mut first, "R").copy_from_slice(a);
        values(&mut second, "R").copy_from_slice(b);
        let (pairs, _) = pair(&first, &second, false).unwrap();
        let mut flags = vec![0; a.len()];
        let mut errors = vec![0.0; a.len()];
        let into = Measured { flags: &mut flags, errors: &mut errors };
        (measure(&pairs[0], pairs[0].layers[0].channels[0], thresholds, into), flags)
    }

    #[test]
    fn figures_are_means_roots_and_the_first_greatest() {
        let (figures, flags) = measured(
            &[0.0, 1.0, 2.0, 3.0],
            &[0.5, 1.0, 1.5, 3.25],
            &Thresholds { fail: 0.3, ..Thresholds::default() },
        );
        assert_eq!(figures.mean_error(), 1.25 / 4.0);
        assert_eq!(figures.rms_error(), (0.5625_f64 / 4.0).sqrt());
        assert!((figures.psnr() - 10.0 * (4.0_f64 / 0.5625).log10()).abs() < 1e-12);
        let place = figures.max_place.clone().unwrap();
        assert_eq!((place.x, place.reference, place.test, figures.max_error), (0, 0.0, 0.5, 0.5));
        assert_eq!(flags, [FAIL | WARN, 0, FAIL | WARN, WARN]);
        let (same, _) = measured(&[0.5], &[0.5], &Thresholds::default());
        assert_eq!((same.psnr(), same.max_place.is_none(), same.equal_share()), (f64::INFINITY, true, 1.0));
    }

    #[test]
    fn both_thresholds_must_be_exceeded() {
        // relative errors: 1 / 10.5, 1 / 1.5
        let thresholds = Thresholds { fail: 0.5, failrelative: 0.1, ..Thresholds::default() };
        let (_, flags) = measured(&[10.0, 1.0, 0.1], &[11.0, 2.0, 0.2], &thresholds);
        assert_eq!(flags.map_fail(), [false, true, false]);
    }

    trait MapFail {
        fn map_fail(&self) -> Vec<bool>;
    }

    impl MapFail for Vec<u8> {
        fn map_fail(&self) -> Vec<bool> {
            self.iter().map(|flags| flags & FAIL != 0).collect()
        }
    }

    #[test]
    fn values_that_are_not_finite_are_never_counted_away() {
        const NAN: f32 = f32::NAN;
        const INF: f32 = f32::INFINITY;
        let lax = Thresholds {
            fail: INF,
            failrelative: INF,
            failpercent: 100.0,
            allowfailures: 1000,
            warn: INF,
            ..Thresholds::default()
        };
        let alike = [NAN, INF, -INF, 1.0];
        let (figures, flags) = measured(&alike, &alike, &lax);
        assert_eq!((figures.equal_non_finite, figures.non_finite, figures.values), (3, 0, 1));
        assert_eq!(Counts::from_flags(&flags).judge(&lax, 4), Status::Pass);
        for (a, b) in [(NAN, 1.0), (1.0, NAN), (INF, 1.0), (INF, -INF), (NAN, INF), (-INF, NAN), (3e38, INF)]
        {
            let (figures, flags) = measured(&[0.0, a], &[0.0, b], &lax);
            let place = figures.non_finite_place.clone().unwrap();
            assert_eq!((figures.non_finite, place.x, figures.mean_error()), (1, 1, 0.0), "{a} {b}");
            assert_eq!(Counts::from_flags(&flags).judge(&lax, 2), Status::Fail, "{a} {b}");
        }
        let (figures, _) = measured(&[3e38], &[-3e38], &lax);
        assert!((figures.max_error / 6e38 - 1.0).abs() < 1e-6, "finite values have a finite difference");
    }

    #[test]
    fn verdicts() {
        let judge = |thresholds: Thresholds| {
            // errors 0, 0.1, 0.2, 0.9
            let (_, flags) = measured(&[0.0; 4], &[0.0, 0.1, 0.2, 0.9], &thresholds);
            Counts::from_flags(&flags).judge(&thresholds, 4)
        };
        let base = Thresholds { warn: 10.0, ..Thresholds::default() };
        assert_eq!(judge(base), Status::Fail);
        assert_eq!(judge(Thresholds { failpercent: 75.0, ..base }), Status::Pass);
        assert_eq!(judge(Thresholds { failpercent: 74.0, ..base }), Status::Fail);
        assert_eq!(judge(Thresholds { failpercent: 75.0, hardfail: 0.5, ..base }), Status::Fail);
        assert_eq!(judge(Thresholds { fail: 1.0, hardfail: 0.5, ..base }), Status::Fail, "idiff passes this");
        assert_eq!(judge(Thresholds { fail: 1.0, warn: 0.1, ..base }), Status::Warn, "idiff passes this");
        assert_eq!(judge(Thresholds { fail: 1.0, hardwarn: 0.5, ..base }), Status::Warn);
        assert_eq!(judge(Thresholds { fail: 1.0, warn: 0.1, warnpercent: 75.0, ..base }), Status::Pass);
        assert_eq!(judge(Thresholds { allowfailures: 3, hardfail: 0.5, ..base }), Status::Pass);
        assert_eq!(judge(Thresholds { allowfailures: 2, ..base }), Status::Fail);
    }
}
