//! Quadrics and tori as rational splines, exactly.

use std::f64::consts::FRAC_1_SQRT_2;

use glam::{DVec2, DVec3};

use super::{SplineSurface, SurfaceError, clamped_knots};

/// A shape by its measures. Parameters run over [0, 1]², u around the axis counter-clockwise seen from its end, by quarters; the
/// normal ∂S/∂u × ∂S/∂v points outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// The parallelogram origin + u · u + v · v.
    Plane {
        /// A corner.
        origin: DVec3,
        /// From there to the next corner along u.
        u: DVec3,
        /// And along v.
        v: DVec3,
    },
    /// v from the pole at -z to that at +z.
    Sphere {
        /// Its middle.
        center: DVec3,
        /// Its radius.
        radius: f64,
    },
    /// Without its ends; v along the axis.
    Cylinder {
        /// The middle of the first end.
        origin: DVec3,
        /// From there to the middle of the other.
        axis: DVec3,
        /// Its radius.
        radius: f64,
    },
    /// Without its base; v from the base to the apex.
    Cone {
        /// The middle of the base.
        origin: DVec3,
        /// From there to the apex.
        axis: DVec3,
        /// The base's radius.
        radius: f64,
    },
    /// v around the tube, from its outer rim upwards.
    Torus {
        /// Its middle.
        center: DVec3,
        /// Direction of its axis.
        axis: DVec3,
        /// Radius of the tube's middle line.
        major_radius: f64,
        /// Radius of the tube, below the other.
        minor_radius: f64,
    },
}

/// A point of a profile in the plane of radius and height, with its weight.
type Profile = (DVec2, f64);

impl Shape {
    /// The shape as a surface.
    ///
    /// # Errors
    /// If a radius is not positive or an axis has no length.
    pub fn surface(&self) -> Result<SplineSurface, SurfaceError> {
        match *self {
            Self::Plane { origin, u, v } => {
                if u.cross(v) == DVec3::ZERO || !(origin + u + v).is_finite() {
                    return Err(SurfaceError::Shape("a plane needs two directions u and v".to_owned()));
                }
                SplineSurface::bezier([1, 1], &[origin, origin + v, origin + u, origin + u + v], &[])
            }
            Self::Sphere { center, radius } => {
                positive("a sphere's radius", radius)?;
                let half = half_circle().map(|(place, weight)| (radius * place, weight));
                revolve(center, DVec3::Z, (2, quarter_knots(2)), &half)
            }
            Self::Cylinder { origin, axis, radius } => {
                positive("a cylinder's radius", radius)?;
                let length = axis.length();
                let line = [(DVec2::new(radius, 0.0), 1.0), (DVec2::new(radius, length), 1.0)];
                revolve(origin, axis, (1, clamped_knots(1, 2)), &line)
            }
            Self::Cone { origin, axis, radius } => {
                positive("a cone's radius", radius)?;
                let line = [(DVec2::new(radius, 0.0), 1.0), (DVec2::new(0.0, axis.length()), 1.0)];
                revolve(origin, axis, (1, clamped_knots(1, 2)), &line)
            }
            Self::Torus { center, axis, major_radius, minor_radius } => {
                positive("a torus's minor_radius", minor_radius)?;
                if !(major_radius > minor_radius && major_radius.is_finite()) {
                    let message = format!(
                        "a torus's major_radius is {major_radius}, but must be above its minor_radius"
                    );
                    return Err(SurfaceError::Shape(message));
                }
                let tube =
                    circle().map(|(place, weight)| (minor_radius * place + DVec2::X * major_radius, weight));
                revolve(center, axis, (2, quarter_knots(4)), &tube)
            }
        }
    }
}

fn positive(what: &str, size: f64) -> Result<(), SurfaceError> {
    if size > 0.0 && size.is_finite() {
        return Ok(());
    }
    Err(SurfaceError::Shape(format!("{what} is {size}, but must be above 0")))
}

/// Knots of quadratic arcs, each a quarter of a circle (The NURBS Book, section 7.5).
fn quarter_knots(arcs: usize) -> Vec<f64> {
    let inner = (1..arcs).flat_map(|i| [i as f64 / arcs as f64; 2]);
    [0.0; 3].into_iter().chain(inner).chain([1.0; 3]).collect()
}

/// The unit circle from (1, 0) by four quarters: corners of its square have the cosine of 45° as weight.
fn circle() -> [Profile; 9] {
    let places = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)];
    places.map(|(x, y): (i8, i8)| {
        let weight = if x != 0 && y != 0 { FRAC_1_SQRT_2 } else { 1.0 };
        (DVec2::new(x.into(), y.into()), weight)
    })
}

/// From (0, -1) by (1, 0) to (0, 1).
fn half_circle() -> [Profile; 5] {
    let all = circle();
    [all[6], all[7], all[0], all[1], all[2]]
}

/// A profile of radius and height turned about an axis (The NURBS Book, section 8.5).
fn revolve(
    origin: DVec3,
    axis: DVec3,
    (degree, knots): (usize, Vec<f64>),
    profile: &[Profile],
) -> Result<SplineSurface, SurfaceError> {
    let Some(up) = axis.try_normalize() else {
        return Err(SurfaceError::Shape("the axis must not be [0, 0, 0]".to_owned()));
    };
    // about +z, u starts at +x
    let across = if up.x.abs() < 0.9 { DVec3::X } else { DVec3::Y };
    let right = (across - up * up.dot(across)).normalize();
    let forward = up.cross(right);
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for (around, weight_around) in circle() {
        for (place, weight) in profile {
            let radial = around.x * right + around.y * forward;
            points.push(origin + place.x * radial + place.y * up);
            weights.push(weight * weight_around);
        }
    }
    SplineSurface::try_new([2, degree], [quarter_knots(4), knots], &points, &weights)
}
