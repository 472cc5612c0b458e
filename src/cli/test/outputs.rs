//! What `trimray test` prints and writes.

use anyhow::Context;
use serde_json::{Value, json};

use trimray::difference::{Comparison, Judge};
use trimray::film::{Raster, encode_raster};
use trimray::output::write_whole;
use trimray::reference_test::{SceneTest, TestResult};
use trimray::report::{SceneTestShown, TestCase, junit, scene_tests_page};

use super::super::encoded;
use super::{CliError, TestArgs, print_result};

/// The longest side of a picture on the page.
const SIDE: u32 = 512;

/// What is told of one scene, without its pictures' numbers.
pub(super) struct Tested {
    shown: SceneTestShown,
    /// The figures in one line.
    figures: String,
    json: Value,
    /// The scene file.
    scene: String,
    seconds: f64,
}

impl Tested {
    pub(super) fn try_new(test: &SceneTest, result: &TestResult) -> Result<Self, CliError> {
        let judged = result.judgement.as_ref();
        let comparison = judged.and_then(|judged| judged.comparison.as_ref());
        let figures = judged.map(|judged| judged.figures()).unwrap_or_default();
        let by = judged.map(|judged| match judged.by {
            Judge::ZTest => "z-test",
            Judge::Thresholds | Judge::Nothing => "thresholds",
        });
        let (pictures, heat_map) = comparison.map(pictures).transpose()?.unwrap_or_default();
        let mut rows = vec![
            ["scene".to_owned(), test.scene.display().to_string()],
            ["reference".to_owned(), test.reference.display().to_string()],
        ];
        rows.extend(by.map(|by| ["judged by".to_owned(), by.to_owned()]));
        rows.extend(comparison.into_iter().flat_map(figure_rows));
        rows.push(["seconds".to_owned(), format!("{:.2}", result.seconds)]);
        let json = json!({
            "name": test.name,
            "status": if result.passes() { "pass" } else { "fail" },
            "scene": test.scene.to_string_lossy(),
            "reference": test.reference.to_string_lossy(),
            "judged_by": by,
            "failures": result.failures,
            "notes": result.notes,
            "mean_error": comparison.map(|found| found.figures.mean_error()),
            "rms_error": comparison.map(|found| found.figures.rms_error()),
            "max_error": comparison.map(|found| found.figures.max_error),
            "metrics": comparison.map(|found| &found.metrics),
            "ztest": comparison.and_then(|found| found.ztest.as_ref()),
            "seconds": result.seconds,
        });
        let shown = SceneTestShown {
            name: test.name.clone(),
            failures: result.failures.clone(),
            notes: result.notes.clone(),
            figures: rows,
            pictures,
            heat_map,
        };
        let scene = test.scene.display().to_string();
        Ok(Self { shown, figures, json, scene, seconds: result.seconds })
    }

    pub(super) const fn passes(&self) -> bool {
        self.shown.failures.is_empty()
    }

    /// `pass NAME: figures` or `FAIL NAME: why`, and what else there is to tell.
    pub(super) fn line(&self) -> String {
        let name = &self.shown.name;
        let mut line = if self.passes() {
            format!("pass {name}: {}\n", self.figures)
        } else {
            format!("FAIL {name}: {}\n", self.shown.failures.join("; "))
        };
        for note in &self.shown.notes {
            line += &format!("     note: {note}\n");
        }
        line
    }

    fn case(&self) -> TestCase {
        TestCase {
            name: self.shown.name.clone(),
            class: self.scene.clone(),
            seconds: self.seconds,
            failure: (!self.passes()).then(|| self.shown.failures.join("; ")),
            output: self.line(),
        }
    }
}

/// Names and values of what comparing found.
fn figure_rows(found: &Comparison) -> Vec<[String; 2]> {
    let figures = &found.figures;
    let mut rows = vec![
        ["mean error", &format!("{:.3e}", figures.mean_error())].map(ToString::to_string),
        ["RMS error", &format!("{:.3e}", figures.rms_error())].map(ToString::to_string),
        ["max error", &format!("{:.3e}", figures.max_error)].map(ToString::to_string),
    ];
    rows.extend(found.metrics.iter().map(|metric| [metric.name.to_owned(), format!("{:.5}", metric.mean)]));
    match &found.ztest {
        Some(test) => rows.push(["z-test".to_owned(), test.to_string()]),
        None => {
            let failing = format!("{} of {}", found.failing, found.pixels);
            rows.push(["failing pixels".to_owned(), failing]);
        }
    }
    rows
}

type Pngs = (Option<[Vec<u8>; 2]>, Option<(String, Vec<u8>)>);

/// The reference, the picture, and where they differ.
fn pictures(found: &Comparison) -> Result<Pngs, CliError> {
    let encoded = |raster: &Raster| encoded(encode_raster(&raster.shrunk(SIDE)));
    let both = match found.colours.as_ref().map(|colours| colours.previews()) {
        Some([reference, test]) => Some([encoded(&reference)?, encoded(&test)?]),
        None => None,
    };
    let map = found.heat_map();
    let label = format!("{}: black is 0, pale yellow {}", map.name, map.scale);
    Ok((both, Some((label, encoded(&map.raster())?))))
}

impl TestArgs {
    /// Writes the page and the results, and prints the summary.
    pub(super) fn write(&self, tested: &[Tested], warnings: &[String]) -> Result<(), CliError> {
        let passed = tested.iter().filter(|tested| tested.passes()).count();
        let failed = tested.len() - passed;
        let title = format!("Scenes of {}", self.folder.display());
        let shown: Vec<_> = tested.iter().map(|tested| tested.shown.clone()).collect();
        write_whole(&self.output, scene_tests_page(&title, &shown, warnings).as_bytes())?;
        if let Some(path) = &self.junit {
            let cases: Vec<_> = tested.iter().map(Tested::case).collect();
            write_whole(path, &junit("trimray test", &cases).context("the JUnit XML")?)?;
        }
        if self.json {
            let all = json!({
                "status": if failed == 0 { "pass" } else { "fail" },
                "passed": passed,
                "failed": failed,
                "seconds": tested.iter().map(|tested| tested.seconds).sum::<f64>(),
                "warnings": warnings,
                "scenes": tested.iter().map(|tested| &tested.json).collect::<Vec<_>>(),
            });
            let bytes = trimray::export::to_json(&all).context("the JSON")?;
            print_result(&String::from_utf8(bytes).context("the JSON")?)?;
        } else if !self.quiet {
            print_result(&format!("{passed} pass, {failed} fail; see {}\n", self.output.display()))?;
        }
        Ok(())
    }
}
