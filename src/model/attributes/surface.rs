//! Objects that are parametric surfaces.

use glam::{DAffine3, DVec2, DVec3, DVec4};

use crate::patch::{BezierPatch, Face, Place, Shell};
use crate::spline::KnotBox;
use crate::surface::SplineSurface;
use crate::trace::VertexAttributes;

/// Texture coordinates of a surface are its own parameters.
#[derive(Debug)]
pub(in crate::model) struct SurfaceAttributes {
    pub(in crate::model) surface: SplineSurface,
    pub(in crate::model) placement: DAffine3,
}

/// The faces of a surface placed in the world.
pub(in crate::model) fn placed_shell(surface: &SplineSurface, placement: DAffine3) -> Shell {
    let place = |trimmed: Face| {
        let placed = |point: DVec4| {
            // (w x, w y, w z, w) goes to w times the image of (x, y, z)
            (placement.matrix3 * point.truncate() + point.w * placement.translation).extend(point.w)
        };
        let points = trimmed.patch.control_points().map(placed).collect();
        Face::untrimmed(trimmed.chart, BezierPatch::new(trimmed.patch.degree(), points))
    };
    surface.shell().map(place)
}

/// The corners of a patch that is a parallelogram, from (0, 0) to (1, 0), (1, 1), (0, 1); `None` if it is not flat.
pub(in crate::model) fn plane_corners(trimmed: &Face) -> Option<[DVec3; 4]> {
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
    fn uv(&self, _polygon: u32, place: Place) -> DVec2 {
        place.coordinates().truncate()
    }

    fn uv_gradients(&self, _polygon: u32, _place: Place) -> Option<[DVec3; 2]> {
        Some([DVec3::X, DVec3::Y])
    }

    fn normal(&self, _polygon: u32, _place: Place, _knot_box: Option<KnotBox>) -> Option<DVec3> {
        None
    }

    fn rest(&self, _polygon: u32, place: Place) -> DVec3 {
        self.placement.transform_point3(self.surface.eval(place.coordinates().truncate()))
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::parse_scene_str;
    use crate::test_support::Noise;
    use crate::trace::Ray;
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

    fn warnings(surface: &str, deform: &str) -> Vec<String> {
        let scene = format!(
            "[[object]]\nname = \"a\"\nsurface = {surface}\n[[object.deform]]\ntype = \"extension\"\n{deform}"
        );
        let built = parse_scene_str(&scene, "a.toml".as_ref()).unwrap().build().unwrap();
        built.objects[0].warnings.clone()
    }

    #[test]
    fn surfaces_that_run_through_themselves_are_warned_of() {
        // a trough, one wall of which is pushed along x, through the other if far enough
        let trough = "{ type = \"bezier\", degree = [2, 1], points = [[-0.5,0,1],[-0.5,1,1],[0,0,-1],[0,1,-1],[0.5,0,1],[0.5,1,1]] }";
        let pushed = |h: f64| {
            let region = "[[object.deform.region]]\nbound = \"((u-0.2)^2+(v-0.5)^2)/0.03 - 1\"\nindex = 2\n";
            warnings(trough, &format!("mode = \"field\"\nfield = [1, 0, 0]\n{region}h = {h}\n"))
        };
        assert_eq!(pushed(0.2), Vec::<String>::new());
        let found = pushed(0.8);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].starts_with("the surface may intersect itself: about u = "), "{found:?}");
        let torus = "{ type = \"torus\", major_radius = 1, minor_radius = 0.4 }";
        let swollen =
            "mode = \"field\"\nfield = \"normal\"\n[[object.deform.region]]\nbound = \"-1\"\nindex = 2\n";
        assert_eq!(warnings(torus, &format!("{swollen}h = 0.2\n")), Vec::<String>::new());
        assert_eq!(
            warnings(torus, &format!("{swollen}h = 0.6\n")).len(),
            1,
            "the tube is wider than the hole"
        );
    }

    #[test]
    fn empty_regions_and_vanishing_determinants_are_warned_of() {
        let plane = "{ type = \"plane\", origin = [0,0,1], u = [1,0,0], v = [0,1,0] }";
        let region = |bound: &str, h: &str| {
            let region = format!("[[object.deform.region]]\nbound = \"{bound}\"\nindex = 2\nh = {h}\n");
            warnings(plane, &format!("mode = \"operator\"\n{region}"))
        };
        let none = Vec::<String>::new();
        assert_eq!(region("(u-0.5)^2 + (v-0.5)^2 - 0.1", "2"), none);
        for empty in ["1 + cos(pi*(u-v))", "u + v + 1", "(u-0.5)^2 + (v-0.5)^2 + 1e-9"] {
            let found = region(empty, "[0, 0, 1]");
            assert!(found.len() == 1 && found[0].contains("region 1 is empty"), "{empty}: {found:?}");
        }
        assert_eq!(region("-(1 + cos(pi*(u-v)))", "[0, 0, 1]"), none);
        // det D = E11 E22 - (E12 - 1) (E21 - 1)
        let shear = "[[0, 1.5, 0], [1.5, 0, 0], [0, 0, 0]]";
        let found = region("-1", shear);
        assert!(found.iter().any(|warning| warning.contains("det D is 0 or negative")), "{found:?}");
        assert_eq!(region("-1", "[[0, 0.5, 0], [0.5, 0, 0], [0, 0, 0]]"), none);
    }
}
