//! The lobes of Disney's material (Burley 2012 and 2015), as Mitsuba has them.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec2, DVec3};

use super::super::bsdf::{BsdfSample, BsdfValue};
use super::super::fresnel;
use super::super::microfacet::{MicrofacetDistribution, Microfacets};
use crate::shade::texture::luminance;
use crate::shade::warp;

/// Least roughness of the main reflection.
const MIN_ALPHA: f64 = 1e-3;

/// The roughness that masks the clear coat's facets, whatever its gloss (Burley 2012, section 5.6).
const CLEARCOAT_MASKING_ALPHA: f64 = 0.25;

/// The parameters at a point; all but `eta` in `[0, 1]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::shade::material) struct Parameters {
    pub(in crate::shade::material) base_color: DVec3,
    pub(in crate::shade::material) roughness: f64,
    pub(in crate::shade::material) anisotropic: f64,
    pub(in crate::shade::material) metallic: f64,
    pub(in crate::shade::material) spec_trans: f64,
    pub(in crate::shade::material) eta: f64,
    pub(in crate::shade::material) spec_tint: f64,
    pub(in crate::shade::material) sheen: f64,
    pub(in crate::shade::material) sheen_tint: f64,
    pub(in crate::shade::material) flatness: f64,
    pub(in crate::shade::material) clearcoat: f64,
    pub(in crate::shade::material) clearcoat_gloss: f64,
}

/// Lobes weighed by the parameters: a diffuse base with sheen, a microfacet reflection between that of a dielectric and
/// of a metal, transmission, and a clear coat. Without transmission it is black from below.
///
/// It is reciprocal, the transmission by the factor eta². It may reflect more than all light: sheen and retroreflection
/// are added to the rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::shade::material) struct Principled {
    p: Parameters,
    facets: Microfacets,
    coat: ClearCoat,
    /// Weight of the diffuse base.
    opaque: f64,
    /// Weight of the transmission.
    transparent: f64,
}

/// Two directions and the facet between them.
struct Pair {
    to_viewer: DVec3,
    to_light: DVec3,
    /// The facet's normal, upwards.
    m: DVec3,
    /// Whether both directions are on one side.
    reflects: bool,
    /// Whether the viewer is above the surface.
    above: bool,
    interface: fresnel::Interface,
}

impl Pair {
    /// Whether the facet is seen from both directions from the side that the surface is.
    fn is_compatible(&self) -> bool {
        let [viewer, light] =
            [self.to_viewer, self.to_light].map(|direction| direction.dot(self.m) * direction.z);
        viewer > 0.0 && light > 0.0
    }
}

/// Probabilities of the lobes, of sum 1.
struct Probabilities {
    diffuse: f64,
    clearcoat: f64,
    transmission: f64,
    reflection: f64,
}

impl Principled {
    pub(in crate::shade::material) fn new(p: Parameters) -> Self {
        // Burley 2012, section 5.4
        let aspect = (1.0 - 0.9 * p.anisotropic).max(0.0).sqrt();
        let alpha = p.roughness * p.roughness;
        let alpha = DVec2::new(alpha / aspect, alpha * aspect).max(DVec2::splat(MIN_ALPHA));
        Self {
            p,
            facets: Microfacets::new(MicrofacetDistribution::Ggx, alpha),
            coat: ClearCoat { alpha: 0.1 + (0.001 - 0.1) * p.clearcoat_gloss },
            opaque: (1.0 - p.metallic) * (1.0 - p.spec_trans),
            transparent: (1.0 - p.metallic) * p.spec_trans,
        }
    }

