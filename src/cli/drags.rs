//! `trimray drags`.

use std::fmt::Write;

use anyhow::Context;
use clap::Args;
use serde::Serialize;

use trimray::export::to_json;
use trimray::manipulate::CONSISTENT;
use trimray::model::{BuiltLattice, DragReport, DragUsing, ObjectReport};
use trimray::scene::{BuiltScene, SceneDescription};

use super::{CliError, SceneArgs, print_result};

#[derive(Debug, Args)]
#[command(after_help = "Example: trimray drags scenes/hu_fig03.toml")]
pub(super) struct DragsArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Drags {
    objects: Vec<ObjectDrags>,
}

#[derive(Debug, Serialize)]
struct ObjectDrags {
    name: String,
    edits: Vec<EditDrags>,
}

/// One edit of an object's lattice.
#[derive(Debug, Serialize)]
struct EditDrags {
    /// Number of the deformation.
    deform: usize,
    edit: usize,
    using: &'static str,
    equations: usize,
    rank: usize,
    condition: f64,
    objective: f64,
    drags: Vec<OneDrag>,
    control_points: Vec<MovedPoint>,
    weights: Vec<ChangedWeight>,
}

#[derive(Debug, Serialize)]
struct OneDrag {
    drag: usize,
    source: [f64; 3],
    target: [f64; 3],
    before: [f64; 3],
    reached: [f64; 3],
    residual: f64,
    /// The displacement of the single-point move of the decomposition.
    decomposed: Option<[f64; 3]>,
}

#[derive(Debug, Serialize)]
struct MovedPoint {
    index: [usize; 3],
    by: [f64; 3],
}

#[derive(Debug, Serialize)]
struct ChangedWeight {
    index: [usize; 3],
    weight: f64,
}

pub(super) fn run(args: &DragsArgs) -> Result<(), CliError> {
    let scene = args.scene.parse()?;
    let built = args.scene.build(&scene, args.json)?;
    print_result(&if args.json { json(&scene, &built)? } else { table(&gather(&scene, &built)) })
}

/// What `--json` prints of a scene that is built already.
pub(super) fn json(scene: &SceneDescription, built: &BuiltScene) -> Result<String, CliError> {
    let drags = gather(scene, built);
    Ok(String::from_utf8(to_json(&drags).context("the JSON")?).context("the JSON")?)
}

/// A line for each edit whose drags are not met, for a compromise was asked for.
pub(super) fn compromises(object: &ObjectReport) -> Vec<String> {
    let of_lattice = |built: &BuiltLattice| {
        let [low, high] = built.lattice.bounds();
        let tolerance = 10.0 * CONSISTENT * (high - low).length();
        let line = |report: &DragReport| {
            let worst = report.drags.iter().map(|drag| drag.residual).fold(0.0, f64::max);
            (worst > tolerance).then(|| {
                format!("edit {}: the drags are a compromise, off by up to {worst:.3e}", report.edit)
            })
        };
        built.drags.iter().filter_map(line).collect::<Vec<_>>()
    };
    object.lattices.iter().flat_map(of_lattice).collect()
}

fn gather(scene: &SceneDescription, built: &BuiltScene) -> Drags {
    let objects = scene.objects.iter().zip(&built.objects);
    let of_object = |(object, made): (&trimray::scene::ObjectDescription, &ObjectReport)| ObjectDrags {
        name: object.name.value.clone(),
        edits: made
            .lattices
            .iter()
            .flat_map(|built| built.drags.iter().map(|report| of_edit(built.deformer, report)))
            .collect(),
    };
    Drags { objects: objects.map(of_object).collect() }
}

fn of_edit(deform: usize, report: &DragReport) -> EditDrags {
    EditDrags {
        deform,
        edit: report.edit,
        using: match report.using {
            DragUsing::Points => "points",
            DragUsing::Weights { .. } => "weights",
        },
        equations: report.equations,
        rank: report.rank,
        condition: report.condition,
        objective: report.objective,
        drags: (1..)
            .zip(&report.drags)
            .map(|(number, drag)| OneDrag {
                drag: number,
                source: drag.source.to_array(),
                target: drag.target.to_array(),
                before: drag.before.to_array(),
                reached: drag.reached.to_array(),
                residual: drag.residual,
                decomposed: drag.decomposed.map(|by| by.to_array()),
            })
            .collect(),
        control_points: report
            .moves
            .iter()
            .map(|&(index, by)| MovedPoint { index, by: by.to_array() })
            .collect(),
        weights: report.weights.iter().map(|&(index, weight)| ChangedWeight { index, weight }).collect(),
    }
}

fn table(drags: &Drags) -> String {
    let mut text = String::new();
    let place = |p: [f64; 3]| format!("({:.6}, {:.6}, {:.6})", p[0], p[1], p[2]);
    // writing to memory does not fail
    for object in &drags.objects {
        let _ = writeln!(text, "{}", object.name);
        if object.edits.is_empty() {
            let _ = writeln!(text, "  no drags");
        }
        for edit in &object.edits {
            let _ = writeln!(
                text,
                "  edit {}, {}: rank {} of {}, condition {:.3}, sum of squared changes {:.6e}",
                edit.edit, edit.using, edit.rank, edit.equations, edit.condition, edit.objective
            );
            for drag in &edit.drags {
                let _ = writeln!(
                    text,
                    "    drag {}: {} to {}, reached {}, off by {:.1e}",
                    drag.drag,
                    place(drag.source),
                    place(drag.target),
                    place(drag.reached),
                    drag.residual
                );
                if let Some(by) = drag.decomposed {
                    let _ = writeln!(text, "      alone, in the decomposition: by {}", place(by));
                }
            }
            for moved in &edit.control_points {
                let _ = writeln!(text, "    control point {:?} moves by {}", moved.index, place(moved.by));
            }
            for changed in &edit.weights {
                let _ = writeln!(text, "    weight {:?} becomes {:.6}", changed.index, changed.weight);
            }
        }
    }
    text
}
