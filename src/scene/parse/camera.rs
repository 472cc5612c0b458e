//! `[camera]`.

use crate::scene::reader::{Table, Value};
use crate::scene::transform::read_view;
use crate::scene::unavailable::{self, MAX_APERTURE_RADIUS};
use crate::shade::{CameraSettings, FovAxis};

/// Reads and checks the camera.
pub(super) fn read(mut table: Table<'_>) -> Option<CameraSettings> {
    table.check_keys(&["origin", "target", "up", "fov", "fov_axis", "aperture_radius", "focus_distance"]);
    let view = read_view(&table);
    let fov = table.optional("fov", "degrees, above 0 and below 180", |value| {
        value.number_where(|fov| fov > 0.0 && fov < 180.0)
    });
    let fov_axis: Option<FovAxis> = table.choice("fov_axis");
    check_lens(&table);
    let (fov, fov_axis) = if table.has("fov") || table.is_excused("fov") {
        (fov?, fov_axis.unwrap_or_default())
    } else {
        if table.has("fov_axis") {
            let message = "fov_axis needs fov, the degrees along it";
            table.report_value("fov_axis", message.to_owned());
        }
        (default_fov(), FovAxis::Diagonal)
    };
    let view = view?;
    Some(CameraSettings { origin: view.origin, target: view.target, up: view.up, fov, fov_axis })
}

/// Mitsuba's: the diagonal of 35 mm film (36 x 24) behind a lens of 50 mm.
fn default_fov() -> f64 {
    let half_diagonal = 0.5 * (36.0_f64 * 36.0 + 24.0 * 24.0).sqrt();
    2.0 * libm::atan2(half_diagonal, 50.0).to_degrees()
}

fn check_lens(table: &Table<'_>) {
    let radius = table.optional("aperture_radius", "a number of at least 0", |value| {
        value.number_where(|radius| radius >= 0.0)
    });
    if radius.is_some_and(|radius| radius > MAX_APERTURE_RADIUS) {
        let thing = "aperture_radius above 0 (a thin lens)";
        let message = unavailable::message(thing, "0, a pinhole");
        table.report_value("aperture_radius", message);
    }
    table.optional("focus_distance", "a number above 0", |value: Value<'_>| {
        value.number_where(|distance| distance > 0.0)
    });
}
