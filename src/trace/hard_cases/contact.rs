//! Rays that touch a surface, or all but touch it, against closed forms.
//!
//! Where an equation in the place λ along the ray has the roots, its residual is compared and not λ, which near a double
//! root is off by the square root of rounding.

use super::*;

/// Bound on the residual of a root's equation: rounding of surface, ray and solver, in units of height.
const RESIDUAL: f64 = 2e-14;

/// Powers of ten from 10^-3 to 10^-12.
fn small() -> impl Iterator<Item = f64> {
    (3..=12).map(|k| libm::pow(10.0, -f64::from(k)))
}

/// Fails unless there are two roots, one on either side of the tangent point; `d` is how deep the ray cuts in.
fn assert_pair(found: &[f64], d: f64, residual: impl Fn(f64) -> f64, what: &str) {
    // where the cut is within some margins of rounding, it is one place of contact along its whole length
    let bound = if d < 5e-12 { d } else { RESIDUAL };
    assert_eq!(found.len(), 2, "two roots: {found:?} {what}");
    assert!(found[0] < 0.0 && found[1] > 0.0, "one on either side: {found:?} {what}");
    for &root in found {
        assert!(residual(root).abs() < bound, "root {root:e} has residual {:e} {what}", residual(root));
    }
}

/// z = x² + y² over [-1, 1]².
fn paraboloid() -> TracedScene {
    one_patch([2, 2], |i, j| DVec3::new(X2[i], X2[j], SQUARE[i] + SQUARE[j]))
}

#[test]
fn a_paraboloid_is_cut_twice_touched_or_missed() {
    let scene = paraboloid();
    let mut tracer = scene.tracer();
    let mut noise = Noise(101);
    for _ in 0..60 {
        let (place, turn) = (1.8 * noise.vector().truncate(), std::f64::consts::TAU * noise.next());
        let along = DVec2::new(libm::cos(turn), libm::sin(turn));
        // unit length across z, so the surface is λ² above the tangent line at λ
        let direction = along.extend(2.0 * place.dot(along));
        let target = place.extend(place.length_squared());
        for d in small() {
            let what = format!("at {place} along {along}, offset {d:e}");
            let cut = offsets(&mut tracer, target + d * DVec3::Z, direction);
            if place.abs().max_element() + d.sqrt() < 1.0 {
                assert_pair(&cut, d, |l| l * l - d, &what);
            }
            let missed = offsets(&mut tracer, target - d * DVec3::Z, direction);
            assert!(missed.is_empty(), "{missed:?} {what}");
        }
        let touched = offsets(&mut tracer, target, direction);
        assert!(!touched.is_empty() && touched.len() <= 2, "{touched:?} at {place} along {along}");
        assert!(touched.iter().all(|l| l * l < 1e-12), "{touched:?} at {place} along {along}");
    }
}

#[test]
fn a_rational_cylinder_is_cut_twice_touched_or_missed() {
    let w = std::f64::consts::FRAC_1_SQRT_2;
    let ring = [(1.0, 0.0, 1.0), (1.0, 1.0, w), (0.0, 1.0, 1.0)];
    let points =
        ring.iter().flat_map(|&(x, y, w)| [-1.0, 1.0].map(|z| DVec4::new(w * x, w * y, w * z, w))).collect();
    let scene = scene_of(vec![whole(BezierPatch::new([2, 1], points))]);
    let mut tracer = scene.tracer();
    let mut noise = Noise(102);
    for _ in 0..60 {
        let phi = std::f64::consts::FRAC_PI_4 + noise.next();
        let (sin, cos) = (libm::sin(phi), libm::cos(phi));
        let outward = DVec3::new(cos, sin, 0.0);
        let lean = 3.0 * noise.next();
        let direction = DVec3::new(-sin, cos, lean);
        let target = outward + noise.next() * DVec3::Z;
        for d in small() {
            let what = format!("at angle {phi}, leaning {lean}, offset {d:e}");
            let cut = offsets(&mut tracer, target - d * outward, direction);
            assert_pair(&cut, d, |l| l * l + d * d - 2.0 * d, &what);
            let missed = offsets(&mut tracer, target + d * outward, direction);
            assert!(missed.is_empty(), "{missed:?} {what}");
        }
        let touched = offsets(&mut tracer, target, direction);
        assert!(!touched.is_empty() && touched.len() <= 2, "{touched:?} at angle {phi}");
        assert!(touched.iter().all(|l| l * l < 1e-12), "{touched:?} at angle {phi}");
    }
}

