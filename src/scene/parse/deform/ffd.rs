//! `[[object.deform]]` of type "ffd", and its edits.

use glam::{DVec2, DVec3};

use crate::choice::Choice;
use crate::model::{DragUsing, Edit, Lattice, MoveTo};
use crate::scene::description::{Block, DeformDescription, DragPlaces, EditDescription};
use crate::scene::diagnostic::Located;
use crate::scene::reader::{Converted, Table, Value};
use crate::spline::{Axis, KnotError, KnotLayout, KnotVector, MAX_VOLUME_DEGREE, SignedAxis};

/// Most control points of a lattice. At 32 bytes each they take half a gigabyte; the patches that
/// so fine a lattice cuts a mesh into take far more.
pub const MAX_CONTROL_POINTS: usize = 1 << 24;

/// Least weight after a drag, in parts of the least one before.
const DEFAULT_MIN_WEIGHT: f64 = 1e-3;

/// Highest degree along an axis.
const MAX_DEGREE: usize = MAX_VOLUME_DEGREE;

const AXES: [char; 3] = ['x', 'y', 'z'];

pub(super) const KEYS: &[&str] =
    &["type", "degree", "points", "basis", "knots", "bounds", "outside", "hold", "frame", "edit"];

/// Reads and checks a deformation.
pub(super) fn read(mut table: Table<'_>) -> Option<DeformDescription> {
    table.check_keys(KEYS);
    let (degree, points) = read_sizes(&table);
    let knots = read_knots(&table, degree, points);
    let bounds = read_bounds(&table);
    let outside = table.choice("outside");
    let hold = table
        .optional("hold", "an integer of at least 0", |value| value.integer(0..=MAX_CONTROL_POINTS as i128));
    let frame = table.choice("frame");
    let limits = Limits { points, hold: hold.unwrap_or(0) };
    let edits = table.tables("edit", "[[object.deform.edit]]");
    let edits = edits.unwrap_or_default().into_iter();
    let edits = edits.filter_map(|edit| limits.read_edit(edit)).collect();
    let lattice = Lattice {
        bounds,
        knots: knots?,
        outside: outside.unwrap_or_default(),
        hold: limits.hold,
        frame: frame.unwrap_or_default(),
        ..Lattice::new(degree?, points?)
    };
    Some(DeformDescription::Lattice { lattice, edits })
}

/// Degrees and numbers of control points; those of Bernstein's basis belong together.
fn read_sizes(table: &Table<'_>) -> (Option<[usize; 3]>, Option<[usize; 3]>) {
    let is_bezier = table.name_index("basis", "basis", &["bspline", "bezier"]) == Some(1);
    let degrees = format!("three integers from 1 to {MAX_DEGREE}");
    let read_degree = |value: Value<'_>| value.array(|element| element.integer(1..=MAX_DEGREE as i128));
    let degree = match is_bezier {
        true => table.optional("degree", &degrees, read_degree),
        false => table.required("degree", &degrees, read_degree),
    };
    let counts = format!("three integers from 2 to {MAX_CONTROL_POINTS}");
    let points: Option<[usize; 3]> = table.required("points", &counts, |value| {
        value.array(|element| element.integer(2..=MAX_CONTROL_POINTS as i128))
    });
    let Some(of_points) = points.filter(|_| is_bezier).map(|points| points.map(|count| count - 1)) else {
        check_counts(table, degree, points);
        return (degree, points);
    };
    if let Some(axis) = (0..3).find(|&axis| of_points[axis] > MAX_DEGREE) {
        let message = format!(
            "basis = \"bezier\" has one degree less than points, at most {MAX_DEGREE}: {} along {} are too many",
            of_points[axis] + 1,
            AXES[axis]
        );
        table.report_value("points", message);
        return (None, points);
    }
    if degree.is_some_and(|degree| degree != of_points) {
        let message = format!(
            "basis = \"bezier\" has one degree less than points, {of_points:?}; without degree it is that"
        );
        table.report_value("degree", message);
    }
    (Some(of_points), points)
}

