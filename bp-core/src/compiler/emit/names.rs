//! Identifiers of emitted code.
//!
//! In: any names that a program may have. Out: Rust identifiers, unique in their place. Invariant: `WetGrass` is
//! `wet_grass`; characters not allowed in identifiers become `_` (`P(O | Z)` is `p_o_z`) or their equivalent (`m²` is
//! `m2`); keywords of Rust get a `_`. If several names give one identifier, all but the first get a number: `rain`,
//! `rain_2`.

use crate::ids::Id;
use pest::unicode::{XID_CONTINUE, XID_START};
use std::collections::HashSet;
use unicode_normalization::UnicodeNormalization;

/// The keywords of Rust 2024, reserved ones included; `Self` is `self` in snake case.
const KEPT: [&str; 51] = [
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate", "do", "dyn",
    "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let", "loop",
    "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref", "return", "self", "static",
    "struct", "super", "trait", "true", "try", "type", "typeof", "unsafe", "unsized", "use", "virtual",
    "where", "while", "yield",
];

/// The identifiers of one scope: fields of a structure, modules of a program.
#[derive(Default)]
pub(super) struct Names(HashSet<String>);

impl Names {
    /// An unused identifier: the given one, or that with a number after it.
    pub(super) fn unique(&mut self, wanted: &str) -> String {
        let numbered = (2..).map(|number| format!("{}_{number}", wanted.trim_end_matches('_')));
        let mut candidates = std::iter::once(wanted.to_owned()).chain(numbered);
        let free = candidates.find(|candidate| !self.0.contains(candidate));
        let free = free.expect("internal: there are more numbers than names");
        self.0.insert(free.clone());
        free
    }
}

/// A name in snake case, as an identifier of Rust.
///
/// Rust compares identifiers in Unicode's normal form C; compatibility decomposition first turns `²` into `2` and `①`
/// into `1`.
pub fn snake(name: &str) -> String {
    let mut snake = String::new();
    let mut previous_lower = false;
    for character in name.nfkc() {
        if XID_CONTINUE(character) && character != '_' {
            if character.is_uppercase() && previous_lower {
                snake.push('_');
            }
            snake.extend(character.to_lowercase());
            previous_lower = !character.is_uppercase();
        } else {
            if !snake.ends_with('_') && !snake.is_empty() {
                snake.push('_');
            }
            previous_lower = false;
        }
    }
    let mut snake: String = snake.trim_end_matches('_').nfc().collect();
    // An underscore that the author wrote at the end stays; one from a bracket is removed.
    let underscores = name.len() - name.trim_end_matches('_').len();
    snake.push_str(&"_".repeat(underscores));
    match snake.chars().next() {
        None => "nameless".to_owned(),
        // `_` alone is not a name.
        Some('_') if snake == "_" => "__".to_owned(),
        Some(first) if first != '_' && !XID_START(first) => format!("_{snake}"),
        _ if KEPT.contains(&snake.as_str()) => format!("{snake}_"),
        _ => snake,
    }
}

/// Whether a name is an identifier of Rust without changes.
pub(super) fn is_identifier(name: &str) -> bool {
    let mut letters = name.chars();
    let first = letters.next().is_some_and(XID_START);
    let is_nfc = name.nfc().eq(name.chars());
    first && is_nfc && letters.all(XID_CONTINUE) && name != "Self" && !KEPT.contains(&name)
}

/// A name in camel case, as an identifier of Rust: the name of a type.
pub(super) fn camel(name: &str) -> String {
    let mut camel = String::new();
    for part in snake(name).split('_') {
        let mut letters = part.chars();
        camel.extend(letters.next().into_iter().flat_map(char::to_uppercase));
        camel.extend(letters);
    }
    match camel.chars().next() {
        Some(first) if XID_START(first) && camel != "Self" => camel,
        _ => format!("_{camel}_"),
    }
}

/// A local name.
pub(super) fn local(prefix: &str, id: impl Id) -> String {
    format!("{prefix}{}", id.position())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_identifiers() {
        let cases = [
            ("P(O | Z)", "p_o_z"),
            ("WetGrass", "wet_grass"),
            ("Sensors[i].reading", "sensors_i_reading"),
            ("O^-1", "o_1"),
            ("X1", "x1"),
            ("A1B", "a1_b"),
            ("crate", "crate_"),
            ("crate_", "crate_"),
            ("Self", "self_"),
            ("gen", "gen_"),
            ("async", "async_"),
            ("rate_", "rate_"),
            ("__", "__"),
            ("_", "__"),
            ("2nd", "_2nd"),
            ("m²", "m2"),
            ("①", "_1"),
            ("½", "_1_2"),
            ("→", "nameless"),
            ("Straße", "straße"),
            ("e\u{301}t\u{e9}", "\u{e9}t\u{e9}"),
            ("\u{301}", "_\u{301}"),
            ("K\u{212a}", "kk"),
            ("()", "nameless"),
        ];
        for (name, identifier) in cases {
            assert_eq!(snake(name), identifier, "{name}");
        }
    }

    #[test]
    fn types_are_in_camel_case_and_labels_keep_their_names() {
        let cases =
            [("wet_grass", "WetGrass"), ("Lamp", "Lamp"), ("X2", "X2"), ("self", "_Self_"), ("2nd", "_2nd_")];
        for (name, identifier) in cases {
            assert_eq!(camel(name), identifier, "{name}");
        }
        let kept = ["HIGH", "Off", "off", "é"].iter().all(|name| is_identifier(name));
        let not = ["Self", "crate", "2nd", "two words", ""].iter().any(|name| is_identifier(name));
        assert!(kept && !not);
    }

    #[test]
    fn an_identifier_is_taken_once() {
        let mut names = Names::default();
        let taken: Vec<String> =
            ["rain", "rain", "rain_2", "rain", "self_", "self_"].map(|name| names.unique(name)).into();
        assert_eq!(taken, ["rain", "rain_2", "rain_2_2", "rain_3", "self_", "self_2"]);
    }
}
