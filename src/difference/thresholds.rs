//! What a difference may be before it fails, or is worth a warning.

use serde::Serialize;
use thiserror::Error;

use crate::choice::UnknownName;

/// Names by which the layer of channels without a dot is called: R, G, B, A.
pub(super) const COLOUR_NAMES: [&str; 5] = ["color", "colour", "RGBA", "RGB", ""];

/// When a difference fails or warns, with OpenImageIO's meaning; in single precision as there.
///
/// The relative error of two values is |a - b| / ((|a| + |b|) / 2). A value is over the thresholds if both its absolute and its
/// relative error are; a pixel with any such value counts once.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Thresholds {
    /// Greatest absolute error that does not fail.
    pub fail: f32,
    /// Greatest relative error that does not fail.
    pub failrelative: f32,
    /// Percentage of the pixels that may fail.
    pub failpercent: f32,
    /// A pixel with a greater absolute error fails everything, whatever the percentage.
    pub hardfail: f32,
    /// Greatest absolute error that does not warn.
    pub warn: f32,
    /// Greatest relative error that does not warn.
    pub warnrelative: f32,
    /// Percentage of the pixels that may warn.
    pub warnpercent: f32,
    /// A pixel with a greater absolute error warns, whatever the percentage.
    pub hardwarn: f32,
    /// So many pixels may differ by any amount; if there are no more, they neither fail nor warn.
    pub allowfailures: u64,
    /// Greatest angle between normals.
    pub degrees: f32,
    /// Greatest distance in units in the last place.
    pub ulp: u64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            fail: 1e-6,
            failrelative: 0.0,
            failpercent: 0.0,
            hardfail: f32::INFINITY,
            warn: 1e-6,
            warnrelative: 0.0,
            warnpercent: 0.0,
            hardwarn: f32::INFINITY,
            allowfailures: 0,
            degrees: f32::INFINITY,
            ulp: u64::MAX,
        }
    }
}

impl Thresholds {
    /// Only equal values pass: for ids, of which the next one is another thing.
    pub(super) fn exact() -> Self {
        Self { fail: 0.0, warn: 0.0, ..Self::default() }
    }
}

/// What is asked of a layer or channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Key {
    Fail,
    FailRelative,
    FailPercent,
    HardFail,
    Warn,
    WarnRelative,
    WarnPercent,
    HardWarn,
    AllowFailures,
    Degrees,
    Ulp,
    Ignore,
}

const KEYS: [(&str, Key); 12] = [
    ("fail", Key::Fail),
    ("failrelative", Key::FailRelative),
    ("failpercent", Key::FailPercent),
    ("hardfail", Key::HardFail),
    ("warn", Key::Warn),
    ("warnrelative", Key::WarnRelative),
    ("warnpercent", Key::WarnPercent),
    ("hardwarn", Key::HardWarn),
    ("allowfailures", Key::AllowFailures),
    ("degrees", Key::Degrees),
    ("ulp", Key::Ulp),
    ("ignore", Key::Ignore),
];

/// Why a text gives no thresholds of a layer.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LayerRuleError {
    /// A key that there is not.
    #[error("--layer {layer}: {error}")]
    Key {
        /// The layer.
        layer: String,
        /// The key, and those that there are.
        error: UnknownName,
    },
    /// A value that is no number of at least 0.
    #[error("--layer {layer}: {key}={value}: a number that is not negative is needed")]
    Value {
        /// The layer.
        layer: String,
        /// The key.
        key: String,
        /// The text in its place.
        value: String,
    },
}

/// Thresholds of one layer or channel, over those of all.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerRule {
    /// The layer (`depth`) or channel (`depth.T`); `color` or `RGBA` for the channels without a dot.
    pub name: String,
    settings: Vec<(Key, f64)>,
}

impl LayerRule {
    /// Reads `KEY=VALUE[,KEY=VALUE…]`: the names of the fields of [`Thresholds`], and `ignore`, which needs no value.
    ///
    /// With `degrees` or `ulp` and no `fail` or `warn`, these alone decide.
    ///
    /// # Errors
    /// If a key or a value is wrong; the message says what would be right.
    pub fn parse(name: &str, settings: &str) -> Result<Self, LayerRuleError> {
        let names = KEYS.map(|(name, _)| name);
        let mut parsed = Vec::new();
        for setting in settings.split(',') {
            let (key, value) = setting.split_once('=').unwrap_or((setting, ""));
            let Some((_, known)) = KEYS.iter().find(|(name, _)| *name == key.trim()) else {
                let error = UnknownName::new("key", &names, key);
                return Err(LayerRuleError::Key { layer: name.to_owned(), error });
            };
            let number = match (known, value.trim()) {
                (Key::Ignore, "" | "true") => Some(1.0),
                (Key::Ignore, "false") => Some(0.0),
                (Key::AllowFailures | Key::Ulp, text) => text.parse::<u32>().ok().map(f64::from),
                (_, text) => text.parse().ok().filter(|&number: &f64| number >= 0.0),
            };
            let number = number.ok_or_else(|| LayerRuleError::Value {
                layer: name.to_owned(),
                key: key.to_owned(),
                value: value.to_owned(),
            })?;
            parsed.push((*known, number));
        }
        Ok(Self { name: name.to_owned(), settings: parsed })
    }

