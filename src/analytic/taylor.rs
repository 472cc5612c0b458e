//! Taylor expansions of a patch's polynomial and of a volume's pieces, and what they make of numbers and discs.

use glam::{DMat3, DVec2, DVec3, DVec4};

use crate::math::bernstein::{MAX_ORDER, binomial};
use crate::patch::BezierPatch;
use crate::spline::{KnotBox, MAX_VOLUME_ORDER, SplineVolume};

use super::jet::{Jet, Point, order_of};
use super::number::{Number, SIZES};

/// Coefficients of the polynomials a^i (1 - a)^(n - i) in a - a0, by i and by the power.
type Products = [[f64; MAX_ORDER]; MAX_ORDER];

/// Those of degree n up to a power.
fn products(n: usize, a0: f64, most: usize) -> Products {
    let mut rising = [[0.0; MAX_ORDER]; MAX_ORDER];
    let mut falling = rising;
    (rising[0][0], falling[0][0]) = (1.0, 1.0);
    for i in 0..n {
        for k in (0..=most.min(i + 1)).rev() {
            let (up, down) = if k > 0 { (rising[i][k - 1], falling[i][k - 1]) } else { (0.0, 0.0) };
            rising[i + 1][k] = a0 * rising[i][k] + up;
            falling[i + 1][k] = (1.0 - a0) * falling[i][k] - down;
        }
    }
    let mut products = [[0.0; MAX_ORDER]; MAX_ORDER];
    for (i, product) in products.iter_mut().enumerate().take(n + 1) {
        for k in 0..=most.min(n) {
            product[k] = (0..=k).map(|j| rising[i][j] * falling[n - i][k - j]).sum();
        }
    }
    products
}

/// A polynomial in one to three arguments about a place: homogeneous points, the third argument's power fastest.
#[derive(Clone, Debug)]
struct Expansion {
    /// Powers are up to these.
    powers: [usize; 3],
    coefficients: Vec<DVec4>,
    rational: bool,
}

impl Expansion {
    /// The expansion of a patch, in s and t, up to a power of each.
    fn of_patch(patch: &BezierPatch, st: DVec2, most: usize) -> Self {
        let degree = patch.degree();
        let powers = degree.map(|degree| degree.min(most));
        let along: [_; 2] = [0, 1].map(|axis| products(degree[axis], st[axis], powers[axis]));
        let columns = degree[1] + 1;
        let mut rows = vec![DVec4::ZERO; (degree[0] + 1) * (powers[1] + 1)];
        for (flat, point) in patch.control_points().enumerate() {
            let (i, j) = (flat / columns, flat % columns);
            let factor = binomial(degree[1], j);
            for k in 0..=powers[1] {
                rows[i * (powers[1] + 1) + k] += factor * along[1][j][k] * point;
            }
        }
        let mut coefficients = vec![DVec4::ZERO; (powers[0] + 1) * (powers[1] + 1)];
        for (i, row) in rows.chunks_exact(powers[1] + 1).enumerate() {
            let factor = binomial(degree[0], i);
            for l in 0..=powers[0] {
                for (k, &point) in row.iter().enumerate() {
                    coefficients[l * (powers[1] + 1) + k] += factor * along[0][i][l] * point;
                }
            }
        }
        Self { powers: [powers[0], powers[1], 0], coefficients, rational: patch.is_rational() }
    }

