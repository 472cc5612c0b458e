//! `trimray compare`.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use serde::Serialize;

use trimray::compare::{
    CompareError, CompareSettings, METRICS, Made, MethodFigures, SceneFigures, measure, needed,
};
use trimray::difference::{self, Comparison};
use trimray::film::{LayeredPicture, encode_png, encode_raster, read_layers_within, write_exr};
use trimray::identity::PictureIdentity;
use trimray::output::{OutputError, check_writable, write_whole};
use trimray::render::RenderError;
use trimray::report::{MethodPictures, ShownScene, comparison_page};
use trimray::scene::{SceneDescription, parse_scene, parse_size, validate_film};

use super::own_inputs::check_not_inputs;
use super::progress::spinner;
use super::{
    CliError, INTERRUPTED, LimitArgs, check_interrupted, encoded, install, parse_tolerance, print_result,
    thread_count,
};

/// Pictures are no wider than this where no size is asked for, and have no more samples than that where no number is.
const WIDTH: u32 = 320;
const SAMPLES: u32 = 16;

#[derive(Debug, Args)]
#[command(after_help = "Example: trimray compare scenes/feng_fig10.toml -o castle --levels 6
         trimray compare scenes/feng_fig*.toml -o feng --adaptive 1e-3,1e-4")]
pub(super) struct CompareArgs {
    /// The scene files (TOML)
    #[arg(required = true)]
    scenes: Vec<PathBuf>,
    /// The folder for report.html, report.json and the pictures; made if it is not there
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Pointwise deformation from level 0, the mesh as it is, to this one: each triangle in 4^L
    #[arg(long, value_name = "L", default_value_t = 4, value_parser = clap::value_parser!(u32).range(0..=12))]
    levels: u32,
    /// Tolerances of adaptive subdivision, in world units [default: about 1e-3, 1e-4 and 1e-5 of the deformed objects' size]
    #[arg(long, value_name = "TOL", value_delimiter = ',', value_parser = parse_tolerance)]
    adaptive: Option<Vec<f64>>,
    /// Width and height in pixels [default: the scene's, scaled to a width of 320 at most]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Samples for each pixel [default: the scene's, at most 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Seed of all random numbers
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Threads to work with [default: one for each processor]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Where drags contradict each other, take the best compromise instead of stopping
    #[arg(long)]
    least_squares: bool,
    #[command(flatten)]
    limits: LimitArgs,
    /// Print report.json to stdout too
    #[arg(long)]
    json: bool,
    /// Say nothing while working
    #[arg(short, long)]
    quiet: bool,
}

/// report.json of several scenes; of one it is that scene's figures.
#[derive(Serialize)]
struct Several<'a> {
    scenes: &'a [SceneFigures],
}

pub(super) fn run(args: &CompareArgs) -> Result<(), CliError> {
    let threads = thread_count(args.threads)?;
    let mut scenes = Vec::new();
    for path in &args.scenes {
        scenes.push(args.scene(path)?);
    }
    fs::create_dir_all(&args.output)
        .map_err(|source| OutputError::Io { path: args.output.clone(), source })?;
    for name in ["report.html", "report.json"] {
        let path = args.output.join(name);
        for scene in &scenes {
            check_not_inputs(&[&path], &scene.files())?;
        }
        check_writable(&path)?;
    }
    let (mut figures, mut pictures) = (Vec::new(), Vec::new());
    for scene in &scenes {
        let (made, shown) = install(threads, || args.compare(scene, threads))??;
        figures.push(made);
        pictures.push(shown);
    }
    let json = match figures.as_slice() {
        [one] => serde_json::to_string_pretty(one),
        several => serde_json::to_string_pretty(&Several { scenes: several }),
    };
    let json = json.context("the JSON")? + "\n";
    let shown: Vec<_> =
        figures.iter().zip(&pictures).map(|(figures, pictures)| ShownScene { figures, pictures }).collect();
    let page =
        comparison_page(&shown).map_err(|reason| anyhow::anyhow!("a plot cannot be drawn: {reason}"))?;
    write_whole(&args.output.join("report.html"), page.as_bytes())?;
    write_whole(&args.output.join("report.json"), json.as_bytes())?;
    if args.json {
        print_result(&json)?;
    }
    if !args.quiet {
        say!("trimray: wrote {}", args.output.join("report.html").display());
    }
    Ok(())
}

