//! Writes the models of the scenes that ship into `scenes/meshes`: `cargo run --release --example models`.
//!
//! All are closed and wind counter-clockwise seen from outside, with planar faces; those of the published figures are
//! triangles, as many as Table 2 of Feng et al. (2002) gives for the figure.

mod feng;
mod gallery;
mod solid;

use std::path::Path;
use std::{error, fs};

use solid::Solid;

fn main() -> Result<(), Box<dyn error::Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/meshes");
    fs::create_dir_all(&folder)?;
    let closed = [
        ("feng_fig07_cube", feng::cube(), Some(12)),
        ("feng_fig08_star", feng::star(), Some(56)),
        ("feng_fig09_letters", feng::letters(), Some(200)),
        ("feng_fig10_castle", feng::castle(), Some(260)),
        ("feng_fig11_bridge", feng::bridge(), Some(178)),
        ("feng_fig12_knot", feng::knot(), Some(96)),
        ("feng_fig13_fish", feng::fish(), Some(956)),
        ("gallery_tower", gallery::tower(), None),
        ("gallery_town", gallery::town(), None),
        ("gallery_word", gallery::word(), None),
    ];
    for (name, solid, triangles) in closed {
        solid.check_closed(name, triangles);
        save(&folder, name, &solid)?;
    }
    save(&folder, "ground", &ground())
}

fn save(folder: &Path, name: &str, solid: &Solid) -> Result<(), Box<dyn error::Error>> {
    fs::write(folder.join(name).with_extension("obj"), solid.to_obj(name))?;
    println!("{name}: {} faces, {} triangles", solid.face_count(), solid.triangle_count());
    Ok(())
}

/// One square of side 2 in the plane z = 0; scenes scale it.
fn ground() -> Solid {
    let mut solid = Solid::default();
    solid.face(&[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| [x, y, 0.0].into()));
    solid
}
