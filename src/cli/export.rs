//! `trimray export`.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, ValueEnum};

use trimray::arrays::write_npy;
use trimray::export::{
    LengthUnit, MITSUBA_NAMES, MITSUBA_SCENE, NamedMesh, Precision, Schema, StepObject, StepReport,
    StepSettings, is_exported, mitsuba_scene, obj, ply, step, write_exact_patches,
};
use trimray::model::{Borders, Representation};
use trimray::output::{
    OwnFolder, check_folder_writable, check_writable, write_folder_whole, write_whole, write_whole_by,
};
use trimray::scene::{BuiltScene, SceneDescription};
use trimray::shade::Material;
use trimray::tessellate::{Fineness, TessellateError, tessellate_within};

use super::own_inputs::{check_not_inputs, check_replaces_no_inputs};
use super::{CliError, INTERRUPTED, SceneArgs, checked_camera, parse_tolerance};

/// The tolerance where none is asked for, in parts of the object's diagonal.
pub(super) const TOLERANCE: f64 = 1e-4;

/// How far STEP surfaces may be from the exact ones where nothing is asked for, in parts of the object's diagonal.
const STEP_TOLERANCE: f64 = 1e-6;

/// Some systems read no higher degrees.
const NOTED_DEGREE: usize = 9;

/// Objects smaller than this, in millimetres, are small beside what systems take for one point (1e-7 mm).
const SMALL: f64 = 1e-3;

/// A Mitsuba scene is a folder that may be written anew.
const MITSUBA_FOLDER: OwnFolder<'static> = OwnFolder { is_own: is_mitsuba_export, names: MITSUBA_NAMES };

#[derive(Debug, Args)]
#[command(after_help = "Example: trimray export scenes/feng_fig07.toml -o cube.json
         trimray export scenes/feng_fig07.toml -o cube.ply --tolerance 1e-5
         trimray export scenes/feng_fig07.toml --format mitsuba -o cube_mitsuba")]
pub(super) struct ExportArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// The file: .step, solids for CAD; .json, the exact patches; .obj or .ply, triangles; .npy, the lattice; for mitsuba a folder
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// What to write [default: by the file's name]
    #[arg(long)]
    format: Option<Format>,
    /// Greatest distance from the surface, in world units: of triangles [default: 1e-4 of each object's diagonal], of what STEP
    /// surfaces stand for [default: 1e-6 of it]
    #[arg(long, value_name = "T", value_parser = parse_tolerance, conflicts_with = "level")]
    tolerance: Option<f64>,
    /// Cut each triangle of each sub-polygon into 4, this many times
    #[arg(long, value_name = "L", value_parser = clap::value_parser!(u32).range(0..=12))]
    level: Option<u32>,
    /// STEP: the unit of length that one unit of the scene is
    #[arg(long, default_value = "mm")]
    unit: Unit,
    /// STEP: the application protocol
    #[arg(long, default_value = "ap242")]
    schema: Protocol,
    /// No notes
    #[arg(short, long)]
    quiet: bool,
}

/// Units of length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Unit {
    /// Millimetre
    Mm,
    /// Centimetre
    Cm,
    /// Metre
    M,
    /// Inch
    In,
}

/// Application protocols of STEP.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Protocol {
    /// ISO 10303-203
    Ap203,
    /// ISO 10303-214
    Ap214,
    /// ISO 10303-242
    Ap242,
}

/// The kinds of export.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Solids for CAD
    Step,
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
    let format = args.checked_format()?;
    let mut scene = args.scene.parse()?;
    args.set_borders(format, &mut scene);
    args.check_output(format, &scene)?;
    let built = args.scene.build(&scene, args.quiet)?;
    args.write(format, &scene, &built)
}

/// As [`run`], of a scene that is built already.
pub(super) fn run_built(
    args: &ExportArgs,
    scene: &SceneDescription,
    built: &BuiltScene,
) -> Result<(), CliError> {
    let format = args.checked_format()?;
    args.check_output(format, scene)?;
    if format == Format::Step {
        // where pieces meet it is built otherwise
        let mut scene = scene.clone();
        args.set_borders(format, &mut scene);
        return args.write(format, &scene, &scene.build()?);
    }
    args.write(format, scene, built)
}

