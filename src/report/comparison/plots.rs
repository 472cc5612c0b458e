//! Errors of the methods against what they cost.

use super::is_exact;
use crate::compare::MethodFigures;
use crate::model::Representation;
use crate::report::numbers::scientific;
use crate::report::page::Html;
use crate::report::plot::{Axis, Curve, Level, Plot, Point, plot};

const TRIANGLES: Axis = Axis { label: "triangles", is_bytes: false };
const SECONDS: Axis = Axis { label: "seconds to build and render", is_bytes: false };
const BYTES: Axis = Axis { label: "memory as traced", is_bytes: true };
const DEVIATION: Axis = Axis { label: "greatest deviation / diagonal", is_bytes: false };
const SILHOUETTE: Axis = Axis { label: "greatest silhouette error in pixels", is_bytes: false };
const FLIP: Axis = Axis { label: "mean LDR-FLIP (0 … 1)", is_bytes: false };

type Figure = fn(&MethodFigures) -> f64;

/// All plots of a scene.
pub(super) fn plots(methods: &[MethodFigures]) -> Result<Vec<Html>, String> {
    let deviation: Figure = |method| method.deviation.map_or(f64::NAN, |deviation| deviation.max);
    let silhouette: Figure = |method| method.silhouette.map_or(f64::NAN, |silhouette| silhouette.max);
    let flip: Figure = |method| method.image.as_ref().map_or(f64::NAN, |image| image.flip);
    let triangles: Figure = |method| method.triangles as f64;
    let exact = methods.iter().find(|method| is_exact(method) && !method.noise);
    let rounding =
        |x: Figure| exact.map(|exact| Level { name: "exact", y: deviation(exact), at: Some(x(exact)) });
    let noise = methods.iter().find(|method| method.noise);
    let noise = noise.map(|noise| Level { name: "noise (exact, other seed)", y: flip(noise), at: None });
    let against = |title, axes, [x, y]: [Figure; 2], level| {
        plot(&Plot { title, axes, curves: curves(methods, x, y), level })
    };
    let (seconds, bytes): (Figure, Figure) = (|method| method.seconds, |method| method.bytes as f64);
    Ok(vec![
        against(
            "Deviation against triangles",
            [TRIANGLES, DEVIATION],
            [triangles, deviation],
            rounding(triangles),
        )?,
        against("Deviation against time", [SECONDS, DEVIATION], [seconds, deviation], rounding(seconds))?,
        against("Deviation against memory", [BYTES, DEVIATION], [bytes, deviation], rounding(bytes))?,
        // of the exact silhouette there is no error to draw: it is the reference
        against("Silhouette against triangles", [TRIANGLES, SILHOUETTE], [triangles, silhouette], None)?,
        against("FLIP against triangles", [TRIANGLES, FLIP], [triangles, flip], noise)?,
    ])
}

/// From coarse to fine.
fn curves(methods: &[MethodFigures], x: Figure, y: Figure) -> Vec<Curve> {
    let curve = |name, parameter: fn(Representation) -> Option<(f64, String)>| {
        let found = methods.iter().filter_map(|method| Some((parameter(method.kind)?, method)));
        let mut found: Vec<_> = found.collect();
        found.sort_by(|((a, _), _), ((b, _), _)| a.total_cmp(b));
        let point = |((_, label), method): ((f64, String), &MethodFigures)| Point {
            x: x(method),
            y: y(method),
            label,
        };
        Curve { name, points: found.into_iter().map(point).collect() }
    };
    vec![
        curve("pointwise", |kind| kind.level().map(|level| (f64::from(level), level.to_string()))),
        curve("adaptive", |kind| {
            kind.tolerance().map(|tolerance| (-tolerance, scientific(tolerance).replace(".0e", "e")))
        }),
    ]
}
