//! `[[light]]`.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

use crate::math::linear::similarity_scale;
use crate::scene::description::LightDescription;
use crate::scene::diagnostic::Location;
use crate::scene::names::{did_you_mean, quoted};
use crate::scene::reader::{Table, Value};
use crate::scene::transform;
use crate::scene::unavailable::{self, TEXTURES};
use crate::shade::Light;

const TYPES: &[&str] = &["constant", "envmap", "point", "directional", "spot", "area"];
const SHAPES: &[&str] = &["rectangle", "disk", "sphere", "object"];

/// Every key of any light, for one that does not say which it is.
const ALL_KEYS: &[&str] = &[
    "type",
    "radiance",
    "intensity",
    "irradiance",
    "position",
    "direction",
    "file",
    "scale",
    "cutoff_angle",
    "beam_width",
    "shape",
    "to_world",
    "center",
    "radius",
    "object",
];

/// What lights have in common.
struct Lights<'a> {
    /// The names of the scene's objects.
    objects: &'a [String],
    /// Where the light stands that surrounds the scene.
    environment: Option<Location>,
    /// Where the light stands that an object is.
    shining: HashMap<usize, Location>,
}

/// Reads and checks all lights of a scene whose objects have these names.
pub(super) fn read_all(tables: Vec<Table<'_>>, objects: &[String]) -> Vec<LightDescription> {
    let mut lights = Lights { objects, environment: None, shining: HashMap::new() };
    tables.into_iter().filter_map(|table| lights.read(table)).collect()
}

impl Lights<'_> {
    fn read(&mut self, mut table: Table<'_>) -> Option<LightDescription> {
        if !table.has("type") {
            table.check_keys(ALL_KEYS);
        }
        let light = match table.required_name("type", "light type", TYPES)? {
            "envmap" => return self.read_envmap(table),
            "constant" => {
                table.check_keys(&["type", "radiance"]);
                self.surround(&table);
                Some(Light::Constant { radiance: emission(&table, "radiance") })
            }
            "point" => {
                table.check_keys(&["type", "position", "intensity"]);
                let position = table.required("position", PLACE, Value::vector);
                let intensity = emission(&table, "intensity");
                position.map(|position| Light::Point { position, intensity })
            }
            "directional" => read_directional(table),
            "spot" => read_spot(table),
            _ => self.read_area(table),
        };
        light.map(LightDescription::Complete)
    }

    /// Notes that a light surrounds the scene.
    fn surround(&mut self, table: &Table<'_>) {
        if let Some(Location { line, .. }) = self.environment {
            let message = "a scene has one light around it, constant or envmap; the first is in line";
            table.report_value("type", format!("{message} {line}"));
        }
        self.environment = self.environment.or(Some(table.location()));
    }

    fn read_envmap(&mut self, mut table: Table<'_>) -> Option<LightDescription> {
        table.check_keys(&["type", "file", "scale", "to_world"]);
        self.surround(&table);
        let expected = "the path of a picture (.exr, .hdr), from the scene file's folder";
        let file = table.required_located("file", expected, Value::path);
        let scale =
            table.optional("scale", "a number, at least 0", |value| value.number_where(|scale| scale >= 0.0));
        let to_world = transform::read(&table, "to_world");
        let turns = |place: &DAffine3| {
            similarity_scale(&place.matrix3).is_some_and(|scale| (scale - 1.0).abs() < 1e-9)
        };
        if to_world.is_some_and(|place| !turns(&place)) {
            let message = "to_world of an envmap turns it: steps that scale have no meaning";
            table.report_value("to_world", message.to_owned());
        }
        Some(LightDescription::Envmap { file: file?, scale: scale.unwrap_or(1.0), to_world: to_world? })
    }

    fn read_area(&mut self, mut table: Table<'_>) -> Option<Light> {
        if !table.has("shape") {
            table.check_keys(&["type", "shape", "to_world", "radiance", "center", "radius", "object"]);
        }
        let shape = table.required_name("shape", "light shape", SHAPES);
        match shape {
            Some("sphere") => {
                table.check_keys(&["type", "shape", "to_world", "center", "radius", "radiance"])
            }
            Some("object") => table.check_keys(&["type", "shape", "object", "radiance"]),
            Some(_) => table.check_keys(&["type", "shape", "to_world", "radiance"]),
            None => {}
        }
        let radiance = emission(&table, "radiance");
        if shape == Some("object") {
            return Some(Light::Object { object: self.read_object(&table)?, radiance });
        }
        let to_world = transform::read(&table, "to_world");
        match shape? {
            "sphere" => Some(Light::Sphere { to_world: read_sphere(&table, to_world)?, radiance }),
            "disk" => Some(Light::Disk { to_world: to_world?, radiance }),
            _ => Some(Light::Rectangle { to_world: to_world?, radiance }),
        }
    }

    /// Index of the object that shines.
    fn read_object(&mut self, table: &Table<'_>) -> Option<usize> {
        let name = table.required("object", "the name of an [[object]]", Value::filled_text)?;
        let Some(index) = self.objects.iter().position(|known| known == name) else {
            let known: Vec<&str> =
                self.objects.iter().map(String::as_str).filter(|name| !name.is_empty()).collect();
            let (list, suggestion) = (known.join(", "), did_you_mean(name, &known));
            let message = format!("unknown object {} (known: {list}){suggestion}", quoted(name));
            table.report_value("object", message);
            return None;
        };
        if let Some(Location { line, .. }) = self.shining.get(&index) {
            let message = format!("object {} shines already, by the light in line {line}", quoted(name));
            table.report_value("object", message);
        } else {
            self.shining.insert(index, table.location());
        }
        Some(index)
    }
}

