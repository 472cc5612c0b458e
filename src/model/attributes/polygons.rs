//! What the mesh's corners say of a point of its surface: texture coordinates and normals.

use glam::{DMat3, DVec2, DVec3};

use crate::math::bernstein::MAX_DEGREE;
use crate::math::cofactor::cofactor;
use crate::mesh::{Polygon, PolygonMesh, PolygonSet};
use crate::patch::Place;
use crate::spline::{KnotBox, SplineVolume};
use crate::trace::VertexAttributes;

/// Looks the attributes of corners up in the polygons they were given for; linear over the triangles of a polygon's fan.
#[derive(Debug)]
pub(in crate::model) struct PolygonAttributes {
    pub(in crate::model) polygons: PolygonSet,
    pub(in crate::model) normals: Option<CarriedNormals>,
}

/// The normals of a mesh's corners, to be carried along by a deformation.
#[derive(Debug)]
pub(in crate::model) struct CarriedNormals {
    /// One for each corner of the mesh, after the object's transform; NaN where there is none.
    corners: Vec<DVec3>,
    /// The deformations, one after the other.
    volumes: Vec<SplineVolume>,
}

impl CarriedNormals {
    /// Those of a mesh that is placed by `transform` and then deformed.
    pub(in crate::model) fn new(mesh: &PolygonMesh, transform: DMat3, volumes: Vec<SplineVolume>) -> Self {
        let place = cofactor(transform);
        let normal = |corner| match mesh.corner(corner).normal {
            Some(normal) => (place * mesh.normals()[normal as usize]).normalize_or(DVec3::NAN),
            None => DVec3::NAN,
        };
        Self { corners: (0..mesh.corner_count()).map(normal).collect(), volumes }
    }
}

impl VertexAttributes for PolygonAttributes {
    fn uv(&self, polygon: u32, place: Place) -> DVec2 {
        let polygon = self.polygons.polygon(polygon as usize);
        if polygon.uvs.is_empty() {
            return DVec2::NAN;
        }
        let (triangle, weights) = fan_triangle(&polygon, place.coordinates());
        let [a, b, c] = triangle.map(|corner| polygon.uvs[corner]);
        weights.x * a + weights.y * b + weights.z * c
    }

    fn uv_gradients(&self, polygon: u32, place: Place) -> Option<[DVec3; 2]> {
        let polygon = self.polygons.polygon(polygon as usize);
        let (triangle, _) = fan_triangle(&polygon, place.coordinates());
        uv_gradients(&polygon, triangle)
    }

    /// The corners' normals interpolated, then transformed by the cofactors of the deformation's Jacobian, as the normal of
    /// any surface through the point is (Feng et al. 2002 deform points alone; the rule is that of Barr 1984, section 3).
    fn normal(&self, polygon: u32, place: Place, knot_box: Option<KnotBox>) -> Option<DVec3> {
        let CarriedNormals { corners, volumes } = self.normals.as_ref()?;
        let polygon = self.polygons.polygon(polygon as usize);
        let rest = place.coordinates();
        let (triangle, weights) = fan_triangle(&polygon, rest);
        let [a, b, c] = triangle.map(|corner| corners[polygon.corners[corner] as usize]);
        let normal = weights.x * a + weights.y * b + weights.z * c;
        let (mut place, mut carried) = (rest, normal);
        for (number, volume) in volumes.iter().enumerate() {
            // of the first the knot box is known, which decides on a knot plane, unless it made cells
            let is_known = number == 0 && volume.total_degree() <= MAX_DEGREE;
            let knot_box = if is_known { knot_box } else { volume.knot_box(place) };
            let Some(knot_box) = knot_box else { continue };
            let point = volume.eval_in_knot_box(knot_box, place);
            (place, carried) = (point.position, cofactor(point.jacobian) * carried);
        }
        carried.try_normalize()
    }

    fn each_number(&self, visit: &mut dyn FnMut(f64)) {
        let uvs = self.polygons.iter().flat_map(|polygon| polygon.uvs).flat_map(|uv| uv.to_array());
        let normals = self.normals.iter().flat_map(|normals| &normals.corners);
        uvs.chain(normals.flat_map(|normal| normal.to_array())).for_each(visit);
    }
}

