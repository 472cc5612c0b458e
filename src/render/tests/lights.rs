//! Pictures by each kind of light.

use std::sync::Arc;

use glam::DMat3;

use super::*;
use crate::film::Picture;
use crate::shade::light::{AreaLight, AreaShape, DirectionalLight, EnvironmentLight, ObjectLight, SpotLight};
use crate::shade::material::DiffuseSource;
use crate::shade::{PictureSource, TextureSource};
use crate::subdivide::FrameChoice;
use crate::test_support::{cube_triangles, deform};
use crate::trace::{NoAttributes, TracedObject, TracedScene};

/// Mitsuba's `look_at`, +z towards the target.
fn look_at(origin: DVec3, target: DVec3) -> DAffine3 {
    let z = (target - origin).normalize();
    let x = DVec3::Z.cross(z).normalize();
    DAffine3::from_mat3_translation(DMat3::from_cols(x, z.cross(x), z), origin)
}

fn envmap(scale: f64, to_world: DAffine3) -> Light {
    let pixel =
        |x: u8, y: u8| [f32::from(1 + x), f32::from(1 + 2 * y), 0.25 * f32::from((7 * x + 5 * y) % 11)];
    let places = (0..3).flat_map(|y| (0..4).map(move |x| (x, y)));
    let pixels = places.map(|(x, y)| pixel(x, y)).collect();
    Light::Envmap(EnvironmentLight {
        picture: PictureSource::Read(Arc::new(Picture { size: [4, 3], pixels })),
        scale,
        to_world,
    })
}

fn ball(centre: DVec3) -> Light {
    let to_world = DAffine3::from_translation(centre) * DAffine3::from_scale(DVec3::splat(0.7));
    Light::Area(AreaLight { shape: AreaShape::Sphere, to_world, radiance: DVec3::new(3.0, 2.0, 1.0) })
}

/// The lights that the table of [`a_floor_is_lit_as_in_mitsuba`] is of.
fn each_light() -> [Light; 8] {
    let colour = DVec3::new(3.0, 2.0, 1.0);
    let (quarter, sixth) = (0.5 * PI, PI / 6.0);
    let disk = DAffine3::from_translation(DVec3::new(1.0, 0.0, 2.0))
        * DAffine3::from_rotation_y(7.0 * sixth)
        * DAffine3::from_scale(DVec3::new(1.0, 0.5, 1.0));
    [
        envmap(2.0, DAffine3::IDENTITY),
        envmap(1.0, DAffine3::from_rotation_z(sixth) * DAffine3::from_rotation_x(quarter)),
        Light::Directional(DirectionalLight { direction: DVec3::new(1.0, 2.0, -2.0), irradiance: colour }),
        Light::Spot(SpotLight {
            to_world: look_at(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 0.5, 0.0)),
            intensity: colour,
            cutoff_angle: 30.0,
            beam_width: 22.5,
        }),
        Light::Area(AreaLight { shape: AreaShape::Disk, to_world: disk, radiance: colour }),
        ball(DVec3::new(1.0, 0.0, 2.0)),
        ball(DVec3::new(1.0, 0.0, 0.2)),
        Light::Area(AreaLight {
            shape: AreaShape::Sphere,
            to_world: DAffine3::from_scale(DVec3::new(2.0, 2.0, -2.0)),
            radiance: colour,
        }),
    ]
}

