//! A diffuse base under a smooth or rough transparent coat.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use super::bsdf::{BsdfSample, BsdfValue, is_above};
use super::fresnel;
use super::microfacet::{MicrofacetDistribution, Microfacets};
use super::prepared::{MaterialError, Textures};
use super::quadrature::gauss_legendre;
use super::refractive_index::{check_media, named_index, read_index};
use super::roughness::DEFAULT_ALPHA;
use super::{Material, MaterialKind, MaterialSettings, Model, Prepared, SIDES, read_colour, read_sides};
use crate::choice::Choice;
use crate::shade::parameters::{Parameter, ParameterSource, Parameters, choice};
use crate::shade::texture::{Texture, TextureSource};
use crate::shade::warp;

const COAT_KEYS: &[&str] =
    &["int_ior", "ext_ior", "diffuse_reflectance", "specular_reflectance", "nonlinear"];

/// Mitsuba's `plastic`.
pub(super) const KIND: MaterialKind = MaterialKind {
    name: "plastic",
    keys: &[COAT_KEYS, SIDES],
    read: |source| {
        Some(Material::Plastic(PlasticSource {
            coat: CoatSource::read(source),
            two_sided: read_sides(source).unwrap_or(true),
        }))
    },
};

/// Mitsuba's `roughplastic`.
pub(super) const ROUGH_KIND: MaterialKind = MaterialKind {
    name: "roughplastic",
    keys: &[COAT_KEYS, &["distribution", "alpha"], SIDES],
    read: |source| {
        let coat = CoatSource::read(source);
        check_media(source, coat.int_ior, coat.ext_ior);
        let alpha = source.number("alpha", "a number of at least 0", &|alpha| alpha >= 0.0);
        Some(Material::RoughPlastic(RoughPlasticSource {
            coat,
            distribution: choice(source, "distribution").unwrap_or_default(),
            alpha: alpha.unwrap_or(DEFAULT_ALPHA),
            two_sided: read_sides(source).unwrap_or(true),
        }))
    },
};

/// A diffuse base under a smooth coat.
#[derive(Clone, Debug, PartialEq)]
pub struct PlasticSource {
    /// The coat and the base.
    pub coat: CoatSource,
    /// Whether both sides reflect.
    pub two_sided: bool,
}

/// A diffuse base under a rough coat.
#[derive(Clone, Debug, PartialEq)]
pub struct RoughPlasticSource {
    /// The coat and the base, of different indices of refraction.
    pub coat: CoatSource,
    /// How the coat's normals are spread.
    pub distribution: MicrofacetDistribution,
    /// The coat's roughness.
    pub alpha: f64,
    /// Whether both sides reflect.
    pub two_sided: bool,
}

/// A diffuse base under a transparent coat.
#[derive(Clone, Debug, PartialEq)]
pub struct CoatSource {
    /// Index of refraction of the coat.
    pub int_ior: f64,
    /// Index of refraction outside.
    pub ext_ior: f64,
    /// Colour of the base.
    pub diffuse_reflectance: TextureSource,
    /// Factor of what the coat reflects.
    pub specular_reflectance: TextureSource,
    /// Whether light that the coat reflects back to the base takes the base's colour again each time.
    pub nonlinear: bool,
}

impl Default for CoatSource {
    fn default() -> Self {
        Self {
            int_ior: named_index("polypropylene"),
            ext_ior: named_index("air"),
            diffuse_reflectance: TextureSource::from(0.5),
            specular_reflectance: TextureSource::from(1.0),
            nonlinear: false,
        }
    }
}

impl CoatSource {
    fn read(source: &dyn ParameterSource) -> Self {
        let default = Self::default();
        let colour = |key, default| read_colour(source, key, default);
        Self {
            int_ior: read_index(source, "int_ior").unwrap_or(default.int_ior),
            ext_ior: read_index(source, "ext_ior").unwrap_or(default.ext_ior),
            diffuse_reflectance: colour("diffuse_reflectance", default.diffuse_reflectance),
            specular_reflectance: colour("specular_reflectance", default.specular_reflectance),
            nonlinear: source.flag("nonlinear").unwrap_or(default.nonlinear),
        }
    }

