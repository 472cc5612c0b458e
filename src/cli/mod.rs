//! The command line: the only place that prints, reads flags and chooses exit codes.
//!
//! Not part of the library's interface: it is here for the program and for what brings the program with it, as the Python
//! package does.

/// Prints a line to stderr; that nobody reads it is no error.
macro_rules! say {
    ($($part:tt)*) => { $crate::cli::write_line(format_args!($($part)*)) };
}

mod compare;
mod diff;
mod drags;
pub mod embedded;
mod export;
mod info;
mod own_inputs;
mod progress;
mod render;
mod show;
mod signals;
mod statistics;
mod test;
mod trace;

use std::ffi::OsString;
use std::fmt;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;

use clap::{Args, Parser, Subcommand};
use thiserror::Error;

use trimray::film::{FilmSettings, PictureLimits};
use trimray::memory::{MemoryLimit, OutOfMemory};
use trimray::output::OutputError;
use trimray::scene::{BuiltScene, SceneDescription, SceneError, parse_scene};
use trimray::shade::{Camera, CameraSettings};

use self::signals::INTERRUPTED;

/// Ray tracing of exactly deformed shapes.
#[derive(Debug, Parser)]
#[command(name = "trimray", version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene to EXR, or to a PNG preview
    Render(render::RenderArgs),
    /// Show what the deformation made, without rendering
    Info(info::InfoArgs),
    /// Trace a batch of rays in double precision
    Trace(trace::TraceArgs),
    /// Show what drags of points did to the lattices
    Drags(drags::DragsArgs),
    /// Write the exact patches, or triangles close to them, for other programs
    Export(export::ExportArgs),
    /// Compare two pictures, as idiff does, layer by layer
    Diff(Box<diff::DiffArgs>),
    /// Compare exact with pointwise and adaptive deformation: figures, plots and pictures on one page
    Compare(compare::CompareArgs),
    /// Render the scenes of a folder and judge them by their reference pictures
    Test(test::TestArgs),
}

/// What every command takes.
#[derive(Debug, Args)]
struct SceneArgs {
    /// The scene file (TOML)
    scene: PathBuf,
    /// Threads to work with [default: one for each processor]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// How deformed shapes are represented, for all objects: exact, pointwise:L, adaptive:TOL, or triangular
    #[arg(long, value_name = "M")]
    method: Option<trimray::model::Representation>,
    /// Where drags contradict each other, take the best compromise instead of stopping
    #[arg(long)]
    least_squares: bool,
    #[command(flatten)]
    limits: LimitArgs,
}

/// Bounds on what files may ask for, which every command takes.
#[derive(Clone, Copy, Debug, Args)]
struct LimitArgs {
    /// Most pixels that a picture which is read may have
    #[arg(long, value_name = "N", default_value_t = PictureLimits::default().max_pixels,
          value_parser = clap::value_parser!(u64).range(1..))]
    max_pixels: u64,
    /// Most memory to take, such as 512M or 4G; what would need more ends with exit code 1 before it takes it [default: 80 % of
    /// the machine's or its control group's]
    #[arg(long, value_name = "SIZE")]
    max_memory: Option<MemoryLimit>,
}

impl LimitArgs {
    /// The most memory that the process may have.
    fn memory(self) -> MemoryLimit {
        self.max_memory.unwrap_or_else(MemoryLimit::of_machine)
    }

    /// Bounds on pictures that are read.
    fn pictures(self) -> PictureLimits {
        PictureLimits { max_pixels: self.max_pixels, memory: self.memory() }
    }
}

/// Why a command did not do its work.
#[derive(Debug, Error)]
pub enum CliError {
    /// The scene or a file it names is wrong.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The input or the command line is wrong otherwise.
    #[error("{0}")]
    Input(String),
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// There is too little memory.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
    /// Ctrl-C, or the signal to end.
    #[error("interrupted")]
    Interrupted,
    /// Anything else that failed while working.
    #[error("{0:#}")]
    Failed(#[from] anyhow::Error),
}

impl CliError {
    /// 1: the work failed; 2: bad command line or bad input.
    fn exit_code(&self) -> u8 {
        match self {
            Self::Scene(error) if error.lacks_memory() => 1,
            Self::Scene(_) | Self::Input(_) => 2,
            Self::Output(
                OutputError::NoFolder { .. }
                | OutputError::IsFolder { .. }
                | OutputError::IsFile { .. }
                | OutputError::Taken { .. },
            ) => 2,
            Self::Output(_) | Self::Memory(_) | Self::Interrupted | Self::Failed(_) => 1,
        }
    }
}

/// Runs the program on arguments, the program's name first.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let cli = match Cli::try_parse_from(diff::with_idiff_spellings(arguments.into_iter())) {
        Ok(cli) => cli,
        Err(error) => {
            // help and version are asked for and go to stdout
            let code = if error.use_stderr() { 2 } else { 0 };
            // nobody is left to tell if the terminal is gone
            let _ = error.print();
            return ExitCode::from(code);
        }
    };
    let result = signals::watch().map_err(CliError::from).and_then(|()| match &cli.command {
        Command::Render(args) => render::run(args).map(success),
        Command::Info(args) => info::run(args).map(success),
        Command::Trace(args) => trace::run(args).map(success),
        Command::Drags(args) => drags::run(args).map(success),
        Command::Export(args) => export::run(args).map(success),
        Command::Diff(args) => diff::run(args),
        Command::Compare(args) => compare::run(args).map(success),
        Command::Test(args) => test::run(args),
    });
    match result {
        Ok(code) => code,
        Err(error) => {
            for line in error.to_string().lines() {
                say!("trimray: {line}");
            }
            ExitCode::from(error.exit_code())
        }
    }
}

