//! `transform` and `to_world`: lists of steps, composed to one affine map.

use glam::{DAffine3, DMat3, DVec3};

use super::reader::{Table, Value};
use crate::math::angle::sin_cos_deg;
use crate::math::linear::unit_vector;

/// The kinds of step.
const STEPS: &[&str] = &["scale", "rotate", "translate", "matrix", "look_at"];

/// Volume of the parallelepiped of three unit vectors below which they count as flat.
///
/// A determinant of entries of size 1 has a rounding error of a few ulp, so that a matrix of lower
/// rank shows up to about this much. A smaller value lets such matrices pass; no useful transform
/// comes near it.
const FLAT: f64 = 16.0 * f64::EPSILON;

/// The map that the steps under `key` compose to, first step first; the identity without any.
pub(super) fn read(table: &Table<'_>, key: &str) -> Option<DAffine3> {
    let expected = "a list of steps, such as [ { scale = 2.0 }, { translate = [0, 0, 1] } ]";
    let Some(value) = table.value(key) else {
        return Some(DAffine3::IDENTITY);
    };
    let steps = value.accept(key, expected, value.elements())?;
    let steps: Vec<_> = steps.map(|step| read_step(key, step)).collect();
    let steps: Option<Vec<DAffine3>> = steps.into_iter().collect();
    let composed = steps?.into_iter().fold(DAffine3::IDENTITY, |before, step| step * before);
    if !composed.is_finite() || !composed.inverse().is_finite() || is_flat(composed.matrix3) {
        value.report(format!("the steps of {key} together cannot be inverted in double precision"));
        return None;
    }
    Some(composed)
}

fn read_step(key: &str, step: Value<'_>) -> Option<DAffine3> {
    let expected = "a list of steps, each a table such as { scale = 2.0 }";
    let mut table = step.accept(key, expected, step.table("a transform step"))?;
    table.check_keys(STEPS);
    let kinds: Vec<_> = STEPS.iter().filter(|kind| table.has(kind)).collect();
    match kinds.as_slice() {
        [] => {
            if !STEPS.iter().any(|kind| table.is_excused(kind)) {
                table.report(format!("a transform step needs one of {}", STEPS.join(", ")));
            }
            None
        }
        [kind] => match **kind {
            "scale" => scale(&table),
            "rotate" => rotate(&table),
            "translate" => table
                .required("translate", "[x, y, z] of finite numbers", Value::vector)
                .map(DAffine3::from_translation),
            "matrix" => matrix(&table),
            _ => look_at(&table),
        },
        [first, second, ..] => {
            table.report_key(
                second,
                format!("a transform step does one thing, not {first} and {second}: write two steps"),
            );
            None
        }
    }
}

fn scale(table: &Table<'_>) -> Option<DAffine3> {
    let expected = "a number or [x, y, z], without 0 (which would flatten)";
    table.required("scale", expected, |value| value.rgb(|factor| factor != 0.0)).map(DAffine3::from_scale)
}

fn rotate(table: &Table<'_>) -> Option<DAffine3> {
    let expected = "a table { axis = [x, y, z], angle = degrees }";
    let mut rotate = table.required("rotate", expected, |value| value.table("rotate"))?;
    rotate.check_keys(&["axis", "angle"]);
    let axis = rotate.required("axis", "[x, y, z] of finite numbers", Value::vector);
    let angle = rotate.required("angle", "a finite number of degrees", Value::number);
    let Some(unit) = unit_vector(axis?) else {
        rotate.report_value("axis", "axis must not be [0, 0, 0]".to_owned());
        return None;
    };
    Some(DAffine3::from_mat3(rotation(unit, angle?)))
}

/// The rotation by degrees about a unit axis, by the right-hand rule (Rodrigues).
fn rotation(axis: DVec3, angle: f64) -> DMat3 {
    let (sin, cos) = sin_cos_deg(angle);
    let turn = |v: DVec3| v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos));
    DMat3::from_cols(turn(DVec3::X), turn(DVec3::Y), turn(DVec3::Z))
}

fn matrix(table: &Table<'_>) -> Option<DAffine3> {
    let expected = "16 finite numbers, row by row";
    let rows: [f64; 16] = table.required("matrix", expected, |value| value.array(Value::number))?;
    if rows[12..] != [0.0, 0.0, 0.0, 1.0] {
        let message = "matrix must be affine: its last row is 0, 0, 0, 1";
        table.report_value("matrix", message.to_owned());
        return None;
    }
    let column = |j: usize| DVec3::new(rows[j], rows[4 + j], rows[8 + j]);
    let linear = DMat3::from_cols(column(0), column(1), column(2));
    if is_flat(linear) {
        let message = "matrix is singular (its determinant is 0): it would flatten";
        table.report_value("matrix", message.to_owned());
        return None;
    }
    Some(DAffine3::from_mat3_translation(linear, column(3)))
}