    fn parameters(&self) -> Parameters<'_> {
        vec![
            ("int_ior", Parameter::Number(self.int_ior)),
            ("ext_ior", Parameter::Number(self.ext_ior)),
            ("nonlinear", Parameter::Flag(self.nonlinear)),
            ("diffuse_reflectance", Parameter::ColourTexture(&self.diffuse_reflectance)),
            ("specular_reflectance", Parameter::ColourTexture(&self.specular_reflectance)),
        ]
    }
}

impl MaterialSettings for PlasticSource {
    fn kind(&self) -> &'static str {
        KIND.name
    }

    fn parameters(&self) -> Parameters<'_> {
        self.coat.parameters()
    }

    fn two_sided(&self) -> Option<bool> {
        Some(self.two_sided)
    }

    fn prepare(&self, textures: &mut Textures) -> Result<Box<dyn Prepared>, MaterialError> {
        Ok(Box::new(PreparedPlastic(PreparedCoat::try_new(&self.coat, textures)?)))
    }
}

impl MaterialSettings for RoughPlasticSource {
    fn kind(&self) -> &'static str {
        ROUGH_KIND.name
    }

    fn parameters(&self) -> Parameters<'_> {
        let mut parameters = self.coat.parameters();
        parameters.push(("distribution", Parameter::Name(self.distribution.name())));
        parameters.push(("alpha", Parameter::Number(self.alpha)));
        parameters
    }

    fn two_sided(&self) -> Option<bool> {
        Some(self.two_sided)
    }

    fn prepare(&self, textures: &mut Textures) -> Result<Box<dyn Prepared>, MaterialError> {
        let coat = PreparedCoat::try_new(&self.coat, textures)?;
        let rough = RoughCoat::new(self.distribution, self.alpha, coat.eta);
        Ok(Box::new(PreparedRoughPlastic { coat, rough }))
    }
}

#[derive(Debug)]
struct PreparedCoat {
    eta: f64,
    diffuse_reflectance: Texture,
    specular_reflectance: Texture,
    nonlinear: bool,
    specular_weight: f64,
}

impl PreparedCoat {
    fn try_new(source: &CoatSource, textures: &mut Textures) -> Result<Self, MaterialError> {
        let diffuse_reflectance = textures.read(&source.diffuse_reflectance)?;
        let specular_reflectance = textures.read(&source.specular_reflectance)?;
        let [diffuse, specular] = [diffuse_reflectance.mean(), specular_reflectance.mean()];
        // a coat and a base that are black are sampled alike
        let specular_weight = if diffuse + specular > 0.0 { specular / (diffuse + specular) } else { 0.5 };
        let (eta, nonlinear) = (source.int_ior / source.ext_ior, source.nonlinear);
        Ok(Self { eta, diffuse_reflectance, specular_reflectance, nonlinear, specular_weight })
    }

    fn at(&self, uv: DVec2) -> Coat {
        Coat {
            eta: self.eta,
            diffuse_reflectance: self.diffuse_reflectance.colour(uv),
            specular_reflectance: self.specular_reflectance.colour(uv),
            nonlinear: self.nonlinear,
            specular_weight: self.specular_weight,
        }
    }
}

#[derive(Debug)]
struct PreparedPlastic(PreparedCoat);

impl Prepared for PreparedPlastic {
    fn model(&self, uv: DVec2) -> Model<'_> {
        Model::Plastic(Plastic(self.0.at(uv)))
    }

    fn diffuse_colour(&self, uv: DVec2) -> Option<DVec3> {
        Some(self.0.diffuse_reflectance.colour(uv))
    }
}

#[derive(Debug)]
struct PreparedRoughPlastic {
    coat: PreparedCoat,
    rough: RoughCoat,
}

impl Prepared for PreparedRoughPlastic {
    fn model(&self, uv: DVec2) -> Model<'_> {
        Model::RoughPlastic(RoughPlastic { coat: self.coat.at(uv), rough: &self.rough })
    }

    fn diffuse_colour(&self, uv: DVec2) -> Option<DVec3> {
        Some(self.coat.diffuse_reflectance.colour(uv))
    }
}

/// The coat's optics and colours at a point, for both kinds of coat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coat {
    /// Index of refraction inside over that outside.
    pub(super) eta: f64,
    /// Colour of the base.
    pub(super) diffuse_reflectance: DVec3,
    /// Factor of what the coat reflects.
    pub(super) specular_reflectance: DVec3,
    /// Whether light that the coat reflects back to the base takes the base's colour again each time.
    pub(super) nonlinear: bool,
    /// Mean specular reflectance over its sum with the mean diffuse one, by which samples go to the coat.
    pub(super) specular_weight: f64,
}

