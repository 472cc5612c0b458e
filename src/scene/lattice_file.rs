//! Whole lattices from `.npy` files.

use std::path::Path;

use glam::{DVec3, DVec4};

use crate::arrays::read_f64;

/// Control points, Cartesian with the weight as fourth component, third index fastest.
///
/// The file is float64 of shape (nx, ny, nz, 3), or (nx, ny, nz, 4) with weights.
///
/// # Errors
/// A message that names the file and what would be valid.
pub(super) fn read_lattice(path: &Path, counts: [usize; 3]) -> Result<Vec<DVec4>, String> {
    let array = read_f64(path).map_err(|error| error.to_string())?;
    let [nx, ny, nz] = counts;
    let shape = array.shape.as_slice();
    let components = match shape {
        [x, y, z, components @ (3 | 4)] if [*x, *y, *z] == counts => *components,
        _ => {
            return Err(format!(
                "{}: has the shape {shape:?}; a lattice of {nx} x {ny} x {nz} control points needs \
                 ({nx}, {ny}, {nz}, 3), or ({nx}, {ny}, {nz}, 4) with weights",
                path.display()
            ));
        }
    };
    let points = array.values.chunks_exact(components);
    let points: Vec<DVec4> =
        points.map(|p| DVec3::new(p[0], p[1], p[2]).extend(p.get(3).copied().unwrap_or(1.0))).collect();
    let index = |flat: usize| [flat / (ny * nz), flat / nz % ny, flat % nz];
    if let Some(flat) = points.iter().position(|p| !p.is_finite()) {
        return Err(format!("{}: control point {:?} is not finite", path.display(), index(flat)));
    }
    if let Some(flat) = points.iter().position(|p| p.w <= 0.0) {
        let weight = points[flat].w;
        let index = index(flat);
        return Err(format!("{}: weight {weight} of control point {index:?} is not above 0", path.display()));
    }
    Ok(points)
}