    /// Whether the layer is left out.
    pub(super) fn ignores(&self) -> bool {
        self.settings
            .iter()
            .rev()
            .find(|(key, _)| *key == Key::Ignore)
            .is_some_and(|(_, value)| *value != 0.0)
    }

    fn has(&self, wanted: Key) -> bool {
        self.settings.iter().any(|(key, _)| *key == wanted)
    }

    /// The thresholds with this rule's in place of those of all.
    pub(super) fn over(&self, base: Thresholds) -> Thresholds {
        let mut all = base;
        if self.has(Key::Degrees) || self.has(Key::Ulp) {
            (all.fail, all.warn) = (f32::INFINITY, f32::INFINITY);
        }
        for &(key, value) in &self.settings {
            #[expect(clippy::cast_possible_truncation, reason = "thresholds are in single precision")]
            let single = value as f32;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "read as 32 bits")]
            let whole = value as u64;
            match key {
                Key::Fail => all.fail = single,
                Key::FailRelative => all.failrelative = single,
                Key::FailPercent => all.failpercent = single,
                Key::HardFail => all.hardfail = single,
                Key::Warn => all.warn = single,
                Key::WarnRelative => all.warnrelative = single,
                Key::WarnPercent => all.warnpercent = single,
                Key::HardWarn => all.hardwarn = single,
                Key::AllowFailures => all.allowfailures = whole,
                Key::Degrees => all.degrees = single,
                Key::Ulp => all.ulp = whole,
                Key::Ignore => {}
            }
        }
        all
    }

    /// Whether the rule is for a channel, by its full name, or else for a layer.
    pub(super) fn is_for(&self, channel: &str, layer: &str) -> Option<RuleScope> {
        if self.name == channel {
            Some(RuleScope::Channel)
        } else if self.name == layer || (layer.is_empty() && COLOUR_NAMES.contains(&self.name.as_str())) {
            Some(RuleScope::Layer)
        } else {
            None
        }
    }
}

/// What a rule's name names; the more special one counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum RuleScope {
    Layer,
    Channel,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_change_what_they_name() {
        let rule = LayerRule::parse("depth", "fail=0.5,failpercent=2,allowfailures=3").unwrap();
        let over = rule.over(Thresholds::default());
        let want = Thresholds { fail: 0.5, failpercent: 2.0, allowfailures: 3, ..Thresholds::default() };
        assert_eq!(over, want);
        assert!(!rule.ignores());
        assert_eq!(rule.is_for("depth.T", "depth"), Some(RuleScope::Layer));
        assert_eq!(rule.is_for("depth", ""), Some(RuleScope::Channel));
        assert_eq!(rule.is_for("R", ""), None);
        assert!(LayerRule::parse("x", "ignore").unwrap().ignores());
        let angle = LayerRule::parse("normal", "degrees=0.1").unwrap().over(Thresholds::default());
        assert_eq!((angle.fail, angle.degrees), (f32::INFINITY, 0.1), "the angle alone decides");
        let both = LayerRule::parse("normal", "degrees=0.1,fail=2").unwrap().over(Thresholds::default());
        assert_eq!((both.fail, both.degrees), (2.0, 0.1));
        for name in ["color", "RGBA"] {
            let rule = LayerRule::parse(name, "fail=1").unwrap();
            assert_eq!(rule.is_for("G", ""), Some(RuleScope::Layer), "{name}");
        }
    }

    #[test]
    fn wrong_rules_are_told() {
        let cases = [
            ("fial=1", "did you mean \"fail\"?"),
            ("fail=x", "fail=x: a number that is not negative is needed"),
            ("fail=-1", "a number"),
            ("fail=nan", "a number"),
            ("ulp=1.5", "a number"),
            ("fail", "a number"),
        ];
        for (text, want) in cases {
            let error = LayerRule::parse("depth", text).unwrap_err();
            let error = error.to_string();
            assert!(error.contains(want) && error.contains("--layer depth"), "{error}");
        }
    }
}
