//! Objects of many patches.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use trimray::spline::MAX_VOLUME_DEGREE;
use trimray::trace::TracedScene;

use crate::Arguments;
use crate::common::objects::{Built, Object, each_object};
use crate::common::rays::{random_sets, ray_sets};
use crate::common::timing::{TraceWay, closest_rate, seconds_of_threads, trace_packets, trace_single};
use crate::report::{Report, by, per_ray_json, per_ray_text};

/// Balls of 8 n² triangles: nearly powers of ten.
const GROWTH: [u32; 6] = [1, 4, 11, 35, 112, 354];

/// The greatest of them with `--quick`.
const QUICK_GROWTH: usize = 4;

/// The ball of the degrees.
const DEGREE_BALL: u32 = 11;

const COLUMNS: &str = "volume  triangles   patches    leaves      MB  B/patch  subdivide   compose structure \
                       | all random hit random | of a hit ray";

/// Patches of one shape, more and more of them.
pub(crate) fn growth(arguments: &Arguments, report: Report) -> Result<(), String> {
    report.heading("growth: a ball, rates in Mrays/s, times in ms", COLUMNS);
    let kinds = if arguments.quick { &GROWTH[..QUICK_GROWTH] } else { &GROWTH };
    for &fineness in kinds {
        // one knot box, so that each triangle is one patch
        whole_object(arguments, report, "growth", &Object::ball(fineness, 2, 3)?)?;
    }
    Ok(())
}

/// One mesh under volumes of every degree.
pub(crate) fn degree(arguments: &Arguments, report: Report) -> Result<(), String> {
    report.heading("degree: a ball, 6 x 6 x 6 control points, rates in Mrays/s, times in ms", COLUMNS);
    for degree in 1..=MAX_VOLUME_DEGREE {
        whole_object(arguments, report, "degree", &Object::ball(DEGREE_BALL, degree, 6)?)?;
    }
    Ok(())
}

/// Builds an object and traces random rays.
fn whole_object(arguments: &Arguments, report: Report, bench: &str, object: &Object) -> Result<(), String> {
    let builds = match object.triangles.len() {
        0..20_000 => 7,
        20_000..200_000 => 3,
        _ => 1,
    };
    let Built { scene, times, bytes } = object.build_least(builds)?;
    let count = if arguments.quick { 1 << 13 } else { 1 << 16 };
    let [all, hits] = random_sets(&object.subject, &scene, count);
    let [all_rate, hit_rate] =
        [&all, &hits].map(|set| closest_rate(&scene, &set.rays, arguments.rounds(), trace_single) * 1e-6);
    let mut tracer = scene.tracer();
    for ray in &hits.rays {
        tracer.closest(&ray.ray());
    }
    let counted = tracer.statistics();
    let patches = scene.objects()[0].faces().len();
    let structure = scene.acceleration();
    let volume = object.volume.degree();
    report.row(
        &json!({
            "bench": bench, "volume_degree": volume, "triangles": object.triangles.len(), "patches": patches,
            "degrees": degrees(&scene), "accel": structure, "bytes": bytes,
            "seconds": { "subdivide": times.subdivide, "compose": times.compose, "structure": times.structure },
            "all_random_mrays_per_second": all_rate, "hit_random_mrays_per_second": hit_rate,
            "hit_random_per_ray": per_ray_json(&counted),
        }),
        &format!(
            "{:<7} {:>9} {patches:>9} {:>9} {:>7.2} {:>8.0} {:>10.2} {:>9.2} {:>9.2} | {all_rate:>10.3} {hit_rate:>10.3} | {}",
            by(&volume),
            object.triangles.len(),
            structure.leaves,
            bytes as f64 * 1e-6,
            bytes as f64 / patches as f64,
            times.subdivide * 1e3,
            times.compose * 1e3,
            times.structure * 1e3,
            per_ray_text(&counted)
        ),
    );
    if !report.json && bench == "degree" {
        println!("        {}", degrees_text(&scene));
    }
    Ok(())
}

/// How many patches there are of each degree.
fn degrees(scene: &TracedScene) -> BTreeMap<String, usize> {
    let mut found = BTreeMap::new();
    for trimmed in scene.objects()[0].faces() {
        *found.entry(by(&trimmed.patch.degree())).or_default() += 1;
    }
    found
}

fn degrees_text(scene: &TracedScene) -> String {
    let parts: Vec<_> = degrees(scene).iter().map(|(degree, count)| format!("{count} of {degree}")).collect();
    format!("patches: {}", parts.join(", "))
}

/// The objects and rays of the benchmark beside Embree.
pub(crate) fn objects(arguments: &Arguments, report: Report) -> Result<(), String> {
    each_object(arguments.object.as_deref(), arguments.mesh.as_deref(), |object| {
        one_object(arguments, report, object)
    })
}

fn one_object(arguments: &Arguments, report: Report, object: &Object) -> Result<(), String> {
    let Built { scene, times, bytes } = object.build_least(7)?;
    let structure = scene.acceleration();
    report.heading(
        &format!("object {}: {}", object.subject.name, object.subject.description),
        &format!(
            "{} patches, {} leaves ({} inside the trim), {:.3} MB, built in {:.2} ms\nrays             number   single  packets  two threads   per ray",
            scene.objects()[0].faces().len(),
            structure.leaves,
            structure.leaves_inside,
            bytes as f64 * 1e-6,
            times.total() * 1e3
        ),
    );
    let built = json!({
        "patches": scene.objects()[0].faces().len(), "accel": structure, "bytes": bytes, "seconds": times.total(),
    });
    let (width, random) = if arguments.quick { (256, 1 << 14) } else { (1024, 1 << 18) };
    for set in ray_sets(&object.subject, &scene, width, random) {
        if set.rays.is_empty() {
            continue;
        }
        let [single, packets] = [trace_single as TraceWay, trace_packets]
            .map(|way| closest_rate(&scene, &set.rays, arguments.rounds(), way) * 1e-6);
        let threads = [1, 2].map(|threads| {
            let way: TraceWay = if packets > single { trace_packets } else { trace_single };
            seconds_of_threads(&scene, &set.rays, (arguments.rounds(), threads), way)
        });
        let mut tracer = scene.tracer();
        let hits = set.rays.iter().filter(|ray| tracer.closest(&ray.ray()).is_some()).count();
        let counted = tracer.statistics();
        let json: Value = json!({
            "bench": "objects", "object": object.subject.name, "built": built, "rays": set.kind, "hits_only": set.hits_only,
            "number": set.rays.len(), "hits": hits, "mrays_per_second": single, "packets_mrays_per_second": packets,
            "two_threads": threads[0] / threads[1], "per_ray": per_ray_json(&counted),
        });
        let text = format!(
            "{:<13} {:>9} {single:>8.3} {packets:>8.3} {:>8.2}   {}",
            set.name(),
            set.rays.len(),
            threads[0] / threads[1],
            per_ray_text(&counted)
        );
        report.row(&json, &text);
        if set.kind == "primary" && !set.hits_only {
            let seconds = times.total() + threads[1];
            let json = json!({"bench": "first image", "object": object.subject.name, "rays": set.rays.len(), "seconds": seconds});
            report.row(
                &json,
                &format!(
                    "first image of {} rays: build and two threads' rays {:.1} ms",
                    set.rays.len(),
                    seconds * 1e3
                ),
            );
        }
    }
    Ok(())
}
