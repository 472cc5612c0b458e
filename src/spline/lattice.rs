//! The control lattice of a volume, and the edits users make to it.

use glam::{DVec3, DVec4};
use thiserror::Error;

use crate::math::angle::sin_cos_deg;

use super::axis::{Axis, SignedAxis};
use super::knot_vector::KnotVector;
use super::volume::{SplineVolume, VolumeError, axes_over, domain, greville_points};

/// An edit names a control point in the held outer layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("control point {index:?} is in the {hold} outer layers that hold keeps")]
pub struct HeldPoint {
    /// Index of the control point.
    pub index: [usize; 3],
    /// Number of layers held.
    pub hold: usize,
}

/// The control points of a volume while they are edited: Cartesian, each with a weight.
#[derive(Clone, Debug, PartialEq)]
pub struct ControlLattice {
    axes: [KnotVector; 3],
    bounds: [DVec3; 2],
    /// Third index fastest.
    points: Vec<DVec4>,
    hold: usize,
}

impl ControlLattice {
    /// The identity over a box: control points at the Greville abscissae, weights 1. The `hold` outermost layers of
    /// control points stay in all edits.
    ///
    /// # Errors
    /// [`VolumeError::Knots`] for a degree, number of points or box that is not valid.
    pub fn identity(
        degree: [usize; 3],
        points: [usize; 3],
        bounds: [DVec3; 2],
        hold: usize,
    ) -> Result<Self, VolumeError> {
        Ok(Self::identity_of(axes_over(degree, points, bounds)?, hold))
    }

    /// The identity over the domains of knot vectors: control points at the Greville abscissae, weights 1.
    #[must_use]
    pub fn identity_of(axes: [KnotVector; 3], hold: usize) -> Self {
        let (bounds, points) = (domain(&axes), greville_points(&axes));
        Self { axes, bounds, points, hold }
    }

    /// The volume of the lattice as it stands.
    ///
    /// # Errors
    /// [`VolumeError`] if a control point is not finite or a weight not positive.
    pub fn volume(&self) -> Result<SplineVolume, VolumeError> {
        SplineVolume::try_new(self.axes.clone(), &self.points)
    }

    /// Numbers of control points along the three axes.
    #[must_use]
    pub fn counts(&self) -> [usize; 3] {
        std::array::from_fn(|axis| self.axes[axis].points())
    }

    /// Control points, Cartesian with the weight as fourth component, third index fastest.
    #[must_use]
    pub fn points(&self) -> &[DVec4] {
        &self.points
    }

    /// Least and greatest corner of the box.
    #[must_use]
    pub const fn bounds(&self) -> [DVec3; 2] {
        self.bounds
    }

    /// The basis functions at a point of the box, without weights: places of control points in [`Self::points`] and values.
    /// `None` outside the box.
    #[must_use]
    pub fn basis(&self, parameters: DVec3) -> Option<Vec<(usize, f64)>> {
        let [_, ny, nz] = self.counts();
        let mut basis = vec![(0, 1.0)];
        for (axis, knots) in self.axes.iter().enumerate() {
            let interval = knots.interval(parameters[axis])?;
            let (values, _) = knots.basis_with_derivatives(interval, parameters[axis]);
            let (first, step) = (knots.first_point(interval), [ny * nz, nz, 1][axis]);
            basis = basis
                .iter()
                .flat_map(|&(flat, factor): &(usize, f64)| {
                    (0..=knots.degree()).map(move |i| (flat + (first + i) * step, factor * values[i]))
                })
                .collect();
        }
        Some(basis)
    }

    /// How the position of a point of the box depends on the control points: places in [`Self::points`] and factors. The
    /// derivative of the position by such a control point, weights fixed, is the factor times the identity. `None` outside
    /// the box.
    #[must_use]
    pub fn derivatives(&self, parameters: DVec3) -> Option<Vec<(usize, f64)>> {
        let mut factors = self.basis(parameters)?;
        let mut sum = 0.0;
        for (flat, factor) in &mut factors {
            *factor *= self.points[*flat].w;
            sum += *factor;
        }
        factors.iter_mut().for_each(|(_, factor)| *factor /= sum);
        Some(factors)
    }