    /// The expansion of a knot box' piece, in its three coordinates, up to a power of each.
    fn of_volume(volume: &SplineVolume, knot_box: KnotBox, place: DVec3, most: usize) -> Self {
        let degree = volume.degree();
        let powers = degree.map(|degree| degree.min(most));
        // basis functions, by number and power
        let along: [_; 3] = std::array::from_fn(|axis| {
            let knots = &volume.axes()[axis];
            let ends = &knots.breakpoints()[knot_box[axis]..];
            let size = ends[1] - ends[0];
            let products = products(degree[axis], (place[axis] - ends[0]) / size, powers[axis]);
            let rows = knots.bernstein_rows(knot_box[axis]);
            let mut basis = [[0.0; MAX_VOLUME_ORDER]; MAX_VOLUME_ORDER];
            for (row, product) in rows.iter().zip(products).take(degree[axis] + 1) {
                let mut scale = 1.0;
                for k in 0..=powers[axis] {
                    for (function, factor) in basis.iter_mut().zip(row) {
                        function[k] += factor * product[k] * scale;
                    }
                    scale /= size;
                }
            }
            basis
        });
        let [nx, ny, nz] = powers.map(|power| power + 1);
        let first = volume.first_point(knot_box);
        let mut coefficients = vec![DVec4::ZERO; nx * ny * nz];
        let mut plane = [[DVec4::ZERO; MAX_VOLUME_ORDER]; MAX_VOLUME_ORDER];
        for i in 0..=degree[0] {
            plane[..ny].iter_mut().for_each(|row| row[..nz].fill(DVec4::ZERO));
            for j in 0..=degree[1] {
                let mut line = [DVec4::ZERO; MAX_VOLUME_ORDER];
                for (k, along_z) in along[2].iter().enumerate().take(degree[2] + 1) {
                    let point = volume.homogeneous(first[0] + i, first[1] + j, first[2] + k);
                    for (sum, &factor) in line.iter_mut().zip(along_z).take(nz) {
                        *sum += factor * point;
                    }
                }
                for (row, &factor) in plane.iter_mut().zip(&along[1][j]).take(ny) {
                    for (sum, point) in row.iter_mut().zip(line).take(nz) {
                        *sum += factor * point;
                    }
                }
            }
            for (a, &factor) in along[0][i].iter().enumerate().take(nx) {
                for b in 0..ny {
                    for c in 0..nz {
                        coefficients[(a * ny + b) * nz + c] += factor * plane[b][c];
                    }
                }
            }
        }
        Self { powers, coefficients, rational: volume.is_rational() }
    }

    /// The point at arguments whose values are numbers about the place of expansion.
    fn at<T: Number, const N: usize>(mut self, arguments: &Point<T, N>) -> Point<T, N> {
        let first = self.coefficients[0];
        let middle = first.truncate() / first.w;
        for point in &mut self.coefficients {
            *point -= (point.w * middle).extend(0.0);
        }
        let reach = arguments.each_ref().map(|argument| argument.value().reach());
        let mut sums = [Jet::<T, N>::constant(T::constant(0.0)); 4];
        // the arguments less their values
        let mut steps = *arguments;
        for step in &mut steps {
            step.coefficients[0] = T::constant(0.0);
        }
        let order = order_of(N);
        let (mut by_x, mut left) = (Jet::constant(T::constant(1.0)), order);
        for a in 0..=self.powers[0].min(order) {
            if a > 0 {
                (by_x, left) = (by_x.multiply(&steps[0]), order - a);
            }
            let mut by_y = by_x;
            for b in 0..=self.powers[1].min(left) {
                if b > 0 {
                    by_y = by_y.multiply(&steps[1]);
                }
                let mut by_z = by_y;
                for c in 0..=self.powers[2].min(left - b) {
                    if c > 0 {
                        by_z = by_z.multiply(&steps[2]);
                    }
                    let coefficient: [T; 4] = self.coefficient([a, b, c], &reach);
                    for (sum, coefficient) in
                        sums.iter_mut().zip(coefficient).take(if self.rational { 4 } else { 3 })
                    {
                        *sum = sum.add(&by_z.multiply(&Jet::constant(coefficient)));
                    }
                }
            }
        }
        let [x, y, z, weight] = sums;
        let offset = if self.rational {
            let inverse = weight.reciprocal();
            [x, y, z].map(|sum| sum.multiply(&inverse))
        } else {
            [x, y, z]
        };
        std::array::from_fn(|axis| offset[axis].plus(middle[axis]))
    }

