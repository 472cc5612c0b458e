//! Pointwise free-form deformation: only the corners of split triangles are moved (Sederberg and Parry 1986), for comparison.

use glam::{DVec2, DVec3};

use super::attributes::{PolygonAttributes, barycentric};
use crate::mesh::{Polygon, PolygonSet};
use crate::patch::{Deformation, DeformedPolygons, PlanarPolygon, deform_polygons};
use crate::spline::{Cell, SplineVolume};
use crate::trace::VertexAttributes;

/// Most triangles of an object.
const MAX_TRIANGLES: usize = 20_000_000;

/// Greatest number of splittings.
pub(super) const MAX_LEVEL: u32 = 12;

/// An object whose triangles' corners alone are deformed.
pub(super) struct Pointwise {
    /// One flat patch for each group of triangles in one plane.
    pub(super) made: DeformedPolygons,
    /// What is looked up at hits.
    pub(super) attributes: PointwiseAttributes,
}

/// The attributes of the triangles' corners, linear between them.
#[derive(Debug)]
pub(super) struct PointwiseAttributes {
    triangles: PolygonSet,
    /// Corners on the undeformed object, and the normals carried to the deformed ones.
    rest: Vec<[DVec3; 3]>,
    normals: Vec<[Option<DVec3>; 3]>,
}

/// A corner of a small triangle.
#[derive(Clone, Copy)]
struct Corner {
    rest: DVec3,
    uv: DVec2,
}

/// Splits each triangle of the polygons' fans into 4^level and moves the corners.
///
/// # Errors
/// If there would be too many triangles, or a patch cannot be made.
pub(super) fn deform_pointwise(
    source: &PolygonAttributes,
    volumes: &[SplineVolume],
    level: u32,
) -> Result<Pointwise, String> {
    let fans: usize = source.polygons.iter().map(|polygon| polygon.positions.len() - 2).sum();
    let each = 4_usize.saturating_pow(level);
    if fans.saturating_mul(each) > MAX_TRIANGLES {
        return Err(format!(
            "pointwise:{level} would make more than {MAX_TRIANGLES} triangles; a lower level would do"
        ));
    }
    let moved = |rest: DVec3| {
        volumes.iter().fold(rest, |place, volume| volume.eval(place).map_or(place, |point| point.position))
    };
    let mut triangles = PolygonSet::default();
    let (mut rest, mut normals) = (Vec::new(), Vec::new());
    for (index, polygon) in (0..).zip(source.polygons.iter()) {
        for fan in fan_triangles(&polygon) {
            for corners in split(fan, level) {
                let positions = corners.map(|corner| moved(corner.rest));
                let uvs = (!polygon.uvs.is_empty()).then(|| corners.map(|corner| corner.uv));
                if !triangles.push_triangle(polygon.face, positions, uvs) {
                    continue;
                }
                rest.push(corners.map(|corner| corner.rest));
                normals.push(corners.map(|corner| {
                    let cell = volumes.first().and_then(|volume| volume.cell(corner.rest));
                    source.normal(index, corner.rest, cell)
                }));
            }
        }
    }
    let planar: Vec<_> = triangles
        .iter()
        .map(|triangle| PlanarPolygon { face: triangle.face, corners: triangle.positions })
        .collect();
    let made = deform_polygons(&planar, Deformation::default()).map_err(|error| error.to_string())?;
    Ok(Pointwise { made, attributes: PointwiseAttributes { triangles, rest, normals } })
}

fn fan_triangles<'p>(polygon: &'p Polygon<'_>) -> impl Iterator<Item = [Corner; 3]> + use<'p> {
    let corner = |i: usize| Corner {
        rest: polygon.positions[i],
        uv: polygon.uvs.get(i).copied().unwrap_or(DVec2::NAN),
    };
    (1..polygon.positions.len() - 1).map(move |i| [corner(0), corner(i), corner(i + 1)])
}