/// How the knots lie: by name, or three lists.
fn read_knots(
    table: &Table<'_>,
    degree: Option<[usize; 3]>,
    points: Option<[usize; 3]>,
) -> Option<KnotLayout> {
    let Some(value) = table.value("knots") else { return Some(KnotLayout::Clamped) };
    if !value.is_array() {
        return match table.name_index("knots", "knots", &["clamped", "uniform"])? {
            0 => Some(KnotLayout::Clamped),
            _ => Some(KnotLayout::Uniform),
        };
    }
    let expected = "\"clamped\", \"uniform\" or three lists of finite numbers that do not fall";
    let lists: [Vec<f64>; 3] = table.optional("knots", expected, |value| value.array(numbers))?;
    let (degree, points) = (degree?, points?);
    let mut made = Vec::new();
    for ((axis, list), degree) in lists.into_iter().enumerate().zip(degree) {
        let (got, points) = (list.len(), points[axis]);
        let knots = match got == degree + points + 1 {
            true => KnotVector::try_new(degree, list),
            false => Err(KnotError::Count { got, degree, points }),
        };
        match knots {
            Ok(knots) => made.push(knots),
            Err(error) => table.report_value("knots", format!("knots along {}: {error}", AXES[axis])),
        }
    }
    let axes: Result<[KnotVector; 3], _> = made.try_into();
    axes.ok().map(|axes| KnotLayout::Given(Box::new(axes)))
}

/// A list of numbers.
fn numbers(value: Value<'_>) -> Converted<Vec<f64>> {
    let (mut numbers, mut mismatches) = (Vec::new(), Vec::new());
    for element in value.elements()? {
        match element.number() {
            Ok(number) => numbers.push(number),
            Err(mismatch) => mismatches.extend(mismatch),
        }
    }
    if mismatches.is_empty() { Ok(numbers) } else { Err(mismatches) }
}

fn check_counts(table: &Table<'_>, degree: Option<[usize; 3]>, points: Option<[usize; 3]>) {
    let Some(points) = points else {
        return;
    };
    for (axis, degree) in degree.iter().flatten().enumerate() {
        if points[axis] <= *degree {
            let message = format!(
                "points must be more than the degree along each axis: {} along {}, where the degree is {degree}",
                points[axis], AXES[axis]
            );
            table.report_value("points", message);
        }
    }
    let total = points.iter().try_fold(1_usize, |total, count| total.checked_mul(*count));
    if total.is_none_or(|total| total > MAX_CONTROL_POINTS) {
        let message = format!("points {points:?} make more than {MAX_CONTROL_POINTS} control points");
        table.report_value("points", message);
    }
}

fn read_bounds(table: &Table<'_>) -> Option<[DVec3; 2]> {
    let expected = "[[x, y, z], [x, y, z]] of finite numbers, the least corner and the greatest";
    let bounds: [DVec3; 2] = table.optional("bounds", expected, |value| value.array(Value::vector))?;
    for axis in 0..3 {
        let [min, max] = bounds.map(|corner| corner[axis]);
        let name = AXES[axis];
        if min >= max {
            let message = format!(
                "bounds are a box with no extent along {name}: {min} to {max}; the least corner comes first"
            );
            table.report_value("bounds", message);
        } else if !(max - min).is_finite() {
            let message = format!("bounds are too large along {name} for double precision");
            table.report_value("bounds", message);
        }
    }
    Some(bounds)
}

/// Kinds of edit, each with the keys beside it.
const EDITS: [(&str, &[&str]); 9] = [
    ("move", &["move", "by", "to"]),
    ("drag", &["drag", "to", "using", "min_weight"]),
    ("pick", &["pick", "to", "using", "min_weight"]),
    ("twist", &["twist"]),
    ("taper", &["taper"]),
    ("bend", &["bend"]),
    ("bulge", &["bulge"]),
    ("weight", &["weight", "value"]),
    ("control_points", &["control_points", "block"]),
];

/// What edits are checked against.
struct Limits {
    points: Option<[usize; 3]>,
    hold: usize,
}

impl Limits {
    fn read_edit(&self, mut table: Table<'_>) -> Option<Located<EditDescription>> {
        let present: Vec<_> = EDITS.iter().filter(|(kind, _)| table.has(kind)).collect();
        let (kind, keys) = match present.as_slice() {
            [] => {
                report_no_kind(table);
                return None;
            }
            [only] => **only,
            [(first, _), (second, _), ..] => {
                let message = format!(
                    "an edit does one thing, not {first} and {second}: write an [[object.deform.edit]] for each"
                );
                table.report_key(second, message);
                table.check_keys(&all_keys());
                return None;
            }
        };
        table.check_keys(keys);
        let location = table.value(kind)?.location();
        let edit = match kind {
            "move" => self.read_move(&table),
            "twist" => read_twist(&table),
            "taper" => read_taper(&table),
            "bend" => read_bend(&table),
            "bulge" => read_bulge(&table),
            "weight" => self.read_weight(&table),
            _ => {
                let value = if kind == "control_points" {
                    let expected = "the path of a .npy, .npz, .xyz, .su2 or .prm file";
                    let path = table.required(kind, expected, Value::path)?;
                    let expected = "the number of a lattice of the file, from 1, or its name";
                    let block = table.optional("block", expected, read_block);
                    EditDescription::ControlPoints { path, block }
                } else {
                    read_drag(&table, kind)?
                };
                return Some(Located { value, location });
            }
        };
        Some(Located { value: EditDescription::Complete(edit?), location })
    }

