//! The triangles of the sub-polygons, before any is halved.

use glam::{DVec2, DVec3};

use super::index;
use crate::math::polygon::doubled_area;
use crate::patch::{Corner, Face, PatchPoint, Sheets, Shell};

/// Share of a mean triangle's area below which one of a fan is taken to be degenerate.
const THIN: f64 = 0.01;

/// A sub-polygon: where its triangles are evaluated.
#[derive(Clone, Debug)]
pub(super) struct Part<'a> {
    pub(super) patch: &'a Face,
    /// All faces over the same square, with curved borders between them; the first leads.
    pub(super) sheets: Sheets<'a>,
    /// Whether its triangles are on its own side of curved borders, and not on that of whichever patch is there.
    pub(super) is_side: bool,
    /// Its corners in the patch's parameters, counter-clockwise.
    pub(super) outline: &'a [DVec2],
    /// The edges of it beyond which the surface does not go on smoothly.
    pub(super) creases: Vec<[DVec2; 2]>,
    /// Index of the prepared polygon it is cut from.
    pub(super) polygon: u32,
    /// Index of the input face.
    pub(super) face: u32,
}

/// A triangle within one sub-polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    /// Index of the sub-polygon.
    pub(super) part: u32,
    pub(super) vertices: [u32; 3],
    /// The vertices in the patch's parameters.
    pub(super) st: [DVec2; 3],
    /// Whether it is known to be close enough to the surface.
    pub(super) settled: bool,
    /// Whether it has not been halved yet.
    pub(super) is_first: bool,
    /// Whether the edges 0-1, 1-2 and 2-0 are along a curved border where the surface is torn.
    pub(super) on_border: [bool; 3],
}

impl Triangle {
    /// Whether no side is a point.
    pub(super) fn has_sides(&self) -> bool {
        let [a, b, c] = self.vertices;
        a != b && b != c && c != a
    }
}

/// Triangles on the exact surface.
#[derive(Debug)]
pub(super) struct Mesh<'a> {
    pub(super) parts: Vec<Part<'a>>,
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<Triangle>,
    /// Points as close as this, with the same place on the undeformed object, are one vertex.
    pub(super) same_position: f64,
}

/// All sub-polygons as triangles that share corners.
pub(super) fn base_mesh(shell: &Shell) -> Mesh<'_> {
    let topology = shell.topology();
    let mut creases = vec![Vec::new(); topology.outlines().len()];
    for edge in topology.edges().iter().filter(|edge| !topology.is_smooth(edge)) {
        for edge_use in &edge.uses {
            creases[edge_use.outline as usize].push(edge_use.st);
        }
    }
    let parts = topology.outlines().iter().zip(creases).map(|(outline, creases)| Part {
        patch: outline.face(),
        sheets: outline.sheets,
        is_side: false,
        outline: outline.face().region.corners(&outline.trim_loop),
        creases,
        polygon: outline.trim_loop.polygon,
        face: outline.trim_loop.face,
    });
    let mut mesh = Mesh {
        parts: parts.collect(),
        positions: topology.positions().to_vec(),
        triangles: Vec::new(),
        same_position: topology.same_position(),
    };
    for (part, outline) in topology.outlines().iter().enumerate() {
        mesh.triangulate(index(part), &outline.corners);
    }
    mesh
}

impl Part<'_> {
    /// Point and partial derivatives of the surface.
    pub(super) fn eval(&self, st: DVec2) -> PatchPoint {
        if self.is_side { self.patch.eval(st) } else { self.patch.eval_whole(st) }
    }
}

impl<'a> Mesh<'a> {
    /// The patches over a triangle's rectangle.
    pub(super) fn sheets(&self, triangle: &Triangle) -> Sheets<'a> {
        self.parts[triangle.part as usize].sheets
    }

    /// The point of a sub-polygon's patch.
    pub(super) fn eval(&self, part: u32, st: DVec2) -> DVec3 {
        self.parts[part as usize].eval(st).position
    }

    /// Cuts a convex outline, which may have corners on straight edges, into triangles: a fan, or a star around its middle
    /// where every fan would have a triangle without area.
    fn triangulate(&mut self, part: u32, outline: &[Corner]) {
        let count = outline.len();
        if count < 3 {
            return;
        }
        let mut push = |corners: [Corner; 3]| {
            let (vertices, st) = (corners.map(|corner| corner.vertex), corners.map(|corner| corner.st));
            self.triangles.push(Triangle {
                part,
                vertices,
                st,
                settled: false,
                is_first: true,
                on_border: [false; 3],
            });
        };
        let corner = |i: usize| outline[i % count];
        let fan =
            |apex: usize| (1..count - 1).map(move |i| [corner(apex), corner(apex + i), corner(apex + i + 1)]);
        let least_area = |apex: usize| {
            fan(apex).map(|t| doubled_area(&t.map(|corner| corner.st))).fold(f64::INFINITY, f64::min)
        };
        let (apex, least) = (0..count)
            .map(|apex| (apex, least_area(apex)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .expect("an outline has corners");
        let st: Vec<_> = outline.iter().map(|corner| corner.st).collect();
        if count == 3 || least > THIN * doubled_area(&st) / (count - 2) as f64 {
            fan(apex).for_each(push);
            return;
        }
        let middle = st.iter().sum::<DVec2>() / count as f64;
        self.positions.push(self.parts[part as usize].patch.eval_whole(middle).position);
        let middle = Corner { vertex: index(self.positions.len() - 1), st: middle };
        for i in 0..count {
            push([middle, corner(i), corner(i + 1)]);
        }
    }
}
