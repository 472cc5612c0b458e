//! `[camera]`.

use crate::scene::reader::{Table, Value};
use crate::scene::transform::read_view;
use crate::shade::{CameraSettings, FovAxis, Projection, ThinLens};

/// Mitsuba's: its far clipping plane.
const DEFAULT_FOCUS_DISTANCE: f64 = 1e4;

/// Reads and checks the camera.
pub(super) fn read(mut table: Table<'_>) -> Option<CameraSettings> {
    const VIEW: [&str; 4] = ["type", "origin", "target", "up"];
    const PERSPECTIVE: [&str; 4] = ["fov", "fov_axis", "aperture_radius", "focus_distance"];
    const KINDS: [&str; 3] = ["perspective", "thinlens", "orthographic"];
    let kind = if table.has("type") {
        table.name_index("type", "camera type", &KINDS).map(|index| KINDS[index])
    } else {
        Some("perspective")
    };
    match kind {
        Some("orthographic") => table.check_keys(&[&VIEW[..], &["width"]].concat()),
        _ => table.check_keys(&[&VIEW[..], &PERSPECTIVE].concat()),
    }
    let view = read_view(&table);
    let projection = match kind? {
        "orthographic" => table
            .required("width", "the picture's width in world units, above 0", |value| {
                value.number_where(|width| width > 0.0)
            })
            .map(|width| Projection::Orthographic { width }),
        kind => read_perspective(&table, kind == "thinlens"),
    };
    let (view, projection) = (view?, projection?);
    Some(CameraSettings { origin: view.origin, target: view.target, up: view.up, projection })
}

fn read_perspective(table: &Table<'_>, needs_lens: bool) -> Option<Projection> {
    let fov = table.optional("fov", "degrees, above 0 and below 180", |value| {
        value.number_where(|fov| fov > 0.0 && fov < 180.0)
    });
    let fov_axis: Option<FovAxis> = table.choice("fov_axis");
    let lens = read_lens(table, needs_lens);
    let (fov, fov_axis) = if table.has("fov") || table.is_excused("fov") {
        (fov?, fov_axis.unwrap_or_default())
    } else {
        if table.has("fov_axis") {
            let message = "fov_axis needs fov, the degrees along it";
            table.report_value("fov_axis", message.to_owned());
        }
        (default_fov(), FovAxis::Diagonal)
    };
    Some(Projection::Perspective { fov, fov_axis, lens })
}

/// Mitsuba's: the diagonal of 35 mm film (36 x 24) behind a lens of 50 mm.
fn default_fov() -> f64 {
    let half_diagonal = 0.5 * (36.0_f64 * 36.0 + 24.0 * 24.0).sqrt();
    2.0 * libm::atan2(half_diagonal, 50.0).to_degrees()
}

/// The lens, or none for a radius of 0.
fn read_lens(table: &Table<'_>, is_needed: bool) -> Option<ThinLens> {
    let above_zero = |value: Value<'_>| value.number_where(|radius| radius > 0.0);
    let radius = if is_needed {
        table.required("aperture_radius", "a number above 0", above_zero)
    } else {
        table.optional("aperture_radius", "a number of at least 0", |value| {
            value.number_where(|radius| radius >= 0.0)
        })
    };
    let focus_distance = table.optional("focus_distance", "a number above 0", above_zero);
    let lens = |aperture_radius| ThinLens {
        aperture_radius,
        focus_distance: focus_distance.unwrap_or(DEFAULT_FOCUS_DISTANCE),
    };
    radius.filter(|&radius| radius > 0.0).map(lens)
}
