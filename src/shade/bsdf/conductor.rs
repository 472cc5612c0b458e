//! Metals, and mirrors.

use glam::{DVec2, DVec3};

use super::microfacet::Microfacets;
use super::{BsdfSample, BsdfValue, fresnel, is_above};

/// What a conductor reflects at an angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::shade) struct Metal {
    /// Real part of the index of refraction.
    pub(in crate::shade) eta: DVec3,
    /// Its imaginary part, the absorption.
    pub(in crate::shade) k: DVec3,
    /// Factor of all that is reflected.
    pub(in crate::shade) specular_reflectance: DVec3,
}

impl Metal {
    fn reflectance(&self, cos: f64) -> DVec3 {
        fresnel::conductor(cos, self.eta, self.k) * self.specular_reflectance
    }
}

/// A smooth conductor: reflects in one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::shade) struct Conductor(pub(in crate::shade) Metal);

impl Conductor {
    pub(super) fn sample(&self, to_viewer: DVec3) -> Option<BsdfSample> {
        is_above(to_viewer).then(|| BsdfSample {
            to_light: DVec3::new(-to_viewer.x, -to_viewer.y, to_viewer.z),
            weight: self.0.reflectance(to_viewer.z),
            pdf: 1.0,
            is_delta: true,
            eta: 1.0,
        })
    }
}

/// A rough conductor: facets that each reflect as a smooth one (Walter et al. 2007).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::shade) struct RoughConductor {
    pub(in crate::shade) metal: Metal,
    pub(in crate::shade) facets: Microfacets,
}

impl RoughConductor {
    /// F D G / (4 cos(viewer)), as the cosine of the light cancels (Walter et al. 2007, eq. 20).
    pub(super) fn eval(&self, to_viewer: DVec3, to_light: DVec3) -> BsdfValue {
        if !(is_above(to_viewer) && is_above(to_light)) {
            return BsdfValue::BLACK;
        }
        let m = (to_viewer + to_light).normalize();
        let pdf = self.pdf(to_viewer, m);
        if pdf > 0.0 {
            BsdfValue { value: self.weight(to_viewer, to_light, m) * pdf, pdf }
        } else {
            BsdfValue::BLACK
        }
    }

    /// Draws a facet that the viewer sees, and reflects.
    pub(super) fn sample(&self, to_viewer: DVec3, u: DVec2) -> Option<BsdfSample> {
        if !is_above(to_viewer) {
            return None;
        }
        let m = self.facets.sample_visible(to_viewer, u);
        let to_light = fresnel::reflect(to_viewer, m);
        let pdf = self.pdf(to_viewer, m);
        let weight = self.weight(to_viewer, to_light, m);
        (is_above(to_light) && pdf > 0.0).then_some(BsdfSample {
            to_light,
            weight,
            pdf,
            is_delta: false,
            eta: 1.0,
        })
    }

    /// The facets' density and the Jacobian 1 / (4 viewer·m) of reflection.
    fn pdf(&self, to_viewer: DVec3, m: DVec3) -> f64 {
        self.facets.density(m) * self.facets.masking(to_viewer, m) / (4.0 * to_viewer.z)
    }

    fn weight(&self, to_viewer: DVec3, to_light: DVec3, m: DVec3) -> DVec3 {
        self.metal.reflectance(to_viewer.dot(m)) * self.facets.masking(to_light, m)
    }
}
