//! The camera and the lights of a scene that names none: a first picture that shows the shape.

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DVec3};

use crate::model::farthest_reach;
use crate::shade::light::{AreaLight, AreaShape, ConstantLight};
use crate::shade::{CameraSettings, FovAxis, Light, Projection};
use crate::trace::TracedObject;

/// Field of view over the picture's shorter side, in degrees: that of a portrait lens, which distorts little.
const FOV: f64 = 30.0;

/// Share of the picture's shorter side that the objects fill, along the axis where they fill more.
const FILLED: f64 = 0.85;

/// The objects are framed as if they were larger by at most this share of their size.
const SLACK: f64 = 5e-4;

/// From the objects to the camera: from the front, the right and above.
const TOWARD_CAMERA: DVec3 = DVec3::new(0.5, -0.8, 0.45);

/// Radiance of the sky, which is the picture's background as well.
const SKY: f64 = 0.22;

/// Irradiance by the key light of a surface that faces it, in the middle of the scene.
const KEY: f64 = 3.2;

/// The key light's way from the camera, to the left and up, in parts of its distance along the direction of view: the
/// light stands 45° from that direction.
const KEY_OFFSET: [f64; 2] = [0.75, 0.66];

/// Radius of the key light in parts of its distance: shadows have soft borders.
const KEY_RADIUS: f64 = 0.3;

/// A camera whose picture the objects fill to 85 % of its shorter side, whatever the picture's size.
///
/// A pyramid of that share of the field of view is moved until its four sides touch the objects from outside. That takes
/// no more than how far these reach along the normals of the four planes, and is exact in perspective. `[low, high]` is a box
/// around the objects.
///
/// # Panics
/// If there are no objects.
pub(super) fn framing_camera(objects: &[TracedObject], [low, high]: [DVec3; 2]) -> CameraSettings {
    let [right, up, backward] = {
        let backward = TOWARD_CAMERA.normalize();
        let right = DVec3::Z.cross(backward).normalize();
        [right, backward.cross(right), backward]
    };
    let (middle, size) = (0.5 * (low + high), (high - low).length().max(f64::MIN_POSITIVE));
    let slope = FILLED * libm::tan(0.5 * FOV.to_radians());
    let reach = |outward: DVec3| {
        let along = outward + slope * backward;
        let farthest = objects.iter().map(|object| farthest_reach(object.faces(), along, SLACK * size));
        farthest.fold(f64::NEG_INFINITY, f64::max) - along.dot(middle)
    };
    // of the planes through a camera at x, y and distance d from the middle: |x of a point - x| <= slope (d - its z)
    let [[left, right_side], [down, upper]] = [right, up].map(|axis| [reach(-axis), reach(axis)]);
    let distance = 0.5 * (left + right_side).max(down + upper) / slope;
    let across = 0.5 * (right_side - left) * right + 0.5 * (upper - down) * up;
    let target = middle + across;
    CameraSettings {
        origin: target + distance.max(f64::MIN_POSITIVE) * backward,
        target,
        up: DVec3::Z,
        projection: Projection::Perspective { fov: FOV, fov_axis: FovAxis::Smaller, lens: None },
    }
}

