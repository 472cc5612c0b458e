//! Lights against closed forms, their own densities, and Mitsuba.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DAffine3, DQuat};

use super::*;
use crate::film::Picture;
use crate::shade::Sampler;
use crate::subdivide::FrameChoice;
use crate::test_support::{Noise, ball_triangles, deform, random_volume};
use crate::trace::{NoAttributes, TracedScene};

fn set_of(lights: &[Light]) -> LightSet {
    LightSet::try_new(lights, &[]).unwrap()
}

fn square(z: f64) -> Light {
    // shines downwards
    let turn = DAffine3::from_rotation_x(PI);
    Light::Area(AreaLight {
        shape: AreaShape::Rectangle,
        to_world: DAffine3::from_translation(DVec3::new(0.0, 0.0, z)) * turn,
        radiance: DVec3::splat(2.0),
    })
}

fn ball(centre: DVec3, radius: f64) -> Light {
    let to_world = DAffine3::from_scale_rotation_translation(DVec3::splat(radius), DQuat::IDENTITY, centre);
    Light::Area(AreaLight { shape: AreaShape::Sphere, to_world, radiance: DVec3::splat(2.0) })
}

fn disk() -> Light {
    let to_world = DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0))
        * DAffine3::from_rotation_y(40.0_f64.to_radians())
        * DAffine3::from_scale(DVec3::new(2.0, 0.5, 1.0));
    Light::Area(AreaLight { shape: AreaShape::Disk, to_world, radiance: DVec3::splat(2.0) })
}

/// 4 x 3 pixels of three kinds of pattern, one with black in it.
fn picture() -> Arc<Picture> {
    let pixel =
        |x: u8, y: u8| [f32::from(1 + x), f32::from(1 + 2 * y), 0.25 * f32::from((7 * x + 5 * y) % 11)];
    let places = (0..3).flat_map(|y| (0..4).map(move |x| (x, y)));
    Arc::new(Picture { size: [4, 3], pixels: places.map(|(x, y)| pixel(x, y)).collect() })
}

fn envmap(to_world: DAffine3) -> Light {
    Light::Envmap(EnvironmentLight { picture: PictureSource::Read(picture()), scale: 2.0, to_world })
}

/// A ball deformed by a shaken lattice, as an object of two; it shines.
fn deformed_ball(degree: [usize; 3], rational: bool) -> (LightSet, TracedScene) {
    let mut noise = Noise(9);
    let volume = random_volume(&mut noise, degree, degree.map(|k| k + 2), 0.25, rational);
    let object =
        |name: &str, shell| TracedObject { name: name.into(), shell, attributes: Box::new(NoAttributes) };
    let far = |corner: DVec3| corner + DVec3::new(50.0, 0.0, 0.0);
    let triangles: Vec<_> = ball_triangles().into_iter().map(|triangle| triangle.map(far)).collect();
    let objects = vec![
        object("dark", deform(&triangles, None, FrameChoice::Parallelogram)),
        object("lamp", deform(&ball_triangles(), Some(&volume), FrameChoice::Parallelogram)),
    ];
    let lights =
        LightSet::try_new(&[Light::Object(ObjectLight { object: 1, radiance: DVec3::splat(3.0) })], &objects);
    (lights.unwrap(), TracedScene::new(objects))
}

/// Mean of `value` over uniform samples, and its standard error.
fn mean(count: u32, value: impl Fn(&mut Sampler) -> f64) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..count {
        let value = value(&mut Sampler::new(6, [i, 0], 0));
        sum += value;
        squares += value * value;
    }
    let n = f64::from(count);
    (sum / n, ((squares / n - (sum / n) * (sum / n)) / n).sqrt())
}

/// Irradiance at a point by the lights' own sampling.
fn irradiance(set: &LightSet, from: DVec3, normal: DVec3, lit: impl Fn(&LightSample) -> bool) -> (f64, f64) {
    mean(100_000, |sampler| {
        let (choice, u) = (sampler.next_1d(), sampler.next_2d());
        let sample = set.sample(from, choice, u).filter(&lit);
        sample.map_or(0.0, |sample| sample.weight.x * sample.direction.dot(normal).max(0.0))
    })
}

