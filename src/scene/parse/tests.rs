use std::path::{Path, PathBuf};

use glam::{DAffine2, DAffine3, DMat3, DVec2, DVec3};
use proptest::prelude::*;

use super::*;
use crate::film::{Aov, FilmSettings, Filter};
use crate::model::{Edit, Lattice, MoveTo, Outside, Representation};
use crate::scene::{
    DeformDescription, EditDescription, Located, Location, NamedMaterial, ObjectDescription, ObjectShape,
};
use crate::shade::light::{
    AreaLight, AreaShape, ConstantLight, DirectionalLight, EnvironmentLight, ObjectLight, PointLight,
    SpotLight,
};
use crate::shade::material::{
    CoatSource, ConductorSource, DielectricSource, DiffuseSource, GlassSource, MetalSource, PlasticSource,
    PrincipledInterface, PrincipledSource, RoughConductorSource, RoughDielectricSource, RoughPlasticSource,
    Roughness,
};
use crate::shade::{
    BitmapSource, Checkerboard, MicrofacetDistribution, PictureSource, TextureFilter, TextureSource,
    TextureWrap,
};
use crate::shade::{
    CameraSettings, FovAxis, IntegratorKind, Light, Material, Projection, RenderSettings, SamplerKind,
    ThinLens,
};
use crate::spline::{Axis, SignedAxis};
use crate::subdivide::FrameChoice;

const FULL: &str = r#"# every key that this version has
[camera]
origin = [3.0, -4.0, 2.0]
target = [0, 0, 0.5]
up     = [0.0, 0.0, 1.0]
fov = 35.0
fov_axis = "y"
aperture_radius = 0.0
focus_distance = 5.0

[film]
size = [640, 480]
filter = "box"
crop = [10, 20, 600, 400]

[render]
integrator = "direct"
spp = 1_6
max_depth = -1
rr_depth = 7
seed = 0xffff_ffff_ffff_ffff
aovs = ["depth", "position"]
hide_emitters = true

[[material]]
name = "clay"
type = "diffuse"
reflectance = [0.6, 0.5, 0.4]
two_sided = false
[[material]]
name = "grey"
type = "diffuse"
reflectance = 0.25

[[light]]
type = "constant"
radiance = 2
[[light]]
type = "point"
position = [1, 2, 3]
intensity = [4, 5, 6]
[[light]]
type = "area"
shape = "rectangle"
to_world = [{ look_at = { origin = [0, 0, 5], target = [0, 0, 0], up = [0, 1, 0] } }]
radiance = [7, 8, 9]

[[object]]
name = "cube"
mesh = "meshes/cube.obj"
material = "grey"
transform = [ { scale = 2.0 }, { rotate = { axis = [0,0,1], angle = 90 } }, { translate = [0,0,1] } ]
normals = "face"
method = "exact"
[[object.deform]]
type = "ffd"
degree = [2, 3, 1]
points = [4, 5, 6]
bounds = [[0,0,0],[1,1,1]]
outside = "error"
hold = 1
frame = "rectangle"
[[object.deform.edit]]
move = [1, 2, 3]
by = [0.0, 0.0, 0.3]
[[object.deform.edit]]
move = [2, 3, 4]
to = [1, 2, 3]
[[object.deform.edit]]
twist = { axis = "z", angle = 90.0 }
[[object.deform.edit]]
taper = { axis = "x", scale = [0.5, 2] }
[[object.deform.edit]]
bend = { axis = "y", angle = -45, toward = "-x" }
[[object.deform.edit]]
bulge = { axis = "z", amount = -0.2 }
[[object.deform.edit]]
weight = [1, 1, 1]
value = 2.0
[[object.deform.edit]]
control_points = "lattice.npy"

[[object]]
name = "plain"
mesh = "/abs/plain.obj"
"#;

fn at(line: usize, column: usize) -> Location {
    Location { line, column }
}

