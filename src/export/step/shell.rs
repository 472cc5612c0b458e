//! Faces, edges and vertices of one object.
//!
//! Source: ISO 10303-42 (topology and geometry).

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::patch::{BezierCurve, Edge, EdgeUse, Face, FaceBounds, Joint, Topology};

use super::entity::{Entities, Id, List, Quoted, Real};

/// What is written of a shell's faces, and what of it is written already.
pub(super) struct ShellWriter<'a> {
    pub(super) entities: &'a mut Entities,
    pub(super) topology: &'a Topology<'a>,
    pub(super) bounds: &'a [FaceBounds],
    /// The context of curves in parameters.
    parameter_space: Id,
    /// The surface of the face that begins with an outline.
    surfaces: HashMap<u32, Id>,
    /// The greatest degree of a curve so far.
    pub(super) curve_degree: usize,
}

/// A line in a plane or a curve on a patch.
enum EdgeGeometry {
    Line,
    Curve(BezierCurve),
}

impl<'a> ShellWriter<'a> {
    pub(super) fn new(
        entities: &'a mut Entities,
        topology: &'a Topology<'a>,
        bounds: &'a [FaceBounds],
        parameter_space: Id,
    ) -> Self {
        Self { entities, topology, bounds, parameter_space, surfaces: HashMap::new(), curve_degree: 1 }
    }

