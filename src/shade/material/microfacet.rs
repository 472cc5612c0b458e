//! Rough surfaces as many small mirrors: how their normals are spread, and which of them are seen.

use std::f64::consts::{FRAC_2_SQRT_PI, PI};

use glam::{DVec2, DVec3};

use crate::choice::Choice;
use crate::shade::warp;

/// Half of 2/√π.
const FRAC_1_SQRT_PI: f64 = 0.5 * FRAC_2_SQRT_PI;

/// Least roughness; what is smoother counts as this, as in Mitsuba.
const MIN_ALPHA: f64 = 1e-4;

/// Density below which there are no normals, as in Mitsuba.
const MIN_DENSITY: f64 = 1e-20;

/// How the normals of a rough surface are spread.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum MicrofacetDistribution {
    /// Slopes of a Gaussian (Beckmann and Spizzichino 1963).
    #[default]
    Beckmann,
    /// Longer tails (Trowbridge and Reitz 1975; Walter et al. 2007).
    Ggx,
}

impl Choice for MicrofacetDistribution {
    const WHAT: &'static str = "distribution";
    const ALL: &'static [Self] = &[Self::Beckmann, Self::Ggx];

    fn name(self) -> &'static str {
        match self {
            Self::Beckmann => "beckmann",
            Self::Ggx => "ggx",
        }
    }
}

/// The normals of a rough surface, in its shading frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Microfacets {
    distribution: MicrofacetDistribution,
    /// Roughness along x and y.
    alpha: DVec2,
}

impl Microfacets {
    pub(super) fn new(distribution: MicrofacetDistribution, alpha: DVec2) -> Self {
        Self { distribution, alpha: alpha.max(DVec2::splat(MIN_ALPHA)) }
    }

    /// Area of facets with normal `m` by the solid angle of `m` and the surface's area: D of Walter et al. 2007,
    /// eqs. 25 and 33, and in both directions Heitz 2014, eqs. 83 and 85.
    pub(super) fn density(&self, m: DVec3) -> f64 {
        let stretched = DVec2::new(m.x, m.y) / self.alpha;
        let (tan_sq, cos_sq) = (stretched.length_squared(), m.z * m.z);
        let area = PI * self.alpha.x * self.alpha.y;
        let density = match self.distribution {
            MicrofacetDistribution::Beckmann => libm::exp(-tan_sq / cos_sq) / (area * cos_sq * cos_sq),
            MicrofacetDistribution::Ggx => {
                let sum = tan_sq + cos_sq;
                1.0 / (area * sum * sum)
            }
        };
        if density * m.z > MIN_DENSITY { density } else { 0.0 }
    }

    /// Share of the facets with normal `m` that is seen from `direction`: Smith's G1 (Walter et al. 2007, eq. 34 and,
    /// for Beckmann, the rational fit of eq. 27, within 0.35 %, as in Mitsuba).
    pub(super) fn masking(&self, direction: DVec3, m: DVec3) -> f64 {
        // the back of a facet is not seen from the front of the surface, nor its front from the back
        let sides = direction.dot(m) * direction.z;
        if sides.is_nan() || sides <= 0.0 {
            return 0.0;
        }
        let across_sq = (DVec2::new(direction.x, direction.y) * self.alpha).length_squared();
        if across_sq == 0.0 {
            return 1.0;
        }
        let tan_sq = across_sq / (direction.z * direction.z);
        match self.distribution {
            MicrofacetDistribution::Beckmann => {
                let a = 1.0 / tan_sq.sqrt();
                if a >= 1.6 {
                    1.0
                } else {
                    let a_sq = a * a;
                    (3.535 * a + 2.181 * a_sq) / (1.0 + 2.276 * a + 2.577 * a_sq)
                }
            }
            MicrofacetDistribution::Ggx => 2.0 / (1.0 + (1.0 + tan_sq).sqrt()),
        }
    }

    /// Density of [`Microfacets::sample_visible`] by the solid angle of `m` (Heitz 2018, eq. 3); for `viewer` above the
    /// horizon.
    pub(super) fn visible_density(&self, viewer: DVec3, m: DVec3) -> f64 {
        self.density(m) * self.masking(viewer, m) * viewer.dot(m).abs() / viewer.z
    }

    /// A normal in proportion to its facets' area as `viewer`, above the horizon, sees it.
    pub(super) fn sample_visible(&self, viewer: DVec3, u: DVec2) -> DVec3 {
        let view = self.view(viewer);
        let normal = match self.distribution {
            MicrofacetDistribution::Beckmann => {
                DVec3::new(-visible_gaussian_slope(&view, u.x), -gaussian_slope(u.y), 1.0)
            }
            MicrofacetDistribution::Ggx => visible_ggx(&view, u),
        };
        self.unstretch(&view, normal)
    }