fn located<T>(value: T, line: usize, column: usize) -> Located<T> {
    Located { value, location: at(line, column) }
}

fn parse(text: &str) -> Result<SceneDescription, SceneError> {
    parse_scene_str(text, Path::new("scenes/a.toml"))
}

fn full_edits() -> Vec<Located<EditDescription>> {
    let index = [1, 2, 3];
    vec![
        located(
            EditDescription::Complete(Edit::Move { index, to: MoveTo::By(DVec3::new(0.0, 0.0, 0.3)) }),
            64,
            8,
        ),
        located(
            EditDescription::Complete(Edit::Move {
                index: [2, 3, 4],
                to: MoveTo::To(DVec3::new(1.0, 2.0, 3.0)),
            }),
            67,
            8,
        ),
        located(EditDescription::Complete(Edit::Twist { axis: Axis::Z, angle: 90.0 }), 70, 9),
        located(EditDescription::Complete(Edit::Taper { axis: Axis::X, scale: [0.5, 2.0] }), 72, 9),
        located(
            EditDescription::Complete(Edit::Bend {
                axis: Axis::Y,
                angle: -45.0,
                toward: SignedAxis { axis: Axis::X, negative: true },
            }),
            74,
            8,
        ),
        located(EditDescription::Complete(Edit::Bulge { axis: Axis::Z, amount: -0.2 }), 76, 9),
        located(EditDescription::Complete(Edit::Weight { index: [1, 1, 1], value: 2.0 }), 78, 10),
        located(
            EditDescription::ControlPoints { path: PathBuf::from("scenes/lattice.npy"), block: None },
            81,
            18,
        ),
    ]
}

fn full_objects() -> Vec<ObjectDescription> {
    let lattice = Lattice {
        bounds: Some([DVec3::ZERO, DVec3::ONE]),
        outside: Outside::Error,
        hold: 1,
        frame: FrameChoice::Rectangle,
        ..Lattice::new([2, 3, 1], [4, 5, 6])
    };
    let turned = DMat3::from_cols(2.0 * DVec3::Y, -2.0 * DVec3::X, 2.0 * DVec3::Z);
    vec![
        ObjectDescription {
            name: located("cube".to_owned(), 49, 8),
            shape: ObjectShape::Mesh(located(PathBuf::from("scenes/meshes/cube.obj"), 50, 8)),
            material: Some(1),
            materials: Vec::new(),
            transform: DAffine3::from_mat3_translation(turned, DVec3::Z),
            vertex_normals: false,
            method: Representation::Exact,
            deform: vec![located(DeformDescription::Lattice { lattice, edits: full_edits() }, 55, 1)],
        },
        ObjectDescription {
            name: located("plain".to_owned(), 84, 8),
            shape: ObjectShape::Mesh(located(PathBuf::from("/abs/plain.obj"), 85, 8)),
            material: None,
            materials: Vec::new(),
            transform: DAffine3::IDENTITY,
            vertex_normals: false,
            method: Representation::Exact,
            deform: Vec::new(),
        },
    ]
}

