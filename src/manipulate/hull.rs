//! Whether a point is outside the convex hull of others.

use glam::DVec3;

/// Steps towards the nearest point of the hull; each needs all points once.
const STEPS: usize = 2000;

/// Whether a plane separates `point` from all of `points`: true is proved, false may be a near miss.
///
/// Source: Gilbert (1966), *An iterative procedure for computing the minimum of a quadratic form on a convex set*.
pub(super) fn is_outside(point: DVec3, points: &[DVec3]) -> bool {
    let Some(first) = points.first() else { return true };
    let mut nearest = *first - point;
    for _ in 0..STEPS {
        let along = |p: &DVec3| nearest.dot(*p - point);
        let Some(support) = points.iter().min_by(|a, b| along(a).total_cmp(&along(b))) else { return true };
        if along(support) > 1e-12 * nearest.length_squared() {
            return true;
        }
        let way = *support - point - nearest;
        let step = (-nearest.dot(way) / way.length_squared()).clamp(0.0, 1.0);
        if step.is_nan() || step <= 0.0 {
            return false;
        }
        nearest += step * way;
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Noise;

    #[test]
    fn the_hull_of_a_cube() {
        let cube: Vec<_> = (0..8_u32)
            .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)))
            .collect();
        let mut noise = Noise(4);
        for _ in 0..2000 {
            let p = DVec3::splat(0.5) + 1.5 * noise.vector();
            let beyond = (p - 0.5).abs().max_element() - 0.5;
            assert!(beyond > 0.0 || !is_outside(p, &cube), "{p} is inside");
            assert!(beyond < 0.02 || is_outside(p, &cube), "{p} is outside");
        }
        assert!(is_outside(DVec3::ZERO, &[]) && !is_outside(DVec3::ZERO, &[DVec3::ZERO]));
    }
}