    /// [`Microfacets::sample_visible`] for all pairs of coordinates, the first one running fastest.
    pub(super) fn sample_visible_grid(&self, viewer: DVec3, coordinates: &[f64]) -> Vec<DVec3> {
        let view = self.view(viewer);
        let slopes =
            |slope: &dyn Fn(f64) -> f64| -> Vec<f64> { coordinates.iter().map(|&u| slope(u)).collect() };
        match self.distribution {
            MicrofacetDistribution::Beckmann => {
                // the two slopes are independent, and dear
                let along = slopes(&|u| visible_gaussian_slope(&view, u));
                let across = slopes(&gaussian_slope);
                let normal = |y: f64| along.iter().map(move |x| DVec3::new(-x, -y, 1.0));
                across.iter().flat_map(|&y| normal(y)).map(|normal| self.unstretch(&view, normal)).collect()
            }
            MicrofacetDistribution::Ggx => {
                let points =
                    coordinates.iter().flat_map(|&v| coordinates.iter().map(move |&u| DVec2::new(u, v)));
                points.map(|u| self.unstretch(&view, visible_ggx(&view, u))).collect()
            }
        }
    }

    /// Stretching makes the roughness of all such surfaces 1 (Heitz and d'Eon 2014).
    fn view(&self, viewer: DVec3) -> View {
        let stretched = DVec3::new(self.alpha.x * viewer.x, self.alpha.y * viewer.y, viewer.z).normalize();
        let (sin, cos) = (stretched.x.hypot(stretched.y), stretched.z);
        let azimuth = if sin > 0.0 { DVec2::new(stretched.x, stretched.y) / sin } else { DVec2::X };
        View { sin, cos, azimuth }
    }

    fn unstretch(&self, view: &View, normal: DVec3) -> DVec3 {
        let turned = view.azimuth.rotate(DVec2::new(normal.x, normal.y)) * self.alpha;
        turned.extend(normal.z).normalize()
    }
}

/// A direction to a surface of roughness 1.
struct View {
    /// Sine and cosine of the angle with the normal.
    sin: f64,
    cos: f64,
    /// Unit vector along the surface; the sampled normals have it as x axis.
    azimuth: DVec2,
}

/// A visible normal of GGX with roughness 1, of any length.
///
/// Heitz 2018: such facets are a hemisphere's; the viewer sees its disk, of which the lower half is narrowed.
fn visible_ggx(view: &View, u: DVec2) -> DVec3 {
    let disk = warp::concentric_disk(u);
    let (x, upper) = (disk.x, (1.0 - disk.x * disk.x).max(0.0).sqrt());
    let share = 0.5 * (1.0 + view.cos);
    let y = upper + (disk.y - upper) * share;
    let z = (1.0 - x * x - y * y).max(0.0).sqrt();
    DVec3::new(view.sin * z - view.cos * y, -x, (view.sin * y + view.cos * z).max(0.0))
}

/// A visible slope towards the viewer of Beckmann's distribution with roughness 1.
///
/// Up to a factor it has the distribution function 1 + erf(s) + tan(θ) exp(-s²) / √π (Heitz and d'Eon 2014), which is
/// inverted by Newton's method within an interval.
fn visible_gaussian_slope(view: &View, u: f64) -> f64 {
    let u = u.clamp(MIN_SHARE, 1.0 - MIN_SHARE);
    let (tan, cot) = (view.sin / view.cos, view.cos / view.sin);
    let below = |slope: f64| 1.0 + libm::erf(slope) + FRAC_1_SQRT_PI * tan * libm::exp(-slope * slope);
    let (mut low, mut high) = (-MAX_SLOPE, cot.min(MAX_SLOPE));
    let target = u * below(high);
    // the solution at grazing angles, where it is farthest from linear
    let erf_high = libm::erf(high);
    let start = erf_high - (erf_high + 1.0) * libm::erf((-libm::log(u)).sqrt());
    let mut slope = inverse_erf(start).clamp(low, high);
    for _ in 0..MAX_STEPS {
        let excess = below(slope) - target;
        if excess > 0.0 {
            high = slope;
        } else {
            low = slope;
        }
        let derivative = FRAC_2_SQRT_PI * libm::exp(-slope * slope) * (1.0 - slope * tan);
        let newton = slope - excess / derivative;
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        let step = (next - slope).abs();
        slope = next;
        // Newton's next step would be about the square of this
        if step < 1e-9 {
            break;
        }
    }
    slope
}