#[test]
fn a_full_scene_gives_its_values() {
    let scene = parse(FULL).unwrap();
    assert_eq!(scene.path, Path::new("scenes/a.toml"));
    assert_eq!(
        scene.camera,
        Some(CameraSettings {
            origin: DVec3::new(3.0, -4.0, 2.0),
            target: DVec3::new(0.0, 0.0, 0.5),
            up: DVec3::Z,
            projection: Projection::Perspective { fov: 35.0, fov_axis: FovAxis::Y, lens: None },
        })
    );
    assert_eq!(
        scene.film,
        FilmSettings { size: [640, 480], filter: Filter::Box, crop: Some([10, 20, 600, 400]) }
    );
    assert_eq!(
        scene.render,
        RenderSettings {
            integrator: IntegratorKind::Direct,
            sampler: SamplerKind::Independent,
            spp: 16,
            max_depth: -1,
            rr_depth: 7,
            seed: u64::MAX,
            aovs: vec![Aov::Depth, Aov::Position],
            hide_emitters: true,
        }
    );
    let diffuse = |name: &str, line, reflectance, two_sided| NamedMaterial {
        name: located(name.to_owned(), line, 8),
        material: Material::Diffuse(DiffuseSource {
            reflectance: TextureSource::from(reflectance),
            two_sided,
        }),
    };
    assert_eq!(
        scene.materials,
        [
            diffuse("clay", 26, DVec3::new(0.6, 0.5, 0.4), false),
            diffuse("grey", 31, DVec3::splat(0.25), true),
        ]
    );
    // z points down at the target, y stays up
    let down = DMat3::from_cols(-DVec3::X, DVec3::Y, -DVec3::Z);
    assert_eq!(
        lights(&scene),
        [
            Light::Constant(ConstantLight { radiance: DVec3::splat(2.0) }),
            Light::Point(PointLight {
                position: DVec3::new(1.0, 2.0, 3.0),
                intensity: DVec3::new(4.0, 5.0, 6.0)
            }),
            Light::Area(AreaLight {
                shape: AreaShape::Rectangle,
                to_world: DAffine3::from_mat3_translation(down, DVec3::new(0.0, 0.0, 5.0)),
                radiance: DVec3::new(7.0, 8.0, 9.0),
            }),
        ]
    );
    assert_eq!(scene.objects, full_objects());
    assert_eq!(
        scene.material_of(&scene.objects[1]),
        Material::default(),
        "an object without material has the default"
    );
}

/// The lights that a scene lists.
fn lights(scene: &SceneDescription) -> Vec<Light> {
    scene.lights.iter().flatten().map(|light| light.value.clone()).collect()
}

/// The materials of a scene of these tables, without their names.
fn materials(tables: &[&str]) -> Vec<Material> {
    let numbered = tables.iter().enumerate();
    let text: String =
        numbered.map(|(i, table)| format!("[[material]]\nname = \"{i}\"\n{table}\n")).collect();
    let scene = parse(&(text + "[[object]]\nname = \"a\"\nmesh = \"a.obj\"\n")).unwrap();
    scene.materials.into_iter().map(|named| named.material).collect()
}

#[test]
fn materials_have_the_defaults_of_mitsuba() {
    let types = [
        "diffuse",
        "conductor",
        "roughconductor",
        "dielectric",
        "roughdielectric",
        "plastic",
        "roughplastic",
        "principled",
    ];
    let tables = types.map(|kind| format!("type = \"{kind}\""));
    let (metal, roughness, glass, coat) =
        (MetalSource::default(), Roughness::default(), GlassSource::default(), CoatSource::default());
    assert_eq!((glass.int_ior, glass.ext_ior, coat.int_ior), (1.5046, 1.000277, 1.49));
    assert_eq!(
        materials(&tables.each_ref().map(String::as_str)),
        [
            Material::default(),
            Material::Conductor(ConductorSource { metal: metal.clone(), two_sided: true }),
            Material::RoughConductor(RoughConductorSource {
                metal,
                roughness: roughness.clone(),
                two_sided: true
            }),
            Material::Dielectric(DielectricSource { glass: glass.clone() }),
            Material::RoughDielectric(RoughDielectricSource { glass, roughness }),
            Material::Plastic(PlasticSource { coat: coat.clone(), two_sided: true }),
            Material::RoughPlastic(RoughPlasticSource {
                coat,
                distribution: MicrofacetDistribution::Beckmann,
                alpha: 0.1,
                two_sided: true
            }),
            Material::Principled(Box::default()),
        ]
    );
}

