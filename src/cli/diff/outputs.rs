//! The files that `trimray diff` writes.

use std::path::Path;

use anyhow::Context;

use trimray::difference::{LayerDifference, Mismatch, Status, difference_layers};
use trimray::film::{Raster, encode_animation, encode_raster, write_layers};
use trimray::output::write_whole;
use trimray::report::{DifferencePage, Shown, TestCase, difference_page, junit};

use super::super::encoded;
use super::text::general;
use super::{CliError, Found};

/// How long each picture of the animation is shown.
const MILLISECONDS: u16 = 500;

/// Grey columns between pictures.
const GAP: u32 = 4;

/// What the page says of each layer.
const LAYER_HEADINGS: [&str; 9] =
    ["layer", "verdict", "mean error", "RMS error", "max error", "at", "values", "failing", "NaN or Inf"];

/// Writes that the pictures cannot be compared.
pub(super) fn write_mismatch(
    path: &Path,
    paths: [&Path; 2],
    mismatch: &Mismatch,
    seconds: f64,
) -> Result<(), CliError> {
    let case = TestCase {
        name: "kind".into(),
        class: class(paths),
        seconds,
        failure: Some("the pictures are of different kinds".into()),
        output: mismatch.reasons.join("\n"),
    };
    write_whole(path, &junit("trimray diff", &[case]).context("the JUnit XML")?)?;
    Ok(())
}

fn class(paths: [&Path; 2]) -> String {
    format!("{} against {}", paths[1].display(), paths[0].display())
}

