//! Deformation of parametric surfaces by extension functions.
//!
//! Source: Wang, Ye, Meng, Li, *Space deformation of parametric surface based on extension function*, sections 3 and 4. With
//! the bound φ(u, v), an index n and an extent h the extension function is E = exp(h φ^n) where φ <= 0, else 1.

use glam::{DMat3, DVec3};
use thiserror::Error;

use crate::analytic::branch::{SelectBranch, inside_region};
use crate::analytic::expression::Expression;
use crate::analytic::jet::{Jet, Point, cross, unit};
use crate::analytic::number::Number;

/// What extension functions do to a point.
#[derive(Clone, Debug, PartialEq)]
pub enum ExtensionMode {
    /// p' = L D L⁻¹ (p - O') + O' (section 4.1, Eq. 1): stretched along the axes L about a center O'.
    Operator {
        /// O'.
        center: DVec3,
        /// L: unit vectors, linearly independent.
        axes: DMat3,
    },
    /// p' = p + Σ (`E_i` - 1) (p - `O_i`) (section 4.6), each region with its own center.
    Radial,
    /// p' = p + Σ (`E_ij` - 1) s along a field of unit vectors (section 4.7).
    Field(Field),
}

/// A field of unit vectors on a surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Field {
    /// The surface's normal, ∂p/∂u × ∂p/∂v.
    Normal,
    /// Along ∂p/∂u.
    TangentU,
    /// Along ∂p/∂v.
    TangentV,
    /// Along a vector, the same everywhere.
    Constant(DVec3),
    /// Along a vector of three expressions of u and v.
    Expressions(Box<[Expression; 3]>),
}

/// A region φ <= 0 with its extension functions.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// φ.
    pub bound: Expression,
    /// The center of this region in radial mode.
    pub center: DVec3,
    /// n, at least 2: derivatives below this order are those of the undeformed surface on φ = 0.
    pub index: u32,
    /// `h_ij`, row by row.
    pub h: [[f64; 3]; 3],
    /// Signs `ε_ij` of the terms off the diagonal.
    pub epsilon: [[f64; 3]; 3],
    /// A factor of all `h_ij`.
    pub factor: Option<Expression>,
}

/// Why there is no such deformation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum ExtensionError {
    /// The index of an extension function is below 2.
    #[error("the index of an extension function is at least 2, not {index}")]
    Index {
        /// The index given.
        index: u32,
    },
    /// The axes of the operators span no space.
    #[error("the axes are not linearly independent")]
    Axes,
}

/// A deformation by extension functions.
#[derive(Clone, Debug, PartialEq)]
pub struct Extension {
    mode: ExtensionMode,
    regions: Vec<Region>,
    /// L⁻¹.
    inverse: DMat3,
}

impl Extension {
    /// A deformation by regions; in operator mode the last is applied first.
    ///
    /// # Errors
    /// If axes are not linearly independent or an index is below 2.
    pub fn try_new(mode: ExtensionMode, regions: Vec<Region>) -> Result<Self, ExtensionError> {
        if let Some(region) = regions.iter().find(|region| region.index < 2) {
            return Err(ExtensionError::Index { index: region.index });
        }
        let inverse = match &mode {
            ExtensionMode::Operator { axes, .. } => axes.inverse(),
            _ => DMat3::IDENTITY,
        };
        if !inverse.is_finite() {
            return Err(ExtensionError::Axes);
        }
        Ok(Self { mode, regions, inverse })
    }

    /// What it does.
    pub const fn mode(&self) -> &ExtensionMode {
        &self.mode
    }

    /// Where.
    pub fn regions(&self) -> &[Region] {
        &self.regions
    }

    /// Whether it takes derivatives of the surface.
    pub const fn takes_derivatives(&self) -> bool {
        matches!(self.mode, ExtensionMode::Field(Field::Normal | Field::TangentU | Field::TangentV))
    }

    /// How large numbers become on the way to coordinates no greater than `magnitude`.
    pub(super) fn largest_term(&self, magnitude: f64) -> f64 {
        let size = |matrix: &DMat3| (0..3).map(|row| matrix.row(row).abs().element_sum()).fold(0.0, f64::max);
        let centers = self.regions.iter().map(|region| region.center.abs().max_element());
        match &self.mode {
            ExtensionMode::Operator { center, axes } => {
                (magnitude + center.abs().max_element()) * size(axes) * size(&self.inverse)
            }
            ExtensionMode::Radial => magnitude + centers.fold(0.0, f64::max),
            ExtensionMode::Field(_) => magnitude,
        }
    }

    /// The deformed point.
    pub(super) fn apply<T: Number, const N: usize>(
        &self,
        point: &Point<T, N>,
        uv: &[Jet<T, N>; 2],
        choose: &mut dyn SelectBranch<T>,
    ) -> Point<T, N> {
        match &self.mode {
            ExtensionMode::Operator { center, axes } => {
                self.apply_operators(point, uv, (*center, *axes), choose)
            }
            ExtensionMode::Radial => {
                let mut moved = *point;
                for region in &self.regions {
                    let Some(exponent) = region.exponent(uv, choose) else { continue };
                    let growth = exponent.scale(region.h[0][0]).exp_minus_1();
                    for axis in 0..3 {
                        let offset = point[axis].plus(-region.center[axis]);
                        moved[axis] = moved[axis].add(&growth.multiply(&offset));
                    }
                }
                moved
            }
            ExtensionMode::Field(field) => {
                let inside: Vec<_> = self
                    .regions
                    .iter()
                    .filter_map(|region| region.exponent(uv, choose).map(|exponent| (region, exponent)))
                    .collect();
                if inside.is_empty() {
                    return *point;
                }
                let along = field.at(point, uv, choose);
                let mut moved = *point;
                for (region, exponent) in inside {
                    let more = region.product(&exponent, &along);
                    moved = std::array::from_fn(|axis| moved[axis].add(&more[axis]));
                }
                moved
            }
        }
    }