impl Coat {
    /// The base's reflectance with all light that goes back and forth below the coat, which reflects the share
    /// `internal` back (Weidlich and Wilkie 2007; d'Eon and Irving 2011).
    fn base(&self, internal: f64) -> DVec3 {
        let colour = self.diffuse_reflectance;
        let again = if self.nonlinear { colour * internal } else { DVec3::splat(internal) };
        colour / (1.0 - again) / (self.eta * self.eta)
    }

    /// Probability of the coat, where it reflects the share `reflected`.
    fn specular_probability(&self, reflected: f64) -> f64 {
        let specular = reflected * self.specular_weight;
        let diffuse = (1.0 - reflected) * (1.0 - self.specular_weight);
        // where neither reflects it does not matter
        if specular > 0.0 { specular / (specular + diffuse) } else { 0.0 }
    }
}

/// A smooth coat over a diffuse base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plastic(pub(super) Coat);

impl Plastic {
    /// The base alone: the coat's reflection is a delta distribution.
    pub(super) fn eval(&self, to_viewer: DVec3, to_light: DVec3) -> BsdfValue {
        if !(is_above(to_viewer) && is_above(to_light)) {
            return BsdfValue::BLACK;
        }
        let reflected = self.reflected(to_viewer);
        let cosine = warp::cosine_hemisphere_pdf(to_light.z);
        let pdf = cosine * (1.0 - self.0.specular_probability(reflected));
        BsdfValue { value: self.diffuse(reflected, to_light) * cosine, pdf }
    }

    /// Goes to the coat or to the base by their strengths.
    pub(super) fn sample(&self, to_viewer: DVec3, choice: f64, u: DVec2) -> Option<BsdfSample> {
        if !is_above(to_viewer) {
            return None;
        }
        let reflected = self.reflected(to_viewer);
        let probability = self.0.specular_probability(reflected);
        if choice < probability {
            return Some(BsdfSample {
                to_light: DVec3::new(-to_viewer.x, -to_viewer.y, to_viewer.z),
                weight: self.0.specular_reflectance * (reflected / probability),
                pdf: probability,
                is_delta: true,
                eta: 1.0,
            });
        }
        let to_light = warp::cosine_hemisphere(u);
        let probability = 1.0 - probability;
        let pdf = probability * warp::cosine_hemisphere_pdf(to_light.z);
        let weight = self.diffuse(reflected, to_light) / probability;
        (pdf > 0.0).then_some(BsdfSample { to_light, weight, pdf, is_delta: false, eta: 1.0 })
    }

    fn reflected(&self, direction: DVec3) -> f64 {
        fresnel::dielectric(direction.z, self.0.eta).reflectance
    }

    /// BSDF times π: in through the coat, about the base, out through the coat.
    fn diffuse(&self, reflected: f64, to_light: DVec3) -> DVec3 {
        let internal = fresnel::diffuse_reflectance(1.0 / self.0.eta);
        self.0.base(internal) * ((1.0 - reflected) * (1.0 - self.reflected(to_light)))
    }
}

/// What a rough coat lets through, computed once for a material.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RoughCoat {
    facets: Microfacets,
    /// Share that is transmitted from outside, at cosines from 0 to 1 in equal steps.
    transmittance: Vec<f64>,
    /// Share of diffuse light from inside that is reflected back.
    internal_reflectance: f64,
}

/// Cosines at which a rough coat's transmittance is computed, as in Mitsuba.
const COSINES: usize = 64;

impl RoughCoat {
    pub(super) fn new(distribution: MicrofacetDistribution, alpha: f64, eta: f64) -> Self {
        let facets = Microfacets::new(distribution, DVec2::splat(alpha));
        let viewers = (0..COSINES).map(|i| {
            let cos = (i as f64 / (COSINES - 1) as f64).max(1e-6);
            DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
        });
        // as Mitsuba: more points where there is total reflection
        let rule = |eta: f64| Rule::new(if eta > 1.0 { 32 } else { 128 });
        let (outside, inside) = (rule(eta), rule(1.0 / eta));
        let transmittance =
            viewers.clone().map(|viewer| transmitted(&facets, viewer, eta, &outside)).collect();
        let reflected: f64 =
            viewers.map(|viewer| viewer.z * reflected(&facets, viewer, 1.0 / eta, &inside)).sum();
        Self { facets, transmittance, internal_reflectance: 2.0 * reflected / COSINES as f64 }
    }