    pub(in crate::shade::material) fn eval(&self, to_viewer: DVec3, to_light: DVec3) -> BsdfValue {
        let Some(pair) = self.pair(to_viewer, to_light) else { return BsdfValue::BLACK };
        let pdf = self.pdf(&pair);
        if !(pdf > 0.0 && pdf.is_finite()) {
            return BsdfValue::BLACK;
        }
        let mut value = DVec3::ZERO;
        if pair.is_compatible() {
            let density = self.facets.density(pair.m);
            let masking = self.facets.masking(to_viewer, pair.m) * self.facets.masking(to_light, pair.m);
            value += if pair.reflects {
                let specular = self.fresnel(&pair) * (density * masking / (4.0 * to_viewer.z.abs()));
                let clearcoat = if pair.above { self.clearcoat(&pair) } else { 0.0 };
                specular + clearcoat
            } else {
                self.transmission(&pair, density * masking)
            };
        }
        if pair.reflects && pair.above {
            value += self.diffuse(&pair);
        }
        BsdfValue { value, pdf }
    }

    pub(in crate::shade::material) fn sample(
        &self,
        to_viewer: DVec3,
        choice: f64,
        u: DVec2,
    ) -> Option<BsdfSample> {
        if !(to_viewer.z != 0.0 && to_viewer.is_finite()) {
            return None;
        }
        let above = if to_viewer.z > 0.0 { to_viewer } else { -to_viewer };
        let m = self.facets.sample_visible(above, u);
        let interface = fresnel::dielectric(to_viewer.dot(m), self.p.eta);
        let probabilities = self.probabilities(to_viewer.z > 0.0, interface.reflectance);
        let mut left = choice - probabilities.diffuse;
        if left < 0.0 {
            let to_light = warp::cosine_hemisphere(u);
            return BsdfSample::smooth(to_light, self.eval(to_viewer, to_light), 1.0);
        }
        left -= probabilities.clearcoat;
        if left < 0.0 {
            let to_light = fresnel::reflect(to_viewer, self.coat.sample(u));
            return BsdfSample::smooth(to_light, self.above(to_viewer, to_light)?, 1.0);
        }
        left -= probabilities.transmission;
        if left < 0.0 {
            let to_light = fresnel::refract(to_viewer, m, &interface);
            let through = to_viewer.z * to_light.z < 0.0;
            return BsdfSample::smooth(
                to_light,
                through.then(|| self.eval(to_viewer, to_light))?,
                interface.eta,
            );
        }
        let to_light = fresnel::reflect(to_viewer, m);
        BsdfSample::smooth(to_light, self.above(to_viewer, to_light)?, 1.0)
    }

    /// The value of a reflection; none if it goes through the surface.
    fn above(&self, to_viewer: DVec3, to_light: DVec3) -> Option<BsdfValue> {
        (to_viewer.z * to_light.z > 0.0).then(|| self.eval(to_viewer, to_light))
    }

    /// None if no light goes this way.
    fn pair(&self, to_viewer: DVec3, to_light: DVec3) -> Option<Pair> {
        let sides = to_viewer.z * to_light.z;
        if !(sides != 0.0 && sides.is_finite()) {
            return None;
        }
        let (above, reflects) = (to_viewer.z > 0.0, sides > 0.0);
        if !(above && reflects || self.transparent > 0.0) {
            return None;
        }
        let eta = if above { self.p.eta } else { 1.0 / self.p.eta };
        let half = if reflects { to_viewer + to_light } else { to_viewer + to_light * eta };
        let m = half.try_normalize()?;
        let m = if m.z < 0.0 { -m } else { m };
        let interface = fresnel::dielectric(to_viewer.dot(m), self.p.eta);
        Some(Pair { to_viewer, to_light, m, reflects, above, interface })
    }