    fn read_move(&self, table: &Table<'_>) -> Option<Edit> {
        let index = self.read_index(table, "move");
        let vector = "[x, y, z] of finite numbers";
        let by = table.optional("by", vector, Value::vector);
        let to = table.optional("to", vector, Value::vector);
        let to = match (table.has("by"), table.has("to")) {
            (true, true) => {
                let message = "a move has either by (a displacement) or to (a place), not both";
                table.report_key("to", message.to_owned());
                None
            }
            (false, false) => {
                let excused = table.is_excused("by") || table.is_excused("to");
                if !excused {
                    let message = "a move needs by (a displacement [x, y, z]) or to (a place [x, y, z])";
                    table.report_value("move", message.to_owned());
                }
                None
            }
            _ => by.map(MoveTo::By).or(to.map(MoveTo::To)),
        };
        Some(Edit::Move { index: index?, to: to? })
    }

    fn read_weight(&self, table: &Table<'_>) -> Option<Edit> {
        let index = self.read_index(table, "weight");
        let value =
            table.required("value", "a number above 0", |value| value.number_where(|weight| weight > 0.0));
        Some(Edit::Weight { index: index?, value: value? })
    }

    /// The index of a control point that may be edited.
    fn read_index(&self, table: &Table<'_>, key: &str) -> Option<[usize; 3]> {
        let expected = "[i, j, k], the index of a control point, integers of at least 0";
        let index: [usize; 3] = table.required(key, expected, |value| {
            value.array(|element| element.integer(0..=usize::MAX as i128))
        })?;
        let points = self.points?;
        let last = points.map(|count| count - 1);
        if (0..3).any(|axis| index[axis] > last[axis]) {
            let message = format!("control point {index:?} is outside the lattice: the last is {last:?}");
            table.report_value(key, message);
            return None;
        }
        let hold = self.hold;
        if (0..3).any(|axis| index[axis] < hold || last[axis] - index[axis] < hold) {
            let free = if (0..3).all(|axis| 2 * hold < points[axis]) {
                let last_free = last.map(|last| last - hold);
                format!("free are {:?} to {last_free:?}", [hold; 3])
            } else {
                "it leaves none free".to_owned()
            };
            let message = format!("control point {index:?} is held by hold = {hold}: {free}");
            table.report_value(key, message);
            return None;
        }
        Some(index)
    }
}

fn read_block(value: Value<'_>) -> Converted<Block> {
    match value.text() {
        Ok(name) => Ok(Block::Name(name.to_owned())),
        Err(_) => value.integer(1..=i128::from(u32::MAX)).map(Block::Number),
    }
}

/// Points of the object, or of the picture, and where they go.
fn read_drag(table: &Table<'_>, kind: &str) -> Option<EditDescription> {
    let places = "[[x, y, z], …], a point for each, of finite numbers";
    let targets: Option<Vec<[f64; 3]>> = table.required("to", places, list);
    let sources = if kind == "drag" {
        let points: Option<Vec<[f64; 3]>> = table.required("drag", places, list);
        points.map(|points| DragPlaces::Points(points.into_iter().map(DVec3::from_array).collect()))
    } else {
        let pixels: Option<Vec<[f64; 2]>> =
            table.required("pick", "[x, y] in pixels, or a list of such places", list);
        pixels.map(|pixels| DragPlaces::Pixels(pixels.into_iter().map(DVec2::from_array).collect()))
    };
    let using = table.name_index("using", "using", &["points", "weights"]);
    let min_weight = table.optional("min_weight", "a number above 0 and below 1", |value| {
        value.number_where(|weight| weight > 0.0 && weight < 1.0)
    });
    if min_weight.is_some() && using != Some(1) {
        table.report_key("min_weight", "min_weight only stands beside using = \"weights\"".to_owned());
    }
    let using = match using {
        Some(1) => DragUsing::Weights { min_weight: min_weight.unwrap_or(DEFAULT_MIN_WEIGHT) },
        _ => DragUsing::Points,
    };
    let (sources, targets) = (sources?, targets?);
    let count = match &sources {
        DragPlaces::Points(points) => points.len(),
        DragPlaces::Pixels(pixels) => pixels.len(),
    };
    if count != targets.len() || count == 0 {
        let message = format!("{kind} has {count} points, but to has {}: one target for each", targets.len());
        table.report_value("to", message);
        return None;
    }
    let targets = targets.into_iter().map(DVec3::from_array).collect();
    Some(EditDescription::Drag { sources, targets, using })
}