impl Found<'_> {
    /// Writes everything that was asked for.
    pub(super) fn write_files(&self) -> Result<(), CliError> {
        let args = self.args;
        let colours = self.comparison.colours.as_ref();
        for (flag, path) in [("--sidebyside", &args.sidebyside), ("--flip", &args.flip)] {
            if path.is_some() && colours.is_none() {
                let message = format!("{flag}: the pictures have no colours R, G, B or Y to show");
                return Err(CliError::Input(message));
            }
        }
        let differ = self.comparison.figures.max_error > 0.0 || self.comparison.figures.non_finite > 0;
        if let Some(path) = args.output.as_ref().filter(|_| differ || !args.od) {
            let [reference, test] = &self.pictures;
            let made = difference_layers(reference, test, args.overlap, args.abs, args.scale);
            write_layers(path, &made.map_err(anyhow::Error::from)?)?;
        }
        if let Some(path) = &args.junit {
            write_whole(path, &junit("trimray diff", &self.cases()).context("the JUnit XML")?)?;
        }
        if [&args.heatmap, &args.sidebyside, &args.flip, &args.html].iter().all(|path| path.is_none()) {
            return Ok(());
        }
        let heat = self.comparison.heat_map().raster();
        if let Some(path) = &args.heatmap {
            write_whole(path, &encoded(encode_raster(&heat))?)?;
        }
        let previews = colours.map(|colours| colours.previews());
        if let Some([reference, test]) = &previews {
            if let Some(path) = &args.sidebyside {
                let beside = Raster::beside(&[reference, test, &heat], GAP);
                write_whole(path, &encoded(encode_raster(&beside))?)?;
            }
            if let Some(path) = &args.flip {
                write_whole(path, &encoded(encode_animation(&[reference, test], MILLISECONDS))?)?;
            }
        }
        if let Some(path) = &args.html {
            write_whole(path, self.page(previews.as_ref(), &heat)?.as_bytes())?;
        }
        Ok(())
    }

    fn page(&self, previews: Option<&[Raster; 2]>, heat: &Raster) -> Result<String, CliError> {
        let found = &self.comparison;
        let heat = encoded(encode_raster(heat))?;
        let map = self.comparison.heat_map();
        let heat_label = format!("{}: black is 0, pale yellow {}", map.name, general(map.scale.into()));
        let mut pngs = Vec::new();
        for preview in previews.into_iter().flatten() {
            pngs.push(encoded(encode_raster(preview))?);
        }
        let labels = self.paths.map(|path| path.display().to_string());
        let pictures = match pngs.as_slice() {
            [reference, test] => {
                Some([Shown { label: &labels[0], png: reference }, Shown { label: &labels[1], png: test }])
            }
            _ => None,
        };
        let worst: Vec<_> = found
            .worst
            .iter()
            .map(|worst| {
                let place = format!("{}, {}", worst.x, worst.y);
                vec![place, general(worst.error), self.command(worst).unwrap_or_default()]
            })
            .collect();
        let layers: Vec<_> = found.layers.iter().map(layer_row).collect();
        let shown = DifferencePage {
            status: word(found.status),
            pictures,
            heat_map: Shown { label: &heat_label, png: &heat },
            figures: &self.figure_rows(),
            layers: (&LAYER_HEADINGS, &layers),
            worst: &worst,
            notes: &self.notes,
        };
        Ok(difference_page(&class(self.paths), &shown))
    }

    /// Names and values of the whole.
    fn figure_rows(&self) -> Vec<Vec<String>> {
        let found = &self.comparison;
        let figures = &found.figures;
        let mut rows = vec![
            ("mean error".to_owned(), general(figures.mean_error())),
            ("RMS error".to_owned(), general(figures.rms_error())),
            ("peak SNR".to_owned(), general(figures.psnr())),
            ("max error".to_owned(), general(figures.max_error)),
            ("failing pixels".to_owned(), format!("{} of {}", found.failing, found.pixels)),
            ("pixels with warnings".to_owned(), format!("{} of {}", found.warning, found.pixels)),
            ("NaN or Inf in one alone".to_owned(), figures.non_finite.to_string()),
        ];
        rows.extend(found.metrics.iter().map(|metric| (metric.name.to_owned(), general(metric.mean))));
        rows.extend(found.ztest.iter().map(|test| ("z-test".to_owned(), test.to_string())));
        rows.into_iter().map(|(name, value)| vec![name, value]).collect()
    }

    /// Every layer as a test, and what else was judged.
    fn cases(&self) -> Vec<TestCase> {
        let found = &self.comparison;
        let class = class(self.paths);
        let case = |name: String, failure: Option<String>, output: String| TestCase {
            name,
            class: class.clone(),
            seconds: 0.0,
            failure,
            output,
        };
        let whole = (found.status == Status::Fail).then(|| {
            format!(
                "{} of {} pixels fail, max error {}",
                found.failing,
                found.pixels,
                general(found.figures.max_error)
            )
        });
        let mut cases = vec![case("picture".to_owned(), whole, self.text())];
        cases[0].seconds = self.seconds;
        cases.extend(found.layers.iter().map(|layer| {
            let cells = layer_row(layer);
            let told: Vec<_> =
                LAYER_HEADINGS.iter().zip(&cells).map(|(name, cell)| format!("{name}: {cell}")).collect();
            let failure = (layer.status == Status::Fail).then(|| {
                format!("{} pixels fail, max error {}", layer.failing, general(layer.figures.max_error))
            });
            case(format!("layer {}", cells[0]), failure, told.join("\n"))
        }));
        cases.extend(found.metrics.iter().map(|metric| {
            let told = format!("{} = {}", metric.name, general(metric.mean));
            case(format!("metric {}", metric.name), metric.fails.then(|| told.clone()), told)
        }));
        cases.extend(found.ztest.iter().map(|test| {
            let failure = (!test.passes).then(|| "noise does not explain the difference".to_owned());
            case("z-test".to_owned(), failure, test.to_string())
        }));
        cases
    }
}

const fn word(status: Status) -> &'static str {
    match status {
        Status::Pass => "pass",
        Status::Warn => "warn",
        Status::Fail => "fail",
    }
}

/// The cells of [`LAYER_HEADINGS`].
fn layer_row(layer: &LayerDifference) -> Vec<String> {
    let figures = &layer.figures;
    let name =
        if layer.part.is_empty() { layer.name.clone() } else { format!("{}: {}", layer.part, layer.name) };
    let (at, values) = figures.max_place.as_ref().map_or_else(Default::default, |place| {
        let at = format!("{}, {}, {}", place.x, place.y, place.channel);
        (at, format!("{} vs {}", general(place.reference), general(place.test)))
    });
    vec![
        name,
        word(layer.status).to_owned(),
        general(figures.mean_error()),
        general(figures.rms_error()),
        general(figures.max_error),
        at,
        values,
        layer.failing.to_string(),
        figures.non_finite.to_string(),
    ]
}
