//! Scenes for Mitsuba 3.

use std::borrow::Cow;
use std::io;

use glam::DVec3;

use super::folder::{ExportedFile, PICTURES, Pictures, id};
use super::meshes::{NamedMesh, Precision, ply};
use super::mitsuba_parameters::{area_emitter, bsdf, emitter};
use super::xml::Element;
use crate::choice::Choice;
use crate::film::{Aov, FilmSettings, Filter};
use crate::scene::{BuiltScene, SceneDescription};
use crate::shade::{CameraSettings, IntegratorKind, Light, Projection, RenderSettings};

/// The scene file's name.
pub const MITSUBA_SCENE: &str = "scene.xml";

/// What is written at the top of a folder: everything else in it is someone else's.
pub const MITSUBA_NAMES: &[&str] = &[MITSUBA_SCENE, MESHES, PICTURES];

const MESHES: &str = "meshes";

/// How a scene file that is ours begins; tells other folders from those that may be overwritten.
const MARK: &str = "exported by trimray";

/// The plugins' parameters are those of this version.
const VERSION: &str = "3.9.0";

/// Distances of Mitsuba's clipping planes in parts of the scene's size as the camera sees it; their ratio is near that of the
/// defaults, 1e6, for single precision's sake. This program's camera has none.
const CLIP: [f64; 2] = [1e-4, 1e3];

/// Whether a text is the beginning of a scene file that was written here.
#[must_use]
pub fn is_exported(text: &[u8]) -> bool {
    text.windows(MARK.len()).take(200).any(|window| window == MARK.as_bytes())
}

/// The files of a Mitsuba scene of the same picture: the scene, one PLY file for each object, and the pictures of textures.
///
/// # Errors
/// If a picture can no longer be read.
///
/// # Panics
/// If there are not as many meshes as objects.
pub fn mitsuba_scene(
    scene: &SceneDescription,
    built: &BuiltScene,
    meshes: &[NamedMesh],
) -> io::Result<Vec<ExportedFile>> {
    assert_eq!(meshes.len(), scene.objects.len(), "one mesh for each object");
    let shapes: Vec<Shape<'_>> =
        (0..meshes.len()).flat_map(|object| shapes_of(scene, built, object, &meshes[object])).collect();
    let mut pictures = Pictures::default();
    // the scene's text knows the files of pictures
    let all_lights: Vec<&Light> = match &scene.lights {
        Some(listed) => listed.iter().map(|light| &light.value).collect(),
        None => built.light_settings.iter().collect(),
    };
    let shines = |index: usize| {
        all_lights.iter().find_map(|light| match light {
            Light::Object(shining) if shining.object == index => Some(shining.radiance),
            _ => None,
        })
    };
    let objects = shapes.iter().map(|Shape { object, mesh, path, material, emission }| {
        Element::plugin("shape", "ply")
            .string("filename", path)
            // the triangles' own normals, which are the surface's
            .boolean("face_normals", mesh.mesh.normals.is_empty())
            .child(Element::new("ref").attribute("id", material))
            .children((!mesh.mesh.uvs.is_empty()).then(flip_tex_coords))
            .children(shines(*object).or(*emission).map(area_emitter))
    });
    let root = Element::new("scene")
        .attribute("version", VERSION)
        .child(integrator(&scene.render))
        .child(sensor(&built.camera, &scene.film, &scene.render, built.traced.bounds()))
        .children(materials(scene, built, &mut pictures)?)
        .children(lights(&all_lights, &mut pictures)?)
        .children(objects);
    let farthest = meshes.iter().map(|mesh| mesh.mesh.deviation).fold(0.0, f64::max);
    let comment = format!(
        "{MARK} {}; the triangles are within {farthest:.1e} of the exact surfaces",
        env!("CARGO_PKG_VERSION")
    );
    let mut files = vec![ExportedFile { path: MITSUBA_SCENE.into(), bytes: root.document(&comment)? }];
    for Shape { mesh, path, .. } in shapes {
        // Mitsuba keeps vertices in single precision
        files.push(ExportedFile { path, bytes: ply(std::slice::from_ref(&*mesh), Precision::Single) });
    }
    files.append(&mut pictures.into_files());
    Ok(files)
}

/// What has one material in Mitsuba's scene: an object, or the triangles of its faces with one material.
struct Shape<'a> {
    /// Index of the object.
    object: usize,
    mesh: Cow<'a, NamedMesh>,
    path: String,
    /// The material's name in the file.
    material: String,
    /// The radiance of a material that emits.
    emission: Option<DVec3>,
}