fn assert_near((got, sigma): (f64, f64), want: f64, most: f64) {
    assert!((got - want).abs() < 4.0 * sigma + 1e-9 * want, "got {got}, want {want}, sigma {sigma}");
    assert!(sigma < most * want, "sigma {sigma} of {want}");
}

/// Fails unless what the lights' samples show has the density that rays are told, over boxes of the
/// sphere of directions, and that density integrates to `part`.
#[expect(clippy::cast_possible_truncation, reason = "numbers of boxes")]
fn assert_density(set: &LightSet, from: DVec3, part: f64, pdf: impl Fn(DVec3) -> f64) {
    const BOXES: [usize; 2] = [24, 12];
    const COUNT: u32 = 100_000;
    let count = f64::from(COUNT);
    let box_of = |direction: DVec3| {
        let turn = libm::atan2(direction.y, direction.x) / TAU;
        let along = ((turn - turn.floor()) * BOXES[0] as f64) as usize % BOXES[0];
        let up = ((0.5 - 0.5 * direction.z) * BOXES[1] as f64) as usize;
        up.min(BOXES[1] - 1) * BOXES[0] + along
    };
    let (mut got, mut want) = ([0.0; BOXES[0] * BOXES[1]], [0.0; BOXES[0] * BOXES[1]]);
    for i in 0..COUNT {
        let mut sampler = Sampler::new(7, [i, 0], 0);
        if let Some(sample) = set.sample(from, sampler.next_1d(), sampler.next_2d()) {
            got[box_of(sample.direction)] += 1.0;
        }
    }
    // midpoints of a fine grid of equal solid angles
    const FINE: u32 = 960;
    let mut integral = 0.0;
    for i in 0..FINE {
        for j in 0..FINE / 2 {
            let u = DVec2::new(f64::from(i) + 0.5, 2.0 * (f64::from(j) + 0.5)) / f64::from(FINE);
            let direction = warp::uniform_sphere(u);
            let share = pdf(direction) * 4.0 * PI / f64::from(FINE * FINE / 2);
            want[box_of(direction)] += share * count;
            integral += share;
        }
    }
    assert!((integral - part).abs() < 0.004, "the density integrates to {integral}, not {part}");
    // the rare boxes together; the borders of shapes are off by part of a fine cell
    let (mut chi, mut freedom, mut rest) = (0.0, -1.0_f64, [0.0; 2]);
    for (got, want) in got.into_iter().zip(want) {
        if want < 20.0 {
            rest = [rest[0] + got, rest[1] + want];
        } else {
            let tolerance: f64 = 0.01 * want;
            let off = ((got - want).abs() - tolerance).max(0.0);
            chi += off * off / want;
            freedom += 1.0;
        }
    }
    assert!((rest[0] - rest[1]).abs() < 0.2 * rest[1] + 20.0, "rare boxes: {rest:?}");
    assert!(chi < freedom + 4.0 * (2.0 * freedom).sqrt() + 4.0, "chi² {chi} of {freedom}");
}

/// The density that a ray to the lights' shapes is told.
fn shape_pdf(set: &LightSet, from: DVec3) -> impl Fn(DVec3) -> f64 {
    move |direction| {
        let ray = Ray::new(from, 3.0 * direction);
        set.closest_hit(&ray).map_or(0.0, |hit| set.hit_pdf(&ray, &hit))
    }
}

