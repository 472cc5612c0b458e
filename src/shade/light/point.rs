//! A point that shines alike in all directions.

use glam::DVec3;

use super::{LightEnd, LightSample};
use crate::math::rounding::gamma;

/// A light at a point: intensity / distance².
pub(super) fn sample(from: DVec3, position: DVec3, intensity: DVec3) -> Option<LightSample> {
    let way = position - from;
    let distance = way.length();
    (distance > 0.0).then(|| LightSample {
        direction: way / distance,
        end: Some(LightEnd {
            position,
            // given exactly; the subtraction that makes the ray rounds once
            position_error: gamma(1) * position.abs().max_element(),
            cos_light: 1.0,
            light: None,
        }),
        weight: intensity / (distance * distance),
        pdf: 1.0,
        is_delta: true,
    })
}