/// The slope across the view: a Gaussian's.
fn gaussian_slope(u: f64) -> f64 {
    inverse_erf(2.0 * u.clamp(MIN_SHARE, 1.0 - MIN_SHARE) - 1.0)
}

/// Least share of a Gaussian's tail that is told apart.
const MIN_SHARE: f64 = 1e-12;

/// Slopes beyond which a Gaussian is 0 in double precision.
const MAX_SLOPE: f64 = 6.0;

/// Enough steps of bisection for the precision of doubles; Newton's take about five.
const MAX_STEPS: usize = 60;

/// The inverse of the error function, for arguments within 1 - 1e-13 of 0.
///
/// Giles' (2010) fit for single precision and two steps of Halley's method.
fn inverse_erf(x: f64) -> f64 {
    let w = -libm::log((1.0 - x) * (1.0 + x));
    let (w, coefficients): (f64, [f64; 9]) = if w < 5.0 {
        (
            w - 2.5,
            [
                2.810_226_36e-8,
                3.432_739_39e-7,
                -3.523_387_7e-6,
                -4.391_506_54e-6,
                2.185_808_7e-4,
                -1.253_725_03e-3,
                -4.177_681_64e-3,
                0.246_640_727,
                1.501_409_41,
            ],
        )
    } else {
        (
            w.sqrt() - 3.0,
            [
                -2.002_142_57e-4,
                1.009_505_58e-4,
                1.349_343_22e-3,
                -3.673_428_44e-3,
                5.739_507_73e-3,
                -7.622_461_3e-3,
                9.438_870_47e-3,
                1.001_674_06,
                2.832_976_82,
            ],
        )
    };
    let mut y = x * coefficients.into_iter().fold(0.0, |sum, coefficient| sum * w + coefficient);
    for _ in 0..2 {
        let newton = (libm::erf(y) - x) / (FRAC_2_SQRT_PI * libm::exp(-y * y));
        y -= newton / (1.0 + y * newton);
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;
    use MicrofacetDistribution::{Beckmann, Ggx};

    #[test]
    fn the_inverse_error_function_is_one() {
        for i in -600..600 {
            let y = f64::from(i) * 0.008;
            let x = libm::erf(y);
            let got = inverse_erf(x);
            let bound = 1e-13 + 4.0 * f64::EPSILON / libm::exp(-y * y);
            assert!((got - y).abs() < bound, "erf⁻¹({x}) = {got}, want {y}");
        }
    }

    /// The integral over the directions with z > 0, by the middles of n² parts of the same solid angle.
    fn over_hemisphere(n: u32, value: impl Fn(DVec3) -> f64) -> f64 {
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n {
                let (z, phi) = (f64::from(i) + 0.5, f64::from(j) + 0.5);
                let (z, phi) = (z / f64::from(n), 2.0 * PI * phi / f64::from(n));
                let (sin, cos) = libm::sincos(phi);
                let radius = (1.0 - z * z).sqrt();
                sum += value(DVec3::new(radius * cos, radius * sin, z));
            }
        }
        sum * 2.0 * PI / f64::from(n * n)
    }

    #[test]
    fn facets_cover_the_surface() {
        // ∫ D(m) cos(m) dm = 1
        for distribution in [Beckmann, Ggx] {
            for alpha in [DVec2::splat(0.5), DVec2::new(0.3, 0.8), DVec2::splat(1.5)] {
                let facets = Microfacets::new(distribution, alpha);
                let covered = over_hemisphere(600, |m| m.z * facets.density(m));
                assert!((covered - 1.0).abs() < 1e-3, "{distribution:?} {alpha}: {covered}");
            }
        }
    }

    #[test]
    fn visible_facets_project_to_the_surface() {
        // ∫ G1(v, m) max(v·m, 0) D(m) dm = cos(v) (Heitz 2014, eq. 14), exactly for GGX, within the fit for Beckmann
        for (distribution, bound) in [(Beckmann, 4e-3), (Ggx, 1e-3)] {
            let facets = Microfacets::new(distribution, DVec2::new(0.4, 0.7));
            for viewer in [DVec3::Z, DVec3::new(0.6, 0.3, 0.5), DVec3::new(-0.3, 0.9, 0.1)] {
                let viewer = viewer.normalize();
                let total = over_hemisphere(1000, |m| facets.visible_density(viewer, m));
                assert!((total - 1.0).abs() < bound, "{distribution:?} {viewer}: {total}");
            }
        }
    }
}
