//! Triangular Bézier patches: the form in which accurate deformations were kept before tensor-product patches.

use std::sync::OnceLock;

use glam::{DVec2, DVec3, DVec4};

use crate::math::bernstein::{MAX_DEGREE, binomial, inverse_binomial};
use crate::spline::{KnotBox, SplineVolume};

use super::bezier_patch::{BezierPatch, POLYNOMIAL, PatchPoint, RATIONAL, from_homogeneous};

/// Control points at [`MAX_DEGREE`].
const MAX_POINTS: usize = point_count(MAX_DEGREE);

/// A (rational) triangular Bézier patch of total degree K over a triangle A, B, C.
///
/// R(a, b, c) = Σ `P_ijk` K! / (i! j! k!) a^i b^j c^k over i + j + k = K, in barycentric coordinates, with `P_ijk` =
/// (w x, w y, w z, w) and a division by the weight at the end. Its parameters here are s = b and t = c: the affine ones of
/// the parallelogram A, B, B + C - A, C.
///
/// Source: Farin (1986), *Triangular Bernstein-Bézier patches*.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangularPatch {
    /// Control points, by j, then by k fastest, of three numbers each, or four if any weight is not 1.
    numbers: Box<[f64]>,
    degree: u8,
    rational: bool,
}

impl TriangularPatch {
    /// The piece of a volume in a knot box, along a triangle: a patch of the sum of the volume's degrees.
    ///
    /// The volume's piece is evaluated at the uniform barycentric grid, as many points as there are control points, and
    /// these are multiplied by the inverse of the matrix of the Bernstein polynomials there, made once for each degree.
    ///
    /// Source: Feng, Peng (2000), *Accelerating accurate B-spline free-form deformation through polynomial interpolation*;
    /// as in Feng, Nishita, Jin, Peng (2002) the B-spline volume itself is evaluated, not Bézier volumes made of it.
    ///
    /// # Panics
    /// If the volume has no such knot box.
    pub fn composed(volume: &SplineVolume, knot_box: KnotBox, corners: &[DVec3; 3]) -> Self {
        let degree = volume.degree().iter().sum();
        let inverse = Inverse::of_degree(degree);
        let [a, s, t] = [corners[0], corners[1] - corners[0], corners[2] - corners[0]];
        let mut samples = [DVec4::ZERO; MAX_POINTS];
        let samples = &mut samples[..point_count(degree)];
        for (sample, st) in samples.iter_mut().zip(&inverse.nodes) {
            *sample = volume.homogeneous_in_knot_box(knot_box, a + st.x * s + st.y * t);
        }
        // rows of the inverse sum to 1, so what the samples have in common needs not suffer its rounding
        let common = samples[0];
        for sample in samples.iter_mut() {
            *sample -= common;
        }
        let control_points = inverse.rows().map(|(columns, weights)| {
            let terms = columns.iter().zip(weights);
            terms.fold(common, |sum, (&column, &weight)| sum + weight * samples[usize::from(column)])
        });
        if volume.is_rational() {
            Self::from_numbers(degree, true, control_points.map(|point| point.to_array()))
        } else {
            Self::from_numbers(degree, false, control_points.map(|point| point.truncate().to_array()))
        }
    }

    /// The triangle itself: degree 1.
    pub fn flat(corners: &[DVec3; 3]) -> Self {
        let [a, b, c] = corners.map(|corner| corner.to_array());
        Self::from_numbers(1, false, [a, c, b].into_iter())
    }

    fn from_numbers<const STRIDE: usize>(
        degree: usize,
        rational: bool,
        points: impl Iterator<Item = [f64; STRIDE]>,
    ) -> Self {
        let mut numbers = Vec::with_capacity(point_count(degree) * STRIDE);
        for point in points {
            numbers.extend_from_slice(&point);
        }
        let degree = u8::try_from(degree).expect("a degree is at most 12");
        Self { numbers: numbers.into_boxed_slice(), degree, rational }
    }

    /// Total degree K.
    pub fn degree(&self) -> usize {
        usize::from(self.degree)
    }