#[test]
fn densities_are_those_of_the_samples() {
    let from = DVec3::new(0.3, -0.2, 0.1);
    for light in [square(1.5), ball(DVec3::new(1.0, 2.0, 1.0), 1.0), ball(from + 0.6, 1.0)] {
        let set = set_of(&[light]);
        assert_density(&set, from, 1.0, shape_pdf(&set, from));
    }
    let from = DVec3::new(1.0, 2.5, 4.0);
    let set = set_of(&[disk()]);
    assert_density(&set, from, 1.0, shape_pdf(&set, from));
    // seen from inside: the density by area differs over the sphere
    let mirrored = DAffine3::from_scale(DVec3::new(2.0, 2.0, -2.0));
    let set = set_of(&[Light::Area(AreaLight {
        shape: AreaShape::Sphere,
        to_world: mirrored,
        radiance: DVec3::ONE,
    })]);
    assert_density(&set, DVec3::new(0.3, 1.1, 0.2), 1.0, shape_pdf(&set, DVec3::new(0.3, 1.1, 0.2)));
    let turn = DAffine3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 1.1, -0.7));
    let set = set_of(&[envmap(turn)]);
    assert_density(&set, from, 1.0, |direction| set.environment_pdf(2.0 * direction));
    let set = set_of(&[Light::Constant(ConstantLight { radiance: DVec3::ONE })]);
    assert_density(&set, from, 1.0, |direction| set.environment_pdf(direction));
}

#[test]
fn densities_of_samples_and_hits_agree() {
    let lights = [
        square(1.5),
        Light::Constant(ConstantLight { radiance: DVec3::ONE }),
        ball(DVec3::new(3.0, 0.0, 0.0), 1.0),
    ];
    let set = set_of(&lights);
    let from = DVec3::new(0.3, -0.2, 0.1);
    let mut seen = [0; 3];
    for i in 0..1500 {
        let mut sampler = Sampler::new(6, [i, 0], 0);
        let (choice, u) = (sampler.next_1d(), sampler.next_2d());
        let sample = set.sample(from, choice, u).unwrap();
        let ray = Ray::new(from, sample.direction);
        if let Some(light) = sample.end.and_then(|end| end.light) {
            let Some(hit) = set.closest_hit(&ray) else {
                assert!(light == 2 && u.x > 0.999, "samples lie on the shape, but for a sphere's limb");
                continue;
            };
            let pdf = set.hit_pdf(&ray, &hit);
            assert!((pdf / sample.pdf - 1.0).abs() < 1e-12, "{pdf} {}", sample.pdf);
            assert_eq!((hit.light, set.hit_radiance(&ray, &hit)), (light, DVec3::splat(2.0)));
            assert!(set.blocks(&ray, None) && !set.blocks(&ray, Some(light)));
            seen[light] += 1;
        } else {
            assert_eq!(sample.pdf, set.environment_pdf(sample.direction));
            seen[1] += 1;
        }
    }
    assert!(seen.iter().all(|n| (400..600).contains(n)), "chosen {seen:?}");
}

#[test]
fn shapes_shine_to_one_side() {
    let set = set_of(&[square(1.0)]);
    let u = DVec2::splat(0.25);
    assert_eq!(set.sample(DVec3::new(0.0, 0.0, 2.0), 0.5, u), None);
    assert_eq!(set.sample(DVec3::new(5.0, 0.0, 1.0), 0.5, u), None);
    let ray = Ray::new(DVec3::new(0.0, 0.0, 2.0), DVec3::NEG_Z);
    let back = set.closest_hit(&ray).unwrap();
    assert_eq!(set.hit_radiance(&ray, &back), DVec3::ZERO);
    assert_eq!(set.hit_pdf(&ray, &back), 0.0);
}

#[test]
fn solid_angle_of_a_square() {
    // a face of the cube [-1, 1]³ seen from its centre: 4π/6
    let set = set_of(&[square(1.0)]);
    let got = mean(100_000, |sampler| 1.0 / set.sample(DVec3::ZERO, 0.0, sampler.next_2d()).unwrap().pdf);
    assert_near(got, 4.0 * PI / 6.0, 0.01);
}