impl CompareArgs {
    fn scene(&self, path: &Path) -> Result<SceneDescription, CliError> {
        let mut scene = parse_scene(path)?;
        scene.least_squares = self.least_squares;
        scene.pictures = self.limits.pictures();
        scene.memory = self.limits.memory();
        let [width, height] = scene.film.size;
        scene.film.crop = None;
        scene.film.size = self.size.unwrap_or_else(|| {
            let scaled = u64::from(height) * u64::from(WIDTH) / u64::from(width.max(1));
            let scaled = u32::try_from(scaled).unwrap_or(u32::MAX).max(1);
            if width > WIDTH { [WIDTH, scaled] } else { [width, height] }
        });
        validate_film(&scene.film).map_err(|error| CliError::Input(error.to_string()))?;
        scene.render.spp = self.spp.unwrap_or_else(|| scene.render.spp.min(SAMPLES));
        scene.render.seed = self.seed.unwrap_or(scene.render.seed);
        Ok(scene)
    }

    /// A scene's figures, and its pictures, which are written too.
    fn compare(
        &self,
        scene: &SceneDescription,
        threads: usize,
    ) -> Result<(SceneFigures, Vec<MethodPictures>), CliError> {
        let name = scene.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let bar = spinner(self.quiet);
        bar.set_message(format!("{name}: exact"));
        let settings = CompareSettings { levels: self.levels, tolerances: self.adaptive.clone(), threads };
        let mut methods = Vec::new();
        let mut pictures = Vec::new();
        let mut reference = None;
        measure(
            scene,
            &settings,
            &INTERRUPTED,
            |next| bar.set_message(format!("{name}: {next}")),
            |made| {
                check_interrupted()?;
                let picture = self.write(&made)?;
                let found = reference.as_ref().map(|reference| compared(reference, &picture)).transpose()?;
                methods.push(MethodFigures::new(made.result, found.as_ref()));
                let heat_map = found.as_ref().map(|found| encoded(encode_raster(&found.heat_map().raster())));
                let png = encoded(encode_png(&made.result.image))?;
                pictures.push(MethodPictures { png, heat_map: heat_map.transpose()? });
                if reference.is_none() {
                    reference = Some(picture);
                }
                Ok::<(), CliError>(())
            },
        )?;
        bar.finish_and_clear();
        let needed = needed(&methods);
        let (size, spp) = (scene.film.size, scene.render.spp);
        Ok((SceneFigures { scene: name, size, spp, methods, needed }, pictures))
    }

    /// Writes a picture and reads it back, as anyone else would.
    fn write(&self, made: &Made<'_>) -> Result<LayeredPicture, CliError> {
        let stem = made.scene.path.file_stem().unwrap_or_default().to_string_lossy();
        let method = if made.result.noise { "noise".to_owned() } else { made.result.method.to_string() };
        let path = self.output.join(format!("{stem}_{}.exr", method.replace(':', "_")));
        check_not_inputs(&[&path], &made.scene.files())?;
        check_not_inputs(&[&path], &made.built.library_files)?;
        let settings = PictureIdentity::new(made.scene, made.built);
        let header = settings.header(made.scene, made.camera);
        write_exr(&path, &made.result.image, &header)?;
        read_layers_within(&path, self.limits.pictures()).map_err(|error| CliError::Failed(error.into()))
    }
}

fn compared(reference: &LayeredPicture, test: &LayeredPicture) -> Result<Comparison, CliError> {
    let settings = difference::CompareSettings { metrics: METRICS.to_vec(), ..Default::default() };
    difference::compare(reference, test, &settings).map_err(|error| CliError::Failed(error.into()))
}

impl From<CompareError> for CliError {
    fn from(error: CompareError) -> Self {
        match error {
            CompareError::Scene(error) => Self::Scene(error),
            CompareError::Render(RenderError::Interrupted) => Self::Interrupted,
            CompareError::Render(error) => Self::Failed(error.into()),
            other => Self::Input(other.to_string()),
        }
    }
}
