//! Random choice by weights: of one among many, and of a point of the unit square.

use glam::DVec2;

/// Choice of an index with a probability in proportion to its weight.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Discrete {
    /// Sums of the weights up to and with each one.
    sums: Box<[f64]>,
}

impl Discrete {
    /// The distribution of weights that are finite and at least 0.
    pub(super) fn new(weights: impl IntoIterator<Item = f64>) -> Self {
        let mut sum = 0.0;
        let add = |weight| {
            sum += weight;
            sum
        };
        Self { sums: weights.into_iter().map(add).collect() }
    }

    /// Sum of all weights.
    pub(super) fn total(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }

    /// The index of `u`, uniform in `[0, 1)`, and what is left of `u`, uniform again; none if all weights are 0.
    pub(super) fn sample(&self, u: f64) -> Option<(usize, f64)> {
        let place = u * self.total();
        let index = self.sums.partition_point(|&sum| sum <= place);
        let end = *self.sums.get(index)?;
        let start = if index == 0 { 0.0 } else { self.sums[index - 1] };
        Some((index, ((place - start) / (end - start)).clamp(0.0, 1.0_f64.next_down())))
    }
}

/// Density over the unit square that is bilinear between the values at the corners of a grid.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bilinear {
    /// Values along u and along v.
    size: [usize; 2],
    /// Row by row along u; at least 0.
    values: Box<[f32]>,
    /// Choice of a row of cells, by its integral.
    rows: Discrete,
    /// Choice of a cell in each row.
    cells: Box<[Discrete]>,
}

impl Bilinear {
    /// In proportion to `values`, finite and at least 0, `size` of them along u and v, at least 2 each.
    pub(super) fn new(values: Vec<f32>, size: [usize; 2]) -> Self {
        let [width, height] = size;
        let value = |x: usize, y: usize| f64::from(values[y * width + x]);
        let integral = |x: usize, y: usize| {
            0.25 * (value(x, y) + value(x + 1, y) + value(x, y + 1) + value(x + 1, y + 1))
        };
        let cells: Box<[_]> =
            (0..height - 1).map(|y| Discrete::new((0..width - 1).map(|x| integral(x, y)))).collect();
        let rows = Discrete::new(cells.iter().map(Discrete::total));
        Self { size, values: values.into(), rows, cells }
    }

    /// The point of `u`, uniform in `[0, 1)²`, and its density; none if all values are 0.
    pub(super) fn sample(&self, u: DVec2) -> Option<(DVec2, f64)> {
        let (row, rest_v) = self.rows.sample(u.y)?;
        let (column, rest_u) = self.cells[row].sample(u.x)?;
        let [[a, b], [c, d]] = self.corners([column, row]);
        let y = sample_linear(rest_v, a + b, c + d);
        let x = sample_linear(rest_u, a + y * (c - a), b + y * (d - b));
        let cell = DVec2::new(column as f64, row as f64);
        Some((
            (cell + DVec2::new(x, y)) / self.cells_along(),
            self.density([[a, b], [c, d]], DVec2::new(x, y)),
        ))
    }

    /// Density at a point.
    pub(super) fn pdf(&self, uv: DVec2) -> f64 {
        let place = uv * self.cells_along();
        let cell = place.floor().clamp(DVec2::ZERO, self.cells_along() - 1.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole numbers of cells that there are; NaN is cell 0, and its density NaN"
        )]
        let corners = self.corners([cell.x as usize, cell.y as usize]);
        self.density(corners, place - cell)
    }

    fn cells_along(&self) -> DVec2 {
        DVec2::new((self.size[0] - 1) as f64, (self.size[1] - 1) as f64)
    }

    /// Values at a cell's corners, two along u in each row.
    fn corners(&self, [x, y]: [usize; 2]) -> [[f64; 2]; 2] {
        [y, y + 1].map(|y| [x, x + 1].map(|x| f64::from(self.values[y * self.size[0] + x])))
    }

    fn density(&self, [[a, b], [c, d]]: [[f64; 2]; 2], at: DVec2) -> f64 {
        let total = self.rows.total();
        let (low, high) = (a + at.x * (b - a), c + at.x * (d - c));
        let cells = self.cells_along();
        if total > 0.0 { (low + at.y * (high - low)) / total * (cells.x * cells.y) } else { 0.0 }
    }
}

