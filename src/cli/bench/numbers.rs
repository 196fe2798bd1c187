//! Numbers as tables and pictures show them.

/// A whole number with commas: `1,000,006`.
pub fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A whole number as people write it on a command line: `300k`, `1M`, `1500`, exactly.
pub fn short(number: usize) -> String {
    match number {
        0 => "0".into(),
        n if n % 1_000_000 == 0 => format!("{}M", n / 1_000_000),
        n if n % 1000 == 0 => format!("{}k", n / 1000),
        n => n.to_string(),
    }
}

/// Three digits that count, or all before the point: `0.123`, `1.23`, `12.3`, `1234`.
pub fn three_digits(number: f64) -> String {
    let decimals = match number.abs() {
        n if n >= 99.95 => 0,
        n if n >= 9.995 => 1,
        n if n >= 0.9995 => 2,
        _ => 3,
    };
    format!("{number:.decimals$}")
}

/// Seconds as milliseconds.
pub fn millis(secs: f64) -> String {
    three_digits(secs * 1e3)
}

/// A fraction as a percentage: `10 %`, `0.5 %`.
pub fn percent(fraction: f64) -> String {
    // Rounded, for 0.07 × 100 is not 7.
    format!("{} %", (fraction * 1e8).round() / 1e6)
}

/// A length as a fraction of the diagonal; of a point, nothing is a fraction.
pub fn relative(length: f64, diagonal: f64) -> f64 {
    if diagonal > 0.0 { length / diagonal } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!([0, 999, 1000, 1_000_006].map(grouped), ["0", "999", "1,000", "1,000,006"]);
        assert_eq!([0, 999, 1500, 300_000, 2_000_000].map(short), ["0", "999", "1500", "300k", "2M"]);
        let digits = [0.0, 0.1234, 0.99949, 0.9996, 9.994, 9.996, 99.96, 1234.5].map(three_digits);
        assert_eq!(digits, ["0.000", "0.123", "0.999", "1.00", "9.99", "10.0", "100", "1234"]);
        assert_eq!([0.1, 0.01, 0.005, 0.07, 1.0].map(percent), ["10 %", "1 %", "0.5 %", "7 %", "100 %"]);
    }
}
