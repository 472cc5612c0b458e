//! `surface` of an object.

use glam::DVec3;

use crate::scene::reader::{Converted, Table, Value};
use crate::surface::{Shape, SplineSurface, SurfaceError, clamped_knots};

const KINDS: [&str; 8] = ["bezier", "bspline", "nurbs", "plane", "sphere", "cylinder", "cone", "torus"];

const POINT: &str = "a point [x, y, z] of finite numbers";
const VECTOR: &str = "[x, y, z] of finite numbers";
const LENGTH: &str = "a number above 0";

/// Reads and checks a surface.
pub(super) fn read(mut table: Table<'_>) -> Option<SplineSurface> {
    let kind = table.required_name("type", "surface type", &KINDS)?;
    let keys: &[&'static str] = match kind {
        "bezier" => &["degree", "points", "weights"],
        "bspline" | "nurbs" => &["degree", "points", "size", "knots_u", "knots_v", "weights"],
        "plane" => &["origin", "u", "v"],
        "sphere" => &["center", "radius"],
        "cylinder" | "cone" => &["origin", "axis", "radius"],
        _ => &["center", "axis", "major_radius", "minor_radius"],
    };
    table.check_keys(&[&["type", "domain"], keys].concat());
    let made = match kind {
        "bezier" => read_bezier(&table)?,
        "bspline" | "nurbs" => read_spline(&table)?,
        _ => read_shape(&table, kind)?.surface(),
    };
    let bounds = |value: Value<'_>| value.array(|axis| axis.array(Value::number));
    let domain = table.optional("domain", "[[u0, u1], [v0, v1]] of finite numbers", bounds);
    let made = match domain {
        Some(domain) => made.and_then(|surface| surface.restricted(domain)),
        None => made,
    };
    made.map_err(|error| table.report(error.to_string())).ok()
}

fn read_bezier(table: &Table<'_>) -> Option<Result<SplineSurface, SurfaceError>> {
    let degree = read_degree(table);
    let (points, weights) = read_points(table);
    Some(SplineSurface::bezier(degree?, &points?, &weights?))
}

fn read_spline(table: &Table<'_>) -> Option<Result<SplineSurface, SurfaceError>> {
    let degree = read_degree(table);
    let size: Option<[usize; 2]> =
        table.required("size", "[nu, nv], the control points along u and v", |value| {
            value.array(|count| count.integer(2..=1 << 20))
        });
    let (points, weights) = read_points(table);
    let knots = [("knots_u", 0), ("knots_v", 1)].map(|(key, axis)| {
        let given = table.optional(key, "a list of numbers that do not fall", numbers);
        match given {
            Some(knots) => Some(knots),
            None if table.has(key) => None,
            None => Some(clamped_knots(degree?[axis], size?[axis])),
        }
    });
    let [knots_u, knots_v] = knots;
    let (degree, size, knots) = (degree?, size?, [knots_u?, knots_v?]);
    for (axis, name) in [(0, "knots_u"), (1, "knots_v")] {
        let want = size[axis] + degree[axis] + 1;
        if knots[axis].len() != want {
            let message = format!(
                "{name} has {} knots, but {} control points of degree {} need {want}",
                knots[axis].len(),
                size[axis],
                degree[axis]
            );
            table.report_value(name, message);
            return None;
        }
    }
    Some(SplineSurface::try_new(degree, knots, &points?, &weights?))
}

fn read_shape(table: &Table<'_>, kind: &str) -> Option<Shape> {
    let point = |key| table.required(key, POINT, Value::vector);
    let center =
        || table.optional("center", POINT, Value::vector).or((!table.has("center")).then_some(DVec3::ZERO));
    let axis = || table.optional("axis", VECTOR, Value::vector).or((!table.has("axis")).then_some(DVec3::Z));
    let origin =
        || table.optional("origin", POINT, Value::vector).or((!table.has("origin")).then_some(DVec3::ZERO));
    let length = |key| table.required(key, LENGTH, |value| value.number_where(|length| length > 0.0));
    Some(match kind {
        "plane" => {
            let (u, v) = (point("u"), point("v"));
            Shape::Plane { origin: origin()?, u: u?, v: v? }
        }
        "sphere" => {
            let radius = length("radius");
            Shape::Sphere { center: center()?, radius: radius? }
        }
        "cylinder" => {
            let radius = length("radius");
            Shape::Cylinder { origin: origin()?, axis: axis()?, radius: radius? }
        }
        "cone" => {
            let radius = length("radius");
            Shape::Cone { origin: origin()?, axis: axis()?, radius: radius? }
        }
        _ => {
            let (major, minor) = (length("major_radius"), length("minor_radius"));
            Shape::Torus { center: center()?, axis: axis()?, major_radius: major?, minor_radius: minor? }
        }
    })
}

fn read_degree(table: &Table<'_>) -> Option<[usize; 2]> {
    table.required("degree", "[degree along u, along v], each from 1 to 12", |value| {
        value.array(|degree| degree.integer(1..=12))
    })
}

/// Control points, and weights if there are any.
fn read_points(table: &Table<'_>) -> (Option<Vec<DVec3>>, Option<Vec<f64>>) {
    let points = table.required("points", "[[x, y, z], …], along v first", |value| {
        value.elements()?.map(Value::vector).collect()
    });
    let weights = table.optional("weights", "a list of numbers above 0, one for each point", numbers);
    let weights = if table.has("weights") { weights } else { Some(Vec::new()) };
    (points, weights)
}

fn numbers(value: Value<'_>) -> Converted<Vec<f64>> {
    value.elements()?.map(Value::number).collect()
}
