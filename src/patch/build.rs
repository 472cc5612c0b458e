//! Stages 1 to 3 on one page: polygons and a volume become trimmed patches.

use std::time::{Duration, Instant};

use glam::{DVec2, DVec3};
use thiserror::Error;

use crate::math::bounds;
use crate::math::polygon::{self, Side};
use crate::memory::{MemoryLimit, OutOfMemory};
use crate::spline::{KnotBox, SplineVolume};
use crate::subdivide::{
    Frame, FrameChoice, FrameSettings, FramedPlane, Group, Pieces, cut_at_knot_planes, frame_group,
    group_coplanar,
};

use super::chart::Chart;
use super::compose::{Composer, flat_patch};
use super::face::Face;
use super::region::{LineCuts, LoopCorner, Region, RegionBuilder, has_area};
use super::shell::Shell;

/// Halvings of a rational patch in search of positive weights; each halves one side.
///
/// The weight function of a volume with positive weights is positive on the trimmed part, so a few halvings do; 60
/// would take both sides below the rounding of their parameters.
pub(super) const MAX_HALVINGS: usize = 60;

/// The least extent of a patch's frame, in parts of the size of object and lattice or of their distance from the origin.
///
/// Ten orders of magnitude above the rounding of coordinates, which is what is left of a place in such a patch, and far below
/// what any but slivers have.
const LEAST_FRAME: f64 = 1.0 / 65536.0;

/// Patches that one is divided into in search of positive weights, at most: weights of the extreme ratios that need more would
/// need millions.
pub(super) const MAX_PARTS: usize = 4096;

/// Memory that a piece takes while polygons are cut and pieces grouped: four corners with their vertices, what is known of
/// crossings, and its place in a group.
const PIECE_BYTES: u64 = 400;

/// Groups that are made patches of between two looks at the memory that is left.
const GROUPS_BETWEEN_CHECKS: usize = 1024;

/// A planar convex polygon of the undeformed object.
#[derive(Clone, Copy, Debug)]
pub struct PlanarPolygon<'a> {
    /// Index of the input face it is (part of).
    pub face: u32,
    /// Corners, counter-clockwise seen from outside.
    pub corners: &'a [DVec3],
}

/// How polygons are deformed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Deformation<'a> {
    /// The volume; without one the polygons stay as they are.
    pub volume: Option<&'a SplineVolume>,
    /// The frame of the patches.
    pub frame: FrameChoice,
}

/// The faces of one object.
#[derive(Clone, Debug, Default)]
pub struct DeformedPolygons {
    /// The faces, ordered by knot box, then by first input face; outside pieces first.
    pub shell: Shell,
    /// Number of sub-polygons the polygons were cut into.
    pub subpolygons: usize,
    /// Time spent.
    pub times: BuildTimes,
}

/// Time spent on the stages of building patches.
#[derive(Clone, Copy, Debug, Default)]
pub struct BuildTimes {
    /// Cutting at knot planes, grouping and framing.
    pub subdivide: Duration,
    /// Composing patches.
    pub compose: Duration,
}

/// Why polygons cannot become patches.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BuildError {
    /// A rational patch did not reach positive weights.
    #[error(
        "face {face}: the weights of its patch stay not positive after {MAX_HALVINGS} halvings, or in more than {MAX_PARTS} parts; less extreme lattice weights would help"
    )]
    Weights {
        /// A face of the patch.
        face: u32,
    },
    /// A patch has a control point that is not finite.
    #[error("face {face}: its deformed patch is not finite; coordinates or lattice are too large")]
    NotFinite {
        /// A face of the patch.
        face: u32,
    },
    /// There is too little memory for so many patches.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
}