    fn apply_operators<T: Number, const N: usize>(
        &self,
        point: &Point<T, N>,
        uv: &[Jet<T, N>; 2],
        (center, axes): (DVec3, DMat3),
        choose: &mut dyn SelectBranch<T>,
    ) -> Point<T, N> {
        let offset: Point<T, N> = std::array::from_fn(|axis| point[axis].plus(-center[axis]));
        let before = transformed(&self.inverse, &offset);
        let mut local = before;
        for region in self.regions.iter().rev() {
            let Some(exponent) = region.exponent(uv, choose) else { continue };
            let more = region.product(&exponent, &local);
            local = std::array::from_fn(|axis| local[axis].add(&more[axis]));
        }
        // by the displacement, so that nothing is rounded where there is none
        let change: Point<T, N> = std::array::from_fn(|axis| local[axis].subtract(&before[axis]));
        let change = transformed(&axes, &change);
        std::array::from_fn(|axis| point[axis].add(&change[axis]))
    }
}

impl Region {
    /// factor · φ^n inside, where φ <= 0.
    pub(super) fn exponent<T: Number, const N: usize>(
        &self,
        uv: &[Jet<T, N>; 2],
        choose: &mut dyn SelectBranch<T>,
    ) -> Option<Jet<T, N>> {
        let bound = inside_region(choose, self.bound.sign_queries(), |choose| self.bound.at(uv, choose))?;
        let power = bound.whole_power(i32::try_from(self.index).unwrap_or(i32::MAX));
        Some(match &self.factor {
            None => power,
            Some(factor) => power.multiply(&factor.at(uv, choose)),
        })
    }

    /// (D - I) of the operator matrix, times a vector: rows of `ε_ij` (`E_ij` - 1).
    fn product<T: Number, const N: usize>(&self, exponent: &Jet<T, N>, vector: &Point<T, N>) -> Point<T, N> {
        // most often the three on the diagonal are the same
        let mut known: Option<(f64, Jet<T, N>)> = None;
        let mut growth = |h: f64| match known {
            Some((of, growth)) if of == h => growth,
            _ => known.insert((h, exponent.scale(h).exp_minus_1())).1,
        };
        std::array::from_fn(|i| {
            let mut sum = Jet::constant(T::constant(0.0));
            for (j, part) in vector.iter().enumerate() {
                let h = self.h[i][j];
                if h != 0.0 {
                    let sign = if i == j { 1.0 } else { self.epsilon[i][j] };
                    sum = sum.add(&growth(h).multiply(part).scale(sign));
                }
            }
            sum
        })
    }
}

impl Field {
    fn at<T: Number, const N: usize>(
        &self,
        point: &Point<T, N>,
        uv: &[Jet<T, N>; 2],
        choose: &mut dyn SelectBranch<T>,
    ) -> Point<T, N> {
        match self {
            Self::Normal => {
                let [by_u, by_v] = derivatives(point, uv);
                unit(&cross(&by_u, &by_v))
            }
            Self::TangentU => unit(&derivatives(point, uv)[0]),
            Self::TangentV => unit(&derivatives(point, uv)[1]),
            Self::Constant(vector) => {
                let vector = vector.normalize();
                std::array::from_fn(|axis| Jet::constant(T::constant(vector[axis])))
            }
            Self::Expressions(parts) => {
                let vector = [parts[0].at(uv, choose), parts[1].at(uv, choose), parts[2].at(uv, choose)];
                unit(&vector)
            }
        }
    }
}

/// Vectors along ∂p/∂u and ∂p/∂v: the frame that takes (s, t) to (u, v) need not be along them.
fn derivatives<T: Number, const N: usize>(point: &Point<T, N>, uv: &[Jet<T, N>; 2]) -> [Point<T, N>; 2] {
    let partials = point.each_ref().map(Jet::partials);
    let [by_s, by_t] = [0, 1].map(|k| partials.map(|partials| partials[k]));
    // u and v are linear in s and t
    let [u, v] = uv.each_ref().map(|parameter| [1, 2].map(|k| parameter.coefficients[k].centre()));
    let sign = (u[0] * v[1] - u[1] * v[0]).signum();
    let combined = |a: f64, b: f64| {
        std::array::from_fn(|axis| by_s[axis].scale(sign * a).add(&by_t[axis].scale(sign * b)))
    };
    [combined(v[1], -v[0]), combined(-u[1], u[0])]
}

fn transformed<T: Number, const N: usize>(matrix: &DMat3, vector: &Point<T, N>) -> Point<T, N> {
    std::array::from_fn(|row| {
        let row = matrix.row(row);
        vector[0].scale(row.x).add(&vector[1].scale(row.y)).add(&vector[2].scale(row.z))
    })
}
