//! The (rational) tensor-product B-spline volume of a free-form deformation.

use fearless_simd::Level;
use glam::{DMat3, DVec3, DVec4};
use thiserror::Error;

use crate::math::lanes::with_vectors;

use super::knot_vector::{KnotError, KnotVector};

/// A knot box: the interval, counted from 0, along each axis.
pub type KnotBox = [usize; 3];

/// Why a volume cannot be made.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum VolumeError {
    /// One axis has no valid knot vector.
    #[error("axis {}: {source}", ["x", "y", "z"][*axis])]
    Knots {
        /// 0, 1, 2 for x, y, z.
        axis: usize,
        /// What is wrong.
        source: KnotError,
    },
    /// The number of control points is not the product of the axes' numbers.
    #[error("{got} control points given, {want} needed")]
    Count {
        /// Number given.
        got: usize,
        /// Number needed.
        want: usize,
    },
    /// A control point is NaN or infinite.
    #[error("control point {index:?} is not finite")]
    NotFinite {
        /// Index (i, j, k) of the control point.
        index: [usize; 3],
    },
    /// A weight is not positive.
    #[error("weight {weight} of control point {index:?} is not positive")]
    Weight {
        /// Index (i, j, k) of the control point.
        index: [usize; 3],
        /// Its weight.
        weight: f64,
    },
}

/// A volume's value and Jacobian at one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumePoint {
    /// The deformed point.
    pub position: DVec3,
    /// Partial derivatives by the three parameters, as columns.
    pub jacobian: DMat3,
}

/// A tensor-product B-spline volume, rational if its weights differ.
///
/// Q(u) = Σ `w_a` `P_a` `N_a(u)` / Σ `w_a` `N_a(u)`, with the parameters u the coordinates of the undeformed point.
/// With control points at the Greville abscissae and equal weights it is the identity.
///
/// Source: Feng, Nishita, Jin, Peng (2002), section 3.1.
#[derive(Clone, Debug, PartialEq)]
pub struct SplineVolume {
    axes: [KnotVector; 3],
    /// (w x, w y, w z, w), the third index fastest.
    homogeneous: Vec<DVec4>,
    rational: bool,
}

impl SplineVolume {
    /// A volume with the given control points (Cartesian, weight as fourth component), the third index
    /// running fastest, then the second, then the first.
    ///
    /// # Errors
    /// [`VolumeError`] if the number of control points does not fit, or one is not finite or has a weight
    /// that is not positive.
    pub fn try_new(axes: [KnotVector; 3], control_points: &[DVec4]) -> Result<Self, VolumeError> {
        let counts = [axes[0].points(), axes[1].points(), axes[2].points()];
        let want = counts.iter().product();
        if control_points.len() != want {
            return Err(VolumeError::Count { got: control_points.len(), want });
        }
        for (flat, point) in control_points.iter().enumerate() {
            let index = [flat / (counts[1] * counts[2]), flat / counts[2] % counts[1], flat % counts[2]];
            if !point.is_finite() {
                return Err(VolumeError::NotFinite { index });
            }
            // NaN was refused above
            if point.w <= 0.0 {
                return Err(VolumeError::Weight { index, weight: point.w });
            }
        }
        let first = control_points[0].w;
        let rational = control_points.iter().any(|point| point.w != first);
        let homogeneous = control_points
            .iter()
            .map(|point| {
                if rational {
                    (point.truncate() * point.w).extend(point.w)
                } else {
                    point.truncate().extend(1.0)
                }
            })
            .collect();
        Ok(Self { axes, homogeneous, rational })
    }

    /// The identity lattice over a box: control points at the Greville abscissae, weights 1.
    ///
    /// # Errors
    /// [`VolumeError::Knots`] for a degree, number of points or box that is not valid.
    pub fn identity(degree: [usize; 3], points: [usize; 3], bounds: [DVec3; 2]) -> Result<Self, VolumeError> {
        let axes = axes_over(degree, points, bounds)?;
        let control_points = greville_points(&axes);
        Self::try_new(axes, &control_points)
    }

    /// The knot vectors of the three axes.
    #[must_use]
    pub fn axes(&self) -> &[KnotVector; 3] {
        &self.axes
    }