/// The number of `[0, 1)` whose density is linear from `a` at 0 to `b` at 1, for a uniform `u`
/// (pbrt 4, `SampleLinear`).
fn sample_linear(u: f64, a: f64, b: f64) -> f64 {
    let root = (a * a + u * (b * b - a * a)).max(0.0).sqrt();
    if a + root > 0.0 { (u * (a + b) / (a + root)).min(1.0_f64.next_down()) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shade::Sampler;

    #[test]
    fn choices_have_their_probabilities() {
        let weights = [0.0, 1.0, 0.0, 3.0, 4.0, 0.0];
        let choice = Discrete::new(weights);
        assert_eq!(choice.total(), 8.0);
        let mut counts = [0.0; 6];
        let mut rest_sum = 0.0;
        for i in 0..8000 {
            let (index, rest) = choice.sample((f64::from(i) + 0.5) / 8000.0).unwrap();
            counts[index] += 1.0;
            rest_sum += rest;
        }
        assert_eq!(counts, weights.map(|weight| 1000.0 * weight));
        assert!((rest_sum / 8000.0 - 0.5).abs() < 1e-9, "what is left is uniform");
        assert_eq!(choice.sample(0.0).unwrap().0, 1);
        assert_eq!(choice.sample(1.0_f64.next_down()).unwrap().0, 4);
        assert_eq!(Discrete::new([0.0, 0.0]).sample(0.5), None);
        assert_eq!(Discrete::new([]).sample(0.5), None);
    }

    #[test]
    #[expect(clippy::cast_possible_truncation, reason = "numbers of boxes")]
    fn bilinear_samples_have_their_density() {
        let values = vec![0.0, 1.0, 3.0, 0.5, 0.0, 2.0, 5.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let density = Bilinear::new(values, [4, 3]);
        // the integral, by midpoints of a grid that the cells' borders are part of
        let n = 240;
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n {
                sum += density.pdf((DVec2::new(f64::from(i), f64::from(j)) + 0.5) / f64::from(n));
            }
        }
        assert!((sum / f64::from(n * n) - 1.0).abs() < 1e-9, "integral {}", sum / f64::from(n * n));
        // chi-square over 12 x 8 boxes, none of which crosses a cell's border
        let (columns, rows, count) = (12, 8, 200_000);
        let mut counts = vec![0.0; columns * rows];
        for i in 0..count {
            let (uv, pdf) = density.sample(Sampler::new(3, [i, 0], 0).next_2d()).unwrap();
            assert!((pdf / density.pdf(uv) - 1.0).abs() < 1e-9);
            counts[(uv.y * rows as f64) as usize * columns + (uv.x * columns as f64) as usize] += 1.0;
        }
        let (mut chi, mut boxes) = (0.0, 0);
        for (index, got) in counts.into_iter().enumerate() {
            // the mean of a bilinear function is its value in the middle
            let middle = DVec2::new((index % columns) as f64 + 0.5, (index / columns) as f64 + 0.5)
                / DVec2::new(columns as f64, rows as f64);
            let want = density.pdf(middle) * f64::from(count) / (columns * rows) as f64;
            if want > 0.0 {
                chi += (got - want) * (got - want) / want;
                boxes += 1;
            } else {
                assert_eq!(got, 0.0);
            }
        }
        let freedom = f64::from(boxes - 1);
        assert!(boxes > 60 && chi < freedom + 4.0 * (2.0 * freedom).sqrt(), "chi² {chi} of {boxes}");
    }

    #[test]
    fn nothing_is_drawn_where_all_is_black() {
        let black = Bilinear::new(vec![0.0; 6], [3, 2]);
        assert_eq!(black.sample(DVec2::splat(0.3)), None);
        assert_eq!(black.pdf(DVec2::splat(0.3)), 0.0);
        assert_eq!(sample_linear(0.0, 0.0, 1.0).to_bits(), 0.0_f64.to_bits());
        assert_eq!(sample_linear(0.25, 0.0, 1.0), 0.5);
        assert_eq!(sample_linear(0.25, 1.0, 1.0), 0.25);
    }
}
