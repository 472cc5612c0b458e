//! The filters of FLIP: what the eye resolves, and where it sees edges and points.

use std::array;
use std::f32::consts::PI;
use std::iter;
use std::ops::Range;

use rayon::prelude::*;

use super::colour::{Colour, exp, opponent};

/// Weights of the filters along one axis, an odd number each. Beyond its border a picture has the border's colours.
#[derive(Debug)]
pub(super) struct Filters {
    /// Contrast sensitivity to luminance, to red against green, and, a sum of two Gaussians, to blue against yellow.
    sensitivity: [Vec<f32>; 4],
    gaussian: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
    /// The greatest radius.
    border: usize,
}

impl Filters {
    /// Rows that [`Self::across`] makes of a row of pixels.
    const ACROSS: usize = 7;
    /// Rows that [`Self::down`] makes of these.
    const DOWN: usize = 8;

    pub(super) fn new(pixels_per_degree: f32) -> Self {
        let sensitivity = sensitivity(pixels_per_degree);
        let [gaussian, edge, point] = features(pixels_per_degree);
        let border = sensitivity[0].len().max(gaussian.len()) / 2;
        Self { sensitivity, gaussian, edge, point, border }
    }

    /// Filters rows of a picture from row `first` on, whose colours `linear` gives by their places in the picture; for each row
    /// [`Self::ACROSS`] in `rows`.
    fn across(&self, width: usize, first: usize, linear: impl Fn(usize) -> Colour + Sync, rows: &mut [f32]) {
        let Self { sensitivity: [luminance, red_green, blue_yellow, wide], gaussian, edge, point, border } =
            self;
        // of luminance, red against green, blue against yellow, and luminance from 0 to 1
        let filters = [
            (0, luminance),
            (1, red_green),
            (2, blue_yellow),
            (2, wide),
            (3, edge),
            (3, point),
            (3, gaussian),
        ];
        rows.par_chunks_mut(width * Self::ACROSS).enumerate().for_each(|(index, filtered)| {
            let row = first + index;
            let mut bordered: [Vec<f32>; 4] = array::from_fn(|_| Vec::with_capacity(width + 2 * border));
            for x in 0..width {
                let beyond = [x == 0, x + 1 == width].into_iter().filter(|&ends| ends).count() * border;
                let [y, cx, cz] = opponent(linear(row * width + x));
                let share = y * (1.0 / 116.0) + 16.0 / 116.0;
                for (values, value) in bordered.iter_mut().zip([y, cx, cz, share]) {
                    values.extend(iter::repeat_n(value, 1 + beyond));
                }
            }
            for ((of, weights), sums) in filters.into_iter().zip(filtered.chunks_exact_mut(width)) {
                let first = border - weights.len() / 2;
                convolve(sums, weights, |step| &bordered[of][first + step..][..width]);
            }
        });
    }

    /// Filters what [`Self::across`] has made along a column, for all pixels of the row `y`.
    pub(super) fn down(&self, strip: &Strip, y: usize) -> Vec<Seen> {
        let (width, across) = (strip.size[0], &strip.rows);
        let Self { sensitivity: [luminance, red_green, blue_yellow, wide], gaussian, edge, point, .. } = self;
        let filters = [
            (0, luminance),
            (1, red_green),
            (2, blue_yellow),
            (3, wide),
            (4, gaussian),
            (5, gaussian),
            (6, edge),
            (6, point),
        ];
        let last = strip.size[1] - 1;
        let mut rows = vec![0.0; width * Self::DOWN];
        for ((of, weights), sums) in filters.into_iter().zip(rows.chunks_exact_mut(width)) {
            let radius = weights.len() / 2;
            convolve(sums, weights, |step| {
                let from = (y + step).saturating_sub(radius).min(last) - strip.first;
                &across[(from * Self::ACROSS + of) * width..][..width]
            });
        }
        let seen = |x: usize| {
            let [y, cx, cz, wide, dx, ddx, dy, ddy] = array::from_fn(|row| rows[row * width + x]);
            Seen { opponent: [y, cx, cz + wide], edge: length(dx, dy), point: length(ddx, ddy) }
        };
        (0..width).map(seen).collect()
    }
}

/// Rows of a picture, filtered across; enough of them to filter some rows of the picture along columns.
#[derive(Debug)]
pub(super) struct Strip {
    /// Width and height of the picture.
    size: [usize; 2],
    /// The first row of the picture that is there.
    first: usize,
    rows: Vec<f32>,
}

impl Strip {
    /// Memory that the rows of a strip may take, unless a filter needs more.
    const BYTES: usize = 1 << 26;

    pub(super) const fn new(size: [usize; 2]) -> Self {
        Self { size, first: 0, rows: Vec::new() }
    }

    /// How many rows of a picture are filtered along columns by one strip.
    pub(super) fn height(filters: &Filters, width: usize) -> usize {
        (Self::BYTES / (4 * Filters::ACROSS * width)).max(4 * filters.border).max(1)
    }