/// Mitsuba's `look_at`: z goes to the view direction, y to the side of `up`.
fn look_at(table: &Table<'_>) -> Option<DAffine3> {
    let expected = "a table { origin = [x, y, z], target = [x, y, z], up = [x, y, z] }";
    let mut look_at = table.required("look_at", expected, |value| value.table("look_at"))?;
    look_at.check_keys(&["origin", "target", "up"]);
    let view = read_view(&look_at)?;
    let z = unit_vector(view.target - view.origin)?;
    let x = unit_vector(view.up)?.cross(z).normalize();
    Some(DAffine3::from_mat3_translation(DMat3::from_cols(x, z.cross(x), z), view.origin))
}

/// A place to look from, one to look at and the direction that is up.
pub(super) struct View {
    pub(super) origin: DVec3,
    pub(super) target: DVec3,
    pub(super) up: DVec3,
}

/// Sine of the angle between `up` and the view direction below which there is no telling how the
/// view is turned: rounding then decides more than 1e-6 of it.
const PARALLEL: f64 = 1e-10;

/// Reads `origin`, `target` and `up`, and checks that they make a frame.
pub(super) fn read_view(table: &Table<'_>) -> Option<View> {
    let place = "a point [x, y, z] of finite numbers";
    let origin = table.required("origin", place, Value::vector);
    let target = table.required("target", place, Value::vector);
    let expected_up = "a direction [x, y, z] of finite numbers";
    let given_up = table.optional("up", expected_up, Value::vector);
    let up = given_up.unwrap_or(DVec3::Z);
    let Some(unit_up) = unit_vector(up) else {
        table.report_value("up", "up must not be [0, 0, 0]".to_owned());
        return None;
    };
    let (origin, target) = (origin?, target?);
    if origin == target {
        let message = "target must differ from origin: nothing looks at itself";
        table.report_value("target", message.to_owned());
        return None;
    }
    let Some(forward) = unit_vector(target - origin) else {
        let message = "target is too far from origin for double precision";
        table.report_value("target", message.to_owned());
        return None;
    };
    if unit_up.cross(forward).length() < PARALLEL {
        let [x, y, z] = up.to_array();
        let default = if given_up.is_some() { "" } else { " (the default)" };
        table.report_value(
            if given_up.is_some() { "up" } else { "target" },
            format!("up [{x}, {y}, {z}]{default} must not be parallel to the view direction"),
        );
        return None;
    }
    Some(View { origin, target, up })
}

/// Whether the columns lie in a plane, up to rounding.
fn is_flat(matrix: DMat3) -> bool {
    let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(unit_vector);
    match columns {
        [Some(x), Some(y), Some(z)] => x.cross(y).dot(z).abs() <= FLAT,
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn right_angles_are_exact() {
        for (angle, sin_cos) in [
            (0.0, (0.0, 1.0)),
            (90.0, (1.0, 0.0)),
            (180.0, (0.0, -1.0)),
            (270.0, (-1.0, 0.0)),
            (-90.0, (-1.0, 0.0)),
            (360.0, (0.0, 1.0)),
            (3690.0, (1.0, 0.0)),
        ] {
            assert_eq!(sin_cos_deg(angle), sin_cos, "angle {angle}");
        }
        for step in -100..100 {
            let angle = f64::from(step) * 7.3;
            let (sin, cos) = sin_cos_deg(angle);
            let (want_sin, want_cos) = angle.to_radians().sin_cos();
            assert!((sin - want_sin).abs() < 1e-14, "angle {angle}");
            assert!((cos - want_cos).abs() < 1e-14, "angle {angle}");
        }
    }

    #[test]
    fn rotations_turn_right_handed() {
        let turned = rotation(DVec3::Z, 90.0) * DVec3::X;
        assert_eq!(turned, DVec3::Y);
    }

    #[test]
    fn matrices_of_lower_rank_are_flat() {
        let matrix = DMat3::from_cols_array(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
        assert!(is_flat(matrix));
        assert!(is_flat(DMat3::ZERO));
        assert!(!is_flat(DMat3::from_diagonal(DVec3::new(1.0, 1e-150, 1e150))));
    }
}
