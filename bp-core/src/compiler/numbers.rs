//! Numbers and bars for display.
//!
//! In: numbers. Out: text. Invariant: six significant digits, for any magnitude.

/// A number with six significant digits.
pub fn six_digits(number: f64) -> String {
    // Zero is printed without a sign.
    let number = number + 0.0;
    if number == 0.0 || !number.is_finite() {
        return number.to_string();
    }
    // The exponent after rounding: 0.9999999 is 1.00000.
    let scientific = format!("{number:.5e}");
    let exponent: i32 = scientific.rsplit('e').next().and_then(|text| text.parse().ok()).unwrap_or(0);
    match exponent {
        -4..=5 => format!("{number:.*}", (5 - exponent) as usize),
        _ => scientific,
    }
}

/// A count: a whole number below 10⁹, otherwise six significant digits.
pub fn count(number: f64) -> String {
    match number.abs() < 1e9 {
        true => format!("{:.0}", number.round() + 0.0),
        false => six_digits(number),
    }
}

/// An error: two significant digits are enough.
pub fn two_digits(number: f64) -> String {
    match format!("{number:.1e}").parse::<f64>() {
        Ok(rounded) if (1e-4..1e4).contains(&rounded.abs()) => rounded.to_string(),
        _ if number == 0.0 => "0".to_owned(),
        _ => format!("{number:.1e}"),
    }
}

/// A bar for a fraction of the width, in eighths of a cell; a nonzero fraction is visible.
pub fn bar(fraction: f64, width: usize) -> String {
    const EIGHTHS: [&str; 8] = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
    let fraction = if fraction.is_finite() { fraction.clamp(0.0, 1.0) } else { 0.0 };
    let eighths = (fraction * width as f64 * 8.0).round() as usize;
    let eighths = if fraction > 0.0 { eighths.max(1) } else { 0 };
    format!("{}{}", "█".repeat(eighths / 8), EIGHTHS[eighths % 8])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_digits_for_numbers_of_any_size() {
        let texts = [0.0, 1.0, 0.322580645, 0.99999999, 123456.7, 7.139e-9, -0.0725707, 1234567.0];
        let expected =
            ["0", "1.00000", "0.322581", "1.00000", "123457", "7.13900e-9", "-0.0725707", "1.23457e6"];
        assert_eq!(texts.map(six_digits), expected);
    }

    #[test]
    fn bars_are_in_eighths() {
        assert_eq!(bar(1.0, 3), "███");
        assert_eq!(bar(0.5, 3), "█▌");
        assert_eq!(bar(1e-9, 3), "▏");
        assert_eq!(bar(0.0, 3), "");
    }
}