    /// Homogeneous control points (w x, w y, w z, w), (K + 1)(K + 2) / 2 of them: by the exponent of b, then by that of c,
    /// which runs fastest.
    pub fn control_points(&self) -> impl ExactSizeIterator<Item = DVec4> + Clone {
        let stride = if self.rational { RATIONAL } else { POLYNOMIAL };
        self.numbers.chunks_exact(stride).map(|point| {
            let weight = point.get(3).copied().unwrap_or(1.0);
            DVec4::new(point[0], point[1], point[2], weight)
        })
    }

    /// Whether any weight may differ from 1.
    pub fn is_rational(&self) -> bool {
        self.rational
    }

    /// Memory of the control points in bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.numbers)
    }

    pub(super) fn is_finite(&self) -> bool {
        self.numbers.iter().all(|number| number.is_finite())
    }

    /// Point and partial derivatives by s = b and t = c, by de Casteljau's algorithm; at any real parameters, meant for
    /// s, t and 1 - s - t in `[0, 1]`.
    pub fn eval(&self, st: DVec2) -> PatchPoint {
        let degree = self.degree();
        let mut points = self.points();
        let barycentric = DVec3::new(1.0 - st.x - st.y, st.x, st.y);
        for level in (2..=degree).rev() {
            reduce(&mut points, degree, level, barycentric);
        }
        let [a, b, c] = [(0, 0), (1, 0), (0, 1)].map(|(j, k)| points[place(degree, j, k)]);
        let scale = f64::from(self.degree);
        let value = barycentric.x * a + barycentric.y * b + barycentric.z * c;
        from_homogeneous([value, scale * (b - a), scale * (c - a)])
    }

    /// The same polynomial as a tensor-product patch of degree K × K over the parallelogram of s and t in `[0, 1]`.
    ///
    /// The blossom of a total degree, f, gives that of the product: control point (i, j) is the mean of f over the pairings
    /// of i arguments s = 1 among K with j arguments t = 1 among K. With l pairs (1, 1), the corner D = B + C - A, these
    /// are f(D^l, B^(i-l), C^(j-l), A^(K-i-j+l)): the points of l steps of de Casteljau's algorithm at D. The patch is the
    /// triangular one to a few roundings times (3/2)^K on the triangle, and to 3^K far from it, at D.
    ///
    /// Source: Brueckner (1980), *Construction of Bézier points of quadrilaterals from those of triangles*; by blossoms as
    /// `DeRose`, Goldman, Hagen, Mann (1993).
    pub fn to_tensor_product(&self) -> BezierPatch {
        let degree = self.degree();
        let mut points = self.points();
        let mut net = vec![DVec4::ZERO; (degree + 1) * (degree + 1)];
        for l in 0..=degree {
            for i in l..=degree {
                for j in l..=degree - (i - l) {
                    let pairings = binomial(i, l) * binomial(degree - i, j - l) * inverse_binomial(degree, j);
                    net[i * (degree + 1) + j] += pairings * points[place(degree, i - l, j - l)];
                }
            }
            if l < degree {
                reduce(&mut points, degree, degree - l, DVec3::new(-1.0, 1.0, 1.0));
            }
        }
        if self.rational {
            BezierPatch::new([degree; 2], net)
        } else {
            BezierPatch::polynomial([degree; 2], net.into_iter().map(DVec4::truncate))
        }
    }

    /// About how far rounding may at most have moved the homogeneous control points of [`Self::composed`], and any point
    /// of the triangle with them: the condition of the inverse matrix times that of the points.
    pub(super) fn rounding(&self) -> f64 {
        let mut points = self.control_points();
        let first = points.next().unwrap_or(DVec4::ZERO);
        let spread = points.map(|point| (point - first).length()).fold(0.0, f64::max);
        f64::EPSILON * Inverse::of_degree(self.degree()).norm * (spread + first.length())
    }

    fn points(&self) -> [DVec4; MAX_POINTS] {
        let mut points = [DVec4::ZERO; MAX_POINTS];
        for (to, from) in points.iter_mut().zip(self.control_points()) {
            *to = from;
        }
        points
    }
}

