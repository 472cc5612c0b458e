//! Bernstein polynomials, rounding bounds, boxes, plane polygons and linear maps; knows nothing of splines or rays.

pub(crate) mod angle;
pub(crate) mod bernstein;
pub(crate) mod bounds;
pub(crate) mod cofactor;
pub(crate) mod lanes;
pub(crate) mod linear;
pub(crate) mod magnitude;
pub(crate) mod polygon;
pub(crate) mod rounding;