    /// The Taylor coefficient about each number of the arguments' sets.
    fn coefficient<T: Number>(&self, [a, b, c]: [usize; 3], reach: &[[f64; SIZES]; 3]) -> [T; 4] {
        let at = self.get([a, b, c]).to_array();
        if T::SINGLE {
            return at.map(T::constant);
        }
        let mut radii = [[0.0; SIZES]; 4];
        let mut along_x = [1.0; SIZES];
        for i in a..=self.powers[0] {
            let mut along_y = along_x;
            for j in b..=self.powers[1] {
                let mut along_z = along_y;
                for k in c..=self.powers[2] {
                    if [i, j, k] != [a, b, c] {
                        let factor = binomial(i, a) * binomial(j, b) * binomial(k, c);
                        let size = factor * self.get([i, j, k]).abs();
                        for (radii, size) in radii.iter_mut().zip(size.to_array()) {
                            // an infinite distance along an axis that does not matter
                            if size != 0.0 {
                                for (radius, way) in radii.iter_mut().zip(along_z) {
                                    *radius += size * way;
                                }
                            }
                        }
                    }
                    times(&mut along_z, &reach[2]);
                }
                times(&mut along_y, &reach[1]);
            }
            times(&mut along_x, &reach[0]);
        }
        std::array::from_fn(|part| T::around(at[part], || radii[part]))
    }

    fn get(&self, [a, b, c]: [usize; 3]) -> DVec4 {
        self.coefficients[(a * (self.powers[1] + 1) + b) * (self.powers[2] + 1) + c]
    }
}

fn times(products: &mut [f64; SIZES], factors: &[f64; SIZES]) {
    for (product, factor) in products.iter_mut().zip(factors) {
        *product *= factor;
    }
}

/// Powers that an expansion needs: those of the derivatives, or for sets of numbers all.
const fn most_powers<T: Number, const N: usize>() -> usize {
    if T::SINGLE { order_of(N) } else { MAX_ORDER }
}

/// Whether single numbers with derivatives of this order are evaluated without expansions.
const fn is_linear<T: Number, const N: usize>() -> bool {
    T::SINGLE && order_of(N) <= 1
}

/// position + Σ derivative · (argument - its value).
fn linear<T: Number, const N: usize, const ARGUMENTS: usize>(
    position: DVec3,
    derivatives: [DVec3; ARGUMENTS],
    arguments: &[Jet<T, N>; ARGUMENTS],
) -> Point<T, N> {
    std::array::from_fn(|axis| {
        let mut jet = Jet::constant(T::constant(position[axis]));
        for k in 1..N {
            let terms = arguments.iter().zip(derivatives);
            let sum: f64 = terms.map(|(argument, by)| argument.coefficients[k].centre() * by[axis]).sum();
            jet.coefficients[k] = T::constant(sum);
        }
        jet
    })
}

/// A patch's point.
pub(super) fn on_patch<T: Number, const N: usize>(patch: &BezierPatch, st: &[Jet<T, N>; 2]) -> Point<T, N> {
    let [s, t] = st.each_ref().map(|parameter| parameter.value().centre());
    if is_linear::<T, N>() {
        if N == 1 {
            let (position, _) = patch.homogeneous(DVec2::new(s, t));
            return position.to_array().map(|x| Jet::constant(T::constant(x)));
        }
        let point = patch.eval(DVec2::new(s, t));
        return linear(point.position, [point.dp_ds, point.dp_dt], st);
    }
    let nothing = Jet::constant(T::constant(0.0));
    Expansion::of_patch(patch, DVec2::new(s, t), most_powers::<T, N>()).at(&[st[0], st[1], nothing])
}

/// The piece of a volume over a knot box, at a place.
pub(super) fn deformed<T: Number, const N: usize>(
    volume: &SplineVolume,
    knot_box: KnotBox,
    place: &Point<T, N>,
) -> Point<T, N> {
    let at = DVec3::from_array(place.each_ref().map(|coordinate| coordinate.value().centre()));
    if is_linear::<T, N>() {
        if N == 1 {
            let point = volume.homogeneous_in_knot_box(knot_box, at);
            return (point.truncate() / point.w).to_array().map(|x| Jet::constant(T::constant(x)));
        }
        let point = volume.eval_in_knot_box(knot_box, at);
        let DMat3 { x_axis, y_axis, z_axis } = point.jacobian;
        return linear(point.position, [x_axis, y_axis, z_axis], place);
    }
    Expansion::of_volume(volume, knot_box, at, most_powers::<T, N>()).at(place)
}
