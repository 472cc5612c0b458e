//! Pointwise free-form deformation: only the corners of split triangles are moved (Sederberg and Parry 1986), for comparison.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use glam::DVec3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::{Construction, Elements};
use crate::mesh::{Polygon, PolygonSet};
use crate::model::deformation::{Base, PlacedShape};
use crate::model::error::ModelError;
use crate::patch::{BuildTimes, Facet, Place};
use crate::spline::SplineVolume;
use crate::subdivide::Numbering;

/// Most triangles of an object.
const MAX_TRIANGLES: usize = 20_000_000;

/// Places this close to the lattice's box, in parts of its diagonal, belong to it: points between corners on its border are off
/// by rounding.
const ON_BORDER: f64 = 1e-10;

/// Memory that a triangle takes: twice the facet, and its face.
const FACET_BYTES: u64 = 1000;

/// Greatest number of splittings.
pub(super) const MAX_LEVEL: u32 = 12;

/// Splits each triangle of the polygons' fans into 4^level and moves the corners.
///
/// # Errors
/// If there would be too many triangles, or the shape is a surface.
pub(super) fn construct(shape: &PlacedShape<'_>, level: u32) -> Result<Construction, ModelError> {
    let Base::Polygons(polygons) = shape.base else { return Err(ModelError::NeedsPolygons) };
    let started = Instant::now();
    let (steps, lattices) = shape.steps()?;
    let fans: usize = polygons.iter().map(|polygon| polygon.positions.len() - 2).sum();
    let each = 4_usize.saturating_pow(level);
    if fans.saturating_mul(each) > MAX_TRIANGLES {
        return Err(ModelError::TooManyTriangles { level, most: MAX_TRIANGLES });
    }
    let count = fans * each;
    let _promise = shape
        .settings
        .memory
        .ask(format_args!("pointwise:{level} of {fans} triangles"), count as u64 * FACET_BYTES)?;
    let moved = |rest: DVec3| lattices.iter().fold(rest, |place, lattice| moved(&lattice.volume, place));
    let numbers = split_vertices(polygons, level);
    let of_polygon = |index: usize| {
        let polygon = polygons.polygon(index);
        let number = u32::try_from(index).expect("fewer than 2^32 polygons fit in memory");
        let facet = |corners: [(DVec3, u32); 3]| {
            let rest = corners.map(|(rest, _)| rest);
            Facet {
                polygon: number,
                face: polygon.face,
                rest: rest.map(Place::Point),
                corners: rest.map(moved),
                vertices: corners.map(|(_, vertex)| vertex),
            }
        };
        let fans = fan_triangles(&polygon).zip(&numbers[index]);
        fans.flat_map(|(fan, numbers)| split(fan, level, numbers)).map(facet).collect::<Vec<_>>()
    };
    let made: Vec<_> = (0..polygons.len()).into_par_iter().map(of_polygon).collect();
    let facets: Vec<Facet> = made.into_iter().flatten().collect();
    let times = BuildTimes { subdivide: started.elapsed(), compose: Duration::ZERO };
    let (subpolygons, elements) = (facets.len(), Elements::Facets(facets));
    Ok(Construction { elements, subpolygons, steps, lattices, triangular: None, times })
}

/// Where a volume takes a place: itself outside the lattice's box.
fn moved(volume: &SplineVolume, place: DVec3) -> DVec3 {
    let [low, high] = volume.bounds();
    let inside = place.clamp(low, high);
    let is_inside = inside.distance(place) <= ON_BORDER * (high - low).length();
    volume.eval(inside).filter(|_| is_inside).map_or(place, |point| point.position)
}

fn fan_triangles<'p>(polygon: &'p Polygon<'_>) -> impl Iterator<Item = [DVec3; 3]> + use<'p> {
    let corners = polygon.positions;
    (1..corners.len() - 1).map(move |i| [corners[0], corners[i], corners[i + 1]])
}

/// The vertices of a split triangle: of its corners, of the points on its sides 0-1, 1-2 and 2-0, and inside.
#[derive(Clone, Copy)]
struct SplitVertices {
    corners: [u32; 3],
    /// The first of a side's, and whether they run from the side's end to its start.
    sides: [(u32, bool); 3],
    inside: u32,
}

