//! Beside the pipeline: deformed objects as triangles, without cracks, for other programs.
//!
//! Sub-polygons are triangulated in the patches' parameters, and edges are halved until the triangles are close enough.
//! Corners are the same where the shell's vertices are, and an edge is halved in all
//! triangles that have it, so neighbours share every vertex. Where the exact surface is torn (parts outside the lattice's
//! box beside moved ones) its two sides stay apart.

mod border;
mod corners;
mod deviation;
mod refine;
#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};
use thiserror::Error;

use crate::memory::{MemoryLimit, OutOfMemory};
use crate::patch::{Facet, Shell};
use crate::trace::TracedObject;
use border::cut_along_tears;
use corners::base_mesh;
use refine::Refinement;

/// Most triangles of an object; more would take more memory than most machines have.
pub const MAX_TRIANGLES: usize = 20_000_000;

/// How fine the triangles are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fineness {
    /// Their distance from the exact surface is below this, in world units.
    Tolerance(f64),
    /// Every triangle of every sub-polygon is cut into 4 this many times.
    Level(u32),
}

/// Triangles with shared vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tessellation {
    /// Points of the exact surface.
    pub positions: Vec<DVec3>,
    /// The first vertex that is the same point of the surface, for each vertex: itself unless what is looked up there changes.
    pub first_at_point: Vec<u32>,
    /// Texture coordinates of the vertices, or none at all. Where they change at an edge the vertices are there twice.
    pub uvs: Vec<DVec2>,
    /// Unit normals for shading at the vertices, or none at all where they are the surface's own.
    pub normals: Vec<DVec3>,
    /// Indices of the vertices, counter-clockwise seen from the side of the input faces' winding.
    pub triangles: Vec<[u32; 3]>,
    /// The input face of each triangle.
    pub faces: Vec<u32>,
    /// Greatest distance found between the triangles and the exact surface, at points all over the triangles: with texture
    /// coordinates between points of the same ones, else from the surface wherever it is nearest.
    pub deviation: f64,
}

/// Why there is no tessellation.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TessellateError {
    /// It was asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// It would be too large.
    #[error(
        "more than {MAX_TRIANGLES} triangles would be needed; a larger tolerance or a lower level would do, \
         but no tolerance does for a curved surface that the border of a lattice's box tears"
    )]
    TooMany,
    /// There is too little memory.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
    /// Halving edges does not help any more.
    #[error(
        "the triangles do not come closer than {reached:.1e} to the surface; a larger tolerance would do"
    )]
    Unreachable {
        /// The distance that remains.
        reached: f64,
    },
}

/// Triangles of a deformed object. `cancel` is set by another thread to stop.
///
/// # Errors
/// If that many triangles do not fit, if rounding stands in the way of the tolerance, or on `cancel`.
pub fn tessellate(
    object: &TracedObject,
    fineness: Fineness,
    cancel: &AtomicBool,
) -> Result<Tessellation, TessellateError> {
    tessellate_within(object, fineness, cancel, MemoryLimit::NONE)
}

/// As [`tessellate`], if there is memory enough.
///
/// # Errors
/// As [`tessellate`]; also if the process would have more memory than it may.
pub fn tessellate_within(
    object: &TracedObject,
    fineness: Fineness,
    cancel: &AtomicBool,
    memory: MemoryLimit,
) -> Result<Tessellation, TessellateError> {
    let mesh = base_mesh(&object.shell);
    let has_uvs = mesh.triangles.first().is_some_and(|triangle| {
        let part = &mesh.parts[triangle.part as usize];
        object.attributes.uv(part.polygon, part.patch.chart.place(triangle.st[0])).is_finite()
    });
    let mut refinement = Refinement::new(mesh, has_uvs, (cancel, memory));
    cut_along_tears(&mut refinement)?;
    let deviation = match fineness {
        Fineness::Tolerance(tolerance) => refinement.refine_to(tolerance)?,
        Fineness::Level(level) => {
            for _ in 0..level {
                refinement.halve_all()?;
            }
            refinement.deviation()
        }
    };
    Ok(finished(object, &refinement, deviation))
}

