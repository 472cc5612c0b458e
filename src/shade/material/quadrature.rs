//! Gauss–Legendre quadrature.

/// Points and weights of the Gauss–Legendre rule of `order` points on `[0, 1]`, with weights of sum 1.
///
/// Newton's method on the Legendre polynomial (Abramowitz and Stegun 1964, 25.4.29).
pub(super) fn gauss_legendre(order: u32) -> Vec<(f64, f64)> {
    let n = f64::from(order);
    (0..order)
        .map(|i| {
            let mut x = -libm::cos(std::f64::consts::PI * (f64::from(i) + 0.75) / (n + 0.5));
            let mut derivative = 1.0;
            for _ in 0..8 {
                let (mut before, mut value) = (1.0, x);
                for k in 2..=order {
                    let k = f64::from(k);
                    (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
                }
                derivative = n * (x * value - before) / (x * x - 1.0);
                x -= value / derivative;
            }
            (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * derivative * derivative))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_integrated_exactly() {
        for order in [2, 3, 32, 128] {
            let rule = gauss_legendre(order);
            for power in 0..2 * order {
                let got: f64 = rule.iter().map(|(x, weight)| weight * libm::pow(*x, power.into())).sum();
                let want = 1.0 / f64::from(power + 1);
                assert!((got - want).abs() < 1e-14, "order {order}, power {power}: {got}, want {want}");
            }
            let next: f64 = rule.iter().map(|(x, weight)| weight * libm::pow(*x, (2 * order).into())).sum();
            let off = (next - 1.0 / f64::from(2 * order + 1)).abs();
            assert!(order > 3 || off > 1e-4, "not for the next power, at low order");
        }
    }
}