#[test]
fn materials_give_their_values() {
    let read = materials(&[
        "type = \"roughconductor\"\nmaterial = \"Au\"\ndistribution = \"ggx\"\nalpha_u = 0.2\nalpha_v = 0.3\n\
         specular_reflectance = 0.9\ntwo_sided = false",
        "type = \"conductor\"\neta = [1, 2, 3]\nk = 4",
        "type = \"roughdielectric\"\nint_ior = \"Diamond\"\next_ior = 1.2\nalpha = 0.4\n\
         specular_reflectance = 0.5\nspecular_transmittance = [1, 0, 0.5]",
        "type = \"roughplastic\"\nint_ior = 1.6\next_ior = \"water\"\ndiffuse_reflectance = 0.1\n\
         specular_reflectance = 0.2\nnonlinear = true\ndistribution = \"ggx\"\nalpha = 0.3\ntwo_sided = false",
        "type = \"principled\"\nspec_trans = 0.5\neta = 1.3",
    ]);
    let gold = MetalSource::named("Au").unwrap();
    let roughness =
        |u: f64, v: f64, distribution| Roughness { distribution, alpha_u: u.into(), alpha_v: v.into() };
    let (ggx, beckmann) = (MicrofacetDistribution::Ggx, MicrofacetDistribution::Beckmann);
    let want = [
        Material::RoughConductor(RoughConductorSource {
            metal: MetalSource { specular_reflectance: 0.9.into(), ..gold },
            roughness: roughness(0.2, 0.3, ggx),
            two_sided: false,
        }),
        Material::Conductor(ConductorSource {
            metal: MetalSource {
                eta: DVec3::new(1.0, 2.0, 3.0),
                k: DVec3::splat(4.0),
                ..MetalSource::default()
            },
            two_sided: true,
        }),
        Material::RoughDielectric(RoughDielectricSource {
            glass: GlassSource {
                int_ior: 2.419,
                ext_ior: 1.2,
                specular_reflectance: 0.5.into(),
                specular_transmittance: DVec3::new(1.0, 0.0, 0.5).into(),
            },
            roughness: roughness(0.4, 0.4, beckmann),
        }),
        Material::RoughPlastic(RoughPlasticSource {
            coat: CoatSource {
                int_ior: 1.6,
                ext_ior: 1.333,
                diffuse_reflectance: 0.1.into(),
                specular_reflectance: 0.2.into(),
                nonlinear: true,
            },
            distribution: ggx,
            alpha: 0.3,
            two_sided: false,
        }),
        Material::Principled(Box::new(PrincipledSource {
            spec_trans: 0.5.into(),
            interface: PrincipledInterface::Eta(1.3),
            two_sided: false,
            ..PrincipledSource::default()
        })),
    ];
    assert_eq!(read, want);
}

#[test]
fn each_principled_parameter_is_read() {
    let keys = [
        "base_color",
        "roughness",
        "anisotropic",
        "metallic",
        "spec_trans",
        "spec_tint",
        "sheen",
        "sheen_tint",
        "flatness",
        "clearcoat",
        "clearcoat_gloss",
    ];
    let table = keys.iter().enumerate().map(|(i, key)| format!("{key} = 0.{i:02}1\n")).collect::<String>();
    let [material] = &materials(&[&format!("type = \"principled\"\nspecular = 0.9\n{table}")])[..] else {
        panic!("one material");
    };
    let want: Vec<_> = (0..keys.len()).map(|i| TextureSource::from(i as f64 / 100.0 + 0.001)).collect();
    let off = |(got, want): (&TextureSource, &TextureSource)| match (got, want) {
        (TextureSource::Uniform(got), TextureSource::Uniform(want)) => (*got - *want).length(),
        _ => f64::INFINITY,
    };
    let worst = material.textures().into_iter().zip(&want).map(off).fold(0.0, f64::max);
    assert!(worst < 1e-15, "{material:?}");
}

