//! Distances from flat triangles.

use glam::DVec3;

/// Distance of a point from a closed triangle (Ericson 2005, *Real-Time Collision Detection*, section 5.1.5). One without area
/// is taken for its longest edge.
pub(super) fn distance([a, b, c]: [DVec3; 3], point: DVec3) -> f64 {
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    let (d3, d4) = (ab.dot(point - b), ac.dot(point - b));
    let (d5, d6) = (ab.dot(point - c), ac.dot(point - c));
    let (of_c, of_b, of_a) = (d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4);
    let whole = of_a + of_b + of_c;
    if of_a > 0.0 && of_b > 0.0 && of_c > 0.0 && whole > 0.0 {
        let normal = ab.cross(ac);
        return (normal.dot(ap) / normal.length()).abs();
    }
    [[a, b], [b, c], [c, a]].into_iter().map(|edge| to_segment(edge, point)).fold(f64::INFINITY, f64::min)
}

/// The four triangles between a triangle's corners and the middles of its edges.
pub(super) fn quarters<T: Copy>([a, b, c]: [T; 3], middle: impl Fn(T, T) -> T) -> [[T; 3]; 4] {
    let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

fn to_segment([a, b]: [DVec3; 2], point: DVec3) -> f64 {
    let along = b - a;
    let fraction = ((point - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    // NaN for an edge without length
    let nearest = if fraction.is_nan() { a } else { a + fraction * along };
    point.distance(nearest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Noise;

    #[test]
    fn distances_are_those_of_the_nearest_of_many_points() {
        let mut noise = Noise(81);
        for case in 0..200 {
            let corners: [DVec3; 3] = std::array::from_fn(|_| noise.vector());
            let point = if case % 2 == 0 { 2.0 * noise.vector() } else { corners[0].lerp(corners[1], 0.3) };
            let got = distance(corners, point);
            let mut least = f64::INFINITY;
            for i in 0..=100 {
                for j in 0..=100 - i {
                    let [u, v] = [f64::from(i), f64::from(j)].map(|k| k / 100.0);
                    let p = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
                    least = least.min(p.distance(point));
                }
            }
            assert!(got <= least + 1e-15 && least <= got + 0.05, "{got} {least}");
        }
        let flat = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X];
        assert_eq!(distance(flat, DVec3::new(1.5, 1.0, 0.0)), 1.0);
        assert_eq!(distance([DVec3::X; 3], DVec3::ZERO), 1.0);
    }
}