/// A list of vectors, or one of them.
fn list<const N: usize>(value: Value<'_>) -> Converted<Vec<[f64; N]>> {
    let is_list = value.elements()?.next().is_none_or(Value::is_array);
    if !is_list {
        return Ok(vec![value.array(Value::number)?]);
    }
    let (mut vectors, mut mismatches) = (Vec::new(), Vec::new());
    for element in value.elements()? {
        match element.array(Value::number) {
            Ok(vector) => vectors.push(vector),
            Err(mismatch) => mismatches.extend(mismatch),
        }
    }
    if mismatches.is_empty() { Ok(vectors) } else { Err(mismatches) }
}

fn all_keys() -> Vec<&'static str> {
    let mut keys = Vec::new();
    for key in EDITS.iter().flat_map(|(_, keys)| keys.iter().copied()) {
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    keys
}

fn report_no_kind(mut table: Table<'_>) {
    table.check_keys(&all_keys());
    let kinds = EDITS.map(|(kind, _)| kind);
    if !kinds.iter().any(|kind| table.is_excused(kind)) {
        table.report(format!("an edit needs one of {}", kinds.join(", ")));
    }
}

/// The table under an edit's own key, with its keys checked.
fn inner<'a>(
    table: &Table<'a>,
    key: &'static str,
    keys: &[&'static str],
    expected: &str,
) -> Option<Table<'a>> {
    let mut inner = table.required(key, expected, |value| value.table(key))?;
    inner.check_keys(keys);
    Some(inner)
}

fn read_angle(table: &Table<'_>) -> Option<f64> {
    table.required("angle", "a finite number of degrees", Value::number)
}

fn read_twist(table: &Table<'_>) -> Option<Edit> {
    let expected = "a table { axis, angle }";
    let twist = inner(table, "twist", &["axis", "angle"], expected)?;
    let axis = twist.required_choice("axis");
    let angle = read_angle(&twist);
    Some(Edit::Twist { axis: axis?, angle: angle? })
}

fn read_taper(table: &Table<'_>) -> Option<Edit> {
    let expected = "a table { axis, scale }";
    let taper = inner(table, "taper", &["axis", "scale"], expected)?;
    let axis = taper.required_choice("axis");
    let expected = "a finite number, or one for each of the two other axes";
    let scale = taper.required("scale", expected, factors);
    Some(Edit::Taper { axis: axis?, scale: scale? })
}

fn factors(value: Value<'_>) -> Converted<[f64; 2]> {
    if value.is_array() { value.array(Value::number) } else { value.number().map(|factor| [factor; 2]) }
}

fn read_bend(table: &Table<'_>) -> Option<Edit> {
    let expected = "a table { axis, angle, toward }";
    let bend = inner(table, "bend", &["axis", "angle", "toward"], expected)?;
    let axis: Option<Axis> = bend.required_choice("axis");
    let angle = read_angle(&bend);
    let sides = r#"the axis to bend to, such as "x" or "-x""#;
    let toward = bend.required("toward", sides, Value::text);
    let toward = toward.and_then(|text| bend.converted("toward", text.parse::<SignedAxis>()));
    let (axis, toward) = (axis?, toward?);
    if axis == toward.axis {
        let [a, b] = axis.cross_axes().map(Choice::name);
        let name = axis.name();
        let message = format!("toward must be across the axis {name}: one of {a}, -{a}, {b}, -{b}");
        bend.report_value("toward", message);
    }
    Some(Edit::Bend { axis, angle: angle?, toward })
}

fn read_bulge(table: &Table<'_>) -> Option<Edit> {
    let expected = "a table { axis, amount }";
    let bulge = inner(table, "bulge", &["axis", "amount"], expected)?;
    let axis = bulge.required_choice("axis");
    let amount = bulge.required("amount", "a finite number", Value::number);
    Some(Edit::Bulge { axis: axis?, amount: amount? })
}
