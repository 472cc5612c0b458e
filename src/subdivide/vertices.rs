//! Numbers of the points at which edges end: faces share an edge if both have the numbers of its ends.

use std::collections::HashMap;

use glam::DVec3;

/// A vertex in the inside of an edge, which other faces may have whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EdgePoint {
    /// The vertex.
    pub(crate) vertex: u32,
    /// The ends of the edge, the lower number first.
    pub(crate) edge: [u32; 2],
    /// How far it is from the first end to the second.
    pub(crate) fraction: f64,
}

/// Gives vertices their numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct VertexNumbers {
    count: u32,
    edge_points: Vec<EdgePoint>,
    equal: Vec<[u32; 2]>,
}

impl VertexNumbers {
    /// With `count` vertices.
    pub(crate) fn new(count: u32) -> Self {
        Self { count, ..Self::default() }
    }

    /// How many there are; all numbers are below.
    pub(crate) const fn count(&self) -> u32 {
        self.count
    }

    /// The vertices inside of edges.
    pub(crate) fn edge_points(&self) -> &[EdgePoint] {
        &self.edge_points
    }

    /// No longer keeps which vertices are inside of edges, for no face has these edges whole.
    pub(super) fn forget_edge_points(&mut self) {
        self.edge_points = Vec::new();
    }

    /// Pairs of vertices that are one.
    pub(crate) fn equal(&self) -> &[[u32; 2]] {
        &self.equal
    }

    /// A vertex of its own.
    pub(crate) fn add(&mut self) -> u32 {
        self.add_run(1)
    }

    /// Vertices of their own with consecutive numbers, of which it returns the first.
    pub(crate) fn add_run(&mut self, length: u32) -> u32 {
        let first = self.count;
        self.count = first.checked_add(length).expect("fewer than 2^32 vertices fit in memory");
        first
    }

    /// A vertex in the inside of the edge from `a` to `b`, at a fraction of the way. An edge that is a point has no inside.
    pub(crate) fn add_on_edge(&mut self, [a, b]: [u32; 2], fraction: f64) -> u32 {
        if a == b {
            return a;
        }
        let vertex = self.add();
        let (edge, fraction) = if a < b { ([a, b], fraction) } else { ([b, a], 1.0 - fraction) };
        self.edge_points.push(EdgePoint { vertex, edge, fraction });
        vertex
    }

    /// Notes that two vertices are one.
    pub(crate) fn join(&mut self, a: u32, b: u32) {
        if a != b {
            self.equal.push([a, b]);
        }
    }

    /// Adds another's vertices. Of those with numbers below `first`, `known` says which of these here they are; returns the
    /// numbers of all.
    pub(crate) fn append(
        &mut self,
        other: &Self,
        first: u32,
        known: impl Fn(u32) -> u32,
    ) -> impl Fn(u32) -> u32 {
        let before = self.count;
        let moved = move |vertex: u32| if vertex < first { known(vertex) } else { vertex - first + before };
        self.count = before.checked_add(other.count - first).expect("fewer than 2^32 vertices fit in memory");
        for point in &other.edge_points {
            let [a, b] = point.edge.map(&moved);
            let (edge, fraction) =
                if a < b { ([a, b], point.fraction) } else { ([b, a], 1.0 - point.fraction) };
            self.edge_points.push(EdgePoint { vertex: moved(point.vertex), edge, fraction });
        }
        self.equal.extend(other.equal.iter().map(|pair| pair.map(&moved)));
        moved
    }

    /// Memory in bytes, besides that of the struct.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.edge_points) + size_of_val(&*self.equal)
    }

    /// Frees memory that is not used.
    pub(crate) fn shrink(&mut self) {
        self.edge_points.shrink_to_fit();
        self.equal.shrink_to_fit();
    }
}

/// Numbers the corners of polygons: those at one place are one vertex.
#[derive(Debug, Default)]
pub(crate) struct Numbering {
    pub(crate) numbers: VertexNumbers,
    known: HashMap<[u64; 3], u32>,
}

impl Numbering {
    /// The vertex at a place.
    pub(crate) fn vertex(&mut self, place: DVec3) -> u32 {
        // -0 is 0
        let bits = (place + DVec3::ZERO).to_array().map(f64::to_bits);
        *self.known.entry(bits).or_insert_with(|| self.numbers.add())
    }
}
