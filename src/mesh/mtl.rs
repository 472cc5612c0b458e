//! Material libraries of OBJ files (`.mtl`).
//!
//! Source: Wavefront (1995), *Advanced Visualizer Manual*, appendix B2; of later additions only what is named here.

use std::io;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::obj_words::{Token, for_each_statement, joined};
use crate::input::read_whole;

/// A material as the library gives it; colours are numbers of any kind, for the format says nothing of their space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MtlMaterial {
    /// Its name.
    pub name: String,
    /// `Kd`: the diffuse colour.
    pub diffuse: Option<DVec3>,
    /// `Ks`: the specular colour.
    pub specular: Option<DVec3>,
    /// `Ns`: the exponent of Phong's lobe.
    pub exponent: Option<f64>,
    /// `Ke`: what it emits.
    pub emission: Option<DVec3>,
    /// `d`, or 1 - `Tr`: 1 is opaque.
    pub opacity: Option<f64>,
    /// `Ni`: the index of refraction.
    pub refraction: Option<f64>,
    /// `map_Kd`: the picture of the diffuse colour, on the path of the library's folder.
    pub diffuse_picture: Option<PathBuf>,
}

/// Reads the materials of a library; statements that are not of [`MtlMaterial`], or cannot be read, are left out.
///
/// # Errors
/// If the file cannot be read.
pub fn load_mtl(path: &Path) -> io::Result<Vec<MtlMaterial>> {
    let bytes = read_whole(path)?;
    Ok(parse_mtl(&String::from_utf8_lossy(&bytes), path.parent().unwrap_or(Path::new(""))))
}

fn parse_mtl(text: &str, folder: &Path) -> Vec<MtlMaterial> {
    let mut materials: Vec<MtlMaterial> = Vec::new();
    for_each_statement(text, |statement| {
        let Some((keyword, values)) = statement.split_first() else { return };
        if keyword.text == "newmtl" {
            materials.push(MtlMaterial { name: joined(values), ..MtlMaterial::default() });
            return;
        }
        let Some(material) = materials.last_mut() else { return };
        match keyword.text {
            "Kd" => material.diffuse = colour(values),
            "Ks" => material.specular = colour(values),
            "Ke" => material.emission = colour(values),
            "Ns" => material.exponent = number(values),
            "Ni" => material.refraction = number(values),
            "d" => material.opacity = number(values),
            "Tr" => material.opacity = number(values).map(|transparency| 1.0 - transparency),
            "map_Kd" => {
                let name = joined(without_options(values));
                // as programs on Windows write it
                let name = name.replace('\\', "/");
                material.diffuse_picture = (!name.is_empty()).then(|| folder.join(name));
            }
            _ => {}
        }
    });
    materials
}

/// Three numbers from 0 on, or one for all.
fn colour(values: &[Token<'_>]) -> Option<DVec3> {
    let numbers: Vec<f64> = values.iter().map_while(|token| token.text.parse().ok()).collect();
    let colour = match *numbers {
        [grey] => DVec3::splat(grey),
        [r, g, b, ..] => DVec3::new(r, g, b),
        _ => return None,
    };
    (colour.is_finite() && colour.min_element() >= 0.0).then_some(colour)
}

fn number(values: &[Token<'_>]) -> Option<f64> {
    // `d -halo 0.5`
    values.iter().find_map(|token| token.text.parse().ok()).filter(|number: &f64| number.is_finite())
}

/// A texture's words without its options and their values.
fn without_options<'a, 't>(mut values: &'a [Token<'t>]) -> &'a [Token<'t>] {
    while let Some((option, rest)) = values.split_first().filter(|(first, _)| first.text.starts_with('-')) {
        let count = match option.text {
            "-o" | "-s" | "-t" => {
                rest.iter().take(3).take_while(|token| token.text.parse::<f64>().is_ok()).count()
            }
            "-mm" => 2,
            _ => 1,
        };
        values = &rest[count.min(rest.len())..];
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_renderers_use_is_read() {
        let text = "# all\nKd 1 1 1\nnewmtl red clay\nKd 0.8 0.1 0.1 # bright\nKs 0.5\nNs 30\nd 0.5\nillum 2\nmap_Kd -s 2 2 1 -clamp on tex\\wood 1.png\n\
                    newmtl lamp\nKe 5 5 4\nTr 0.25\nKd nan 0 0\nnewmtl\nd -halo 0.7\nKs -1 0 0\nmap_Kd -o 1\n";
        let materials = parse_mtl(text, Path::new("lib"));
        assert_eq!(
            materials,
            [
                MtlMaterial {
                    name: "red clay".into(),
                    diffuse: Some(DVec3::new(0.8, 0.1, 0.1)),
                    specular: Some(DVec3::splat(0.5)),
                    exponent: Some(30.0),
                    opacity: Some(0.5),
                    diffuse_picture: Some("lib/tex/wood 1.png".into()),
                    ..MtlMaterial::default()
                },
                MtlMaterial {
                    name: "lamp".into(),
                    emission: Some(DVec3::new(5.0, 5.0, 4.0)),
                    opacity: Some(0.75),
                    ..MtlMaterial::default()
                },
                MtlMaterial { opacity: Some(0.7), ..MtlMaterial::default() },
            ]
        );
    }
}
