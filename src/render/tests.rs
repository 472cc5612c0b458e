//! Pictures whose radiance is known.

use std::f64::consts::{FRAC_1_PI, PI};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use glam::{DAffine3, DVec3};

use super::*;
use crate::film::{Aov, Filter};
use crate::identity::PictureIdentity;
use crate::shade::ObjectMaterials;
use crate::shade::light::{AreaLight, AreaShape, ConstantLight, PointLight};
use crate::shade::material::DiffuseSource;
use crate::shade::testing::{Shape, Shapes};
use crate::shade::{
    CameraSettings, FovAxis, IntegratorKind, Light, LightSet, Material, PreparedMaterial, Projection,
    SamplerKind,
};
use crate::trace::{Geometry, Ray, RayTracer, SurfaceInteraction};

/// A pinhole camera's view along x, in degrees.
fn pinhole(fov: f64) -> Projection {
    Projection::Perspective { fov, fov_axis: FovAxis::X, lens: None }
}

const SPHERE: Shape = Shape::Sphere { centre: DVec3::ZERO, radius: 1.0 };

/// A test scene; the camera sees 45 degrees from (0, -6, 3) towards the origin.
struct Setup {
    shapes: Vec<Shape>,
    materials: Vec<Material>,
    lights: Vec<Light>,
    camera: CameraSettings,
    film: FilmSettings,
    settings: RenderSettings,
}

impl Setup {
    fn new(shapes: Vec<Shape>, reflectance: f64, lights: Vec<Light>) -> Self {
        let material = grey(reflectance);
        Self {
            materials: vec![material; shapes.len()],
            shapes,
            lights,
            camera: CameraSettings {
                origin: DVec3::new(0.0, -6.0, 3.0),
                target: DVec3::ZERO,
                up: DVec3::Z,
                projection: pinhole(45.0),
            },
            film: FilmSettings { size: [3, 3], filter: Filter::Box, crop: None },
            settings: RenderSettings { aovs: vec![Aov::Variance], ..RenderSettings::default() },
        }
    }

    fn render(&self) -> Image {
        self.render_with(1).0
    }

    fn render_with(&self, threads: usize) -> (Image, RenderStatistics) {
        let geometry = Shapes(self.shapes.clone());
        self.render_geometry(&geometry, threads)
    }

    fn render_geometry<G: Geometry>(&self, geometry: &G, threads: usize) -> (Image, RenderStatistics) {
        let lights = LightSet::try_new(&self.lights, &[]).unwrap();
        let materials = prepared(&self.materials);
        let scene = ShadingScene { geometry, object_materials: &materials, lights: &lights };
        let camera = Camera::try_new(&self.camera, self.film.size).unwrap();
        let cancel = AtomicBool::new(false);
        let control = RenderControl { threads, ..RenderControl::new(&cancel) };
        let rendered = render(&scene, &camera, &self.film, &self.settings, &control).unwrap();
        assert_eq!(rendered.samples, [self.settings.spp; 2]);
        (rendered.image, rendered.statistics)
    }

    /// Looks straight down at a point from a height, through a film of one pixel so narrow that
    /// it shows that point alone.
    fn look_down(&mut self, at: DVec3, height: f64) {
        self.camera = CameraSettings {
            origin: at + height * DVec3::Z,
            target: at,
            up: DVec3::Y,
            projection: pinhole(1e-4),
        };
        self.film.size = [1, 1];
    }
}

fn prepared(materials: &[Material]) -> Vec<ObjectMaterials> {
    let prepare = |material: &Material| PreparedMaterial::try_new(material).unwrap();
    materials.iter().map(|material| ObjectMaterials::uniform(material.clone(), prepare(material))).collect()
}

fn grey(reflectance: f64) -> Material {
    Material::Diffuse(DiffuseSource { reflectance: reflectance.into(), two_sided: true })
}

fn sky(radiance: f64) -> Light {
    Light::Constant(ConstantLight { radiance: DVec3::splat(radiance) })
}