    /// Degrees along the three axes.
    #[must_use]
    pub fn degree(&self) -> [usize; 3] {
        std::array::from_fn(|axis| self.axes[axis].degree())
    }

    /// Numbers of control points along the three axes.
    #[must_use]
    pub fn points(&self) -> [usize; 3] {
        std::array::from_fn(|axis| self.axes[axis].points())
    }

    /// Whether the weights differ.
    #[must_use]
    pub fn is_rational(&self) -> bool {
        self.rational
    }

    /// Lowest and highest corner of the parameter domain.
    #[must_use]
    pub fn bounds(&self) -> [DVec3; 2] {
        domain(&self.axes)
    }

    /// Control points, Cartesian with the weight as fourth component (1 throughout if not rational).
    #[must_use]
    pub fn control_points(&self) -> Vec<DVec4> {
        self.homogeneous.iter().map(|h| (h.truncate() / h.w).extend(h.w)).collect()
    }

    /// The first of the control points that act in a knot box.
    pub(crate) fn first_point(&self, knot_box: KnotBox) -> [usize; 3] {
        std::array::from_fn(|axis| self.axes[axis].first_point(knot_box[axis]))
    }

    /// The sum of the degrees: that of a patch across all axes.
    #[must_use]
    pub fn total_degree(&self) -> usize {
        self.degree().iter().sum()
    }

    /// Homogeneous control point (w x, w y, w z, w).
    pub(crate) fn homogeneous(&self, i: usize, j: usize, k: usize) -> DVec4 {
        self.homogeneous[(i * self.axes[1].points() + j) * self.axes[2].points() + k]
    }

    /// The knot box of a point: half open along each axis, the last box closed; `None` outside the domain.
    #[must_use]
    pub fn knot_box(&self, parameters: DVec3) -> Option<KnotBox> {
        Some([
            self.axes[0].interval(parameters.x)?,
            self.axes[1].interval(parameters.y)?,
            self.axes[2].interval(parameters.z)?,
        ])
    }

    /// The deformed point and the Jacobian; `None` outside the domain.
    #[must_use]
    pub fn eval(&self, parameters: DVec3) -> Option<VolumePoint> {
        Some(self.eval_in_knot_box(self.knot_box(parameters)?, parameters))
    }

    /// The deformed point alone, which takes a third of the time of [`Self::eval`]; `None` outside the domain.
    #[must_use]
    pub fn position(&self, parameters: DVec3) -> Option<DVec3> {
        let sum = self.homogeneous_in_knot_box(self.knot_box(parameters)?, parameters);
        Some(if self.rational { sum.truncate() / sum.w } else { sum.truncate() })
    }

    /// As [`Self::position`] for many points, with the processor's vectors: calls `put` with each point and where it goes.
    pub fn positions(&self, points: impl Iterator<Item = DVec3>, put: impl FnMut(DVec3, Option<DVec3>)) {
        let level = Level::new();
        match self.axes[2].degree() {
            1 => with_vectors!(level, _simd => self.positions_of_order::<2>(points, put)),
            2 => with_vectors!(level, _simd => self.positions_of_order::<3>(points, put)),
            3 => with_vectors!(level, _simd => self.positions_of_order::<4>(points, put)),
            _ => with_vectors!(level, _simd => self.positions_of_order::<5>(points, put)),
        }
    }

    #[inline(always)]
    fn positions_of_order<const ORDER: usize>(
        &self,
        points: impl Iterator<Item = DVec3>,
        mut put: impl FnMut(DVec3, Option<DVec3>),
    ) {
        for point in points {
            let sum = self.knot_box(point).map(|knot_box| self.sum_of_rows::<ORDER>(knot_box, point));
            put(point, sum.map(|sum| if self.rational { sum.truncate() / sum.w } else { sum.truncate() }));
        }
    }

    /// The polynomial (rational) piece of one knot box, at any real parameters.
    ///
    /// Source: Feng, Nishita, Jin, Peng (2002), section 3.4.2, the generalised de Boor-Cox algorithm.
    ///
    /// # Panics
    /// If there is no such knot box.
    #[must_use]
    pub fn eval_in_knot_box(&self, knot_box: KnotBox, parameters: DVec3) -> VolumePoint {
        let sums = self.sums_in_knot_box(knot_box, parameters);
        let position = sums[0].truncate() / sums[0].w;
        let partial = |sum: DVec4| (sum.truncate() - sum.w * position) / sums[0].w;
        VolumePoint {
            position,
            jacobian: DMat3::from_cols(partial(sums[1]), partial(sums[2]), partial(sums[3])),
        }
    }