#[test]
fn textures_give_their_values() {
    let read = materials(&[
        "type = \"diffuse\"\nreflectance = { texture = \"a.png\", filter = \"nearest\", wrap = \"mirror\", \
         raw = true, to_uv = [ { scale = [2, 3] }, { rotate = 90 }, { translate = [1, 0.5] }, { scale = 2 } ] }",
        "type = \"diffuse\"\nreflectance = { texture = \"/b.exr\" }",
        "type = \"diffuse\"\nreflectance = { checkerboard = {} }",
        "type = \"principled\"\nroughness = { checkerboard = { color0 = 0.1, color1 = [1, 0, 0], \
         to_uv = [ { scale = 4 } ] } }",
    ]);
    let diffuse =
        |reflectance: TextureSource| Material::Diffuse(DiffuseSource { reflectance, two_sided: true });
    // (u, v) -> (2u, 3v) -> (-3v, 2u) -> (1 - 3v, 0.5 + 2u) -> (2 - 6v, 1 + 4u)
    let to_uv = DAffine2::from_cols(DVec2::new(0.0, 4.0), DVec2::new(-6.0, 0.0), DVec2::new(2.0, 1.0));
    let board = Checkerboard {
        colours: [DVec3::splat(0.1), DVec3::X],
        to_uv: DAffine2::from_scale(DVec2::splat(4.0)),
    };
    let want = [
        diffuse(TextureSource::Bitmap(BitmapSource {
            path: "scenes/a.png".into(),
            channel: None,
            filter: TextureFilter::Nearest,
            wrap: TextureWrap::Mirror,
            raw: true,
            to_uv,
        })),
        diffuse(TextureSource::Bitmap(BitmapSource {
            path: "/b.exr".into(),
            channel: None,
            filter: TextureFilter::Bilinear,
            wrap: TextureWrap::Repeat,
            raw: false,
            to_uv: DAffine2::IDENTITY,
        })),
        diffuse(TextureSource::Checkerboard(Checkerboard::default())),
        Material::Principled(Box::new(PrincipledSource {
            roughness: TextureSource::Checkerboard(board),
            ..PrincipledSource::default()
        })),
    ];
    assert_eq!(read, want);
}

#[test]
fn all_but_objects_may_be_left_out() {
    let scene = parse("[[object]]\nname = \"a\"\nmesh = \"a.obj\"\n").unwrap();
    assert_eq!(scene.camera, None);
    assert_eq!(scene.film, FilmSettings::default());
    assert_eq!(scene.render, RenderSettings::default());
    assert_eq!(scene.lights, None);
    assert_eq!(scene.objects[0].shape.mesh(), Some(Path::new("scenes/a.obj")));
}

#[test]
fn lights_have_the_defaults_of_mitsuba() {
    let text = r#"
[[light]]
type = "envmap"
file = "sky.exr"
[[light]]
type = "directional"
[[light]]
type = "directional"
direction = [0, 0, -1e200]
irradiance = 3
[[light]]
type = "spot"
[[light]]
type = "spot"
cutoff_angle = 40
[[light]]
type = "area"
shape = "disk"
[[light]]
type = "area"
shape = "sphere"
center = [1, 2, 3]
radius = 0.5
to_world = [{ scale = 2 }]
radiance = 4
[[light]]
type = "area"
shape = "object"
object = "b"
[[object]]
name = "a"
mesh = "a.obj"
[[object]]
name = "b"
mesh = "b.obj"
"#;
    let spot = |cutoff_angle: f64| {
        Light::Spot(SpotLight {
            to_world: DAffine3::IDENTITY,
            intensity: DVec3::ONE,
            cutoff_angle,
            beam_width: 0.75 * cutoff_angle,
        })
    };
    let scene = parse(text).unwrap();
    let want = [
        Light::Envmap(EnvironmentLight {
            picture: PictureSource::File("scenes/sky.exr".into()),
            scale: 1.0,
            to_world: DAffine3::IDENTITY,
        }),
        Light::Directional(DirectionalLight { direction: DVec3::Z, irradiance: DVec3::ONE }),
        Light::Directional(DirectionalLight { direction: DVec3::NEG_Z, irradiance: DVec3::splat(3.0) }),
        spot(20.0),
        spot(40.0),
        Light::Area(AreaLight { shape: AreaShape::Disk, to_world: DAffine3::IDENTITY, radiance: DVec3::ONE }),
        Light::Area(AreaLight {
            shape: AreaShape::Sphere,
            to_world: DAffine3::from_scale_rotation_translation(
                DVec3::ONE,
                glam::DQuat::IDENTITY,
                DVec3::new(2.0, 4.0, 6.0),
            ),
            radiance: DVec3::splat(4.0),
        }),
        Light::Object(ObjectLight { object: 1, radiance: DVec3::ONE }),
    ];
    assert_eq!(lights(&scene), want);
    let places: Vec<_> = scene.lights.unwrap().iter().map(|light| light.location).take(2).collect();
    assert_eq!(
        places,
        [Location { line: 4, column: 8 }, Location { line: 5, column: 1 }],
        "its picture, itself"
    );
}

