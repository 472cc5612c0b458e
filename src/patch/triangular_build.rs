//! Polygons and a volume become triangular Bézier patches, and these trimmed tensor-product ones to be traced.

use std::time::Instant;

use glam::{DVec2, DVec3};

use crate::spline::{KnotBox, SplineVolume};
use crate::subdivide::{Frame, VertexNumbers, cut_into_triangles};

use super::bezier_patch::BezierPatch;
use super::build::{
    BuildError, BuildTimes, MAX_HALVINGS, MAX_PARTS, PlanarPolygon, bounds_with_lattice, box_size, halves,
    least_frame, short_knot_box,
};
use super::chart::Chart;
use super::face::Face;
use super::region::{LineCuts, LoopCorner, Region, RegionBuilder};
use super::shell::Shell;
use super::triangular::TriangularPatch;

/// A triangle of a polygon in one knot box, deformed.
#[derive(Clone, Debug)]
pub struct TriangularPiece {
    /// Index of the polygon it is cut from.
    pub polygon: u32,
    /// Its corners before the deformation, in the polygon's winding.
    pub corners: [DVec3; 3],
    /// The surface.
    pub patch: TriangularPatch,
    knot_box: Option<[u32; 3]>,
    vertices: [u32; 3],
}

impl TriangularPiece {
    /// The knot box it is the image of; `None` outside the lattice, where the surface is undeformed.
    pub fn knot_box(&self) -> Option<KnotBox> {
        self.knot_box.map(|knot_box| knot_box.map(|interval| interval as usize))
    }
}

/// The triangular patches of one object.
#[derive(Clone, Debug)]
pub struct DeformedTriangles {
    /// The patches, in the order of the polygons.
    pub pieces: Vec<TriangularPiece>,
    numbers: VertexNumbers,
    /// Time spent.
    pub times: BuildTimes,
}