    /// The homogeneous value (w x, w y, w z, w) of one knot box' piece, at any real parameters.
    pub(crate) fn homogeneous_in_knot_box(&self, knot_box: KnotBox, parameters: DVec3) -> DVec4 {
        match self.axes[2].degree() {
            1 => self.sum_of_rows::<2>(knot_box, parameters),
            2 => self.sum_of_rows::<3>(knot_box, parameters),
            3 => self.sum_of_rows::<4>(knot_box, parameters),
            4 => self.sum_of_rows::<5>(knot_box, parameters),
            5 => self.sum_of_rows::<6>(knot_box, parameters),
            6 => self.sum_of_rows::<7>(knot_box, parameters),
            7 => self.sum_of_rows::<8>(knot_box, parameters),
            _ => self.sum_of_rows::<9>(knot_box, parameters),
        }
    }

    /// As [`Self::homogeneous_in_knot_box`], with sums along the last axis of a length known when compiling.
    #[inline(always)]
    fn sum_of_rows<const ORDER: usize>(&self, knot_box: KnotBox, parameters: DVec3) -> DVec4 {
        let p = parameters.to_array();
        let [nu, nv, nw]: [_; 3] = std::array::from_fn(|axis| self.axes[axis].basis(knot_box[axis], p[axis]));
        let [ku, kv, _] = self.degree();
        let first = self.first_point(knot_box);
        let (columns, depth) = (self.axes[1].points(), self.axes[2].points());
        let mut sum = DVec4::ZERO;
        for (i, nu) in nu.iter().enumerate().take(ku + 1) {
            for (j, nv) in nv.iter().enumerate().take(kv + 1) {
                let start = ((first[0] + i) * columns + first[1] + j) * depth + first[2];
                let row = &self.homogeneous[start..start + ORDER];
                let mut of_row = DVec4::ZERO;
                for k in 0..ORDER {
                    of_row += nw[k] * row[k];
                }
                sum += nu * nv * of_row;
            }
        }
        sum
    }

    /// Homogeneous value and partials of one knot box' piece.
    fn sums_in_knot_box(&self, knot_box: KnotBox, parameters: DVec3) -> [DVec4; 4] {
        let p = parameters.to_array();
        let bases: [_; 3] = std::array::from_fn(|a| self.axes[a].basis_with_derivatives(knot_box[a], p[a]));
        let [(nu, du), (nv, dv), (nw, dw)] = bases;
        let [ku, kv, kw] = self.degree();
        let first = self.first_point(knot_box);
        let mut sums = [DVec4::ZERO; 4];
        for i in 0..=ku {
            for j in 0..=kv {
                let (mut value, mut slope) = (DVec4::ZERO, DVec4::ZERO);
                for k in 0..=kw {
                    let point = self.homogeneous(first[0] + i, first[1] + j, first[2] + k);
                    value += nw[k] * point;
                    slope += dw[k] * point;
                }
                sums[0] += nu[i] * nv[j] * value;
                sums[1] += du[i] * nv[j] * value;
                sums[2] += nu[i] * dv[j] * value;
                sums[3] += nu[i] * nv[j] * slope;
            }
        }
        sums
    }