    /// Probabilities of the lobes where the facet reflects the share `reflectance` of light; all of Mitsuba's sampling
    /// rates are 1. The clear coat has a quarter of the main reflection's energy.
    fn probabilities(&self, above: bool, reflectance: f64) -> Probabilities {
        if !above {
            let reflection = reflectance;
            return Probabilities {
                diffuse: 0.0,
                clearcoat: 0.0,
                transmission: 1.0 - reflection,
                reflection,
            };
        }
        let clearcoat = 0.25 * self.p.clearcoat;
        let transmission = self.transparent * (1.0 - reflectance);
        let total = 1.0 + clearcoat + self.opaque;
        Probabilities {
            diffuse: self.opaque / total,
            clearcoat: clearcoat / total,
            transmission: transmission / total,
            reflection: (1.0 - transmission) / total,
        }
    }

    fn pdf(&self, pair: &Pair) -> f64 {
        let Probabilities { diffuse, clearcoat, transmission, reflection } =
            self.probabilities(pair.above, pair.interface.reflectance);
        let light_m = pair.to_light.dot(pair.m);
        let mut pdf =
            if pair.reflects { diffuse * warp::cosine_hemisphere_pdf(pair.to_light.z) } else { 0.0 };
        if pair.is_compatible() {
            let turned = if pair.above { pair.to_viewer } else { -pair.to_viewer };
            let facets = self.facets.visible_density(turned, pair.m);
            pdf += if pair.reflects {
                (reflection * facets + clearcoat * self.coat.pdf(pair.m)) / (4.0 * light_m.abs())
            } else {
                let sum = pair.to_viewer.dot(pair.m) + pair.interface.eta * light_m;
                transmission * facets * pair.interface.eta * pair.interface.eta * light_m.abs() / (sum * sum)
            };
        }
        pdf
    }

    /// The main reflection's share of light: that of a dielectric, tinted by Schlick's (1994) approximation, and of a
    /// metal by the same (Burley 2015, section 2).
    fn fresnel(&self, pair: &Pair) -> DVec3 {
        let Parameters { base_color, metallic, spec_tint, eta, .. } = self.p;
        let dielectric = pair.interface.reflectance;
        if dielectric == 0.0 {
            // without an interface not even the metal reflects, as in Mitsuba
            return DVec3::ZERO;
        }
        if !pair.above {
            return DVec3::splat(self.transparent * dielectric);
        }
        let cos = pair.to_viewer.dot(pair.m);
        let normal = (eta - 1.0) / (eta + 1.0);
        let tinted = tint(base_color) * (normal * normal);
        metallic * schlick(base_color, cos, eta)
            + (1.0 - metallic) * spec_tint * schlick(tinted, cos, eta)
            + (1.0 - metallic) * (1.0 - spec_tint) * dielectric
    }

    /// Walter et al. 2007, eq. 21, by 1/eta² for radiance; the colour is passed twice, in and out.
    fn transmission(&self, pair: &Pair, density_masking: f64) -> DVec3 {
        let colour = self.p.base_color.map(f64::sqrt);
        let (viewer_m, light_m) = (pair.to_viewer.dot(pair.m), pair.to_light.dot(pair.m));
        let sum = viewer_m + pair.interface.eta * light_m;
        let transmitted = 1.0 - pair.interface.reflectance;
        // eta² of the Jacobian and 1/eta² of radiance cancel
        let factor = transmitted * density_masking * viewer_m * light_m / (pair.to_viewer.z * sum * sum);
        colour * (self.transparent * factor.abs())
    }

    /// Burley 2012, section 5.6; of index of refraction 1.5.
    fn clearcoat(&self, pair: &Pair) -> f64 {
        let fresnel = schlick(DVec3::splat(0.04), pair.to_viewer.dot(pair.m), self.p.eta).x;
        let masking = clearcoat_masking(pair.to_viewer) * clearcoat_masking(pair.to_light);
        0.25 * self.p.clearcoat * fresnel * self.coat.density(pair.m) * masking * pair.to_light.z
    }

