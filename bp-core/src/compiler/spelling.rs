//! Notation of names and numbers.
//!
//! In: any name: `Rain`, `Asy/Patch`, `<5`. Out: its spelling: `Rain`, `"Asy/Patch"`, `"<5"`. Invariant: [`unquoted`] of
//! [`quoted`] is the name, and the spelling is one token of Rust, so that it passes through a macro.

use pest::unicode::{XID_CONTINUE, XID_START};
use std::borrow::Cow;

/// Words that are names only if quoted.
pub const RESERVED: [&str; 13] =
    ["if", "else", "match", "let", "in", "and", "or", "not", "table", "prod", "true", "false", "P"];

/// A name, quoted unless it is a plain word.
pub fn quoted(name: &str) -> Cow<'_, str> {
    let mut letters = name.chars();
    let begins = letters.next().is_some_and(|first| first == '_' || XID_START(first));
    if begins && letters.all(XID_CONTINUE) && name != "_" && !RESERVED.contains(&name) {
        return Cow::Borrowed(name);
    }
    let mut text = String::with_capacity(name.len() + 2);
    text.push('"');
    for letter in name.chars() {
        match letter {
            '"' | '\\' => text.extend(['\\', letter]),
            '\n' => text.push_str("\\n"),
            '\r' => text.push_str("\\r"),
            '\t' => text.push_str("\\t"),
            other => text.push(other),
        }
    }
    text.push('"');
    Cow::Owned(text)
}

/// A number for display: 0.3 for 0.1 + 0.2, 1e-9, 123456. Fifteen digits, without trailing zeros.
pub fn number(number: f64) -> String {
    if number == 0.0 {
        return "0".to_owned();
    }
    let rounded: f64 = format!("{number:.14e}").parse().unwrap_or(number);
    match rounded.abs() {
        1e-4..1e15 => rounded.to_string(),
        _ if rounded.is_finite() => format!("{rounded:e}"),
        _ if number.is_finite() => format!("{number:e}"),
        _ => number.to_string(),
    }
}

/// A number with all of its digits, as it can be typed: 0.1, 1e200, 5e-324. Zero has no sign.
pub fn exact(number: f64) -> String {
    let text = format!("{:?}", number + 0.0);
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

/// Numbers as a list: `[2, 1]`.
pub fn list(numbers: &[f64]) -> String {
    let numbers: Vec<String> = numbers.iter().copied().map(exact).collect();
    format!("[{}]", numbers.join(", "))
}

/// The name of a spelling.
pub fn unquoted(spelling: &str) -> Cow<'_, str> {
    let Some(inside) = spelling.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')) else {
        return Cow::Borrowed(spelling);
    };
    if !inside.contains('\\') {
        return Cow::Borrowed(inside);
    }
    let (mut name, mut letters) = (String::with_capacity(inside.len()), inside.chars());
    while let Some(letter) = letters.next() {
        match (letter, letter == '\\') {
            (_, true) => match letters.next() {
                Some('n') => name.push('\n'),
                Some('r') => name.push('\r'),
                Some('t') => name.push('\t'),
                Some(same) => name.push(same),
                None => {}
            },
            (letter, false) => name.push(letter),
        }
    }
    Cow::Owned(name)
}

/// The length of the quoted name at the start of a text, if there is one: up to a `"` on the same line.
pub fn quoted_length(text: &str) -> Option<usize> {
    let mut escaped = false;
    for (position, byte) in text.bytes().enumerate().skip(1) {
        match byte {
            b'\n' => return None,
            b'"' if !escaped => return text.starts_with('"').then_some(position + 1),
            _ => escaped = byte == b'\\' && !escaped,
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_people_write_them() {
        let numbers = [0.1 + 0.2, 1e-9, -0.0, 123456.0, 1e22, -2.5, 1.0 / 3.0, 1.0 - 1e-16, f64::MAX];
        let texts = [
            "0.3",
            "1e-9",
            "0",
            "123456",
            "1e22",
            "-2.5",
            "0.333333333333333",
            "1",
            "1.7976931348623157e308",
        ];
        assert_eq!(numbers.map(number), texts);
        assert_eq!([f64::NAN, f64::NEG_INFINITY].map(number), ["NaN", "-inf"]);
        let numbers = [0.1 + 0.2, 1e200, -0.0, 5e-324, -3.0, 1234567.5];
        let texts = ["0.30000000000000004", "1e200", "0", "5e-324", "-3", "1234567.5"];
        assert_eq!(numbers.map(exact), texts);
    }

    #[test]
    fn any_name_comes_back() {
        for (name, spelling) in [
            ("Rain", "Rain"),
            ("σ_1", "σ_1"),
            ("Asy/Patch", "\"Asy/Patch\""),
            ("<5", "\"<5\""),
            ("12+", "\"12+\""),
            ("true", "\"true\""),
            ("P", "\"P\""),
            ("_", "\"_\""),
            ("two words", "\"two words\""),
            ("say \"a\\b\"\n", "\"say \\\"a\\\\b\\\"\\n\""),
        ] {
            assert_eq!(quoted(name), spelling);
            assert_eq!(unquoted(spelling), name);
            if spelling.starts_with('"') {
                assert_eq!(quoted_length(&format!("{spelling} \"")), Some(spelling.len()));
            }
        }
        assert_eq!(quoted_length("\"open\n\""), None);
    }
}