    /// Bound on how much farther than the undeformed points two deformed points can be from each other.
    ///
    /// Along an axis the derivative's control points are k (`P_i+1` - `P_i`) / (`U_i+k+1` - `U_i+1`); a rational volume's
    /// derivative is bounded by (greatest weight / least weight)² times that.
    ///
    /// Source: Floater (1992), *Derivatives of rational Bézier curves*, for the rational bound.
    pub(crate) fn lipschitz_bound(&self) -> f64 {
        let counts = self.points();
        let steps = [counts[1] * counts[2], counts[2], 1];
        let mut sum_sq = 0.0;
        for (axis, knots) in self.axes.iter().enumerate() {
            let k = knots.degree();
            let mut greatest: f64 = 0.0;
            for flat in 0..self.homogeneous.len() {
                let i = flat / steps[axis] % counts[axis];
                if i + 1 < counts[axis] {
                    let (a, b) = (self.homogeneous[flat], self.homogeneous[flat + steps[axis]]);
                    let difference = (b.truncate() / b.w - a.truncate() / a.w).length();
                    let extent = knots.knots()[i + k + 1] - knots.knots()[i + 1];
                    greatest = greatest.max(k as f64 * difference / extent);
                }
            }
            sum_sq += greatest * greatest;
        }
        let weights = self.homogeneous.iter().map(|point| point.w);
        let (least, most) =
            weights.fold((f64::INFINITY, 0.0_f64), |(low, high), w| (low.min(w), high.max(w)));
        sum_sq.sqrt() * (most / least) * (most / least)
    }
}

/// Lowest and highest corner of the box of knot vectors' domains.
pub(crate) fn domain(axes: &[KnotVector; 3]) -> [DVec3; 2] {
    let [x, y, z] = axes.each_ref().map(KnotVector::domain);
    [0, 1].map(|end| DVec3::new(x[end], y[end], z[end]))
}

/// How a lattice's knots lie.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum KnotLayout {
    /// Evenly, with ends as often as the control points at the ends are reached.
    #[default]
    Clamped,
    /// Evenly, beyond the box as well.
    Uniform,
    /// As these, whose domains are taken to the box; their degrees and numbers of control points are the lattice's.
    Given(Box<[KnotVector; 3]>),
}

impl KnotLayout {
    /// The knot vectors over a box.
    ///
    /// # Errors
    /// [`VolumeError::Knots`] for a degree, number of points, knots or box that is not valid.
    pub(crate) fn axes(
        &self,
        degree: [usize; 3],
        points: [usize; 3],
        bounds: [DVec3; 2],
    ) -> Result<[KnotVector; 3], VolumeError> {
        let make = |axis: usize| {
            let (degree, points, start, end) = (degree[axis], points[axis], bounds[0][axis], bounds[1][axis]);
            let made = match self {
                Self::Clamped => KnotVector::clamped_uniform(degree, points, start, end),
                Self::Uniform => KnotVector::uniform(degree, points, start, end),
                Self::Given(axes) => {
                    let given = &axes[axis];
                    let got = given.knots().len();
                    if given.degree() == degree && given.points() == points {
                        given.over(start, end)
                    } else {
                        Err(KnotError::Count { got, degree, points })
                    }
                }
            };
            made.map_err(|source| VolumeError::Knots { axis, source })
        };
        Ok([make(0)?, make(1)?, make(2)?])
    }
}

/// Clamped uniform knot vectors over a box.
pub(crate) fn axes_over(
    degree: [usize; 3],
    points: [usize; 3],
    bounds: [DVec3; 2],
) -> Result<[KnotVector; 3], VolumeError> {
    KnotLayout::Clamped.axes(degree, points, bounds)
}