    /// Share that is transmitted at an angle, linear between the cosines.
    fn transmittance(&self, cos: f64) -> f64 {
        let place = cos.clamp(0.0, 1.0) * (COSINES - 1) as f64;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 0 and COSINES - 1"
        )]
        let index = (place as usize).min(COSINES - 2);
        let [low, high] = [self.transmittance[index], self.transmittance[index + 1]];
        low + (high - low) * (place - index as f64)
    }
}

/// A product of Gauss rules over the unit square.
struct Rule {
    points: Vec<f64>,
    weights: Vec<f64>,
}

impl Rule {
    fn new(order: u32) -> Self {
        let (points, weights) = gauss_legendre(order).into_iter().unzip();
        Self { points, weights }
    }

    /// Mean of a function of the normals that a viewer sees.
    fn mean(&self, facets: &Microfacets, viewer: DVec3, integrand: impl Fn(DVec3) -> f64) -> f64 {
        let normals = facets.sample_visible_grid(viewer, &self.points);
        let rows = normals.chunks_exact(self.points.len()).zip(&self.weights);
        let row = |normals: &[DVec3]| -> f64 {
            normals.iter().zip(&self.weights).map(|(m, weight)| weight * integrand(*m)).sum()
        };
        rows.map(|(normals, weight)| weight * row(normals)).sum()
    }
}

/// Share of light from a direction that facets transmit.
fn transmitted(facets: &Microfacets, viewer: DVec3, eta: f64, rule: &Rule) -> f64 {
    rule.mean(facets, viewer, |m| {
        let interface = fresnel::dielectric(viewer.dot(m), eta);
        let light = fresnel::refract(viewer, m, &interface);
        if light.z < 0.0 { facets.masking(light, m) * (1.0 - interface.reflectance) } else { 0.0 }
    })
}

/// Share of light from a direction that facets reflect.
fn reflected(facets: &Microfacets, viewer: DVec3, eta: f64, rule: &Rule) -> f64 {
    rule.mean(facets, viewer, |m| {
        let light = fresnel::reflect(viewer, m);
        if light.z > 0.0 {
            facets.masking(light, m) * fresnel::dielectric(viewer.dot(m), eta).reflectance
        } else {
            0.0
        }
    })
}

/// A rough coat over a diffuse base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RoughPlastic<'a> {
    pub(super) coat: Coat,
    pub(super) rough: &'a RoughCoat,
}

impl RoughPlastic<'_> {
    /// The facets' reflection and the base's.
    pub(super) fn eval(&self, to_viewer: DVec3, to_light: DVec3) -> BsdfValue {
        if !(is_above(to_viewer) && is_above(to_light)) {
            return BsdfValue::BLACK;
        }
        let RoughCoat { facets, internal_reflectance, .. } = self.rough;
        let m = (to_viewer + to_light).normalize();
        let seen = facets.density(m) * facets.masking(to_viewer, m) / (4.0 * to_viewer.z);
        let reflectance = fresnel::dielectric(to_viewer.dot(m), self.coat.eta).reflectance;
        let specular = reflectance * facets.masking(to_light, m) * seen;
        let enters = self.rough.transmittance(to_viewer.z);
        let leaves = self.rough.transmittance(to_light.z);
        let diffuse = self.coat.base(*internal_reflectance) * (FRAC_1_PI * to_light.z * enters * leaves);
        let probability = self.coat.specular_probability(1.0 - enters);
        let cosine = warp::cosine_hemisphere_pdf(to_light.z);
        BsdfValue {
            value: self.coat.specular_reflectance * specular + diffuse,
            pdf: probability * seen + (1.0 - probability) * cosine,
        }
    }

    /// Goes to the coat or to the base by their strengths.
    pub(super) fn sample(&self, to_viewer: DVec3, choice: f64, u: DVec2) -> Option<BsdfSample> {
        if !is_above(to_viewer) {
            return None;
        }
        let enters = self.rough.transmittance(to_viewer.z);
        let to_light = if choice < self.coat.specular_probability(1.0 - enters) {
            fresnel::reflect(to_viewer, self.rough.facets.sample_visible(to_viewer, u))
        } else {
            warp::cosine_hemisphere(u)
        };
        BsdfSample::smooth(to_light, self.eval(to_viewer, to_light), 1.0)
    }
}