/// Control points of a degree.
const fn point_count(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// Where the control point of exponents j of b and k of c is.
const fn place(degree: usize, j: usize, k: usize) -> usize {
    j * (2 * degree + 3 - j) / 2 + k
}

/// One step of de Casteljau's algorithm: points of degree `level`, in the places of `degree`, to those of one less.
fn reduce(points: &mut [DVec4; MAX_POINTS], degree: usize, level: usize, barycentric: DVec3) {
    for j in 0..level {
        for k in 0..level - j {
            let [a, b, c] = [(j, k), (j + 1, k), (j, k + 1)].map(|(j, k)| points[place(degree, j, k)]);
            points[place(degree, j, k)] = barycentric.x * a + barycentric.y * b + barycentric.z * c;
        }
    }
}

/// The inverse of the matrix of a degree's Bernstein polynomials at the uniform barycentric grid; more than half of its
/// entries are 0, for the points of a side depend on the samples there alone.
#[derive(Debug)]
struct Inverse {
    /// The grid, as (s, t).
    nodes: Vec<DVec2>,
    /// Where the entries of each row end.
    ends: Vec<u16>,
    columns: Vec<u8>,
    weights: Vec<f64>,
    /// Greatest sum of a row's absolute values.
    norm: f64,
}

impl Inverse {
    fn of_degree(degree: usize) -> &'static Self {
        static ALL: [OnceLock<Inverse>; MAX_DEGREE + 1] = [const { OnceLock::new() }; MAX_DEGREE + 1];
        ALL[degree].get_or_init(|| Self::new(degree))
    }

    /// Nothing is solved: a column has the control points of the Lagrange polynomial of a node, which is a product of
    /// linear forms with integer coefficients, so that each entry is a quotient of integers.
    ///
    /// Source: Silvester (1969), *High-order polynomial triangular finite elements for potential problems*, for the product.
    fn new(degree: usize) -> Self {
        let exponents: Vec<[usize; 3]> =
            (0..=degree).flat_map(|j| (0..=degree - j).map(move |k| [degree - j - k, j, k])).collect();
        let columns: Vec<Vec<f64>> = exponents.iter().map(|&node| lagrange(degree, node)).collect();
        let part = |exponent: usize| exponent as f64 / degree as f64;
        let mut made = Self {
            nodes: exponents.iter().map(|&[_, j, k]| DVec2::new(part(j), part(k))).collect(),
            ends: Vec::new(),
            columns: Vec::new(),
            weights: Vec::new(),
            norm: 0.0,
        };
        for row in 0..exponents.len() {
            for (number, column) in (0..).zip(&columns) {
                if column[row] != 0.0 {
                    made.columns.push(number);
                    made.weights.push(column[row]);
                }
            }
            made.ends.push(u16::try_from(made.weights.len()).expect("at most 91 × 91 entries"));
            made.norm = made.norm.max(columns.iter().map(|column| column[row].abs()).sum());
        }
        made
    }

    /// Columns and values of each row's entries.
    fn rows(&self) -> impl Iterator<Item = (&[u8], &[f64])> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| {
            let range = usize::from(start)..usize::from(end);
            (&self.columns[range.clone()], &self.weights[range])
        })
    }
}