/// The 4^level triangles between the points that divide each side into 2^level.
fn split([a, b, c]: [Corner; 3], level: u32) -> impl Iterator<Item = [Corner; 3]> {
    let n = 1_u32 << level;
    // so written, both triangles of an edge have the same bits on it
    let at = move |i: u32, j: u32| {
        let [u, v, w] = [n - i - j, i, j].map(|k| f64::from(k) / f64::from(n));
        Corner { rest: a.rest * u + b.rest * v + c.rest * w, uv: a.uv * u + b.uv * v + c.uv * w }
    };
    (0..n).flat_map(move |i| {
        (0..n - i).flat_map(move |j| {
            let up = [at(i, j), at(i + 1, j), at(i, j + 1)];
            let down = (i + j + 1 < n).then(|| [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            std::iter::once(up).chain(down)
        })
    })
}

impl PointwiseAttributes {
    fn weights(&self, polygon: u32, place: DVec3) -> DVec3 {
        barycentric(&self.triangles.polygon(polygon as usize), 1, place)
    }
}

impl VertexAttributes for PointwiseAttributes {
    fn uv(&self, polygon: u32, place: DVec3) -> DVec2 {
        let triangle = self.triangles.polygon(polygon as usize);
        let weights = self.weights(polygon, place);
        match *triangle.uvs {
            [a, b, c] => a * weights.x + b * weights.y + c * weights.z,
            _ => DVec2::NAN,
        }
    }

    fn uv_gradients(&self, polygon: u32, _place: DVec3) -> Option<[DVec3; 2]> {
        super::attributes::uv_gradients(&self.triangles.polygon(polygon as usize), [0, 1, 2])
    }

    fn normal(&self, polygon: u32, place: DVec3, _cell: Option<Cell>) -> Option<DVec3> {
        let [Some(a), Some(b), Some(c)] = self.normals[polygon as usize] else { return None };
        let weights = self.weights(polygon, place);
        (a * weights.x + b * weights.y + c * weights.z).try_normalize()
    }

    fn rest(&self, polygon: u32, place: DVec3) -> DVec3 {
        let [a, b, c] = self.rest[polygon as usize];
        let weights = self.weights(polygon, place);
        a * weights.x + b * weights.y + c * weights.z
    }

    fn each_number(&self, visit: &mut dyn FnMut(f64)) {
        let uvs = self.triangles.iter().flat_map(|triangle| triangle.uvs).flat_map(|uv| uv.to_array());
        let normals = self.normals.iter().flatten().flatten().flat_map(|normal| normal.to_array());
        uvs.chain(normals).for_each(visit);
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use crate::scene::{BuiltScene, parse_scene};
    use crate::test_support::Noise;
    use crate::trace::{Geometry, Ray, SurfaceInteraction};
    use glam::DVec3;

    const CUBE: &str = include_str!("../../scenes/meshes/feng_fig07_cube.obj");

    fn built(method: &str) -> BuiltScene {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.obj"), CUBE).unwrap();
        let scene = format!(
            "[[object]]\nname = \"a\"\nmesh = \"a.obj\"\nmethod = \"{method}\"\n\
             [[object.deform]]\ntype = \"ffd\"\ndegree = [2, 2, 2]\npoints = [4, 4, 4]\n\
             [[object.deform.edit]]\ntwist = {{ axis = \"z\", angle = 60 }}\n"
        );
        let path = folder.path().join("a.toml");
        fs::write(&path, scene).unwrap();
        parse_scene(&path).unwrap().build().unwrap()
    }

    fn hits(built: &BuiltScene) -> Vec<SurfaceInteraction> {
        let mut noise = Noise(5);
        let middle = DVec3::splat(0.5);
        let ray = |_| {
            let from = middle + 3.0 * noise.unit_vector();
            Ray::new(from, middle + 0.5 * noise.vector() - from)
        };
        (0..3000).map(ray).filter_map(|ray| built.traced.closest_hit(&ray)).collect()
    }

    #[test]
    fn the_error_falls_by_four_with_each_level() {
        let exact = built("exact");
        let volume = &exact.objects[0].lattices[0].volume;
        // how far a hit is from where the volume takes its place on the undeformed cube
        let error = |built: &BuiltScene| {
            let off = |hit: SurfaceInteraction| {
                let rest = hit.rest.clamp(DVec3::ZERO, DVec3::ONE);
                assert!(rest.distance(hit.rest) < 1e-12, "{} is off the cube", hit.rest);
                volume.eval(rest).unwrap().position.distance(hit.position)
            };
            let hits = hits(built);
            assert!(hits.len() > 1000);
            hits.into_iter().map(off).fold(0.0, f64::max)
        };
        assert!(error(&exact) < 1e-12);
        let errors: Vec<f64> = (0..5).map(|level| error(&built(&format!("pointwise:{level}")))).collect();
        assert!(errors[0] > 0.05, "{errors:?}");
        for pair in errors[1..].windows(2) {
            assert!((pair[0] / pair[1] - 4.0).abs() < 0.4, "{errors:?}");
        }
    }

    #[test]
    fn levels_split_triangles_into_fours() {
        for level in 0..4 {
            let built = built(&format!("pointwise:{level}"));
            let loops: usize = built.traced.objects()[0].patches.iter().map(|p| p.trim.loops().len()).sum();
            assert_eq!(loops, 12 * 4_usize.pow(level));
            assert!(hits(&built).iter().all(|hit| hit.face < 12));
        }
    }
}
