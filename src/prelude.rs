//! What most programs need: from a file or a lattice to a picture.
//!
//! ```
//! use trimray::prelude::*;
//!
//! let text = "[[object]]\nname = \"ball\"\nsurface = { type = \"sphere\", radius = 1.0 }\n";
//! let scene = parse_scene_str(text, "ball.toml".as_ref())?.build()?;
//! assert_eq!(scene.traced.objects().len(), 1);
//! # Ok::<(), SceneError>(())
//! ```

pub use crate::difference::{CompareSettings, compare};
pub use crate::film::{read_layers, write_png};
pub use crate::manipulate::DirectManipulation;
pub use crate::mesh::{PolygonMesh, load_mesh, load_obj};
pub use crate::render::{RenderControl, render};
pub use crate::scene::{BuiltScene, SceneDescription, SceneError, parse_scene, parse_scene_str};
pub use crate::shade::Camera;
pub use crate::spline::{Axis, ControlLattice, SplineVolume};
pub use crate::surface::SplineSurface;
pub use crate::tessellate::{Fineness, tessellate};
pub use crate::trace::Ray;