/// A soft key light from the camera's upper left, over a dimmer grey sky.
///
/// The key light is a disk that faces the middle of the objects. It stands behind the camera's plane, so that it is never in
/// the picture, and its light on the objects does not depend on its distance. `[low, high]` is a box around the objects.
pub(super) fn key_and_sky([low, high]: [DVec3; 2], camera: &CameraSettings) -> Vec<Light> {
    let (middle, size) = (0.5 * (low + high), (high - low).length().max(f64::MIN_POSITIVE));
    let backward = (camera.origin - camera.target).normalize_or(DVec3::Z);
    let right =
        camera.up.cross(backward).try_normalize().unwrap_or_else(|| backward.any_orthonormal_vector());
    let up = backward.cross(right);
    let depth = 1.05 * (camera.origin - middle).dot(backward).max(size);
    let way = depth * (backward - KEY_OFFSET[0] * right + KEY_OFFSET[1] * up);
    let facing = -way.normalize();
    let across = facing.any_orthonormal_vector();
    let radius = KEY_RADIUS * way.length();
    let axes = DMat3::from_cols(radius * across, radius * facing.cross(across), facing);
    // a disk that faces a point fills the share sin² of what a sky would give
    let share = KEY_RADIUS * KEY_RADIUS / (1.0 + KEY_RADIUS * KEY_RADIUS);
    vec![
        Light::Constant(ConstantLight { radiance: DVec3::splat(SKY) }),
        Light::Area(AreaLight {
            shape: AreaShape::Disk,
            to_world: DAffine3::from_mat3_translation(axes, middle + way),
            radiance: DVec3::splat(KEY / (PI * share)),
        }),
    ]
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use glam::DVec2;

    use super::*;
    use crate::scene::{BuiltScene, parse_scene_str};
    use crate::shade::Camera;
    use crate::shade::light::PointLight;
    use crate::trace::{Ray, RayTracer};

    /// The scene of objects that a text lists; its meshes are those of `scenes`.
    fn built(text: &str) -> BuiltScene {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/first_view.toml");
        parse_scene_str(text, &path).expect("the scene is valid").build().expect("it can be built")
    }

    /// Lowest and highest pixel that shows an object, in parts of the shorter side, from the picture's middle.
    fn seen(scene: &BuiltScene, size: [u32; 2]) -> [DVec2; 2] {
        let camera = Camera::try_new(&scene.camera, size).unwrap();
        let pixels = DVec2::new(size[0].into(), size[1].into());
        let mut tracer = scene.traced.tracer();
        let mut seen = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        for (x, y) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
            let corner = DVec2::new(x.into(), y.into());
            let ray: Ray = camera.ray(corner + 0.5, DVec2::ZERO);
            if tracer.closest_hit(&ray).is_some() {
                seen = [seen[0].min(corner), seen[1].max(corner + 1.0)];
            }
        }
        seen.map(|place| (place - 0.5 * pixels) / pixels.min_element())
    }

    const OBJECTS: [&str; 5] = [
        "surface = { type = \"sphere\", radius = 3.0 }",
        "surface = { type = \"torus\", major_radius = 2.0, minor_radius = 0.2 }",
        "mesh = \"meshes/feng_fig10_castle.obj\"",
        "mesh = \"meshes/feng_fig13_fish.obj\"\ntransform = [{ scale = 1e-3 }, { translate = [5, 6, 7] }]",
        "mesh = \"meshes/feng_fig07_cube.obj\"\n[[object.deform]]\ntype = \"ffd\"\ndegree = [2, 2, 2]\n\
         points = [4, 4, 4]\n[[object.deform.edit]]\ntwist = { axis = \"z\", angle = 70 }",
    ];

    #[test]
    fn objects_fill_85_percent_of_the_shorter_side() {
        for object in OBJECTS {
            let scene = built(&format!("[[object]]\nname = \"a\"\n{object}\n"));
            for size in [[300, 300], [480, 270], [240, 360]] {
                let [low, high] = seen(&scene, size);
                let filled = (high - low).max_element();
                let tolerance = 0.01 * FILLED + 1.0 / f64::from(size[0].min(size[1]));
                assert!((filled - FILLED).abs() < tolerance, "{object} in {size:?}: {low} to {high}");
                let middle = 0.5 * (low + high);
                assert!(
                    middle.abs().max_element() < 0.05,
                    "{object} in {size:?} is off the middle by {middle}"
                );
            }
        }
    }

    #[test]
    fn several_objects_are_framed_together() {
        let ball = |name: &str, x: f64| {
            format!(
                "[[object]]\nname = \"{name}\"\nsurface = {{ type = \"sphere\", radius = 1.0 }}\n\
                     transform = [{{ translate = [{x}, 0, 0] }}]\n"
            )
        };
        let [low, high] = seen(&built(&(ball("a", -4.0) + &ball("b", 5.0))), [300, 300]);
        assert!(((high - low).x - FILLED).abs() < 0.012, "{low} to {high}");
    }

    #[test]
    fn the_key_light_is_at_the_upper_left_behind_the_camera() {
        let ball = "[[object]]\nname = \"a\"\nsurface = { type = \"sphere\", radius = 1.0 }\n";
        let camera = "[camera]\norigin = [9, 1, 2]\ntarget = [0, 0, 0]\n";
        for text in [ball.to_owned(), camera.to_owned() + ball] {
            let scene = built(&text);
            let [Light::Constant(ConstantLight { radiance }), Light::Area(AreaLight { shape, to_world, .. })] =
                &scene.light_settings[..]
            else {
                panic!("{:?}", scene.light_settings);
            };
            assert_eq!(*shape, AreaShape::Disk);
            assert_eq!(radiance.min_element(), radiance.max_element(), "the sky is grey");
            let view = Camera::try_new(&scene.camera, [100, 100]).unwrap().camera_from_world();
            let place = view.transform_point3(to_world.translation);
            assert!(place.x < 0.0 && place.y > 0.0 && place.z > 0.0, "{place}");
            assert!(to_world.matrix3.z_axis.dot(-to_world.translation) > 0.0, "it faces the scene");
        }
    }

    #[test]
    fn lights_of_the_scene_replace_it() {
        let ball = "[[object]]\nname = \"a\"\nsurface = { type = \"sphere\", radius = 1.0 }\n";
        let scene = built(&format!("[[light]]\ntype = \"point\"\nposition = [0, 0, 9]\n{ball}"));
        let point = Light::Point(PointLight { position: DVec3::new(0.0, 0.0, 9.0), intensity: DVec3::ONE });
        assert_eq!(scene.light_settings, [point]);
    }
}
