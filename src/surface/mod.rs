//! Stage 4b: parametric surfaces as Bézier patches, exactly.

mod basis;
mod seam;
mod shapes;

use glam::{DVec2, DVec3, DVec4};
use thiserror::Error;

use crate::math::bernstein::MAX_DEGREE;
use crate::patch::{BezierPatch, Chart, Face, ParameterFrame, Shell};
use basis::KnotAxis;
use seam::grid_shell;

pub use shapes::Shape;

/// Why a surface cannot be made.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SurfaceError {
    /// A degree that patches do not have.
    #[error("degree {0} is not one of 1 to {MAX_DEGREE}")]
    Degree(usize),
    /// Too few or too many control points.
    #[error("{got} control points given, {want} needed")]
    Points {
        /// Number given.
        got: usize,
        /// Number needed.
        want: usize,
    },
    /// Not as many weights as control points.
    #[error("{got} weights given, {want} needed: one for each control point")]
    Weights {
        /// Number given.
        got: usize,
        /// Number needed.
        want: usize,
    },
    /// A weight that is not positive.
    #[error("weight {index} is {weight}, but must be above 0")]
    Weight {
        /// Its place, from 0.
        index: usize,
        /// Its value.
        weight: f64,
    },
    /// Knots that are not as many as points and degree need, fall, or leave no domain.
    #[error("knots_{axis}: {reason}")]
    Knots {
        /// u or v.
        axis: char,
        /// What is wrong.
        reason: String,
    },
    /// A part of the parameters that the surface has not.
    #[error("domain: {low} to {high} along {axis} is not a part of {start} to {end}")]
    Domain {
        /// u or v.
        axis: char,
        /// Where the part starts.
        low: f64,
        /// Where it ends.
        high: f64,
        /// Where the surface starts.
        start: f64,
        /// Where it ends.
        end: f64,
    },
    /// A size that is not positive, or an axis of no length.
    #[error("{0}")]
    Shape(String),
}

/// A (rational) tensor-product B-spline surface over a rectangle of its parameters.
///
/// S(u, v) = Σ `w_ij` `P_ij` `N_i(u)` `N_j(v)` / Σ `w_ij` `N_i(u)` `N_j(v)`; Piegl and Tiller, *The NURBS Book*, 2nd edition (1997),
/// chapter 4.
#[derive(Clone, Debug, PartialEq)]
pub struct SplineSurface {
    axes: [KnotAxis; 2],
    /// (w x, w y, w z, w), v fastest.
    points: Vec<DVec4>,
    domain: [[f64; 2]; 2],
}

impl SplineSurface {
    /// The surface with these control points, v fastest, and their weights (all 1 if there are none).
    ///
    /// # Errors
    /// Where numbers do not fit each other, or weights are not positive.
    pub fn try_new(
        degree: [usize; 2],
        knots: [Vec<f64>; 2],
        points: &[DVec3],
        weights: &[f64],
    ) -> Result<Self, SurfaceError> {
        if let Some(&bad) = degree.iter().find(|degree| !(1..=MAX_DEGREE).contains(*degree)) {
            return Err(SurfaceError::Degree(bad));
        }
        let [knots_u, knots_v] = knots;
        let axes = [
            KnotAxis::try_new(degree[0], knots_u)
                .map_err(|reason| SurfaceError::Knots { axis: 'u', reason })?,
            KnotAxis::try_new(degree[1], knots_v)
                .map_err(|reason| SurfaceError::Knots { axis: 'v', reason })?,
        ];
        let want = axes[0].points() * axes[1].points();
        if points.len() != want {
            return Err(SurfaceError::Points { got: points.len(), want });
        }
        if !weights.is_empty() && weights.len() != want {
            return Err(SurfaceError::Weights { got: weights.len(), want });
        }
        if let Some(index) = weights.iter().position(|weight| !(*weight > 0.0 && weight.is_finite())) {
            return Err(SurfaceError::Weight { index, weight: weights[index] });
        }
        let weight = |index: usize| weights.get(index).copied().unwrap_or(1.0);
        let points =
            points.iter().enumerate().map(|(i, point)| (*point * weight(i)).extend(weight(i))).collect();
        let domain = [axes[0].domain(), axes[1].domain()];
        Ok(Self { axes, points, domain })
    }

