//! What `render --show` draws over a preview.

use clap::ValueEnum;
use glam::DVec3;

use trimray::film::{Image, Overlay};
use trimray::scene::BuiltScene;
use trimray::shade::Camera;
use trimray::spline::ControlLattice;

/// What can be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Show {
    /// Control points and the lines between neighbours
    Lattice,
    /// Sources of drags (red) and their targets (blue)
    Drags,
}

/// Colours, linear.
const LINE: DVec3 = DVec3::new(0.12, 0.16, 0.2);
const POINT: DVec3 = DVec3::new(0.02, 0.03, 0.04);
const SOURCE: DVec3 = DVec3::new(0.8, 0.01, 0.01);
const TARGET: DVec3 = DVec3::new(0.01, 0.05, 0.8);

/// Draws over a picture; nothing hides anything.
pub(super) fn draw(image: &mut Image, show: &[Show], built: &BuiltScene, camera: &Camera) {
    // as thin as can be seen in pictures of any size
    let unit = f64::from(image.display_size()[1]) / 480.0;
    let mut overlay = Overlay::new(image);
    for object in &built.objects {
        for built in object.lattices.iter().filter(|_| show.contains(&Show::Lattice)) {
            draw_lattice(&mut overlay, &built.lattice, camera, unit.max(0.7));
        }
        if show.contains(&Show::Drags) {
            for drag in
                object.lattices.iter().flat_map(|lattice| &lattice.drags).flat_map(|report| &report.drags)
            {
                let ends = [drag.before, drag.target].map(|end| camera.project(end));
                let [Some(from), Some(to)] = ends else { continue };
                overlay.line([from, to], 1.5 * unit.max(0.7), TARGET);
                overlay.dot(from, 4.0 * unit.max(0.7), SOURCE);
                overlay.dot(to, 4.0 * unit.max(0.7), TARGET);
            }
        }
    }
}

fn draw_lattice(overlay: &mut Overlay<'_>, lattice: &ControlLattice, camera: &Camera, unit: f64) {
    let counts = lattice.counts();
    let steps = [counts[1] * counts[2], counts[2], 1];
    let place = |flat: usize| camera.project(lattice.points()[flat].truncate());
    for flat in 0..lattice.points().len() {
        let index = lattice.index_of(flat);
        for axis in 0..3 {
            if index[axis] + 1 < counts[axis]
                && let (Some(from), Some(to)) = (place(flat), place(flat + steps[axis]))
            {
                overlay.line([from, to], unit, LINE);
            }
        }
    }
    for centre in (0..lattice.points().len()).filter_map(place) {
        overlay.dot(centre, 2.2 * unit, POINT);
    }
}