/// Triangles in place of patches, closer to the surface than `tolerance`, and as few as that takes.
///
/// They are at rest where the patches' frames say, so that everything that is known of a place of the undeformed object is
/// known of the triangles too. `cancel` is set by another thread to stop.
///
/// # Errors
/// As [`tessellate`].
pub fn facets(shell: &Shell, tolerance: f64, cancel: &AtomicBool) -> Result<Vec<Facet>, TessellateError> {
    facets_within(shell, tolerance, cancel, MemoryLimit::NONE)
}

/// As [`facets`], if there is memory enough.
///
/// # Errors
/// As [`facets`]; also if the process would have more memory than it may.
pub fn facets_within(
    shell: &Shell,
    tolerance: f64,
    cancel: &AtomicBool,
    memory: MemoryLimit,
) -> Result<Vec<Facet>, TessellateError> {
    let mut refinement = Refinement::new(base_mesh(shell), false, (cancel, memory));
    cut_along_tears(&mut refinement)?;
    refinement.refine_to(tolerance)?;
    let mesh = &refinement.mesh;
    let facet = |triangle: &corners::Triangle| {
        let part = &mesh.parts[triangle.part as usize];
        Facet {
            polygon: part.polygon,
            face: part.face,
            rest: triangle.st.map(|st| part.patch.chart.place(st)),
            corners: triangle.vertices.map(|vertex| mesh.positions[vertex as usize]),
            vertices: triangle.vertices,
        }
    };
    Ok(mesh.triangles.iter().filter(|triangle| triangle.has_sides()).map(facet).collect())
}

/// The triangles with the attributes of their vertices, and without vertices that no triangle has.
fn finished(object: &TracedObject, refinement: &Refinement<'_>, deviation: f64) -> Tessellation {
    let mesh = &refinement.mesh;
    let uv_at = |part: u32, st: DVec2| {
        let part = &mesh.parts[part as usize];
        object.attributes.uv(part.polygon, part.patch.chart.place(st))
    };
    let normal_at = |part: u32, st: DVec2| {
        let part = &mesh.parts[part as usize];
        object.attributes.normal(part.polygon, part.patch.chart.place(st), part.patch.knot_box())
    };
    // an object has attributes if any of its corners has
    let any = |has: &dyn Fn(u32, DVec2) -> bool| {
        mesh.triangles.iter().any(|triangle| has(triangle.part, triangle.st[0]))
    };
    let has_uvs = any(&|part, st| uv_at(part, st).is_finite());
    let has_normals = any(&|part, st| normal_at(part, st).is_some());
    let mut made = Tessellation { deviation, ..Tessellation::default() };
    let mut numbers: HashMap<(u32, [u32; 5]), u32> = HashMap::new();
    let mut first_at_point: HashMap<u32, u32> = HashMap::new();
    made.triangles.reserve(mesh.triangles.len());
    // at a pole triangles have a side that is a point
    for triangle in mesh.triangles.iter().filter(|triangle| triangle.has_sides()) {
        made.faces.push(mesh.parts[triangle.part as usize].face);
        made.triangles.push([0, 1, 2].map(|corner| {
            let (vertex, st) = (triangle.vertices[corner], triangle.st[corner]);
            let uv = if has_uvs { uv_at(triangle.part, st) } else { DVec2::ZERO };
            // no reader expects NaN
            let uv = if uv.is_finite() { uv } else { DVec2::ZERO };
            let normal = if has_normals {
                let own = || mesh.parts[triangle.part as usize].eval(st).normal();
                normal_at(triangle.part, st).unwrap_or_else(own)
            } else {
                DVec3::ZERO
            };
            // single precision leaves out the rounding by which two faces differ
            let [u, v] = (uv.as_vec2() + 0.0).to_array();
            let [x, y, z] = (normal.as_vec3() + 0.0).to_array();
            *numbers.entry((vertex, [u, v, x, y, z].map(f32::to_bits))).or_insert_with(|| {
                made.positions.push(mesh.positions[vertex as usize]);
                made.uvs.extend(has_uvs.then_some(uv));
                made.normals.extend(has_normals.then_some(normal));
                let number = index(made.positions.len() - 1);
                made.first_at_point.push(*first_at_point.entry(vertex).or_insert(number));
                number
            })
        }));
    }
    made
}

fn index(n: usize) -> u32 {
    u32::try_from(n).expect("MAX_TRIANGLES keeps vertices below 2^32")
}