const PLACE: &str = "a point [x, y, z] of finite numbers";

fn read_directional(mut table: Table<'_>) -> Option<Light> {
    table.check_keys(&["type", "direction", "to_world", "irradiance"]);
    let irradiance = emission(&table, "irradiance");
    if table.has("direction") && table.has("to_world") {
        let message = "a directional light has direction or to_world, not both";
        table.report_key("to_world", message.to_owned());
    }
    if !table.has("direction") {
        let to_world = transform::read(&table, "to_world")?;
        let direction = transform::direction(to_world.matrix3.z_axis)?;
        return Some(Light::Directional { direction, irradiance });
    }
    let expected = "[x, y, z] of finite numbers, not all 0";
    let unit = |value: Value<'_>| value.vector().map(transform::direction);
    let direction = table.optional("direction", expected, unit)?;
    if direction.is_none() {
        table.report_value("direction", "direction must not be [0, 0, 0]".to_owned());
    }
    Some(Light::Directional { direction: direction?, irradiance })
}

fn read_spot(mut table: Table<'_>) -> Option<Light> {
    table.check_keys(&["type", "to_world", "intensity", "cutoff_angle", "beam_width"]);
    let to_world = transform::read(&table, "to_world");
    let intensity = emission(&table, "intensity");
    let cutoff_angle = table
        .optional("cutoff_angle", "degrees above 0, up to 180", |value| {
            value.number_where(|angle| angle > 0.0 && angle <= 180.0)
        })
        .unwrap_or(20.0);
    let beam_width = table
        .optional("beam_width", "degrees from 0 up to cutoff_angle", |value| {
            value.number_where(|angle| (0.0..=cutoff_angle).contains(&angle))
        })
        .unwrap_or(0.75 * cutoff_angle);
    Some(Light::Spot { to_world: to_world?, intensity, cutoff_angle, beam_width })
}

/// The place of the unit sphere: first `radius`, then `center`, then `to_world`, as in Mitsuba.
fn read_sphere(table: &Table<'_>, to_world: Option<DAffine3>) -> Option<DAffine3> {
    let center = table.optional("center", PLACE, Value::vector).unwrap_or(DVec3::ZERO);
    let expected = "a number above 0";
    let radius = table.optional("radius", expected, |value| value.number_where(|radius| radius > 0.0));
    let to_world = to_world?;
    if similarity_scale(&to_world.matrix3).is_none() {
        let message = "to_world of a sphere must scale all axes alike: only disks become ellipses";
        table.report_value("to_world", message.to_owned());
        return None;
    }
    let unit = DAffine3::from_translation(center) * DAffine3::from_scale(DVec3::splat(radius.unwrap_or(1.0)));
    Some(to_world * unit)
}

/// What a light emits, 1 if it is left out; textures are refused by name.
fn emission(table: &Table<'_>, key: &str) -> DVec3 {
    let expected = "a number or [r, g, b], each at least 0";
    let texture = table.value(key).and_then(|value| value.table("a texture").ok());
    if let Some(texture) = texture
        && let Some(kind) = TEXTURES.iter().find(|kind| texture.has(kind))
    {
        table.report_value(key, unavailable::message(&format!("{kind:?}"), expected));
        return DVec3::ONE;
    }
    table.optional(key, expected, |value| value.rgb(|value| value >= 0.0)).unwrap_or(DVec3::ONE)
}