/// Cuts, groups and composes: the exact deformation of planar convex polygons as trimmed patches.
///
/// Source: Feng, Nishita, Jin, Peng (2002), section 3.
///
/// # Errors
/// [`BuildError`] if a patch is not finite or does not reach positive weights.
pub fn deform_polygons(
    polygons: &[PlanarPolygon<'_>],
    deformation: Deformation<'_>,
) -> Result<DeformedPolygons, BuildError> {
    deform_polygons_within(polygons, deformation, false, MemoryLimit::NONE)
}

/// [`deform_polygons`], of polygons that may share edges with others that are deformed apart from them, if there is memory
/// enough.
pub(crate) fn deform_polygons_within(
    polygons: &[PlanarPolygon<'_>],
    deformation: Deformation<'_>,
    shares_edges: bool,
    memory: MemoryLimit,
) -> Result<DeformedPolygons, BuildError> {
    let started = Instant::now();
    let most = polygons.iter().map(|polygon| most_pieces(polygon.corners, deformation.volume));
    let most = most.fold(0, u64::saturating_add);
    let promise = memory.ask(
        format_args!("cutting {} polygons into up to {most} pieces at the lattice's knots", polygons.len()),
        most.saturating_mul(PIECE_BYTES),
    )?;
    let numbered = (0..).zip(polygons).map(|(number, polygon)| (number, polygon.corners));
    let pieces = cut_at_knot_planes(numbered, deformation.volume, shares_edges);
    let [low, high] = bounds_with_lattice(polygons, deformation.volume);
    let diagonal = (high - low).length();
    let groups = group_coplanar(&pieces, |polygon| polygons[polygon as usize].corners, diagonal);
    let subdivide = started.elapsed();
    drop(promise);

    let started = Instant::now();
    let mut builder = Builder {
        polygons,
        pieces: &pieces,
        deformation,
        memory,
        bytes: 0,
        parts_left: 0,
        lipschitz: deformation.volume.map_or(1.0, SplineVolume::lipschitz_bound),
        least_frame: least_frame([low, high]),
        composer: Composer::default(),
        corners: Vec::new(),
        region: RegionBuilder::default(),
        shell: Shell::new(pieces.numbers().clone()),
    };
    for (number, group) in groups.iter().enumerate() {
        if number % GROUPS_BETWEEN_CHECKS == GROUPS_BETWEEN_CHECKS - 1 {
            builder.memory.check("making the patches", builder.bytes)?;
        }
        builder.add_group(group)?;
    }
    let mut shell = builder.shell;
    shell.shrink();
    let times = BuildTimes { subdivide, compose: started.elapsed() };
    Ok(DeformedPolygons { shell, subpolygons: pieces.len(), times })
}

/// The most pieces that a polygon is cut into at the knot planes that cross it: so many regions have three sets of parallel lines
/// in a plane.
fn most_pieces(corners: &[DVec3], volume: Option<&SplineVolume>) -> u64 {
    let Some(volume) = volume else { return 1 };
    let [low, high] = bounds::around(corners.iter().copied());
    let [a, b, c] = [0, 1, 2].map(|axis| {
        let planes = volume.axes()[axis].breakpoints();
        let before = |end: f64| planes.partition_point(|&plane| plane < end) as u64;
        before(high[axis]) - before(low[axis])
    });
    1 + a + b + c + a * b + b * c + c * a
}

/// The box around polygons and lattice.
pub(super) fn bounds_with_lattice(
    polygons: &[PlanarPolygon<'_>],
    volume: Option<&SplineVolume>,
) -> [DVec3; 2] {
    let corners = polygons.iter().flat_map(|polygon| polygon.corners).copied();
    bounds::around(corners.chain(volume.map(SplineVolume::bounds).into_iter().flatten()))
}

/// The least extent of a patch's frame where polygons and lattice are in a box.
pub(super) fn least_frame([low, high]: [DVec3; 2]) -> f64 {
    LEAST_FRAME * (high - low).length().max(low.abs().max(high.abs()).max_element())
}

/// The extent of a knot box.
pub(super) fn box_size(volume: &SplineVolume, knot_box: KnotBox) -> DVec3 {
    let size = |axis: usize| {
        let breakpoints = volume.axes()[axis].breakpoints();
        breakpoints[knot_box[axis] + 1] - breakpoints[knot_box[axis]]
    };
    DVec3::new(size(0), size(1), size(2))
}

struct Builder<'a> {
    memory: MemoryLimit,
    /// Memory of the patches so far.
    bytes: u64,
    /// Parts that the patch being made may still be divided into.
    parts_left: usize,
    polygons: &'a [PlanarPolygon<'a>],
    pieces: &'a Pieces,
    deformation: Deformation<'a>,
    lipschitz: f64,
    /// See [`LEAST_FRAME`]; a length.
    least_frame: f64,
    composer: Composer,
    corners: Vec<DVec3>,
    region: RegionBuilder,
    shell: Shell,
}

impl Builder<'_> {
    fn add_group(&mut self, group: &Group) -> Result<(), BuildError> {
        self.corners.clear();
        for &piece in &group.pieces {
            self.corners.extend_from_slice(self.pieces.corners(piece as usize));
        }
        let Some(framed) = self.frame(group) else { return Ok(()) };
        let mut off_plane: f64 = 0.0;
        for &piece in &group.pieces {
            let polygon = self.pieces.piece(piece as usize).polygon;
            let corners = self.pieces.corners(piece as usize);
            let parameters = |&corner: &DVec3| framed.parameters(corner).clamp(DVec2::ZERO, DVec2::ONE);
            for corner in corners {
                off_plane = off_plane.max((framed.frame.point(parameters(corner)) - *corner).length());
            }
            let vertices = self.pieces.vertices(piece as usize);
            let corners = corners.iter().zip(vertices);
            let corners = corners.map(|(corner, &vertex)| LoopCorner { st: parameters(corner), vertex });
            self.region.push(polygon, self.polygons[polygon as usize].face, corners);
        }
        let boundary_error = off_plane * self.lipschitz;
        let region = self.region.finish();
        self.parts_left = MAX_PARTS;
        self.add_patch(group.knot_box, framed.frame, region, boundary_error, 0)
    }

    fn frame(&self, group: &Group) -> Option<FramedPlane> {
        let (degree, box_size, least) = match (group.knot_box, self.deformation.volume) {
            (Some(knot_box), Some(volume)) => {
                let box_size = box_size(volume, knot_box);
                (volume.degree(), box_size, self.least_frame.min(box_size.min_element()))
            }
            // undeformed: along any two axes the plane is a patch of degree 1 × 1
            _ => ([1; 3], DVec3::ONE, self.least_frame),
        };
        let choice = self.deformation.frame;
        frame_group(&group.plane, &self.corners, &FrameSettings { degree, box_size, least, choice })
    }

    /// Composes the patch over a frame; halves the frame while weights are not positive.
    fn add_patch(
        &mut self,
        knot_box: Option<KnotBox>,
        frame: Frame,
        (region, vertices): (Region, Vec<u32>),
        boundary_error: f64,
        halvings: usize,
    ) -> Result<(), BuildError> {
        let patch = match (knot_box, self.deformation.volume) {
            (Some(knot_box), Some(volume)) => self.composer.compose(volume, knot_box, &frame),
            _ => flat_patch(&frame),
        };
        let face = region.trim_loop(0).face;
        if !patch.is_finite() {
            return Err(BuildError::NotFinite { face });
        }
        if patch.has_positive_weights() {
            let (knot_box, chart) = (knot_box.map(short_knot_box), Chart::Plane(frame));
            let made = Face { knot_box, chart, patch, region, boundary_error, exact: None };
            self.bytes += made.bytes() as u64;
            self.shell.push(made, &vertices);
            return Ok(());
        }
        if halvings == MAX_HALVINGS || self.parts_left == 0 {
            return Err(BuildError::Weights { face });
        }
        self.parts_left -= 1;
        let region = (&region, &*vertices);
        let [below, above] = halves(region, halvings % 2, &mut LineCuts::new(self.shell.numbers_mut()));
        for ([low, high], region) in [below, above].into_iter().flatten() {
            self.add_patch(knot_box, frame.restricted(low, high), region, boundary_error, halvings + 1)?;
        }
        Ok(())
    }
}

