//! `trimray diff`.

mod json;
mod outputs;
mod text;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Context;
use clap::{ArgAction, Args, ValueEnum};

use trimray::difference::{
    CompareError, CompareSettings, Comparison, Judge, LayerDifference, LayerRule, Metric, Mismatch, Status,
    Thresholds, compare, why, with_black_outside,
};
use trimray::film::{LayeredPicture, read_layers_within};
use trimray::output::check_writable;

use super::own_inputs::check_not_inputs;
use super::{CliError, LimitArgs, check_ending, check_interrupted, print_result};

/// The exit codes of idiff, as its manual has them.
const WARNED: u8 = 1;
const FAILED: u8 = 2;
const OTHER_KIND: u8 = 3;
const FILE_FAILED: u8 = 4;

/// Flags that idiff has with one hyphen. `-q`, `-v` and `-o` are the same in both.
const IDIFF: [&str; 13] = [
    "fail",
    "failrelative",
    "failpercent",
    "hardfail",
    "warn",
    "warnrelative",
    "warnpercent",
    "hardwarn",
    "allowfailures",
    "abs",
    "scale",
    "od",
    "a",
];

#[derive(Debug, Args)]
#[command(after_help = "\
Exit codes: 0 pass, 1 warning, 2 failure (or a wrong command line), 3 size or channels differ, 4 a file cannot be read or written.
idiff's flags work with one hyphen too. NaN and Inf that one picture has alone always fail; ids are exact unless --layer says otherwise.

Example: trimray diff before.exr after.exr
         trimray diff before.exr after.exr --fail 0.004 --failpercent 1 --hardfail 0.1
         trimray diff before.exr after.exr --layer depth fail=1e-4 --layer normal degrees=0.5
         trimray diff before.exr after.exr --ztest --layer st ignore --html difference.html
         trimray diff before.png after.png --metric flip --metricfail 0.05 --heatmap flip.png")]
pub(super) struct DiffArgs {
    /// The picture to compare with: .exr, .hdr, .png, .jpg, .tif, .bmp, .webp or .tga
    reference: PathBuf,
    /// The picture to test, or the folder with one of the same name
    test: PathBuf,
    /// Greatest absolute error that does not fail
    #[arg(long, value_name = "A", default_value_t = 1e-6, value_parser = threshold)]
    fail: f32,
    /// Greatest relative error, |a - b| / mean(|a|, |b|), that does not fail; a value fails if both are exceeded
    #[arg(long, value_name = "R", default_value_t = 0.0, value_parser = threshold)]
    failrelative: f32,
    /// Percentage of the pixels that may fail
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = threshold)]
    failpercent: f32,
    /// Fail if any pixel has a greater absolute error
    #[arg(long, value_name = "H", value_parser = threshold)]
    hardfail: Option<f32>,
    /// Greatest absolute error that does not warn
    #[arg(long, value_name = "A", default_value_t = 1e-6, value_parser = threshold)]
    warn: f32,
    /// Greatest relative error that does not warn
    #[arg(long, value_name = "R", default_value_t = 0.0, value_parser = threshold)]
    warnrelative: f32,
    /// Percentage of the pixels that may warn
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = threshold)]
    warnpercent: f32,
    /// Warn if any pixel has a greater absolute error
    #[arg(long, value_name = "H", value_parser = threshold)]
    hardwarn: Option<f32>,
    /// So many pixels may differ by any amount (but not by NaN or Inf)
    #[arg(long, value_name = "N", default_value_t = 0)]
    allowfailures: u64,
    /// Thresholds of a layer (depth), a channel (depth.T) or the colours (RGBA): any of the above, and degrees (of normals),
    /// ulp, ignore
    #[arg(long, num_args = 2, value_names = ["NAME", "KEY=VALUE,…"], action = ArgAction::Append)]
    layer: Vec<String>,
    /// Compare only the pixels that both pictures have, if their windows differ
    #[arg(long)]
    overlap: bool,
    /// Take the pixels outside of one picture's data window that the other has as this
    #[arg(long, value_name = "WHAT", conflicts_with = "overlap")]
    outside: Option<OutsidePixels>,
    /// Judge colours by whether noise explains their difference; needs the AOV variance in both
    #[arg(long)]
    ztest: bool,
    /// Measure the colours: mae, mse, rmse, relmse, psnr, ssim, flip, hdrflip or ulp; may be repeated
    #[arg(long, value_name = "NAME")]
    metric: Vec<Metric>,
    /// Fail if a metric is above this (psnr and ssim: below)
    #[arg(long, value_name = "V", requires = "metric", allow_negative_numbers = true)]
    metricfail: Option<f64>,
    /// Write test - reference, all channels, to this .exr
    #[arg(short, long, value_name = "DIFF.exr")]
    output: Option<PathBuf>,
    /// With -o: only if there is a difference
    #[arg(long, requires = "output")]
    od: bool,
    /// With -o: absolute differences
    #[arg(long, requires = "output")]
    abs: bool,
    /// With -o: times this factor
    #[arg(long, value_name = "F", default_value_t = 1.0, allow_negative_numbers = true, requires = "output")]
    scale: f64,
    /// Write where they differ, in the colours of magma: the first metric with a map (flip, hdrflip, ssim), or the greatest
    /// absolute difference of the colours
    #[arg(long, value_name = "OUT.png")]
    heatmap: Option<PathBuf>,
    /// Write reference, test and heat map beside each other
    #[arg(long, value_name = "OUT.png")]
    sidebyside: Option<PathBuf>,
    /// Write an animated PNG that shows both in turn
    #[arg(long, value_name = "OUT.png")]
    flip: Option<PathBuf>,
    /// Write a page to look at: pictures to wipe and flip, heat map, figures
    #[arg(long, value_name = "OUT.html")]
    html: Option<PathBuf>,
    /// Write the result for build servers
    #[arg(long, value_name = "OUT.xml")]
    junit: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// The scene file, for the commands that render the worst pixels
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    limits: LimitArgs,
    /// Say only that they differ
    #[arg(short, long)]
    quiet: bool,
    /// Tell of all layers, also of equal ones
    #[arg(short, long)]
    verbose: bool,
    /// As idiff's -a: all parts are compared always
    #[arg(short = 'a', long = "a", hide = true)]
    all_parts: bool,
}

