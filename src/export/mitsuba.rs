//! Scenes for Mitsuba 3.

use std::io;

use glam::DVec3;

use super::meshes::{NamedMesh, Precision, ply};
use super::xml::Element;
use crate::film::{Aov, FilmSettings, Filter};
use crate::scene::{BuiltScene, Choice, SceneDescription};
use crate::shade::{CameraSettings, IntegratorKind, Light, Material, RenderSettings};

/// The scene file's name.
pub const MITSUBA_SCENE: &str = "scene.xml";

/// What is written at the top of a folder: everything else in it is someone else's.
pub const MITSUBA_NAMES: &[&str] = &[MITSUBA_SCENE, MESHES];

const MESHES: &str = "meshes";

/// How a scene file that is ours begins; tells other folders from those that may be overwritten.
const MARK: &str = "exported by trimray";

/// The plugins' parameters are those of this version.
const VERSION: &str = "3.9.0";

/// Distances of Mitsuba's clipping planes in parts of the scene's size as the camera sees it; their ratio is near that of the
/// defaults, 1e6, for single precision's sake. This program's camera has none.
const CLIP: [f64; 2] = [1e-4, 1e3];

/// A file of an exported folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportedFile {
    /// Its path in the folder, with `/`.
    pub path: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// Whether a text is the beginning of a scene file that was written here.
pub fn is_exported(text: &[u8]) -> bool {
    text.windows(MARK.len()).take(200).any(|window| window == MARK.as_bytes())
}

/// The files of a Mitsuba scene of the same picture: the scene and one PLY file for each object.
///
/// # Errors
/// None in practice: the XML is written to memory.
///
/// # Panics
/// If there are not as many meshes as objects.
pub fn mitsuba_scene(
    scene: &SceneDescription,
    built: &BuiltScene,
    meshes: &[NamedMesh],
) -> io::Result<Vec<ExportedFile>> {
    assert_eq!(meshes.len(), scene.objects.len(), "one mesh for each object");
    let paths: Vec<_> =
        (0..).zip(meshes).map(|(n, mesh)| format!("{MESHES}/{}.ply", id(n, &mesh.name))).collect();
    let objects = scene.objects.iter().zip(meshes).zip(&paths).map(|((object, mesh), path)| {
        Element::plugin("shape", "ply")
            .string("filename", path)
            // the triangles' own normals, which are the surface's
            .boolean("face_normals", true)
            .child(Element::new("ref").attribute("id", material_id(scene, object.material)))
            .children((!mesh.mesh.uvs.is_empty()).then(flip_tex_coords))
    });
    let root = Element::new("scene")
        .attribute("version", VERSION)
        .child(integrator(&scene.render))
        .child(sensor(&built.camera, &scene.film, &scene.render, built.traced.bounds()))
        .children(materials(scene))
        .children(scene.lights_or_default().iter().map(light))
        .children(objects);
    let farthest = meshes.iter().map(|mesh| mesh.mesh.deviation).fold(0.0, f64::max);
    let comment = format!(
        "{MARK} {}; the triangles are within {farthest:.1e} of the exact surfaces",
        env!("CARGO_PKG_VERSION")
    );
    let mut files = vec![ExportedFile { path: MITSUBA_SCENE.into(), bytes: root.document(&comment)? }];
    for (mesh, path) in meshes.iter().zip(paths) {
        // Mitsuba keeps vertices in single precision
        files.push(ExportedFile { path, bytes: ply(std::slice::from_ref(mesh), Precision::Single) });
    }
    Ok(files)
}

/// A number and a name in letters that files and references can have.
fn id(number: usize, name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    format!("{number}_{}", name.chars().take(40).map(plain).collect::<String>())
}

fn material_id(scene: &SceneDescription, material: Option<usize>) -> String {
    let named = material.map(|index| format!("material_{}", id(index, &scene.materials[index].name.value)));
    named.unwrap_or_else(|| "material_default".to_owned())
}

/// All materials, and the default one if an object has it.
fn materials(scene: &SceneDescription) -> Vec<Element> {
    let used = |material: &Option<usize>| scene.objects.iter().any(|object| object.material == *material);
    let all = std::iter::once(None).chain((0..scene.materials.len()).map(Some));
    all.filter(used)
        .map(|index| {
            let material = index.map(|index| scene.materials[index].material).unwrap_or_default();
            bsdf(&material).attribute("id", material_id(scene, index))
        })
        .collect()
}

