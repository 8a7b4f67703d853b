//! Numbers with a unit or a percent sign: `3 cm`, `3cm`, `30%`.
//!
//! In: the token behind a number, or a number with letters. Out: how to write the number. Invariant: the language has numbers only.

/// Words that are taken for units behind a number.
const UNITS: [&str; 38] = [
    "m", "cm", "mm", "km", "um", "nm", "s", "ms", "us", "ns", "min", "h", "d", "g", "kg", "mg", "t", "deg",
    "rad", "Hz", "kHz", "MHz", "V", "mV", "A", "mA", "W", "kW", "J", "N", "K", "C", "F", "Pa", "bar", "l",
    "dB", "percent",
];

/// The help for a cell, or an option, that is a number with a unit: `3 cm`, `3cm`, `30%`.
pub(crate) fn in_value(text: &str) -> Option<String> {
    let text = text.trim();
    let end = text.rfind(|sign: char| sign.is_ascii_digit())? + 1;
    let (number, unit) = (text[..end].trim_start_matches(['-', '+']), text[end..].trim());
    number.parse::<f64>().is_ok().then(|| help(number, unit)).flatten()
}

/// The help for a token that was not expected behind this text.
pub(crate) fn help(before: &str, found: &str) -> Option<String> {
    let is_number = |text: &str| text.starts_with(|first: char| first.is_ascii_digit());
    if is_number(found) {
        let digits = found.trim_end_matches(|letter: char| letter.is_alphabetic());
        let unit = &found[digits.len()..];
        let plain = digits.chars().all(|digit| digit.is_ascii_digit() || matches!(digit, '_' | '.'));
        // `1e5` and `0x1f` are other mistakes.
        return (plain && !unit.is_empty() && !unit.starts_with(['e', 'E'])).then(|| plainly(digits, unit));
    }
    let of_number = |sign: char| sign.is_ascii_digit() || matches!(sign, '.' | '_');
    let start = before.trim_end_matches(of_number).len();
    let number = &before[start..];
    if !is_number(number) || before[..start].ends_with(|letter: char| letter.is_alphanumeric()) {
        return None;
    }
    match found {
        "%" => {
            let share: f64 = number.replace('_', "").parse().ok()?;
            // Without the last digits, which come from rounding.
            Some(format!("write the share itself: `{number}%` is `{}`", (share * 1e10).round() / 1e12))
        }
        "°" => Some(plainly(number, found)),
        unit => UNITS.contains(&unit).then(|| plainly(number, unit)),
    }
}

/// The help for a name that is no variable, and may be the unit of the number before it.
pub(crate) fn behind_number(name: &str) -> Option<String> {
    let help = "numbers have no units: write the number alone, and name the unit in a comment";
    UNITS.contains(&name).then(|| help.to_owned())
}

fn plainly(number: &str, unit: &str) -> String {
    format!("numbers have no units: write `{number}`, and name the unit `{unit}` in a comment")
}