/// Control points of the polynomial of a degree that is 1 at one node of the grid and 0 at the others.
///
/// For the node (i, j, k) / K it is the product over p < i of (K a - p (a + b + c)) / (i - p), and so on for b and c.
fn lagrange(degree: usize, node: [usize; 3]) -> Vec<f64> {
    let integer = |n: usize| i128::try_from(n).expect("a degree is at most 12");
    // coefficients of monomials; sums of absolute values stay below 24^12
    let mut product = vec![1_i128];
    let mut divisor = 1_i128;
    let mut reached = 0;
    for axis in 0..3 {
        for p in 0..node[axis] {
            let mut form = [-integer(p); 3];
            form[axis] += integer(degree);
            let mut raised = vec![0; point_count(reached + 1)];
            for j in 0..=reached {
                for k in 0..=reached - j {
                    let coefficient = product[place(reached, j, k)];
                    for ((dj, dk), factor) in [(0, 0), (1, 0), (0, 1)].into_iter().zip(form) {
                        raised[place(reached + 1, j + dj, k + dk)] += factor * coefficient;
                    }
                }
            }
            product = raised;
            reached += 1;
            divisor *= integer(p + 1);
        }
    }
    let multinomial = |j: usize, k: usize| binomial(degree, j) * binomial(degree - j, k);
    let places = (0..=degree).flat_map(|j| (0..=degree - j).map(move |k| (j, k)));
    places
        .zip(product)
        .map(|((j, k), monomial)| monomial as f64 / (divisor as f64 * multinomial(j, k)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::{Noise, random_volume};

    fn random_triangle(noise: &mut Noise) -> [DVec3; 3] {
        // in the first knot box, half the cube along each axis
        std::array::from_fn(|_| 0.5 * (noise.vector() + 0.5))
    }

    fn random_place(noise: &mut Noise) -> DVec2 {
        let [s, t] = [noise.next() + 0.5, noise.next() + 0.5];
        if s + t > 1.0 { DVec2::new(1.0 - s, 1.0 - t) } else { DVec2::new(s, t) }
    }

    #[test]
    fn patches_are_the_volume_on_their_triangles_and_convert_exactly() {
        let mut noise = Noise(41);
        for rational in [false, true] {
            let bound = if rational { 1e-11 } else { 1e-12 } * 3_f64.sqrt();
            for degree in (1..=4).flat_map(|u| (1..=4).flat_map(move |v| (1..=4).map(move |w| [u, v, w]))) {
                let volume = random_volume(&mut noise, degree, degree.map(|k| k + 2), 0.3, rational);
                for _ in 0..6 {
                    let corners = random_triangle(&mut noise);
                    let patch = TriangularPatch::composed(&volume, [0; 3], &corners);
                    let total = degree.iter().sum();
                    assert_eq!((patch.degree(), patch.is_rational()), (total, rational));
                    assert_eq!(patch.control_points().len(), (total + 1) * (total + 2) / 2);
                    let converted = patch.to_tensor_product();
                    assert_eq!(converted.degree(), [total; 2]);
                    for _ in 0..12 {
                        let st = random_place(&mut noise);
                        let [s, t] = [corners[1] - corners[0], corners[2] - corners[0]];
                        let place = corners[0] + st.x * s + st.y * t;
                        let want = volume.eval_in_knot_box([0; 3], place);
                        for got in [patch.eval(st), converted.eval(st)] {
                            let off = (got.position - want.position).length();
                            assert!(off <= bound, "{degree:?} rational {rational}: {off:e}");
                            let slopes = [(got.dp_ds, want.jacobian * s), (got.dp_dt, want.jacobian * t)];
                            for (got, want) in slopes {
                                assert!((got - want).length() <= 300.0 * bound, "{degree:?}: {got} {want}");
                            }
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_flat_patch_is_its_triangle() {
        let corners = random_triangle(&mut Noise(2));
        let patch = TriangularPatch::flat(&corners);
        for (st, want) in [(DVec2::ZERO, corners[0]), (DVec2::X, corners[1]), (DVec2::Y, corners[2])] {
            assert_eq!(patch.eval(st).position, want);
            assert!((patch.to_tensor_product().eval(st).position - want).length() < 1e-15);
        }
    }

    #[test]
    fn the_inverse_takes_samples_of_a_power_to_its_control_points() {
        for degree in 1..=MAX_DEGREE {
            let inverse = Inverse::of_degree(degree);
            // s^K has control point 1 at B and 0 elsewhere
            let samples: Vec<f64> =
                inverse.nodes.iter().map(|st| (0..degree).fold(1.0, |power, _| power * st.x)).collect();
            for (row, (columns, weights)) in inverse.rows().enumerate() {
                let terms = columns.iter().zip(weights);
                let got: f64 = terms.map(|(&column, weight)| weight * samples[usize::from(column)]).sum();
                let want = if row == place(degree, degree, 0) { 1.0 } else { 0.0 };
                assert!((got - want).abs() <= 1e-15 * inverse.norm, "degree {degree}: {got:e}");
            }
        }
    }
}
