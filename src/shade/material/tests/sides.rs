//! Frames, and materials with one side or two.

use std::f64::consts::FRAC_1_PI;

use super::super::*;
use crate::shade::testing::surface;
use crate::shade::{Sampler, warp};

fn clay(two_sided: bool, normal: DVec3) -> Bsdf<'static> {
    Bsdf::new(Model::Diffuse(Diffuse { reflectance: DVec3::new(0.6, 0.5, 0.4) }), two_sided, &surface(normal))
}

#[test]
fn samples_agree_with_eval() {
    for i in 0..10_000 {
        let mut sampler = Sampler::new(3, [i, 0], 0);
        let normal = warp::uniform_sphere(sampler.next_2d()).normalize();
        let viewer = warp::uniform_sphere(sampler.next_2d()).normalize();
        let u = sampler.next_2d();
        let sample = clay(true, normal).sample(viewer, 0.5, u).unwrap();
        let value = clay(true, normal).eval(viewer, sample.to_light);
        assert!((value.pdf / sample.pdf - 1.0).abs() < 1e-9, "sample {i}: {} {}", value.pdf, sample.pdf);
        let off = (value.value / value.pdf - sample.weight).abs().max_element();
        assert!(off < 1e-14, "sample {i}: off by {off:e}");
        let same_side = normal.dot(viewer) * normal.dot(sample.to_light);
        assert!(same_side > 0.0, "sample {i} went through the surface");
        let one_sided = clay(false, normal).sample(viewer, 0.5, u);
        assert_eq!(one_sided.is_some(), normal.dot(viewer) > 0.0);
    }
}

#[test]
fn sides() {
    let (above, below) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.6, 0.0, -0.8));
    let lit = DVec3::new(0.6, 0.5, 0.4) * (0.8 * FRAC_1_PI);
    for two_sided in [false, true] {
        let material = clay(two_sided, DVec3::Z);
        assert_eq!(material.eval(above, above).value, lit);
        assert_eq!(material.eval(above, below), BsdfValue::BLACK);
        assert_eq!(material.eval(below, above), BsdfValue::BLACK);
    }
    assert_eq!(clay(true, DVec3::Z).eval(below, below).value, lit);
    assert_eq!(clay(false, DVec3::Z).eval(below, below), BsdfValue::BLACK);
    assert_eq!(clay(true, DVec3::Z).sample(DVec3::X, 0.5, DVec2::splat(0.3)), None);
}