fn shapes_of<'a>(
    scene: &SceneDescription,
    built: &BuiltScene,
    object: usize,
    mesh: &'a NamedMesh,
) -> Vec<Shape<'a>> {
    let name = id(object, &mesh.name);
    let materials = &built.materials[object];
    if materials.only().is_some() {
        let material = material_id(scene, scene.objects[object].material);
        return vec![Shape {
            object,
            mesh: Cow::Borrowed(mesh),
            path: format!("{MESHES}/{name}.ply"),
            material,
            emission: None,
        }];
    }
    let with_material = |index: usize| {
        let mut part = mesh.clone();
        let triangles = mesh.mesh.triangles.iter().zip(&mesh.mesh.faces);
        let own = triangles.filter(|(_, face)| materials.index(**face) == index);
        (part.mesh.triangles, part.mesh.faces) = own.map(|(triangle, face)| (*triangle, *face)).unzip();
        let path = format!("{MESHES}/{name}_{index}.ply");
        (!part.mesh.triangles.is_empty()).then(|| Shape {
            object,
            mesh: Cow::Owned(part),
            path,
            material: face_material_id(object, index),
            emission: materials.emission().get(index).copied().filter(|&radiance| radiance != DVec3::ZERO),
        })
    };
    (0..materials.iter().len()).filter_map(with_material).collect()
}

/// The name of a material of some faces of an object.
fn face_material_id(object: usize, material: usize) -> String {
    format!("material_of_object_{object}_{material}")
}

fn material_id(scene: &SceneDescription, material: Option<usize>) -> String {
    let named = material.map(|index| format!("material_{}", id(index, &scene.materials[index].name.value)));
    named.unwrap_or_else(|| "material_default".to_owned())
}

/// All materials, and the default one if an object has it.
fn materials(
    scene: &SceneDescription,
    built: &BuiltScene,
    pictures: &mut Pictures,
) -> io::Result<Vec<Element>> {
    let uniform = || scene.objects.iter().zip(&built.materials).filter(|(_, own)| own.only().is_some());
    let used = |material: &Option<usize>| uniform().any(|(object, _)| object.material == *material);
    let all = std::iter::once(None).chain((0..scene.materials.len()).map(Some));
    let listed = all.filter(used).map(|index| {
        let material = index.map(|index| scene.materials[index].material.clone()).unwrap_or_default();
        (material, material_id(scene, index))
    });
    let of_faces = built.materials.iter().enumerate().filter(|(_, own)| own.only().is_none());
    let of_faces = of_faces.flat_map(|(object, own)| {
        let numbered = own.iter().enumerate();
        numbered.map(move |(index, (material, _))| (material.clone(), face_material_id(object, index)))
    });
    listed.chain(of_faces).map(|(material, id)| Ok(bsdf(&material, pictures)?.attribute("id", id))).collect()
}

/// All lights but objects, which shine as shapes.
fn lights(lights: &[&Light], pictures: &mut Pictures) -> io::Result<Vec<Element>> {
    let others = lights.iter().filter(|light| !matches!(light, Light::Object(_)));
    others.map(|light| emitter(light, pictures)).collect()
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
    let CameraSettings { origin, target, up, projection } = camera;
    let look_at = Element::new("lookat")
        .attribute("origin", triple(*origin))
        .attribute("target", triple(*target))
        .attribute("up", triple(*up));
    let middle = 0.5 * (bounds[0] + bounds[1]);
    let size = origin.distance(middle) + 0.5 * (bounds[1] - bounds[0]).length();
    let mut to_world = Element::new("transform").attribute("name", "to_world");
    let element = match projection {
        Projection::Perspective { fov, fov_axis, lens } => {
            let element = Element::plugin("sensor", if lens.is_some() { "thinlens" } else { "perspective" })
                .float("fov", *fov)
                .string("fov_axis", fov_axis.name());
            match lens {
                Some(lens) => element
                    .float("aperture_radius", lens.aperture_radius)
                    .float("focus_distance", lens.focus_distance),
                None => element,
            }
        }
        Projection::Orthographic { width } => {
            let half = format!("{:?}", 0.5 * width);
            to_world =
                to_world.child(Element::new("scale").attribute("x", half.clone()).attribute("y", half));
            Element::plugin("sensor", "orthographic")
        }
    };
    element
        .float("near_clip", CLIP[0] * size)
        .float("far_clip", CLIP[1] * size)
        .child(to_world.child(look_at))
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
            .integer("crop_height", height)
            // the filter reaches out of the crop
            .boolean("sample_border", *filter != Filter::Box);
    }
    let filter = Element::plugin("rfilter", filter.name());
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
    let layers: Vec<_> = render.aovs.iter().copied().filter_map(Aov::mitsuba_name).collect();
    if layers.is_empty() {
        return light;
    }
    Element::plugin("integrator", "aov")
        .string("aovs", &layers.join(","))
        .child(light.attribute("name", "image"))
}
