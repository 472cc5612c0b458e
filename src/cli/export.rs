//! `trimray export`.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, ValueEnum};

use trimray::arrays::write_npy;
use trimray::export::{
    MITSUBA_NAMES, MITSUBA_SCENE, NamedMesh, Precision, exact_patches, is_exported, mitsuba_scene, obj, ply,
};
use trimray::output::{OwnFolder, check_folder_writable, check_writable, write_folder_whole, write_whole};
use trimray::scene::{BuiltScene, SceneDescription};
use trimray::tessellate::{Fineness, TessellateError, tessellate};

use super::own_inputs::{check_not_inputs, check_replaces_no_inputs};
use super::{CliError, INTERRUPTED, SceneArgs, checked_camera, parse_tolerance};

/// The tolerance where none is asked for, in parts of the object's diagonal.
const TOLERANCE: f64 = 1e-4;

/// A Mitsuba scene is a folder that may be written anew.
const MITSUBA_FOLDER: OwnFolder<'static> = OwnFolder { is_own: is_mitsuba_export, names: MITSUBA_NAMES };

#[derive(Debug, Args)]
#[command(after_help = "Example: trimray export scenes/feng_fig07.toml -o cube.json
         trimray export scenes/feng_fig07.toml -o cube.ply --tolerance 1e-5
         trimray export scenes/feng_fig07.toml --format mitsuba -o cube_mitsuba")]
pub(super) struct ExportArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// The file: .json, the exact patches; .obj or .ply, triangles; .npy, the lattice; for mitsuba a folder
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// What to write [default: by the file's name]
    #[arg(long)]
    format: Option<Format>,
    /// Greatest distance of triangles from the surface, in world units [default: 1e-4 of each object's diagonal]
    #[arg(long, value_name = "T", value_parser = parse_tolerance, conflicts_with = "level")]
    tolerance: Option<f64>,
    /// Cut each triangle of each sub-polygon into 4, this many times
    #[arg(long, value_name = "L", value_parser = clap::value_parser!(u32).range(0..=12))]
    level: Option<u32>,
    /// No notes
    #[arg(short, long)]
    quiet: bool,
}

/// The kinds of export.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// The exact patches
    Json,
    /// Triangles, all objects in one Wavefront file
    Obj,
    /// Triangles, all objects in one binary file
    Ply,
    /// The lattice after all edits, float64 (nx, ny, nz, 4): x, y, z, weight
    Npy,
    /// A folder with a scene of the same picture for Mitsuba 3
    Mitsuba,
}

pub(super) fn run(args: &ExportArgs) -> Result<(), CliError> {
    let format = args.format()?;
    if format == Format::Json && (args.tolerance.is_some() || args.level.is_some()) {
        let message = "--tolerance and --level are for triangles; .json holds the exact patches";
        return Err(CliError::Input(message.to_owned()));
    }
    let scene = args.scene.parse()?;
    if format == Format::Mitsuba {
        check_replaces_no_inputs(&args.output, MITSUBA_NAMES, &scene.files())?;
        check_folder_writable(&args.output, MITSUBA_FOLDER)?;
    } else {
        check_not_inputs(&[&args.output], &scene.files())?;
        check_writable(&args.output)?;
    }
    let built = args.scene.build(&scene, args.quiet)?;
    match format {
        Format::Json => write_whole(&args.output, &exact_patches(&built).context("the JSON")?)?,
        Format::Obj => write_whole(&args.output, obj(&args.meshes(&scene, &built)?).as_bytes())?,
        Format::Ply => write_whole(&args.output, &ply(&args.meshes(&scene, &built)?, Precision::Double))?,
        Format::Npy => write_lattice(&args.output, &built)?,
        Format::Mitsuba => {
            // what Mitsuba would refuse
            checked_camera(&built.camera, &scene.film)?;
            let meshes = args.meshes(&scene, &built)?;
            let files = mitsuba_scene(&scene, &built, &meshes).context("the XML")?;
            let files = files.iter().map(|file| (file.path.as_str(), file.bytes.as_slice()));
            write_folder_whole(&args.output, MITSUBA_FOLDER, files)?;
        }
    }
    Ok(())
}

impl ExportArgs {
    fn format(&self) -> Result<Format, CliError> {
        if let Some(format) = self.format {
            return Ok(format);
        }
        let extension = self.output.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        match extension.to_ascii_lowercase().as_str() {
            "json" => Ok(Format::Json),
            "obj" => Ok(Format::Obj),
            "ply" => Ok(Format::Ply),
            "npy" => Ok(Format::Npy),
            _ => Err(CliError::Input(format!(
                "{}: unknown kind of export (valid in this version: .json, .obj, .ply, .npy, or --format mitsuba for a folder)",
                self.output.display()
            ))),
        }
    }

    /// The objects as triangles; says how close they are.
    fn meshes(&self, scene: &SceneDescription, built: &BuiltScene) -> Result<Vec<NamedMesh>, CliError> {
        let mut meshes = Vec::new();
        for (index, object) in built.traced.objects().iter().enumerate() {
            let [low, high] = built.traced.object_bounds(index);
            let fineness = match (self.tolerance, self.level) {
                (Some(tolerance), _) => Fineness::Tolerance(tolerance),
                (None, Some(level)) => Fineness::Level(level),
                (None, None) => Fineness::Tolerance(TOLERANCE * (high - low).length()),
            };
            let made = self.scene.install(|| tessellate(object, fineness, &INTERRUPTED))?;
            let mesh = made.map_err(|error| match error {
                TessellateError::Interrupted => CliError::Interrupted,
                other => CliError::Input(format!("object {:?}: {other}", object.name)),
            })?;
            if !self.quiet {
                let (name, count) = (&scene.objects[index].name.value, mesh.triangles.len());
                say!(
                    "trimray: {name}: {count} triangles, within {:.1e} of the exact surface",
                    mesh.deviation
                );
            }
            meshes.push(NamedMesh { name: object.name.clone(), mesh });
        }
        Ok(meshes)
    }
}

/// The lattice of the scene's one deformed object.
fn write_lattice(path: &Path, built: &BuiltScene) -> Result<(), CliError> {
    let lattices: Vec<_> =
        built.objects.iter().flat_map(|object| &object.lattices).map(|built| &built.lattice).collect();
    let [lattice] = lattices.as_slice() else {
        let message =
            format!("{}: .npy holds one lattice, and the scene has {}", path.display(), lattices.len());
        return Err(CliError::Input(message));
    };
    let [nx, ny, nz] = lattice.counts();
    let numbers: Vec<f64> = lattice.points().iter().flat_map(|point| point.to_array()).collect();
    Ok(write_npy(path, &[nx, ny, nz, 4], &numbers)?)
}

/// Whether a folder holds a scene that was exported before.
fn is_mitsuba_export(folder: &Path) -> bool {
    let mut start = Vec::new();
    let read =
        File::open(folder.join(MITSUBA_SCENE)).and_then(|file| file.take(1024).read_to_end(&mut start));
    read.is_ok() && is_exported(&start)
}