impl SplitVertices {
    /// The vertex `i` and `j` steps of `n` from the first corner towards the others.
    fn vertex(&self, n: u32, i: u32, j: u32) -> u32 {
        let along = |side: usize, steps: u32| {
            let (first, is_reversed) = self.sides[side];
            first + if is_reversed { n - steps - 1 } else { steps - 1 }
        };
        match (n - i - j, i, j) {
            (k, _, _) if k == n => self.corners[0],
            (_, i, _) if i == n => self.corners[1],
            (_, _, j) if j == n => self.corners[2],
            (_, i, 0) => along(0, i),
            (0, _, j) => along(1, j),
            (_, 0, j) => along(2, n - j),
            // rows of i have n - 1 - i inside
            (_, i, j) => self.inside + (i - 1) * (n - 1) - i * (i - 1) / 2 + j - 1,
        }
    }
}

/// Numbers the points of all triangles of each polygon; triangles that share a side share its points.
fn split_vertices(polygons: &PolygonSet, level: u32) -> Vec<Vec<SplitVertices>> {
    let n = 1_u32 << level;
    let (on_side, inside) = (n - 1, (n - 1) * n.saturating_sub(2) / 2);
    let mut numbering = Numbering::default();
    let mut sides: HashMap<[u32; 2], u32> = HashMap::new();
    let mut of_fan = |fan: [DVec3; 3]| {
        let corners = fan.map(|corner| numbering.vertex(corner));
        let numbers = &mut numbering.numbers;
        let sides = [0, 1, 2].map(|side| {
            let (from, to) = (corners[side], corners[(side + 1) % 3]);
            let first = sides.entry([from.min(to), from.max(to)]).or_insert_with(|| numbers.add_run(on_side));
            (*first, from > to)
        });
        SplitVertices { corners, sides, inside: numbers.add_run(inside) }
    };
    polygons.iter().map(|polygon| fan_triangles(&polygon).map(&mut of_fan).collect()).collect()
}

/// The 4^level triangles between the points that divide each side into 2^level, with the vertices of their corners.
fn split(
    [a, b, c]: [DVec3; 3],
    level: u32,
    numbers: &SplitVertices,
) -> impl Iterator<Item = [(DVec3, u32); 3]> {
    let n = 1_u32 << level;
    // so written, both triangles of an edge have the same bits on it
    let at = move |i: u32, j: u32| {
        let [u, v, w] = [n - i - j, i, j].map(|k| f64::from(k) / f64::from(n));
        (a * u + b * v + c * w, numbers.vertex(n, i, j))
    };
    (0..n).flat_map(move |i| {
        (0..n - i).flat_map(move |j| {
            let up = [at(i, j), at(i + 1, j), at(i, j + 1)];
            let down = (i + j + 1 < n).then(|| [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            std::iter::once(up).chain(down)
        })
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use crate::scene::{BuiltScene, parse_scene};
    use crate::test_support::Noise;
    use crate::trace::{Ray, SurfaceInteraction};
    use glam::{DVec3, DVec4};

    use super::{SplitVertices, moved, split};
    use crate::spline::SplineVolume;

    const CUBE: &str = include_str!("../../../scenes/meshes/feng_fig07_cube.obj");

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
    fn points_between_corners_on_the_border_of_the_box_move_too() {
        // 0.9 u + 0.9 v + 0.9 w is above 0.9 for some u + v + w = 1
        let volume = SplineVolume::identity([1; 3], [2; 3], [DVec3::splat(0.3), DVec3::splat(0.9)]).unwrap();
        let shifted: Vec<_> =
            volume.control_points().into_iter().map(|p| p + DVec4::new(1.0, 0.0, 0.0, 0.0)).collect();
        let volume = SplineVolume::try_new(volume.axes().clone(), &shifted).unwrap();
        let triangle = [DVec3::new(0.3, 0.3, 0.9), DVec3::new(0.9, 0.3, 0.9), DVec3::splat(0.9)];
        let numbers = SplitVertices { corners: [0, 1, 2], sides: [(3, false); 3], inside: 50 };
        let places: Vec<DVec3> = split(triangle, 4, &numbers).flatten().map(|(place, _)| place).collect();
        assert!(places.iter().any(|place| place.max_element() > 0.9), "some are outside by rounding");
        for place in places {
            assert!((moved(&volume, place) - place).distance(DVec3::X) < 1e-12, "{place} stays");
        }
        assert_eq!(moved(&volume, DVec3::splat(0.91)), DVec3::splat(0.91));
    }

    #[test]
    fn levels_split_triangles_into_fours() {
        for level in 0..4 {
            let built = built(&format!("pointwise:{level}"));
            assert_eq!(built.traced.objects()[0].faces().len(), 12 * 4_usize.pow(level));
            assert!(hits(&built).iter().all(|hit| hit.face < 12));
        }
    }
}