/// The square `[-1, 1]²` at height z that shines downwards.
fn ceiling(z: f64, radiance: f64) -> Light {
    let turn = DAffine3::from_rotation_x(PI);
    Light::Area(AreaLight {
        shape: AreaShape::Rectangle,
        to_world: DAffine3::from_translation(z * DVec3::Z) * turn,
        radiance: DVec3::splat(radiance),
    })
}

fn value(image: &Image, channel: &str, pixel: usize) -> f64 {
    image.channel(channel).expect("channel")[pixel].into()
}

/// Asserts that a pixel is `want` within `sigmas` of its own variance.
fn assert_pixel(image: &Image, pixel: usize, want: f64, sigmas: f64) {
    let got = value(image, "R", pixel);
    let sigma = value(image, "variance.R", pixel).sqrt();
    let bound = sigmas * sigma + 1e-6 * want;
    assert!((got - want).abs() <= bound, "pixel {pixel}: got {got}, want {want}, sigma {sigma}");
}

#[test]
fn white_furnace() {
    // a white body in white light cannot be told from its surroundings
    let corner = vec![
        Shape::floor(0.0),
        Shape::Quad { corner: DVec3::new(-4.0, 4.0, 0.0), u: 8.0 * DVec3::X, v: 8.0 * DVec3::Z },
    ];
    for shapes in [vec![SPHERE], corner] {
        let mut setup = Setup::new(shapes, 1.0, vec![sky(1.0)]);
        setup.settings.max_depth = -1;
        setup.settings.spp = 512;
        setup.film.size = [8, 8];
        let (image, statistics) = setup.render_with(1);
        let mut worst: f64 = 0.0;
        for pixel in 0..64 {
            let sigma = value(&image, "variance.R", pixel).sqrt();
            let off = (value(&image, "R", pixel) - 1.0).abs();
            worst = worst.max(if off < 1e-6 { 0.0 } else { off / sigma });
            assert_eq!(value(&image, "A", pixel), 1.0);
        }
        assert!(worst < 4.0, "worst pixel off by {worst} sigma");
        let means = image.channel("R").unwrap();
        let mean = means.iter().map(|&v| f64::from(v)).sum::<f64>() / 64.0;
        assert!((mean - 1.0).abs() < 5e-3, "mean {mean}");
        assert_eq!(statistics.samples, 64 * 512);
        assert_eq!(statistics.non_finite_samples, 0);
    }
}

#[test]
fn point_light_on_a_floor() {
    // I · cos(θ) / r² · ρ / π, without any noise
    let light = DVec3::new(1.0, 0.5, 2.0);
    let point = Light::Point(PointLight { position: light, intensity: DVec3::splat(10.0) });
    let mut setup = Setup::new(vec![Shape::floor(0.0)], 0.6, vec![point]);
    setup.settings.spp = 4;
    let at = DVec3::new(-0.25, 0.75, 0.0);
    setup.look_down(at, 5.0);
    let way = light - at;
    let cos = way.z / way.length();
    let want = 10.0 * cos / way.length_squared() * 0.6 * FRAC_1_PI;
    let got = value(&setup.render(), "R", 0);
    assert!((got / want - 1.0).abs() < 1e-5, "got {got}, want {want}");
    // behind an object it is dark
    setup.shapes.push(Shape::Sphere { centre: at + 0.5 * way, radius: 0.1 });
    setup.materials.push(grey(0.0));
    assert_eq!(value(&setup.render(), "R", 0), 0.0);
}

#[test]
fn rectangle_light_on_a_floor() {
    // form factor of a parallel rectangle of sides a, b at distance c above a corner (Howell,
    // C-12): (A/√(1+A²) atan(B/√(1+A²)) + B/√(1+B²) atan(A/√(1+B²))) / 2π, A = a/c, B = b/c;
    // four such corners under the centre
    let c: f64 = 1.25;
    let (a, b) = (1.0 / c, 1.0 / c);
    let (ra, rb) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    let corner = (a / ra * (b / ra).atan() + b / rb * (a / rb).atan()) / (2.0 * PI);
    let want = 0.7 * 3.0 * 4.0 * corner;
    for integrator in [IntegratorKind::Path, IntegratorKind::Direct] {
        let mut setup = Setup::new(vec![Shape::floor(0.0)], 0.7, vec![ceiling(c, 3.0)]);
        setup.settings.integrator = integrator;
        setup.settings.spp = 20_000;
        setup.look_down(DVec3::ZERO, 1.0);
        let image = setup.render();
        assert_pixel(&image, 0, want, 3.0);
        assert!(value(&image, "variance.R", 0).sqrt() < 0.01 * want);
    }
}

