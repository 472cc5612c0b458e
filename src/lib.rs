//! Ray tracing of exactly deformed shapes.
//!
//! A polygon mesh is deformed by a B-spline volume (free-form deformation), and the result is kept as trimmed (rational)
//! Bézier patches, without approximation. Rays are traced against those patches directly. The modules are the stages, and
//! each uses only those before it:
//!
//! 1. [`mesh`]: OBJ files to convex planar polygons
//! 2. [`spline`]: knot vectors, the control lattice and its edits, the volume
//! 3. [`subdivide`]: polygons cut at the knot planes, coplanar pieces grouped, each group in an affine frame
//! 4. [`patch`]: the volume composed with the frame: Bézier patches with trims
//!    [`surface`]: parametric surfaces as patches; [`analytic`]: extension functions and chains of deformations, as cells
//! 5. [`trace`]: rays against patches: acceleration structure, Bézier clipping, Newton's method
//!    [`model`]: objects, by which all of this is used: a shape, placed, deformed and represented, built to be traced
//! 6. [`film`], [`shade`], [`render`]: from hits to a picture
//!    [`difference`]: how far a picture is from another; [`deviation`]: how far triangles are from a surface
//! 7. [`scene`]: scene files; [`tessellate`], [`export`]: the exact patches or triangles for other programs
//!
//! With the feature `cli`, which is on by default, there are also `compare`, a scene by several methods; `reference_test`,
//! scenes against their references; and `report`, what was found, for people and for build servers. The program's commands
//! are in `src/cli`.
//!
//! [`prelude`] has what most programs need; `docs/library.md` has an example for each job.
//!
//! # Guarantees
//! A patch is the volume on its plane to 1e-12 of the diagonal; hits are on their ray and on the surface to 1e-11; no part
//! of a patch is left out unless its control points prove that the ray misses it.
//!
//! # Non-guarantees
//! Meshes are not repaired. A ray that lies in a flat face hits only the faces beside it; tangent rays, within rounding, may
//! count once or not at all.
//!
//! # Example
//! The unit square at mid-height of a twisted unit cube, hit from above:
//!
//! ```
//! use glam::DVec3;
//! use trimray::patch::{Deformation, PlanarPolygon, deform_polygons};
//! use trimray::spline::{Axis, ControlLattice};
//! use trimray::trace::{Geometry, NoAttributes, Ray, TracedObject, TracedScene};
//!
//! let mut lattice = ControlLattice::identity([2; 3], [4; 3], [DVec3::ZERO, DVec3::ONE], 0)?;
//! lattice.twist(Axis::Z, 90.0);
//! let volume = lattice.volume()?;
//!
//! let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.4));
//! let square = PlanarPolygon { face: 0, corners: &corners };
//! let made = deform_polygons(&[square], Deformation { volume: Some(&volume), ..Default::default() })?;
//!
//! let square = TracedObject { name: "square".into(), shell: made.shell, attributes: Box::new(NoAttributes) };
//! let scene = TracedScene::new(vec![square]);
//! let hit = scene.closest_hit(&Ray::new(DVec3::new(0.6, 0.5, 2.0), DVec3::NEG_Z)).expect("it is hit");
//! let exact = volume.eval(hit.rest).expect("inside the lattice");
//! assert!((hit.position - exact.position).length() < 1e-15);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// the commands name the library as every program does that uses it
#[cfg(feature = "cli")]
extern crate self as trimray;

/// The examples of `docs/library.md`, which the tests run.
#[cfg(doctest)]
#[doc = include_str!("../docs/library.md")]
#[derive(Debug)]
pub struct LibraryPage;

pub mod analytic;
pub mod arrays;
pub mod choice;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
#[cfg(feature = "cli")]
pub mod compare;
pub mod deviation;
pub mod difference;
pub mod export;
pub mod film;
pub mod identity;
pub mod input;
pub mod manipulate;
mod math;
pub mod memory;
pub mod mesh;
pub mod model;
pub mod output;
pub mod patch;
pub mod prelude;
pub mod random;
#[cfg(feature = "cli")]
pub mod reference_test;
pub mod render;
#[cfg(feature = "cli")]
pub mod report;
pub mod scene;
pub mod shade;
pub mod spline;
pub mod subdivide;
#[doc(hidden)]
pub mod suggestion;
pub mod surface;
pub mod tessellate;
#[cfg(test)]
mod test_support;
pub mod trace;