/// The exact deformation of planar convex polygons as triangular Bézier patches, the method before
/// [`deform_polygons`](super::deform_polygons).
///
/// Polygons are cut at the knot planes into triangles; each becomes a patch of the sum of the volume's degrees, of degree
/// 1 outside the lattice. Without a volume all stay as they are.
///
/// Source: Feng, Heng, Wong (1998) for the subdivision, Feng, Peng (2000) for the control points.
///
/// # Errors
/// [`BuildError::NotFinite`] if a patch is not finite.
pub fn deform_triangles(
    polygons: &[PlanarPolygon<'_>],
    volume: Option<&SplineVolume>,
) -> Result<DeformedTriangles, BuildError> {
    let started = Instant::now();
    let numbered = (0..).zip(polygons).map(|(number, polygon)| (number, polygon.corners));
    let cut = cut_into_triangles(numbered, volume);
    let subdivide = started.elapsed();

    let started = Instant::now();
    let mut pieces = Vec::with_capacity(cut.len());
    for index in 0..cut.len() {
        let piece = cut.piece(index);
        let (&[a, b, c], &[of_a, of_b, of_c]) = (cut.corners(index), cut.vertices(index)) else { continue };
        let first = obtuse([a, b, c]);
        let mut corners = [a, b, c];
        let mut vertices = [of_a, of_b, of_c];
        corners.rotate_left(first);
        vertices.rotate_left(first);
        let patch = match (piece.knot_box, volume) {
            (Some(knot_box), Some(volume)) => TriangularPatch::composed(volume, knot_box, &corners),
            _ => TriangularPatch::flat(&corners),
        };
        if !patch.is_finite() {
            return Err(BuildError::NotFinite { face: polygons[piece.polygon as usize].face });
        }
        let knot_box = piece.knot_box.map(short_knot_box);
        pieces.push(TriangularPiece { polygon: piece.polygon, corners, patch, knot_box, vertices });
    }
    let numbers = cut.numbers().clone();
    Ok(DeformedTriangles { pieces, numbers, times: BuildTimes { subdivide, compose: started.elapsed() } })
}

/// The corner of the greatest angle: as the first of the parallelogram's it is the one from which that reaches least far.
fn obtuse([a, b, c]: [DVec3; 3]) -> usize {
    let [of_a, of_b, of_c] = [(b, c), (c, a), (a, b)].map(|(from, to)| from.distance_squared(to));
    if of_a >= of_b.max(of_c) {
        0
    } else if of_b >= of_c {
        1
    } else {
        2
    }
}

impl DeformedTriangles {
    /// Control points of all patches.
    pub fn control_points(&self) -> usize {
        self.pieces.iter().map(|piece| piece.patch.control_points().len()).sum()
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        self.pieces.iter().map(|piece| size_of::<TriangularPiece>() + piece.patch.bytes()).sum()
    }

    /// The same surface as tensor-product patches of degree K × K over parallelograms, trimmed to their triangles.
    ///
    /// `polygons` and `volume` are those it was made of.
    ///
    /// # Errors
    /// [`BuildError`] if a patch is not finite or does not reach positive weights.
    pub fn shell(
        &self,
        polygons: &[PlanarPolygon<'_>],
        volume: Option<&SplineVolume>,
    ) -> Result<Shell, BuildError> {
        let lipschitz = volume.map_or(1.0, SplineVolume::lipschitz_bound);
        let least_weight = volume.filter(|volume| volume.is_rational()).map_or(1.0, |volume| {
            volume.control_points().iter().fold(f64::INFINITY, |least, point| least.min(point.w))
        });
        let mut shell = Shell::new(self.numbers.clone());
        let mut region = RegionBuilder::default();
        let least = least_frame(bounds_with_lattice(polygons, volume));
        for piece in &self.pieces {
            let polygon = &polygons[piece.polygon as usize];
            let knot_box = piece.knot_box().zip(volume);
            let least = knot_box
                .map_or(least, |(knot_box, volume)| least.min(box_size(volume, knot_box).min_element()));
            let made;
            let (patch, [a, b, c], st) = match Wider::around(&piece.corners, polygon.corners, least) {
                None => (&piece.patch, piece.corners, [DVec2::ZERO, DVec2::X, DVec2::Y]),
                Some(Wider { corners, st }) => {
                    made = match knot_box {
                        Some((knot_box, volume)) => TriangularPatch::composed(volume, knot_box, &corners),
                        None => TriangularPatch::flat(&corners),
                    };
                    (&made, corners, st)
                }
            };
            let frame = Frame { origin: a, s: b - a, t: c - a };
            let off = |(st, corner): (DVec2, DVec3)| (frame.point(st) - corner).length();
            let off_plane = st.into_iter().zip(piece.corners).map(off).fold(0.0, f64::max) * lipschitz;
            let numbered = st.into_iter().zip(piece.vertices);
            region.push(piece.polygon, polygon.face, numbered.map(|(st, vertex)| LoopCorner { st, vertex }));
            let part = Part {
                knot_box: piece.knot_box,
                frame,
                patch: patch.to_tensor_product(),
                boundary_error: off_plane + rounding(patch, least_weight),
                region: region.finish(),
            };
            let mut parts_left = MAX_PARTS;
            part.add_to(&mut shell, 0, &mut parts_left)?;
        }
        shell.shrink();
        Ok(shell)
    }
}

/// A triangle around a sliver in its plane, wide enough for a patch.
struct Wider {
    /// Counter-clockwise as the sliver's.
    corners: [DVec3; 3],
    /// Where the sliver's corners are on it, in parameters from the first of its corners to the second and to the third.
    st: [DVec2; 3],
}

impl Wider {
    /// The triangle with the longest side of the given one, made as long as `least`, and the corner across it as high above.
    /// None if the given one is as wide itself. `polygon` is what it is cut from, which tells the plane if it is wider.
    fn around(corners: &[DVec3; 3], polygon: &[DVec3], least: f64) -> Option<Self> {
        let side = |i: usize| corners[(i + 2) % 3] - corners[(i + 1) % 3];
        // so that the longest side is across the first corner
        let first = (0..3).max_by(|&i, &j| side(i).length_squared().total_cmp(&side(j).length_squared()))?;
        let [top, from, to] = [0, 1, 2].map(|i| corners[(first + i) % 3]);
        let length = (to - from).length();
        let along = (to - from) / length;
        let height = along.cross(top - from).length();
        if height >= least || !along.is_finite() {
            return None;
        }
        let mut normal = DVec3::ZERO;
        for pair in polygon.windows(2) {
            normal += (pair[0] - polygon[0]).cross(pair[1] - polygon[0]);
        }
        let up = normal.cross(along).normalize_or(along.any_orthonormal_vector());
        let foot = along.dot(top - from);
        let wide = [from + foot * along + least * up, from, from + length.max(least) * along];
        let below = height / least;
        // parameters run from the top to the two ends of the longest side
        let on_side = |distance: f64| distance / length.max(least);
        let at = |part: f64, depth: f64| DVec2::new(depth * (1.0 - part), depth * part);
        let mut st = [at(on_side(foot), 1.0 - below), at(0.0, 1.0), at(on_side(length), 1.0)];
        st.rotate_right(first);
        Some(Self { corners: wide, st })
    }
}

/// How far rounding may have moved a patch's points; `least_weight` bounds the weights on its triangle.
fn rounding(patch: &TriangularPatch, least_weight: f64) -> f64 {
    let homogeneous = patch.rounding();
    if !patch.is_rational() {
        return homogeneous;
    }
    let greatest = patch.control_points().map(|point| point.truncate().length()).fold(0.0, f64::max);
    homogeneous * (1.0 + greatest / least_weight) / least_weight
}

/// A tensor-product patch on the parallelogram of a triangle, or a part of it, that is not known to have positive weights.
struct Part {
    knot_box: Option<[u32; 3]>,
    frame: Frame,
    patch: BezierPatch,
    boundary_error: f64,
    /// With the vertices of its corners.
    region: (Region, Vec<u32>),
}

impl Part {
    /// Adds it to the patches, in halves while weights are not positive.
    fn add_to(self, shell: &mut Shell, halvings: usize, parts_left: &mut usize) -> Result<(), BuildError> {
        let Self { knot_box, frame, patch, boundary_error, region: (region, vertices) } = self;
        let face = region.trim_loop(0).face;
        if !patch.is_finite() {
            return Err(BuildError::NotFinite { face });
        }
        if patch.has_positive_weights() {
            let chart = Chart::Plane(frame);
            shell.push(Face { knot_box, chart, patch, region, boundary_error, exact: None }, &vertices);
            return Ok(());
        }
        if halvings == MAX_HALVINGS || *parts_left == 0 {
            return Err(BuildError::Weights { face });
        }
        *parts_left -= 1;
        let region = (&region, &*vertices);
        let [below, above] = halves(region, halvings % 2, &mut LineCuts::new(shell.numbers_mut()));
        for ([low, high], region) in [below, above].into_iter().flatten() {
            let (frame, patch) = (frame.restricted(low, high), patch.subpatch(low, high));
            Self { knot_box, frame, patch, boundary_error, region }.add_to(
                shell,
                halvings + 1,
                parts_left,
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::polygon::doubled_area;
    use crate::test_support::{Noise, cube_triangles, random_volume};

    fn polygons(triangles: &[[DVec3; 3]]) -> Vec<PlanarPolygon<'_>> {
        (0..).zip(triangles).map(|(face, corners)| PlanarPolygon { face, corners }).collect()
    }

    #[test]
    fn the_unit_cube_gives_60_patches_of_28_control_points() {
        let triangles = cube_triangles();
        let polygons = polygons(&triangles);
        let volume = random_volume(&mut Noise(1), [2; 3], [4; 3], 0.3, false);
        let made = deform_triangles(&polygons, Some(&volume)).unwrap();
        assert_eq!((made.pieces.len(), made.control_points()), (60, 60 * 28));
        assert!(made.bytes() > 60 * 28 * 24);
        let patches = made.shell(&polygons, Some(&volume)).unwrap().into_faces();
        assert_eq!(patches.len(), 60);
        assert!(patches.iter().all(|p| p.patch.degree() == [6, 6] && p.region.len() == 1));
    }

    #[test]
    fn without_a_volume_triangles_stay() {
        let triangles = cube_triangles();
        let polygons = polygons(&triangles);
        let made = deform_triangles(&polygons, None).unwrap();
        assert_eq!((made.pieces.len(), made.control_points()), (12, 36));
        assert!(made.shell(&polygons, None).unwrap().faces().iter().all(|p| p.knot_box().is_none()));
    }

    #[test]
    fn extreme_weights_are_split_until_positive() {
        let mut noise = Noise(23);
        let mut split = 0;
        for _ in 0..20 {
            let mut points = random_volume(&mut noise, [3; 3], [5; 3], 0.3, false).control_points();
            for point in &mut points {
                point.w = libm::exp(8.0 * noise.next());
            }
            let axes = SplineVolume::identity([3; 3], [5; 3], [DVec3::ZERO, DVec3::ONE]).unwrap();
            let volume = SplineVolume::try_new(axes.axes().clone(), &points).unwrap();
            let triangle = [std::array::from_fn(|_| noise.vector() + 0.5)];
            let polygons = polygons(&triangle);
            let made = deform_triangles(&polygons, Some(&volume)).unwrap();
            let patches = made.shell(&polygons, Some(&volume)).unwrap().into_faces();
            split += patches.len() - made.pieces.len();
            assert!(patches.iter().all(|p| p.patch.has_positive_weights()));
            let area = |p: &Face| {
                let [_, s, t] = p.chart.coordinates();
                0.5 * s.cross(t).length() * doubled_area(p.region.all_corners())
            };
            let [a, b, c] = triangle[0];
            let want = 0.5 * (b - a).cross(c - a).length();
            assert!((patches.iter().map(area).sum::<f64>() - want).abs() < 1e-12);
        }
        assert!(split > 0, "the weights are extreme enough to need a split");
    }
}
