//! `trimray info`.

use std::collections::BTreeMap;
use std::fmt::Write;

use anyhow::Context;
use clap::Args;
use serde::Serialize;

use trimray::export::to_json;
use trimray::model::{BuiltLattice, TriangularCounts, bounds_of};
use trimray::scene::{BuiltScene, ObjectDescription, SceneDescription};
use trimray::spline::{Orientation, orientations};

use super::statistics::{Acceleration, Sample, readable};
use super::{CliError, SceneArgs, print_result};

/// How much too large an object's box may be, in parts of its size.
const TIGHTNESS: f64 = 1e-4;

#[derive(Debug, Args)]
#[command(after_help = "Example: trimray info scenes/feng_fig07.toml --json")]
pub(super) struct InfoArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Info {
    objects: Vec<ObjectInfo>,
    accel: Acceleration,
    sample: Sample,
    seconds: Seconds,
    bytes: usize,
}

#[derive(Debug, Serialize)]
struct ObjectInfo {
    name: String,
    method: String,
    faces: usize,
    triangles: usize,
    subpolygons: usize,
    patches: usize,
    degrees: BTreeMap<String, usize>,
    control_points: usize,
    triangular: Option<Triangular>,
    cells: usize,
    certified_error: f64,
    lattice: Option<Lattice>,
    lattices: Vec<Lattice>,
    /// Whether the object bounds solids: every edge has a face on either side.
    closed: bool,
    injective: bool,
    fold_overs: usize,
    bounds: [[f64; 3]; 2],
    bytes: usize,
    notes: Vec<String>,
}