    /// Writes the faces of one component, with joints and vertices of its own; those of a component that is inside out are turned
    /// around.
    pub(super) fn faces<'n>(
        &mut self,
        faces: &[u32],
        joints: &[&Joint],
        is_turned: bool,
        name: impl Fn(u32) -> Option<&'n str>,
    ) -> Vec<Id> {
        let mut vertices = HashMap::new();
        let mut edges: HashMap<(u32, u32), (Id, bool)> = HashMap::new();
        for joint in joints {
            let (id, is_forward) = self.edge(joint, &mut vertices);
            for (bound_use, is_forward) in joint.uses.iter().zip(is_forward) {
                edges.insert((bound_use.face, bound_use.position), (id, is_forward));
            }
        }
        faces.iter().map(|&face| self.face(face, &edges, is_turned, name(face).unwrap_or_default())).collect()
    }

    fn face(
        &mut self,
        face: u32,
        edges: &HashMap<(u32, u32), (Id, bool)>,
        is_turned: bool,
        name: &str,
    ) -> Id {
        let all: &'a [FaceBounds] = self.bounds;
        let bounds = &all[face as usize];
        let mut position = 0;
        let mut written = Vec::new();
        for (number, bound) in std::iter::once(&bounds.outer).chain(&bounds.holes).enumerate() {
            let mut oriented = Vec::with_capacity(bound.len());
            for _ in bound {
                let (edge, is_forward) = edges[&(face, position)];
                let forward = truth(is_forward);
                oriented.push(self.entities.add(format_args!("ORIENTED_EDGE('',*,*,{edge},{forward})")));
                position += 1;
            }
            let edge_loop = self.entities.add(format_args!("EDGE_LOOP('',{})", List(&oriented)));
            let kind = if number == 0 { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
            let sense = truth(!is_turned);
            written.push(self.entities.add(format_args!("{kind}('',{edge_loop},{sense})")));
        }
        let surface = self.surface(bounds.outline);
        let sense = truth(!is_turned);
        self.entities.add(format_args!(
            "ADVANCED_FACE({},{},{surface},{sense})",
            Quoted(name),
            List(&written)
        ))
    }

    /// Writes an edge; returns too whether each of its uses runs along it.
    fn edge(&mut self, joint: &Joint, vertices: &mut HashMap<u32, Id>) -> (Id, Vec<bool>) {
        let topology: &'a Topology<'a> = self.topology;
        let all: &'a [FaceBounds] = self.bounds;
        let edge: &Edge = &topology.edges()[joint.edge as usize];
        // the faces, and the edge's ends in the parameters of each
        let mut uses = Vec::with_capacity(2);
        for bound_use in &joint.uses {
            let bounds = &all[bound_use.face as usize];
            let oriented = bounds.edges().nth(bound_use.position as usize);
            let oriented = oriented.expect("the position is one of the face's edges");
            let [from, to] = oriented.st;
            let ends = if oriented.is_reversed { [to, from] } else { [from, to] };
            uses.push((bounds.outline, ends, !oriented.is_reversed));
        }
        let [start, end] = edge.vertices.map(|vertex| self.vertex(vertex, vertices));
        let curve = match self.geometry(edge) {
            EdgeGeometry::Line => {
                let [from, to] = edge.vertices.map(|vertex| topology.positions()[vertex as usize]);
                self.line(from, to)
            }
            EdgeGeometry::Curve(curve) => {
                self.curve_degree = self.curve_degree.max(curve.degree());
                let in_space = self.curve(&curve);
                let mut on_surfaces = Vec::with_capacity(2);
                for &(outline, ends, _) in &uses {
                    on_surfaces.push(self.parameter_curve(outline, ends));
                }
                let on_surfaces = List(&on_surfaces);
                self.entities.add(format_args!("SURFACE_CURVE('',{in_space},{on_surfaces},.CURVE_3D.)"))
            }
        };
        let id = self.entities.add(format_args!("EDGE_CURVE('',{start},{end},{curve},.T.)"));
        (id, uses.iter().map(|&(_, _, is_forward)| is_forward).collect())
    }

    /// The curve of the face that had the edge first; between planes a line.
    fn geometry(&self, edge: &Edge) -> EdgeGeometry {
        let face = |edge_use: &EdgeUse| self.topology.outlines()[edge_use.outline as usize].face();
        if edge.uses.iter().all(|edge_use| is_plane(face(edge_use))) {
            return EdgeGeometry::Line;
        }
        // a patch rather than a plane, whose lines have the same points
        let first = &edge.uses[0];
        EdgeGeometry::Curve(face(first).patch.curve(first.st))
    }

    fn vertex(&mut self, vertex: u32, known: &mut HashMap<u32, Id>) -> Id {
        let place = self.topology.positions()[vertex as usize];
        *known.entry(vertex).or_insert_with(|| {
            let point = self.entities.point(place);
            self.entities.add(format_args!("VERTEX_POINT('',{point})"))
        })
    }

    fn line(&mut self, from: DVec3, to: DVec3) -> Id {
        let origin = self.entities.point(from);
        let length = from.distance(to);
        let direction = self.entities.direction((to - from) / length);
        let vector = self.entities.add(format_args!("VECTOR('',{direction},{})", Real(length)));
        self.entities.add(format_args!("LINE('',{origin},{vector})"))
    }

    fn curve(&mut self, curve: &BezierCurve) -> Id {
        let degree = curve.degree();
        let points: Vec<Id> =
            curve.control_points().map(|point| self.entities.point(point.truncate())).collect();
        let points = List(&points);
        let ends = degree + 1;
        let knots = format_args!("({ends},{ends}),(0.,1.),.UNSPECIFIED.").to_string();
        if curve.is_rational() {
            let greatest = curve.control_points().map(|point| point.w).fold(0.0, f64::max);
            let weights: Vec<_> = curve.control_points().map(|point| Real(point.w / greatest)).collect();
            self.entities.add(format_args!(
                "(BOUNDED_CURVE()B_SPLINE_CURVE({degree},{points},.UNSPECIFIED.,.F.,.F.)B_SPLINE_CURVE_WITH_KNOTS({knots})CURVE()\
                 GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_CURVE({})REPRESENTATION_ITEM(''))",
                List(&weights)
            ))
        } else {
            self.entities.add(format_args!(
                "B_SPLINE_CURVE_WITH_KNOTS('',{degree},{points},.UNSPECIFIED.,.F.,.F.,{knots})"
            ))
        }
    }

    /// The straight line in a surface's parameters, with the parameter of the curve in space.
    fn parameter_curve(&mut self, outline: u32, ends: [DVec2; 2]) -> Id {
        let face = self.topology.outlines()[outline as usize].face();
        let ends = match parallelogram(face) {
            Some(plane) => ends.map(|st| plane_parameters(plane, st)),
            None => ends,
        };
        let points = ends.map(|st| self.entities.parameters(st));
        let points = List(&points);
        let line = self.entities.add(format_args!(
            "B_SPLINE_CURVE_WITH_KNOTS('',1,{points},.UNSPECIFIED.,.F.,.F.,(2,2),(0.,1.),.UNSPECIFIED.)"
        ));
        let space = self.parameter_space;
        let representation =
            self.entities.add(format_args!("DEFINITIONAL_REPRESENTATION('',({line}),{space})"));
        let surface = self.surface(outline);
        self.entities.add(format_args!("PCURVE('',{surface},{representation})"))
    }

    fn surface(&mut self, outline: u32) -> Id {
        if let Some(&known) = self.surfaces.get(&outline) {
            return known;
        }
        let face = self.topology.outlines()[outline as usize].face();
        let id = match parallelogram(face) {
            Some(plane) => self.plane(plane),
            None => self.patch(face),
        };
        self.surfaces.insert(outline, id);
        id
    }

    fn plane(&mut self, [origin, s, t]: [DVec3; 3]) -> Id {
        let [x, z] = plane_axes([s, t]);
        let origin = self.entities.point(origin);
        let [z, x] = [z, x].map(|direction| self.entities.direction(direction));
        let placement = self.entities.add(format_args!("AXIS2_PLACEMENT_3D('',{origin},{z},{x})"));
        self.entities.add(format_args!("PLANE('',{placement})"))
    }

    fn patch(&mut self, face: &Face) -> Id {
        let patch = &face.patch;
        let [m, n] = patch.degree();
        let points: Vec<Id> =
            patch.control_points().map(|point| self.entities.point(point.truncate() / point.w)).collect();
        let rows: Vec<_> = points.chunks(n + 1).map(List).collect();
        let rows = List(&rows);
        let (u, v) = (m + 1, n + 1);
        let knots = format_args!("({u},{u}),({v},{v}),(0.,1.),(0.,1.),.UNSPECIFIED.").to_string();
        if patch.is_rational() {
            let greatest = patch.control_points().map(|point| point.w).fold(0.0, f64::max);
            let weights: Vec<_> = patch.control_points().map(|point| Real(point.w / greatest)).collect();
            let weights: Vec<_> = weights.chunks(n + 1).map(List).collect();
            self.entities.add(format_args!(
                "(BOUNDED_SURFACE()B_SPLINE_SURFACE({m},{n},{rows},.UNSPECIFIED.,.F.,.F.,.F.)B_SPLINE_SURFACE_WITH_KNOTS({knots})\
                 GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_SURFACE({})REPRESENTATION_ITEM('')SURFACE())",
                List(&weights)
            ))
        } else {
            self.entities.add(format_args!(
                "B_SPLINE_SURFACE_WITH_KNOTS('',{m},{n},{rows},.UNSPECIFIED.,.F.,.F.,.F.,{knots})"
            ))
        }
    }
}

