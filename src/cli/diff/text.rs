//! What `trimray diff` prints, in idiff's manner.

use std::fmt::Write;

use trimray::difference::{Figures, Judge, LayerDifference, LayerKind, Place, Status, WorstPixel};

use super::Found;

impl Found<'_> {
    /// All lines after the first.
    pub(super) fn text(&self) -> String {
        let found = &self.comparison;
        let mut text = figures(&found.figures);
        let thresholds = self.args;
        let counts = [(found.warning, thresholds.warn), (found.failing, thresholds.fail)];
        for (count, threshold) in counts {
            let _ = writeln!(text, "  {} over {}", pixels(count, found.pixels), general(threshold.into()));
        }
        if found.layers.len() > 1 {
            let differs = |layer: &&LayerDifference| self.args.verbose || layer.figures.equal_share() < 1.0;
            for layer in found.layers.iter().filter(differs) {
                text += &block(layer);
            }
        } else if let [layer] = found.layers.as_slice() {
            text += &special(layer);
        }
        if let Some(test) = &found.ztest {
            let verdict = if test.passes { "noise explains it" } else { "NOT explained by noise" };
            let _ = writeln!(text, "  z-test: {verdict}: {test}");
            let _ = writeln!(
                text,
                "    largest |z| has p = {}; a value fails below {}",
                general(test.smallest_p),
                general(test.significance)
            );
        }
        for metric in &found.metrics {
            let max = metric.max.map_or_else(String::new, |max| format!(", greatest {}", general(max)));
            let fails = if metric.fails { ": beyond --metricfail" } else { "" };
            let _ = writeln!(text, "  {} = {}{max}{fails}", metric.name, general(metric.mean));
        }
        if let (Some(path), map) = (&self.args.heatmap, self.comparison.heat_map()) {
            let scale = general(map.scale.into());
            let _ =
                writeln!(text, "  {}: {}, from 0 (black) to {scale} (pale yellow)", path.display(), map.name);
        }
        for note in &self.notes {
            let _ = writeln!(text, "  note: {note}");
        }
        for worst in &found.worst {
            let part = if worst.part.is_empty() { String::new() } else { format!(" of {}", worst.part) };
            let _ = write!(text, "  worst: ({}, {}){part} by {}", worst.x, worst.y, general(worst.error));
            let _ = match self.command(worst) {
                Some(command) => writeln!(text, "; {command}"),
                None => writeln!(text),
            };
        }
        text += match found.status {
            Status::Pass => "PASS\n",
            Status::Warn => "WARNING\n",
            Status::Fail => "FAILURE\n",
        };
        text
    }

    /// The command that renders a pixel alone, as the test was; none for a pixel outside the frame or if the files do not say.
    pub(super) fn command(&self, worst: &WorstPixel) -> Option<String> {
        let [reference, test] = &self.pictures;
        let recorded = [&test.recorded, &reference.recorded].into_iter().find(|made| made.spp.is_some())?;
        let (x, y) = (u32::try_from(worst.x).ok()?, u32::try_from(worst.y).ok()?);
        let scene = match &self.args.scene {
            Some(path) => quoted(&path.to_string_lossy()),
            None => "SCENE".to_owned(),
        };
        let [width, height] = [test.display.width, test.display.height];
        let mut command = format!("trimray render {scene} --size {width}x{height} --crop {x},{y},1,1");
        for (flag, value) in [("--spp", &recorded.spp), ("--seed", &recorded.seed)] {
            if let Some(value) = value {
                let _ = write!(command, " {flag} {}", quoted(value));
            }
        }
        Some(command + " -o worst.exr")
    }
}

/// A word for the shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/._-+,:".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

fn figures(figures: &Figures) -> String {
    let mut text = format!(
        "  Mean error = {}\n  RMS error = {}\n  Peak SNR = {}\n  Max error  = {}",
        general(figures.mean_error()),
        general(figures.rms_error()),
        general(figures.psnr()),
        general(figures.max_error)
    );
    if let Some(place) = &figures.max_place {
        text += &at(place);
    }
    text.push('\n');
    if let Some(place) = &figures.non_finite_place {
        let _ = writeln!(
            text,
            "  {} values are NaN or Inf in one picture alone, the first{}",
            figures.non_finite,
            at(place)
        );
    }
    if figures.equal_non_finite > 0 {
        let _ = writeln!(
            text,
            "  {} values are NaN or Inf in both alike; they are in no mean",
            figures.equal_non_finite
        );
    }
    text
}

fn at(place: &Place) -> String {
    let Place { x, y, part, channel, reference, test } = place;
    let part = if part.is_empty() { String::new() } else { format!("{part}: ") };
    format!(" @ ({x}, {y}, {part}{channel})  values are {} vs {}", exact(*reference), exact(*test))
}

