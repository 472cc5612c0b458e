//! `trimray render`.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;

use trimray::film::{FilmSettings, write_exr, write_png};
use trimray::identity::PictureIdentity;
use trimray::output::check_writable;
use trimray::render::{Checkpoint, CheckpointFile, RenderControl, RenderError, Rendered, TevPreview};
use trimray::scene::{Choice, SceneDescription, parse_crop, parse_size, validate_film};
use trimray::shade::IntegratorKind;

use super::own_inputs::check_not_inputs;
use super::progress::progress_bar;
use super::show::{Show, draw};
use super::statistics::{Acceleration, print_render};
use super::{CliError, INTERRUPTED, SceneArgs, checked_camera};

#[derive(Debug, Args)]
#[command(after_help = "Example: trimray render scenes/feng_fig07.toml -o cube.exr --spp 256")]
pub(super) struct RenderArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// The picture: .exr, or .png for a preview [default: the scene's name with .exr, in the current folder]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Samples for each pixel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Longest path in segments; -1 is unlimited
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(i32).range(-1..))]
    max_depth: Option<i32>,
    /// Render only this part, in pixels
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_crop)]
    crop: Option<[u32; 4]>,
    /// Seed of all random numbers
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// How light is gathered: path or direct
    #[arg(long, value_name = "I", value_parser = IntegratorKind::from_name)]
    integrator: Option<IntegratorKind>,
    /// Save the state to this file now and then and on Ctrl-C, for --resume
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Seconds between two savings
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = seconds, requires = "checkpoint")]
    checkpoint_interval: f64,
    /// Go on from the checkpoint file, if it is there; with a larger --spp also from a picture that is done
    #[arg(long, requires = "checkpoint")]
    resume: bool,
    /// Stop after this many seconds and write the picture with the samples that there are
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    time_limit: Option<f64>,
    /// Show the picture as it grows in the viewer tev, if one listens there
    #[arg(long, value_name = "HOST[:PORT]", num_args = 0..=1, default_missing_value = "127.0.0.1")]
    preview: Option<String>,
    /// Draw over a .png preview: lattice, drags
    #[arg(long, value_name = "WHAT", value_delimiter = ',')]
    show: Vec<Show>,
    /// Print to stderr what the rays met, and the acceleration structure
    #[arg(long)]
    stats: bool,
    /// No progress bar and no notes
    #[arg(short, long)]
    quiet: bool,
}

/// The two kinds of picture.
#[derive(Clone, Copy)]
enum Format {
    Exr,
    Png,
}

pub(super) fn run(args: &RenderArgs) -> Result<(), CliError> {
    let started = Instant::now();
    let mut scene = args.scene.parse()?;
    args.override_settings(&mut scene)?;
    let (path, format) = args.output_file(&scene)?;
    if !args.show.is_empty() && matches!(format, Format::Exr) {
        let message = "--show draws over previews alone: write a .png with -o";
        return Err(CliError::Input(message.to_owned()));
    }
    let state = args.checkpoint.as_deref();
    let outputs: Vec<&Path> = std::iter::once(&*path).chain(state).collect();
    check_not_inputs(&outputs, &scene.files())?;
    check_writable(&path)?;
    let threads = args.scene.thread_count()?;
    let camera = scene.camera.map(|camera| checked_camera(&camera, &scene.film)).transpose()?;
    let built = args.scene.build(&scene, args.quiet)?;
    check_not_inputs(&outputs, &built.library_files)?;
    let camera = camera.map_or_else(|| checked_camera(&built.camera, &scene.film), Ok)?;
    if let Some(state) = &args.checkpoint {
        check_writable(state)?;
    }
    let settings = match (&args.checkpoint, format) {
        (None, Format::Png) => None,
        _ => Some(PictureIdentity::new(&scene, &built)),
    };
    let interval = Duration::from_secs_f64(args.checkpoint_interval);
    let checkpoint = args.checkpoint.clone().zip(settings.as_ref());
    let checkpoint = checkpoint.map(|(state, settings)| CheckpointFile::new(state, settings, interval));
    let resume = args.resumed(checkpoint.as_ref())?;
    let preview = args.open_preview(&path, &scene.film);
    let bar = progress_bar(pixels(&scene.film) * u64::from(scene.render.spp), args.quiet);
    let control = RenderControl {
        threads,
        deadline: args.time_limit.map(|seconds| started + Duration::from_secs_f64(seconds)),
        progress: &|done, total| {
            bar.set_length(total);
            bar.set_position(done.max(bar.position()));
        },
        checkpoint: checkpoint.as_ref(),
        resume: resume.as_ref(),
        preview: preview.as_ref(),
        memory: args.scene.limits.memory(),
        ..RenderControl::new(&INTERRUPTED)
    };
    let rendered = built.render(&camera, &scene.film, &scene.render, &control);
    bar.finish_and_clear();
    let Rendered { mut image, statistics, samples: [least, most] } =
        rendered.map_err(|error| match error {
            RenderError::Interrupted => CliError::Interrupted,
            RenderError::Checkpoint(error) => CliError::Input(error.to_string()),
            RenderError::Output(error) => CliError::Output(error),
            RenderError::Memory(error) => CliError::Memory(error),
            other => CliError::Failed(other.into()),
        })?;
    if statistics.non_finite_samples > 0 {
        say!("trimray: {} samples were not finite and count as black", statistics.non_finite_samples);
    }
    if least < scene.render.spp && !args.quiet {
        let spp = scene.render.spp;
        say!("trimray: the time is over: pixels have {least} to {most} samples instead of {spp}");
    }
    if let (Format::Exr, Some(settings)) = (format, &settings) {
        write_exr(&path, &image, &settings.header(&scene, &camera))?;
    } else {
        draw(&mut image, &args.show, &built, &camera);
        write_png(&path, &image)?;
    }
    if args.stats {
        print_render(&statistics, &Acceleration::new(&built));
    }
    if !args.quiet && std::io::IsTerminal::is_terminal(&std::io::stderr()) {
        let [width, height] = scene.film.size;
        let seconds = started.elapsed().as_secs_f64();
        say!("wrote {}: {width}x{height}, {} spp, {seconds:.1} s", path.display(), scene.render.spp);
    }
    Ok(())
}