    /// Goes on to the rows that `of` needs, which follow those before; `linear` gives colours by their places in the picture.
    pub(super) fn advance(
        &mut self,
        filters: &Filters,
        of: Range<usize>,
        linear: impl Fn(usize) -> Colour + Sync,
    ) {
        let [width, height] = self.size;
        let row = width * Filters::ACROSS;
        let (start, end) = (of.start.saturating_sub(filters.border), (of.end + filters.border).min(height));
        self.rows.drain(..(start - self.first) * row);
        let kept = self.rows.len();
        self.first = start;
        self.rows.resize((end - start) * row, 0.0);
        filters.across(width, start + kept / row, linear, &mut self.rows[kept..]);
    }
}

/// A pixel as it is seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// Its colour amid its neighbours', as [`opponent`] has it.
    pub(super) opponent: Colour,
    /// How strong an edge, and how strong a point or line, there is in its luminance.
    pub(super) edge: f32,
    pub(super) point: f32,
}

/// For each x the sum over the steps of a weight times `values(step)[x]`.
fn convolve<'a>(sums: &mut [f32], weights: &[f32], values: impl Fn(usize) -> &'a [f32]) {
    // so many stay in registers
    const BLOCK: usize = 16;
    let (blocks, rest) = sums.as_chunks_mut::<BLOCK>();
    let start = blocks.len() * BLOCK;
    for (index, sums) in blocks.iter_mut().enumerate() {
        *sums = [0.0; BLOCK];
        for (step, weight) in weights.iter().enumerate() {
            if let Some(values) = values(step)[index * BLOCK..].first_chunk::<BLOCK>() {
                *sums = array::from_fn(|x| sums[x] + weight * values[x]);
            }
        }
    }
    rest.fill(0.0);
    for (step, weight) in weights.iter().enumerate() {
        rest.iter_mut().zip(&values(step)[start..]).for_each(|(sum, value)| *sum += weight * value);
    }
}

fn length(x: f32, y: f32) -> f32 {
    (x * x + y * y).sqrt()
}

/// `a √(π/b) exp(-π² x²/b)` with x in degrees (2020 paper, spatial filtering), along one axis. The last two are one
/// filter: their squares add up to its weights in two dimensions.
fn sensitivity(pixels_per_degree: f32) -> [Vec<f32>; 4] {
    const WIDEST: f32 = 0.04;
    const PI_SQ: f32 = PI * PI;
    let radius = (3.0 * (WIDEST / (2.0 * PI_SQ)).sqrt() * pixels_per_degree).ceil();
    let per_pixel = 1.0 / pixels_per_degree;
    let gaussian = |height: f32, b: f32| -> Vec<f32> {
        let degrees = offsets(radius).map(|x| x * per_pixel);
        degrees.map(|x| height * exp(-PI_SQ * (x * x) / b)).collect()
    };
    let height = |a: f32, b: f32| a * (PI / b).sqrt();
    let luminance = gaussian(height(1.0, 0.0047), 0.0047);
    let red_green = gaussian(height(1.0, 0.0053), 0.0053);
    let blue_yellow = gaussian(height(34.1, WIDEST).sqrt(), WIDEST);
    let wide = gaussian(height(13.5, 0.025).sqrt(), 0.025);
    let of_both = 1.0 / length(sum(&blue_yellow), sum(&wide));
    let factors = [1.0 / sum(&luminance), 1.0 / sum(&red_green), of_both, of_both];
    let filters = [luminance, red_green, blue_yellow, wide].into_iter().zip(factors);
    let mut scaled = filters.map(|(weights, factor)| weights.into_iter().map(|w| w * factor).collect());
    array::from_fn(|_| scaled.next().unwrap_or_default())
}

/// A Gaussian, which adds up to 1, and its first and second derivatives, of which what is positive does and what is
/// negative to -1 (2020 paper, feature pipeline): its standard deviation is half of an edge's width of 0.082 degrees.
fn features(pixels_per_degree: f32) -> [Vec<f32>; 3] {
    let deviation = 0.5 * 0.082 * pixels_per_degree;
    let radius = (3.0 * deviation).ceil();
    let gaussian: Vec<f32> = offsets(radius).map(|x| exp(-(x * x) / (2.0 * deviation * deviation))).collect();
    let edge: Vec<f32> = offsets(radius).zip(&gaussian).map(|(x, g)| -x * g).collect();
    let second = |(x, g): (f32, &f32)| (x * x / (deviation * deviation) - 1.0) * g;
    let point: Vec<f32> = offsets(radius).zip(&gaussian).map(second).collect();
    [gaussian, edge, point].map(|weights| {
        let signed = |sign: f32| -> f32 { weights.iter().map(|w| (sign * w).max(0.0)).sum() };
        let (positive, negative) = (signed(1.0), signed(-1.0));
        // one that is too narrow for the pixels has nothing to scale
        let scaled = |&w: &f32| {
            if w > 0.0 {
                w / positive
            } else if w < 0.0 {
                w / negative
            } else {
                0.0
            }
        };
        weights.iter().map(scaled).collect()
    })
}

/// Whole numbers from `-radius` to `radius`.
fn offsets(radius: f32) -> impl Iterator<Item = f32> {
    iter::successors(Some(-radius), |x| Some(x + 1.0)).take_while(move |x| *x <= radius)
}

fn sum(weights: &[f32]) -> f32 {
    weights.iter().sum()
}
