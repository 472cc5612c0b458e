//! `trimray test`.

mod outputs;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use trimray::output::check_writable;
use trimray::reference_test::{
    BlessError, BlessSettings, FolderError, JudgeSettings, MakeError, SEED, SceneTest, TestFolder,
    TestSettings, bless, find_tests, run_test,
};
use trimray::render::{RenderControl, RenderError};
use trimray::suggestion::did_you_mean;

use self::outputs::Tested;
use super::diff::threshold;
use super::own_inputs::check_not_inputs;
use super::progress::spinner;
use super::{CliError, INTERRUPTED, LimitArgs, check_ending, install, print_result, thread_count};

#[derive(Debug, Args)]
#[command(after_help = "\
The scenes are DIR/*.toml or, if there are none, DIR/scenes/*.toml. A scene's reference is NAME.exr beside it, or else in the
folder above. A reference with the layer variance is judged by the z-test (see diff --ztest), the scene being rendered with
another seed; any other reference value by value, in all layers that it has.
Exit codes: 0 all pass, 1 a scene fails (or the work failed), 2 wrong command line or no scenes.

Example: trimray test refs
         trimray test refs diffuse_constant crop -o page.html --junit results.xml
         trimray test pictures --bless cube --spp 1024")]
pub(super) struct TestArgs {
    /// The folder of the scenes
    folder: PathBuf,
    /// Only these scenes
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Only scenes with this text in their names
    #[arg(long, value_name = "TEXT")]
    filter: Option<String>,
    /// The folder of the references
    #[arg(long, value_name = "FOLDER")]
    references: Option<PathBuf>,
    /// Render this scene's reference anew, with its variance; may be repeated. Nothing is tested then
    #[arg(long, value_name = "NAME", conflicts_with_all = ["names", "filter", "output", "junit", "json"])]
    bless: Vec<String>,
    /// With --bless: samples for each pixel [default: the scene's]
    #[arg(long, value_name = "N", requires = "bless", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// With --bless: also in place of another program's reference
    #[arg(long, requires = "bless")]
    force: bool,
    /// Seed of what is judged by the z-test; one more for references of this seed
    #[arg(long, value_name = "N", default_value_t = SEED)]
    seed: u64,
    /// Greatest absolute error that does not fail, of references without variance
    #[arg(long, value_name = "A", default_value_t = JudgeSettings::default().fail, value_parser = threshold)]
    fail: f32,
    /// Fail references without variance
    #[arg(long)]
    ztest: bool,
    /// The page
    #[arg(short, long, value_name = "REPORT.html", default_value = "trimray_test.html")]
    output: PathBuf,
    /// Write the results for build servers
    #[arg(long, value_name = "OUT.xml")]
    junit: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Threads to work with [default: one for each processor]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    #[command(flatten)]
    limits: LimitArgs,
    /// Tell only of failures
    #[arg(short, long)]
    quiet: bool,
}

pub(super) fn run(args: &TestArgs) -> Result<ExitCode, CliError> {
    let threads = thread_count(args.threads)?;
    let found = find_tests(&args.folder, args.references.as_deref())?;
    let memory = args.limits.memory();
    let control = RenderControl { threads, memory, ..RenderControl::new(&INTERRUPTED) };
    if args.bless.is_empty() {
        args.check_outputs(&found)?;
        let chosen = args.chosen(&found)?;
        install(threads, || args.test(&found, &chosen, &control))?
    } else {
        let chosen = named(&found, &args.bless, "--bless ")?;
        install(threads, || args.bless(&chosen, &control))?
    }
}

/// The tests of the names, in their order.
fn named<'a>(found: &'a TestFolder, names: &[String], flag: &str) -> Result<Vec<&'a SceneTest>, CliError> {
    let known: Vec<_> = found.tests.iter().map(|test| test.name.as_str()).collect();
    let find = |name: &String| {
        let test = found.tests.iter().find(|test| test.name == *name);
        test.ok_or_else(|| format!("{flag}{name}: there is no such scene{}", did_you_mean(name, &known)))
    };
    let (mut tests, mut wrong) = (Vec::new(), Vec::new());
    for name in names {
        match find(name) {
            Ok(test) => tests.push(test),
            Err(message) => wrong.push(message),
        }
    }
    if wrong.is_empty() { Ok(tests) } else { Err(CliError::Input(wrong.join("\n"))) }
}

impl TestArgs {
    fn chosen<'a>(&self, found: &'a TestFolder) -> Result<Vec<&'a SceneTest>, CliError> {
        let mut chosen =
            if self.names.is_empty() { found.tests.iter().collect() } else { named(found, &self.names, "")? };
        if let Some(text) = &self.filter {
            chosen.retain(|test| test.name.contains(text));
            if chosen.is_empty() {
                return Err(CliError::Input(format!("--filter {text}: no scene has this in its name")));
            }
        }
        Ok(chosen)
    }

    fn check_outputs(&self, found: &TestFolder) -> Result<(), CliError> {
        let files = found.tests.iter().flat_map(|test| [test.scene.as_path(), test.reference.as_path()]);
        let inputs: Vec<_> = files.collect();
        let outputs = [("--output", Some(&self.output), "html"), ("--junit", self.junit.as_ref(), "xml")];
        for (flag, path, ending) in outputs {
            let Some(path) = path else { continue };
            check_ending(flag, path, ending)?;
            check_not_inputs(&[path], &inputs)?;
            check_writable(path)?;
        }
        Ok(())
    }

    fn test(
        &self,
        found: &TestFolder,
        chosen: &[&SceneTest],
        control: &RenderControl<'_>,
    ) -> Result<ExitCode, CliError> {
        let judge = JudgeSettings { fail: self.fail, ztest: self.ztest };
        let settings = TestSettings { seed: self.seed, judge, pictures: self.limits.pictures() };
        let warnings: Vec<_> = found.unused.iter().map(|path| unused(path)).collect();
        for warning in warnings.iter().filter(|_| !self.quiet) {
            say!("trimray: {warning}");
        }
        let bar = spinner(self.quiet);
        let mut tested = Vec::new();
        for (index, test) in chosen.iter().enumerate() {
            bar.set_message(format!("{} ({} of {})", test.name, index + 1, chosen.len()));
            let result = run_test(test, &settings, control).map_err(|error| match error {
                RenderError::Interrupted => CliError::Interrupted,
                other => CliError::Failed(other.into()),
            })?;
            let told = Tested::try_new(test, &result)?;
            if !self.json && (!self.quiet || !told.passes()) {
                bar.suspend(|| print_result(&told.line()))?;
            }
            tested.push(told);
        }
        bar.finish_and_clear();
        self.write(&tested, &warnings)?;
        let all = tested.iter().all(Tested::passes);
        Ok(if all { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    fn bless(&self, chosen: &[&SceneTest], control: &RenderControl<'_>) -> Result<ExitCode, CliError> {
        let settings = BlessSettings { spp: self.spp, force: self.force, pictures: self.limits.pictures() };
        let bar = spinner(self.quiet);
        for test in chosen {
            bar.set_message(test.name.clone());
            let spp = bless(test, &settings, control)?;
            if !self.quiet {
                let line = format!("wrote {}: {spp} samples per pixel\n", test.reference.display());
                bar.suspend(|| print_result(&line))?;
            }
        }
        bar.finish_and_clear();
        Ok(ExitCode::SUCCESS)
    }
}

fn unused(path: &Path) -> String {
    format!("{}: no scene has this reference", path.display())
}

impl From<FolderError> for CliError {
    fn from(error: FolderError) -> Self {
        Self::Input(error.to_string())
    }
}

impl From<BlessError> for CliError {
    fn from(error: BlessError) -> Self {
        match error {
            error if error.is_interrupted() => Self::Interrupted,
            BlessError::Picture(MakeError::Scene(error)) => Self::Scene(error),
            BlessError::Picture(MakeError::Render(error)) => Self::Failed(error.into()),
            BlessError::Output(error) => Self::Output(error),
            error @ BlessError::NonFinite { .. } => Self::Failed(error.into()),
            other => Self::Input(other.to_string()),
        }
    }
}