/// A layer that differs.
fn block(layer: &LayerDifference) -> String {
    let part = if layer.part.is_empty() { String::new() } else { format!(" of part {}", layer.part) };
    let verdict = match (layer.judge, layer.status) {
        (Judge::ZTest, Status::Pass) => "judged by the z-test",
        (Judge::Nothing, Status::Pass) => "not judged",
        (_, Status::Pass) => "pass",
        (_, Status::Warn) => "warning",
        (_, Status::Fail) => "failure",
    };
    let mut text = format!("Layer {}{part}: {verdict}\n{}", layer.name, figures(&layer.figures));
    if layer.judge == Judge::Thresholds {
        let counts = [(layer.warning, layer.thresholds.warn), (layer.failing, layer.thresholds.fail)];
        for (count, threshold) in counts {
            if threshold.is_finite() {
                let _ =
                    writeln!(text, "  {} over {}", pixels(count, layer.pixels), general(threshold.into()));
            }
        }
    }
    text + &special(layer)
}

/// What only some kinds of layers have.
fn special(layer: &LayerDifference) -> String {
    let mut text = String::new();
    if layer.kind == LayerKind::Id {
        let _ = writeln!(text, "  {} % of the ids are equal", general(100.0 * layer.figures.equal_share()));
    }
    if let Some(angles) = layer.angles {
        let (max, mean) = (general(angles.max), general(angles.mean));
        let _ = writeln!(text, "  Max angle  = {max} degrees @ ({}, {}), mean {mean}", angles.x, angles.y);
        if layer.thresholds.degrees.is_finite() {
            let limit = general(layer.thresholds.degrees.into());
            let _ = writeln!(
                text,
                "  {} over {limit} degrees or other limits",
                pixels(layer.failing, layer.pixels)
            );
        }
    }
    if layer.thresholds.ulp != u64::MAX {
        let limit = layer.thresholds.ulp;
        let _ = writeln!(
            text,
            "  Max distance = {} units in the last place, allowed {limit}",
            layer.figures.max_ulp
        );
    }
    text
}

fn pixels(count: u64, all: usize) -> String {
    format!("{count} pixels ({}%)", significant(100.0 * count as f64 / all.max(1) as f64, 3))
}

/// As C's `%g` prints it.
pub(super) fn general(value: f64) -> String {
    significant(value, 6)
}

/// The shortest decimal that is the same single.
#[expect(clippy::cast_possible_truncation, reason = "of a value that came from a single, or a whole number")]
fn exact(value: f64) -> String {
    let single = value as f32;
    if f64::from(single) == value {
        general_or(f64::from(single), format!("{single}"))
    } else {
        value.to_string()
    }
}

fn general_or(value: f64, shortest: String) -> String {
    if !value.is_finite() || (value != 0.0 && !(1e-5..1e9).contains(&value.abs())) {
        significant(value, 9)
    } else {
        shortest
    }
}

/// C's `%.{digits}g`.
fn significant(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "nan".to_owned();
    }
    if value.is_infinite() {
        return if value > 0.0 { "inf" } else { "-inf" }.to_owned();
    }
    let scientific = format!("{value:.*e}", digits - 1);
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let trimmed = |text: &str| {
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text.to_owned()
        }
    };
    let before = i32::try_from(digits).unwrap_or(i32::MAX);
    if exponent < -4 || exponent >= before {
        let sign = if exponent < 0 { '-' } else { '+' };
        return format!("{}e{sign}{:02}", trimmed(mantissa), exponent.abs());
    }
    let after = usize::try_from(before - 1 - exponent).unwrap_or(0);
    trimmed(&format!("{value:.after$}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_printed_as_c_does() {
        let cases = [
            (0.0, "0"),
            (1.0, "1"),
            (0.1, "0.1"),
            (1e-6, "1e-06"),
            (0.000_123_456_789, "0.000123457"),
            (123_456.7, "123457"),
            (1_234_567.0, "1.23457e+06"),
            (-0.5, "-0.5"),
            (f64::INFINITY, "inf"),
            (f64::NAN, "nan"),
            (999_999.9, "1e+06"),
        ];
        for (value, want) in cases {
            assert_eq!(general(value), want);
        }
        assert_eq!(significant(1.5625, 3), "1.56");
        assert_eq!(exact(f64::from(0.1_f32)), "0.1");
        assert_eq!(exact(4_294_967_295.0), "4294967295");
        assert_eq!(exact(f64::from(1e-20_f32)), "9.99999968e-21");
    }

    #[test]
    fn words_are_quoted_for_the_shell() {
        assert_eq!(quoted("scenes/a.toml"), "scenes/a.toml");
        assert_eq!(quoted("it's a.toml"), "'it'\\''s a.toml'");
    }
}
