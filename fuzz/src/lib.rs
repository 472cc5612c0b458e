//! What the fuzz targets do with their input. Each is an ordinary function that panics if something is wrong, so that the seeds
//! run as a test without a fuzzer (`tests/fuzz_seeds.rs`).

use std::fs;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DVec3};
use trimray::analytic::{Expression, Extension, ExtensionMode, Region};
use trimray::arrays::read_f64;
use trimray::difference::{CompareSettings, compare};
use trimray::film::{PictureLimits, read_layers_within};
use trimray::memory::MemoryLimit;
use trimray::mesh::{MeshTolerances, load_mesh, prepare_polygons};
use trimray::model::{BuildSettings, Edit, Lattice, Object, Shape};
use trimray::scene::parse_scene_str;
use trimray::spline::Axis;
use trimray::surface::{self, SplineSurface};
use trimray::trace::{Ray, TracedScene};

/// What everything has to do with.
const MEMORY: MemoryLimit = MemoryLimit::new(1 << 30);

/// Objects built within that.
fn limited() -> BuildSettings {
    BuildSettings { memory: MEMORY, ..BuildSettings::default() }
}

/// The input as a file, which is what the library reads.
fn file(ending: &str, data: &[u8]) -> PathBuf {
    let name = format!("trimray_fuzz_{}_{:?}.{ending}", std::process::id(), std::thread::current().id());
    let path = std::env::temp_dir().join(name.replace(['(', ')'], ""));
    fs::write(&path, data).expect("the folder for temporary files is writable");
    path
}

/// An OBJ file to polygons, and to patches under a twisted lattice.
pub fn obj(data: &[u8]) {
    let path = file("obj", data);
    let Ok((mesh, _)) = load_mesh(&path) else { return };
    let (polygons, notes) = prepare_polygons(&mesh, DAffine3::IDENTITY, MeshTolerances::default());
    assert!(notes.polygons == polygons.len(), "every polygon is counted");
    let mut lattice = Lattice::new([2; 3], [4; 3]);
    lattice.edits.push(Edit::Twist { axis: Axis::Z, angle: 60.0 });
    let mut object = Object::new("mesh", Shape::Polygons(mesh.into()));
    object.deformers.push(lattice.into());
    if let Ok(built) = object.build_with(limited()) {
        let _ = TracedScene::try_new_within(vec![built.traced], MEMORY);
    }
}

/// A scene file to a built scene; its meshes and pictures are those of `scenes`.
pub fn scene(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    // the tests of the program include this file
    let root = if here.ends_with("fuzz") { here.parent().unwrap_or(here) } else { here };
    let path = root.join("scenes/fuzzed.toml");
    if let Ok(mut scene) = parse_scene_str(text, &path) {
        scene.memory = MEMORY;
        scene.pictures = PictureLimits { max_pixels: 1 << 20, memory: MEMORY };
        let _ = scene.build();
    }
}

/// An array of numbers: `.npy`, or `.npz` if it begins as an archive.
pub fn array(data: &[u8]) {
    let ending = if data.starts_with(b"PK") { "npz" } else { "npy" };
    if let Ok(array) = read_f64(&file(ending, data)) {
        let count = array.shape.iter().product::<usize>();
        assert!(count == array.values.len(), "as many numbers as the shape says");
    }
}

/// An expression as the bound of an extension function, to the cells of a sheet.
pub fn expression(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok(bound) = Expression::parse(text) else { return };
    let region = Region {
        bound,
        center: DVec3::ZERO,
        index: 2,
        h: [[0.3, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.5]],
        epsilon: [[1.0; 3]; 3],
        factor: None,
    };
    let mode = ExtensionMode::Operator { center: DVec3::Z, axes: DMat3::IDENTITY };
    let sheet = surface::Shape::Plane { origin: DVec3::ZERO, u: DVec3::X, v: DVec3::Y };
    let sheet = sheet.surface().expect("a plane with two directions");
    let mut object = Object::new("sheet", Shape::Surface(sheet));
    let extension = Extension::try_new(mode, vec![region]).expect("axes and an index that are right");
    object.deformers.push(extension.into());
    if let Ok(built) = object.build_with(limited()) {
        let _ = TracedScene::try_new_within(vec![built.traced], MEMORY);
    }
}

/// A picture, compared with itself.
pub fn picture(data: &[u8]) {
    let ending = if data.starts_with(b"\x89PNG") { "png" } else { "exr" };
    let limits = PictureLimits { max_pixels: 1 << 22, memory: MEMORY };
    let Ok(picture) = read_layers_within(&file(ending, data), limits) else { return };
    if let Ok(found) = compare(&picture, &picture, &CompareSettings::default()) {
        assert!(found.figures.max_error == 0.0 && found.figures.non_finite == 0, "a picture is as itself");
    }
}

/// Numbers out of the input; 0 when it has ended.
struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }

    /// In [-1, 1].
    fn small(&mut self) -> f64 {
        f64::from(i16::from_le_bytes([self.byte(), self.byte()])) / f64::from(i16::MAX)
    }

    /// Any finite number.
    fn any(&mut self) -> f64 {
        let number = f64::from_bits(u64::from_le_bytes(std::array::from_fn(|_| self.byte())));
        if number.is_finite() { number } else { 0.5 }
    }
}

/// Rays of any finite numbers on a small random patch.
pub fn rays(data: &[u8]) {
    let mut numbers = Numbers(data);
    let degree = [0, 1].map(|_| 1 + usize::from(numbers.byte() % 4));
    let count = (degree[0] + 1) * (degree[1] + 1);
    let points: Vec<_> = (0..count).map(|_| DVec3::from_array([0; 3].map(|_| numbers.small()))).collect();
    let rational = numbers.byte() % 2 == 1;
    let weights: Vec<_> = (0..count).filter(|_| rational).map(|_| 1.5 + numbers.small()).collect();
    let surface = SplineSurface::bezier(degree, &points, &weights).expect("numbers that fit each other");
    let Ok(built) = Object::new("patch", Shape::Surface(surface)).build_with(limited()) else { return };
    let scene = TracedScene::new(vec![built.traced]);
    while !numbers.0.is_empty() {
        let exact = numbers.byte() % 4 == 0;
        let mut vector =
            || DVec3::from_array([0; 3].map(|_| if exact { numbers.any() } else { 3.0 * numbers.small() }));
        let (origin, direction) = (vector(), vector());
        check_ray(&scene, &Ray::new(origin, direction));
    }
}

/// What holds of any ray.
fn check_ray(scene: &TracedScene, ray: &Ray) {
    if !ray.is_traceable() {
        return;
    }
    let (closest, all) = (scene.closest_hit(ray), scene.all(ray));
    assert_eq!(closest.is_some(), scene.any_hit(ray), "{ray:?}: any is whether there is a closest");
    assert_eq!(closest.is_some(), !all.is_empty(), "{ray:?}: all are as many as there are");
    let Some(closest) = closest else { return };
    assert!(all.iter().any(|hit| hit.t == closest.t), "{ray:?}: the closest is one of all");
    assert!(all.iter().all(|hit| hit.t >= closest.t), "{ray:?}: none is closer");
    // rounding of the ray's points there, and of the patch's, whose control points are within 2
    let size = 4.0 + ray.origin.abs().max_element();
    let off = ray.at(closest.t).distance(closest.position);
    let tangent = all.iter().any(|hit| hit.tangent);
    assert!(tangent || off <= 1e-9 * size, "{ray:?}: {off} off");
}
