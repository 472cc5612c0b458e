//! Discs of complex numbers: what bounds of analytic functions are made of.

use super::number::{Number, SIZES};

/// Discs {z: |z - centre| <= radius} of complex numbers with one centre, which is real, and [`SIZES`] radii.
///
/// Every operation gives discs that hold all results; a function that is real on the real axis takes discs around real
/// numbers to such. A function that is not analytic on a disc gets radius infinity or NaN. The first disc is an interval: of
/// its numbers only the real ones are meant, so that it is finite wherever functions are finite, analytic or not.
/// The rounding of centres is left out; users of discs allow for it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    centre: f64,
    radius: [f64; SIZES],
}

impl Disc {
    fn map(self, centre: f64, radius: impl Fn(f64) -> f64) -> Self {
        Self { centre, radius: self.radius.map(radius) }
    }

    /// A function that is analytic but for x <= 0 and monotone on [0, infinity). `change` bounds |f(z) - f(centre)| over a
    /// disc whose radius is below the centre.
    fn map_positive(self, value: impl Fn(f64) -> f64, change: impl Fn(f64) -> f64) -> Self {
        let centre = value(self.centre.max(0.0));
        let mut made =
            self.map(centre, |radius| if radius < self.centre { change(radius) } else { f64::INFINITY });
        if !made.radius[0].is_finite() {
            let end = |sign: f64| value((self.centre + sign * self.radius[0]).max(0.0));
            made.radius[0] = (end(-1.0) - centre).abs().max((end(1.0) - centre).abs());
        }
        made
    }

    /// The image by a function whose derivative is in the discs `slope`.
    fn with_slope(self, centre: f64, slope: Self) -> Self {
        let mut made = self;
        made.centre = centre;
        for (radius, slope_radius) in made.radius.iter_mut().zip(slope.radius) {
            *radius *= slope.centre.abs() + slope_radius;
        }
        made
    }
}

impl Number for Disc {
    const SINGLE: bool = false;

    fn constant(value: f64) -> Self {
        Self { centre: value, radius: [0.0; SIZES] }
    }

    fn around(centre: f64, reach: impl FnOnce() -> [f64; SIZES]) -> Self {
        Self { centre, radius: reach() }
    }

    fn centre(self) -> f64 {
        self.centre
    }

    fn reach(self) -> [f64; SIZES] {
        self.radius
    }

    fn add(self, other: Self) -> Self {
        let mut sum = self;
        sum.centre += other.centre;
        for (radius, more) in sum.radius.iter_mut().zip(other.radius) {
            *radius += more;
        }
        sum
    }

    fn multiply(self, other: Self) -> Self {
        let mut product = self;
        product.centre *= other.centre;
        let (a, b) = (self.centre.abs(), other.centre.abs());
        for (radius, more) in product.radius.iter_mut().zip(other.radius) {
            *radius = a * more + (b + more) * *radius;
        }
        product
    }

    fn scale(self, factor: f64) -> Self {
        self.map(self.centre * factor, |radius| radius * factor.abs())
    }

    fn reciprocal(self) -> Self {
        let size = self.centre.abs();
        self.map(1.0 / self.centre, |radius| {
            if radius < size { radius / (size * (size - radius)) } else { f64::INFINITY }
        })
    }

    fn exp(self) -> Self {
        let centre = libm::exp(self.centre);
        self.map(centre, |radius| centre * libm::expm1(radius))
    }

    fn exp_minus_1(self) -> Self {
        let size = libm::exp(self.centre);
        self.map(libm::expm1(self.centre), |radius| size * libm::expm1(radius))
    }

    fn sin(self) -> Self {
        let (sin, cos) = (libm::sin(self.centre), libm::cos(self.centre));
        let mut made = self.map(sin, |radius| turned(cos.abs(), sin.abs(), radius));
        made.radius[0] = self.radius[0].min(2.0);
        made
    }

    fn cos(self) -> Self {
        let (sin, cos) = (libm::sin(self.centre), libm::cos(self.centre));
        let mut made = self.map(cos, |radius| turned(sin.abs(), cos.abs(), radius));
        made.radius[0] = self.radius[0].min(2.0);
        made
    }

    fn ln(self) -> Self {
        self.map_positive(libm::log, |radius| -libm::log1p(-radius / self.centre))
    }

    fn asin(self) -> Self {
        let slope = Self::constant(1.0).subtract(self.multiply(self)).power(-0.5);
        let mut made = self.with_slope(libm::asin(self.centre.clamp(-1.0, 1.0)), slope);
        if !made.radius[0].is_finite() {
            made.radius[0] = std::f64::consts::PI;
        }
        made
    }