    /// Diffuse and retroreflection (Burley 2015, section 3), the flat look of shallow subsurface scattering after Hanrahan
    /// and Krueger (1993), and sheen (Burley 2012, sections 5.3 and 5.5).
    fn diffuse(&self, pair: &Pair) -> DVec3 {
        if self.opaque == 0.0 {
            return DVec3::ZERO;
        }
        let Parameters { base_color, roughness, metallic, flatness, sheen, sheen_tint, .. } = self.p;
        let [cos_viewer, cos_light] = [pair.to_viewer.z, pair.to_light.z];
        let (viewer, light) = (schlick_weight(cos_viewer), schlick_weight(cos_light));
        let cos_facet = pair.m.dot(pair.to_light);
        let lambert = (1.0 - 0.5 * viewer) * (1.0 - 0.5 * light);
        let rough = 2.0 * roughness * cos_facet * cos_facet;
        let retro = rough * (light + viewer + light * viewer * (rough - 1.0));
        let flattened = |weight: f64| 1.0 + (0.5 * rough - 1.0) * weight;
        let scattered = flattened(light) * flattened(viewer);
        let subsurface = 1.25 * (scattered * (1.0 / (cos_light + cos_viewer) - 0.5) + 0.5);
        let shape = lambert + retro + (subsurface - lambert - retro) * flatness;
        let base = base_color * (self.opaque * FRAC_1_PI * shape);
        let sheen_colour = DVec3::ONE + (tint(base_color) - 1.0) * sheen_tint;
        let sheen = sheen_colour * (sheen * (1.0 - metallic) * schlick_weight(cos_facet.abs()));
        (base + sheen) * cos_light
    }
}

/// Facets of the generalised Trowbridge–Reitz distribution with exponent 1 (Burley 2012, appendix B).
#[derive(Clone, Copy, Debug, PartialEq)]
struct ClearCoat {
    alpha: f64,
}

impl ClearCoat {
    fn density(self, m: DVec3) -> f64 {
        let alpha_sq = self.alpha * self.alpha;
        (alpha_sq - 1.0) / (PI * libm::log(alpha_sq) * (1.0 + (alpha_sq - 1.0) * m.z * m.z))
    }

    fn pdf(self, m: DVec3) -> f64 {
        m.z.max(0.0) * self.density(m)
    }

    /// A normal in proportion to its area on the surface.
    fn sample(self, u: DVec2) -> DVec3 {
        let alpha_sq = self.alpha * self.alpha;
        let cos_sq = ((1.0 - libm::pow(alpha_sq, 1.0 - u.y)) / (1.0 - alpha_sq)).clamp(0.0, 1.0);
        let (sin, cos) = libm::sincos(2.0 * PI * u.x);
        let radius = (1.0 - cos_sq).sqrt();
        DVec3::new(radius * cos, radius * sin, cos_sq.sqrt())
    }
}

/// Smith's masking of the clear coat for one direction.
fn clearcoat_masking(direction: DVec3) -> f64 {
    let cos_sq = direction.z * direction.z;
    let tan_sq = (1.0 - cos_sq).max(0.0) / cos_sq;
    2.0 / (1.0 + (1.0 + CLEARCOAT_MASKING_ALPHA * CLEARCOAT_MASKING_ALPHA * tan_sq).sqrt())
}

/// (1 - cos)⁵.
fn schlick_weight(cos: f64) -> f64 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m_sq = m * m;
    m_sq * m_sq * m
}

/// Schlick's (1994) approximation of the Fresnel equations, of value `normal` at normal incidence; of light from the
/// denser side by the refracted angle.
fn schlick(normal: DVec3, cos: f64, eta: f64) -> DVec3 {
    let interface = fresnel::dielectric(cos, eta);
    let cos = if interface.eta > 1.0 { cos.abs() } else { interface.cos_transmitted.abs() };
    normal + (DVec3::ONE - normal) * schlick_weight(cos)
}

/// A colour without its brightness; white for black.
fn tint(colour: DVec3) -> DVec3 {
    let luminance = luminance(colour);
    if luminance > 0.0 { colour / luminance } else { DVec3::ONE }
}