    /// Where the lattice takes a point of the box; `None` outside.
    #[must_use]
    pub fn position(&self, parameters: DVec3) -> Option<DVec3> {
        let weighted = |(flat, value): (usize, f64)| {
            let point = self.points[flat];
            (point.truncate() * point.w).extend(point.w) * value
        };
        let sum: DVec4 = self.basis(parameters)?.into_iter().map(weighted).sum();
        Some(sum.truncate() / sum.w)
    }

    /// Whether a control point is in the held outer layers.
    #[must_use]
    pub fn is_held(&self, index: [usize; 3]) -> bool {
        let counts = self.counts();
        (0..3).any(|axis| index[axis] < self.hold || index[axis] + self.hold >= counts[axis])
    }

    /// Index (i, j, k) of a control point from its place in [`Self::points`].
    #[must_use]
    pub fn index_of(&self, flat: usize) -> [usize; 3] {
        let [_, ny, nz] = self.counts();
        [flat / (ny * nz), flat / nz % ny, flat % nz]
    }

    fn free_point(&mut self, index: [usize; 3]) -> Result<&mut DVec4, HeldPoint> {
        if self.is_held(index) {
            return Err(HeldPoint { index, hold: self.hold });
        }
        let [_, ny, nz] = self.counts();
        Ok(&mut self.points[(index[0] * ny + index[1]) * nz + index[2]])
    }

    /// Moves one control point by an offset.
    ///
    /// # Errors
    /// [`HeldPoint`] if it is held.
    ///
    /// # Panics
    /// If there is no such control point.
    pub fn move_by(&mut self, index: [usize; 3], offset: DVec3) -> Result<(), HeldPoint> {
        *self.free_point(index)? += offset.extend(0.0);
        Ok(())
    }

    /// Moves one control point to a place; its weight stays.
    ///
    /// # Errors
    /// [`HeldPoint`] if it is held.
    ///
    /// # Panics
    /// If there is no such control point.
    pub fn move_to(&mut self, index: [usize; 3], place: DVec3) -> Result<(), HeldPoint> {
        let point = self.free_point(index)?;
        *point = place.extend(point.w);
        Ok(())
    }

    /// Sets the weight of one control point.
    ///
    /// # Errors
    /// [`HeldPoint`] if it is held.
    ///
    /// # Panics
    /// If there is no such control point.
    pub fn set_weight(&mut self, index: [usize; 3], weight: f64) -> Result<(), HeldPoint> {
        self.free_point(index)?.w = weight;
        Ok(())
    }

    /// Sets all control points, third index fastest; held ones must stay where they are.
    ///
    /// # Errors
    /// [`HeldPoint`], the first that would change.
    ///
    /// # Panics
    /// If their number is not the lattice's.
    pub fn set_all(&mut self, points: Vec<DVec4>) -> Result<(), HeldPoint> {
        assert_eq!(points.len(), self.points.len(), "one point for each of the lattice");
        let changed =
            |flat: &usize| self.is_held(self.index_of(*flat)) && points[*flat] != self.points[*flat];
        if let Some(flat) = (0..points.len()).find(changed) {
            return Err(HeldPoint { index: self.index_of(flat), hold: self.hold });
        }
        self.points = points;
        Ok(())
    }

    /// Applies a map to every control point that is not held; weights stay.
    fn map(&mut self, map: impl Fn(DVec3) -> DVec3) {
        for flat in 0..self.points.len() {
            if !self.is_held(self.index_of(flat)) {
                let point = &mut self.points[flat];
                *point = map(point.truncate()).extend(point.w);
            }
        }
    }