#[test]
fn light_in_a_surfaces_plane_is_not_hidden() {
    // the ceiling's own surface lies where the light is: the margin of shadow rays lets it shine
    let ceiling_shape =
        Shape::Quad { corner: DVec3::new(-4.0, 4.0, 1.25), u: 8.0 * DVec3::X, v: -8.0 * DVec3::Y };
    let setup = |shapes| {
        let mut setup = Setup::new(shapes, 0.7, vec![ceiling(1.25, 3.0)]);
        setup.settings.max_depth = 2;
        setup.settings.spp = 2000;
        setup.look_down(DVec3::ZERO, 1.0);
        value(&setup.render(), "R", 0)
    };
    let free = setup(vec![Shape::floor(0.0)]);
    let mounted = setup(vec![Shape::floor(0.0), ceiling_shape]);
    assert!((mounted / free - 1.0).abs() < 1e-6, "{mounted} instead of {free}");
}

/// A sphere (0.5) above a floor (0.8, 0.6, 0.4) under a rectangle, a point and a constant light.
fn all_lights() -> Setup {
    let lights = vec![
        ceiling(3.0, 10.0),
        Light::Point(PointLight {
            position: DVec3::new(2.0, -3.0, 2.0),
            intensity: DVec3::new(10.0, 5.0, 2.0),
        }),
        sky(0.3),
    ];
    let mut setup = Setup::new(vec![Shape::floor(-1.0), SPHERE], 0.5, lights);
    setup.materials[0] =
        Material::Diffuse(DiffuseSource { reflectance: DVec3::new(0.8, 0.6, 0.4).into(), two_sided: true });
    setup
}

#[test]
fn pictures_agree_with_mitsuba() {
    // Mitsuba 3.9.1, scalar_rgb, 1.6 million samples a pixel, standard error below 4.5e-4
    let path = [
        [0.300001, 0.300001, 0.300001],
        [0.312896, 0.31274, 0.312647],
        [0.300001, 0.300001, 0.300001],
        [0.445873, 0.347591, 0.252023],
        [0.466902, 0.410287, 0.372522],
        [0.482997, 0.361535, 0.25574],
        [0.616632, 0.436026, 0.279826],
        [0.58536, 0.384723, 0.234339],
        [0.745808, 0.484336, 0.292666],
    ];
    let direct = [
        [0.300001, 0.300001, 0.300001],
        [0.312856, 0.312702, 0.31261],
        [0.300001, 0.300001, 0.300001],
        [0.437713, 0.342334, 0.249064],
        [0.411514, 0.374205, 0.351015],
        [0.473919, 0.356103, 0.252877],
        [0.60365, 0.428342, 0.275804],
        [0.548316, 0.365023, 0.224966],
        [0.728642, 0.474999, 0.288072],
    ];
    let kinds = [(IntegratorKind::Path, path), (IntegratorKind::Direct, direct)];
    for (integrator, reference) in kinds {
        let mut setup = all_lights();
        setup.settings.integrator = integrator;
        setup.settings.max_depth = 6;
        setup.settings.rr_depth = 2;
        setup.settings.spp = 20_000;
        let image = setup.render();
        for (pixel, want) in reference.iter().enumerate() {
            for (name, want) in ["R", "G", "B"].into_iter().zip(want) {
                let got = value(&image, name, pixel);
                let sigma = value(&image, &format!("variance.{name}"), pixel).sqrt();
                let bound = 3.5 * sigma.hypot(4.5e-4);
                assert!(
                    (got - want).abs() < bound,
                    "{integrator:?} {pixel} {name}: got {got}, want {want}, sigma {sigma}"
                );
            }
        }
    }
}