#[test]
fn closed_forms_of_irradiance() {
    // sphere, wholly above the horizon: π L (r/d)² cos; also from close by and from afar
    for (centre, radius) in [
        (DVec3::new(1.0, 0.0, 2.0), 0.7),
        (DVec3::new(0.0, 0.0, 1.001), 1.0),
        (DVec3::new(0.0, 3e4, 4e4), 1.0),
    ] {
        let want = PI * 2.0 * (radius / centre.length()).powi(2) * centre.z / centre.length();
        let got = irradiance(&set_of(&[ball(centre, radius)]), DVec3::ZERO, DVec3::Z, |_| true);
        assert_near(got, want, 0.01);
    }
    // disk on its axis: π L r² / (r² + d²)
    let to_world = DAffine3::from_translation(0.8 * DVec3::Z)
        * DAffine3::from_rotation_x(PI)
        * DAffine3::from_scale(DVec3::splat(1.5));
    let lamp = Light::Area(AreaLight { shape: AreaShape::Disk, to_world, radiance: DVec3::splat(2.0) });
    let want = PI * 2.0 * 1.5 * 1.5 / (1.5 * 1.5 + 0.8 * 0.8);
    assert_near(irradiance(&set_of(&[lamp]), DVec3::ZERO, DVec3::Z, |_| true), want, 0.01);
    // inside a shining sphere: π L everywhere
    let mirrored = DAffine3::from_scale(DVec3::new(2.0, 2.0, -2.0));
    let set = set_of(&[Light::Area(AreaLight {
        shape: AreaShape::Sphere,
        to_world: mirrored,
        radiance: DVec3::splat(2.0),
    })]);
    assert_near(irradiance(&set, DVec3::new(0.3, 1.1, 0.2), DVec3::Y, |_| true), 2.0 * PI, 0.01);
}

#[test]
fn spots_are_those_of_mitsuba() {
    // look_at from (1, 2, 3) to (1.5, 2, 1); printed by Mitsuba 3.9.1
    let z = DVec3::new(0.5, 0.0, -2.0).normalize();
    let x = DVec3::Y.cross(z).normalize();
    let place =
        DAffine3::from_mat3_translation(glam::DMat3::from_cols(x, z.cross(x), z), DVec3::new(1.0, 2.0, 3.0));
    let spot = |to_world, cutoff_angle, beam_width| {
        let intensity = DVec3::new(3.0, 2.0, 1.0);
        set_of(&[Light::Spot(SpotLight { to_world, intensity, cutoff_angle, beam_width })])
    };
    let set = spot(place, 30.0, 12.0);
    for (x, y, z, want) in [
        (2.0, 2.0, -1.0, 0.176_470_607_519),
        (1.5, 2.0, 1.0, 0.705_882_430_077),
        (1.9, 2.3, 0.5, 0.419_580_340_385),
        (1.0, 2.7, 0.6, 0.230_510_964_989),
    ] {
        let sample = set.sample(DVec3::new(x, y, z), 0.5, DVec2::ZERO).unwrap();
        assert!((sample.weight.x / want - 1.0).abs() < 2e-6, "{} instead of {want}", sample.weight.x);
        assert!((sample.weight - want * DVec3::new(1.0, 2.0 / 3.0, 1.0 / 3.0)).length() < 1e-6);
        assert!(sample.is_delta && sample.pdf == 1.0);
    }
    for (x, y, z) in [(0.4, 1.4, 0.5), (0.2, 2.0, 0.5), (1.0, 2.0, 5.0)] {
        assert_eq!(set.sample(DVec3::new(x, y, z), 0.5, DVec2::ZERO), None);
    }
    // a cone that is stretched: falloff by the angle in its own space
    let set = spot(DAffine3::from_scale(DVec3::new(1.0, 2.0, 0.5)), 20.0, 15.0);
    for (y, want) in [(0.5, 2.399_999_856_95), (0.6, 2.205_882_310_87)] {
        let sample = set.sample(DVec3::new(0.0, y, 1.0), 0.5, DVec2::ZERO).unwrap();
        assert!((sample.weight.x / want - 1.0).abs() < 2e-6, "{} instead of {want}", sample.weight.x);
    }
    // without a dimmed rim
    let sharp = spot(DAffine3::IDENTITY, 20.0, 20.0);
    assert!(sharp.sample(DVec3::new(0.36, 0.0, 1.0), 0.5, DVec2::ZERO).is_some());
    assert!(sharp.sample(DVec3::new(0.37, 0.0, 1.0), 0.5, DVec2::ZERO).is_none());
}