#[test]
fn a_floor_is_lit_as_in_mitsuba() {
    // a floor (0.6) seen at (-0.25, 0.75, 0): radiance and its standard error, printed by Mitsuba 3.9.1
    // (path of depth 2, 524288 samples, single precision)
    #[rustfmt::skip]
    let table = [
        ([3.000_28, 3.601_28, 1.362_48], 1.7e-3),
        ([1.501_18, 1.200_06, 0.713_01], 1.0e-3),
        ([0.381_956_3, 0.254_643_9, 0.127_321_9], 6e-6),
        ([0.040_710_53, 0.027_137_26, 0.013_568_63], 1e-6),
        ([0.104_200, 0.069_466, 0.034_733], 3e-5),
        ([0.116_361, 0.077_574, 0.038_787], 2e-5),
        ([0.076_383, 0.050_922, 0.025_461], 1.3e-4),
        ([1.799_85, 1.199_90, 0.599_95], 6e-4),
    ];
    for (light, (want, error)) in each_light().into_iter().zip(table) {
        let mut setup = Setup::new(vec![Shape::floor(0.0)], 0.6, vec![light.clone()]);
        setup.settings.max_depth = 2;
        setup.settings.spp = 40_000;
        setup.look_down(DVec3::new(-0.25, 0.75, 0.0), 0.5);
        let image = setup.render();
        for (name, want) in ["R", "G", "B"].into_iter().zip(want) {
            let got = value(&image, name, 0);
            let sigma = value(&image, &format!("variance.{name}"), 0).sqrt();
            assert!(sigma < 0.01 * want, "{light:?} {name}: sigma {sigma} of {want}");
            let bound = 3.5 * sigma.hypot(error) + 2e-6;
            assert!((got - want).abs() < bound, "{light:?} {name}: got {got}, want {want}, sigma {sigma}");
        }
    }
}

#[test]
fn environment_maps_are_seen_and_cover() {
    let mut setup = Setup::new(vec![SPHERE], 0.5, vec![envmap(2.0, DAffine3::IDENTITY)]);
    // the camera looks down at an empty place, along -z: the middle between last and first column
    setup.look_down(DVec3::new(5.0, 5.0, 0.0), 4.0);
    let pixel = |setup: &Setup| {
        let image = setup.render();
        ["R", "G", "B", "A"].map(|name| value(&image, name, 0))
    };
    let got = pixel(&setup);
    for (got, want) in got.into_iter().zip([5.0, 6.0, 2.25, 1.0]) {
        assert!((got - want).abs() < 1e-5, "{got} instead of {want}");
    }
    setup.settings.hide_emitters = true;
    assert_eq!(pixel(&setup), [0.0; 4]);
    setup.settings.hide_emitters = false;
    setup.settings.integrator = IntegratorKind::Direct;
    assert_eq!(pixel(&setup)[3], 0.0, "as in Mitsuba");
    // directional light is not seen
    let light = Light::Directional(DirectionalLight { direction: DVec3::Z, irradiance: DVec3::ONE });
    setup.lights = vec![light];
    setup.settings.integrator = IntegratorKind::Path;
    assert_eq!(pixel(&setup), [0.0; 4]);
}

/// A shining cube (0.5) on a floor (0.8, 0.6, 0.4) under a sky of 0.3, as patches.
fn shining_cube(setup: &Setup) -> Image {
    let corner = |x: f64, y: f64| DVec3::new(x, y, -0.5);
    let floor = [
        [corner(-4.0, -4.0), corner(4.0, -4.0), corner(4.0, 4.0)],
        [corner(-4.0, -4.0), corner(4.0, 4.0), corner(-4.0, 4.0)],
    ];
    let object = |name: &str, triangles: &[[DVec3; 3]]| {
        let shell = deform(triangles, None, FrameChoice::Parallelogram);
        TracedObject { name: name.into(), shell, attributes: Box::new(NoAttributes) }
    };
    let objects = vec![object("floor", &floor), object("cube", &cube_triangles())];
    let lights = LightSet::try_new(&setup.lights, &objects).unwrap();
    let geometry = TracedScene::new(objects);
    let scene =
        ShadingScene { geometry: &geometry, object_materials: &prepared(&setup.materials), lights: &lights };
    let camera = Camera::try_new(&setup.camera, setup.film.size).unwrap();
    let cancel = AtomicBool::new(false);
    let control = RenderControl { threads: 1, ..RenderControl::new(&cancel) };
    render(&scene, &camera, &setup.film, &setup.settings, &control).unwrap().image
}