/// Gradients of the texture coordinates over a triangle of a polygon's corners, if there are any.
fn uv_gradients(polygon: &Polygon<'_>, triangle: [usize; 3]) -> Option<[DVec3; 2]> {
    if polygon.uvs.is_empty() {
        return None;
    }
    let [a, b, c] = triangle.map(|corner| polygon.positions[corner]);
    let [ua, ub, uc] = triangle.map(|corner| polygon.uvs[corner]);
    // of a function that is 0 at a: values at b and c times the gradients of their barycentric coordinates
    let area = polygon.normal.dot((b - a).cross(c - a));
    let of_b = (c - a).cross(polygon.normal) / area;
    let of_c = polygon.normal.cross(b - a) / area;
    Some([0, 1].map(|axis| (ub - ua)[axis] * of_b + (uc - ua)[axis] * of_c))
}

/// The triangle of a polygon's fan that holds a point, and the point's barycentric coordinates in it.
fn fan_triangle(polygon: &Polygon<'_>, rest: DVec3) -> ([usize; 3], DVec3) {
    let mut best = ([0, 1, 2], barycentric(polygon, 1, rest));
    for i in 2..polygon.positions.len() - 1 {
        let weights = barycentric(polygon, i, rest);
        if weights.min_element() > best.1.min_element() {
            best = ([0, i, i + 1], weights);
        }
    }
    best
}