#[test]
fn directional_light_comes_against_its_direction() {
    let irradiance = DVec3::new(3.0, 2.0, 1.0);
    let set =
        set_of(&[Light::Directional(DirectionalLight { direction: DVec3::new(1.0, 2.0, -2.0), irradiance })]);
    let sample = set.sample(DVec3::ZERO, 0.3, DVec2::ZERO).unwrap();
    assert!((sample.direction - DVec3::new(-1.0, -2.0, 2.0) / 3.0).length() < 1e-15);
    assert_eq!((sample.weight, sample.pdf, sample.is_delta, sample.end), (irradiance, 1.0, true, None));
    assert!(!set.has_environment());
    assert_eq!(set.environment_radiance(DVec3::Z), DVec3::ZERO);
    assert_eq!(set.environment_pdf(sample.direction), 0.0);
}

#[test]
fn environment_maps_are_those_of_mitsuba() {
    // direction, radiance, density; printed by Mitsuba 3.9.1
    let set = set_of(&[envmap(DAffine3::IDENTITY)]);
    #[rustfmt::skip]
    let table = [
        ([1.0, 0.0, 0.0], [3.0, 6.0, 1.5], 0.092_515_125_9),
        ([-1.0, 0.0, 0.0], [7.0, 6.0, 3.0], 0.110_127_240_4),
        ([0.0, 0.0, 1.0], [5.0, 6.0, 2.25], 0.101_321_175_7),
        ([0.0, 0.0, -1.0], [5.0, 6.0, 2.25], 0.101_321_175_7),
        ([0.3, 0.4, 0.5], [4.311_916_351, 4.468_893_051, 1.865_849_495], 0.072_631_888_1),
        ([-0.7, 0.2, 0.1], [6.819_331_169, 5.298_081_398, 3.137_353_420], 0.093_964_874_7),
        ([0.01, -0.5, -0.9], [4.957_560_539, 7.291_249_275, 3.060_567_379], 0.078_365_050_3),
        ([-0.2, -0.9, 0.3], [5.748_668_671, 9.029_694_557, 1.811_401_129], 0.069_131_009_3),
        ([-0.01, 0.3, -0.8], [5.047_744_751, 5.086_463_451, 2.313_112_736], 0.083_645_917_5),
    ];
    for (direction, radiance, pdf) in table {
        let direction = DVec3::from_array(direction);
        let got = set.environment_radiance(direction);
        assert!((got - DVec3::from_array(radiance)).length() < 2e-5, "{direction}: {got}");
        let got = set.environment_pdf(direction);
        assert!((got / pdf - 1.0).abs() < 2e-5, "{direction}: {got}, want {pdf}");
    }
    // a pole is its whole row, here by the middle between last and first column
    let south = set.environment_radiance(DVec3::new(0.0, -1.0, -1e-12));
    assert!((south - DVec3::new(5.0, 10.0, 4.75)).length() < 1e-9, "{south}");
}

#[test]
fn environment_maps_turn() {
    let turn = DAffine3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 1.1, -0.7));
    let (plain, turned) = (set_of(&[envmap(DAffine3::IDENTITY)]), set_of(&[envmap(turn)]));
    for i in 0..1000 {
        let direction = warp::uniform_sphere(Sampler::new(1, [i, 0], 0).next_2d());
        let there = turn.transform_vector3(direction);
        let off = plain.environment_radiance(direction) - turned.environment_radiance(there);
        assert!(off.length() < 1e-12);
        // the sample's radiance is that of its direction
        let sample = turned.sample(DVec3::ZERO, 0.2, Sampler::new(2, [i, 0], 0).next_2d()).unwrap();
        let radiance = turned.environment_radiance(sample.direction);
        assert!((sample.weight * sample.pdf - radiance).length() < 1e-9 * radiance.length());
        assert!((turned.environment_pdf(sample.direction) / sample.pdf - 1.0).abs() < 1e-9);
    }
    assert!(plain.has_environment());
}

