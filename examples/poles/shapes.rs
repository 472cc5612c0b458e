//! Surfaces with a side that is one point, at both ends of u and of v, plain and deformed by lattices.

#[path = "../common/random.rs"]
mod random;

use std::sync::Arc;

use glam::{DVec2, DVec3};
use trimray::analytic::{Chain, CoverSettings, Step, cover};
use trimray::patch::Shell;
use trimray::spline::{Axis, ControlLattice};
use trimray::surface::{Shape, SplineSurface};
use trimray::trace::{NoAttributes, TracedObject, TracedScene};

pub(crate) use random::Random;

/// A side of a face that is one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pole {
    /// Index of the face.
    pub(crate) face: usize,
    /// The parameter that is the same all along the side: 0 for s, 1 for t.
    pub(crate) axis: usize,
    /// Its value there: 0 or 1.
    pub(crate) end: f64,
}

impl Pole {
    /// The place at `along` of the side, a part `depth` of the face away from it.
    pub(crate) fn place(&self, along: f64, depth: f64) -> DVec2 {
        let across = if self.end > 0.0 { 1.0 - depth } else { depth };
        if self.axis == 0 { DVec2::new(across, along) } else { DVec2::new(along, across) }
    }
}

/// A surface with poles.
pub(crate) struct Surface {
    /// What it is.
    pub(crate) name: String,
    /// It alone.
    pub(crate) scene: TracedScene,
    /// The sides that are points.
    pub(crate) poles: Vec<Pole>,
}

/// All of them.
///
/// # Errors
/// If one cannot be made.
pub(crate) fn surfaces(random: &mut Random) -> Result<Vec<Surface>, String> {
    let center = DVec3::new(0.1, -0.2, 0.3);
    let mut shapes = vec![
        ("sphere".to_owned(), Shape::Sphere { center: DVec3::ZERO, radius: 1.0 }.surface()),
        ("sphere elsewhere".to_owned(), Shape::Sphere { center, radius: 0.7 }.surface()),
        ("cone".to_owned(), Shape::Cone { origin: DVec3::ZERO, axis: DVec3::Z, radius: 1.0 }.surface()),
        (
            "slanted cone".to_owned(),
            Shape::Cone { origin: center, axis: DVec3::new(0.3, -0.5, 0.9), radius: 0.4 }.surface(),
        ),
    ];
    for degree in [[2, 1], [3, 3], [1, 3], [4, 2]] {
        for rational in [false, true] {
            for side in 0..4 {
                let name = format!("Bezier {degree:?}, rational {rational}, side {side}");
                shapes.push((name, collapsed(degree, rational, side, random)));
            }
        }
    }
    let mut made = Vec::new();
    for (name, surface) in shapes {
        let shell = surface.map_err(|error| format!("{name}: {error}"))?.shell();
        for twist in [30.0, 90.0] {
            let chain = Chain::try_new(vec![twisted(twist)?]).map_err(|error| error.to_string())?;
            let chain = Arc::new(chain);
            let covered = cover(&shell, &chain, CoverSettings::default())
                .map_err(|error| format!("{name}: {error}"))?;
            made.push(Surface::new(format!("{name}, twisted by {twist} degrees"), covered.shell));
        }
        made.push(Surface::new(name, shell));
    }
    Ok(made)
}

/// A patch like a dome, or a tent where it is linear, one side of which is its top: at s = 0, s = 1, t = 0, t = 1.
fn collapsed(
    degree: [usize; 2],
    rational: bool,
    side: usize,
    random: &mut Random,
) -> Result<SplineSurface, trimray::surface::SurfaceError> {
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    let top = DVec3::new(0.1, 0.2, 0.3);
    let shaken = 0.1 * random.unit();
    for i in 0..=degree[0] {
        for j in 0..=degree[1] {
            let [s, t] = [i as f64 / degree[0] as f64, j as f64 / degree[1] as f64];
            let (down, around) = [(s, t), (1.0 - s, 1.0 - t), (t, 1.0 - s), (1.0 - t, s)][side];
            let angle = 1.5 * (around - 0.5);
            let ring = down * DVec3::new(libm::cos(angle), libm::sin(angle), 0.0);
            points.push(top + ring + (shaken * down - 0.5 * down * down) * DVec3::Z);
            weights.push(if rational { 0.6 + random.unit() } else { 1.0 });
        }
    }
    if !rational {
        weights.clear();
    }
    SplineSurface::bezier(degree, &points, &weights)
}

fn twisted(angle: f64) -> Result<Step, String> {
    let bounds = [DVec3::splat(-1.5), DVec3::splat(1.6)];
    let mut lattice =
        ControlLattice::identity([2; 3], [4; 3], bounds, 0).map_err(|error| error.to_string())?;
    lattice.twist(Axis::X, angle);
    lattice.taper(Axis::Z, [0.9, 1.2]);
    Ok(Step::Volume(lattice.volume().map_err(|error| error.to_string())?))
}

impl Surface {
    fn new(name: String, shell: Shell) -> Self {
        let mut poles = Vec::new();
        for (number, face) in shell.faces().iter().enumerate() {
            for (axis, end) in [(0, 0.0), (0, 1.0), (1, 0.0), (1, 1.0)] {
                let pole = Pole { face: number, axis, end };
                let [from, middle, to] =
                    [0.0, 0.5, 1.0].map(|along| face.eval(pole.place(along, 0.0)).position);
                if from.distance(middle).max(from.distance(to)) < 1e-14 {
                    poles.push(pole);
                }
            }
        }
        let object = TracedObject { name: name.clone(), shell, attributes: Box::new(NoAttributes) };
        Self { name, scene: TracedScene::new(vec![object]), poles }
    }
}
