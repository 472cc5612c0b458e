//! What decides a picture besides the scene.

use super::sampler::SamplerKind;
use crate::choice::Choice;
use crate::film::Aov;

/// How light is gathered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum IntegratorKind {
    /// Path tracing with next-event estimation and multiple importance sampling.
    #[default]
    Path,
    /// Light that reaches the surface straight from the lights.
    Direct,
}

impl Choice for IntegratorKind {
    const WHAT: &'static str = "integrator";
    const ALL: &'static [Self] = &[Self::Path, Self::Direct];

    fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Direct => "direct",
        }
    }
}

/// The `[render]` table of a scene, with Mitsuba's meanings and defaults.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// How light is gathered.
    pub integrator: IntegratorKind,
    /// How random numbers are drawn.
    pub sampler: SamplerKind,
    /// Samples for each pixel, at least 1.
    pub spp: u32,
    /// Longest path in segments; -1 is unlimited, 0 is black, 1 shows lights alone.
    pub max_depth: i32,
    /// Depth from which Russian roulette may end a path.
    pub rr_depth: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Layers written beside the picture, in the order asked for.
    pub aovs: Vec<Aov>,
    /// Whether lights that the camera sees directly are left out, also from alpha.
    pub hide_emitters: bool,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            integrator: IntegratorKind::Path,
            sampler: SamplerKind::Independent,
            spp: 64,
            max_depth: 8,
            rr_depth: 5,
            seed: 0,
            aovs: Vec::new(),
            hide_emitters: false,
        }
    }
}