    /// Turns the control points about the box's centre line by the right-hand rule: by `angle` degrees at the far end,
    /// by none at the near end, in proportion between.
    ///
    /// Source: Barr (1984), *Global and local deformations of solid primitives*, section on twisting.
    pub fn twist(&mut self, axis: Axis, angle: f64) {
        let line = self.centre_line(axis);
        self.map(|point| {
            let (z, offset) = line.coordinates(point);
            let (sin, cos) = sin_cos_deg(angle * z);
            let turned = offset * cos + line.direction.cross(offset) * sin;
            line.point(point) + turned
        });
    }

    /// Scales the control points away from the box's centre line: by `scale` along the two other axes at the far end,
    /// by 1 at the near end, in proportion between.
    ///
    /// Source: Barr (1984), section on tapering.
    pub fn taper(&mut self, axis: Axis, scale: [f64; 2]) {
        let line = self.centre_line(axis);
        let [a, b] = axis.cross_axes().map(Axis::index);
        self.map(|point| {
            let (z, mut offset) = line.coordinates(point);
            offset[a] *= 1.0 + (scale[0] - 1.0) * z;
            offset[b] *= 1.0 + (scale[1] - 1.0) * z;
            line.point(point) + offset
        });
    }

    /// Scales the distance from the box's centre line by 1 + amount · sin(π z), z from 0 at the near end to 1 at the far.
    pub fn bulge(&mut self, axis: Axis, amount: f64) {
        let line = self.centre_line(axis);
        self.map(|point| {
            let (z, offset) = line.coordinates(point);
            let (sin, _) = sin_cos_deg(180.0 * z);
            line.point(point) + offset * (1.0 + amount * sin)
        });
    }

    /// Bends the box's centre line to an arc of the same length that starts along the axis and turns by `angle` degrees
    /// to the side `toward`; cross-sections stay flat and square to it. Beyond the ends it goes on straight.
    ///
    /// Source: Barr (1984), section on bending.
    pub fn bend(&mut self, axis: Axis, angle: f64, toward: SignedAxis) {
        if angle == 0.0 {
            return;
        }
        let line = self.centre_line(axis);
        let side = DVec3::AXES[toward.axis.index()] * toward.sign();
        let radius = line.length / angle.to_radians();
        self.map(|point| {
            let (z, offset) = line.coordinates(point);
            let beyond = line.along(point) - z * line.length;
            let (sin, cos) = sin_cos_deg(angle * z);
            let across = offset.dot(side);
            let tangent = cos * line.direction + sin * side;
            let inward = cos * side - sin * line.direction;
            let arc = radius * (sin * line.direction + (1.0 - cos) * side);
            line.near + arc + beyond * tangent + across * inward + (offset - across * side)
        });
    }

    fn centre_line(&self, axis: Axis) -> CentreLine {
        let [low, high] = self.bounds;
        let direction = DVec3::AXES[axis.index()];
        let middle = 0.5 * (low + high);
        let length = (high - low)[axis.index()];
        let mut near = middle;
        near[axis.index()] = low[axis.index()];
        CentreLine { near, direction, length }
    }
}

/// The line through the box's middle along an axis.
struct CentreLine {
    near: DVec3,
    direction: DVec3,
    length: f64,
}

impl CentreLine {
    /// Distance along the line from the near end.
    fn along(&self, point: DVec3) -> f64 {
        (point - self.near).dot(self.direction)
    }

    /// Nearest point of the line.
    fn point(&self, point: DVec3) -> DVec3 {
        self.near + self.along(point) * self.direction
    }