/// z = x y over [-1, 1]².
fn saddle() -> TracedScene {
    one_patch([1, 1], |i, j| DVec3::new(X1[i], X1[j], X1[i] * X1[j]))
}

#[test]
fn beside_an_asymptotic_line_of_a_saddle_nothing_is_hit() {
    let scene = saddle();
    let mut tracer = scene.tracer();
    let mut noise = Noise(103);
    for _ in 0..60 {
        let place = 1.8 * noise.vector().truncate();
        let target = place.extend(place.x * place.y);
        tracer.take_statistics();
        offsets(&mut tracer, target, DVec3::new(1.0, 0.0, place.y));
        let statistics = tracer.take_statistics();
        assert!(statistics.in_surface > 0, "the line is in the surface: {statistics:?}");
        for d in small().flat_map(|d| [d, -d]) {
            let found = offsets(&mut tracer, target + d * DVec3::Z, DVec3::new(1.0, 0.0, place.y));
            assert!(found.is_empty(), "{found:?} at {place}, offset {d:e}");
        }
        assert_eq!(tracer.statistics().not_converged, 0);
    }
}

#[test]
fn near_an_asymptotic_line_a_saddle_is_cut_twice_or_missed() {
    let scene = saddle();
    let mut tracer = scene.tracer();
    let mut noise = Noise(104);
    for number in 0..60 {
        let place = 1.2 * noise.vector().truncate();
        let target = place.extend(place.x * place.y);
        // the surface is e λ² above the ray through the target
        let e = libm::pow(10.0, -f64::from(number % 7));
        let direction = DVec3::new(1.0, e, place.y + e * place.x);
        for part in [0.3, 0.1, 0.01, 1e-3] {
            let d = e * part * part;
            if d < 1e-12 {
                continue;
            }
            let what = format!("at {place}, e {e:e}, offset {d:e}");
            assert_pair(&offsets(&mut tracer, target + d * DVec3::Z, direction), d, |l| e * l * l - d, &what);
            let missed = offsets(&mut tracer, target - d * DVec3::Z, direction);
            assert!(missed.is_empty(), "{missed:?} {what}");
        }
    }
    assert_eq!(tracer.statistics().not_converged, 0);
}

/// z = x³ over [-1, 1]².
fn cubic() -> TracedScene {
    one_patch([3, 1], |i, j| DVec3::new(X3[i], X1[j], CUBE[i]))
}

#[test]
fn three_roots_at_an_inflection_are_found_or_one() {
    let scene = cubic();
    let mut tracer = scene.tracer();
    let mut noise = Noise(105);
    for _ in 0..60 {
        let y = noise.next();
        for k in 2..=8 {
            // roots 0 and ± sqrt(slope)
            let slope = libm::pow(10.0, -f64::from(k));
            let target = DVec3::new(0.0, y, 0.0);
            let found = offsets(&mut tracer, target, DVec3::new(1.0, noise.next(), slope));
            assert_eq!(found.len(), 3, "{found:?} at y {y}, slope {slope:e}");
            for (root, want) in found.iter().zip([-1.0, 0.0, 1.0]) {
                let residual = root * root * root - slope * root;
                let close = (root - want * slope.sqrt()).abs() < 0.1 * slope.sqrt();
                assert!(close && residual.abs() < RESIDUAL, "{found:?} at y {y}, slope {slope:e}");
            }
            let found = offsets(&mut tracer, target, DVec3::new(1.0, noise.next(), -slope));
            assert!(found.len() == 1 && found[0].abs() * slope < RESIDUAL, "{found:?} at {y}, {slope:e}");
        }
    }
}

