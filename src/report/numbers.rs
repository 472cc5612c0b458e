//! Numbers as people read them.

/// Three digits where the size is everyday, otherwise [`scientific`].
pub(super) fn short(value: f64) -> String {
    let size = value.abs();
    match size {
        _ if value.is_nan() => "–".to_owned(),
        _ if value.is_infinite() => if value > 0.0 { "∞" } else { "−∞" }.to_owned(),
        0.0 => "0".to_owned(),
        0.001..999.5 => {
            let decimals = (0_u8..5).find(|&n| size * libm::exp10(f64::from(n)) >= 99.95).unwrap_or(5);
            format!("{value:.*}", usize::from(decimals))
        }
        999.5..1e6 if value > 0.0 => grouped(&format!("{value:.0}")),
        _ => scientific(value),
    }
}

/// Two digits and a power of ten.
pub(super) fn scientific(value: f64) -> String {
    if value.is_finite() && value != 0.0 { format!("{value:.1e}") } else { short(value) }
}

/// A share of a whole, in per cent where it is not tiny.
pub(super) fn share(value: f64) -> String {
    if value < 1e-4 { scientific(value) } else { format!("{} %", short(value * 100.0)) }
}

/// With its thousands apart.
pub(super) fn count(value: usize) -> String {
    grouped(&value.to_string())
}

/// A count that may be large or estimated.
pub(super) fn about(value: f64) -> String {
    match value {
        1e12.. => scientific(value),
        1e9.. => format!("{} billion", short(value / 1e9)),
        1e6.. => format!("{} million", short(value / 1e6)),
        _ => grouped(&format!("{value:.0}")),
    }
}

/// In decimal units.
pub(super) fn bytes(value: f64) -> String {
    const UNITS: [(f64, &str); 3] = [(1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    match UNITS.iter().find(|(unit, _)| value >= unit * 0.9995) {
        Some((unit, name)) if value / unit < 10.0 => format!("{:.1} {name}", value / unit),
        Some((unit, name)) => format!("{:.0} {name}", value / unit),
        None => format!("{value:.0} B"),
    }
}

fn grouped(digits: &str) -> String {
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_readable() {
        let shorts = [0.0, 0.001_234, 0.012_34, 1.234, 12.34, 999.7, 12_345.6, 1.2e7, 1.23e-5, f64::NAN];
        let expected = ["0", "0.00123", "0.0123", "1.23", "12.3", "1,000", "12,346", "1.2e7", "1.2e-5", "–"];
        assert_eq!(shorts.map(short), expected);
        assert_eq!((short(f64::INFINITY).as_str(), short(-0.5).as_str()), ("∞", "-0.500"));
        assert_eq!([12, 123, 12_288, 1_234_567].map(count), ["12", "123", "12,288", "1,234,567"]);
        assert_eq!(
            [12_288.0, 3.4e6, 5e10, 2e13].map(about),
            ["12,288", "3.40 million", "50.0 billion", "2.0e13"]
        );
        assert_eq!([12.0, 3.4e6, 999.9e3, 12e9].map(bytes), ["12 B", "3.4 MB", "1.0 MB", "12 GB"]);
        assert_eq!([0.012, 1e-5].map(share), ["1.20 %", "1.0e-5"]);
    }
}
