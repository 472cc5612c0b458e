//! Knot vectors of any kind.

use crate::spline::polar_form;

/// One axis of a surface.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct KnotAxis {
    degree: usize,
    knots: Vec<f64>,
}

impl KnotAxis {
    /// Knots that do not fall, degree + 1 more than the control points.
    pub(super) fn try_new(degree: usize, knots: Vec<f64>) -> Result<Self, String> {
        let least = 2 * (degree + 1);
        if knots.len() < least {
            return Err(format!("{} knots given, but degree {degree} needs at least {least}", knots.len()));
        }
        if let Some(index) = knots.iter().position(|knot| !knot.is_finite()) {
            return Err(format!("knot {index} is not finite"));
        }
        if let Some(index) = knots.windows(2).position(|pair| pair[1] < pair[0]) {
            return Err(format!("knot {} is {}, below the one before", index + 1, knots[index + 1]));
        }
        let axis = Self { degree, knots };
        let [start, end] = axis.domain();
        if start >= end {
            return Err(format!("the domain, from knot {degree} on, is empty: {start} to {end}"));
        }
        Ok(axis)
    }

    pub(super) const fn degree(&self) -> usize {
        self.degree
    }

    pub(super) fn points(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    pub(super) fn domain(&self) -> [f64; 2] {
        [self.knots[self.degree], self.knots[self.points()]]
    }

    /// The first control point of the span that holds a parameter of the domain.
    pub(super) fn span(&self, parameter: f64) -> usize {
        let inner = &self.knots[self.degree..=self.points()];
        let above = inner.partition_point(|&knot| knot <= parameter);
        // the domain's end belongs to the last span that has a length
        let last = inner.partition_point(|&knot| knot < inner[inner.len() - 1]);
        above.clamp(1, last) - 1
    }

    /// The spans in a part of the domain, and the part of each in it.
    pub(super) fn intervals(&self, [low, high]: [f64; 2]) -> Vec<(usize, f64, f64)> {
        let spans = (0..self.points() - self.degree).filter_map(|span| {
            let start = self.knots[span + self.degree].max(low);
            let end = self.knots[span + self.degree + 1].min(high);
            (start < end).then_some((span, start, end))
        });
        spans.collect()
    }

    /// The polar form of a span's polynomial at as many arguments as the degree: the factor of each of its control points.
    pub(super) fn blossom(&self, span: usize, arguments: &[f64]) -> Vec<f64> {
        let mut basis = vec![0.0; self.degree + 1];
        polar_form(&self.knots, span + self.degree, arguments, &mut basis);
        basis
    }

    /// For each Bernstein polynomial of an interval of a span the factors of the span's control points.
    pub(super) fn bezier_rows(&self, span: usize, [low, high]: [f64; 2]) -> Vec<Vec<f64>> {
        let k = self.degree;
        (0..=k)
            .map(|i| {
                let mut arguments = vec![low; k];
                arguments[..i].fill(high);
                self.blossom(span, &arguments)
            })
            .collect()
    }
}