fn bsdf(material: &Material) -> Element {
    let (model, two_sided) = match material {
        Material::Diffuse { reflectance, two_sided } => {
            (Element::plugin("bsdf", "diffuse").rgb("reflectance", *reflectance), *two_sided)
        }
    };
    if two_sided { Element::plugin("bsdf", "twosided").child(model) } else { model }
}

fn light(light: &Light) -> Element {
    match light {
        Light::Constant { radiance } => Element::plugin("emitter", "constant").rgb("radiance", *radiance),
        Light::Point { position, intensity } => {
            Element::plugin("emitter", "point").point("position", *position).rgb("intensity", *intensity)
        }
        Light::Rectangle { to_world, radiance } => {
            area(Element::plugin("shape", "rectangle").transform("to_world", to_world), *radiance)
        }
    }
}

/// A shape that emits and is black otherwise.
fn area(shape: Element, radiance: DVec3) -> Element {
    shape
        .child(Element::plugin("bsdf", "diffuse").rgb("reflectance", DVec3::ZERO))
        .child(Element::plugin("emitter", "area").rgb("radiance", radiance))
}

/// Mitsuba's v of a PLY file runs downwards in textures, that of OBJ files upwards.
fn flip_tex_coords() -> Element {
    Element::new("boolean").attribute("name", "flip_tex_coords").attribute("value", "true")
}

fn sensor(
    camera: &CameraSettings,
    settings: &FilmSettings,
    render: &RenderSettings,
    bounds: [DVec3; 2],
) -> Element {
    let CameraSettings { origin, target, up, fov, fov_axis } = camera;
    let look_at = Element::new("lookat")
        .attribute("origin", triple(*origin))
        .attribute("target", triple(*target))
        .attribute("up", triple(*up));
    let middle = 0.5 * (bounds[0] + bounds[1]);
    let size = origin.distance(middle) + 0.5 * (bounds[1] - bounds[0]).length();
    Element::plugin("sensor", "perspective")
        .float("fov", *fov)
        .string("fov_axis", fov_axis.name())
        .float("near_clip", CLIP[0] * size)
        .float("far_clip", CLIP[1] * size)
        .child(Element::new("transform").attribute("name", "to_world").child(look_at))
        .child(film(settings))
        .child(sampler(render))
}

fn triple(point: DVec3) -> String {
    format!("{:?} {:?} {:?}", point.x, point.y, point.z)
}

fn film(film: &FilmSettings) -> Element {
    let FilmSettings { size, filter, crop } = film;
    let mut element = Element::plugin("film", "hdrfilm").integer("width", size[0]).integer("height", size[1]);
    if let Some([x, y, width, height]) = *crop {
        element = element
            .integer("crop_offset_x", x)
            .integer("crop_offset_y", y)
            .integer("crop_width", width)
            .integer("crop_height", height);
    }
    let filter = match filter {
        Filter::Box => Element::plugin("rfilter", "box"),
    };
    element.string("pixel_format", "rgba").string("component_format", "float32").child(filter)
}

fn sampler(render: &RenderSettings) -> Element {
    // Mitsuba's seeds have 32 bits; the random numbers are others anyway
    let seed = render.seed & u64::from(u32::MAX);
    Element::plugin("sampler", "independent")
        .integer("sample_count", render.spp)
        .integer("seed", i64::try_from(seed).unwrap_or_default())
}

fn integrator(render: &RenderSettings) -> Element {
    let light = match render.integrator {
        IntegratorKind::Path => Element::plugin("integrator", "path")
            .integer("max_depth", render.max_depth)
            .integer("rr_depth", render.rr_depth),
        IntegratorKind::Direct => Element::plugin("integrator", "direct"),
    };
    let light = light.boolean("hide_emitters", render.hide_emitters);
    let layers: Vec<_> = render.aovs.iter().copied().filter_map(layer).collect();
    if layers.is_empty() {
        return light;
    }
    Element::plugin("integrator", "aov")
        .string("aovs", &layers.join(","))
        .child(light.attribute("name", "image"))
}

/// Mitsuba's name of a layer and of what it shows, if it has it.
const fn layer(aov: Aov) -> Option<&'static str> {
    match aov {
        Aov::Depth => Some("depth:depth"),
        Aov::Position => Some("position:position"),
        Aov::Normal => Some("normal:sh_normal"),
        Aov::GeoNormal => Some("geo_normal:geo_normal"),
        Aov::Uv => Some("uv:uv"),
        Aov::Albedo => Some("albedo:albedo"),
        Aov::St | Aov::Rest | Aov::Object | Aov::Face | Aov::Patch | Aov::Variance => None,
    }
}
