//! Whole lattices from files: NumPy's, and those of the programs that have free-form deformations.

mod npy;
mod plot3d;
mod prm;
mod su2;
mod words;

use std::fs;
use std::path::Path;

use glam::{DVec3, DVec4};

use super::description::Block;
use crate::input::read_whole;
use crate::memory::MemoryLimit;
use crate::model::Lattice;
use crate::spline::KnotVector;

/// Memory that reading a text takes at most, in sizes of the file: its words, and the numbers that they stand for.
const TEXT_FACTOR: u64 = 20;

/// Greatest distance of the box that a file is made for from the lattice's, in parts of its diagonal: the rounding of either.
const SAME_BOX: f64 = 1e-12;

/// What a file says of a lattice.
#[derive(Debug, Default)]
struct FileLattice {
    counts: [usize; 3],
    /// Cartesian, the weight as fourth component, third index fastest.
    points: Vec<DVec4>,
    /// The degrees, if the file gives them.
    degree: Option<[usize; 3]>,
    /// The least and greatest corner of the box that the control points are moved from, if the file gives one.
    bounds: Option<[DVec3; 2]>,
    /// The knots, if the file gives them.
    knots: Option<[Vec<f64>; 3]>,
}

/// Control points, Cartesian with the weight as fourth component, third index fastest, of a lattice as the scene has it.
///
/// The format is told by the file's beginning, then by the ending of its name: `.npy` and `.npz`, `.su2`, `.prm`, and otherwise `Plot3D`
/// (`.xyz`).
///
/// # Errors
/// A message that names the file and what would be valid.
pub(super) fn read_lattice(
    path: &Path,
    block: Option<&Block>,
    lattice: &Lattice,
    memory: MemoryLimit,
) -> Result<Vec<DVec4>, String> {
    let named = |message: String| format!("{}: {message}", path.display());
    let length = fs::metadata(path).map_or(0, |file| file.len());
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    let ending = ending.to_string_lossy();
    if !matches!(&*ending, "xyz" | "p3d" | "fmt" | "su2" | "prm") {
        let _promise =
            memory.ask(named("its arrays".to_owned()), length).map_err(|error| error.to_string())?;
        if block.is_some() {
            return Err(named("has one lattice; block is for files of several (.xyz, .su2)".to_owned()));
        }
        return checked(path, lattice, npy::read(path, lattice.points)?);
    }
    let asked = memory.ask(named("its text".to_owned()), length.saturating_mul(TEXT_FACTOR));
    let _promise = asked.map_err(|error| error.to_string())?;
    let bytes = read_whole(path).map_err(|error| named(format!("cannot be read: {error}")))?;
    let text = String::from_utf8_lossy(&bytes);
    let read = match &*ending {
        "su2" => su2::read(&text, block),
        "prm" if block.is_some() => {
            return Err(named("has one lattice; block is for files of several (.xyz, .su2)".to_owned()));
        }
        "prm" => prm::read(&text),
        _ => plot3d::read(&text, block),
    };
    checked(path, lattice, read.map_err(|fault| format!("{}:{fault}", path.display()))?)
}

/// The points, if they are those of a lattice such as this.
fn checked(path: &Path, lattice: &Lattice, read: FileLattice) -> Result<Vec<DVec4>, String> {
    let fault = |message: String| Err(format!("{}: {message}", path.display()));
    let [nx, ny, nz] = lattice.points;
    if read.counts != lattice.points {
        let [x, y, z] = read.counts;
        return fault(format!(
            "has {x} x {y} x {z} control points, but the lattice {nx} x {ny} x {nz}; points = [{x}, {y}, {z}] would fit"
        ));
    }
    if let Some(degree) = read.degree.filter(|degree| *degree != lattice.degree) {
        return fault(format!("is of degree {degree:?}, but the lattice of degree {:?}", lattice.degree));
    }
    if let Some(knots) = read.knots {
        check_knots(path, lattice, &knots)?;
    }
    if let Some([low, high]) = read.bounds {
        let fits = |[min, max]: [DVec3; 2]| {
            (min - low).abs().max((max - high).abs()).max_element() <= SAME_BOX * (high - low).length()
        };
        if !lattice.bounds.is_some_and(fits) {
            return fault(format!(
                "is made for another box than the lattice's; bounds = [{:?}, {:?}] would fit",
                low.to_array(),
                high.to_array()
            ));
        }
    }
    let index = |flat: usize| [flat / (ny * nz), flat / nz % ny, flat % nz];
    if let Some(flat) = read.points.iter().position(|p| !p.is_finite()) {
        return fault(format!("control point {:?} is not finite", index(flat)));
    }
    if let Some(flat) = read.points.iter().position(|p| p.w <= 0.0) {
        let weight = read.points[flat].w;
        return fault(format!("weight {weight} of control point {:?} is not above 0", index(flat)));
    }
    Ok(read.points)
}

/// The file's knots are the lattice's, wherever their domain is.
fn check_knots(path: &Path, lattice: &Lattice, knots: &[Vec<f64>; 3]) -> Result<(), String> {
    let unit = [DVec3::ZERO, DVec3::ONE];
    let axes = lattice.knots.axes(lattice.degree, lattice.points, unit).map_err(|error| error.to_string())?;
    for (axis, (given, own)) in knots.iter().zip(&axes).enumerate() {
        let name = ['x', 'y', 'z'][axis];
        let made = KnotVector::try_new(lattice.degree[axis], given.clone())
            .and_then(|knots| knots.over(0.0, 1.0))
            .map_err(|error| format!("{}: knots along {name}: {error}", path.display()))?;
        let differs = |(a, b): (&f64, &f64)| (a - b).abs() > SAME_BOX;
        if made.knots().len() != own.knots().len() || made.knots().iter().zip(own.knots()).any(differs) {
            return Err(format!(
                "{}: its knots along {name} are not the lattice's; knots = [{}] would fit",
                path.display(),
                knots.each_ref().map(|list| format!("{list:?}")).join(", ")
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