/// A logical value.
const fn truth(value: bool) -> &'static str {
    if value { ".T." } else { ".F." }
}

/// The corner and the sides of the parallelogram that a face's surface is, if it is one.
fn parallelogram(face: &Face) -> Option<[DVec3; 3]> {
    let patch = &face.patch;
    if face.exact.is_some() || patch.is_rational() || patch.degree() != [1, 1] {
        return None;
    }
    let mut corners = [DVec3::ZERO; 4];
    for (corner, point) in corners.iter_mut().zip(patch.control_points()) {
        *corner = point.truncate();
    }
    let [origin, along_t, along_s, opposite] = corners;
    let greatest = corners.iter().map(|corner| corner.abs().max_element()).fold(0.0, f64::max);
    let off = (origin - along_t - along_s + opposite).abs().max_element();
    // the rounding of three sums
    (off <= 4.0 * f64::EPSILON * greatest).then_some([origin, along_s - origin, along_t - origin])
}

/// Whether a face's surface is a plane.
fn is_plane(face: &Face) -> bool {
    parallelogram(face).is_some()
}

/// A place of a parallelogram's unit square in the parameters of its plane.
fn plane_parameters([_, s, t]: [DVec3; 3], st: DVec2) -> DVec2 {
    let [x, z] = plane_axes([s, t]);
    let place = st.x * s + st.y * t;
    DVec2::new(place.dot(x), place.dot(z.cross(x)))
}

/// The x axis and the normal of a plane, unit vectors.
fn plane_axes([s, t]: [DVec3; 2]) -> [DVec3; 2] {
    [s.normalize(), s.cross(t).normalize()]
}