/// The control points of the identity, weights 1, third index fastest.
pub(crate) fn greville_points(axes: &[KnotVector; 3]) -> Vec<DVec4> {
    let mut points = Vec::with_capacity(axes.iter().map(KnotVector::points).product());
    for i in 0..axes[0].points() {
        for j in 0..axes[1].points() {
            for k in 0..axes[2].points() {
                points.push(DVec4::new(axes[0].greville(i), axes[1].greville(j), axes[2].greville(k), 1.0));
            }
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Noise;

    fn bent_volume(degree: [usize; 3], rational: bool) -> SplineVolume {
        let bounds = [DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 3.0, 2.5)];
        let points = degree.map(|k| k + 3);
        let axes = axes_over(degree, points, bounds).unwrap();
        let mut noise = Noise(7);
        let control_points: Vec<_> = greville_points(&axes)
            .into_iter()
            .map(|p| {
                let shift = noise.vector();
                let weight = if rational { 1.0 + noise.next() } else { 1.0 };
                (p.truncate() + 0.4 * shift).extend(weight)
            })
            .collect();
        SplineVolume::try_new(axes, &control_points).unwrap()
    }

    #[test]
    fn the_position_alone_is_that_with_the_jacobian() {
        let mut noise = Noise(5);
        for (degree, rational) in [([1, 2, 3], false), ([4, 3, 1], true), ([2, 4, 4], true)] {
            let volume = bent_volume(degree, rational);
            let [low, high] = volume.bounds();
            for _ in 0..50 {
                let place = low + (high - low) * noise.vector().abs();
                let [alone, full] = [volume.position(place), volume.eval(place).map(|point| point.position)];
                assert!(alone.unwrap().distance(full.unwrap()) < 1e-14, "{degree:?} at {place}");
            }
            assert_eq!(volume.position(high + 0.1), None);
            let places = [low, low - 1.0, 0.3 * low + 0.7 * high];
            let mut many = Vec::new();
            volume.positions(places.into_iter(), |place, position| many.push((place, position)));
            assert_eq!(many, places.map(|place| (place, volume.position(place))));
        }
    }

    #[test]
    fn the_first_lattice_is_the_identity_with_identity_jacobian() {
        for k in 1..=4 {
            let bounds = [DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 3.0, 2.5)];
            let volume = SplineVolume::identity([k, 5 - k, 2], [k + 3, 7, 4], bounds).unwrap();
            let mut noise = Noise(3);
            for _ in 0..200 {
                let unit = noise.vector() + 0.5;
                let point = bounds[0] + unit * (bounds[1] - bounds[0]);
                let got = volume.eval(point).unwrap();
                assert!((got.position - point).length() < 4e-15, "{got:?}");
                let off = got.jacobian - DMat3::IDENTITY;
                assert!(off.to_cols_array().iter().all(|e| e.abs() < 1e-13), "{off:?}");
            }
        }
    }

    #[test]
    fn jacobian_matches_central_differences_and_pieces_join() {
        for rational in [false, true] {
            let volume = bent_volume([2, 3, 4], rational);
            let point = DVec3::new(0.21, 1.3, 2.31);
            let knot_box = volume.knot_box(point).unwrap();
            let got = volume.eval_in_knot_box(knot_box, point);
            for axis in 0..3 {
                let step = DVec3::AXES[axis] * 1e-6;
                let (ahead, behind) = (
                    volume.eval_in_knot_box(knot_box, point + step),
                    volume.eval_in_knot_box(knot_box, point - step),
                );
                let want = (ahead.position - behind.position) / 2e-6;
                assert!((got.jacobian.col(axis) - want).length() < 1e-8, "axis {axis}");
            }
            let knot = volume.axes()[0].breakpoints()[1];
            let at = DVec3::new(knot, 1.3, 2.31);
            let (left, right) =
                (volume.eval_in_knot_box([0, 1, 1], at), volume.eval_in_knot_box([1, 1, 1], at));
            assert!((left.position - right.position).length() < 1e-14, "continuous across a knot plane");
        }
    }

    #[test]
    fn equal_weights_are_not_rational() {
        let bounds = [DVec3::ZERO, DVec3::ONE];
        let axes = axes_over([2; 3], [4; 3], bounds).unwrap();
        let points: Vec<_> = greville_points(&axes).into_iter().map(|p| p.truncate().extend(2.0)).collect();
        let volume = SplineVolume::try_new(axes, &points).unwrap();
        assert!(!volume.is_rational());
        assert_eq!(volume.control_points()[0].w, 1.0);
    }

    #[test]
    fn bad_lattices_are_refused() {
        let axes = axes_over([2; 3], [4; 3], [DVec3::ZERO, DVec3::ONE]).unwrap();
        let mut points = greville_points(&axes);
        assert!(matches!(
            SplineVolume::try_new(axes.clone(), &points[1..]),
            Err(VolumeError::Count { got: 63, want: 64 })
        ));
        points[21].w = 0.0;
        let refused = SplineVolume::try_new(axes.clone(), &points);
        assert_eq!(refused, Err(VolumeError::Weight { index: [1, 1, 1], weight: 0.0 }));
        points[21] = DVec4::new(f64::NAN, 0.0, 0.0, 1.0);
        assert!(matches!(
            SplineVolume::try_new(axes, &points),
            Err(VolumeError::NotFinite { index: [1, 1, 1] })
        ));
    }
}