#[test]
fn the_default_lens_is_that_of_mitsuba() {
    let text =
        "[camera]\norigin = [0, 1, 0]\ntarget = [0, 0, 0]\n[[object]]\nname = \"a\"\nmesh = \"a.obj\"\n";
    let camera = parse(text).unwrap().camera.unwrap();
    let Projection::Perspective { fov, fov_axis, lens: None } = camera.projection else {
        panic!("{:?} is no pinhole", camera.projection);
    };
    assert_eq!(fov_axis, FovAxis::Diagonal);
    assert!((fov - 46.793_003).abs() < 1e-6, "got {fov}");
}

#[test]
fn cameras_of_all_kinds() {
    let camera = |keys: &str| {
        let text = format!(
            "[camera]\norigin = [0, 1, 0]\ntarget = [0, 0, 0]\n{keys}\n[[object]]\nname = \"a\"\nmesh = \"a.obj\"\n"
        );
        parse(&text).unwrap().camera.unwrap().projection
    };
    let lens = |aperture_radius, focus_distance| Projection::Perspective {
        fov: 30.0,
        fov_axis: FovAxis::X,
        lens: Some(ThinLens { aperture_radius, focus_distance }),
    };
    assert_eq!(camera("fov = 30\naperture_radius = 0.1\nfocus_distance = 3"), lens(0.1, 3.0));
    assert_eq!(camera("fov = 30\ntype = \"thinlens\"\naperture_radius = 0.2"), lens(0.2, 1e4));
    assert_eq!(camera("type = \"orthographic\"\nwidth = 2.5"), Projection::Orthographic { width: 2.5 });
}

/// Every fault by itself: scene texts, each with exactly the messages it must give.
///
/// `faults.txt` holds cases of the form `=== where the text stands`, the text, and a `-> message`
/// for each fault.
#[test]
fn each_fault_gives_its_message() {
    let object = "[[object]]\nname = \"a\"\nmesh = \"a.obj\"\n";
    let ffd = "[[object.deform]]\ntype = \"ffd\"\ndegree = [2, 2, 2]\npoints = [4, 4, 5]\n";
    let cases = include_str!("faults.txt").split("=== ").skip(1);
    let (mut count, mut wrong) = (0, String::new());
    for case in cases {
        let (place, case) = case.split_once('\n').unwrap();
        let (messages, text): (Vec<&str>, Vec<&str>) =
            case.trim_end().lines().partition(|line| line.starts_with("-> "));
        let text = text.join("\n") + "\n";
        let text = match place {
            "alone" => text,
            "before an object" => text + object,
            "in an object" => object.to_owned() + &text,
            "in an ffd" => object.to_owned() + ffd + &text,
            _ => panic!("unknown place {place:?}"),
        };
        let want: Vec<String> =
            messages.iter().map(|message| message.replacen("-> ", "scenes/a.toml:", 1)).collect();
        let got = parse(&text).err().map_or_else(String::new, |error| error.to_string());
        if got != want.join("\n") {
            wrong += &format!("scene:\n{text}gives:\n{got}\nwant:\n{}\n\n", want.join("\n"));
        }
        count += 1;
    }
    assert!(wrong.is_empty(), "{wrong}");
    assert!(count > 120, "only {count} cases were found");
}

