//! Objects of triangular Bézier patches, the exact method before; they go through the same tracer, for comparison.
//!
//! Source: Feng, Peng (2000), *Accelerating accurate B-spline free-form deformation through polynomial interpolation*.

use std::collections::BTreeSet;

use super::{Construction, Elements};
use crate::analytic::Step;
use crate::math::bernstein::MAX_DEGREE;
use crate::model::deformation::{Base, Faces, PlacedShape, planar};
use crate::model::error::ModelError;
use crate::patch::{BuildError, deform_triangles};
use crate::spline::SplineVolume;

/// How much the triangular patches of an object are, before they are converted to tensor-product patches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TriangularCounts {
    /// Number of patches.
    pub patches: usize,
    /// Control points of all of them.
    pub control_points: usize,
    /// Memory.
    pub bytes: usize,
}

/// Polygons under one lattice at most, as triangular patches.
///
/// # Errors
/// At the second deformer if there is one, and as the exact representation.
pub(super) fn construct(shape: &PlacedShape<'_>) -> Result<Construction, ModelError> {
    if shape.deformers.len() > 1 {
        return Err(ModelError::OneLattice);
    }
    let (steps, mut lattices) = shape.steps()?;
    let (polygons, volume) = match (shape.base, steps.first()) {
        (Base::Polygons(polygons), None) => (polygons, None),
        (Base::Polygons(polygons), Some(Step::Volume(volume))) => (polygons, Some(volume)),
        _ => return Err(ModelError::OnlyLattice),
    };
    if let Some(degree) = volume.map(SplineVolume::total_degree).filter(|degree| *degree > MAX_DEGREE) {
        return Err(ModelError::TriangularDegree { degree });
    }
    let planar = planar(polygons);
    let failed = |source: BuildError| ModelError::Patches { deformer: 0, source };
    let made = deform_triangles(&planar, volume).map_err(failed)?;
    let shell = made.shell(&planar, volume).map_err(failed)?;
    let subpolygons = made.pieces.len();
    let counts =
        TriangularCounts { patches: subpolygons, control_points: made.control_points(), bytes: made.bytes() };
    let knot_boxes: BTreeSet<_> = made.pieces.iter().map(|piece| (0, piece.knot_box())).collect();
    let made = Faces { shell, subpolygons, times: made.times, knot_boxes };
    if volume.is_some() {
        shape.check_outside(0, &made)?;
    }
    made.record_knot_boxes(&mut lattices);
    let Faces { shell, times, .. } = made;
    let elements = Elements::Faces(shell);
    Ok(Construction { elements, subpolygons, steps, lattices, triangular: Some(counts), times })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use glam::DVec3;

    use crate::scene::{BuiltScene, SceneError, parse_scene};
    use crate::test_support::Noise;
    use crate::trace::Ray;

    const CUBE: &str = include_str!("../../../scenes/meshes/feng_fig07_cube.obj");
    const LATTICE: &str = "[[object.deform]]\ntype = \"ffd\"\ndegree = [2, 3, 2]\npoints = [4, 5, 4]\n\
                           [[object.deform.edit]]\ntwist = { axis = \"z\", angle = 60 }\n";

    fn try_build(method: &str, deform: &str) -> Result<BuiltScene, SceneError> {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.obj"), CUBE).unwrap();
        let object = "[[object]]\nname = \"a\"\nmesh = \"a.obj\"\ntransform = [{ rotate = { axis = [1, 2, 3], angle = 25 } }]";
        let path = folder.path().join("a.toml");
        fs::write(&path, format!("{object}\nmethod = \"{method}\"\n{deform}")).unwrap();
        parse_scene(&path).unwrap().build()
    }

    #[test]
    fn hits_are_those_of_the_exact_method() {
        let weights = "[[object.deform.edit]]\nweight = [1, 2, 1]\nvalue = 3\n";
        let smaller = LATTICE.replace("points", "bounds = [[-0.1, -0.2, 0.1], [0.7, 0.6, 0.8]]\npoints");
        for deform in [LATTICE, &format!("{LATTICE}{weights}"), &smaller] {
            let [exact, triangular] =
                ["exact", "triangular"].map(|method| try_build(method, deform).unwrap());
            let [low, high] = exact.traced.bounds();
            let (middle, size) = (0.5 * (low + high), (high - low).length());
            let mut noise = Noise(77);
            let mut found = 0;
            for _ in 0..3000 {
                let from = middle + 2.0 * size * noise.unit_vector();
                let ray = Ray::new(from, middle + 0.6 * size * noise.vector() - from);
                let hits = [&exact, &triangular].map(|built| built.traced.closest_hit(&ray));
                let [Some(a), Some(b)] = hits else {
                    assert!(hits.iter().all(Option::is_none), "one of them misses");
                    continue;
                };
                found += 1;
                assert!(a.position.distance(b.position) <= 1e-11 * size, "{}", a.position - b.position);
                assert!(a.rest.distance(b.rest) <= 1e-10 * size);
                assert!((a.normal - b.normal).length() <= 1e-8, "{} {}", a.normal, b.normal);
                assert_eq!(a.face, b.face);
            }
            assert!(found > 1000);
        }
    }

    #[test]
    fn a_closed_cube_has_an_even_number_of_hits_on_every_ray() {
        let built = try_build("triangular", LATTICE).unwrap();
        let counts = built.objects[0].triangular.unwrap();
        assert_eq!(
            (counts.patches, counts.control_points),
            (built.objects[0].subpolygons, counts.patches * 36)
        );
        assert!(!built.objects[0].lattices[0].knot_boxes.is_empty());
        let [low, high] = built.traced.bounds();
        let middle = 0.5 * (low + high);
        let mut noise = Noise(8);
        for _ in 0..2000 {
            let from = middle + 5.0 * noise.unit_vector();
            let ray = Ray::new(from, middle + 0.7 * noise.vector() - from);
            assert_eq!(built.traced.all(&ray).len() % 2, 0);
        }
        assert!(built.traced.all(&Ray::new(middle + 9.0, DVec3::ONE)).is_empty());
    }

    #[test]
    fn parts_outside_may_be_refused_and_a_second_lattice_is() {
        let bounds = "outside = \"error\"\nbounds = [[0, 0, 0], [1, 1, 0.5]]\npoints";
        let error = try_build("triangular", &LATTICE.replace("points", bounds)).unwrap_err();
        assert!(error.to_string().contains("not wholly in the lattice's box"), "{error}");
        let error = try_build("triangular", &format!("{LATTICE}{LATTICE}")).unwrap_err().to_string();
        assert!(error.contains("a.toml:12:") && error.contains("one lattice at most"), "{error}");
    }
}
