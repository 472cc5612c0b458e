//! NumPy's files.

use std::path::Path;

use glam::DVec3;

use super::FileLattice;
use crate::arrays::{Array, is_archive, read_archive, read_f64};

/// The arrays of an archive that are read; the first is needed.
const NAMES: [&str; 6] = ["control_points", "weights", "degrees", "knots_x", "knots_y", "knots_z"];

/// A `.npy` file, float64 of shape (nx, ny, nz, 3), or (nx, ny, nz, 4) with weights, or an archive (`.npz`) with it as
/// `control_points`; `weights` of shape (nx, ny, nz), `degrees`, `knots_x`, `knots_y` and `knots_z` may be beside.
pub(super) fn read(path: &Path, counts: [usize; 3]) -> Result<FileLattice, String> {
    let named = |message: String| format!("{}: {message}", path.display());
    if !is_archive(path) {
        let array = read_f64(path).map_err(|error| error.to_string())?;
        return control_points(&array, None, counts).map_err(named);
    }
    let arrays = read_archive(path, &NAMES).map_err(|error| error.to_string())?;
    let find = |name: &str| arrays.iter().find(|(known, _)| known == name).map(|(_, array)| array);
    let Some(points) = find("control_points") else {
        return Err(named(format!("has no array control_points (read are {})", NAMES.join(", "))));
    };
    let mut lattice = control_points(points, find("weights"), counts).map_err(named)?;
    if let Some(degrees) = find("degrees") {
        let degree = <[f64; 3]>::try_from(degrees.values.as_slice());
        let whole =
            |degree: f64| (1..=64).find(|whole| f64::from(*whole) == degree).map(|whole| whole as usize);
        let [x, y, z] = degree.unwrap_or([f64::NAN; 3]).map(whole);
        let (Some(x), Some(y), Some(z)) = (x, y, z) else {
            return Err(named(format!("degrees are {:?}; three whole numbers are needed", degrees.values)));
        };
        lattice.degree = Some([x, y, z]);
    }
    let knots = ["knots_x", "knots_y", "knots_z"].map(|name| find(name).map(|array| array.values.clone()));
    lattice.knots = match knots {
        [Some(x), Some(y), Some(z)] => Some([x, y, z]),
        [None, None, None] => None,
        _ => {
            return Err(named(
                "has knots of some axes; knots_x, knots_y and knots_z come together".to_owned(),
            ));
        }
    };
    Ok(lattice)
}

fn control_points(array: &Array, weights: Option<&Array>, counts: [usize; 3]) -> Result<FileLattice, String> {
    let [nx, ny, nz] = counts;
    let shape = array.shape.as_slice();
    let components = match shape {
        [x, y, z, components @ (3 | 4)] if [*x, *y, *z] == counts => *components,
        _ => {
            return Err(format!(
                "has the shape {shape:?}; a lattice of {nx} x {ny} x {nz} control points needs \
                 ({nx}, {ny}, {nz}, 3), or ({nx}, {ny}, {nz}, 4) with weights"
            ));
        }
    };
    if let Some(weights) = weights.filter(|weights| weights.shape != counts) {
        return Err(format!("weights have the shape {:?}; ({nx}, {ny}, {nz}) is needed", weights.shape));
    }
    let points = array.values.chunks_exact(components).enumerate().map(|(flat, p)| {
        let beside = weights.and_then(|weights| weights.values.get(flat));
        DVec3::new(p[0], p[1], p[2]).extend(beside.or(p.get(3)).copied().unwrap_or(1.0))
    });
    Ok(FileLattice { counts, points: points.collect(), ..FileLattice::default() })
}