#[test]
fn small_and_black_environment_maps() {
    // one pixel is everywhere
    let one = Arc::new(Picture { size: [1, 1], pixels: vec![[1.0, 2.0, 3.0]] });
    let map = |picture: &Arc<Picture>| {
        Light::Envmap(EnvironmentLight {
            picture: PictureSource::Read(Arc::clone(picture)),
            scale: 0.5,
            to_world: DAffine3::IDENTITY,
        })
    };
    let set = set_of(&[map(&one)]);
    for i in 0..100 {
        let direction = warp::uniform_sphere(Sampler::new(1, [i, 0], 0).next_2d());
        assert!((set.environment_radiance(direction) - DVec3::new(0.5, 1.0, 1.5)).length() < 1e-15);
    }
    let black = Arc::new(Picture { size: [3, 4], pixels: vec![[0.0; 3]; 12] });
    let set = set_of(&[map(&black)]);
    assert_eq!(set.sample(DVec3::ZERO, 0.0, DVec2::splat(0.5)), None);
    assert_eq!(set.environment_pdf(DVec3::X), 0.0);
    let broken = Arc::new(Picture { size: [1, 1], pixels: vec![[f32::NAN, 0.0, 0.0]] });
    assert_eq!(LightSet::try_new(&[map(&broken)], &[]), Err(LightError::Envmap { light: 0 }));
    let mut scaled = map(&one);
    if let Light::Envmap(EnvironmentLight { to_world, .. }) = &mut scaled {
        *to_world = DAffine3::from_scale(DVec3::splat(2.0));
    }
    assert_eq!(LightSet::try_new(&[scaled], &[]), Err(LightError::Envmap { light: 0 }));
}

#[test]
fn shapes_are_those_of_mitsuba() {
    // ray, place on the shape, texture coordinates; printed by Mitsuba 3.9.1
    let turn = DAffine3::from_axis_angle(DVec3::new(0.0, 0.6, 0.8), 30.0_f64.to_radians());
    let Light::Area(AreaLight { shape: AreaShape::Sphere, to_world, radiance }) =
        ball(DVec3::new(1.0, 2.0, 3.0), 0.5)
    else {
        panic!("a sphere")
    };
    let sphere = Light::Area(AreaLight { shape: AreaShape::Sphere, to_world: turn * to_world, radiance });
    let cases = [
        (
            sphere,
            DVec3::new(0.0, 0.0, 9.0),
            DVec3::new(1.066_025_412_1, 2.271_436_071_4, 2.733_923_244_5),
            0.942_276_597,
            DVec3::new(0.076_930_373_9, -0.562_228_143_2, 0.823_396_205_9),
            DVec2::new(0.640_307_903_3, 0.219_953_224_1),
        ),
        (
            disk(),
            DVec3::new(0.0, 0.0, 9.0),
            DVec3::new(1.3, 2.2, 3.3),
            1.119_702_696_8,
            DVec3::new(0.642_787_575_7, 0.0, 0.766_044_497_5),
            DVec2::new(0.973_238_170_1, 0.200_578_555_5),
        ),
        (
            disk(),
            DVec3::new(3.0, 4.0, 9.0),
            DVec3::new(1.1, 1.9, 2.9),
            0.997_908_890_2,
            DVec3::new(0.642_787_575_7, 0.0, 0.766_044_497_5),
            DVec2::new(0.202_902_406_5, 0.804_277_718_1),
        ),
    ];
    for (light, from, to, t, normal, uv) in cases {
        let hit = set_of(&[light]).closest_hit(&Ray::new(from, to - from)).unwrap().hit;
        assert!((hit.t - t).abs() < 3e-6, "{} instead of {t}", hit.t);
        assert!((hit.normal - normal).length() < 1e-5, "{} instead of {normal}", hit.normal);
        assert!(hit.uv.distance(uv) < 2e-5, "{} instead of {uv}", hit.uv);
    }
    // densities: the sphere of centre (2, 4, 6), radius 1, and the disk
    let sphere = set_of(&[ball(DVec3::new(2.0, 4.0, 6.0), 1.0)]);
    let flat = set_of(&[disk()]);
    #[rustfmt::skip]
    let table = [
        (&sphere, DVec3::ZERO, DVec2::new(0.5, 0.25), 17.745_457),
        (&sphere, DVec3::new(2.0, 4.0, 4.5), DVec2::new(0.5, 0.25), 0.625_009_48),
        (&sphere, DVec3::new(2.0, 5.01, 6.0), DVec2::new(0.3, 0.6), 0.185_144_05),
        (&flat, DVec3::new(0.0, 0.0, 9.0), DVec2::new(0.5, 0.25), 20.416_334),
    ];
    for (set, from, u, want) in table {
        let got = set.sample(from, 0.0, u).unwrap().pdf;
        assert!((got / want - 1.0).abs() < 2e-5, "{got}, want {want}");
    }
}

