//! Glass and liquids: light is reflected and refracted. Directions may be on both sides.

use glam::{DVec2, DVec3};

use super::microfacet::Microfacets;
use super::{BsdfSample, BsdfValue, fresnel};

/// An interface between two transparent media.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::shade) struct Glass {
    /// Index of refraction where the normal points away from, over that on the other side.
    pub(in crate::shade) eta: f64,
    /// Factor of all that is reflected.
    pub(in crate::shade) specular_reflectance: DVec3,
    /// Factor of all that is transmitted.
    pub(in crate::shade) specular_transmittance: DVec3,
}

/// A smooth interface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::shade) struct Dielectric(pub(in crate::shade) Glass);

impl Dielectric {
    /// Reflects with the probability that light does, or refracts.
    ///
    /// What is refracted shrinks with its cone by 1/eta²: this is radiance, not power.
    pub(super) fn sample(&self, to_viewer: DVec3, choice: f64) -> Option<BsdfSample> {
        let Glass { eta, specular_reflectance, specular_transmittance } = self.0;
        if !(to_viewer.z != 0.0 && to_viewer.is_finite()) {
            return None;
        }
        let interface = fresnel::dielectric(to_viewer.z, eta);
        let sample = if choice < interface.reflectance {
            BsdfSample {
                to_light: DVec3::new(-to_viewer.x, -to_viewer.y, to_viewer.z),
                weight: specular_reflectance,
                pdf: interface.reflectance,
                is_delta: true,
                eta: 1.0,
            }
        } else {
            let shrink = interface.inverse_eta;
            BsdfSample {
                to_light: DVec3::new(-shrink * to_viewer.x, -shrink * to_viewer.y, interface.cos_transmitted),
                weight: specular_transmittance * (shrink * shrink),
                pdf: 1.0 - interface.reflectance,
                is_delta: true,
                eta: interface.eta,
            }
        };
        (sample.to_light.z != 0.0).then_some(sample)
    }
}

/// A rough interface: facets that each reflect and refract as a smooth one (Walter et al. 2007).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::shade) struct RoughDielectric {
    pub(in crate::shade) glass: Glass,
    pub(in crate::shade) facets: Microfacets,
}

impl RoughDielectric {
    /// Walter et al. 2007, eqs. 20 and 21, the latter by 1/eta² for radiance.
    pub(super) fn eval(&self, to_viewer: DVec3, to_light: DVec3) -> BsdfValue {
        let sides = to_viewer.z * to_light.z;
        if !(sides != 0.0 && sides.is_finite()) {
            return BsdfValue::BLACK;
        }
        let half =
            if sides > 0.0 { to_viewer + to_light } else { to_viewer + to_light * self.eta_from(to_viewer) };
        let Some(m) = half.try_normalize() else { return BsdfValue::BLACK };
        let m = if m.z < 0.0 { -m } else { m };
        let interface = fresnel::dielectric(to_viewer.dot(m), self.glass.eta);
        let (weight, pdf) = self.weight_and_pdf(to_viewer, to_light, m, &interface);
        if !(pdf > 0.0 && pdf.is_finite()) {
            return BsdfValue::BLACK;
        }
        BsdfValue { value: weight * pdf, pdf }
    }

    /// Draws a facet that the viewer sees, which reflects with the probability that light does, or refracts.
    pub(super) fn sample(&self, to_viewer: DVec3, choice: f64, u: DVec2) -> Option<BsdfSample> {
        if !(to_viewer.z != 0.0 && to_viewer.is_finite()) {
            return None;
        }
        // the same facets are seen from below
        let above = if to_viewer.z > 0.0 { to_viewer } else { -to_viewer };
        let m = self.facets.sample_visible(above, u);
        let interface = fresnel::dielectric(to_viewer.dot(m), self.glass.eta);
        let reflects = choice < interface.reflectance;
        let to_light = if reflects {
            fresnel::reflect(to_viewer, m)
        } else {
            fresnel::refract(to_viewer, m, &interface)
        };
        if (to_viewer.z * to_light.z > 0.0) != reflects {
            return None;
        }
        let (weight, pdf) = self.weight_and_pdf(to_viewer, to_light, m, &interface);
        let eta = if reflects { 1.0 } else { interface.eta };
        (pdf > 0.0 && pdf.is_finite()).then_some(BsdfSample { to_light, weight, pdf, is_delta: false, eta })
    }

    /// Value over density, and density.
    fn weight_and_pdf(
        &self,
        to_viewer: DVec3,
        to_light: DVec3,
        m: DVec3,
        interface: &fresnel::Interface,
    ) -> (DVec3, f64) {
        let (viewer_m, light_m) = (to_viewer.dot(m), to_light.dot(m));
        let seen = self.facets.density(m) * self.facets.masking(to_viewer, m);
        let lit = self.facets.masking(to_light, m);
        // what would come out on the wrong side is not drawn
        let seen = if lit > 0.0 { seen } else { 0.0 };
        if to_viewer.z * to_light.z > 0.0 {
            let pdf = interface.reflectance * seen / (4.0 * to_viewer.z.abs());
            return (self.glass.specular_reflectance * lit, pdf);
        }
        let sum = viewer_m + interface.eta * light_m;
        let jacobian = interface.eta * interface.eta * light_m.abs() / (sum * sum);
        let pdf = (1.0 - interface.reflectance) * seen * viewer_m.abs() / to_viewer.z.abs() * jacobian;
        let shrink = interface.inverse_eta * interface.inverse_eta;
        (self.glass.specular_transmittance * (shrink * lit), pdf)
    }

    /// Index of refraction of the far side over that of the viewer's.
    fn eta_from(&self, to_viewer: DVec3) -> f64 {
        if to_viewer.z > 0.0 { self.glass.eta } else { 1.0 / self.glass.eta }
    }
}
