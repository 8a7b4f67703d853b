//! The messages that source text has.
//!
//! In: Rust files. Out: string literals, templates of messages, and the kinds of an error type with their texts. Invariant: a page
//! that is made of them has what the code has.

use std::path::Path;

/// What stands for a value in the template of a message.
pub(crate) const HOLE: char = '\u{fffc}';

/// The text of a format string, with a hole for each value.
pub(crate) fn template(literal: &str) -> String {
    let text = literal.replace("\\\"", "\"").replace("{{", "\u{1}").replace("}}", "\u{2}");
    let (mut shown, mut rest) = (String::new(), text.as_str());
    while let Some((before, after)) = rest.split_once('{') {
        shown.push_str(before);
        shown.push(HOLE);
        rest = after.split_once('}').map_or("", |(_, rest)| rest);
    }
    shown.push_str(rest);
    shown.replace('\u{1}', "{").replace('\u{2}', "}")
}

/// The string literals of a piece of code, lines that are continued joined.
pub(crate) fn literals(code: &str) -> Vec<String> {
    let (mut found, mut rest) = (Vec::new(), code);
    while let Some((_, after)) = rest.split_once('"') {
        let mut escaped = false;
        let end = after.find(|character| {
            let ends = character == '"' && !escaped;
            escaped = character == '\\' && !escaped;
            ends
        });
        let Some(end) = end else { break };
        let pieces: Vec<&str> = after[..end].split("\\\n").collect();
        let joined = pieces
            .iter()
            .enumerate()
            .map(|(place, piece)| if place > 0 { piece.trim_start() } else { piece });
        found.push(joined.collect());
        rest = &after[end + 1..];
    }
    found
}

/// The kinds of errors of a file, each with its explanation and its text; that of a kind which wraps other errors is empty.
pub(crate) fn kinds(file: &Path) -> Vec<(String, String, String)> {
    let source = std::fs::read_to_string(file).unwrap();
    let (_, list) = source.split_once("Error {\n    /// ").expect("an enumeration of errors");
    let list = &format!("\n    /// {list}");
    let list = list.split("\n}\n").next().unwrap();
    let parts: Vec<&str> = list.split("#[error(").collect();
    let found: Vec<_> = (parts.windows(2))
        .map(|pair| {
            let lines = pair[0].lines().rev().skip(1).take_while(|line| line.trim_start().starts_with("///"));
            let mut lines: Vec<&str> = lines.map(|line| line.trim().trim_start_matches("/// ")).collect();
            lines.reverse();
            assert!(!lines.is_empty(), "an error without an explanation");
            let words = literals(pair[1]).into_iter().next().map(|text| template(&text).replace(HOLE, "…"));
            let after = pair[1]
                .lines()
                .find(|line| line.starts_with("    ") && line.trim().starts_with(char::is_uppercase));
            let name: String =
                after.unwrap().trim().chars().take_while(|character| character.is_alphanumeric()).collect();
            (name, lines.join(" "), words.unwrap_or_default())
        })
        .collect();
    assert!(found.len() > 2, "{found:?}");
    found
}