    fn atan(self) -> Self {
        let slope = Self::constant(1.0).add(self.multiply(self)).reciprocal();
        let mut made = self.with_slope(libm::atan(self.centre), slope);
        made.radius[0] = self.radius[0].min(std::f64::consts::PI);
        made
    }

    fn power(self, exponent: f64) -> Self {
        // the binomial series of (1 + z / centre)^exponent, with absolute values
        let change = |radius: f64| {
            let part = radius / self.centre;
            let growth = if (0.0..=1.0).contains(&exponent) {
                -libm::expm1(exponent * libm::log1p(-part))
            } else {
                libm::expm1(-exponent.abs() * libm::log1p(-part))
            };
            libm::pow(self.centre, exponent) * growth
        };
        self.map_positive(|x| libm::pow(x, exponent), change)
    }
}

/// |sin(c + z) - sin c| for |z| = radius, by sin z and cos z - 1 and the absolute values of their factors.
fn turned(of_sine: f64, of_cosine: f64, radius: f64) -> f64 {
    of_sine * libm::sinh(radius) + of_cosine * (libm::cosh(radius) - 1.0)
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::test_support::Noise;

    type OfDisc = fn(Disc) -> Disc;
    type OfComplex = fn(Complex64) -> Complex64;

    const FUNCTIONS: [(&str, OfDisc, OfComplex); 12] = [
        ("1/z", |z| z.reciprocal(), |z| z.inv()),
        ("exp", |z| z.exp(), |z| z.exp()),
        ("exp - 1", |z| z.exp_minus_1(), |z| z.exp() - 1.0),
        ("sin", |z| z.sin(), |z| z.sin()),
        ("cos", |z| z.cos(), |z| z.cos()),
        ("ln", |z| z.ln(), |z| z.ln()),
        ("asin", |z| z.asin(), |z| z.asin()),
        ("atan", |z| z.atan(), |z| z.atan()),
        ("sqrt", |z| z.power(0.5), |z| z.sqrt()),
        ("z^2.5", |z| z.power(2.5), |z| z.powf(2.5)),
        ("z^-1.3", |z| z.power(-1.3), |z| z.powf(-1.3)),
        ("z (z + 2)", |z| z.multiply(z.add(Disc::constant(2.0))), |z| z * (z + 2.0)),
    ];

    #[test]
    fn images_are_in_their_discs() {
        let mut noise = Noise(5);
        for (name, of_disc, of_complex) in FUNCTIONS {
            let (mut finite, mut tightest) = (0, 0.0_f64);
            for _ in 0..400 {
                let (centre, radius) = (3.0 * noise.next(), 1.5 * (noise.next() + 0.5));
                let disc = Disc::around(centre, || [radius; SIZES]);
                let image = of_disc(disc);
                let [real, whole, ..] = image.reach();
                finite += usize::from(whole.is_finite());
                for _ in 0..40 {
                    let part = std::f64::consts::TAU * noise.next();
                    let z = Complex64::new(centre, 0.0) + Complex64::from_polar(radius, part);
                    let off = (of_complex(z) - image.centre()).norm();
                    let bound = whole * (1.0 + 1e-12) + 1e-12;
                    assert!(!whole.is_finite() || off <= bound, "{name} at {z} of {disc:?}: {off}");
                    if whole.is_finite() {
                        tightest = tightest.max(off / whole);
                    }
                    let x = centre + 2.0 * radius * noise.next();
                    let off = (of_complex(x.into()).re - image.centre()).abs();
                    let real_there = of_complex(x.into()).im == 0.0;
                    assert!(!real_there || off <= real * (1.0 + 1e-12) + 1e-12, "{name} at {x} of {disc:?}");
                }
            }
            assert!(finite > 50 && tightest > 0.5, "{name}: {finite} finite, {tightest} of the bounds");
        }
    }

    #[test]
    fn functions_that_are_not_analytic_on_a_disc_have_no_bound() {
        let disc = Disc::around(0.5, || [1.0; SIZES]);
        for image in [disc.reciprocal(), disc.ln(), disc.power(0.5), disc.asin()] {
            assert!(!image.reach()[1].is_finite());
        }
        assert!(disc.power(0.5).reach()[0] <= 1.0, "real numbers have square roots");
        assert!(disc.asin().reach()[0].is_finite());
    }
}