#[test]
fn files_that_are_no_scenes_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let message = |name: &str, bytes: Option<&[u8]>| {
        let path = folder.path().join(name);
        if let Some(bytes) = bytes {
            std::fs::write(&path, bytes).unwrap();
        }
        let error = parse_scene(&path).unwrap_err().to_string();
        let prefix = path.display().to_string();
        error.strip_prefix(&prefix).unwrap().to_owned()
    };
    assert_eq!(message("", None), ": is a folder; a scene is a TOML file");
    let missing = message("missing.toml", None);
    assert!(missing.starts_with(": cannot read the scene file: No such file"), "{missing}");
    assert_eq!(
        message("binary.toml", Some(b"a = 1\n\xc3\xa9 = \xff\xfe")),
        ":2:5: is not UTF-8 text (byte 0xff); a scene is TOML in UTF-8"
    );
    assert_eq!(
        message("cut.toml", Some(b"a = \"\xc3")),
        ":1:6: is not UTF-8 text (byte 0xc3); a scene is TOML in UTF-8"
    );
    assert_eq!(
        message("zero.toml", Some(b"a = \0")),
        ":1:5: is not text (a zero byte); a scene is TOML in UTF-8"
    );
    let lines: String = (0..1000).map(|line| format!("v {line} 0 0\n")).collect();
    let other = message("mesh.obj", Some(lines.as_bytes()));
    assert_eq!(other.lines().count(), MAX_TOML_FAULTS + 1);
    assert!(other.ends_with("more than 20 faults in the TOML; is it a scene?"));
}

#[test]
fn deep_nesting_does_not_exhaust_the_stack() {
    let key = vec!["a"; 200_000].join(".");
    for text in [
        format!("{key} = 1"),
        format!("[{key}]"),
        format!("b = {{ {key} = 1 }}"),
        format!("{} = 1", vec!["a"; MAX_KEY_PARTS].join(".")),
        format!("a = {}", "[".repeat(100_000)),
        format!("a = {}", "{a=".repeat(100_000)),
    ] {
        assert!(parse(&text).is_err());
    }
}

#[test]
fn a_byte_order_mark_and_line_ends_of_windows_are_no_faults() {
    let text = format!("\u{feff}{}", FULL.replace('\n', "\r\n"));
    assert_eq!(parse(&text), parse(FULL));
}

proptest! {
    #[test]
    fn any_bytes_are_read_without_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, bytes).unwrap();
        if let Err(error) = parse_scene(&path) {
            prop_assert!(!error.diagnostics.is_empty());
        }
    }

    #[test]
    fn any_text_is_read_without_panic(text in "(?s)[\\[\\]{}=\"'.,#\\n a-z0-9é-]{0,200}") {
        if let Err(error) = parse(&text) {
            prop_assert!(!error.diagnostics.is_empty());
        }
    }

    #[test]
    fn any_damage_is_read_without_panic(
        start in 0..FULL.len(),
        length in 0_usize..40,
        put in prop::sample::select(vec![
            "", "\"", "[", "]", "{", "}", "=", ".", "\n", "[[object]]", "nan", "-inf", "-1", "0",
            "1e999", "99999999999999999999999999999999999999999999", "[]", "{}", "1979-05-27", "é\0", "\u{feff}",
        ]),
    ) {
        let mut text = FULL.to_owned();
        text.replace_range(start..(start + length).min(FULL.len()), put);
        if let Err(error) = parse(&text) {
            prop_assert!(!error.diagnostics.is_empty());
        }
    }
}
