//! Maps of the unit square to where directions are drawn from.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, PI};

use glam::{DVec2, DVec3};

/// Density of [`uniform_sphere`] by solid angle.
pub(super) const UNIFORM_SPHERE_PDF: f64 = 0.25 * FRAC_1_PI;

/// A point of the unit disk, uniform by area, by the concentric map of Shirley and Chiu (1997).
///
/// Squares about the centre of `[0, 1]²` go to circles about the disk's centre, so that points
/// that are near stay near.
pub(super) fn concentric_disk(u: DVec2) -> DVec2 {
    let p = 2.0 * u - 1.0;
    if p == DVec2::ZERO {
        return DVec2::ZERO;
    }
    let (radius, angle) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * (p.y / p.x))
    } else {
        (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y))
    };
    let (sin, cos) = libm::sincos(angle);
    radius * DVec2::new(cos, sin)
}

/// A unit vector with z >= 0, of density cos(θ)/π by solid angle, θ being the angle with +z.
///
/// The disk's points lifted to the hemisphere (Malley's method).
pub(super) fn cosine_hemisphere(u: DVec2) -> DVec3 {
    let disk = concentric_disk(u);
    disk.extend((1.0 - disk.length_squared()).max(0.0).sqrt())
}

/// Density of [`cosine_hemisphere`] by solid angle; 0 below the horizon.
pub(super) fn cosine_hemisphere_pdf(cos_theta: f64) -> f64 {
    FRAC_1_PI * cos_theta.max(0.0)
}

/// A unit vector, uniform by solid angle: z uniform in `[-1, 1]`, and any azimuth (Archimedes).
#[must_use]
pub fn uniform_sphere(u: DVec2) -> DVec3 {
    let z = 1.0 - 2.0 * u.y;
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = libm::sincos(2.0 * PI * u.x);
    DVec3::new(radius * cos, radius * sin, z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shade::Sampler;
    use crate::shade::testing::to_world;

    const COUNT: u32 = 200_000;

    /// Asserts that the mean of `value` over random points is `want` within five sigma.
    fn assert_mean(name: &str, want: f64, value: impl Fn(DVec2) -> f64) {
        let (mut sum, mut sum_sq) = (0.0, 0.0);
        for i in 0..COUNT {
            let value = value(Sampler::new(1, [i, 0], 0).next_2d());
            sum += value;
            sum_sq += value * value;
        }
        let n = f64::from(COUNT);
        let mean = sum / n;
        let sigma = ((sum_sq / n - mean * mean) / n).sqrt();
        let off = (mean - want).abs();
        assert!(off <= 5.0 * sigma + 1e-12, "{name}: got {mean}, want {want}, sigma {sigma}");
    }

    #[test]
    fn disk_is_uniform() {
        // E[x] = 0, E[x²] = 1/4, E[x y] = 0, E[r⁴] = 1/3, share within r < 1/2: 1/4
        assert_mean("x", 0.0, |u| concentric_disk(u).x);
        assert_mean("y", 0.0, |u| concentric_disk(u).y);
        assert_mean("x²", 0.25, |u| concentric_disk(u).x.powi(2));
        assert_mean("xy", 0.0, |u| concentric_disk(u).x * concentric_disk(u).y);
        assert_mean("r⁴", 1.0 / 3.0, |u| concentric_disk(u).length_squared().powi(2));
        let inner = |u| f64::from(u8::from(concentric_disk(u).length() < 0.5));
        assert_mean("inner", 0.25, inner);
        assert_eq!(concentric_disk(DVec2::splat(0.5)), DVec2::ZERO);
        assert!((concentric_disk(DVec2::ZERO).length() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn hemisphere_has_its_density() {
        // with density cos/π: E[z^k] = 2/(k+2), E[x²] = 1/4
        for k in 1..5 {
            assert_mean("z^k", 2.0 / f64::from(k + 2), |u| cosine_hemisphere(u).z.powi(k));
        }
        assert_mean("x²", 0.25, |u| cosine_hemisphere(u).x.powi(2));
        // E[1/pdf] over the part z > 1/10 is that part's solid angle
        let angle = |u| {
            let z = cosine_hemisphere(u).z;
            if z > 0.1 { 1.0 / cosine_hemisphere_pdf(z) } else { 0.0 }
        };
        assert_mean("solid angle", 2.0 * PI * 0.9, angle);
        assert_eq!(cosine_hemisphere_pdf(-0.5), 0.0);
    }

    #[test]
    fn sphere_is_uniform() {
        for k in 0..3 {
            assert_mean("component", 0.0, |u| uniform_sphere(u)[k]);
            assert_mean("square", 1.0 / 3.0, |u| uniform_sphere(u)[k].powi(2));
            assert_mean("fourth power", 0.2, |u| uniform_sphere(u)[k].powi(4));
        }
        assert_mean("length", 1.0, |u| uniform_sphere(u).length());
    }

    #[test]
    fn to_world_is_a_rotation() {
        for i in 0..1000 {
            let mut sampler = Sampler::new(2, [i, 0], 0);
            let normal = uniform_sphere(sampler.next_2d()).normalize();
            let local = cosine_hemisphere(sampler.next_2d());
            let world = to_world(normal, local);
            assert!((world.length() - 1.0).abs() < 1e-14);
            assert!((world.dot(normal) - local.z).abs() < 1e-14);
        }
    }
}