fn pixels(film: &FilmSettings) -> u64 {
    let [width, height] = film.crop.map_or(film.size, |[_, _, width, height]| [width, height]);
    u64::from(width) * u64::from(height)
}

/// Seconds of a flag: above 0.
fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if Duration::try_from_secs_f64(seconds).is_ok_and(|seconds| !seconds.is_zero()) => {
            Ok(seconds)
        }
        _ => Err("must be a number of seconds above 0".to_owned()),
    }
}

impl RenderArgs {
    /// The state to go on from, if there is one.
    fn resumed(&self, file: Option<&CheckpointFile>) -> Result<Option<Checkpoint>, CliError> {
        let Some(file) = file else { return Ok(None) };
        let shown = file.path().display();
        match (file.path().exists(), self.resume) {
            (true, true) => file.read().map(Some).map_err(|error| CliError::Input(error.to_string())),
            (true, false) => Err(CliError::Input(format!(
                "{shown}: is there already; --resume goes on from it, or delete it to start anew"
            ))),
            (false, true) => {
                if !self.quiet {
                    say!("trimray: {shown} is not there yet: starting from the first sample");
                }
                Ok(None)
            }
            (false, false) => Ok(None),
        }
    }

    /// The viewer's picture; that none listens is said and is no error.
    fn open_preview(&self, path: &Path, film: &FilmSettings) -> Option<TevPreview> {
        let address = self.preview.as_ref()?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        match TevPreview::open(address, &name, film.size) {
            Ok(preview) => Some(preview),
            Err(error) => {
                say!("trimray: no preview: tev at {address}: {error}");
                None
            }
        }
    }

    fn override_settings(&self, scene: &mut SceneDescription) -> Result<(), CliError> {
        let SceneDescription { film, render, .. } = scene;
        film.size = self.size.unwrap_or(film.size);
        film.crop = self.crop.or(film.crop);
        render.spp = self.spp.unwrap_or(render.spp);
        render.max_depth = self.max_depth.unwrap_or(render.max_depth);
        render.seed = self.seed.unwrap_or(render.seed);
        render.integrator = self.integrator.unwrap_or(render.integrator);
        validate_film(film).map_err(|error| CliError::Input(error.to_string()))
    }

    fn output_file(&self, scene: &SceneDescription) -> Result<(PathBuf, Format), CliError> {
        let path = match &self.output {
            Some(path) => path.clone(),
            None => Path::new(scene.path.file_name().unwrap_or("scene".as_ref())).with_extension("exr"),
        };
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        let format = match extension.to_ascii_lowercase().as_str() {
            "exr" => Format::Exr,
            "png" => Format::Png,
            _ => {
                let message = format!("{}: unknown kind of picture (valid: .exr, .png)", path.display());
                return Err(CliError::Input(message));
            }
        };
        Ok((path, format))
    }
}