#[test]
fn objects_have_the_density_of_their_samples() {
    for (degree, rational) in [([1, 2, 1], false), ([2, 3, 2], true)] {
        let (set, scene) = deformed_ball(degree, rational);
        let from = DVec3::new(0.4, -0.6, 0.3);
        let mut visible = 0;
        for i in 0..3000 {
            let u = Sampler::new(6, [i, 0], 0).next_2d();
            let Some(sample) = set.sample(from, 0.7, u) else { continue };
            let end = sample.end.unwrap();
            assert!(end.cos_light > 0.0 && sample.weight.x > 0.0);
            let ray = Ray::new(from, 2.0 * sample.direction);
            let hit = scene.closest_hit(&ray).expect("samples lie on the object");
            if hit.position.distance(end.position) > 1e-9 {
                continue;
            }
            visible += 1;
            let distance = hit.t * ray.direction.length();
            let pdf = set.object_pdf(&hit, ray.direction, distance);
            assert!((pdf / sample.pdf - 1.0).abs() < 1e-6, "{u}: {pdf}, sampled with {}", sample.pdf);
            assert_eq!(set.object_radiance(&hit, ray.direction), DVec3::splat(3.0));
            // its own surface does not hide it
            let short = Ray { t_max: 1.0 - 1e-12, ..Ray::new(from, end.position - from) };
            assert!(!scene.any_hit(&short), "{u}");
        }
        assert!(visible > 800, "{visible} of 3000 are seen");
        // the other object, and the back of this one, are black
        let other = scene.closest_hit(&Ray::new(DVec3::new(50.5, 0.5, 5.0), DVec3::NEG_Z)).unwrap();
        assert_eq!(set.object_radiance(&other, DVec3::NEG_Z), DVec3::ZERO);
        assert_eq!(set.object_pdf(&other, DVec3::NEG_Z, 4.0), 0.0);
        let inside = Ray::new(DVec3::splat(0.5), DVec3::new(0.2, 0.3, 0.9));
        let back = scene.closest_hit(&inside).unwrap();
        assert_eq!(set.object_radiance(&back, inside.direction), DVec3::ZERO);
        assert_eq!(set.object_pdf(&back, inside.direction, back.t * inside.direction.length()), 0.0);
        assert!(set.is_object_light(&back) && !set.is_object_light(&other));
    }
}

