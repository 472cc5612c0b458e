//! A closed mesh under construction.

use std::collections::HashMap;
use std::fmt::Write;

use glam::{DVec2, DVec3};

/// Coordinates are rounded to this before they are compared and written, so that the files are short and the same on
/// every machine.
const GRID: f64 = 1e-6;

/// Vertices, welded where they coincide, and faces.
#[derive(Default)]
pub(crate) struct Solid {
    vertices: Vec<DVec3>,
    welded: HashMap<[i64; 3], usize>,
    faces: Vec<Vec<usize>>,
}

impl Solid {
    pub(crate) fn face_count(&self) -> usize {
        self.faces.len()
    }

    pub(crate) fn triangle_count(&self) -> usize {
        self.faces.iter().map(|face| face.len() - 2).sum()
    }

    /// Adds a planar face that winds counter-clockwise seen from outside.
    pub(crate) fn face(&mut self, points: &[DVec3]) {
        let face = points.iter().map(|&p| self.vertex(p)).collect();
        self.faces.push(face);
    }

    /// Adds a convex face as triangles around its first corner.
    pub(crate) fn fan(&mut self, points: &[DVec3]) {
        for pair in points[1..].windows(2) {
            self.face(&[points[0], pair[0], pair[1]]);
        }
    }

    /// Adds a face as triangles from its edges to `apex`.
    pub(crate) fn pyramid(&mut self, base: &[DVec3], apex: DVec3) {
        for (i, &p) in base.iter().enumerate() {
            self.face(&[p, base[(i + 1) % base.len()], apex]);
        }
    }

    /// Adds a prism over an outline (counter-clockwise) with an optional hole (counter-clockwise too), of triangles.
    ///
    /// With a hole, its first vertex must see the outline's first vertex.
    pub(crate) fn extrude(&mut self, outline: &[DVec2], hole: &[DVec2], z: [f64; 2]) {
        let mut joined = outline.to_vec();
        if let (Some(&outer), Some(&inner)) = (outline.first(), hole.first()) {
            joined.extend([outer, inner]);
            joined.extend(hole.iter().skip(1).rev());
            joined.push(inner);
        }
        for [a, b, c] in cut_ears(&joined) {
            self.face(&[a, b, c].map(|p| p.extend(z[1])));
            self.face(&[c, b, a].map(|p| p.extend(z[0])));
        }
        let reversed: Vec<_> = hole.iter().rev().copied().collect();
        for ring in [outline, &reversed] {
            for (a, b) in sides(ring) {
                self.fan(&[a.extend(z[0]), b.extend(z[0]), b.extend(z[1]), a.extend(z[1])]);
            }
        }
    }

    /// Adds a prism over an outline (counter-clockwise): its sides are rectangles, its ends whole.
    pub(crate) fn prism(&mut self, outline: &[DVec2], z: [f64; 2]) {
        let top: Vec<_> = outline.iter().map(|p| p.extend(z[1])).collect();
        let bottom: Vec<_> = outline.iter().rev().map(|p| p.extend(z[0])).collect();
        self.face(&top);
        self.face(&bottom);
        for (a, b) in sides(outline) {
            self.face(&[a.extend(z[0]), b.extend(z[0]), b.extend(z[1]), a.extend(z[1])]);
        }
    }

    /// Stops if an edge is not matched by its reverse exactly once, or the count of triangles is another.
    pub(crate) fn check_closed(&self, name: &str, triangles: Option<usize>) {
        let mut edges = HashMap::new();
        for face in &self.faces {
            for (i, &a) in face.iter().enumerate() {
                let b = face[(i + 1) % face.len()];
                assert_ne!(a, b, "{name}: an edge of no length at {}", self.vertices[a]);
                *edges.entry((a, b)).or_insert(0) += 1;
            }
        }
        for (&(a, b), &count) in &edges {
            let (p, q) = (self.vertices[a], self.vertices[b]);
            assert_eq!(count, 1, "{name}: edge {p} {q} is there {count} times");
            assert!(edges.contains_key(&(b, a)), "{name}: edge {p} {q} has no neighbour");
        }
        assert!(self.volume() > 0.0, "{name}: inside out");
        if let Some(triangles) = triangles {
            assert_eq!(self.triangle_count(), triangles, "{name}: triangles");
        }
    }

    fn volume(&self) -> f64 {
        let fans =
            self.faces.iter().flat_map(|face| face[1..].windows(2).map(|pair| [face[0], pair[0], pair[1]]));
        fans.map(|triangle| triangle.map(|i| self.vertices[i]))
            .map(|[a, b, c]| a.dot(b.cross(c)))
            .sum::<f64>()
            / 6.0
    }

    /// The text of an OBJ file.
    pub(crate) fn to_obj(&self, name: &str) -> String {
        let mut text = format!("# trimray: {name}, written by examples/models\no {name}\n");
        for p in &self.vertices {
            writeln!(text, "v {} {} {}", p.x, p.y, p.z).expect("writing to a String cannot fail");
        }
        for face in &self.faces {
            text.push('f');
            for i in face {
                write!(text, " {}", i + 1).expect("writing to a String cannot fail");
            }
            text.push('\n');
        }
        text
    }

    fn vertex(&mut self, p: DVec3) -> usize {
        let steps = p.to_array().map(step);
        *self.welded.entry(steps).or_insert_with(|| {
            // a division, since that gives the double next to the decimal number
            self.vertices.push(DVec3::from_array(steps.map(|step| step as f64 / GRID.recip().round())));
            self.vertices.len() - 1
        })
    }
}

/// Number of grid steps next to a coordinate.
#[expect(clippy::cast_possible_truncation, reason = "models measure a few units, a step is a millionth")]
fn step(x: f64) -> i64 {
    (x / GRID).round() as i64
}

fn sides(ring: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> {
    ring.iter().copied().zip(ring.iter().copied().cycle().skip(1))
}

/// Triangles of an outline, each time the best-shaped ear.
fn cut_ears(outline: &[DVec2]) -> Vec<[DVec2; 3]> {
    let mut rest = outline.to_vec();
    let mut triangles = Vec::new();
    while rest.len() >= 3 {
        let n = rest.len();
        let corner = |i: usize| [rest[(i + n - 1) % n], rest[i], rest[(i + 1) % n]];
        let quality = |[a, b, c]: [DVec2; 3]| {
            let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
            (b - a).perp_dot(c - a) / longest
        };
        let is_ear = |[a, b, c]: [DVec2; 3]| {
            let within =
                |p: DVec2| [(a, b), (b, c), (c, a)].iter().all(|&(q, r)| (r - q).perp_dot(p - q) >= -1e-12);
            !rest.iter().any(|&p| p != a && p != b && p != c && within(p))
        };
        let ears = (0..n).filter(|&i| quality(corner(i)) > 1e-9 && is_ear(corner(i)));
        let best = ears.max_by(|&i, &j| quality(corner(i)).total_cmp(&quality(corner(j))));
        let tip = best.expect("the outlines of the models are simple");
        triangles.push(corner(tip));
        rest.remove(tip);
    }
    triangles
}
