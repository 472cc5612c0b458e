//! Reflection at smooth interfaces: the Fresnel equations for unpolarised light.

use glam::DVec3;

/// What happens at an interface between two dielectrics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Interface {
    /// Share of the light that is reflected.
    pub(super) reflectance: f64,
    /// Cosine of the refracted direction with the normal; negative for light from the normal's side.
    pub(super) cos_transmitted: f64,
    /// Index of refraction of the far side over that of the near side.
    pub(super) eta: f64,
    /// The same the other way round, by which the refracted direction's tangential part shrinks.
    pub(super) inverse_eta: f64,
}

/// The Fresnel equations of dielectrics, with `eta` the index of refraction of the side that the normal turns away from
/// over that of the other side, and `cos` the cosine of the incoming direction with the normal, of any sign.
///
/// Total reflection has a reflectance of 1.
pub(super) fn dielectric(cos: f64, eta: f64) -> Interface {
    let (eta, inverse_eta) = if cos >= 0.0 { (eta, 1.0 / eta) } else { (1.0 / eta, eta) };
    // Snell's law
    let cos_sq = 1.0 - (1.0 - cos * cos) * (inverse_eta * inverse_eta);
    let (incident, transmitted) = (cos.abs(), cos_sq.max(0.0).sqrt());
    let reflectance = if eta == 1.0 {
        0.0
    } else if incident == 0.0 {
        1.0
    } else {
        let perpendicular = (incident - eta * transmitted) / (incident + eta * transmitted);
        let parallel = (transmitted - eta * incident) / (transmitted + eta * incident);
        0.5 * (perpendicular * perpendicular + parallel * parallel)
    };
    let cos_transmitted = if cos >= 0.0 { -transmitted } else { transmitted };
    Interface { reflectance, cos_transmitted, eta, inverse_eta }
}

/// The Fresnel equations of conductors with index of refraction `eta + i·k`, for each colour by itself; light comes from
/// outside, `cos` > 0 (K. D. Möller, Optics, 1988).
///
/// `eta` 0 with `k` 1 reflects all light.
pub(super) fn conductor(cos: f64, eta: DVec3, k: DVec3) -> DVec3 {
    let channel = |eta: f64, k: f64| {
        let cos_sq = cos * cos;
        let sin_sq = 1.0 - cos_sq;
        let difference = eta * eta - k * k - sin_sq;
        let sum = (difference * difference + 4.0 * k * k * eta * eta).sqrt();
        let a = (0.5 * (sum + difference)).max(0.0).sqrt();
        let (even, odd) = (sum + cos_sq, 2.0 * cos * a);
        let perpendicular = (even - odd) / (even + odd);
        let (even, odd) = (sum * cos_sq + sin_sq * sin_sq, odd * sin_sq);
        let parallel = perpendicular * (even - odd) / (even + odd);
        0.5 * (perpendicular + parallel)
    };
    DVec3::new(channel(eta.x, k.x), channel(eta.y, k.y), channel(eta.z, k.z))
}

/// Share of diffuse light that an interface reflects back to the side it comes from, `eta` the far side's index of
/// refraction over the near side's.
///
/// The two fits that Mitsuba takes: Egan and Hilgeman (1973) below 1, d'Eon and Irving (2011) from 1 on, within 0.2 % for
/// common materials.
pub(super) fn diffuse_reflectance(eta: f64) -> f64 {
    let inverse = 1.0 / eta;
    if eta < 1.0 {
        0.0636 * inverse + (eta * (eta * -1.4399 + 0.7099) + 0.6681)
    } else {
        [-1.36881, 4.98554, -7.80989, 6.75335, -3.4793, 0.919317]
            .into_iter()
            .fold(0.0, |sum, coefficient| sum * inverse + coefficient)
    }
}

/// The mirror image of a direction about a normal.
pub(super) fn reflect(direction: DVec3, normal: DVec3) -> DVec3 {
    normal * (2.0 * direction.dot(normal)) - direction
}

/// The direction behind an interface, `interface` computed for `direction` and `normal`.
pub(super) fn refract(direction: DVec3, normal: DVec3, interface: &Interface) -> DVec3 {
    let along = direction.dot(normal) * interface.inverse_eta + interface.cos_transmitted;
    normal * along - direction * interface.inverse_eta
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_incidence_has_its_closed_form() {
        for eta in [0.5, 1.3, 1.5, 2.4] {
            let want = ((eta - 1.0) / (eta + 1.0_f64)).powi(2);
            for cos in [1.0, -1.0] {
                let got = dielectric(cos, eta).reflectance;
                assert!((got - want).abs() < 1e-15, "eta {eta}, cos {cos}: {got}, want {want}");
            }
        }
        // ((eta - 1)² + k²) / ((eta + 1)² + k²)
        let (eta, k) = (DVec3::new(0.2, 1.5, 0.0), DVec3::new(3.9, 0.0, 1.0));
        let want = ((eta - 1.0) * (eta - 1.0) + k * k) / ((eta + 1.0) * (eta + 1.0) + k * k);
        let off = (conductor(1.0, eta, k) - want).abs().max_element();
        assert!(off < 1e-15, "off by {off:e}");
    }

    #[test]
    fn a_conductor_without_absorption_is_a_dielectric() {
        for i in 1..100 {
            let cos = f64::from(i) / 100.0;
            let want = dielectric(cos, 1.5).reflectance;
            let got = conductor(cos, DVec3::splat(1.5), DVec3::ZERO).x;
            assert!((got - want).abs() < 1e-14, "cos {cos}: {got}, want {want}");
            assert_eq!(conductor(cos, DVec3::ZERO, DVec3::ONE), DVec3::ONE, "a mirror");
        }
    }

    #[test]
    fn refraction_follows_snell() {
        let normal = DVec3::new(0.6, 0.0, 0.8);
        for i in 0..200 {
            let angle = 0.031 * f64::from(i);
            let direction = DVec3::new(libm::sin(angle), 0.3, libm::cos(angle)).normalize();
            let interface = dielectric(direction.dot(normal), 1.5);
            let refracted = refract(direction, normal, &interface);
            let sin = direction.cross(normal).length();
            if sin * interface.inverse_eta >= 1.0 {
                assert!((interface.reflectance - 1.0).abs() < 1e-15, "total reflection");
                continue;
            }
            assert!((refracted.length() - 1.0).abs() < 1e-14);
            assert!((refracted.cross(normal).length() * interface.eta - sin).abs() < 1e-14);
            assert!(refracted.dot(normal) * direction.dot(normal) < 0.0, "on the far side");
            // the way back loses as much
            let back = dielectric(refracted.dot(normal), 1.5);
            assert!((back.reflectance - interface.reflectance).abs() < 1e-9);
        }
    }

    #[test]
    fn diffuse_reflectance_is_near_its_integral() {
        for eta in [1.0 / 1.5, 1.1, 1.33, 1.5, 1.9] {
            // ∫ F(cos) 2 cos dcos by the midpoint rule
            let n = 20_000;
            let integral: f64 = (0..n)
                .map(|i| (f64::from(i) + 0.5) / f64::from(n))
                .map(|cos| 2.0 * cos * dielectric(cos, eta).reflectance / f64::from(n))
                .sum();
            let got = diffuse_reflectance(eta);
            assert!((got / integral - 1.0).abs() < 0.02, "eta {eta}: {got}, integral {integral}");
        }
    }
}