/// What the pixels outside of a data window are taken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum OutsidePixels {
    /// 0 in all channels, as OpenImageIO takes them
    Black,
}

/// A threshold: not negative, not NaN.
pub(super) fn threshold(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(value) if value >= 0.0 => Ok(value),
        _ => Err("must be a number that is not negative".to_owned()),
    }
}

/// The arguments with idiff's spellings (`-fail`) as this program's (`--fail`), if they are for `diff`.
pub(super) fn with_idiff_spellings(arguments: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut arguments: Vec<_> = arguments.collect();
    if arguments.get(1).is_some_and(|command| command == "diff") {
        for argument in arguments.iter_mut().skip(2).take_while(|argument| *argument != "--") {
            let known = argument.to_str().and_then(|text| text.strip_prefix('-')).is_some_and(|text| {
                let name = text.split('=').next().unwrap_or_default();
                IDIFF.contains(&name)
            });
            if known {
                let mut spelled = OsString::from("-");
                spelled.push(&*argument);
                *argument = spelled;
            }
        }
    }
    arguments
}

/// A comparison with what is needed to tell of it.
struct Found<'a> {
    args: &'a DiffArgs,
    /// The reference's and the test's.
    paths: [&'a Path; 2],
    pictures: [LayeredPicture; 2],
    comparison: Comparison,
    /// Why the pictures may differ, and what was odd.
    notes: Vec<String>,
    seconds: f64,
}

pub(super) fn run(args: &DiffArgs) -> Result<ExitCode, CliError> {
    match compare_files(args) {
        // 1 would be a warning
        Err(error) if error.exit_code() == 1 => {
            say!("trimray: {error}");
            Ok(ExitCode::from(FILE_FAILED))
        }
        other => other,
    }
}

