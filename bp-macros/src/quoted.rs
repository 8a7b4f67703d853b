//! The value of a string literal.
//!
//! In: a literal as it is written, with its quotes. Out: its text. Invariant: a literal that is not a plain or raw
//! string has none.

/// The text of `"…"`, `r"…"` or `r#"…"#`.
pub(crate) fn unquote(literal: &str) -> Option<String> {
    if let Some(raw) = literal.strip_prefix('r') {
        let inside = raw.trim_matches('#');
        return Some(inside.strip_prefix('"')?.strip_suffix('"')?.to_owned());
    }
    let inside = literal.strip_prefix('"')?.strip_suffix('"')?;
    let mut text = String::new();
    let mut rest = inside.chars();
    while let Some(letter) = rest.next() {
        if letter != '\\' {
            text.push(letter);
            continue;
        }
        match rest.next()? {
            'n' => text.push('\n'),
            'r' => text.push('\r'),
            't' => text.push('\t'),
            '0' => text.push('\0'),
            'x' => {
                let digits: String = rest.by_ref().take(2).collect();
                text.push(char::from(u8::from_str_radix(&digits, 16).ok()?));
            }
            'u' => {
                let digits: String = rest.by_ref().skip(1).take_while(|letter| *letter != '}').collect();
                text.push(char::from_u32(u32::from_str_radix(&digits.replace('_', ""), 16).ok()?)?);
            }
            // A backslash at the end of a line removes the line break and the blanks that follow.
            '\n' => rest = rest.as_str().trim_start().chars(),
            same => text.push(same),
        }
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::unquote;

    #[test]
    fn string_literals_have_the_values_of_the_compiler() {
        macro_rules! agree {
            ($($literal:literal)*) => { $( assert_eq!(unquote(stringify!($literal)).as_deref(), Some($literal)); )* };
        }
        agree!("" "models/cell.bp" "a \"b\" \\ \n\t\r\0 \'" "\x41\u{3b1}\u{1_F600}" r"a\b" r#"a "b" c"# "ρ");
        agree!(
            "two \
                lines"
        );
    }

    #[test]
    fn other_literals_are_not_strings() {
        for literal in ["1.0", "'a'", "b\"bytes\"", "c\"c\"", "\"a\"suffix"] {
            assert_eq!(unquote(literal), None, "{literal}");
        }
    }
}