#[test]
fn alpha_and_depths_agree_with_mitsuba() {
    // (hide_emitters, integrator, max_depth) -> (R where 3 or 0, A) of the light seen, alpha of the
    // sphere, R and A of the background, without and with a sky; printed by Mitsuba 3.9.1
    use IntegratorKind::{Direct, Path};
    #[rustfmt::skip]
    let cases = [
        (false, Path,   0, false, [0.0, 0.0], 0.0, [0.0, 0.0]),
        (false, Path,   0, true,  [0.0, 0.0], 0.0, [0.0, 0.0]),
        (false, Path,   1, false, [3.0, 1.0], 0.0, [0.0, 0.0]),
        (false, Path,   1, true,  [3.0, 1.0], 1.0, [1.0, 1.0]),
        (false, Path,   2, false, [3.0, 1.0], 1.0, [0.0, 0.0]),
        (false, Path,   2, true,  [3.0, 1.0], 1.0, [1.0, 1.0]),
        (false, Direct, 1, false, [3.0, 1.0], 1.0, [0.0, 0.0]),
        (false, Direct, 1, true,  [3.0, 1.0], 1.0, [1.0, 0.0]),
        (true,  Path,   0, true,  [0.0, 0.0], 0.0, [0.0, 0.0]),
        (true,  Path,   1, false, [0.0, 0.0], 0.0, [0.0, 0.0]),
        (true,  Path,   1, true,  [0.0, 0.0], 0.0, [0.0, 0.0]),
        (true,  Path,   2, false, [0.0, 1.0], 1.0, [0.0, 0.0]),
        (true,  Direct, 1, false, [0.0, 1.0], 1.0, [0.0, 0.0]),
    ];
    for (hide, integrator, max_depth, with_sky, light, sphere, background) in cases {
        // a light between camera and sphere that shines towards the camera
        let to_world = DAffine3::from_translation(DVec3::new(0.0, -2.0, 0.0))
            * DAffine3::from_rotation_x(0.5 * PI)
            * DAffine3::from_scale(DVec3::splat(0.3));
        let radiance = DVec3::splat(3.0);
        let mut lights = vec![Light::Area(AreaLight { shape: AreaShape::Rectangle, to_world, radiance })];
        if with_sky {
            lights.push(sky(1.0));
        }
        let mut setup = Setup::new(vec![SPHERE], 0.5, lights);
        setup.camera.origin = DVec3::new(0.0, -5.0, 0.0);
        setup.camera.projection = pinhole(40.0);
        setup.film.size = [17, 13];
        setup.settings.spp = 4;
        setup.settings.hide_emitters = hide;
        setup.settings.integrator = integrator;
        setup.settings.max_depth = max_depth;
        let image = setup.render();
        let case = format!("hide {hide}, {integrator:?} {max_depth}, sky {with_sky}");
        let (centre, side) = (6 * 17 + 8, 6 * 17 + 5);
        let pair = |pixel| [value(&image, "R", pixel), value(&image, "A", pixel)];
        assert_eq!(pair(centre), light, "light: {case}");
        assert_eq!(value(&image, "A", side), sphere, "sphere: {case}");
        assert_eq!(pair(0), background, "background: {case}");
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    let mut setup = all_lights();
    setup.film.size = [45, 37];
    setup.settings.spp = 3;
    setup.settings.aovs = Aov::ALL.to_vec();
    let one = setup.render_with(1);
    for threads in [2, 5] {
        assert!(setup.render_with(threads) == one, "{threads} threads differ");
    }
    setup.settings.seed = 1;
    assert!(setup.render_with(1).0 != one.0, "the seed decides the picture");
}

#[test]
fn a_crop_is_part_of_the_full_frame() {
    let mut setup = all_lights();
    setup.film.size = [45, 37];
    setup.settings.spp = 3;
    setup.settings.aovs = Aov::ALL.to_vec();
    let full = setup.render();
    for crop in [[13, 9, 20, 17], [44, 36, 1, 1]] {
        setup.film.crop = Some(crop);
        let part = setup.render();
        assert_eq!(part.display_size(), [45, 37]);
        let [x, y, width, height] = crop.map(|n| n as usize);
        for channel in part.channels() {
            let whole = full.channel(&channel.name).unwrap();
            for row in 0..height {
                let want = &whole[(y + row) * 45 + x..][..width];
                let got = &channel.values[row * width..][..width];
                assert_eq!(got, want, "{} row {row}", channel.name);
            }
        }
    }
}

#[test]
fn layers_show_the_first_hit() {
    let mut setup = Setup::new(vec![SPHERE], 0.25, vec![sky(1.0)]);
    setup.look_down(DVec3::new(0.0, 0.0, 1.0), 4.0);
    setup.settings.aovs = Aov::ALL.to_vec();
    setup.settings.spp = 2;
    let image = setup.render();
    let got = |name| value(&image, name, 0);
    assert!((got("depth.T") - 4.0).abs() < 1e-6);
    assert!((got("position.Z") - 1.0).abs() < 1e-6);
    assert!((got("normal.Z") - 1.0).abs() < 1e-6);
    assert_eq!([got("object.I"), got("face.I"), got("patch.I")], [0.0, 7.0, 9.0]);
    assert_eq!(got("albedo.G"), 0.25);
    assert_eq!(got("uv.U"), 0.0, "no NaN in pictures");
    setup.shapes.clear();
    let miss = setup.render();
    assert_eq!(value(&miss, "object.I", 0), -1.0);
    assert_eq!(value(&miss, "depth.T", 0), 0.0);
    assert_eq!(value(&miss, "R", 0), 1.0);
}

#[test]
fn direction_on_screen() {
    // world +x is on the right, +z at the top
    let ball = Shape::Sphere { centre: DVec3::new(1.0, 0.0, 0.5), radius: 0.3 };
    let mut setup = Setup::new(vec![ball], 0.0, vec![sky(1.0)]);
    setup.camera.origin = DVec3::new(0.0, -5.0, 0.0);
    setup.camera.projection = pinhole(40.0);
    setup.film.size = [16, 12];
    let image = setup.render();
    // Mitsuba 3.9.1's picture of it is dark about column 12, row 3.3
    assert_eq!(value(&image, "R", 3 * 16 + 12), 0.0);
    assert_eq!(value(&image, "R", 3 * 16 + 3), 1.0);
    assert_eq!(value(&image, "R", 8 * 16 + 12), 1.0);
}

/// A surface that knows no normal.
struct Broken;

impl Geometry for Broken {
    type Tracer<'a> = &'a Self;

    fn tracer(&self) -> &Self {
        self
    }
}

impl RayTracer for &Broken {
    fn closest_hit(&mut self, ray: &Ray) -> Option<SurfaceInteraction> {
        let hit = Shapes(vec![SPHERE]).closest_hit(ray)?;
        Some(SurfaceInteraction { normal: DVec3::NAN, ..hit })
    }

    fn any_hit(&mut self, _ray: &Ray) -> bool {
        false
    }
}

#[test]
fn samples_that_are_not_finite_are_counted() {
    let mut setup = Setup::new(vec![SPHERE], 0.5, vec![sky(1.0)]);
    setup.look_down(DVec3::ZERO, 4.0);
    setup.settings.spp = 5;
    let (image, statistics) = setup.render_geometry(&Broken, 1);
    assert_eq!(statistics.samples, 5);
    assert_eq!(statistics.non_finite_samples, 5);
    assert_eq!(value(&image, "R", 0), 0.0);
}

#[test]
fn rays_are_counted() {
    let mut setup = Setup::new(vec![SPHERE], 0.5, vec![sky(1.0)]);
    setup.look_down(DVec3::ZERO, 4.0);
    setup.settings.spp = 100;
    let (_, statistics) = setup.render_with(1);
    assert_eq!(statistics.rays, 200, "one from the camera, one from the sphere");
    // half the sky's samples are below the horizon and need no ray
    assert!((20..80).contains(&statistics.shadow_rays), "{}", statistics.shadow_rays);
}

#[test]
fn renders_can_be_watched_and_stopped() {
    let mut setup = all_lights();
    setup.film.size = [64, 64];
    setup.settings.spp = 1;
    let geometry = Shapes(setup.shapes.clone());
    let lights = LightSet::try_new(&setup.lights, &[]).unwrap();
    let materials = prepared(&setup.materials);
    let scene = ShadingScene { geometry: &geometry, object_materials: &materials, lights: &lights };
    let camera = Camera::try_new(&setup.camera, setup.film.size).unwrap();
    let run = |stop_at: u64| {
        let cancel = AtomicBool::new(false);
        let most = AtomicU64::new(0);
        let progress = |done, total| {
            assert_eq!(total, 64 * 64, "one sample of each pixel");
            most.fetch_max(done, Ordering::Relaxed);
            if done >= stop_at {
                cancel.store(true, Ordering::Relaxed);
            }
        };
        let control = RenderControl { threads: 1, progress: &progress, ..RenderControl::new(&cancel) };
        let result = render(&scene, &camera, &setup.film, &setup.settings, &control);
        (result, most.load(Ordering::Relaxed))
    };
    let (result, done) = run(u64::MAX);
    assert!(result.is_ok());
    assert_eq!(done, 64 * 64);
    let (result, done) = run(512);
    assert!(matches!(result, Err(RenderError::Interrupted)));
    assert_eq!(done, 512);
}

/// Every kind of light on a sphere, with a filter, in a picture of several tiles.
fn filtered(filter: Filter) -> Setup {
    let mut setup = all_lights();
    setup.film = FilmSettings { size: [45, 37], filter, crop: None };
    setup.settings.spp = 40;
    setup.settings.aovs = vec![Aov::Variance, Aov::Depth];
    setup
}

#[test]
fn crops_are_parts_of_the_picture() {
    for filter in [Filter::Box, Filter::Gaussian, Filter::Lanczos] {
        let mut setup = filtered(filter);
        let whole = setup.render_with(2).0;
        for crop in [[0, 0, 45, 37], [14, 15, 5, 4], [40, 30, 5, 7], [17, 0, 1, 1]] {
            setup.film.crop = Some(crop);
            let part = setup.render();
            let [x, y, width, height] = crop;
            for channel in whole.channels() {
                let values = part.channel(&channel.name).unwrap();
                for row in 0..height {
                    let start = ((y + row) * 45 + x) as usize;
                    let want = &channel.values[start..start + width as usize];
                    let got = &values[(row * width) as usize..][..width as usize];
                    assert_eq!(got, want, "{filter:?}, {}, row {row} of {crop:?}", channel.name);
                }
            }
        }
    }
}

#[test]
fn filters_keep_the_mean_and_know_their_variance() {
    // many pictures: the spread of each pixel is the variance that each of them claims
    for filter in [Filter::Box, Filter::Tent, Filter::Mitchell, Filter::CatmullRom] {
        let mut setup = filtered(filter);
        setup.film.size = [9, 9];
        setup.settings.spp = 64;
        let pictures: Vec<_> = (0..60)
            .map(|seed| {
                setup.settings.seed = seed;
                setup.render()
            })
            .collect();
        let (mut ratio, mut pixels) = (0.0, 0.0);
        for pixel in 0..81 {
            let values = |name: &str| pictures.iter().map(|p| value(p, name, pixel)).collect::<Vec<_>>();
            let (radiance, claimed) = (values("R"), values("variance.R"));
            let mean = |v: &[f64]| v.iter().sum::<f64>() / 60.0;
            let of_pixel = mean(&radiance);
            let spread = radiance.iter().map(|x| (x - of_pixel).powi(2)).sum::<f64>() / 59.0;
            // the sky alone has no noise but rounding
            if mean(&claimed) > 1e-12 {
                ratio += spread / mean(&claimed);
                pixels += 1.0;
            }
        }
        // each pixel's ratio has a deviation of √(2/59), neighbours' are alike
        let ratio = ratio / pixels;
        assert!((ratio - 1.0).abs() < 0.15, "{filter:?}: {ratio} of {pixels} pixels");
    }
}

#[test]
fn sobol_has_less_noise() {
    let noise = |sampler| {
        let mut setup = filtered(Filter::Box);
        setup.film.size = [9, 9];
        setup.settings.sampler = sampler;
        let mut sum = 0.0;
        let pictures: Vec<_> = (0..8)
            .map(|seed| {
                setup.settings.seed = seed;
                setup.render()
            })
            .collect();
        for pixel in 0..81 {
            let values: Vec<_> = pictures.iter().map(|picture| value(picture, "R", pixel)).collect();
            let mean = values.iter().sum::<f64>() / 8.0;
            sum += values.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
        }
        sum
    };
    let (independent, sobol) = (noise(SamplerKind::Independent), noise(SamplerKind::Sobol));
    assert!(sobol < 0.6 * independent, "{sobol} of {independent}");
}

#[test]
fn interrupted_renders_go_on_to_the_same_picture() {
    let folder = tempfile::tempdir().unwrap();
    for filter in [Filter::Box, Filter::Mitchell] {
        let mut setup = filtered(filter);
        let whole = setup.render();
        let path = folder.path().join(format!("{filter:?}"));
        let file = |settings: &str| {
            let identity = PictureIdentity::from_settings(serde_json::json!({ "of": settings }));
            CheckpointFile::new(path.clone(), &identity, std::time::Duration::ZERO)
        };
        let geometry = Shapes(setup.shapes.clone());
        let lights = LightSet::try_new(&setup.lights, &[]).unwrap();
        let materials = prepared(&setup.materials);
        let scene = ShadingScene { geometry: &geometry, object_materials: &materials, lights: &lights };
        let camera = Camera::try_new(&setup.camera, setup.film.size).unwrap();
        // stopped again and again, each time a bit later
        let mut finished = None;
        for round in 1..100 {
            let resumed = path.exists().then(|| file("this").read().unwrap());
            let cancel = AtomicBool::new(false);
            let calls = AtomicU64::new(0);
            let progress = |_, _| {
                if calls.fetch_add(1, Ordering::Relaxed) >= round {
                    cancel.store(true, Ordering::Relaxed);
                }
            };
            let saved = file("this");
            let control = RenderControl {
                threads: 2,
                progress: &progress,
                checkpoint: Some(&saved),
                resume: resumed.as_ref(),
                ..RenderControl::new(&cancel)
            };
            match render(&scene, &camera, &setup.film, &setup.settings, &control) {
                Ok(rendered) => {
                    assert!(round > 3, "it was never interrupted");
                    finished = Some(rendered.image);
                    break;
                }
                Err(error) => assert!(matches!(error, RenderError::Interrupted), "{error}"),
            }
        }
        assert_eq!(finished.as_ref(), Some(&whole), "{filter:?}");

        let other = file("that").read().unwrap_err();
        assert!(matches!(&other, CheckpointError::OtherPicture { what, .. } if what == "of"), "{other}");
        let done = file("this").read().unwrap();
        setup.settings.spp = 50;
        let cancel = AtomicBool::new(false);
        let control = RenderControl { resume: Some(&done), ..RenderControl::new(&cancel) };
        let more = render(&scene, &camera, &setup.film, &setup.settings, &control).unwrap_err();
        assert!(more.to_string().contains("a multiple of 16"), "{more}");

        let mut bytes = std::fs::read(&path).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        std::fs::write(&path, &bytes).unwrap();
        let damaged = file("this").read().unwrap_err();
        assert!(matches!(damaged, CheckpointError::NotOne { .. }), "{damaged}");
        std::fs::write(&path, "").unwrap();
        assert!(matches!(file("this").read().unwrap_err(), CheckpointError::NotOne { .. }));
    }
}

#[test]
fn a_deadline_ends_with_the_samples_there_are() {
    let setup = filtered(Filter::Box);
    let geometry = Shapes(setup.shapes.clone());
    let lights = LightSet::try_new(&setup.lights, &[]).unwrap();
    let materials = prepared(&setup.materials);
    let scene = ShadingScene { geometry: &geometry, object_materials: &materials, lights: &lights };
    let camera = Camera::try_new(&setup.camera, setup.film.size).unwrap();
    let cancel = AtomicBool::new(false);
    let deadline = Some(Instant::now());
    let control = RenderControl { deadline, ..RenderControl::new(&cancel) };
    let rendered = render(&scene, &camera, &setup.film, &setup.settings, &control).unwrap();
    assert_eq!(rendered.samples, [0, 0]);
    assert!(rendered.image.channel("R").unwrap().iter().all(|&value| value == 0.0));
}
mod lights;
