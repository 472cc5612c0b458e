//! `trimray render`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use clap::Args;
use serde_json::json;

use crate::film::{Aov, ExrHeader, FilmSettings, Picture, write_exr, write_png};
use crate::output::check_writable;
use crate::render::{RenderControl, RenderError, render};
use crate::scene::{BuiltScene, Choice, SceneDescription, parse_crop, parse_size, validate_film};
use crate::shade::{IntegratorKind, Light, PerspectiveCamera, ShadingScene};

use super::material_json::material_json;
use super::progress::progress_bar;
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
    check_writable(&path)?;
    let threads = args.scene.thread_count()?;
    let camera = scene.camera.map(|camera| checked_camera(&camera, &scene.film)).transpose()?;
    let built = args.scene.build(&scene, args.quiet)?;
    let camera = camera.map_or_else(|| checked_camera(&built.camera, &scene.film), Ok)?;
    let shading =
        ShadingScene { geometry: &built.traced, object_materials: &built.materials, lights: &built.lights };
    let bar = progress_bar(pixels(&scene.film), args.quiet);
    let control = RenderControl {
        threads,
        cancel: &INTERRUPTED,
        progress: &|done, _| bar.set_position(done.max(bar.position())),
    };
    let rendered = render(&shading, &camera, &scene.film, &scene.render, &control);
    bar.finish_and_clear();
    let (image, statistics) = rendered.map_err(|error| match error {
        RenderError::Interrupted => CliError::Interrupted,
        other => CliError::Failed(other.into()),
    })?;
    if statistics.non_finite_samples > 0 {
        eprintln!("trimray: {} samples were not finite and count as black", statistics.non_finite_samples);
    }
    match format {
        Format::Exr => write_exr(&path, &image, &header(&scene, &built, &camera)?)?,
        Format::Png => write_png(&path, &image)?,
    }
    if args.stats {
        print_render(&statistics, &Acceleration::of(&built));
    }
    if !args.quiet && std::io::IsTerminal::is_terminal(&std::io::stderr()) {
        let [width, height] = scene.film.size;
        let seconds = started.elapsed().as_secs_f64();
        eprintln!("wrote {}: {width}x{height}, {} spp, {seconds:.1} s", path.display(), scene.render.spp);
    }
    Ok(())
}

fn pixels(film: &FilmSettings) -> u64 {
    let [width, height] = film.crop.map_or(film.size, |[_, _, width, height]| [width, height]);
    u64::from(width) * u64::from(height)
}

impl RenderArgs {
    fn override_settings(&self, scene: &mut SceneDescription) -> Result<(), CliError> {
        let SceneDescription { film, render, .. } = scene;
        film.size = self.size.unwrap_or(film.size);
        film.crop = self.crop.or(film.crop);
        render.spp = self.spp.unwrap_or(render.spp);
        render.max_depth = self.max_depth.unwrap_or(render.max_depth);
        render.seed = self.seed.unwrap_or(render.seed);
        render.integrator = self.integrator.unwrap_or(render.integrator);
        validate_film(film).map_err(CliError::Input)
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

fn header(
    scene: &SceneDescription,
    built: &BuiltScene,
    camera: &PerspectiveCamera,
) -> Result<ExrHeader, CliError> {
    let settings = settings_json(scene, built);
    Ok(ExrHeader {
        camera_from_world: camera.camera_from_world(),
        screen_window_width: camera.screen_window_width(),
        scene_hash: scene_hash(scene, built).context("the scene's hash")?,
        seed: scene.render.seed,
        spp: scene.render.spp,
        settings: settings.to_string(),
    })
}

/// All that decides the pixels besides geometry, which the hash stands for.
fn settings_json(scene: &SceneDescription, built: &BuiltScene) -> serde_json::Value {
    let (camera, film, render) = (&built.camera, &scene.film, &scene.render);
    let materials = scene.objects.iter().zip(&built.materials).map(|(object, prepared)| {
        let mut material = material_json(&scene.material_of(object));
        material["pictures"] = prepared.pictures().into_iter().map(picture_hash).collect();
        material
    });
    json!({
        "camera": {
            "origin": camera.origin.to_array(), "target": camera.target.to_array(), "up": camera.up.to_array(),
            "fov": camera.fov, "fov_axis": camera.fov_axis.name(),
        },
        "film": { "size": film.size, "filter": film.filter.name(), "crop": film.crop },
        "render": {
            "integrator": render.integrator.name(), "spp": render.spp, "max_depth": render.max_depth,
            "rr_depth": render.rr_depth, "seed": render.seed, "hide_emitters": render.hide_emitters,
            "aovs": render.aovs.iter().map(|aov: &Aov| aov.name()).collect::<Vec<_>>(),
        },
        "materials": materials.collect::<Vec<_>>(),
        "lights": scene.lights_or_default().iter().map(light_json).collect::<Vec<_>>(),
    })
}

/// Hash of a picture's pixels, which decide more than its file's name.
fn picture_hash(picture: &Picture) -> String {
    let mut hasher = blake3::Hasher::new();
    for side in picture.size {
        hasher.update(&side.to_le_bytes());
    }
    for channel in picture.pixels.as_flattened() {
        hasher.update(&channel.to_le_bytes());
    }
    hasher.finalize().to_hex()[..32].to_owned()
}

fn light_json(light: &Light) -> serde_json::Value {
    match light {
        Light::Constant { radiance } => json!({ "type": "constant", "radiance": radiance.to_array() }),
        Light::Point { position, intensity } => {
            json!({ "type": "point", "position": position.to_array(), "intensity": intensity.to_array() })
        }
        Light::Rectangle { to_world, radiance } => json!({
            "type": "area", "shape": "rectangle", "radiance": radiance.to_array(),
            "to_world": to_world.to_cols_array(),
        }),
    }
}

/// Hash of what the scene shows: its patches, materials, lights, camera and picture size; not of seed or samples.
fn scene_hash(scene: &SceneDescription, built: &BuiltScene) -> std::io::Result<String> {
    let mut settings = settings_json(scene, built);
    settings["render"] = serde_json::Value::Null;
    settings["film"]["crop"] = serde_json::Value::Null;
    let mut hasher = blake3::Hasher::new();
    hasher.update(settings.to_string().as_bytes());
    hasher.update(&crate::export::exact_patches(built)?);
    Ok(hasher.finalize().to_hex()[..32].to_owned())
}
