//! Objects that are parametric surfaces.

use glam::{DAffine3, DVec2, DVec3, DVec4};

use crate::patch::{BezierPatch, TrimmedPatch};
use crate::spline::Cell;
use crate::surface::SplineSurface;
use crate::trace::VertexAttributes;

/// A surface ready to trace.
pub(super) struct SurfaceObject {
    pub(super) patches: Vec<TrimmedPatch>,
    pub(super) attributes: SurfaceAttributes,
}

/// Texture coordinates of a surface are its own parameters; a patch's frame takes to them, with z = 0.
#[derive(Debug)]
pub(super) struct SurfaceAttributes {
    surface: SplineSurface,
    transform: DAffine3,
}

/// A surface placed in the world.
pub(super) fn surface_object(surface: &SplineSurface, transform: DAffine3) -> SurfaceObject {
    let place = |trimmed: TrimmedPatch| {
        let placed = |point: DVec4| {
            // (w x, w y, w z, w) goes to w times the image of (x, y, z)
            (transform.matrix3 * point.truncate() + point.w * transform.translation).extend(point.w)
        };
        let points = trimmed.patch.control_points().map(placed).collect();
        TrimmedPatch::untrimmed(trimmed.frame, BezierPatch::new(trimmed.patch.degree(), points))
    };
    SurfaceObject {
        patches: surface.patches().into_iter().map(place).collect(),
        attributes: SurfaceAttributes { surface: surface.clone(), transform },
    }
}

/// The corners of a patch that is a parallelogram, from (0, 0) to (1, 0), (1, 1), (0, 1); `None` if it is not flat.
pub(super) fn plane_corners(trimmed: &TrimmedPatch) -> Option<[DVec3; 4]> {
    let patch = &trimmed.patch;
    if patch.degree() != [1, 1] || patch.is_rational() {
        return None;
    }
    let points: Vec<_> = patch.control_points().map(DVec4::truncate).collect();
    let corners = [points[0], points[2], points[3], points[1]];
    let skew = points[0] + points[3] - points[1] - points[2];
    let size = corners.iter().fold(0.0, |most: f64, corner| most.max(corner.length()));
    (skew.length() <= 8.0 * f64::EPSILON * size).then_some(corners)
}

impl VertexAttributes for SurfaceAttributes {
    fn uv(&self, _polygon: u32, place: DVec3) -> DVec2 {
        place.truncate()
    }

    fn uv_gradients(&self, _polygon: u32, _place: DVec3) -> Option<[DVec3; 2]> {
        Some([DVec3::X, DVec3::Y])
    }

    fn normal(&self, _polygon: u32, _place: DVec3, _cell: Option<Cell>) -> Option<DVec3> {
        None
    }

    fn rest(&self, _polygon: u32, place: DVec3) -> DVec3 {
        self.transform.transform_point3(self.surface.eval(place.truncate()))
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::parse_scene_str;
    use crate::test_support::Noise;
    use crate::trace::{Geometry, Ray};
    use glam::{DVec2, DVec3};

    #[test]
    fn a_placed_sphere_is_hit_where_it_is() {
        let scene = "[[object]]\nname = \"a\"\nsurface = { type = \"sphere\", center = [1, 0, 0], radius = 0.5 }\n\
             transform = [{ scale = [2, 2, 2] }, { translate = [0, 3, 0] }]\n";
        let built = parse_scene_str(scene, "a.toml".as_ref()).unwrap().build().unwrap();
        let (centre, radius) = (DVec3::new(2.0, 3.0, 0.0), 1.0);
        let mut noise = Noise(51);
        let mut hits = 0;
        for _ in 0..3000 {
            let from = centre + 4.0 * noise.unit_vector();
            let ray = Ray::new(from, centre + 1.2 * noise.vector() - from);
            // the distance of the ray from the middle decides
            let along = (centre - from).dot(ray.direction) / ray.direction.length_squared();
            let off = centre.distance(ray.at(along)) - radius;
            let hit = built.traced.closest_hit(&ray);
            assert_eq!(hit.is_some(), off < 0.0, "{off:e}");
            let Some(hit) = hit else { continue };
            hits += 1;
            assert!((hit.position.distance(centre) - radius).abs() < 1e-13);
            assert!(hit.normal.distance((hit.position - centre) / radius) < 1e-10);
            assert!(hit.rest.distance(hit.position) < 1e-13, "the surface is not deformed");
            assert!(hit.uv.cmpge(DVec2::ZERO).all() && hit.uv.cmple(DVec2::ONE).all());
            // u runs around the axis
            assert!(hit.dp_du.dot(DVec3::Z).abs() < 1e-9 * hit.dp_du.length());
        }
        assert!(hits > 1000);
    }
}
