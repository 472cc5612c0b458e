//! Bézier clipping: which part of a parameter box can hold a zero.
//!
//! Source: Nishita, Sederberg, Kakimoto (1990), *Ray tracing trimmed rational surface patches*, section 4.

use glam::DVec2;

use crate::math::bernstein::MAX_ORDER;

/// One of a net's two parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Parameter {
    S,
    T,
}

/// The range of one parameter, within `[0, 1]`, outside of which the net has no zero; `None` if it has none at all.
///
/// The net's component across `line` is a function of both parameters; its least and greatest coefficients for each
/// index along the parameter bound it between two polygons, of which only the parts over the returned range reach 0.
/// `margin` bounds the error of the coefficients.
pub(crate) fn clip(
    points: &[DVec2],
    degree: [usize; 2],
    parameter: Parameter,
    line: DVec2,
    margin: f64,
) -> Option<[f64; 2]> {
    let row = degree[1] + 1;
    let mut low = [f64::INFINITY; MAX_ORDER];
    let mut high = [f64::NEG_INFINITY; MAX_ORDER];
    for (flat, point) in points.iter().enumerate() {
        let index = match parameter {
            Parameter::S => flat / row,
            Parameter::T => flat % row,
        };
        let distance = line.perp_dot(*point);
        low[index] = low[index].min(distance - margin);
        high[index] = high[index].max(distance + margin);
    }
    let count = match parameter {
        Parameter::S => degree[0] + 1,
        Parameter::T => row,
    };
    let upper = reach(high[..count].iter().copied())?;
    let lower = reach(low[..count].iter().map(|value| -value))?;
    let range = [upper[0].max(lower[0]), upper[1].min(lower[1])];
    (range[0] <= range[1]).then_some(range)
}

/// Where the convex hull of the points (i / degree, `value_i`) and all below is at or above 0.
fn reach(values: impl Iterator<Item = f64> + Clone) -> Option<[f64; 2]> {
    let degree = (values.clone().count() - 1) as f64;
    let mut range: Option<[f64; 2]> = None;
    let mut widen = |x: f64| {
        range = Some(range.map_or([x, x], |[from, to]| [from.min(x), to.max(x)]));
    };
    for (i, a) in values.clone().enumerate() {
        let x = i as f64 / degree;
        if a >= 0.0 {
            widen(x);
            continue;
        }
        for (j, b) in values.clone().enumerate() {
            if b >= 0.0 {
                let other = j as f64 / degree;
                widen(x + (other - x) * (a / (a - b)));
            }
        }
    }
    range
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_function_is_clipped_to_its_zero() {
        // distance across the line y = 0 is -y: zero at s = 0.25 for every t
        let points =
            [DVec2::new(0.0, -1.0), DVec2::new(1.0, -1.0), DVec2::new(0.0, 3.0), DVec2::new(1.0, 3.0)];
        let range = clip(&points, [1, 1], Parameter::S, DVec2::X, 0.0).unwrap();
        assert!((range[0] - 0.25).abs() < 1e-15 && (range[1] - 0.25).abs() < 1e-15, "{range:?}");
        let range = clip(&points, [1, 1], Parameter::T, DVec2::X, 0.0).unwrap();
        assert_eq!(range, [0.0, 1.0], "t says nothing");
        let range = clip(&points, [1, 1], Parameter::S, DVec2::X, 0.4).unwrap();
        assert!(range[0] < 0.2 && range[1] > 0.3, "the margin widens: {range:?}");
    }

    #[test]
    fn no_sign_change_is_no_zero() {
        let points = [DVec2::new(0.0, 1.0), DVec2::new(1.0, 2.0), DVec2::new(0.0, 3.0), DVec2::new(1.0, 1.0)];
        assert_eq!(clip(&points, [1, 1], Parameter::S, DVec2::X, 0.0), None);
        assert!(clip(&points, [1, 1], Parameter::S, DVec2::X, 1.0).is_some(), "within the margin");
    }
}