impl ExportArgs {
    /// How near pieces of a chain must meet for what is written.
    fn set_borders(&self, format: Format, scene: &mut SceneDescription) {
        if format == Format::Step {
            // two neighbours may be off in opposite directions
            scene.borders = match self.tolerance {
                Some(tolerance) => Borders::Within(0.5 * tolerance),
                None => Borders::WithinPart(0.5 * STEP_TOLERANCE),
            };
        }
    }

    /// Refuses a file or folder that cannot be written, or that is read.
    fn check_output(&self, format: Format, scene: &SceneDescription) -> Result<(), CliError> {
        if format == Format::Mitsuba {
            check_replaces_no_inputs(&self.output, MITSUBA_NAMES, &scene.files())?;
            Ok(check_folder_writable(&self.output, MITSUBA_FOLDER)?)
        } else {
            check_not_inputs(&[&self.output], &scene.files())?;
            Ok(check_writable(&self.output)?)
        }
    }

    fn write(&self, format: Format, scene: &SceneDescription, built: &BuiltScene) -> Result<(), CliError> {
        if format == Format::Mitsuba {
            check_replaces_no_inputs(&self.output, MITSUBA_NAMES, &built.library_files)?;
        } else {
            check_not_inputs(&[&self.output], &built.library_files)?;
        }
        match format {
            Format::Json => write_whole_by(&self.output, |file| write_exact_patches(built, file))?,
            Format::Step => self.write_step(scene, built)?,
            Format::Obj => write_whole(&self.output, obj(&self.meshes(scene, built)?).as_bytes())?,
            Format::Ply => write_whole(&self.output, &ply(&self.meshes(scene, built)?, Precision::Double))?,
            Format::Npy => write_lattice(&self.output, built)?,
            Format::Mitsuba => {
                // what Mitsuba would refuse
                checked_camera(&built.camera, &scene.film)?;
                let meshes = self.meshes(scene, built)?;
                let files = mitsuba_scene(scene, built, &meshes).context("the XML")?;
                let files = files.iter().map(|file| (file.path.as_str(), file.bytes.as_slice()));
                write_folder_whole(&self.output, MITSUBA_FOLDER, files)?;
            }
        }
        Ok(())
    }

    /// What to write, if the other flags fit it.
    fn checked_format(&self) -> Result<Format, CliError> {
        let format = self.format()?;
        if format == Format::Json && (self.tolerance.is_some() || self.level.is_some()) {
            let message = "--tolerance and --level are for triangles; .json holds the exact patches";
            return Err(CliError::Input(message.to_owned()));
        }
        if format == Format::Step && self.level.is_some() {
            let message = "--level is for triangles; .step holds surfaces";
            return Err(CliError::Input(message.to_owned()));
        }
        Ok(format)
    }

    fn format(&self) -> Result<Format, CliError> {
        if let Some(format) = self.format {
            return Ok(format);
        }
        let extension = self.output.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        match extension.to_ascii_lowercase().as_str() {
            "step" | "stp" => Ok(Format::Step),
            "json" => Ok(Format::Json),
            "obj" => Ok(Format::Obj),
            "ply" => Ok(Format::Ply),
            "npy" => Ok(Format::Npy),
            _ => Err(CliError::Input(format!(
                "{}: unknown kind of export (valid in this version: .step, .json, .obj, .ply, .npy, or --format mitsuba for a folder)",
                self.output.display()
            ))),
        }
    }