fn cube_setup() -> Setup {
    let lights =
        vec![Light::Object(ObjectLight { object: 1, radiance: DVec3::new(3.0, 2.0, 1.0) }), sky(0.3)];
    let mut setup = Setup::new(vec![Shape::floor(-0.5), SPHERE], 0.5, lights);
    setup.materials[0] = Material::Diffuse(DiffuseSource {
        reflectance: TextureSource::Uniform(DVec3::new(0.8, 0.6, 0.4)),
        two_sided: true,
    });
    setup
}

#[test]
fn an_object_that_shines_agrees_with_mitsuba() {
    // Mitsuba 3.9.1, 1.2 million samples a pixel (hidden: 0.4 million): colour, and its standard error
    #[rustfmt::skip]
    let seen = [
        ([0.300_001, 0.300_001, 0.300_001], 1e-6), ([0.554_839, 0.465_301, 0.375_785], 7.5e-4),
        ([0.323_562, 0.315_276, 0.306_993], 2.3e-4), ([0.291_466, 0.208_801, 0.135_001], 1.6e-4),
        ([1.258_391, 0.807_023, 0.411_866], 1.1e-3), ([0.463_639, 0.306_832, 0.175_520], 5.6e-4),
        ([0.274_059, 0.196_366, 0.124_840], 9e-5), ([0.303_995, 0.210_692, 0.129_040], 1.8e-4),
        ([0.294_236, 0.206_043, 0.127_698], 1.4e-4),
    ];
    #[rustfmt::skip]
    let hidden = [
        ([0.0, 0.0, 0.0], 0.0), ([0.0, 0.0, 0.0], 0.0), ([0.0, 0.0, 0.0], 0.0),
        ([0.278_056, 0.195_328, 0.121_494], 3.1e-4), ([0.563_809, 0.329_718, 0.159_832], 1.1e-3),
        ([0.368_995, 0.238_352, 0.133_825], 6.1e-4), ([0.274_115, 0.196_380, 0.124_834], 1.4e-4),
        ([0.303_922, 0.210_654, 0.129_027], 3.6e-4), ([0.294_074, 0.205_976, 0.127_691], 2.7e-4),
    ];
    for (hide, table) in [(false, seen), (true, hidden)] {
        let mut setup = cube_setup();
        setup.settings.max_depth = 4;
        setup.settings.spp = 5000;
        setup.settings.hide_emitters = hide;
        let image = shining_cube(&setup);
        for (pixel, (want, error)) in table.into_iter().enumerate() {
            for (name, want) in ["R", "G", "B"].into_iter().zip(want) {
                let got = value(&image, name, pixel);
                let sigma = value(&image, &format!("variance.{name}"), pixel).sqrt();
                assert!(sigma < 0.03 * want + 1e-9, "hide {hide}, {pixel} {name}: sigma {sigma} of {want}");
                let bound = 3.5 * sigma.hypot(error) + 2e-6;
                assert!(
                    (got - want).abs() < bound,
                    "hide {hide}, {pixel} {name}: got {got}, want {want}, sigma {sigma}"
                );
            }
        }
        let alpha = value(&image, "A", 4);
        assert!(if hide { (alpha - 0.963).abs() < 0.01 } else { alpha == 1.0 }, "{alpha}");
    }
}

#[test]
fn an_object_that_shines_covers_at_depth_one() {
    let mut setup = cube_setup();
    setup.lights.truncate(1);
    setup.look_down(DVec3::new(0.4, 0.6, 1.0), 3.0);
    setup.settings.spp = 4;
    for (max_depth, hide, want) in [(0, false, [0.0, 0.0]), (1, false, [3.0, 1.0]), (1, true, [0.0, 0.0])] {
        setup.settings.max_depth = max_depth;
        setup.settings.hide_emitters = hide;
        let image = shining_cube(&setup);
        assert_eq!([value(&image, "R", 0), value(&image, "A", 0)], want, "depth {max_depth}, hide {hide}");
    }
    // through the cube, the floor below it: lit by the cube's underside
    setup.settings.max_depth = 2;
    let image = shining_cube(&setup);
    assert!(value(&image, "R", 0) > 0.1 && value(&image, "A", 0) == 1.0);
}