#[test]
fn a_crossing_at_a_triple_root_is_hit() {
    let scene = cubic();
    let mut tracer = scene.tracer();
    let mut noise = Noise(106);
    for number in 0..400 {
        let y = noise.next();
        // within rounding of three roots in one, where the ray goes through the surface all the same
        let slope = if number % 4 == 0 { 0.0 } else { libm::pow(10.0, -10.0 - 8.0 * (noise.next() + 0.5)) };
        let target = DVec3::new(0.0, y, 0.0);
        let found = offsets(&mut tracer, target, DVec3::new(1.0, noise.next(), slope));
        assert!(!found.is_empty(), "at y {y}, slope {slope:e}");
        assert!(found.iter().all(|l| l.abs() < 1e-4), "{found:?} at y {y}, slope {slope:e}");
    }
}

/// Silhouettes of random patches: the roots on either side of a tangent line that is moved along the normal, to the
/// second order.
#[test]
fn silhouettes_are_cut_twice_or_missed() {
    let mut noise = Noise(107);
    let mut tested = 0;
    for case in 0..40 {
        let spread = if case % 2 == 0 { 1.0 } else { 4.0 };
        let patch = random_patch(&mut noise, [2 + case % 3, 2 + case / 3 % 3], 0.8, spread);
        let scene = scene_of(vec![whole(patch.clone())]);
        let mut tracer = scene.tracer();
        for _ in 0..20 {
            let st = 0.5 + 0.8 * noise.vector().truncate();
            let Some(direction) = near_tangent(&mut noise, &patch, st, 0.0) else { continue };
            let point = patch.eval(st);
            let normal = point.dp_ds.cross(point.dp_dt).normalize();
            let curvature = normal_curvature(&patch, st, direction, normal);
            if curvature.abs() < 0.5 {
                continue;
            }
            tested += 1;
            for d in [1e-7, 1e-9, 1e-11] {
                let inward = d * curvature.signum() * normal;
                let want = (2.0 * d / curvature.abs()).sqrt();
                let near = |mut found: Vec<f64>| {
                    found.retain(|l| l.abs() < 3.0 * want);
                    found
                };
                let what = format!("case {case} at {st}, curvature {curvature}, offset {d:e}, want {want:e}");
                let cut = near(offsets(&mut tracer, point.position + inward, direction));
                assert!(cut.len() == 2, "{cut:?} {what}");
                let off = (cut[0] + want).abs().max((cut[1] - want).abs());
                assert!(off < 0.1 * want, "{cut:?} {what}");
                let missed = near(offsets(&mut tracer, point.position - inward, direction));
                assert!(missed.is_empty(), "{missed:?} {what}");
            }
        }
    }
    assert!(tested > 400, "most places are curved: {tested}");
}

/// Height of the surface above its tangent plane along a unit tangent, twice, for each squared length.
fn normal_curvature(patch: &BezierPatch, st: DVec2, tangent: DVec3, normal: DVec3) -> f64 {
    const STEP: f64 = 1e-4;
    let point = patch.eval(st);
    let (s, t) = (point.dp_ds, point.dp_dt);
    let (ss, stt, tt) = (s.dot(s), s.dot(t), t.dot(t));
    let (a, b) = (tangent.dot(s), tangent.dot(t));
    let along = DVec2::new(a * tt - b * stt, b * ss - a * stt) / (ss * tt - stt * stt);
    let height = |step: f64| normal.dot(patch.eval(st + step * along).position - point.position);
    (height(STEP) + height(-STEP)) / (STEP * STEP)
}