/// A knot box as patches keep it.
pub(super) fn short_knot_box(knot_box: KnotBox) -> [u32; 3] {
    knot_box.map(|interval| u32::try_from(interval).expect("fewer than 2^32 knots fit in memory"))
}

/// A region with the vertices of its corners.
type NumberedRegion = (Region, Vec<u32>);

/// The parts of a region on both sides of the square's middle: their bounding rectangles, and the parts in parameters of those;
/// `None` where nothing is left.
pub(super) fn halves(
    (region, vertices): (&Region, &[u32]),
    axis: usize,
    cuts: &mut LineCuts<'_>,
) -> [Option<([DVec2; 2], NumberedRegion)>; 2] {
    [Side::Below, Side::Above].map(|side| {
        let mut kept = Vec::new();
        let mut loops = Vec::new();
        for trim_loop in region.loops() {
            let corners: Vec<_> = region.numbered_corners(&trim_loop, vertices).collect();
            cuts.clip(&corners, (axis, 0.5, side), [0; 2], &mut kept);
            if has_area(&kept) {
                loops.push((trim_loop, kept.clone()));
            }
        }
        let corners = loops.iter().flat_map(|(_, corners)| corners).map(|corner| corner.st);
        let [low, high] = polygon::bounds(corners)?;
        let mut fitted = RegionBuilder::default();
        for (trim_loop, corners) in loops {
            let fit = |corner: LoopCorner| LoopCorner { st: (corner.st - low) / (high - low), ..corner };
            fitted.push(trim_loop.polygon, trim_loop.face, corners.into_iter().map(fit));
        }
        Some(([low, high], fitted.finish()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch::compose_by_interpolation;
    use crate::test_support::{Noise, cube_triangles, random_volume};

    fn shaken_volume(noise: &mut Noise, degree: [usize; 3], rational: bool) -> SplineVolume {
        random_volume(noise, degree, degree.map(|k| k + 2), 0.3, rational)
    }

    /// A triangle, in turn in a general plane and along one or two axes.
    fn random_triangle(noise: &mut Noise, kind: usize) -> [DVec3; 3] {
        let mut corners: [DVec3; 3] = std::array::from_fn(|_| noise.vector() + 0.5);
        match kind % 6 {
            axis @ 0..3 => {
                let value = corners[0][axis];
                corners.iter_mut().for_each(|c| c[axis] = value);
            }
            3 => corners[1] = corners[0].with_x(0.5 * (corners[0].x + 1.0)),
            _ => {}
        }
        corners
    }

    #[test]
    fn patches_are_the_volume_on_their_planes() {
        let mut noise = Noise(5);
        for rational in [false, true] {
            for degree in (1..=4).flat_map(|u| (1..=4).flat_map(move |v| (1..=4).map(move |w| [u, v, w]))) {
                let volume = shaken_volume(&mut noise, degree, rational);
                for kind in 0..6 {
                    let corners = random_triangle(&mut noise, kind);
                    let polygons = [PlanarPolygon { face: 3, corners: &corners }];
                    for frame in [FrameChoice::Parallelogram, FrameChoice::Rectangle] {
                        let made =
                            deform_polygons(&polygons, Deformation { volume: Some(&volume), frame }).unwrap();
                        for patch in made.shell.faces() {
                            let worst = deviation(&volume, patch, &mut noise);
                            let bound = if rational { 1e-11 } else { 1e-12 };
                            assert!(
                                worst <= bound * 3_f64.sqrt(),
                                "{degree:?} rational {rational} {frame:?}: {worst:e}"
                            );
                        }
                    }
                }
            }
        }
    }

    fn deviation(volume: &SplineVolume, patch: &Face, noise: &mut Noise) -> f64 {
        let mut worst: f64 = 0.0;
        for trim_loop in patch.region.loops() {
            let corners = patch.region.corners(&trim_loop);
            for _ in 0..8 {
                let weights: Vec<f64> = corners.iter().map(|_| noise.next() + 0.5).collect();
                let sum: f64 = weights.iter().sum();
                let st: DVec2 = corners.iter().zip(&weights).map(|(&c, w)| c * (w / sum)).sum();
                let knot_box = patch.knot_box().unwrap();
                let want = volume.eval_in_knot_box(knot_box, patch.chart.place(st).coordinates());
                let got = patch.patch.eval(st);
                worst = worst.max((got.position - want.position).length());
            }
        }
        worst
    }

    #[test]
    fn interpolation_gives_the_same_surface() {
        let mut noise = Noise(9);
        for degree in [[1, 2, 3], [2, 2, 2], [3, 3, 3], [4, 4, 4]] {
            for rational in [false, true] {
                let volume = shaken_volume(&mut noise, degree, rational);
                let corners = random_triangle(&mut noise, 5);
                let polygons = [PlanarPolygon { face: 0, corners: &corners }];
                let made = deform_polygons(
                    &polygons,
                    Deformation { volume: Some(&volume), ..Deformation::default() },
                )
                .unwrap();
                for patch in made.shell.faces() {
                    let knot_box = patch.knot_box().unwrap();
                    let other =
                        compose_by_interpolation(&volume, knot_box, &plane_of(patch), patch.patch.degree());
                    let size = patch.patch.control_points().map(|p| p.length()).fold(1.0, f64::max);
                    for step in 0..=20 {
                        let st = DVec2::new(f64::from(step) / 20.0, f64::from(step * 7 % 21) / 20.0);
                        let (a, b) = (patch.patch.eval(st), other.eval(st));
                        // the condition numbers of both directions at uniform nodes cancel on the surface but for a
                        // factor of the interpolation's Lebesgue constants, at most 30 each up to degree 8
                        assert!(
                            (a.position - b.position).length() < 1e-15 * 900.0 * size,
                            "{degree:?} at {st}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn the_unit_cube_gives_36_sub_polygons_and_24_patches() {
        let triangles = cube_triangles();
        let polygons: Vec<_> =
            (0..).zip(&triangles).map(|(face, c)| PlanarPolygon { face, corners: c }).collect();
        let volume = shaken_volume(&mut Noise(1), [2; 3], false);
        assert_eq!(volume.points(), [4; 3]);
        let made =
            deform_polygons(&polygons, Deformation { volume: Some(&volume), ..Deformation::default() })
                .unwrap();
        assert_eq!((made.subpolygons, made.shell.faces().len()), (36, 24));
        let area: f64 = made.shell.faces().iter().map(rest_area).sum();
        assert!((area - 6.0).abs() < 1e-12, "area {area}");
    }

    fn plane_of(face: &Face) -> Frame {
        let Chart::Plane(frame) = face.chart else { panic!("polygons are plane") };
        frame
    }

    /// Area of a patch's trim on the undeformed plane.
    fn rest_area(patch: &Face) -> f64 {
        let [_, s, t] = patch.chart.coordinates();
        let scale = s.cross(t).length();
        let loops = patch.region.loops().map(|l| polygon::doubled_area(patch.region.corners(&l)));
        loops.sum::<f64>() * 0.5 * scale
    }

    #[test]
    fn extreme_weights_are_split_until_positive() {
        let mut noise = Noise(21);
        let mut split = 0;
        for _ in 0..40 {
            let mut points = shaken_volume(&mut noise, [3; 3], false).control_points();
            for point in &mut points {
                point.w = libm::exp(12.0 * noise.next());
            }
            let axes = SplineVolume::identity([3; 3], [5; 3], [DVec3::ZERO, DVec3::ONE]).unwrap();
            let volume = SplineVolume::try_new(axes.axes().clone(), &points).unwrap();
            let corners = random_triangle(&mut noise, 5);
            let polygons = [PlanarPolygon { face: 0, corners: &corners }];
            let made =
                deform_polygons(&polygons, Deformation { volume: Some(&volume), ..Deformation::default() })
                    .unwrap();
            let groups = made.subpolygons;
            split += made.shell.faces().len() - groups;
            assert!(made.shell.faces().iter().all(|p| p.patch.has_positive_weights()));
            let area: f64 = made.shell.faces().iter().map(rest_area).sum();
            let want = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
            assert!((area - want).abs() < 1e-12, "area {area}, want {want}");
        }
        assert!(split > 0, "the weights are extreme enough to need a split");
    }
}