#[test]
fn irradiance_of_an_object_by_three_ways() {
    for (degree, rational) in [([1, 1, 1], false), ([2, 3, 2], true)] {
        let (set, scene) = deformed_ball(degree, rational);
        let (from, normal) = (DVec3::new(0.4, -0.3, 0.3), DVec3::Y);
        let radiance = |direction: DVec3| {
            let hit = scene.closest_hit(&Ray::new(from, direction));
            hit.map_or(0.0, |hit| set.object_radiance(&hit, direction).x)
        };
        let by_directions = mean(200_000, |sampler| {
            let direction = warp::uniform_sphere(sampler.next_2d());
            4.0 * PI * radiance(direction) * direction.dot(normal).max(0.0)
        });
        let by_area = irradiance(&set, from, normal, |sample| {
            let way = sample.end.unwrap().position - from;
            !scene.any_hit(&Ray { t_max: 1.0 - 1e-12, ..Ray::new(from, way) })
        });
        let sigma = by_directions.1.hypot(by_area.1);
        assert!(sigma < 0.02 * by_area.0, "{by_directions:?} {by_area:?}");
        assert!((by_directions.0 - by_area.0).abs() < 4.0 * sigma, "{by_directions:?} {by_area:?}");
        // the density that rays are told, over all that is seen, is the share of samples that are seen
        let share = mean(200_000, |sampler| {
            let direction = warp::uniform_sphere(sampler.next_2d());
            let hit = scene.closest_hit(&Ray::new(from, direction));
            4.0 * PI * hit.map_or(0.0, |hit| set.object_pdf(&hit, direction, hit.t))
        });
        let seen = mean(50_000, |sampler| {
            let sample = set.sample(from, 0.0, sampler.next_2d());
            let seen = sample.is_some_and(|sample| {
                let way = sample.end.unwrap().position - from;
                !scene.any_hit(&Ray { t_max: 1.0 - 1e-12, ..Ray::new(from, way) })
            });
            f64::from(u8::from(seen))
        });
        let sigma = share.1.hypot(seen.1);
        assert!(sigma < 0.02 && (share.0 - seen.0).abs() < 4.0 * sigma, "{share:?} {seen:?}");
    }
}

#[test]
fn unusable_lights_are_refused() {
    let sky = Light::Constant(ConstantLight { radiance: DVec3::ONE });
    let refused = |lights: &[Light]| LightSet::try_new(lights, &[]).unwrap_err();
    let want = LightError::TwoEnvironments { first: 0, second: 2 };
    assert_eq!(refused(&[sky.clone(), square(1.0), envmap(DAffine3::IDENTITY)]), want);
    let to_world = DAffine3::from_scale(DVec3::new(0.0, 1.0, 1.0));
    let radiance = DVec3::ONE;
    assert_eq!(
        refused(&[Light::Area(AreaLight { shape: AreaShape::Rectangle, to_world, radiance })]),
        LightError::FlatShape { light: 0 }
    );
    assert_eq!(
        refused(&[sky, Light::Area(AreaLight { shape: AreaShape::Disk, to_world, radiance })]),
        LightError::FlatShape { light: 1 }
    );
    assert_eq!(
        refused(&[Light::Area(AreaLight { shape: AreaShape::Sphere, to_world, radiance })]),
        LightError::NotRound { light: 0 }
    );
    let still = Light::Directional(DirectionalLight { direction: DVec3::ZERO, irradiance: DVec3::ONE });
    assert_eq!(refused(&[still]), LightError::NoDirection { light: 0 });
    let missing = Light::Object(ObjectLight { object: 0, radiance });
    assert_eq!(refused(std::slice::from_ref(&missing)), LightError::Object { light: 0, object: 0 });
    let shell = deform(&ball_triangles(), None, FrameChoice::Parallelogram);
    let objects = [TracedObject { name: "a".into(), shell, attributes: Box::new(NoAttributes) }];
    let twice = LightSet::try_new(&[missing.clone(), missing], &objects);
    assert_eq!(twice, Err(LightError::Object { light: 1, object: 0 }));
    assert_eq!(LightSet::default().sample(DVec3::ZERO, 0.0, DVec2::ZERO), None);
}