    /// A single Bézier patch over the unit square, v fastest.
    ///
    /// # Errors
    /// As [`Self::try_new`].
    pub fn bezier(degree: [usize; 2], points: &[DVec3], weights: &[f64]) -> Result<Self, SurfaceError> {
        Self::try_new(degree, degree.map(|degree| clamped_knots(degree, degree + 1)), points, weights)
    }

    /// The part of the surface over a rectangle of parameters.
    ///
    /// # Errors
    /// If the surface is not defined on all of it, or it has no area.
    pub fn restricted(mut self, domain: [[f64; 2]; 2]) -> Result<Self, SurfaceError> {
        for (axis, name) in [(0, 'u'), (1, 'v')] {
            let ([low, high], [start, end]) = (domain[axis], self.axes[axis].domain());
            if !(start <= low && low < high && high <= end) {
                return Err(SurfaceError::Domain { axis: name, low, high, start, end });
            }
        }
        self.domain = domain;
        Ok(self)
    }

    /// Lowest and highest parameters, along u and along v.
    #[must_use]
    pub const fn domain(&self) -> [[f64; 2]; 2] {
        self.domain
    }

    /// The point at parameters of the domain, by de Boor's algorithm.
    #[must_use]
    pub fn eval(&self, uv: DVec2) -> DVec3 {
        let [(span_u, along_u), (span_v, along_v)] = [0, 1].map(|axis| {
            let span = self.axes[axis].span(uv[axis]);
            (span, self.axes[axis].blossom(span, &vec![uv[axis]; self.axes[axis].degree()]))
        });
        let point = self.combine([span_u, span_v], &along_u, &along_v);
        point.truncate() / point.w
    }

    /// `Σ a_i b_j` of the control points of a pair of spans.
    fn combine(&self, [span_u, span_v]: [usize; 2], a: &[f64], b: &[f64]) -> DVec4 {
        let columns = self.axes[1].points();
        let mut sum = DVec4::ZERO;
        for (i, a) in a.iter().enumerate() {
            let row = &self.points[(span_u + i) * columns + span_v..];
            sum += *a * b.iter().zip(row).map(|(b, point)| *b * *point).sum::<DVec4>();
        }
        sum
    }

    /// The surface as Bézier patches, one for each pair of knot intervals in the domain: their control points are the polar
    /// forms at the intervals' ends (Ramshaw 1989, *Blossoms are polar forms*). A face's chart takes its unit square to its
    /// rectangle of (u, v), and all of it is surface.
    ///
    /// Faces share the vertices of the knot lines between them; of a surface that closes upon itself also those of its seam, and
    /// where a side of the domain is one point it is one vertex.
    #[must_use]
    pub fn shell(&self) -> Shell {
        let [intervals_u, intervals_v] = [0, 1].map(|axis| self.axes[axis].intervals(self.domain[axis]));
        let mut faces = Vec::new();
        for (span_u, low_u, high_u) in &intervals_u {
            let rows = self.axes[0].bezier_rows(*span_u, [*low_u, *high_u]);
            for (span_v, low_v, high_v) in &intervals_v {
                let columns = self.axes[1].bezier_rows(*span_v, [*low_v, *high_v]);
                let control_points = rows
                    .iter()
                    .flat_map(|a| columns.iter().map(|b| self.combine([*span_u, *span_v], a, b)))
                    .collect();
                let degree = [self.axes[0].degree(), self.axes[1].degree()];
                let chart = Chart::Parameters(ParameterFrame {
                    origin: DVec2::new(*low_u, *low_v),
                    s: DVec2::new(high_u - low_u, 0.0),
                    t: DVec2::new(0.0, high_v - low_v),
                });
                faces.push(Face::untrimmed(chart, BezierPatch::new(degree, control_points)));
            }
        }
        grid_shell(faces, [intervals_u.len(), intervals_v.len()])
    }
}

/// The clamped uniform knot vector over [0, 1].
#[must_use]
pub fn clamped_knots(degree: usize, points: usize) -> Vec<f64> {
    let intervals = points.saturating_sub(degree).max(1);
    let inner = (1..intervals).map(|i| i as f64 / intervals as f64);
    std::iter::repeat_n(0.0, degree + 1).chain(inner).chain(std::iter::repeat_n(1.0, degree + 1)).collect()
}

#[cfg(test)]
mod tests;