    /// The objects as solids; says what they are.
    fn write_step(&self, scene: &SceneDescription, built: &BuiltScene) -> Result<(), CliError> {
        if let Some(object) = scene.objects.iter().find(|object| object.method != Representation::Exact) {
            return Err(CliError::Input(format!(
                "object {:?}: method {} makes triangles or their like, and .step holds exact surfaces; .obj and .ply hold triangles",
                object.name.value, object.method
            )));
        }
        let groups: Vec<_> =
            built.objects.iter().map(|report| |face: u32| report.groups.name(face)).collect();
        let objects: Vec<_> = built
            .traced
            .objects()
            .iter()
            .enumerate()
            .map(|(index, object)| StepObject {
                name: &object.name,
                shell: &object.shell,
                colour: built.materials[index].only().and_then(Material::uniform_colour),
                group: &groups[index],
            })
            .collect();
        let file_name = self.output.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let settings = StepSettings {
            unit: self.unit.into(),
            schema: self.schema.into(),
            file_name,
            time_stamp: time_stamp(),
        };
        let (text, reports) =
            step(&objects, &settings).map_err(|error| CliError::Input(error.to_string()))?;
        for (index, report) in reports.iter().enumerate() {
            let [low, high] = built.traced.object_bounds(index);
            let diagonal = (high - low).length();
            let tolerance = self.tolerance.unwrap_or(STEP_TOLERANCE * diagonal);
            if report.error > tolerance {
                return Err(CliError::Input(format!(
                    "object {:?}: its surfaces are certified within {:.1e} of the exact ones, not within {tolerance:.1e}",
                    report.name, report.error
                )));
            }
            if !self.quiet {
                say_of_step(report, diagonal, self.unit);
            }
        }
        Ok(write_whole(&self.output, text.as_bytes())?)
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
            let memory = self.scene.limits.memory();
            let made = self.scene.install(|| tessellate_within(object, fineness, &INTERRUPTED, memory))?;
            let mesh = made.map_err(|error| match error {
                TessellateError::Interrupted => CliError::Interrupted,
                TessellateError::Memory(error) => CliError::Memory(error),
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

impl From<Unit> for LengthUnit {
    fn from(unit: Unit) -> Self {
        match unit {
            Unit::Mm => Self::Millimetre,
            Unit::Cm => Self::Centimetre,
            Unit::M => Self::Metre,
            Unit::In => Self::Inch,
        }
    }
}

impl From<Protocol> for Schema {
    fn from(protocol: Protocol) -> Self {
        match protocol {
            Protocol::Ap203 => Self::Ap203,
            Protocol::Ap214 => Self::Ap214,
            Protocol::Ap242 => Self::Ap242,
        }
    }
}

/// What was written of an object, and what readers may stumble over.
fn say_of_step(report: &StepReport, diagonal: f64, unit: Unit) {
    let StepReport { name, solids, voids, open_shells, faces, edges, degree, turned, error } = report;
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let mut parts = Vec::new();
    if *solids > 0 {
        parts.push(count(*solids, "solid"));
    }
    if *voids > 0 {
        parts.push(count(*voids, "cavity").replace("cavitys", "cavities"));
    }
    if *open_shells > 0 {
        parts.push(count(*open_shells, "open shell"));
    }
    let parts = if parts.is_empty() { "nothing".to_owned() } else { parts.join(", ") };
    let closeness =
        if *error > 0.0 { format!("within {error:.1e} of the exact surface") } else { "exact".to_owned() };
    say!(
        "trimray: {name}: {parts}, {}, {}, greatest degree {degree}, {closeness}",
        count(*faces, "face"),
        count(*edges, "edge")
    );
    if *open_shells > 0 && *solids == 0 {
        say!("trimray: {name}: not closed, so a shell and no solid");
    }
    if *turned > 0 {
        say!(
            "trimray: warning: {name}: {} turned inside out by the deformation, written with normals outwards",
            count(*turned, "solid")
        );
    }
    if *degree > NOTED_DEGREE {
        say!("trimray: {name}: degree {degree}; some CAD systems read no more than {NOTED_DEGREE}");
    }
    let millimetres = diagonal * LengthUnit::from(unit).millimetres();
    if millimetres < SMALL {
        say!(
            "trimray: warning: {name} is {millimetres:.1e} mm long, and CAD systems take lengths within 1e-7 mm for one: reading may be slow \
             and small faces may be lost; --unit says how long a unit of the scene is"
        );
    }
}

/// Now, or what `SOURCE_DATE_EPOCH` says, in UTC as ISO 8601 has it.
fn time_stamp() -> String {
    let named = std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|seconds| seconds.parse().ok());
    let now = || {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        since.map_or(0, |since| since.as_secs())
    };
    iso_8601(named.unwrap_or_else(now))
}

/// Seconds since 1970 as date and time.
///
/// Source: Hinnant (2013), *chrono-Compatible Low-Level Date Algorithms*, `civil_from_days`.
fn iso_8601(seconds: u64) -> String {
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    // from 1 March 0000, in eras of 400 years
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month + 2) / 5 + 1;
    let (year, month) = if month < 10 { (0, month + 3) } else { (1, month - 9) };
    let year = year_of_era + 400 * era + year;
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}")
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

#[cfg(test)]
mod tests {
    use super::iso_8601;

    #[test]
    fn seconds_are_dates() {
        assert_eq!(iso_8601(0), "1970-01-01T00:00:00");
        assert_eq!(iso_8601(951_827_696), "2000-02-29T12:34:56");
        assert_eq!(iso_8601(1_795_824_000), "2026-11-28T00:00:00");
    }
}