/// Only `diff` and `test` have other results than this.
const fn success((): ()) -> ExitCode {
    ExitCode::SUCCESS
}

impl SceneArgs {
    fn parse(&self) -> Result<SceneDescription, CliError> {
        let mut scene = parse_scene(&self.scene)?;
        scene.least_squares = self.least_squares;
        scene.pictures = self.limits.pictures();
        scene.memory = self.limits.memory();
        if let Some(method) = self.method {
            for object in &mut scene.objects {
                object.method = method;
            }
        }
        Ok(scene)
    }

    /// Builds a scene on the threads asked for, and says on stderr what was odd about its meshes.
    fn build(&self, scene: &SceneDescription, quiet: bool) -> Result<BuiltScene, CliError> {
        let built = self.install(|| signals::while_building(|| scene.build()))??;
        check_interrupted()?;
        if !quiet {
            for (object, made) in scene.objects.iter().zip(&built.objects) {
                if let Some(mesh) = object.shape.mesh() {
                    for line in made.notes.to_string().lines().skip(1) {
                        say!("trimray: {}: {line}", mesh.display());
                    }
                }
                for line in made.warnings.iter().cloned().chain(drags::compromises(made)) {
                    say!("trimray: {}: {line}", object.name.value);
                }
            }
        }
        Ok(built)
    }

    /// Runs work on the threads asked for.
    fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> Result<T, CliError> {
        install(self.thread_count()?, work)
    }

    /// Threads to use; 0 is one for each processor.
    fn thread_count(&self) -> Result<usize, CliError> {
        thread_count(self.threads)
    }
}

/// Runs work on some threads; 0 is one for each processor.
fn install<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T, CliError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(anyhow::Error::from)?;
    Ok(pool.install(work))
}

/// Threads to use; 0 is one for each processor.
fn thread_count(asked: Option<usize>) -> Result<usize, CliError> {
    const MOST: usize = 1024;
    match asked {
        None => Ok(0),
        Some(threads @ 1..=MOST) => Ok(threads),
        Some(threads) => Err(CliError::Input(format!("--threads {threads}: valid are 1 to {MOST}"))),
    }
}

fn checked_camera(camera: &CameraSettings, film: &FilmSettings) -> Result<Camera, CliError> {
    Camera::try_new(camera, film.size).map_err(|error| CliError::Input(format!("[camera]: {error}")))
}

/// Bytes of a picture, or why there are none.
fn encoded(png: Result<Vec<u8>, trimray::film::EncodeError>) -> Result<Vec<u8>, CliError> {
    png.map_err(|reason| CliError::Failed(anyhow::anyhow!("a picture cannot be encoded: {reason}")))
}

/// Whether a flag's file has the ending that its kind has.
fn check_ending(flag: &str, path: &Path, ending: &str) -> Result<(), CliError> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(ending)) {
        return Ok(());
    }
    let shown = path.display();
    Err(CliError::Input(format!("{flag} {shown}: the file's name must end in .{ending}")))
}

/// A flag's length in world units: above 0.
fn parse_tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(tolerance) if tolerance > 0.0 && tolerance.is_finite() => Ok(tolerance),
        _ => Err("must be a number above 0, in world units".to_owned()),
    }
}

fn check_interrupted() -> Result<(), CliError> {
    if INTERRUPTED.load(Ordering::Relaxed) { Err(CliError::Interrupted) } else { Ok(()) }
}

/// Prints a result to stdout; a reader that has gone away is no error.
fn print_result(text: &str) -> Result<(), CliError> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        // a closed pipe (`| head`) has got what it wanted
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        Err(source) => Err(OutputError::Io { path: "standard output".into(), source }.into()),
        Ok(()) => Ok(()),
    }
}

/// Prints a line to stderr.
fn write_line(line: fmt::Arguments<'_>) {
    // nobody is left to tell if it cannot be written
    let _ = writeln!(io::stderr().lock(), "{line}");
}