fn compare_files(args: &DiffArgs) -> Result<ExitCode, CliError> {
    let started = Instant::now();
    let settings = args.settings()?;
    let test = args.test_file();
    args.check_outputs(&test)?;
    let paths = [args.reference.as_path(), test.as_path()];
    if !args.quiet && !args.json {
        print_result(&format!("Comparing \"{}\" and \"{}\"\n", paths[0].display(), paths[1].display()))?;
    }
    let [reference, test] = match paths.map(|path| read_layers_within(path, args.limits.pictures())) {
        [Ok(reference), Ok(test)] => [reference, test],
        failed => {
            for error in failed.into_iter().filter_map(Result::err) {
                say!("trimray: {error}");
            }
            return Ok(ExitCode::from(FILE_FAILED));
        }
    };
    check_interrupted()?;
    let [reference, test] = match args.outside {
        None => [reference, test],
        Some(OutsidePixels::Black) => match with_black_outside(&[reference, test], args.limits.max_pixels) {
            Ok(wide) => wide,
            Err(mismatch) => return args.different(paths, &mismatch, started),
        },
    };
    let comparison = match compare(&reference, &test, &settings) {
        Ok(comparison) => comparison,
        Err(CompareError::Input(message)) => return Err(CliError::Input(message)),
        Err(CompareError::Different(mismatch)) => return args.different(paths, &mismatch, started),
    };
    check_interrupted()?;
    let pictures = [reference, test];
    let notes = notes(args, &pictures, &comparison);
    let seconds = started.elapsed().as_secs_f64();
    let found = Found { args, paths, pictures, comparison, notes, seconds };
    found.write_files()?;
    let status = found.comparison.status;
    if args.json {
        print_result(&found.json().context("the JSON")?)?;
    } else if !args.quiet {
        print_result(&found.text())?;
    }
    if args.quiet && status == Status::Fail {
        say!("FAILURE");
    }
    Ok(match status {
        Status::Pass => ExitCode::SUCCESS,
        Status::Warn => ExitCode::from(WARNED),
        Status::Fail => ExitCode::from(FAILED),
    })
}

/// As [`run`], of pictures that are read already: the comparison, and what `--json` prints of it.
pub(super) fn run_read(
    args: &DiffArgs,
    pictures: [LayeredPicture; 2],
) -> Result<(Comparison, String), CliError> {
    let started = Instant::now();
    let settings = args.settings()?;
    args.check_outputs(&args.test)?;
    let different = |mismatch: Mismatch| CliError::Input(mismatch.to_string());
    let pictures = match args.outside {
        None => pictures,
        Some(OutsidePixels::Black) => {
            with_black_outside(&pictures, args.limits.max_pixels).map_err(different)?
        }
    };
    let comparison = compare(&pictures[0], &pictures[1], &settings).map_err(|error| match error {
        CompareError::Input(message) => CliError::Input(message),
        CompareError::Different(mismatch) => different(mismatch),
    })?;
    let notes = notes(args, &pictures, &comparison);
    let seconds = started.elapsed().as_secs_f64();
    let paths = [args.reference.as_path(), args.test.as_path()];
    let found = Found { args, paths, pictures, comparison, notes, seconds };
    found.write_files()?;
    let json = found.json().context("the JSON")?;
    Ok((found.comparison, json))
}

/// Why the pictures may differ, and what was odd.
fn notes(args: &DiffArgs, [reference, test]: &[LayeredPicture; 2], comparison: &Comparison) -> Vec<String> {
    let differ = comparison.figures.max_error > 0.0 || comparison.figures.non_finite > 0;
    let mut notes = comparison.notes.clone();
    notes.extend(why(&reference.recorded, &test.recorded, differ, args.ztest));
    notes.extend(first_samples(args, comparison));
    notes
}

/// What to do about layers that fail beside a z-test: with other seeds they are of other places.
fn first_samples(args: &DiffArgs, comparison: &Comparison) -> Option<String> {
    let fails = |layer: &&LayerDifference| layer.judge == Judge::Thresholds && layer.status == Status::Fail;
    let names: Vec<_> = comparison.layers.iter().filter(fails).map(|layer| layer.name.as_str()).collect();
    (args.ztest && !names.is_empty()).then(|| {
        format!(
            "{}: these layers hold the first sample of each pixel, which another seed puts elsewhere; --layer NAME ignore leaves \
             one out",
            names.join(", ")
        )
    })
}