/// Barycentric coordinates of a point in triangle (0, i, i + 1) of a polygon's fan.
fn barycentric(polygon: &Polygon<'_>, i: usize, point: DVec3) -> DVec3 {
    let [a, b, c] = [0, i, i + 1].map(|corner| polygon.positions[corner]);
    let area = polygon.normal.dot((b - a).cross(c - a));
    let of_b = polygon.normal.dot((point - a).cross(c - a)) / area;
    let of_c = polygon.normal.dot((b - a).cross(point - a)) / area;
    let weights = DVec3::new(1.0 - of_b - of_c, of_b, of_c);
    // a fan's triangle without area holds no point
    if weights.is_finite() { weights } else { DVec3::splat(f64::NEG_INFINITY) }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::scene::{BuiltScene, parse_scene};
    use crate::trace::Ray;

    /// Two triangles and a pentagon, folded, with texture coordinates and normals that are nobody's own, twisted and bulged.
    const MESH: &str = "v 0.1 0.1 0.3\nv 0.9 0.15 0.4\nv 0.8 0.9 0.6\nv 0.2 0.8 0.5\n\
        v 0 0 0.1\nv 1 0 0.1\nv 1.2 0.5 0.1\nv 1 1 0.1\nv 0 1 0.1\n\
        vt 0 0\nvt 1 0.1\nvt 0.8 0.9\nvt 0.1 1\nvn 0.1 0.2 1\nvn -0.3 0 2\nvn 0 0.4 1\nvn 0.2 0.1 0.5\n\
        f 1/1/1 2/2/2 3/3/3\nf 1/1/1 3/3/3 4/4/4\nf 5/1/1 6/2/2 7/3/3 8/4/4 9/4/1\n";

    fn built(normals: &str) -> BuiltScene {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.obj"), MESH).unwrap();
        let scene = format!(
            "[[object]]\nname = \"a\"\nmesh = \"a.obj\"\nnormals = \"{normals}\"\n\
             transform = [{{ scale = [2, 1, 3] }}, {{ rotate = {{ axis = [1, 2, 3], angle = 40 }} }}]\n\
             [[object.deform]]\ntype = \"ffd\"\ndegree = [2, 3, 2]\npoints = [4, 5, 4]\n\
             [[object.deform.edit]]\ntwist = {{ axis = \"z\", angle = 70 }}\n\
             [[object.deform.edit]]\nweight = [1, 2, 1]\nvalue = 2.0\n"
        );
        let path = folder.path().join("a.toml");
        fs::write(&path, scene).unwrap();
        parse_scene(&path).unwrap().build().unwrap()
    }

    /// Rays from a point above that hit the surface in many places.
    fn hits(built: &BuiltScene) -> Vec<crate::trace::SurfaceInteraction> {
        let [low, high] = built.traced.bounds();
        let eye = 0.5 * (low + high) + 2.0 * (high - low).length() * DVec3::new(0.3, 0.2, 1.0);
        let ray = |i: u32| {
            let place = DVec3::new(f64::from(i % 40), f64::from(i / 40), 20.0) / 40.0;
            Ray::new(eye, low + place * (high - low) - eye)
        };
        (0..1600).filter_map(|i| built.traced.closest_hit(&ray(i))).collect()
    }

    #[test]
    fn dp_du_is_the_partial_by_u() {
        let built = built("face");
        let object = &built.traced.objects()[0];
        let found = hits(&built);
        assert!(found.len() > 300, "{}", found.len());
        for hit in found {
            assert_eq!(hit.shading_normal, hit.normal);
            if hit.face == 2 {
                // a triangle of the pentagon's fan has two corners with the same texture coordinates
                continue;
            }
            assert!(hit.dp_du.dot(hit.normal).abs() < 1e-12 * hit.dp_du.length(), "in the surface");
            // the same by differences: a step along s and t that moves u alone
            let trimmed = &object.faces()[hit.patch as usize];
            let polygon = trimmed.region.loops().find(|l| l.face == hit.face).unwrap().polygon;
            let uv = |st: DVec2| object.attributes.uv(polygon, trimmed.chart.place(st));
            let step = 1e-4;
            let by_s = (uv(hit.st + DVec2::X * step) - uv(hit.st - DVec2::X * step)) / (2.0 * step);
            let by_t = (uv(hit.st + DVec2::Y * step) - uv(hit.st - DVec2::Y * step)) / (2.0 * step);
            let along = DVec2::new(by_t.y, -by_s.y) / by_s.perp_dot(by_t);
            let want = hit.dp_ds * along.x + hit.dp_dt * along.y;
            // a pentagon's fan has creases that differences may straddle
            assert!(
                hit.face == 2 || (want - hit.dp_du).length() < 1e-7 * want.length(),
                "{want} {}",
                hit.dp_du
            );
        }
    }

    #[test]
    fn vertex_normals_are_carried_by_cofactors() {
        let built = built("vertex");
        let volume = &built.objects[0].lattices[0].volume;
        let map = glam::DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 40_f64.to_radians())
            * glam::DAffine3::from_scale(DVec3::new(2.0, 1.0, 3.0));
        let corner = |x, y, z| map.transform_point3(DVec3::new(x, y, z));
        let normals = [[0.1, 0.2, 1.0], [-0.3, 0.0, 2.0], [0.0, 0.4, 1.0]]
            .map(|n| (map.matrix3.inverse().transpose() * DVec3::from_array(n)).normalize());
        let (a, b, c) = (corner(0.1, 0.1, 0.3), corner(0.9, 0.15, 0.4), corner(0.8, 0.9, 0.6));
        let mut checked = 0;
        for hit in hits(&built) {
            assert!((hit.shading_normal.length() - 1.0).abs() < 1e-12);
            if hit.face != 0 {
                continue;
            }
            // weights by areas, the Jacobian by differences
            let of = |p: DVec3, q: DVec3| (p - hit.rest).cross(q - hit.rest).length();
            let weights = DVec3::new(of(b, c), of(c, a), of(a, b)) / (b - a).cross(c - a).length();
            let normal = weights.x * normals[0] + weights.y * normals[1] + weights.z * normals[2];
            let at = |offset: DVec3| volume.eval(hit.rest + offset).unwrap().position;
            let by = |axis: DVec3| (at(1e-5 * axis) - at(-1e-5 * axis)) / 2e-5;
            let jacobian = DMat3::from_cols(by(DVec3::X), by(DVec3::Y), by(DVec3::Z));
            let want = (jacobian.inverse().transpose() * normal).normalize();
            assert!((hit.shading_normal - want).length() < 1e-6, "{} {want}", hit.shading_normal);
            checked += 1;
        }
        assert!(checked > 100, "{checked}");
    }
}
