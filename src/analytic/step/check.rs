//! What an extension may do that its author did not mean.

use std::collections::VecDeque;

use glam::DVec2;

use super::extension::{Extension, ExtensionMode, Region};
use crate::analytic::branch::{ByValue, Possible, SelectBranch};
use crate::analytic::cell::rectangle;
use crate::analytic::disc::Disc;
use crate::analytic::jet::Jet;
use crate::analytic::number::{Number, SIZES};

/// Rectangles examined for one question; then it stays open.
const MAX_RECTANGLES: usize = 4096;

/// Whether a function of (u, v) is positive throughout a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sign {
    Positive,
    /// There is a counterexample here.
    NotPositive(DVec2),
    /// Neither was found: it comes close to 0.
    Open,
}

/// Decides by discs, halving rectangles until they do.
fn sign(
    domain: [DVec2; 2],
    is_counterexample: impl Fn(DVec2) -> bool,
    of_discs: impl Fn([Disc; 2]) -> Disc,
) -> Sign {
    let mut waiting = VecDeque::from([domain]);
    let mut examined = 0;
    while let Some([low, high]) = waiting.pop_front() {
        let middle = 0.5 * (low + high);
        if is_counterexample(middle) {
            return Sign::NotPositive(middle);
        }
        let range = of_discs(rectangle([low, high], [[1.0; SIZES]; 2]));
        if range.centre() - range.reach()[0] > 0.0 {
            continue;
        }
        examined += 1;
        if examined == MAX_RECTANGLES {
            return Sign::Open;
        }
        let (mut first, mut second) = (high, low);
        let axis = usize::from(high.y - low.y > high.x - low.x);
        (first[axis], second[axis]) = (middle[axis], middle[axis]);
        waiting.extend([[low, first], [second, high]]);
    }
    Sign::Positive
}

/// Warnings about an extension over the domain of (u, v).
pub(super) fn warnings(extension: &Extension, [along_u, along_v]: [[f64; 2]; 2]) -> Vec<String> {
    let domain = [0, 1].map(|end| DVec2::new(along_u[end], along_v[end]));
    let mut warnings = Vec::new();
    for (number, region) in (1..).zip(extension.regions()) {
        if is_empty(region, domain) {
            let bound = region.bound.text();
            warnings.push(format!(
                "region {number} is empty: its bound {bound:?} is nowhere below 0 in the surface's domain, so it moves nothing; \
                 a region is where phi <= 0, so 1 + cos(…) and 1 - cos(…) need a minus sign: -(1 + cos(…))"
            ));
        }
    }
    let found = sign(
        domain,
        |uv| determinant::<f64>(extension, uv.to_array(), &mut ByValue) <= 0.0,
        |uv| determinant(extension, uv, &mut Possible::default()),
    );
    match found {
        Sign::Positive => {}
        Sign::NotPositive(DVec2 { x, y }) => warnings.push(format!(
            "det D is 0 or negative, among other places at u = {x}, v = {y}: the deformation of space folds over or \
             flattens there"
        )),
        Sign::Open => warnings.push("det D comes close to 0: the deformation of space all but folds over".to_owned()),
    }
    warnings
}

fn is_empty(region: &Region, domain: [DVec2; 2]) -> bool {
    // a double zero of -(1 ± cos) is no region by itself
    let below =
        |uv: DVec2| region.bound.at(&uv.to_array().map(Jet::<f64, 1>::constant), &mut ByValue).value() < 0.0;
    let discs =
        |uv: [Disc; 2]| region.bound.at(&uv.map(Jet::<_, 1>::constant), &mut Possible::default()).value();
    !matches!(sign(domain, below, discs), Sign::NotPositive(_))
}

/// Determinant of the map of space at (u, v): of D1 D2 … in operator mode, 1 + Σ (`E_i` - 1) in radial mode; along a field
/// there is none, and this is 1.
fn determinant<T: Number>(extension: &Extension, uv: [T; 2], choose: &mut dyn SelectBranch<T>) -> T {
    let uv = uv.map(Jet::<T, 1>::constant);
    let one = T::constant(1.0);
    let mut product = one;
    for region in extension.regions() {
        let Some(exponent) = region.exponent(&uv, choose) else { continue };
        match extension.mode() {
            ExtensionMode::Operator { .. } => {
                let entry = |i: usize, j: usize| {
                    let change = exponent.scale(region.h[i][j]).exp_minus_1().value();
                    if i == j { change.add(one) } else { change.scale(region.epsilon[i][j]) }
                };
                let row: [[T; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
                let minor = |a: usize, b: usize| {
                    row[1][a].multiply(row[2][b]).subtract(row[1][b].multiply(row[2][a]))
                };
                let sum = row[0][0].multiply(minor(1, 2)).subtract(row[0][1].multiply(minor(0, 2)));
                product = product.multiply(sum.add(row[0][2].multiply(minor(0, 1))));
            }
            ExtensionMode::Radial => {
                product = product.add(exponent.scale(region.h[0][0]).exp_minus_1().value());
            }
            ExtensionMode::Field(_) => {}
        }
    }
    product
}