impl DiffArgs {
    fn settings(&self) -> Result<CompareSettings, CliError> {
        let rules = self.layer.chunks(2).map(|rule| match rule {
            [name, settings] => LayerRule::parse(name, settings).map_err(|error| error.to_string()),
            _ => Err("--layer needs a name and settings".to_owned()),
        });
        let thresholds = Thresholds {
            fail: self.fail,
            failrelative: self.failrelative,
            failpercent: self.failpercent,
            hardfail: self.hardfail.unwrap_or(f32::INFINITY),
            warn: self.warn,
            warnrelative: self.warnrelative,
            warnpercent: self.warnpercent,
            hardwarn: self.hardwarn.unwrap_or(f32::INFINITY),
            allowfailures: self.allowfailures,
            ..Thresholds::default()
        };
        let metric_fail = self.metricfail;
        if metric_fail.is_some_and(f64::is_nan) || !self.scale.is_finite() {
            return Err(CliError::Input("--metricfail and --scale need numbers".to_owned()));
        }
        Ok(CompareSettings {
            thresholds,
            rules: rules.collect::<Result<_, _>>().map_err(CliError::Input)?,
            overlap: self.overlap,
            ztest: self.ztest,
            metrics: self.metric.clone(),
            metric_fail,
            keep_colours: [&self.sidebyside, &self.flip, &self.html].iter().any(|path| path.is_some()),
        })
    }

    /// The test, or in a folder the file that is called as the reference is.
    fn test_file(&self) -> PathBuf {
        match self.reference.file_name() {
            Some(name) if self.test.is_dir() => self.test.join(name),
            _ => self.test.clone(),
        }
    }

    /// Every file that is to be written can be, has the right ending, and is none of the others.
    fn check_outputs(&self, test: &Path) -> Result<(), CliError> {
        let outputs = [
            ("--output", &self.output, "exr"),
            ("--heatmap", &self.heatmap, "png"),
            ("--sidebyside", &self.sidebyside, "png"),
            ("--flip", &self.flip, "png"),
            ("--html", &self.html, "html"),
            ("--junit", &self.junit, "xml"),
        ];
        let mut taken = vec![self.reference.as_path(), test];
        for (flag, path, ending) in outputs {
            let Some(path) = path else { continue };
            check_ending(flag, path, ending)?;
            if taken.contains(&path.as_path()) {
                let shown = path.display();
                return Err(CliError::Input(format!("{flag} {shown}: is another file of this command")));
            }
            check_not_inputs(&[path], &taken)?;
            check_writable(path)?;
            taken.push(path);
        }
        Ok(())
    }

    /// Tells of pictures that cannot be compared.
    fn different(
        &self,
        paths: [&Path; 2],
        mismatch: &Mismatch,
        started: Instant,
    ) -> Result<ExitCode, CliError> {
        if let Some(path) = &self.junit {
            outputs::write_mismatch(path, paths, mismatch, started.elapsed().as_secs_f64())?;
        }
        if self.json {
            print_result(&json::different(mismatch).context("the JSON")?)?;
        } else if !self.quiet {
            let lines = mismatch.reasons.iter().map(|reason| format!("  {reason}\n"));
            print_result(&(lines.collect::<String>() + "FAILURE: the pictures are of different kinds\n"))?;
        }
        if self.quiet {
            say!("FAILURE");
        }
        Ok(ExitCode::from(OTHER_KIND))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_hyphen_becomes_two() {
        let spelled = |line: &str| {
            let spelled = with_idiff_spellings(line.split(' ').map(OsString::from));
            spelled.iter().map(|word| word.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(
            spelled("trimray diff -fail 1e-3 -failpercent=5 -od -o -abs a.exr -q -a b.exr"),
            "trimray diff --fail 1e-3 --failpercent=5 --od -o --abs a.exr -q --a b.exr"
        );
        assert_eq!(spelled("trimray diff -- -fail"), "trimray diff -- -fail");
        assert_eq!(spelled("trimray render -abs"), "trimray render -abs");
    }
}