/// Triangular patches before they are converted to the patches that are traced.
#[derive(Clone, Copy, Debug, Serialize)]
struct Triangular {
    patches: usize,
    control_points: usize,
    bytes: usize,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct Lattice {
    degree: [usize; 3],
    points: [usize; 3],
}

#[derive(Debug, Serialize)]
struct Seconds {
    load: f64,
    subdivide: f64,
    compose: f64,
    build: f64,
}

pub(super) fn run(args: &InfoArgs) -> Result<(), CliError> {
    let scene = args.scene.parse()?;
    let built = args.scene.build(&scene, true)?;
    let info = args.scene.install(|| gather(&scene, &built))??;
    print_result(&if args.json { as_json(&info)? } else { table(&info) })
}

/// What `--json` prints of a scene that is built already.
pub(super) fn json(scene: &SceneDescription, built: &BuiltScene) -> Result<String, CliError> {
    as_json(&gather(scene, built)?)
}

fn as_json(info: &Info) -> Result<String, CliError> {
    Ok(String::from_utf8(to_json(info).context("the JSON")?).context("the JSON")?)
}

fn gather(scene: &SceneDescription, built: &BuiltScene) -> Result<Info, CliError> {
    let objects: Vec<_> =
        scene.objects.iter().enumerate().map(|(i, object)| object_info(built, i, object)).collect();
    let accel = Acceleration::new(built);
    let times = &built.times;
    Ok(Info {
        bytes: accel.bytes() + objects.iter().map(|object| object.bytes).sum::<usize>(),
        objects,
        accel,
        sample: Sample::trace(scene, built)?,
        seconds: Seconds {
            load: times.load.as_secs_f64(),
            subdivide: times.patches.subdivide.as_secs_f64(),
            compose: times.patches.compose.as_secs_f64(),
            build: times.build.as_secs_f64(),
        },
    })
}

fn object_info(built: &BuiltScene, object: usize, description: &ObjectDescription) -> ObjectInfo {
    let (traced, made) = (&built.traced.objects()[object], &built.objects[object]);
    let mut degrees: BTreeMap<String, usize> = BTreeMap::new();
    for patch in traced.faces() {
        let [m, n] = patch.patch.degree();
        *degrees.entry(format!("{m}x{n}")).or_default() += 1;
    }
    let folds: Vec<_> = made.lattices.iter().map(folds).collect();
    let lattice =
        |built: &BuiltLattice| Lattice { degree: built.volume.degree(), points: built.volume.points() };
    let lattices: Vec<_> = made.lattices.iter().map(lattice).collect();
    let cells = traced.faces().iter().filter_map(|patch| patch.exact.as_ref());
    ObjectInfo {
        name: traced.name.clone(),
        method: description.method.to_string(),
        faces: made.notes.faces,
        triangles: made.notes.triangles,
        subpolygons: made.subpolygons,
        patches: traced.faces().len(),
        degrees,
        control_points: traced.faces().iter().map(|patch| patch.patch.control_points().len()).sum(),
        triangular: made.triangular.map(|TriangularCounts { patches, control_points, bytes }| Triangular {
            patches,
            control_points,
            bytes,
        }),
        cells: cells.clone().count(),
        certified_error: cells.map(|exact| exact.error()).fold(0.0, f64::max),
        lattice: lattices.first().copied(),
        lattices,
        closed: traced.shell.topology().is_closed(),
        injective: folds.iter().all(|(injective, _)| *injective),
        fold_overs: folds.iter().map(|(_, fold_overs)| fold_overs).sum(),
        bounds: bounds_of(traced.faces(), TIGHTNESS).map(|corner| corner.to_array()),
        bytes: traced.shell.bytes(),
        notes: made
            .notes
            .to_string()
            .lines()
            .skip(1)
            .map(str::to_owned)
            .chain(made.warnings.clone())
            .collect(),
    }
}

/// Whether the volume is proved to be locally one to one in all knot boxes that hold a piece of the object, and in how
/// many of them it folds over.
fn folds(built: &BuiltLattice) -> (bool, usize) {
    let found = orientations(&built.volume, built.knot_boxes.iter());
    let injective = found.iter().all(|&orientation| orientation == Orientation::Positive);
    let fold_overs = found.iter().filter(|&&orientation| orientation == Orientation::FoldsOver).count();
    (injective, fold_overs)
}

fn table(info: &Info) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        // writing to a string cannot fail
        let _ = writeln!(text, "{name:<18}{value}");
    };
    for object in &info.objects {
        line("object", object.name.clone());
        line("  method", object.method.clone());
        line("  input", format!("{} faces, {} triangles", object.faces, object.triangles));
        line("  sub-polygons", object.subpolygons.to_string());
        let degrees: Vec<_> =
            object.degrees.iter().map(|(degree, count)| format!("{count} of {degree}")).collect();
        line("  patches", format!("{} ({})", object.patches, degrees.join(", ")));
        line("  control points", object.control_points.to_string());
        if let Some(Triangular { patches, control_points, bytes }) = object.triangular {
            line(
                "  triangular",
                format!(
                    "{patches} patches, {control_points} control points, {bytes} bytes before conversion"
                ),
            );
        }
        if object.cells > 0 {
            let error = object.certified_error;
            line(
                "  cells",
                format!("{}, their patches within {error:.1e} of the surface, proved", object.cells),
            );
        }
        for Lattice { degree: [ku, kv, kw], points: [nu, nv, nw] } in &object.lattices {
            line("  lattice", format!("degree {ku} x {kv} x {kw}, {nu} x {nv} x {nw} control points"));
        }
        if object.lattice.is_some() {
            let folds = match (object.injective, object.fold_overs) {
                (true, _) => "yes, proved".to_owned(),
                (false, 0) => "not proved: the Jacobian determinant comes close to 0".to_owned(),
                (false, count) => format!("no: folds over in {count} knot boxes"),
            };
            line("  injective", folds);
        }
        line("  closed", if object.closed { "yes" } else { "no" }.to_owned());
        let [low, high] = object.bounds.map(|p| format!("({:.6}, {:.6}, {:.6})", p[0], p[1], p[2]));
        line("  bounds", format!("{low} to {high}"));
        line("  memory", format!("{} bytes", object.bytes));
        for note in &object.notes {
            line("  note", note.clone());
        }
    }
    line("acceleration", info.accel.to_string());
    let Sample { from, rays, hits, per_ray } = &info.sample;
    let source = if *from == "camera" { "of the camera" } else { "along random lines" };
    line("sample", format!("{rays} rays {source}, {hits} hits; per ray:"));
    for (name, count) in per_ray {
        line(&format!("  {}", readable(name)), format!("{count:.6}"));
    }
    let Seconds { load, subdivide, compose, build } = info.seconds;
    line(
        "seconds",
        format!("load {load:.4}, subdivide {subdivide:.4}, compose {compose:.4}, build {build:.4}"),
    );
    line("memory", format!("{} bytes", info.bytes));
    text
}