    /// Place along the line, 0 to 1 from end to end and held there beyond, and the offset from the line.
    fn coordinates(&self, point: DVec3) -> (f64, DVec3) {
        let z = (self.along(point) / self.length).clamp(0.0, 1.0);
        (z, point - self.point(point))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(hold: usize) -> ControlLattice {
        ControlLattice::identity([2; 3], [4, 5, 6], [DVec3::ZERO, DVec3::new(2.0, 2.0, 4.0)], hold).unwrap()
    }

    fn corner(lattice: &ControlLattice, index: [usize; 3]) -> DVec3 {
        let [_, ny, nz] = lattice.counts();
        lattice.points()[(index[0] * ny + index[1]) * nz + index[2]].truncate()
    }

    fn assert_near(got: DVec3, want: DVec3) {
        assert!((got - want).length() < 1e-15 * 8.0, "got {got}, want {want}");
    }

    #[test]
    fn twist_turns_the_far_end_by_the_right_hand_rule() {
        let mut twisted = lattice(0);
        twisted.twist(Axis::Z, 90.0);
        assert_near(corner(&twisted, [0, 0, 0]), DVec3::ZERO);
        assert_near(corner(&twisted, [3, 0, 5]), DVec3::new(2.0, 2.0, 4.0));
        assert_near(corner(&twisted, [3, 4, 5]), DVec3::new(0.0, 2.0, 4.0));
    }

    #[test]
    fn taper_and_bulge_scale_about_the_centre_line() {
        let mut tapered = lattice(0);
        tapered.taper(Axis::Z, [0.5, 2.0]);
        assert_near(corner(&tapered, [3, 4, 5]), DVec3::new(1.5, 3.0, 4.0));
        assert_near(corner(&tapered, [3, 4, 0]), DVec3::new(2.0, 2.0, 0.0));
        let mut bulged = lattice(0);
        bulged.bulge(Axis::Y, 0.5);
        assert_near(corner(&bulged, [3, 2, 5]), DVec3::new(2.5, 1.0, 5.0));
        assert_near(corner(&bulged, [3, 4, 5]), DVec3::new(2.0, 2.0, 4.0));
    }

    #[test]
    fn bend_makes_a_quarter_circle_of_the_centre_line() {
        let mut bent = lattice(0);
        bent.bend(Axis::Z, 90.0, SignedAxis { axis: Axis::X, negative: false });
        let radius = 4.0 / std::f64::consts::FRAC_PI_2;
        // the far end's corners: the centre at (1 + radius, 1, radius), x turned to -z
        assert_near(corner(&bent, [0, 0, 5]), DVec3::new(1.0 + radius, 0.0, radius + 1.0));
        assert_near(corner(&bent, [3, 4, 5]), DVec3::new(1.0 + radius, 2.0, radius - 1.0));
        assert_near(corner(&bent, [3, 4, 0]), DVec3::new(2.0, 2.0, 0.0));
    }

    #[test]
    fn derivatives_are_what_moved_control_points_do() {
        let mut rational = lattice(0);
        rational.set_weight([1, 2, 3], 2.5).unwrap();
        let place = DVec3::new(0.7, 1.1, 2.3);
        let before = rational.position(place).unwrap();
        let factors = rational.derivatives(place).unwrap();
        assert_eq!(factors.len(), 27);
        assert!((factors.iter().map(|(_, factor)| factor).sum::<f64>() - 1.0).abs() < 1e-15);
        for (flat, factor) in factors {
            let mut moved = rational.clone();
            let by = DVec3::new(0.5, -1.0, 0.25);
            moved.move_by(rational.index_of(flat), by).unwrap();
            assert_near(moved.position(place).unwrap(), before + factor * by);
        }
        assert_eq!(rational.derivatives(DVec3::splat(-1.0)), None);
    }

    #[test]
    fn held_layers_stay_and_may_not_be_named() {
        let mut held = lattice(1);
        let before = held.clone();
        held.twist(Axis::X, 45.0);
        for flat in 0..held.points().len() {
            let index = held.index_of(flat);
            assert_eq!(held.is_held(index), held.points()[flat] == before.points()[flat], "{index:?}");
        }
        assert_eq!(held.move_by([0, 2, 2], DVec3::ONE), Err(HeldPoint { index: [0, 2, 2], hold: 1 }));
        assert_eq!(held.move_by([1, 2, 2], DVec3::ONE), Ok(()));
        let mut points = held.points().to_vec();
        assert_eq!(held.set_all(points.clone()), Ok(()));
        points[0].x += 1.0;
        assert_eq!(held.set_all(points), Err(HeldPoint { index: [0, 0, 0], hold: 1 }));
    }
}
