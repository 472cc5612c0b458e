//! The exact patches as JSON.

use std::io;

use glam::{DVec3, DVec4};
use serde::Serialize;
use serde_json::ser::{CompactFormatter, Formatter, Serializer};

use crate::model::BuiltLattice;
use crate::patch::Face;
use crate::scene::BuiltScene;
use crate::spline::SplineVolume;

/// What is serialized is made piece by piece, so that only one patch at a time is in memory as JSON has it.
#[derive(Serialize)]
struct Document<'a> {
    #[serde(serialize_with = "objects")]
    objects: &'a BuiltScene,
}

#[derive(Serialize)]
struct Object<'a> {
    name: &'a str,
    #[serde(serialize_with = "volumes")]
    volumes: &'a [BuiltLattice],
    #[serde(serialize_with = "patches")]
    patches: &'a [Face],
}

fn objects<S: serde::Serializer>(scene: &BuiltScene, serializer: S) -> Result<S::Ok, S::Error> {
    let pairs = scene.traced.objects().iter().zip(&scene.objects);
    serializer.collect_seq(pairs.map(|(traced, built)| Object {
        name: &traced.name,
        volumes: &built.lattices,
        patches: traced.faces(),
    }))
}

fn volumes<S: serde::Serializer>(lattices: &[BuiltLattice], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(lattices.iter().map(|lattice| volume(&lattice.volume)))
}

fn patches<S: serde::Serializer>(faces: &[Face], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(faces.iter().map(patch))
}

#[derive(Debug, Serialize)]
struct Volume {
    degree: [usize; 3],
    points: [usize; 3],
    knots: Vec<Vec<f64>>,
    control_points: Vec<[f64; 4]>,
    bounds: [[f64; 3]; 2],
}

#[derive(Debug, Serialize)]
struct Patch {
    cell: Option<[usize; 3]>,
    degree: [usize; 2],
    control_points: Vec<[f64; 4]>,
    frame: FrameVectors,
    trim: Vec<Loop>,
    /// How far the patch may be from the surface that it stands for, if it does.
    #[serde(skip_serializing_if = "Option::is_none")]
    certified_error: Option<f64>,
    /// Whether it has borders that are curves, which the loops do not show.
    #[serde(skip_serializing_if = "Option::is_none")]
    curved_borders: Option<bool>,
}

#[derive(Debug, Serialize)]
struct FrameVectors {
    origin: [f64; 3],
    s: [f64; 3],
    t: [f64; 3],
}

#[derive(Debug, Serialize)]
struct Loop {
    face: u32,
    #[serde(rename = "loop")]
    corners: Vec<[f64; 2]>,
}

/// All volumes and patches of a scene: `{ "objects": [{ "name", "volumes", "patches" }] }`.
///
/// Control points are Cartesian with the weight as fourth component; numbers have 17 significant digits, which read
/// back to the same doubles.
///
/// # Errors
/// None in practice: the document is finite and written to memory.
pub fn exact_patches(scene: &BuiltScene) -> io::Result<Vec<u8>> {
    to_json(&Document { objects: scene })
}

/// Writes what [`exact_patches`] gives, without having all of it in memory.
///
/// # Errors
/// If the file cannot be written.
pub fn write_exact_patches(scene: &BuiltScene, file: &mut dyn io::Write) -> io::Result<()> {
    write_json(&Document { objects: scene }, file)
}

fn volume(volume: &SplineVolume) -> Volume {
    Volume {
        degree: volume.degree(),
        points: volume.points(),
        knots: volume.axes().iter().map(|axis| axis.knots().to_vec()).collect(),
        control_points: volume.control_points().iter().map(DVec4::to_array).collect(),
        bounds: volume.bounds().map(|corner| corner.to_array()),
    }
}

fn patch(trimmed: &Face) -> Patch {
    let [origin, s, t] = trimmed.chart.coordinates().map(|vector| vector.to_array());
    Patch {
        cell: trimmed.knot_box(),
        degree: trimmed.patch.degree(),
        control_points: trimmed
            .patch
            .control_points()
            .map(|point| ((point.truncate() / point.w) + DVec3::ZERO).extend(point.w).to_array())
            .collect(),
        frame: FrameVectors { origin, s, t },
        trim: trimmed
            .region
            .loops()
            .map(|l| Loop {
                face: l.face,
                corners: trimmed.region.corners(&l).iter().map(|corner| corner.to_array()).collect(),
            })
            .collect(),
        certified_error: trimmed.exact.as_ref().map(|exact| exact.error()),
        curved_borders: trimmed.exact.as_ref().map(|exact| exact.has_borders()),
    }
}

/// JSON with every number at 17 significant digits.
///
/// # Errors
/// If serialising fails.
pub fn to_json(value: &impl Serialize) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    write_json(value, &mut bytes)?;
    Ok(bytes)
}

fn write_json(value: &impl Serialize, mut file: impl io::Write) -> io::Result<()> {
    value.serialize(&mut Serializer::with_formatter(&mut file, FullPrecision))?;
    file.write_all(b"\n")
}

struct FullPrecision;

impl Formatter for FullPrecision {
    fn write_f64<W: ?Sized + io::Write>(&mut self, writer: &mut W, value: f64) -> io::Result<()> {
        if value == value.trunc() && value.abs() < 1e15 {
            // whole numbers are exact in fewer digits
            return CompactFormatter.write_f64(writer, value);
        }
        write!(writer, "{value:.16e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_to_the_bit() {
        let values = [0.1, -1.0 / 3.0, 1e-300, 123_456.789, 5e-324, 2.0, -0.0, 1e22];
        let text = to_json(&values).unwrap();
        let back: Vec<f64> = serde_json::from_slice(&text).unwrap();
        assert_eq!(back.map_bits(), values.to_vec().map_bits(), "{}", String::from_utf8_lossy(&text));
    }

    trait Bits {
        fn map_bits(&self) -> Vec<u64>;
    }

    impl Bits for Vec<f64> {
        fn map_bits(&self) -> Vec<u64> {
            self.iter().map(|x| x.to_bits()).collect()
        }
    }
}
